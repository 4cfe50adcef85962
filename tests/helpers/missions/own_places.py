"""Missions of robots of which each may enter some regions only: who must do what is then known."""

from __future__ import annotations

from collections.abc import Mapping

from tests.helpers.missions.worlds import PLACES, STARTS
from verify.data import Mission, parse_mission


def own_places(
    formula: str,
    may_enter: Mapping[str, str],
    *,
    team: str = "own",
    starts: tuple[tuple[float, float], ...] = STARTS,
    extra: str = "",
) -> Mission:
    """Return a mission in a plane, flown at nominal pace unless `extra` has a planner.

    Args:
        formula: Over a, b, c, d.
        may_enter: For each robot the regions that it may enter, in one string.
        team: How it is read.
        starts: Where robots start, x and y in m.
        extra: YAML for further keys.
    """
    used = [place for place in PLACES if any(place in places for places in may_enter.values())]
    lines = ["format: 1", "name: own-places", "regions:"]
    for place in used:
        kinds = [f"k{i}" for i, places in enumerate(may_enter.values()) if place in places]
        x, y = PLACES[place]
        lines.append(f"  {place}: {{center: [{x}, {y}, 1.0], radii: [0.2, 0.2, 0.2], only: [{', '.join(kinds)}]}}")
    lines += ["robots:", *(f"  k{i}: {{initial: idle, states: {{idle: []}}}}" for i in range(len(may_enter))), "agents:"]
    for i, (name, (x, y)) in enumerate(zip(may_enter, starts, strict=False)):
        lines.append(f"  {name}: {{start: [{x}, {y}, 1.0], robot: k{i}}}")
    lines += [
        "vehicle: crazyflie-2.1",
        "workspace: {min: [-20, -20, 0.2], max: [20, 20, 3]}",
        f"spec: {{formula: '{formula}', team: {team}}}",
        extra if "planner:" in extra else f"planner: {{pace: nominal}}\n{extra}",
    ]
    return parse_mission("\n".join(lines))
