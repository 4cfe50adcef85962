"""What a Crazyflie answers on CRTP, and flies: tables of contents, parameters, logs, trajectory memory, high-level commander, supervisor."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from flight.exports.crazyflies.memory import MEMORY, PIECE
from tests.helpers.vehicles.crazyflie_setpoints import SHUT, Streamed
from tests.helpers.vehicles.supervisor import Supervisor
from tests.helpers.vehicles.trajectory_bytes import compressed_trajectory, poly4d_trajectory
from verify.data import GRAVITY

EBUSY, ENOENT, EEXIST, LANDS = 16, 2, 17, 1
LOW = 0.08
"""m above where it stood, from which on motors that stop let a vehicle fall."""
Reply = tuple[int, int, bytes]
"""Port, channel and data."""

PARAMETERS = {
    "stabilizer.estimator": ("B", 1), "stabilizer.controller": ("B", 1), "ctrlMel.mass": ("f", 0.029),
    "ctrlMel.massThrust": ("f", 132000.0), "ctrlLee.mass": ("f", 0.034), "locSrv.extPosStdDev": ("f", 0.01),
    "locSrv.extQuatStdDev": ("f", 0.0045), "commander.enHighLevel": ("B", 1),
}  # fmt: skip
LOGS = {
    "stateEstimate.x": "f", "stateEstimate.y": "f", "stateEstimate.z": "f", "stateEstimate.yaw": "f", "supervisor.info": "H",
    "pm.batteryLevel": "B", "pm.state": "b", "kalman.varX": "f", "kalman.varY": "f", "kalman.varZ": "f",
    "kalman.varPX": "f", "kalman.varPY": "f", "kalman.varPZ": "f",
    "ctrltarget.x": "f", "ctrltarget.z": "f",
}  # fmt: skip
_PARAMETER_TYPES = {"B": 0x08, "f": 0x06}
_LOG_TYPES = {"B": 1, "H": 2, "b": 4, "f": 7}


@dataclass
class Manner:
    """How a vehicle behaves; what is not said is as the firmware does it. Times are s since it was switched on."""

    lacks: tuple[str, ...] = ()  # parameters and log variables
    keeps: tuple[str, ...] = ()  # parameters that it does not take
    blocks: bool = False  # its supervisor lets nothing fly
    blocks_after: int | None = None  # starts
    needs_arming: bool = False  # brushless
    spin_up: float = 0.26  # s from being armed to being able to fly, of a brushless one; never for infinity
    battery: float = 100.0
    unsettled: bool = False
    forgets: bool = False  # what is written to its memory
    version: int = 12
    off: float = 0.0  # m that its estimate is off, along x
    silent_since: float = math.inf  # switched off: the radio gives it up
    frozen_since: float = math.inf  # the radio does not notice


@dataclass
class Firmware:
    """One vehicle.

    Attributes:
        spinning: Whether its motors carry it.
        supervisor: Says what it may do, and what it does.
        fell: What cut its motors while it was in the air, and from how high, m: nothing of it was an emergency.
        busy: Starts that were answered EBUSY.
        stopped_in: The supervisor's state at each command to stop.
        stopped_since: When its motors were stopped last, s; infinite where they never were.
        impact: m/s at which it came down last.
        stopped_at: Height in m at which they were stopped last.
        locked: Whether it has to be switched off and on.
        starts: When it was told to start which trajectory.
        streamed: What was streamed to it.
        velocity: m/s.
    """

    name: str
    place: np.ndarray  # x, y, z, yaw
    clock: Callable[[], float]
    manner: Manner = field(default_factory=Manner)
    spinning: bool = False
    stopped_at: float = 0.0
    locked: bool = False
    dropped: bool = False
    starts: list[tuple[float, int]] = field(default_factory=list)
    commands: list[int] = field(default_factory=list)
    shown: list[tuple[float, ...]] = field(default_factory=list)
    parameters: dict[str, float] = field(default_factory=dict)
    memory: bytearray = field(default_factory=lambda: bytearray(MEMORY))
    watchdog: float | None = None
    streamed: Streamed = field(default_factory=Streamed)
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        self.supervisor = Supervisor(self.manner.needs_arming, self.manner.spin_up if self.manner.needs_arming else 0.0)
        self.supervisor.settle()
        self.fell: list[tuple[str, float]] = []
        self.busy: list[int] = []
        self.stopped_in: list[str] = []
        self.impact, self.stopped_since = 0.0, math.inf
        self._falls: tuple[float, float, float] | None = None  # since when, from where, and how fast it rose
        self.parameters = {k: v for k, (_, v) in PARAMETERS.items() if k not in self.manner.lacks}
        self.logs = [k for k in LOGS if k not in self.manner.lacks]
        self.blocks: dict[int, list[str]] = {}
        self.streams: dict[int, list[float]] = {}  # block to period and when it is due
        self.defined: dict[int, tuple[int, int, int]] = {}
        self._read: tuple[bytes, object] = (b"", None)
        self.measured = np.array(self.place)
        self._plan: tuple[str, float, object] = ("rest", 0.0, np.array(self.place))

    # What it flies

    def wanted(self, now: float) -> np.ndarray:
        """Return x, y, z, heading and four derivatives. Shape (5, 4)."""
        if self.streamed.first and self.spinning:
            return self.streamed.wanted(now, self.measured, self.velocity)
        kind, begin, what = self._plan
        t = max(now - begin, 0.0)
        if kind == "rest":
            return np.vstack([what, np.zeros((4, 4))])
        if kind == "poly":
            coefficients, length = what
            if t > length:
                return np.vstack([_derivatives(coefficients, length)[0], np.zeros((4, 4))])
            return _derivatives(coefficients, t)
        path = self._decoded(*what)
        if t < path.duration:
            return np.stack([path.evaluate(t, order) for order in range(5)])
        return np.vstack([path.evaluate(path.duration), np.zeros((4, 4))])

    def _decoded(self, offset: int, pieces: int, kind: int):
        """Read the memory as it is now: what is written over a trajectory that is flown moves the vehicle at once."""
        data = bytes(self.memory[offset:] if kind == 1 else self.memory[offset : offset + PIECE * pieces])
        if data != self._read[0]:
            self._read = data, compressed_trajectory(data) if kind == 1 else poly4d_trajectory(data)
        return self._read[1]

    def stop_motors(self, why: str = "emergency") -> None:
        """Have motors carry it no longer: in the air it falls.

        Args:
            why: Who did it: an emergency stop, its own landing, or what is a fault of who told it.
        """
        if self.spinning:
            height = float(self.measured[2]) - float(self.place[2])
            self.stopped_at, self.stopped_since = float(self.measured[2]), self.clock()
            self._falls = (self.clock(), height, float(self.velocity[2]))
            if why not in ("emergency", "landed") and height > LOW:
                self.fell.append((why, height))
        place = self.wanted(self.clock())[0].copy()
        self.spinning = False
        self._plan = ("rest", 0.0, place)

    def true_place(self, flown: np.ndarray) -> np.ndarray:
        """Return where it is, x, y, z in m: where the simulation has it, or as far down as it has fallen with motors off.

        Args:
            flown: Where the simulation has it.
        """
        if self._falls is None or self.spinning:
            self._falls = None if self.spinning else self._falls
            return flown
        since, height, rises = self._falls
        t = self.clock() - since
        left = height + rises * t - 0.5 * GRAVITY * t * t
        if left <= 0.0:
            self.impact = math.sqrt(max(rises**2 + 2.0 * GRAVITY * max(height, 0.0), 0.0))
        return np.array([*flown[:2], float(self.place[2]) + max(left, 0.0)])

    def tick(self) -> None:
        """Do what is done all the time: both watchdogs, the supervisor, and the end of a landing."""
        now = self.clock()
        alone = self.watchdog is not None and now > self.watchdog + 1.0
        old = self.streamed.first and self.spinning and self.streamed.age(now) > SHUT
        if alone or old:
            self.locked = True
        self.supervisor.emergency |= self.locked
        self.supervisor.look(now, thrust=self.spinning)
        if self.spinning and not self._can_fly:
            self.stop_motors("emergency" if self.locked or self._blocked else "disarmed")
        kind, begin, what = self._plan
        if kind == "poly" and len(what) == 2 and self.landing and now > begin + what[1]:
            self.landing = False
            self.stop_motors("landed")

    landing, measured_at, asked_to_stop = False, 0.0, False

    @property
    def armed(self) -> bool:
        """Whether it is armed."""
        return self.supervisor.armed

    @property
    def _blocked(self) -> bool:
        return self.manner.blocks or (self.manner.blocks_after is not None and len(self.starts) >= self.manner.blocks_after)

    @property
    def _can_fly(self) -> bool:
        return self.supervisor.can_fly and not self._blocked and not self.locked

    @property
    def info(self) -> int:
        kind, begin, what = self._plan
        length = 0.0 if kind == "rest" else what[1] if kind == "poly" else self._decoded(*what).duration
        own = self.supervisor.info & ~(8 if self._blocked else 0)
        return own | (self.spinning and kind != "rest") * 256 | (self.clock() >= begin + length) * 512

    # What it answers

    def receive(self, port: int, channel: int, data: bytes) -> list[Reply]:
        """Take in one packet, and return what is answered."""
        if port == 15:
            return [(15, 0, data)] if channel == 0 else [(15, 1, b"Bitcraze Crazyflie\0" + bytes(8))]
        if port == 13:
            if channel == 1:
                return [(13, 1, bytes((0, self.manner.version)))]
            if channel == 0 and data[0] == 1:
                self.supervisor.request(bool(data[1]))
            return []
        answer = {2: self._parameter, 4: self._memory, 5: self._log, 8: self._command, 9: self._supervise}.get(port)
        if answer is not None:
            return [(port, channel, reply) for reply in answer(channel, data)]
        if port == 6 and channel == 1:
            self._localise(data)
        if port == 7:
            self._stream(channel, data)
        if port == 3 and self.spinning:  # a set-point without thrust goes before the high-level commander
            self.dropped = True
            self.stop_motors()
        return []

    def _stream(self, channel: int, data: bytes) -> None:
        """Take a set-point, which stops the high-level commander, or that they have ended: then it is followed again, or motors stop."""
        if channel == 0:
            self.landing, self._plan = False, ("rest", 0.0, self.measured.copy())
            self.streamed.take(data, self.clock())
            if self.streamed.flat is None or not self._can_fly:
                self.dropped |= self.spinning
                self.stop_motors()
            else:
                self.spinning = True
        elif data[0] == 0 and self.streamed.first:
            self.streamed.first = False
            if self._plan[0] == "rest" and self.spinning:
                self.dropped |= not self.asked_to_stop
                self.stop_motors("stopped" if self.asked_to_stop else "emergency")

    def _localise(self, data: bytes) -> None:
        if data[0] == 8:
            self.shown.append(struct.unpack("<7f", data[1:29]))
        elif data[0] == 3:
            self._supervise(1, b"\x03")
        elif data[0] == 4:
            self._supervise(1, b"\x04")

    def _toc(self, data: bytes, names: list[str], kind: Callable[[str], int]) -> list[bytes]:
        if data[0] == 3:
            return [struct.pack("<BHIBB", 3, len(names), 0, 16, 128)]
        (number,) = struct.unpack("<H", data[1:3])
        group, name = names[number].split(".")
        return [struct.pack("<BHB", 2, number, kind(names[number])) + f"{group}\0{name}\0".encode()]

    def _parameter(self, channel: int, data: bytes) -> list[bytes]:
        names = list(self.parameters)
        if channel == 0:
            return self._toc(data, names, lambda key: _PARAMETER_TYPES[PARAMETERS[key][0]])
        key = names[struct.unpack("<H", data[:2])[0]]
        form = f"<{PARAMETERS[key][0]}"
        if channel == 2:
            if key not in self.manner.keeps:
                (self.parameters[key],) = struct.unpack(form, data[2:])
            return [data[:2] + struct.pack(form, self.parameters[key])]
        return [data[:2] + b"\0" + struct.pack(form, self.parameters[key])]

    def _memory(self, channel: int, data: bytes) -> list[bytes]:
        if channel == 0:
            return [bytes((1, 1))] if data[0] == 1 else [struct.pack("<BBBI8x", 2, 0, 0x12, MEMORY)]
        number, address = struct.unpack("<BI", data[:5])
        if channel == 1:
            return [struct.pack("<BIB", number, address, 0) + bytes(self.memory[address : address + data[5]])]
        fits = address + len(data) - 5 <= MEMORY
        if fits and not self.manner.forgets:
            self.memory[address : address + len(data) - 5] = data[5:]
        return [struct.pack("<BIB", number, address, 0 if fits else 5)]

    def _log(self, channel: int, data: bytes) -> list[bytes]:
        if channel == 0:
            return self._toc(data, self.logs, lambda key: _LOG_TYPES[LOGS[key]])
        command = data[0]
        if command == 5:
            self.blocks.clear()
            self.streams.clear()
            return [bytes((5, 0, 0))]
        block = data[1]
        if command == 6:
            known = block in self.blocks
            self.blocks[block] = [self.logs[struct.unpack("<H", data[i + 1 : i + 3])[0]] for i in range(2, len(data), 3)]
            return [bytes((6, block, EEXIST if known else 0))]
        if command == 3:
            self.stopped_in.append(self.supervisor.state)
            self.streams[block] = [data[2] / 100.0, self.clock()]
        return [bytes((command, block, 0 if block in self.blocks else ENOENT))]

    def due(self) -> list[Reply]:
        """Return the log packets that are due."""
        now, found = self.clock(), []
        stamp = int(1000 * self.measured_at)
        for block, stream in self.streams.items():
            if now >= stream[1]:
                stream[1] = max(stream[1] + stream[0], now - stream[0])
                values = b"".join(struct.pack(f"<{LOGS[key]}", self._value(key)) for key in self.blocks[block])
                found.append((5, 2, bytes((block,)) + stamp.to_bytes(3, "little") + values))
        return found

    def _value(self, key: str) -> float:
        group, _, name = key.partition(".")
        if group == "ctrltarget":
            return self._target["xyz".index(name)]
        if group == "stateEstimate":
            value = self.measured[("x", "y", "z", "yaw").index(name)]
            return math.degrees(value) if name == "yaw" else value + self.manner.off * (name == "x")
        battery = self.manner.battery
        told = {"pm.batteryLevel": int(battery), "pm.state": 3 if battery <= 0 else 0}
        return self.info if key == "supervisor.info" else told.get(key, self._variance(key))

    def _variance(self, key: str) -> float:
        """What the filter says of `kalman.var...`: X, Y, Z are its position's, m^2; PX, PY, PZ its velocity's, (m/s)^2, which settles."""
        return self.clock() if self.manner.unsettled and not key.startswith("kalman.varP") else 1e-5

    @property
    def _target(self) -> np.ndarray:
        """The place that it follows; the origin while motors stand still."""
        if not self.spinning:
            return np.zeros(4)
        return self.streamed.flat[0] if self.streamed.first else self.wanted(self.clock())[0]

    def _supervise(self, channel: int, data: bytes) -> list[bytes]:
        if channel == 0:
            return [bytes((0x8C,)) + struct.pack("<H", self.info)] if data[0] == 0x0C else []
        if data[0] == 1:
            taken = self.supervisor.request(bool(data[1]))
            return [bytes((0x81, taken, self.supervisor.armed))]
        if data[0] == 3:
            self.locked = True
            self.stop_motors()
        if data[0] == 4:
            self.watchdog = self.clock()
        return []

    def _command(self, channel: int, data: bytes) -> list[bytes]:
        """Obey the high-level commander's port; its answer is the command, two of its bytes, and 0 or why not."""
        self.commands.append(data[0])
        return [data[:3].ljust(3, b"\0") + bytes((self._obey(data),))]

    def _obey(self, data: bytes) -> int:
        now, command = self.clock(), data[0]
        if command == 6:
            number, _, kind, offset, pieces = struct.unpack("<BBBIB", data[1:9])
            self.defined[number] = (offset, pieces, kind)
            return 0
        if not self._can_fly:
            self.busy += [command] if command in (13, 5) else []
            return EBUSY
        if command == 3:
            self.stopped_in.append(self.supervisor.state)
            self.asked_to_stop, self.landing = True, False
            if self.streamed.first:
                self._plan = ("rest", 0.0, self.measured.copy())
            else:
                self.stop_motors("stopped")
        elif command in (13, 5):
            number = data[5 if command == 13 else 4]
            assert struct.unpack("<f", data[-4:]) == (1.0,), "a time scale voids the certificate"
            assert not any(data[2:-5]), "relative or reversed"
            self.starts.append((now, number))
            if number in self.defined:
                self.spinning, self.landing = True, False
                self._plan = ("path", now, self.defined[number])
        elif command == 12 and self.spinning:
            x, y, z, yaw, seconds = struct.unpack("<5f", data[4:24])
            self._go(np.array([x, y, z, yaw]), seconds, now, landing=False)
        elif command == 8 and self.landing:
            return LANDS
        elif command == 8 and self.spinning:
            height, _, _, seconds = struct.unpack("<ff?f", data[2:15])
            place = self._own(now)[0].copy()
            place[2] = height
            self._go(place, seconds, now, landing=True)
        return 0

    def _own(self, now: float) -> np.ndarray:
        """Return what its high-level commander begins from: what it follows, or, where it was stopped, how the vehicle flies. Shape (5, 4)."""
        if not self.streamed.first or self._plan[0] != "rest":
            streamed, self.streamed.first = self.streamed.first, False
            flat = self.wanted(now)
            self.streamed.first = streamed
            return flat
        flat = np.zeros((5, 4))
        flat[0], flat[1, :3] = self.measured, self.velocity
        return flat

    def _go(self, place: np.ndarray, seconds: float, now: float, *, landing: bool) -> None:
        """Plan a polynomial of degree 7 to a rest; a landing begins from one, too."""
        flat, length = self._own(now), max(seconds, 0.1)
        if landing:
            flat[1:] = 0.0
        rows = [[0.0] * 8 for _ in range(8)]
        for order in range(4):
            for power in range(order, 8):
                factor = math.perm(power, order)
                rows[order][power] = factor * 0.0 ** (power - order)
                rows[4 + order][power] = factor * length ** (power - order)
        ends = np.vstack([flat[:3], np.zeros((1, 4)), place, np.zeros((3, 4))])
        self._plan, self.landing = ("poly", now, (np.linalg.solve(np.array(rows), ends), length)), landing


def _derivatives(coefficients: np.ndarray, t: float) -> np.ndarray:
    """Return a polynomial's value and four derivatives. Shape (8, 4) to (5, 4)."""
    return np.array(
        [
            sum(math.perm(power, order) * t ** (power - order) * coefficients[power] for power in range(order, 8))
            for order in range(5)
        ]
    )
