"""Simulated flights of identification: a hover and a line there and back, by vehicles that are not what their profiles say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flight.conditions import Conditions
from flight.control.controller import CONTROLLERS
from flight.identification.recorded import Recorded, even
from flight.mixed_fleet import kinds_of
from flight.model.airframe import airframe_of
from flight.model.attitude import euler
from flight.model.disturbances import Wind
from flight.model.reference import sample_reference
from flight.model.sensing import MotionCapture
from flight.model.timing import CONTROL_STEP, SUBSTEPS
from flight.onboard_simulation.fleet import Differences, Fleet
from flight.onboard_simulation.steps import seen
from flight.random_streams import Draws
from tests.helpers.motion.flights import legs
from verify.data import Vehicle

CAMERAS = 0.001
"""m, of places and of what the filter is told."""
ATTITUDE = 0.002
"""rad, of motion capture's attitudes."""


@dataclass(frozen=True)
class Truth:
    """What a simulated vehicle is."""

    mass: float
    thrust: float
    drag: float
    latency: float


@dataclass(frozen=True)
class Flown:
    """A log and what is true of it."""

    recorded: Recorded
    vehicle: Vehicle
    true: Truth


def flown_logs(vehicle: Vehicle, seeds: Sequence[int], *, drag: float = 1.0, laps: int = 4, varied: bool = True) -> list[Flown]:
    """Fly a log for each seed, all of one drag: `drag` times the profile's."""
    nominal = airframe_of(vehicle)
    airframe = nominal.changed(rotor_drag=drag * nominal.rotor_drag, inflow_drag=drag * nominal.inflow_drag, drag_range=None)
    rng = np.random.default_rng([len(seeds), *seeds])
    n = len(seeds)
    thrust = rng.uniform(0.95, 1.05, n) if varied else np.ones(n)
    latency = rng.uniform(0.005, 0.025, n)
    line = [[-1.2, 0, 1], *([[1.2, 0, 1], [-1.2, 0, 1]] * laps)]
    path = legs(line, speed=0.9, hold=6.0)
    wanted = sample_reference({"quad0": path}, CONTROL_STEP, SUBSTEPS)
    controller = CONTROLLERS.find(vehicle.controller)
    start = np.tile(wanted.start, (1, n))
    fleet = Fleet(kinds_of((airframe,), n), controller, start, Differences(latency, thrust=thrust))
    sensor = MotionCapture(noise=CAMERAS)
    wind = [Wind((0.2 * np.cos(a), 0.2 * np.sin(a), 0.0), 0.1) for a in rng.uniform(0, 2 * np.pi, n)]
    mean = np.array([each.mean for each in wind]).T
    draws = Draws(Conditions(wind[0], sensor), seeds, 1)
    gusts = wind[0].at_first(draws.first())
    rows: dict[str, list[np.ndarray]] = {"state": [], "rotors": [], "known": []}
    for tick in range(wanted.ticks):
        draws.tick(tick)
        gusts = wind[0].after(gusts, draws.gust(), CONTROL_STEP)
        fleet.drain(CONTROL_STEP)
        flat = np.tile(wanted.wanted(tick), (1, 1, n))
        for half in range(2):
            fleet.look(seen(draws, sensor, half))
            rows["state"].append(fleet.state[:10].copy())
            rows["rotors"].append(fleet.rotors.copy())
            rows["known"].append(fleet.known[:3].copy())
            fleet.fly(flat, half, mean + gusts)
    state, rotors, known = (np.array(rows[name]) for name in ("state", "rotors", "known"))
    times = 0.01 * np.arange(len(state))
    found: list[Flown] = []
    for k in range(n):
        noise = np.random.default_rng([seeds[k], 7])
        angles = euler(state[:, 6:10, k].T).T + ATTITUDE * noise.standard_normal((len(state), 3))
        places = state[:, :3, k] + CAMERAS * noise.standard_normal((len(state), 3))
        columns = {"t": times, **{name: places[:, i] for i, name in enumerate("xyz")}}
        columns |= {name: angles[:, i] for i, name in enumerate(("roll", "pitch", "yaw"))}
        columns["thrust"] = rotors[:, :, k].sum(axis=1) / thrust[k]
        columns |= {f"e{name}": known[:, i, k] for i, name in enumerate("xyz")}
        true = Truth(vehicle.mass, thrust[k], airframe.rotor_drag, latency[k])
        found.append(Flown(even(columns), vehicle, true))
    return found
