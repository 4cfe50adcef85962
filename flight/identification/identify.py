"""Identify an airframe from a recorded hover and a line: thrust, drag and latency, with intervals, or a refusal.

A flight tells forces only as shares of the mass. Let T be the commanded thrust, z the body's axis, W the sum of rotor speeds and w the air's
velocity. Then m a = s T z - c W (v - w) - m g gives s/m and c/m. The mass itself comes from scales.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from flight.identification.least_squares import LEVEL, Bumps, Fit, bumps_over, fitted
from flight.identification.recorded import RATE, Recorded
from flight.model.airframe import Airframe, airframe_of
from flight.model.attitude import Floats, from_euler, matrix
from verify.data import GRAVITY, BadInput, Vehicle
from verify.data.uncertain import Uncertain

WEIGHED, NOT_WEIGHED = 0.005, 0.02
"""Shares by which a mass may be off that came from scales, or from the profile."""
_FILTER = 0.002
"""s by which the filter on board may be late or early by itself: its velocity errs with drag, of which it knows nothing."""
_HOVER, _LINE, _SLOW, _FAST = 4.0, 4.0, 0.15, 0.4
"""s of hover and of a line, and the speeds below and above which they count, m/s."""
_SURE = {"thrust": 0.05, "drag": 0.6, "latency": 0.01}
"""Half an interval that still tells something: share, share of the drag that is found, s."""
_SHARE, _LATE = (0.5, 1.5), 0.2
"""Ends of a thrust over the commanded one, and of a latency in s, that a profile may have."""
_MOST = 0.6
"""m/s^2 of residual from which a flight is not one of the model."""


@dataclass(frozen=True, slots=True)
class Found:
    """One number with its interval.

    Attributes:
        value: The best guess.
        least: Lower end of the interval.
        most: Upper end.
    """

    value: float
    least: float
    most: float

    def times(self, other: Found) -> Found:
        """Return the product, of intervals above zero that are found apart from each other.

        Args:
            other: The other factor.
        """
        value = self.value * other.value
        half = [max(f.value - f.least, f.most - f.value) / f.value for f in (self, other)]
        share = math.hypot(*half)
        return Found(value, value * (1.0 - share), value * (1.0 + share))


@dataclass(frozen=True, slots=True)
class Identified:
    """Findings of one flight.

    Attributes:
        vehicle: The profile that was told.
        mass: kg.
        thrust: Thrust over commanded thrust.
        drag: kg, force across a rotor's axis per rad/s and m/s.
        latency: s; None where nothing tells it.
        residual: Root mean square of what is left over along x, y and z, m/s^2.
        lasts: s of the log.
    """

    vehicle: Vehicle
    mass: Found
    thrust: Found
    drag: Found
    latency: Found | None
    residual: tuple[float, float, float]
    lasts: float

    @property
    def sentences(self) -> tuple[str, ...]:
        """The findings, for a person."""
        x, y, z = self.residual
        late = (
            "latency: not told, for the log has no columns ex, ey, ez."
            if self.latency is None
            else f"latency {1000 * self.latency.value:.1f} ms ({1000 * self.latency.least:.1f} to {1000 * self.latency.most:.1f})."
        )
        return (
            f"mass {1000 * self.mass.value:.4g} g ({1000 * self.mass.least:.4g} to {1000 * self.mass.most:.4g}), from scales or the profile.",
            f"thrust {self.thrust.value:.4f} of what is commanded ({self.thrust.least:.4f} to {self.thrust.most:.4f}).",
            f"drag {self.drag.value:.3g} kg for each rotor ({self.drag.least:.3g} to {self.drag.most:.3g}).",
            late,
            f"left over: {x:.3f}, {y:.3f}, {z:.3f} m/s^2 along x, y, z (root mean square, {self.lasts:.1f} s; intervals at {100 * LEVEL:.0f} %).",
        )

    @property
    def profile(self) -> Vehicle:
        """The vehicle's profile with what was found: its mass, and all intervals."""
        late = None if self.latency is None else (max(self.latency.least, 0.0), self.latency.most)
        uncertain = Uncertain(
            mass=(self.mass.least, self.mass.most),
            thrust=(self.thrust.least, self.thrust.most),
            drag=(max(self.drag.least, 0.0), self.drag.most),
            latency=late,
        )
        return self.vehicle.changed(mass=self.mass.value, uncertain=uncertain)


def identify(recorded: Recorded, vehicle: Vehicle, *, mass: float | None = None) -> Identified:
    """Identify an airframe.

    Args:
        recorded: A hover and a line, there and back.
        vehicle: What flew.
        mass: kg as it was weighed; None takes the profile's, and doubts it more.

    Raises:
        BadInput: The log cannot tell, and why.
    """
    if mass is not None and not 0.5 * vehicle.mass <= mass <= 2.0 * vehicle.mass:
        raise BadInput(f"a mass of {mass:g} kg is not that of '{vehicle.name}', whose profile has {vehicle.mass:g} kg.")
    airframe = airframe_of(vehicle)
    if recorded.lasts < 1.0:
        raise BadInput(
            f"the log lasts {recorded.lasts:.1f} s, too short to tell anything: a hover of {_HOVER:g} s and a line of {_LINE:g} s are needed."
        )
    velocity = np.asarray(savgol_filter(recorded.position, 31, 3, deriv=1, delta=1.0 / RATE, axis=0), dtype=np.float64)
    _require_flight(recorded, velocity)
    bumps = bumps_over(len(recorded.thrust))
    forces = _forces(recorded, velocity, airframe, bumps)
    left = np.sqrt(np.mean(forces.residual**2, axis=0))
    if not np.all(left < _MOST):
        raise BadInput(
            f"the model does not explain this log: {left.max():.2f} m/s^2 are left over, and {_MOST:g} are the most. Are attitudes in rad (Z-Y-X), and is "
            "thrust in N of all rotors?"
        )
    weighed = vehicle.mass if mass is None else mass
    off = NOT_WEIGHED if mass is None else WEIGHED
    scales = Found(weighed, weighed * (1.0 - off), weighed * (1.0 + off))
    thrust, drag = (_found(forces, k) for k in range(2))
    if drag.value <= 0.0 or drag.value - drag.least > _SURE["drag"] * drag.value:
        raise BadInput(
            f"the log cannot tell the drag: {drag.value * weighed:.2g} kg with {(drag.most - drag.value) * weighed:.2g} to either side. Fly the line faster or "
            "more often, there and back, in still air."
        )
    thrust = thrust.times(scales)
    if thrust.value - thrust.least > _SURE["thrust"] * thrust.value:
        share = 100 * (thrust.value - thrust.least) / thrust.value
        raise BadInput(
            f"the log cannot tell the thrust: within {share:.0f} % only. Hover longer, and give the mass from scales."
        )
    if not (_SHARE[0] <= thrust.least and thrust.most <= _SHARE[1]):
        raise BadInput(
            f"the thrust comes out as {thrust.value:.3g} of what is commanded; {_SHARE[0]:g} to {_SHARE[1]:g} may be. Is `thrust` in N of all rotors, and is "
            f"the vehicle a '{vehicle.name}'?"
        )
    late = None if recorded.estimated is None else _latency(recorded.estimated - recorded.position, velocity, bumps)
    x, y, z = left.tolist()
    return Identified(vehicle, scales, thrust, drag.times(scales), late, (x, y, z), recorded.lasts)


def _require_flight(recorded: Recorded, velocity: Floats) -> None:
    """Reject a log without a hover, or without a line there and back."""
    speed = np.linalg.norm(velocity, axis=1)
    hover, line = float(np.mean(speed < _SLOW)) * recorded.lasts, float(np.mean(speed > _FAST)) * recorded.lasts
    if hover < _HOVER:
        raise BadInput(f"the log hovers for {hover:.1f} s (below {_SLOW:g} m/s); {_HOVER:g} s are needed to tell the thrust.")
    if line < _LINE:
        raise BadInput(f"the log flies a line for {line:.1f} s (above {_FAST:g} m/s); {_LINE:g} s are needed to tell the drag.")
    along = velocity[speed > _FAST, :2]
    turned = np.linalg.norm(along.mean(axis=0)) / np.mean(np.linalg.norm(along, axis=1))
    if turned > 0.5:
        raise BadInput("the log flies its line one way: wind and drag cannot be told apart. Fly it there and back.")


def _forces(recorded: Recorded, velocity: Floats, airframe: Airframe, bumps: Bumps) -> Fit:
    """Fit s/m, c/m and the wind's push along x and y."""
    up = matrix(from_euler(recorded.attitude.T))[:, 2].T
    rotors = 4.0 * np.sqrt(np.maximum(recorded.thrust, 0.0) / (4.0 * airframe.thrust_coefficient))
    along = (1.0 - airframe.inflow_drag / airframe.rotor_drag) if airframe.rotor_drag > 0 else 0.0
    dragged = velocity - along * up * np.sum(up * velocity, axis=1, keepdims=True)
    wanted = bumps.curve @ recorded.position
    wanted[:, 2] += GRAVITY
    columns = np.zeros((*wanted.shape, 4))
    columns[:, :, 0] = bumps.plain @ (recorded.thrust[:, None] * up)
    columns[:, :, 1] = -(bumps.plain @ (rotors[:, None] * dragged))
    columns[:, 0, 2], columns[:, 1, 3] = 1.0, 1.0
    return fitted(columns, wanted)


def _latency(off: Floats, velocity: Floats, bumps: Bumps) -> Found:
    """Return by how much what is known on board lags behind what is seen."""
    columns = np.zeros((len(bumps.plain), 3, 4))
    columns[:, :, 0] = -(bumps.plain @ velocity)
    for axis in range(3):
        columns[:, axis, axis + 1] = 1.0
    found = _found(fitted(columns, bumps.plain @ off), 0)
    half = found.most - found.value + _FILTER
    if half > _SURE["latency"]:
        raise BadInput(
            f"the log cannot tell the latency: {1000 * found.value:.0f} ms with {1000 * half:.0f} to either side. Fly the line faster."
        )
    if not 0.0 <= found.value + half <= _LATE:
        raise BadInput(
            f"the latency comes out as {1000 * found.value:.0f} ms; 0 to {1000 * _LATE:g} may be. Are ex, ey and ez where the vehicle takes itself to be at `t`?"
        )
    return Found(found.value, found.value - half, found.value + half)


def _found(fit: Fit, index: int) -> Found:
    value, half = float(fit.values[index]), float(fit.half[index])
    return Found(value, value - half, value + half)
