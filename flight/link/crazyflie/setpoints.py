"""Full-state set-points as the radio has them: 29 bytes of whole millimetres, milliradians, and a quaternion of 32 bits.

They are rounded to the nearest: a place is off by at most 0.5 mm along each axis, so 0.87 mm, and a heading by 0.2 degrees. What does not
fit into 16 bits, such as a place 33 m away, cannot be sent.
"""

from __future__ import annotations

import struct

import numpy as np

from flight.control.flatness import feed_forward, lifted
from flight.model.attitude import Floats, from_matrix
from verify.data import DoesNotFit, Mission

ROUNDING = 0.5e-3
"""m by which a place that is sent may be off along each axis."""
_FULL_STATE = 6
_LARGEST = 32.767
"""m, m/s, m/s^2 and rad/s that are sent at the most."""


def full_state(flat: Floats) -> bytes:
    """Return the set-point that asks for a flat output: place, velocity, acceleration, attitude and body rates.

    Args:
        flat: x, y, z in m and heading in rad, and their first three derivatives. Shape (4, 4).

    Raises:
        DoesNotFit: A number is too large to be sent.
    """
    from cflib.utils.encoding import compress_quaternion

    column = flat[..., None]
    force = lifted(column[2, :3])
    leads = feed_forward(force, column[3, :3], np.zeros_like(force), column[0, 3], column[1, 3], column[2, 3])
    attitude = np.roll(from_matrix(leads.turn)[:, 0], -1)  # x, y, z, w
    numbers = np.rint(1000.0 * np.concatenate([flat[0, :3], flat[1, :3], flat[2, :3], leads.rates[:, 0]]))
    if not np.abs(numbers).max() <= 1000.0 * _LARGEST:
        raise DoesNotFit(
            f"a set-point of {np.abs(numbers).max() / 1000:.5g} m, m/s, m/s^2 or rad/s exceeds the Crazyflie packet's {_LARGEST}; fly slower, or nearer to the origin."
        )
    whole = numbers.astype(int).tolist()
    return struct.pack("<B9hI3h", _FULL_STATE, *whole[:9], compress_quaternion(attitude), *whole[9:])


def require_near(mission: Mission) -> None:
    """Reject a mission in whose workspace there are places that cannot be sent.

    Args:
        mission: In the laboratory's frame.

    Raises:
        DoesNotFit: A corner of it is too far away.
    """
    far = max(abs(side) for corner in (mission.workspace.min, mission.workspace.max) for side in corner)
    if far > _LARGEST:
        raise DoesNotFit(
            f"the workspace reaches {far:g} m from the laboratory's origin, and a Crazyflie's set-points end at {_LARGEST} m: "
            "let `frame` put the mission nearer to it, or fly with `ltlplan fly`, whose flights lie on board."
        )
