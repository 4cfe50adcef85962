"""Recordings in the mission's frame: the one place that turns what was measured, for the command, the library, the service and comparisons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from flight.logs.recordings import Recording
from flight.logs.units import require_metres
from verify.data import Letter, Mission
from verify.recordings.flight_log import Samples


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
    """Return a recording as what the checker checks: in the mission's frame, with all that its files cover.

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
