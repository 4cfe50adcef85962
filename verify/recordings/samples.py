"""Recorded flights: what positions at some instants prove about all times, given a bound on the speed.

Regions are *must*, *may* or *no* between samples as for a certificate (`sampled_timelines`), and the same judge decides: satisfied
whatever happened in between, violated whatever happened in between, or samples too sparse to tell.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from verify.data.errors import BadInput
from verify.data.mission import Mission, check_mission
from verify.logic.progression import OutOfBudget
from verify.logic.verdict import Verdict
from verify.model_checking.inclusion import DEFAULT_BUDGET
from verify.model_checking.refutation import every_behaviour_breaks
from verify.model_checking.timeline import InternalChange, Relations, Timeline
from verify.model_checking.word_claims import judge_formula, judged_as_one
from verify.motion.regions import relations
from verify.recordings.flight_log import load_flight_log
from verify.recordings.measurement import LARGEST, longest_gaps, require_error, require_speed, with_rounding
from verify.recordings.sampled_timelines import sampled_timeline

Floats = NDArray[np.float64]

MAX_SAMPLES = 2_000_000
_NO_RATE = "no rate that was tried would do, for at the edge of a region a robot may go in and out unseen"
FACTORS = (2, 4, 8, 16, 32, 64)
"""How much denser samples are tried, to say which rate would do."""


@dataclass(frozen=True, eq=False)
class _Track:
    """One robot's samples: times from 0 in s, shape (n,); positions in m, shape (n, 3); internal propositions, or None."""

    robot: str
    times: Floats
    positions: Floats
    internal: tuple[frozenset[str], ...] | None


# eight parameters: what was measured, what was asked, and how well it is known, each of that by its keyword
def check_samples(
    times: ArrayLike,
    positions: ArrayLike | Mapping[str, ArrayLike],
    mission: Mission,
    *,
    max_speed: float | None = None,
    error: float = 0.0,
    rounding: tuple[float, float] = (0.0, 0.0),
    internal: Mapping[str, Sequence[Iterable[str]]] | None = None,
    budget: int = DEFAULT_BUDGET,
) -> Verdict:
    """Decide whether a recorded flight satisfies its mission's formula, for all times and not only at the samples.

    Args:
        times: s, strictly increasing, the same for all robots. Shape (n,).
        positions: m. Shape (n, 3) for one robot, (n, robots, 3) in the mission's order, or one (n, 3) for each name.
        mission: Carries the formula and the regions; its trace must be finite.
        max_speed: Bound on every robot's speed at all times, m/s.
        error: Bound on the distance between measured and true position, m.
        rounding: How far a time (s) and a position (m) may be off for having been written with few digits; it is
            allowed for on top of the error.
        internal: For each robot its internal propositions at each sample; needed where the formula names them. No
            speed bounds them: between samples that agree they are taken as unchanged, between others as changed once.
        budget: Configurations that each part of the formula may take.

    Returns:
        "holds": satisfied, whatever happened between the samples. "fails": violated, whatever happened. "undecided":
        the samples are too sparse to tell; the sentence names a rate that would do, where one would.

    Raises:
        BadInput: No speed bound, samples further apart than it allows, or arrays that do not fit.
    """
    mission = check_mission(mission, to_plan=False)
    speed = require_speed(max_speed)
    require_error(error)
    if mission.spec.formula is None:
        raise BadInput(
            "The mission has no formula, so nothing would be checked; `check_flight` checks passages and all the rest."
        )
    if mission.spec.trace == "infinite":
        raise BadInput("A recorded flight ends; it cannot satisfy or break a formula over an infinite trace.")
    tracks = _tracks(times, positions, mission, internal)
    error = with_rounding(error, speed, rounding, np.asarray(times, dtype=np.float64), [track.positions for track in tracks])
    for track in tracks:
        _refuse_jumps(track, speed, error)
    related = relations(mission)
    verdict = _judged(tracks, mission, related, speed, error, budget)
    if verdict.outcome != "undecided":
        return verdict
    rate = _sufficient_rate(tracks, mission, related, speed, error, budget)
    if verdict.claim == "timing" and rate == _NO_RATE:
        return verdict
    return Verdict(
        "undecided",
        f"The samples are too sparse to tell whether the flight satisfies `{mission.spec.formula}`: {rate}. "
        f"What might have happened between them: {verdict.sentence}",
        verdict.counterexample,
        verdict.time,
        robot=verdict.robot,
        times=verdict.times,
    )


def check_recording(source: str | Path, mission: Mission, *, max_speed: float | None = None, error: float = 0.0) -> Verdict:
    """Hold a flight log in the form of `flight.csv` against a mission's formula: `check_samples` of what it holds.

    Args:
        source: The log.
        mission: Carries the formula and the regions.
        max_speed: Bound on the speed at all times, m/s.
        error: Bound on the distance between logged and true position, m.

    Raises:
        BadInput: The file is no such log, or does not fit the mission; and as `check_samples`.
        InternalError: Our progression and Spot disagree: a bug of ours.
        MissingEngine: Spot is absent.
    """
    log = load_flight_log(source, mission)
    return check_samples(
        log.times, log.positions, mission, max_speed=max_speed, error=error, rounding=log.rounding, internal=log.internal
    )


def _judged(tracks: Sequence[_Track], mission: Mission, related: Relations, speed: float, error: float, budget: int) -> Verdict:
    return judge_timelines(mission, {track.robot: _timeline(track, mission, speed, error) for track in tracks}, related, budget)


def judge_timelines(
    mission: Mission,
    timelines: Mapping[str, Timeline],
    related: Relations,
    budget: int = DEFAULT_BUDGET,
    *,
    late: Fraction = Fraction(0),
) -> Verdict:
    """Decide the formula on timelines that samples give: satisfied or violated whatever happened in between, or undecided.

    Args:
        mission: Carries the formula and the reading.
        timelines: One for each robot.
        related: What is proved of the regions at large.
        budget: Configurations that each part of the formula may take.
        late: By how much later than the timelines' 0 the flight may have begun, s: bounds in seconds count from there.

    Raises:
        BadInput: There is no timeline, or the mission's trace is infinite.
        InternalError: Our progression and Spot disagree, or the timelines contradict themselves.
        MissingEngine: Spot is absent.
    """
    apart = late if mission.timed_parts else Fraction(0)
    verdict, *timed = judge_formula(mission, timelines, related, clock_error=apart, budget=budget)
    if timed and not (worst := judged_as_one(timed)) and (verdict or worst.outcome == "fails"):
        start = "Violated, whatever happened between the samples. " if worst.outcome == "fails" else ""
        return replace(worst, sentence=f"{start}{worst.sentence}")
    formula = f"`{mission.spec.formula}`"
    if verdict.outcome == "holds":
        note = f" But {verdict.vacuous[0]}" if verdict.vacuous else ""
        return Verdict(
            "holds", f"Satisfied: {formula} holds at all times, not only at the samples.{note}", vacuous=verdict.vacuous
        )
    if verdict.outcome == "undecided":
        return verdict
    try:
        broken = every_behaviour_breaks(mission.formula, timelines, related, mission.spec.team, budget)
    except OutOfBudget:
        broken = False
    outcome = "fails" if broken else "undecided"
    sentence = f"Violated, whatever happened between the samples. {verdict.sentence}" if broken else verdict.sentence
    return Verdict(outcome, sentence, verdict.counterexample, verdict.time, robot=verdict.robot, times=verdict.times)


def _timeline(track: _Track, mission: Mission, speed: float, error: float) -> Timeline:
    plain = sampled_timeline(track.robot, track.times, track.positions, mission.all_regions, speed=speed, error=error)
    if track.internal is None:
        return plain
    actions = tuple(
        InternalChange(Fraction(float(start)), "", "", "", -1, after, Fraction(float(stop)))
        for start, stop, before, after in zip(
            track.times[:-1], track.times[1:], track.internal[:-1], track.internal[1:], strict=True
        )
        if before != after
    )
    return Timeline(track.robot, plain.initial, plain.changes, plain.duration, track.internal[0], actions)


def _sufficient_rate(
    tracks: Sequence[_Track], mission: Mission, related: Relations, speed: float, error: float, budget: int
) -> str:
    """Say at which rate samples of the same flight, straight between those that there are, would decide."""
    count = max(len(track.times) for track in tracks)
    span = max(float(track.times[-1]) for track in tracks)
    if count < 2 or span <= 0:
        return "one instant is no flight"
    for factor in FACTORS:
        if count * factor * len(tracks) > MAX_SAMPLES:
            break
        denser = [_denser(track, factor) for track in tracks]
        if _judged(denser, mission, related, speed, error, budget).outcome != "undecided":
            return f"about {math.ceil(factor * (count - 1) / span)} samples a second would do"
    return _NO_RATE


def _denser(track: _Track, factor: int) -> _Track:
    n = len(track.times)
    index = np.arange((n - 1) * factor + 1) / factor
    times = np.interp(index, np.arange(n), track.times)
    positions = np.stack([np.interp(index, np.arange(n), column) for column in track.positions.T], axis=1)
    internal = track.internal
    if internal is not None:
        internal = tuple(internal[math.ceil(i / factor)] for i in range((n - 1) * factor + 1))
    return _Track(track.robot, times, positions, internal)


def _tracks(
    times: ArrayLike,
    positions: ArrayLike | Mapping[str, ArrayLike],
    mission: Mission,
    internal: Mapping[str, Sequence[Iterable[str]]] | None,
) -> list[_Track]:
    at = _array(times, "times")
    if at.ndim != 1 or len(at) == 0:
        raise BadInput(f"times must have shape (n,) with at least one sample, not {at.shape}.")
    if np.any(np.diff(at) <= 0) or np.any(np.diff(at - at[0]) <= 0):
        where = int(np.argmax((np.diff(at) <= 0) | (np.diff(at - at[0]) <= 0)))
        raise BadInput(
            f"times must increase, and by more than floats lose; times[{where + 1}] = {at[where + 1]} follows {at[where]}."
        )
    names = tuple(mission.agents)
    if isinstance(positions, Mapping):
        if set(positions) != set(names):
            raise BadInput(f"positions name {', '.join(map(str, positions))}; the mission has {', '.join(names)}.")
        tables = {name: _array(positions[name], f"positions of {name}") for name in names}
    else:
        table = _array(positions, "positions")
        if table.ndim == 2 and len(names) == 1:
            table = table[:, None, :]
        if table.ndim != 3 or table.shape[1] != len(names):
            raise BadInput(f"positions must have shape (n, {len(names)}, 3) for {len(names)} robots, not {table.shape}.")
        tables = {name: table[:, i] for i, name in enumerate(names)}
    for name, table in tables.items():
        if table.shape != (len(at), 3):
            raise BadInput(f"positions of {name} must have shape ({len(at)}, 3) for {len(at)} times, not {table.shape}.")
    if len(at) * len(names) > MAX_SAMPLES:
        raise BadInput(f"{len(at)} samples of {len(names)} robots are too many; {MAX_SAMPLES} in all is the most.")
    inner = _internal(internal, mission, len(at))
    return [_Track(name, at - at[0], tables[name], None if inner is None else inner[name]) for name in names]


def _internal(
    internal: Mapping[str, Sequence[Iterable[str]]] | None, mission: Mission, count: int
) -> dict[str, tuple[frozenset[str], ...]] | None:
    known = mission.internal_propositions
    needed = sorted(known & mission.formula.names())
    if internal is None:
        if needed:
            raise BadInput(
                f"The formula names the internal proposition '{needed[0]}', which positions do not show: give `internal`."
            )
        return None
    result: dict[str, tuple[frozenset[str], ...]] = {}
    for name in mission.agents:
        if name not in internal or len(internal[name]) != count:
            raise BadInput(f"internal must have {count} sets of names for {name}, one a sample.")
        result[name] = tuple(frozenset(letter) & known for letter in internal[name])
    return result


def _array(values: ArrayLike, name: str) -> Floats:
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as problem:
        raise BadInput(f"{name} must be an array of numbers: {problem}.") from None
    if not np.all(np.isfinite(array)):
        raise BadInput(f"{name} must be finite; a number is NaN or infinite.")
    if not np.all(np.abs(array) <= LARGEST):
        raise BadInput(f"{name} must lie within {LARGEST:g}; that is no flight.")
    return array


def _refuse_jumps(track: _Track, speed: float, error: float) -> None:
    step = np.linalg.norm(np.diff(track.positions, axis=0), axis=1)
    allowed = (speed * longest_gaps(track.times) + 2 * error) * (1 + 1e-9)
    if np.any(step > allowed):
        k = int(np.argmax(step > allowed))
        digits = next((n for n in range(4, 17) if f"{step[k]:.{n}g}" != f"{allowed[k]:.{n}g}"), 17)
        raise BadInput(
            f"{track.robot}'s samples {k} and {k + 1} are {step[k]:.{digits}g} m apart, "
            f"{track.times[k + 1] - track.times[k]:.{digits}g} s one after the other; at most {speed:g} m/s and {error:g} m "
            f"of error allow {allowed[k]:.{digits}g} m. Positions or times that were written with few digits need an error."
        )
