"""Recorded flights, checked claim by claim: everything that a certificate says of paths, of positions that something measured.

A recording holds positions at some instants. With a bound on every robot's speed and on the measurement's error, the places
where a robot can have been at all other instants are known (`tracks`), and each claim is decided on all of them: it holds
whatever happened, it is broken whatever happened, or the samples cannot tell. A flight is satisfied where every claim holds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from verify.claims.claim import Claim, Outcome
from verify.data.errors import BadInput
from verify.model_checking.inclusion import DEFAULT_BUDGET
from verify.recordings.alignment import Alignment
from verify.recordings.flight_log import Samples
from verify.recordings.flight_reference import FlightReference
from verify.recordings.geometric_claims import TELLS
from verify.recordings.measurement import LARGEST, require_error, require_speed, with_rounding
from verify.recordings.reachable_sets import Bounds
from verify.recordings.recorded_flight import RecordedFlight
from verify.recordings.samples import MAX_SAMPLES


@dataclass(frozen=True, eq=False)
class FlightVerdict:
    """Verdict on a recorded flight, claim by claim.

    Attributes:
        claims: Every claim, compared with the recording.
        assumptions: What the verdict rests on, a sentence each.
        alignment: When the flight began on the recording's clock.
        premise: What a formula of laps for ever takes for granted of what comes after the recording; empty where there is none.
    """

    claims: tuple[Claim, ...]
    assumptions: tuple[str, ...]
    alignment: Alignment
    premise: str = ""

    @property
    def outcome(self) -> Outcome:
        """Satisfied where every claim holds, broken where one is, otherwise undecided."""
        outcomes = {claim.outcome for claim in self.claims}
        return "fails" if "fails" in outcomes else "undecided" if "undecided" in outcomes or not outcomes else "holds"

    @property
    def sentence(self) -> str:
        """The verdict for a person, with the first claim that does not hold."""
        if self.outcome == "holds":
            all_hold = f"Satisfied: all {len(self.claims)} claims hold at all times, not only at the samples."
            return f"{all_hold} {self.premise}".rstrip()
        worst = [claim for claim in self.claims if claim.outcome == self.outcome]
        more = f" And {len(worst) - 1} more." if len(worst) > 1 else ""
        start = "Violated, whatever happened between the samples" if self.outcome == "fails" else "The samples cannot tell"
        return f"{start} ({worst[0].name}). {worst[0].sentence}{more}"

    def __bool__(self) -> bool:
        return self.outcome == "holds"

    def to_dict(self) -> dict[str, Any]:  # of any type: JSON nests
        """Return the verdict as plain data for JSON."""
        return {
            "outcome": self.outcome,
            "sentence": self.sentence,
            "claims": [_claim_data(claim) for claim in self.claims],
            "assumptions": list(self.assumptions),
            "start": {
                "low": self.alignment.low,
                "high": self.alignment.high,
                "fitted": self.alignment.fitted,
                "trusted": self.alignment.trusted,
            },
        }


# seven parameters: what was measured, what was asked, and how well it is known, each of that by its keyword
def check_flight(
    samples: Samples,
    asked: FlightReference,
    *,
    max_speed: float | None = None,
    max_acceleration: float | None = None,
    error: float = 0.0,
    start: float | tuple[float, float] | None = None,
    budget: int = DEFAULT_BUDGET,
) -> FlightVerdict:
    """Check a recorded flight against everything that is claimed of paths.

    Args:
        samples: What was measured.
        asked: Mission, plan and trajectories.
        max_speed: Bound on every robot's speed at all times, m/s.
        max_acceleration: Bound on every robot's acceleration at all times, m/s^2, where one is known.
        error: Bound on the distance between measured and true position, m.
        start: When the flight began on the recording's clock, s, or from when to when it may have begun; None fits one start for the
            whole team to the plan, and without a plan takes the first sample.
        budget: Configurations that each part of the formula may take.

    Raises:
        BadInput: No speed bound, samples further apart than it allows, arrays that do not fit, or a formula that names internal
            propositions which neither the recording nor a plan shows.
    """
    for value, kind in ((samples, Samples), (asked, FlightReference)):
        if not isinstance(value, kind):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
            raise BadInput(
                f"Give {kind.__name__}, not {type(value).__name__}: see `verify.load_flight_log` and `verify.load_reference`."
            )
    samples, asked = samples.checked(), asked.checked()
    speed = require_speed(max_speed)
    require_error(error)
    if max_acceleration is not None and not (_is_number(max_acceleration) and 0 < max_acceleration <= LARGEST):
        raise BadInput(f"max_acceleration must be above 0 m/s^2, not {str(max_acceleration)[:40]}.")
    begins = _begins(start)
    _require_fit(samples, asked)
    if asked.changes:
        samples, begins = _on_the_changes_clock(samples, begins)
    whole = with_rounding(float(error), speed, samples.rounding, samples.times, samples.positions.values())
    bounds = Bounds(speed, whole, np.inf if max_acceleration is None else float(max_acceleration))
    flown = RecordedFlight(samples, asked, bounds, begins, budget)
    return FlightVerdict(flown.claims(), tuple(flown.assumptions()), flown.alignment, flown.premise)


def _on_the_changes_clock(samples: Samples, begins: tuple[float, float] | None) -> tuple[Samples, tuple[float, float]]:
    """Return a recording of a flight in which the world changed with one start: how far that may be off goes to its times.

    What changed did so at times of the flight, not of the recording. Where a start is off by s, so is every time, and what was measured
    then; so that all of it may be checked as if the start were known.
    """
    if begins is None:
        raise BadInput(
            "The world changed in flight, or robots left or joined, at times that count from the flight's start, which is not known "
            "on the recording's clock: give start (--start), in s."
        )
    middle, half = begins[0] / 2 + begins[1] / 2, (begins[1] - begins[0]) / 2 * (1 + 1e-12)
    late, off = samples.rounding
    return replace(samples, rounding=(late + half, off)), (middle, middle)


def _begins(start: float | tuple[float, float] | None) -> tuple[float, float] | None:
    """Return from when to when a flight may have begun, as was told."""
    if start is None:
        return None
    ends = start if isinstance(start, tuple) else (start, start)
    if len(ends) != 2 or not all(_is_number(end) and abs(end) <= LARGEST for end in ends) or ends[0] > ends[1]:
        raise BadInput(
            f"start must be a time of the recording, in s, or the earliest and the latest one, not {str(start)[:40]}."
        )
    return float(ends[0]), float(ends[1])


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _require_fit(samples: Samples, asked: FlightReference) -> None:
    times, agents = samples.times, asked.mission.agents
    if times.ndim != 1 or len(times) == 0 or not np.all(np.abs(times) <= LARGEST) or np.any(np.diff(times) <= 0):
        raise BadInput("times must be finite and increase, with at least one sample.")
    if set(samples.positions) != set(agents):
        raise BadInput(f"The recording has robots {', '.join(samples.positions)}; the mission has {', '.join(agents)}.")
    for robot, places in samples.positions.items():
        if places.shape != (len(times), 3) or np.any(np.abs(places) > LARGEST):
            raise BadInput(f"positions of {robot} must be finite, of shape ({len(times)}, 3), not {places.shape}.")
    seen = sum(int(np.count_nonzero(~np.isnan(places[:, 0]))) for places in samples.positions.values())
    if seen > MAX_SAMPLES:
        raise BadInput(f"{seen} samples of {len(agents)} robots are too many; {MAX_SAMPLES} in all is the most.")
    named = sorted(asked.mission.internal_propositions & asked.mission.formula.names())
    if named and samples.internal is None and asked.team is None:
        raise BadInput(
            f"The formula names the internal proposition '{named[0]}', which positions do not show: give `internal`, or a run's "
            "folder with its plan and certificate."
        )
    if samples.covers is not None and not (len(samples.covers) == 2 and all(abs(end) <= LARGEST for end in samples.covers)):
        raise BadInput(f"covers must be two finite times in s, not {samples.covers!s:.60}.")
    if samples.internal is not None:
        for robot in agents:
            if len(samples.internal.get(robot, ())) != len(times):
                raise BadInput(f"internal must have {len(times)} sets of names for {robot}, one a sample.")


def _claim_data(claim: Claim) -> dict[str, Any]:
    witness = claim.witness
    return {
        "name": claim.name,
        "outcome": claim.outcome,
        "says": TELLS[claim.outcome],
        "sentence": claim.sentence,
        "robot": claim.robot,
        "other": claim.other,
        "region": None if witness is None else witness.region,
        "visit": None if witness is None else witness.visit,
        "time": claim.time,
        "bound": claim.bound if claim.bound is None or np.isfinite(claim.bound) else None,
        "limit": claim.limit,
        "unit": claim.unit,
        "word": [] if witness is None else [[robot, sorted(letter)] for robot, letter in witness.word],
    }
