"""The charts over time: labels and sub-formulas as bars, tracking error, rotor thrusts and shares of limits as lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from flight.figures import Figure
from flight.pictures import MANY, robot_colour
from flight.shapes import Floats
from ltlplan.report.bars import Bar, bars_html
from ltlplan.report.history.bounds import timed_bars, timed_truth
from ltlplan.report.history.letters import LetterInterval, ReadLetter, truth_intervals
from ltlplan.report.over_time import MARK, Line, over_time, stacked
from verify.data import GRAVITY

if TYPE_CHECKING:
    from ltlplan.result import Result
    from verify import Certificate
    from verify.data import Mission, Trajectory

WORST = 10
"""Robots that a chart of very many draws by themselves."""

_STEP = 0.05
"""s between samples of shares of limits, of flights that are not so long that fewer must do."""
_SAMPLES = 1000

_INTERNAL = "#6b7280"
_TRUE = "#2f8d57"


def label_chart(
    certificate: Certificate, letters: Mapping[str, Sequence[LetterInterval]], end: float, cycle: float | None
) -> str:
    """Draw regions by robot: what must be and what may be, from the certificate's timelines.

    Args:
        certificate: Gives the timelines; of a cycle it holds one lap, which is drawn as often as it is flown.
        letters: Each robot's sampled letters, for its internal propositions.
        end: s, when the drawn flight ends.
        cycle: s, when the cycle begins, where there is one.
    """
    bars: list[Bar] = []
    rows: list[str] = []
    regions = certificate.mission.all_regions
    for index, (robot, timeline) in enumerate(certificate.timelines.items()):
        for region, initial in timeline.initial.items():
            changes = [(0.0, initial), *((float(c.time.low), c.status) for c in timeline.changes if c.region == region)]
            spans = [
                (a, b, status)
                for (a, status), (b, _) in zip(changes, [*changes[1:], (float(timeline.duration), "no")], strict=True)
            ]
            row = f"{robot} {region}"
            if any(status != "no" for _, _, status in spans):
                rows.append(row)
            for start, stop, status in _laps(spans, float(timeline.duration), end, cycle):
                if status != "no":
                    colour = robot_colour(index) + ("" if status == "must" else "66")
                    bars.append(Bar(row, start, stop, colour, f"{robot} {status} be in {region}"))
        held = [(interval, interval.letter - set(regions)) for interval in letters[robot] if interval.letter - set(regions)]
        for name in sorted(frozenset[str]().union(*(names for _, names in held))):
            row = f"{robot} {name}"
            rows.append(row)
            bars += [
                Bar(row, interval.start, interval.end, _INTERNAL, f"{robot}: {name}")
                for interval, names in held
                if name in names
            ]
    timed_rows, timed = timed_bars(certificate, end)
    rows, bars = [*rows, *timed_rows], [*bars, *timed]
    return bars_html(
        "labels",
        bars,
        rows,
        end,
        "Chart: which region each robot must be in and may be in, and what is bounded in seconds, over time.",
    )


def _laps(
    spans: Sequence[tuple[float, float, str]], duration: float, end: float, cycle: float | None
) -> list[tuple[float, float, str]]:
    """Repeat the part from `cycle` on until `end`; all in s."""
    repeated = list(spans)
    lap = duration - cycle if cycle is not None else 0.0
    shift = lap
    while lap > 0.0 and duration + shift < end + lap / 2:
        repeated += [(max(a, cycle or 0.0) + shift, b + shift, status) for a, b, status in spans if b > (cycle or 0.0)]
        shift += lap
    return repeated


def shown_chart(mission: Mission, letters: Mapping[str, Sequence[LetterInterval]], end: float) -> str:
    """Draw what each robot showed: regions and propositions of its internal states, as they were seen.

    Args:
        mission: Gives the regions.
        letters: Each robot's letters over time.
        end: s, when the drawn flight ends.
    """
    bars: list[Bar] = []
    rows: list[str] = []
    for index, (robot, mine) in enumerate(letters.items()):
        seen = frozenset[str]().union(*(interval.letter for interval in mine))
        for name in (*(region for region in mission.all_regions if region in seen), *sorted(seen - set(mission.all_regions))):
            rows.append(f"{robot} {name}")
            colour = robot_colour(index) if name in mission.all_regions else _INTERNAL
            bars += [
                Bar(rows[-1], interval.start, interval.end, colour, f"{robot}: {name}")
                for interval in mine
                if name in interval.letter
            ]
    return bars_html("labels", bars, rows, end, "Chart: which region each robot was seen in, over time.")


def truth_chart(
    mission: Mission,
    letters: Mapping[str, Sequence[LetterInterval]],
    readings: list[ReadLetter],
    end: float,
    cycle: float | None,
) -> str:
    """Draw when each sub-formula holds, on the readings of the team; bounds in seconds count but in laps.

    Args:
        mission: Whose formula.
        letters: Each robot's letters over time.
        readings: The team word, in order of time.
        end: s, when the drawn flight ends.
        cycle: s, when the cycle begins, where there is one.
    """
    if mission.timed_parts and cycle is None:
        truth = timed_truth(mission.bounded, letters, end)
    else:
        truth = truth_intervals(mission.formula, readings, end, cycle)
    bars = [
        Bar(name, interval.start, interval.end, _TRUE, f"{name} holds") for name, mine in truth.items() for interval in mine
    ]
    return bars_html("truth", bars, list(truth), end, "Chart: when each sub-formula holds, over time.")


def error_chart(result: Result) -> Figure:
    """Draw each robot's distance from its certified path, against the margin; of very many those that went farthest, and the farthest of all."""
    times, errors, names = result.log.times, 1000 * result.log.error, result.log.robots
    shown = _worst(np.fmax.reduce(errors))
    lines = {names[i]: Line(times, errors[:, i], robot_colour(i)) for i in shown}
    if len(shown) < len(names):
        lines[f"farthest of {len(names)}"] = Line(times, np.fmax.reduce(errors, axis=1), MARK)
    margin = 1000 * result.certificate.margin
    return over_time(lines, "error (mm)", {f"margin {margin:g} mm": margin})


def rotor_chart(result: Result, rotors: Floats) -> Figure:
    """Draw each robot's greatest and least rotor, against its vehicle's limits; of very many those that push hardest, and the extremes of all.

    Args:
        result: Gives the limits and the times.
        rotors: N. Shape (samples, robots, 4).
    """
    own = {name: result.mission.limits_of(name) for name in result.log.robots}
    lines: dict[str, Line] = {}
    shown = _worst(np.max(rotors, axis=(0, 2)))
    for index in shown:
        name = result.log.robots[index]
        greatest, least = np.max(rotors[:, index], axis=1), np.min(rotors[:, index], axis=1)
        lines[f"{name} greatest"] = Line(result.log.times, greatest, robot_colour(index), group=name)
        lines[f"{name} least"] = Line(result.log.times, least, robot_colour(index), "dot", group=name, least=True)
    if len(shown) < len(own):
        group = f"extremes of {len(own)}"
        lines["greatest of all"] = Line(result.log.times, np.max(rotors, axis=(1, 2)), MARK, group=group)
        lines["least of all"] = Line(result.log.times, np.min(rotors, axis=(1, 2)), MARK, "dot", group=group, least=True)
    kinds: dict[tuple[str, float], dict[str, None]] = {}
    for name, limits in own.items():
        for word, value in (("most", limits.rotor_thrust_max), ("least", limits.rotor_thrust_min)):
            kinds.setdefault((word, value), {})[result.mission.vehicle_of(name).name] = None
    whose = {limit: "" if result.mission.of_one_kind else f", {' and '.join(names)}" for limit, names in kinds.items()}
    marks = {f"{word}: {value:g} N{whose[word, value]}": value for word, value in kinds}
    return over_time(lines, "thrust of one rotor (N)", marks)


def limit_chart(result: Result) -> Figure:
    """Draw which share of their limits each robot's speed, acceleration and thrust take; of very many those that take most, and the most of all."""
    mission = result.mission
    flown = {name: path.flattened(mission.spec.repeat) for name, path in result.team.items()}
    names, end = list(flown), max(path.duration for path in flown.values())
    times = np.linspace(0.0, end, min(_SAMPLES, max(2, int(np.ceil(end / _STEP)) + 1)))
    shares = np.stack([_shares(mission, name, path, times) for name, path in flown.items()])
    shown = _worst(shares.max(axis=(1, 2)))
    panels: dict[str, dict[str, Line]] = {}
    for quantity, title in enumerate(("speed", "acceleration", "thrust")):
        lines = {names[i]: Line(times, shares[i, quantity], robot_colour(i)) for i in shown}
        if len(shown) < len(names):
            lines[f"most of {len(names)}"] = Line(times, shares[:, quantity].max(axis=0), MARK)
        panels[title] = lines
    return stacked(panels, 1.0, "limit")


def _shares(mission: Mission, name: str, path: Trajectory, times: Floats) -> Floats:
    """Return a robot's speed, acceleration and collective thrust over their limits; hovering takes its share of thrust. Shape (3, times)."""
    limits, mass = mission.limits_of(name), mission.vehicle_of(name).mass
    velocity, acceleration = (path.evaluate(times, order)[:, :3] for order in (1, 2))
    thrust = mass * np.linalg.norm(acceleration + np.array([0.0, 0.0, GRAVITY]), axis=1)
    speed, bent = np.linalg.norm(velocity, axis=1), np.linalg.norm(acceleration, axis=1)
    return np.stack([speed / limits.speed, bent / limits.acceleration, thrust / limits.thrust_max])


def _worst(values: Floats) -> list[int]:
    """Return the places of the robots that a chart draws: all of a few, of very many those with the greatest values."""
    if len(values) <= MANY:
        return list(range(len(values)))
    return sorted(np.argsort(-values, kind="stable")[:WORST].tolist())
