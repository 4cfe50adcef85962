"""Small missions for the planner's tests: round regions far apart, unless a test says otherwise."""

from __future__ import annotations

from collections.abc import Mapping

from verify.data import Mission, parse_mission

PLACES = {"a": (0.0, 0.0), "b": (2.0, 0.0), "c": (2.0, 1.5), "d": (-1.5, 2.0)}
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
    """Return a mission in a plane, at height 1 m. `extra` is YAML for further keys."""
    radius = dict.fromkeys(regions, 0.2) | dict(radii or {})
    lines = [
        "format: 1", "name: world", "regions:",
        *(f"  {n}: {{center: [{x}, {y}, 1.0], radii: [{radius[n]}, {radius[n]}, {radius[n]}]}}" for n, (x, y) in regions.items()),
        "agents:",
        *(f"  quad{i}: {{start: [{x}, {y}, 1.0]}}" for i, (x, y) in enumerate(starts[:robots])),
        "vehicle: crazyflie-2.1",
        "workspace: {min: [-20, -20, 0.2], max: [20, 20, 3]}",
        f"planner: {{objective: {objective}}}",
        f"spec: {{formula: '{formula}', trace: {trace}, team: {team}, repeat: {repeat}}}",
        extra,
    ]  # fmt: skip
    return parse_mission("\n".join(lines))
