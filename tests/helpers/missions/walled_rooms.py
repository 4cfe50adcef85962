"""Missions in rooms with walls."""

from __future__ import annotations

from typing import Any

from verify.data import Mission


def box(center: tuple[float, float, float], size: tuple[float, float, float]) -> dict[str, Any]:
    """Return a box as a mission file has it."""
    return {"center": center, "size": size}


def two_rooms(formula: str, *, gap: float = 0.8, **changed: Any) -> Mission:  # of any type: a mission's fields
    """Return a room 4 m by 4 m, cut in two at y = 2 by a wall with one gap around x = 3, which the region `door` fills.

    A robot starts on one side, where the region `a` is; `b` is on the other side.

    Args:
        formula: What is asked.
        gap: Width of the gap, m.
        changed: Other fields of the mission.
    """
    left, right = 3.0 - gap / 2, 3.0 + gap / 2
    fields: dict[str, Any] = {
        "name": "two rooms",
        "spec": {"formula": formula},
        "regions": {
            "a": box((1.0, 1.0, 1.0), (0.6, 0.6, 0.6)),
            "b": box((1.0, 3.2, 1.0), (0.6, 0.6, 0.6)),
            "door": box((3.0, 2.0, 1.0), (gap, 0.3, 2.0)),
        },
        "obstacles": {
            "west": box((left / 2, 2.0, 1.0), (left, 0.1, 2.0)),
            "east": box(((4.0 + right) / 2, 2.0, 1.0), (4.0 - right, 0.1, 2.0)),
        },
        "agents": {"quad0": {"start": (2.0, 0.6, 1.0)}},
        "vehicle": "crazyflie-2.1",
        "workspace": {"min": (0.0, 0.0, 0.2), "max": (4.0, 4.0, 1.8)},
    }
    return Mission.model_validate({**fields, **changed})


def shelves(rows: int, formula: str) -> Mission:
    """Ten columns of posts, with a region beside each."""
    cells = [(i, j) for i in range(10) for j in range(rows)]
    obstacles = {f"post{i}_{j}": box((2.0 * i + 1.0, 2.0 * j + 1.0, 1.0), (0.8, 1.2, 2.0)) for i, j in cells}
    regions = {f"at{i}_{j}": box((2.0 * i + 2.0, 2.0 * j + 1.0, 1.0), (0.4, 0.4, 0.4)) for i, j in cells}
    agents = {"quad0": {"start": (0.2, 0.2, 1.0)}}
    space = {"min": (0.0, 0.0, 0.2), "max": (21.0, 2.0 * rows + 0.5, 1.8)}
    return two_rooms(formula, obstacles=obstacles, regions=regions, agents=agents, workspace=space)
