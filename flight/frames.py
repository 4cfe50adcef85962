"""Between the mission's frame and the laboratory's: certified flights there, the same polynomials in the vehicles' own numbers, and recordings back."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from flight.logs.recordings import Recording
from flight.logs.units import require_metres
from verify.data import DoesNotFit, Letter, Mission, Trajectory
from verify.data.frame import Frame
from verify.recordings.flight_log import Samples

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


def in_mission(found: Recording, mission: Mission) -> Recording:
    """Return a recording in the mission's frame; nothing else turns what was measured.

    Args:
        found: In the frame that it says.
        mission: Carries the frame.
    """
    frame = mission.frame
    if found.frame == "mission" or frame is None:
        return replace(found, frame="mission")
    late, off = found.rounding
    lost = 8 * float(np.spacing(np.nanmax(np.abs(found.position), initial=1.0)))
    turned = replace(found, position=frame.to_mission(found.position), rounding=(late, off + lost), frame="mission")
    return turned.noted(f"The recording's frame is the laboratory's: {frame.sentence} (`frame`).")


def samples_of(found: Recording, mission: Mission, internal: Mapping[str, Sequence[Letter]] | None = None) -> Samples:
    """Return a recording as what the checker judges: in the mission's frame, with all that its files cover.

    Args:
        found: As it was read.
        mission: Carries the frame and the workspace.
        internal: Each robot's letter at each sample, where the recording shows them.

    Raises:
        BadInput: Positions cannot be metres in the mission's workspace.
    """
    turned = in_mission(found, mission)
    require_metres(turned.position, mission)
    places = {name: turned.position[:, j] for j, name in enumerate(turned.robots)}
    return Samples(turned.times, places, internal, turned.rounding, turned.notes, turned.zero, turned.covers)


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
