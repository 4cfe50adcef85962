"""Flights of `mellinger` on its filter under the disturbances of docs/tracking.md, by the simulator's own parts: many at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from flight.control.mellinger import MELLINGER
from flight.control.onboard_controller import setpoint_of
from flight.model.airframe import airframe_of
from flight.model.attitude import quaternion_rate, unit
from flight.model.ekf import SENSED, ExtendedKalman
from flight.model.timing import STEP
from flight.onboard_simulation.rotor_plant import RotorPlant

STEPS = 5


@cache
def settled(noise):
    """Return the filter of a vehicle that has hovered at the origin for long. Shape (ROWS, 1)."""
    kalman = ExtendedKalman(noise, 0.01)
    rows = kalman.at_first(np.zeros((3, 1)), np.array([[1.0], [0.0], [0.0], [0.0]]))
    sensed = np.zeros((SENSED, 1))
    sensed[3], sensed[7], sensed[11] = 9.80665, 1.0, 1.0
    for _ in range(3000):
        rows = kalman.after(rows, sensed)
        rows[:10] = np.eye(10)[:, [6]]
    return rows


@dataclass
class Hovers:
    """Disturbances of n hovers; each function is told the step on board, or the frame, and returns (3, n)."""

    n: int
    wind: object = None
    gyroscope: object = None
    place: object = None  # by frame
    attitude: object = None  # by frame
    late: object = 0  # steps, a number or by frame
    mass: np.ndarray | None = None
    thrust: np.ndarray | None = None
    offset: np.ndarray | None = None
    lag: float = 1.0  # times the rotors'
    drag: float = 1.0  # times the airframe's
    moment: object = None  # N m about the body's axes, by step
    sag: object = None  # share by which thrust is more than at the start, by step. Shape (n,)
    plan: object = None  # by frame: derivatives of the plan. Shape (5, 3)

    def fly(self, vehicle, autopilot, steps):
        """Return place, velocity, attitude and rates after every step, and place, velocity and attitude as known. Shapes (steps, ., n)."""
        n, frame = self.n, airframe_of(vehicle.changed(autopilot=autopilot))
        slow = frame.changed(
            rotor_lag=self.lag * frame.rotor_lag,
            rotor_drag=self.drag * frame.rotor_drag,
            inflow_drag=self.drag * frame.inflow_drag,
            drag_range=None,
        )
        strength = np.ones(n) if self.thrust is None else self.thrust
        start = np.zeros((4, n))
        start[:3] = 0.0 if self.offset is None else self.offset
        setpoint = self.setpoint(0)
        mass = vehicle.mass * (np.ones(n) if self.mass is None else self.mass)
        plant = RotorPlant(slow, MELLINGER.laws(frame), start, setpoint, mass, self.thrust)
        plant._rows[13:17] = frame.hover_speed
        kalman, rows = ExtendedKalman(autopilot.ekf, 0.01), np.repeat(settled(autopilot.ekf), n, axis=1)
        rows[:3] = start[:3]
        none = np.zeros((3, n))
        past = [np.concatenate([plant.state[:3], plant.state[6:10]])] * 25
        found, known = [], kalman.known(rows)
        for step in range(steps):
            tick = step // STEPS
            setpoint = self.setpoint(tick) if step % STEPS == 0 else setpoint
            if step and step % STEPS == 0:
                seen = past[-1 - (self.late(tick) if callable(self.late) else self.late)]
                sensed = np.zeros((SENSED, n))
                sensed[:3], sensed[3] = plant.sensed(STEPS)
                sensed[4:7], sensed[11] = seen[:3] + (self.place(tick) if self.place else none), 1.0
                turned = quaternion_rate(seen[3:], self.attitude(tick) if self.attitude else none)
                sensed[7:11] = unit(seen[3:] + turned)
                rows = kalman.after(rows, sensed)
                known = kalman.known(rows)
            noise = self.gyroscope(step) if self.gyroscope else none
            wind = self.wind(step) if self.wind else none
            if self.moment:
                plant._rows[10:13] += STEP * self.moment(step) / np.array(vehicle.inertia)[:, None]
            if self.sag:
                plant._pushed = np.sqrt(strength * (1.0 + self.sag(step)))
            plant.fly(setpoint, known, noise, wind, 1)
            past = [*past[-24:], np.concatenate([plant.state[:3], plant.state[6:10]])]
            found.append(np.concatenate([plant.state[:13], known]))
        return np.array(found)

    def setpoint(self, tick):
        """Return what the commander on board asks for in a frame."""
        flat = np.zeros((5, 4, self.n))
        if self.plan is not None:
            flat[:, :3] = self.plan(tick)[:, :, None]
        return setpoint_of(flat, 0.0)
