"""A vehicle's trajectory memory of 4096 bytes behind cflib's own element, and an evaluator that reads it as the firmware does.

At the end of a trajectory the high-level planner goes on reading the last piece from memory; only another command, such as a
go-to, ends that. So what is written while a vehicle hovers at a trajectory's end moves its set-point at once.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flight.exports.crazyflies.crazyflie import write_entry
from flight.exports.crazyflies.memory import MEMORY, PIECE, Entry

Place = NDArray[np.float64]


@dataclass
class Vehicle:
    """One vehicle's memory, and what its planner does.

    Attributes:
        memory: What was written over the radio.
        trajectory: Offset and number of pieces of what is flown; None while a go-to holds.
        begun: s, when it was started.
        held: Where a go-to holds: x, y, z in m and heading in rad.
    """

    memory: bytearray = field(default_factory=lambda: bytearray(MEMORY))
    trajectory: tuple[int, int] | None = None
    begun: float = 0.0
    held: Place = field(default_factory=lambda: np.zeros(4))
    defined: dict[int, tuple[int, int]] = field(default_factory=dict[int, tuple[int, int]])

    def write(self, element: object, address: int, data: bytes, flush_queue: bool) -> None:  # cflib's call
        """Take what cflib writes."""
        assert address + len(data) <= MEMORY
        self.memory[address : address + len(data)] = data
        element.write_done(element, address)  # type: ignore[attr-defined]

    def upload(self, entry: Entry) -> None:
        """Write and define a trajectory through cflib's memory element."""
        from cflib.crazyflie.mem.trajectory_memory import TrajectoryMemory

        assert write_entry(TrajectoryMemory(id=1, type=0x12, size=MEMORY, mem_handler=self), entry)
        self.defined[entry.trajectory_id] = entry.offset, entry.pieces

    def go_to(self, place: Place) -> None:
        """Hold where it is told."""
        self.held, self.trajectory = np.array(place), None

    def start(self, trajectory_id: int, now: float) -> None:
        """Fly a trajectory."""
        self.trajectory, self.begun = self.defined[trajectory_id], now

    def set_point(self, now: float) -> Place:
        """Return x, y, z and heading that the planner asks for, in float32 as on board."""
        if self.trajectory is None:
            return self.held
        offset, pieces = self.trajectory
        table = np.frombuffer(bytes(self.memory), dtype="<f4", count=pieces * PIECE // 4, offset=offset).reshape(pieces, 33)
        left = np.float32(now - self.begun)
        number = 0
        while number < pieces - 1 and left > table[number, 32]:
            left = np.float32(left - table[number, 32])
            number += 1
        row = table[number]
        left = min(left, row[32])
        value = np.zeros(4, dtype=np.float32)
        for power in range(7, -1, -1):
            value = value * left + row[:32].reshape(4, 8)[:, power]
        return value.astype(np.float64)
