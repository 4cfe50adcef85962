"""Yaw rates and rotor thrusts beside their limits: told apart to a billionth, and held against Euler's angles in Arb."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from flint import arb, arb_poly, arb_series, ctx

from tests.helpers.few import few_of
from tests.helpers.motion.flights import quantised, small_mission, wandering
from verify.data.mission import Mission
from verify.data.trajectory import Trajectory
from verify.data.vehicle import GRAVITY, Vehicle
from verify.motion.limits import extremes
from verify.motion.paths import read_team

MISSION = small_mission(regions="")
QUANTITIES = ("yaw_rate", "rotor_thrust_max", "rotor_thrust_min")


def gentle(rng: np.random.Generator, pieces: int) -> Trajectory:
    """A random flight, slowed down until its rotors turn the right way."""
    flight = wandering(rng, pieces=pieces)
    slow = float(rng.uniform(6, 12))
    coefficients = flight.coefficients / slow ** np.arange(8)
    turns = rng.normal(size=(pieces, 8)) / np.cumprod(np.arange(1, 9)) / (flight.durations[:, None] * slow) ** np.arange(8)
    coefficients[:, 3] = turns
    return quantised(Trajectory(flight.durations * slow, coefficients))


def motion(coefficients: np.ndarray, at: arb, vehicle: Vehicle) -> tuple[arb_series, list[arb_series]]:
    """Return the yaw rate and the four rotors' thrusts as series in time around `at`, by roll, pitch and yaw angles."""
    x, y, z, yaw = (arb_series(arb_poly([arb(float(c)) for c in row])(arb_poly([at, 1])), 8) for row in coefficients)
    fx, fy, fz = (p.derivative().derivative() for p in (x, y, z))
    fz = fz + arb(GRAVITY)
    p, q = fx * yaw.cos() + fy * yaw.sin(), fy * yaw.cos() - fx * yaw.sin()
    size = (p * p + q * q + fz * fz).sqrt()
    pitch, roll = (p / fz).atan(), (-q / size).asin()
    psi, theta, phi = yaw.derivative(), pitch.derivative(), roll.derivative()
    omega = (
        phi - psi * pitch.sin(),
        theta * roll.cos() + psi * pitch.cos() * roll.sin(),
        psi * pitch.cos() * roll.cos() - theta * roll.sin(),
    )
    inertia = [arb(value) for value in vehicle.inertia]
    momentum = [i * w for i, w in zip(inertia, omega, strict=True)]
    torque = [
        momentum[i].derivative() + omega[(i + 1) % 3] * momentum[(i + 2) % 3] - omega[(i + 2) % 3] * momentum[(i + 1) % 3]
        for i in range(3)
    ]
    arm = arb(vehicle.arm) / arb(2).sqrt()
    rotors = []
    for sx in (1, -1):
        for sy in (1, -1):
            # a quarter of the thrust, of the torques over the levers, and of the drag about z
            share = (arb(vehicle.mass) * size, sy * torque[0] / arm, -sx * torque[1] / arm)
            rotors.append((share[0] + share[1] + share[2] + sx * sy * torque[2] / arb(vehicle.torque_to_thrust)) / 4)
    return omega[2], rotors


def quantities(coefficients: np.ndarray, at: float, vehicle: Vehicle) -> dict[str, list[arb_series]]:
    """Return what each limit is about, so that greater is worse."""
    rate, rotors = motion(coefficients, arb(at), vehicle)
    return {"yaw_rate": [rate, -rate], "rotor_thrust_max": rotors, "rotor_thrust_min": [-r for r in rotors]}


def peak(flight: Trajectory, vehicle: Vehicle, name: str, samples: int = 120) -> float:
    """Return the greatest value to some 1e-15: the best of many samples, and the best near it in floats."""

    def value(piece: int, row: int) -> Callable[[float], float]:
        return lambda at: float(quantities(flight.coefficients[piece], at, vehicle)[name][row][0])

    best = -np.inf
    for piece, length in enumerate(flight.durations):
        grid = np.linspace(0, float(length), samples)
        table = np.array([[float(s[0]) for s in quantities(flight.coefficients[piece], t, vehicle)[name]] for t in grid])
        for row in range(table.shape[1]):
            at = int(np.argmax(table[:, row]))
            if table[at, row] > table.max() - 0.05 * abs(table.max()):
                best = max(best, highest(value(piece, row), grid[max(at - 1, 0)], grid[min(at + 1, samples - 1)]))
    return best


def highest(value: Callable[[float], float], low: float, high: float) -> float:
    """Return the greatest value between two places, of a function that rises and then falls there (golden section)."""
    share = (np.sqrt(5) - 1) / 2
    first, second = high - share * (high - low), low + share * (high - low)
    a, b = value(first), value(second)
    best = max(a, b, value(low), value(high))
    while high - low > 1e-9:
        if a > b:
            high, second, b = second, first, a
            first = high - share * (high - low)
            a = value(first)
        else:
            low, first, a = first, second, b
            second = low + share * (high - low)
            b = value(second)
        best = max(best, a, b)
    return best


def limited(name: str, value: float) -> Mission:
    """The mission with one limit set so that `value`, greater being worse, is just allowed."""
    if name == "yaw_rate":
        limits = MISSION.limits.model_copy(update={"yaw_rate_deg": float(np.degrees(value))})
        return MISSION.model_copy(update={"limits": limits})
    own = MISSION.vehicle.model_copy(update={name: -value if name.endswith("_min") else value})
    return MISSION.model_copy(update={"vehicle": own})


def verdict(flight: Trajectory, name: str, limit: float) -> str:
    (found,) = (e for e in extremes(read_team(limited(name, limit), {"r0": flight})) if e.name == name)
    return "holds" if found.holds else "fails" if found.fails else "undecided"


@few_of(1, "seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 3)), 2])
@few_of(1, "name", QUANTITIES)
def test_limits_a_billionth_away_are_told(name, seed, monkeypatch):
    monkeypatch.setattr(ctx, "prec", 160)
    flight = gentle(np.random.default_rng(seed), 1 + seed % 3)
    top = peak(flight, MISSION.vehicle, name)
    for share in (1e-5, 1e-7, 1e-9):
        assert verdict(flight, name, top + share * abs(top)) == "holds"
        assert verdict(flight, name, top - share * abs(top)) == "fails"
