"""Units that a file does not say: what cannot be metres in this mission is refused."""

from __future__ import annotations

import numpy as np

from flight.model.attitude import Floats
from verify.data import BadInput, Mission

_FAR = 50.0
"""Times the workspace's reach that no robot was measured at."""


def require_metres(position: Floats, mission: Mission) -> None:
    """Refuse positions that are far too large to be metres in a mission's workspace.

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
            f"positions reach {farthest:g} where the workspace ends at {reach:g} m; are they in millimetres? Give them in m."
        )
