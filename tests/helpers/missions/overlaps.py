"""Missions over regions that overlap or lie in each other, and a reading of flights that shares nothing with ours: samples, then Spot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tests.helpers.words.spot_reading import spot_accepts
from verify.data import Letter, Mission, Trajectory, Word, parse_mission

Ball = tuple[tuple[float, float, float], float]

PAIR: dict[str, Ball] = {
    "a": ((0, 0, 1.2), 0.3),
    "b": ((0.4, 0, 1.2), 0.3),
    "c": ((1.5, 0, 1.2), 0.3),
    "d": ((-1.5, 0, 1.2), 0.3),
}
"""a and b overlap; c lies behind b, d behind a."""
NEST: dict[str, Ball] = {
    "room": ((0, 0, 1.2), 0.9), "desk": ((0.35, 0, 1.2), 0.25), "c": ((2, 0, 1.2), 0.3), "d": ((-2, 0, 1.2), 0.3),
}  # fmt: skip
"""desk lies in room."""
THREE: dict[str, Ball] = {
    "a": ((0, 0, 1.2), 0.5), "b": ((0.5, 0, 1.2), 0.5), "e": ((0.25, 0.4, 1.2), 0.45), "c": ((2, 0, 1.2), 0.3), "d": ((-2, 0, 1.2), 0.3),
}  # fmt: skip
"""a, b and e have points in common."""

CASES: dict[str, tuple[dict[str, Ball], tuple[float, float, float], str, str]] = {
    "into the pair": (PAIR, (-0.8, 0, 1.2), "F (a & b)", "{} {a} {a, b} {b}"),
    "out of two, as they lie": (PAIR, (0.2, 0, 1.2), "F c & (a U (b & !a))", "{a, b} {b} {} {c}"),
    "out of two, the other way about": (PAIR, (0.2, 0, 1.2), "F c & (b U (a & !b))", "{a, b} {a} {a, b} {b} {} {c}"),
    "out of two, to the far side": (PAIR, (0.2, 0, 1.2), "F d & (a U (b & !a))", "{a, b} {b} {} {d}"),
    "into a region in another": (NEST, (-1.4, 0, 1.2), "F desk", "{} {room} {desk, room}"),
    "out of a region in another": (NEST, (0.35, 0, 1.2), "F c & F d", "{desk, room} {room} {} {c} {} {d}"),
    "through a region in another": (NEST, (-1.2, -1, 1.2), "F c & (!c U desk)", "{} {room} {desk, room} {room} {} {c}"),
    "in the outer one": (NEST, (-0.5, 0, 1.2), "F c", "{room} {} {c}"),
    "out of three": (THREE, (0.25, 0.2, 1.2), "F c", "{a, b, e} {b, e} {b} {} {c}"),
    "out of three, one last": (THREE, (0.25, 0.2, 1.2), "F (b & !a & !e)", "{a, b, e} {b, e} {b} {} {c}"),
}
"""Regions, a start (m), a formula, and the exact search's word."""


def overlapping(
    formula: str,
    *starts: tuple[float, float, float],
    regions: Mapping[str, Ball] = PAIR,
    method: str = "exact",
    team: str = "own",
    extra: str = "",
) -> Mission:
    """Return a mission over round regions; `extra` is YAML for further keys."""
    places = "\n".join(f"  {n}: {{center: {list(p)}, radii: [{r}, {r}, {r}]}}" for n, (p, r) in regions.items())
    agents = ", ".join(f"quad{i}: {{start: {list(start)}}}" for i, start in enumerate(starts))
    return parse_mission(f"""
format: 1
name: overlap
spec: {{formula: "{formula}", team: {team}}}
regions:
{places}
agents: {{{agents}}}
vehicle: crazyflie-2.1
workspace: {{min: [-4, -4, 0.2], max: [4, 4, 2.6]}}
planner: {{method: {method}, samples: 20, elite: 0.1, iterations: 3}}
{extra}
""")


def mission_of(case: str, method: str = "exact") -> Mission:
    """Return one of the missions of one robot."""
    regions, start, formula, _ = CASES[case]
    return overlapping(formula, start, regions=regions, method=method)


def sampled_word(
    mission: Mission, path: Trajectory, actions: Sequence[tuple[float, str]] = (), state: str | None = None
) -> Word:
    """Return the letters of dense samples of a flight: each region by its centre and radii.

    Args:
        mission: Its regions are balls.
        path: What is flown.
        actions: Instants of changes of the internal state (s), and the state after each.
        state: The internal state at first; None: the mission's.
    """
    times = np.arange(0.0, path.duration, 0.002)
    points = path.evaluate(times)[:, :3]
    held = {n: np.linalg.norm(points - np.array(r.center), axis=1) <= r.semi_axes[0] for n, r in mission.all_regions.items()}
    letters: list[Letter] = []
    for k, time in enumerate(times):
        now = next((after for at, after in reversed(actions) if at <= time), state or mission.robot.initial)
        letter = frozenset(n for n in held if held[n][k]) | frozenset(mission.robot.states[now])
        if letter != (letters[-1] if letters else None):
            letters.append(letter)
    return Word(tuple(letters))


def holds_when_sampled(mission: Mission, team: Mapping[str, Trajectory]) -> bool:
    """Tell whether Spot accepts what dense samples of each robot show, one robot after another in the mission's order and back."""
    words = [sampled_word(mission, team[name]).prefix for name in mission.agents]
    orders = (words, words[::-1])
    return all(spot_accepts(mission.formula, Word(tuple(x for word in order for x in word))) for order in orders)
