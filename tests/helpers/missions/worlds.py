"""Small missions for the planner's tests: round regions far apart, unless a test says otherwise."""

from __future__ import annotations

import functools
from collections.abc import Mapping

from ltlplan.reproduction.published_missions import plane_mission_text
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
    return _parsed(
        plane_mission_text(
            formula, robots=robots, regions=regions, starts=starts, radii=radii, trace=trace, team=team, repeat=repeat,
            objective=objective, extra=extra,
        )
    )  # fmt: skip
