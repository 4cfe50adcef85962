"""Valid files and what they mean: recordings, trajectories, plans, missions and certificates, for hypothesis."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from hypothesis import strategies as st

from tests.helpers.motion.flights import small_mission
from tests.strategies import finite_words
from verify.certificate import CERTIFICATE_FORMAT, payload_digest
from verify.data import Mission, Plan, Trajectory
from verify.data.plan import RobotPlan, Visit, Waypoint

ROBOTS = ("r0", "R0", "r0_pos")


@dataclass(frozen=True)
class Recorded:
    """A table's text, and what it says: times since the first in s, positions in m (None: not seen), all exact."""

    text: str
    robots: tuple[str, ...]
    times: list[Fraction]
    positions: dict[str, list[tuple[Fraction, ...] | None]]


@st.composite
def recordings(draw: st.DrawFn) -> Recorded:
    """Long and wide tables of one to three robots, with every unit and many digits."""
    robots = draw(st.lists(st.sampled_from(ROBOTS), min_size=1, max_size=3, unique=True))
    clock, power = draw(st.sampled_from([("t", 0), ("Time (s)", 0), ("time_ms", -3), ("timestamp_us", -6), ("time_ns", -9)]))
    unit, shift = draw(st.sampled_from([("", 0), ("_mm", -3), (" [m]", 0)]))
    places = draw(st.integers(0, 9)) if power == 0 else 0
    begin = draw(st.sampled_from([0, 12, 1_767_225_600])) * 10 ** (places - power)
    steps = draw(st.lists(st.integers(1, 10 ** (places - power)), min_size=1, max_size=6))
    counts = [begin + draw(st.integers(0, 999))]
    for step in steps:
        counts.append(counts[-1] + step)
    decimals = draw(st.integers(0, 6))
    wide = draw(st.booleans())
    rows: list[str] = []
    positions: dict[str, list[tuple[Fraction, ...] | None]] = {robot: [] for robot in robots}
    for index, count in enumerate(counts):
        time = _decimal(count, places)
        cells = [time]
        for robot in robots:
            seen = index == 0 or draw(st.booleans())
            whole = [draw(st.integers(-(10**7), 10**7)) for _ in range(3)] if seen else None
            positions[robot].append(
                None if whole is None else tuple(Fraction(w, 10**decimals) * Fraction(10) ** shift for w in whole)
            )
            values = [""] * 3 if whole is None else [_decimal(w, decimals) for w in whole]
            if wide:
                cells += values
            elif seen or len(robots) == 1 or draw(st.booleans()):
                rows.append(",".join([time, robot, *values]))
        if wide:
            rows.append(",".join(cells))
    head = [f"{robot}{draw(st.sampled_from('. /:'))}{axis}{unit}" for robot in robots for axis in "xyz"]
    header = [clock, *head] if wide else [clock, "robot", *(f"{axis}{unit}" for axis in "xyz")]
    if not wide:  # instants at which nobody stands in the table are no samples
        kept = [i for i, count in enumerate(counts) if any(row.split(",")[0] == _decimal(count, places) for row in rows)]
        counts = [counts[i] for i in kept]
        positions = {robot: [found[i] for i in kept] for robot, found in positions.items()}
    tick = Fraction(10) ** (power - places)
    return Recorded(
        "\n".join([",".join(header), *rows, ""]), tuple(robots), [(c - counts[0]) * tick for c in counts], positions
    )


def _decimal(whole: int, places: int) -> str:
    digits = f"{abs(whole):0{places + 1}d}"
    sign = "-" if whole < 0 else ""
    return sign + (f"{digits[:-places]}.{digits[-places:]}" if places else digits)


def trajectories(most: int = 4) -> st.SearchStrategy[Trajectory]:
    """Any float32 numbers as pieces."""
    number = st.floats(width=32, allow_nan=False, allow_infinity=False)
    duration = st.floats(min_value=2.0**-20, max_value=1000, width=32)
    return st.lists(st.tuples(duration, st.lists(number, min_size=32, max_size=32)), min_size=1, max_size=most).map(
        lambda pieces: Trajectory([p[0] for p in pieces], np.array([p[1] for p in pieces]).reshape(-1, 4, 8))
    )


@st.composite
def missions(draw: st.DrawFn) -> Mission:
    """Small missions with one or two regions and robots."""
    radius = draw(st.floats(0.1, 0.3))
    regions = f"a: {{center: [1.0, 0.0, 1.0], radii: [{radius!r}, 0.2, 0.2], yaw_deg: {draw(st.integers(-90, 90))}}}"
    if draw(st.booleans()):
        regions += "\nb: {center: [-1.0, 0.5, 1.0], radii: [0.2, 0.2, 0.2]}"
    starts = ((0.0, 0.0, 1.0), (0.0, 1.5, 1.0))[: draw(st.integers(1, 2))]
    return small_mission(draw(st.sampled_from(["F a", "G !a", "F a & F G !a", "a | F a"])), regions=regions, starts=starts)


@st.composite
def plans(draw: st.DrawFn) -> Plan:
    """Plans with any words, visits and waypoints."""
    mission = draw(missions())
    names = st.sampled_from(sorted(mission.all_regions))
    coordinate = st.floats(-1e6, 1e6)
    robots = {}
    for name, agent in mission.agents.items():
        visits = draw(st.lists(st.builds(Visit, region=names), max_size=3))
        points = [agent.start, *draw(st.lists(st.tuples(coordinate, coordinate, coordinate), max_size=3))]
        robots[name] = RobotPlan(
            word=draw(finite_words()),
            visits=tuple(visits),
            waypoints=tuple(Waypoint(position=p, role="via" if i else "start") for i, p in enumerate(points)),
            times=tuple(map(float, range(len(points)))),
            cost=draw(coordinate),
        )
    return Plan(mission=mission, robots=robots, notes=tuple(draw(st.lists(st.text(max_size=20), max_size=2))))


@st.composite
def certificates(draw: st.DrawFn) -> dict[str, Any]:
    """What certificate.json may hold, of the right shape and proved of nothing."""
    number = st.floats(0, 1e300)
    body = {
        "format": CERTIFICATE_FORMAT,
        "mission": draw(st.text(max_size=64)),
        "plan": draw(st.text(max_size=64)),
        "trajectories": {
            name: {"digest": draw(st.text(max_size=8)), "cycle": draw(st.none() | st.integers(0, 9))} for name in ROBOTS
        },
        "margin": draw(number),
        "largest_margin": draw(st.none() | number),
        "clock_error": draw(number),
        "duration": draw(number),
        "claims": draw(st.lists(st.dictionaries(st.text(max_size=5), st.none() | number | st.text(max_size=9)), max_size=3)),
        "actions": [],
        "versions": draw(st.dictionaries(st.text(max_size=5), st.text(max_size=5), max_size=3)),
    }
    return {**body, "digest": payload_digest(body)}
