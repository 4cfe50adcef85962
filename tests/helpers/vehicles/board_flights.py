"""Plans, filters and sums that tests of the proof of `mellinger` share."""

from __future__ import annotations

import numpy as np

from verify.data.airframe import load_airframe
from verify.data.autopilot import load_autopilot
from verify.data.disturbance import Disturbance
from verify.data.trajectory import Trajectory
from verify.data.vehicle import load_vehicle
from verify.tracking.on_board.onboard_proof import summed_of
from verify.tracking.on_board.slopes import Slopes

VEHICLE, AIRFRAME, STOCK = load_vehicle("crazyflie-2.1"), load_airframe("crazyflie-2.1"), load_autopilot("crazyflie-2")


QUICK = STOCK.changed(ekf=STOCK.ekf.changed(least_turn=2e-5))
"""A filter that drops less."""


FIRM = STOCK.changed(ekf=STOCK.ekf.changed(attitude_noise=0.0045))
"""A filter that trusts attitudes as the firmware does where nobody says otherwise; its dead zone is the firmware's."""


SMALL = Disturbance(
    airframe=AIRFRAME,
    wind=0.03,
    position=4e-5,
    latency=(0.014, 0.014),
    gyroscope=0.0015,
    mass=0.0008,
    thrust=0.002,
    sag=1e-4,
    start=1e-4,
)


SECONDS = 1.2


FRAMES = 120


def line(away, seconds, rest=0.0):
    """Return a way from rest to rest, and a hover behind it."""
    s = np.array([0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0]) / seconds ** np.arange(8)
    way, end = np.zeros((4, 8)), np.zeros((4, 8))
    way[:3], end[:3, 0] = np.outer(away, s), away
    way[2, 0], end[2, 0] = 1.0, 1.0 + away[2]
    return Trajectory([seconds, rest] if rest else [seconds], np.stack([way, end]) if rest else way[None])


STILL = line((0.0, 0.0, 0.0), SECONDS), SECONDS


WAY = line((0.25, -0.2, 0.08), 1.0, 0.2), SECONDS
"""A way on which a vehicle tilts by 0.2 rad."""


EARLY = 60
"""Frames of it that are flown, with its greatest tilts."""


def summed(autopilot=QUICK, late=7, path=STILL[0], frames=FRAMES):
    """Return what is linear about a flight, and its sums."""
    return summed_of(VEHICLE, AIRFRAME, autopilot, late, path, frames)


def exact(values):
    """Return numbers that are known, as a law takes them."""
    values = np.asarray(values, dtype=np.float64)
    return Slopes.variables(np.zeros(values.size))[: values.size] + values


def number(value: Slopes):
    return 0.5 * (value.centre.low + value.centre.high)


def tilts_of(q):
    """Return the tilts and headings of quaternions, as the proof has them. Shape (steps, 4, n) to (steps, 3, n)."""
    w, x, y, z = (q[:, k] for k in range(4))
    half = np.arctan2(z, w)
    across, along = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x)  # of the thrust's axis in the world
    cosine, sine = np.cos(2.0 * half), np.sin(2.0 * half)
    return np.stack([sine * across - cosine * along, cosine * across + sine * along, 2.0 * np.sin(half)], axis=1)
