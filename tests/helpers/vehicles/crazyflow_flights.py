"""Flights by crazyflow, in an interpreter that has it: set-points in, the worst distance and processor time out. Needs nothing of ours.

    python tests/helpers/vehicles/crazyflow_flights.py SETPOINTS.npz WORLDS

`SETPOINTS.npz` holds `wanted`, states at 100 Hz as crazyflow takes them, of shape (ticks, 16). All worlds fly the same; each hovers for 5 s before.
"""

from __future__ import annotations

import importlib.metadata
import itertools
import json
import sys
import time
import warnings

import numpy as np

RATE = 100
"""Hz, of set-points; the dynamics have 500."""


def main(path: str, worlds: int) -> None:
    """Fly the set-points in some worlds at once and print version, worst distance in mm and processor time of a flight in ms."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from crazyflow.sim import Sim  # pyright: ignore[reportMissingImports]

        sim = Sim(n_worlds=worlds, n_drones=1, drone="cf2x_L250", dynamics="first_principles", control="state", freq=500)
    wanted = np.load(path)["wanted"].astype(np.float32)
    sim.reset()
    first = np.broadcast_to(wanted[0, :3], (worlds, 1, 3))
    sim.data = sim.data.replace(states=sim.data.states.replace(pos=sim.data.states.pos * 0 + first))

    def fly(state: np.ndarray) -> np.ndarray:
        sim.state_control(np.broadcast_to(state, (worlds, 1, 16)))
        sim.step(500 // RATE)
        return np.asarray(sim.data.states.pos[:, 0])

    for _ in range(5 * RATE):
        fly(wanted[0])
    begun, worst = time.process_time(), 0.0
    for now, following in itertools.pairwise(wanted):
        worst = max(worst, float(np.linalg.norm(fly(now) - following[:3], axis=1).max()))
    spent = (time.process_time() - begun) / worlds
    print(json.dumps({"version": importlib.metadata.version("crazyflow"), "worst": 1000 * worst, "spent": 1000 * spent}))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
