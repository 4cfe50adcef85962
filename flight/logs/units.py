"""Units that a file does not say: what cannot be metres in this mission is rejected."""

from __future__ import annotations

import numpy as np

from flight.model.attitude import Floats
from verify.data import BadInput, Mission

_FAR = 50.0
"""Times the workspace's reach that no robot was measured at."""

_LONG, _SLOW = 200.0, 1.0
"""Times the flight's length, and s between samples: a recording that is longer with samples further apart is none in s."""


def require_metres(position: Floats, mission: Mission) -> None:
    """Reject positions that are far too large to be metres in a mission's workspace.

    Args:
        position: m; NaN where a robot was not seen. Shape (..., 3).
        mission: Gives the workspace.

    Raises:
        BadInput: As said.
    """
    reach = float(np.max(np.abs([mission.workspace.min, mission.workspace.max])))
    farthest = float(np.nanmax(np.abs(position), initial=0.0))
    if farthest > _FAR * reach:
        raise BadInput(
            f"positions reach {farthest:g} where the workspace ends at {reach:g} m; are they in millimetres or centimetres? Give them in m, or name their columns so (quad0.x_mm)."
        )


def require_seconds(times: Floats, duration: float) -> None:
    """Reject times that are far too far apart to be seconds of a flight.

    Args:
        times: s. Shape (n,), n >= 1.
        duration: Of the flight, s.

    Raises:
        BadInput: As said.
    """
    step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    span = float(times[-1] - times[0])
    if step > max(duration, _SLOW) or (step > _SLOW and span > _LONG * duration):
        raise BadInput(
            f"samples are {step:g} s apart where the flight lasts {duration:.4g} s; are the times in ms or us? Name their column so "
            "(--rename time_ms=t)."
        )
