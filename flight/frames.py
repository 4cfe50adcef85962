"""Certified flights in the laboratory's frame: the same polynomials, turned and moved, in the vehicles' own numbers again."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from verify.data import DoesNotFit, Mission, Trajectory
from verify.data.frame import Frame

NEAR = 1e-5
"""m that rounding to the vehicles' numbers may move a flight by in the laboratory's frame."""


def in_laboratory(frame: Frame, path: Trajectory) -> tuple[Trajectory, float]:
    """Return a flight as the laboratory sees it, in float32, and by how much rounding moves it at most, m.

    Args:
        frame: Where the mission lies.
        path: In the mission's frame.

    Raises:
        DoesNotFit: The laboratory's numbers are so large that float32 would move it by more than `NEAR`.
    """
    exact = path.coefficients.copy()
    exact[:, :3] = np.einsum("ij,pjk->pik", frame.matrix, exact[:, :3])
    exact[:, :3, 0] += np.array(frame.offset)
    exact[:, 3, 0] += math.radians(frame.rotation_deg)
    rounded = exact.astype(np.float32).astype(np.float64)
    powers = path.durations[:, None, None] ** np.arange(exact.shape[-1])
    # the sums above are rounded, too: far less than float32 is
    axes = ((np.abs(rounded - exact) + 1e-15 * np.abs(exact)) * powers)[:, :3].sum(axis=2).max(axis=0)
    off = float(np.linalg.norm(axes)) * (1 + 1e-12)
    if not off <= NEAR:
        raise DoesNotFit(
            f"by `frame` the flight lies where float32 moves it by {off:.2g} m; bring the laboratory's origin nearer to it."
        )
    return Trajectory(path.durations, rounded, cycle=path.cycle, cuts=path.cuts), off


def team_in_laboratory(mission: Mission, team: Mapping[str, Trajectory]) -> tuple[dict[str, Trajectory], str]:
    """Return a team's flights as the laboratory sees them, and what is to be said of that; as they are where the mission has no `frame`.

    Args:
        mission: Carries the frame.
        team: In the mission's frame.

    Raises:
        DoesNotFit: As `in_laboratory`.
    """
    frame = mission.frame
    if frame is None:
        return dict(team), ""
    found = {name: in_laboratory(frame, path) for name, path in team.items()}
    off = max((off for _, off in found.values()), default=0.0)
    said = (
        f"All places are the laboratory's: {frame.sentence} (`frame`). They are the certified ones to {max(off, 1e-9):.1g} m, "
        "which is of the margin."
    )
    return {name: path for name, (path, _) in found.items()}, said


def mission_in_laboratory(mission: Mission) -> Mission:
    """Return the mission with its robots' headings as the laboratory sees them, for links, which ask for nothing else in it.

    Args:
        mission: Carries the frame.
    """
    if mission.frame is None:
        return mission
    turn = mission.frame.rotation_deg
    agents = {name: agent.model_copy(update={"yaw_deg": agent.yaw_deg + turn}) for name, agent in mission.agents.items()}
    return mission.model_copy(update={"agents": agents, "frame": None})
