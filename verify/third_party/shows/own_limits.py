"""Limits and fences in a show's own file, which its designer wrote; they are required where nothing else is given."""

from __future__ import annotations

from dataclasses import dataclass

from verify.arithmetic.balls import Floats


@dataclass(frozen=True, eq=False, slots=True)
class Fence:
    """A polygon of a geofence, upright and without end above and below.

    Attributes:
        name: For messages, such as "polygon 1".
        inside: Whether drones must stay inside it, or outside.
        corners: In order around it, in m; edges lead from each to the next and do not cross. Shape (corners, 2).
    """

    name: str
    inside: bool
    corners: Floats


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class OwnLimits:
    """Limits in a file beside its flights; None where it has none.

    Attributes:
        separation: m.
        altitude: Greatest z, in m.
        speed_xy: Greatest horizontal speed, in m/s.
        climb: Greatest speed upwards.
        descent: Greatest speed downwards.
        acceleration_xy: Greatest horizontal acceleration, in m/s^2.
        acceleration_up: Greatest one upwards.
        acceleration_down: Greatest one downwards.
        yaw_rate: Greatest rate of turning, in deg/s.
        fences: Of its geofence.
        where: For each of these that is there, the file's own name for it.
    """

    separation: float | None = None
    altitude: float | None = None
    speed_xy: float | None = None
    climb: float | None = None
    descent: float | None = None
    acceleration_xy: float | None = None
    acceleration_up: float | None = None
    acceleration_down: float | None = None
    yaw_rate: float | None = None
    fences: tuple[Fence, ...] = ()
    where: tuple[tuple[str, str], ...] = ()

    def source(self, name: str) -> str:
        """Return the file's own name for one of the limits, such as `settings.validation.minDistance`."""
        return dict(self.where)[name]


NO_LIMITS = OwnLimits()
"""Of files that hold flights alone."""
