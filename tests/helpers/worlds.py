"""Small missions for the planner's tests: round regions far apart, unless a test says otherwise."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Mapping

from verify.data import Mission, parse_mission

PLACES = {"a": (0.0, 0.0), "b": (2.0, 0.0), "c": (2.0, 1.5), "d": (-1.5, 2.0)}
_parsed = functools.lru_cache(maxsize=256)(parse_mission)
"""Many tests ask for the same mission, which nobody can change."""
STARTS = ((-1.0, -1.0), (3.0, 3.0), (-2.0, 0.5), (1.0, -2.0))


def world(
    formula: str,
    *,
    robots: int = 1,
    regions: Mapping[str, tuple[float, float]] = PLACES,
    radii: Mapping[str, float] | None = None,
    starts: tuple[tuple[float, float], ...] = STARTS,
    trace: str = "finite",
    team: str = "own",
    repeat: int = 1,
    objective: str = "sum",
    extra: str = "",
) -> Mission:
    """Return a mission in a plane, at height 1 m, flown at nominal pace: its plan is what is tested. `extra` is YAML for further keys."""
    radius = dict.fromkeys(regions, 0.2) | dict(radii or {})
    lines = [
        "format: 1", "name: world", "regions:",
        *(f"  {n}: {{center: [{x}, {y}, 1.0], radii: [{radius[n]}, {radius[n]}, {radius[n]}]}}" for n, (x, y) in regions.items()),
        "agents:",
        *(f"  quad{i}: {{start: [{x}, {y}, 1.0]}}" for i, (x, y) in enumerate(starts[:robots])),
        "vehicle: crazyflie-2.1",
        "workspace: {min: [-20, -20, 0.2], max: [20, 20, 3]}",
        f"planner: {{objective: {objective}, pace: nominal}}",
        f"spec: {{formula: '{formula}', trace: {trace}, team: {team}, repeat: {repeat}}}",
        extra,
    ]  # fmt: skip
    return _parsed("\n".join(lines))


def office_grid(
    formula: str, *, named: Mapping[str, tuple[int, int]] | None = None, robot: str = "", team: str = "own"
) -> Mission:
    """Return a mission of six robots on a grid of 112 places with walls, `n0_0` to `n13_7` but for those that are `named`.

    `robot` is YAML of its internal states and actions.
    """
    width, height = 14, 8
    cells = {(x, y): f"n{x}_{y}" for x in range(width) for y in range(height)}
    cells |= {cell: name for name, cell in (named or {}).items()}
    places = {name: (float(x), float(y)) for (x, y), name in cells.items()}
    edges = [f"[home, {cells[x, 0]}]" for x in range(0, width, 3)]
    for x, y in itertools.product(range(width), range(height)):
        edges += [f"[{cells[x, y]}, {cells[x + 1, y]}]"] if x + 1 < width and not (x == 6 and y not in (0, 5)) else []
        edges += [f"[{cells[x, y]}, {cells[x, y + 1]}]"] if y + 1 < height else []
    starts = tuple((float(x), -1.0) for x in range(0, 18, 3))
    extra = f"environment: {{start: home, edges: [{', '.join(edges)}]}}\n{robot}"
    return world(formula, robots=6, regions=places, starts=starts, team=team, extra=extra)
