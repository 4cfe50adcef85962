"""One Crazyflie over cflib: commands go out by a thread of its own, and what it last said is kept.

cflib's calls may wait for the radio, for seconds where a vehicle is gone; nobody else's commands wait with them.
"""

from __future__ import annotations

import functools
import math
import struct
import threading
from collections import deque
from collections.abc import Callable
from enum import IntFlag
from queue import SimpleQueue
from typing import Any

from flight.exports.crazyflies.memory import Entry
from flight.link.link import Pose
from verify.data import MissingEngine

AGAIN = 0.1
"""s after which a command that was not answered is sent again."""
EBUSY = 16
"""What the high-level commander answers while the supervisor lets nothing fly."""
_SETTLED = 0.001
"""m^2 that the variances of the estimated position may change by in half a second where the estimator has settled."""
_DRIFT = 2e-4
"""Share by which a vehicle's clock may run slower than ours."""
_HALF = 1 << 23
"""Half of the milliseconds that a vehicle counts before it begins anew."""
_FULL = 200
"""Commands that wait for the radio before nothing that comes again and again is added."""

_POSE = ("stateEstimate.x", "stateEstimate.y", "stateEstimate.z", "stateEstimate.yaw")
_VARIANCES = ("kalman.varPX", "kalman.varPY", "kalman.varPZ")
_HEALTH = ("supervisor.info", "pm.batteryLevel", "pm.state", *_VARIANCES)
_LOW_POWER = 3
"""`pm.state` of an empty battery; higher ones switch off."""
_STOP, _GO_TO, _START, _DEFINE, _LAND = 3, 12, 13, 6, 8
"""Commands of the high-level commander, as its answers name them; older firmware answers `_OLDER`."""
_OLDER = {_GO_TO: 4, _START: 5}
_COMMANDER, _SUPERVISOR, _PLATFORM, _LOCALIZATION = 8, 9, 13, 6
"""Ports of CRTP."""
_OWN_PORT = 12
"""Protocol version from which on the supervisor has a port of its own."""
_ARM, _EMERGENCY, _WATCHDOG = 1, 3, 4


class State(IntFlag):
    """Bits of `supervisor.info`."""

    CAN_ARM = 1 << 0
    ARMED = 1 << 1
    CAN_FLY = 1 << 3
    TUMBLED = 1 << 5
    LOCKED = 1 << 6
    CRASHED = 1 << 7
    ACTIVE = 1 << 8
    FINISHED = 1 << 9


@functools.cache
def cflib_drivers() -> Any:  # cflib has no types
    """Return cflib's door to radios, with its drivers made once.

    Raises:
        MissingEngine: cflib is not installed.
    """
    try:
        import cflib.crtp as crtp
    except ImportError:
        raise MissingEngine("flying Crazyflies needs cflib: pip install 'ltlplan[crazyflie]'.") from None
    crtp.init_drivers()
    return crtp


class Vehicle:
    """One Crazyflie.

    Attributes:
        name: The robot's.
        uri: Its address.
        now: The link's clock, s.
        failure: Why it cannot be reached; empty while it can.
        heard: When its last packet came, s.
        pose: Where it was measured last.
        estimate: Where it takes itself to be.
        board: Parameters as they were last read from board.
        reads: How often each was read.
        upload: How the last upload stands: None while it goes on, else whether all bytes are on board as they were sent.
    """

    def __init__(self, name: str, uri: str, now: Callable[[], float]) -> None:
        """Prepare to reach it.

        Args:
            name: The robot's.
            uri: Its address.
            now: The link's clock, s.

        Raises:
            MissingEngine: cflib is not installed.
        """
        cflib_drivers()
        from cflib.crazyflie import Crazyflie

        self.name, self.uri, self.now, self.failure, self.heard = name, uri, now, "", -math.inf
        self.pose: Pose | None = None
        self.estimate: Pose | None = None
        self.board: dict[str, float] = {}
        self.reads: dict[str, int] = {}
        self.upload: bool | None = None
        self._told: dict[str, float] = {}
        self._reports = False
        self._told_at, self._stamp, self._offset, self._offset_at = -math.inf, 0, math.inf, 0.0
        self._variances: deque[tuple[float, ...]] = deque(maxlen=10)
        self._answers: dict[int, int] = {}
        self._asked: tuple[object, ...] = ()
        self._sent = -math.inf
        self._connected = threading.Event()
        self._calls: SimpleQueue[Callable[[], object] | None] = SimpleQueue()
        self._cf: Any = Crazyflie()
        self._cf.fully_connected.add_callback(lambda _: self._connected.set())
        self._cf.connection_failed.add_callback(self._fail)
        self._cf.connection_lost.add_callback(self._fail)
        self._cf.packet_received.add_callback(self._hear)
        self._cf.add_port_callback(_COMMANDER, self._answer)
        self._cf.param.all_update_callback.add_callback(self._read)
        self._worker = threading.Thread(target=self._work, name=f"commands to {name}", daemon=True)
        self._worker.start()

    # Being reached

    def open(self) -> None:
        """Begin to connect: tables of contents and all parameters are read."""
        self.heard = self.now()
        self.send(lambda: self._cf.open_link(self.uri))

    @property
    def connected(self) -> bool:
        """Whether it is reached, and all that it has is known."""
        return self._connected.is_set() and not self.failure

    def send(self, call: Callable[[], object]) -> None:
        """Have something sent after what waits already."""
        self._calls.put(call)

    def close(self, *, landed: bool) -> None:
        """Let go of it.

        Args:
            landed: Whether its motors are known to stand still. cflib's own good-bye is a set-point without thrust: it goes to nobody who flies.
        """
        self._calls.put(None)
        self._worker.join(timeout=3.0)
        cf = self._cf
        cf.incoming.stop()
        if cf.incoming.is_alive():
            cf.incoming.join(timeout=2.0)
        link = cf.link
        if not landed and link is not None:
            cf.link = None
            link.close()
        cf.close_link()

    def _work(self) -> None:
        while (call := self._calls.get()) is not None:
            try:
                call()
            except Exception as error:  # cflib raises what its drivers do
                self._fail(self.uri, str(error) or type(error).__name__)

    def _fail(self, _uri: str, why: str) -> None:
        first = (why or "the link to it was lost").splitlines()[0].removeprefix("Couldn't load link driver: ").strip()
        self.failure = self.failure or first.removesuffix(f": {self.uri}").removesuffix(".")

    def _hear(self, _packet: Any) -> None:  # cflib's packets have no types
        self.heard = self.now()

    # What it says

    def listen(self) -> list[str]:
        """Have it report pose and health; return what its firmware does not have of what is needed."""
        from cflib.crazyflie.log import LogConfig

        toc = self._cf.log.toc.toc
        has = [name for name in (*_POSE, *_HEALTH) if name.split(".")[1] in toc.get(name.split(".")[0], {})]
        if missing := [name for name in _POSE if name not in has]:
            return missing
        for block, period, names in (("pose", 20, _POSE), ("health", 50, _HEALTH)):
            if not (kept := [name for name in names if name in has]):
                continue
            self._reports |= names is _HEALTH
            config = LogConfig(name=block, period_in_ms=period)
            for name in kept:
                config.add_variable(name)
            config.data_received_cb.add_callback(self._place if names is _POSE else self._tell)
            self.send(functools.partial(self._begin, config))
        return []

    def _begin(self, config: Any) -> None:
        self._cf.log.add_config(config)
        config.start()

    def _place(self, stamp: int, values: dict[str, float], _config: object) -> None:
        """Take in a pose, at the instant when it was measured: the least delay of all packets is the one that counts."""
        now = self.now()
        since = self._stamp + ((stamp - self._stamp + _HALF) % (2 * _HALF) - _HALF)
        if self.estimate is not None and since <= self._stamp:
            return  # it was overtaken on its way
        self._stamp = since
        self._offset = min(self._offset + _DRIFT * (now - self._offset_at), now - since / 1000.0)
        self._offset_at = now
        x, y, z, yaw = (values[name] for name in _POSE)
        self.estimate = Pose(since / 1000.0 + self._offset, (x, y, z), math.radians(yaw))

    def _tell(self, _stamp: int, values: dict[str, float], _config: object) -> None:
        self._told, self._told_at = dict(values), self.now()
        if all(name in values for name in _VARIANCES):
            self._variances.append(tuple(values[name] for name in _VARIANCES))

    def _read(self, key: str, value: str) -> None:
        self.board[key] = float(value)
        self.reads[key] = self.reads.get(key, 0) + 1

    @property
    def state(self) -> State | None:
        """What its supervisor last said; None where it says nothing."""
        info = self._told.get("supervisor.info")
        return None if info is None else State(int(info) & sum(State))

    @property
    def state_at(self) -> float:
        """When it said so, s."""
        return self._told_at

    @property
    def watched(self) -> bool:
        """Whether its pose is known, and its health for half a second, where it says something of it."""
        health = not self._reports or (bool(self._told) and len(self._variances) in (0, self._variances.maxlen))
        return health and self.estimate is not None

    @property
    def settled(self) -> bool | None:
        """Whether the variances of its estimated position stay as they are; None where it does not say."""
        if not self._variances:
            return None
        return self.watched and all(max(axis) - min(axis) < _SETTLED for axis in zip(*self._variances, strict=True))

    @property
    def battery(self) -> float | None:
        """Share of its charge that is left; None where it does not say."""
        if self._told.get("pm.state", 0.0) >= _LOW_POWER:
            return 0.0
        level = self._told.get("pm.batteryLevel")
        return None if level is None else level / 100.0

    # Parameters

    def has(self, key: str) -> bool:
        """Whether its firmware has a parameter, such as `ctrlMel.mass`."""
        group, _, name = key.partition(".")
        return name in self._cf.param.toc.toc.get(group, {})

    def set(self, key: str, value: float) -> None:
        """Set a parameter, and read it from board: two more `reads`."""
        self.send(lambda: self._cf.param.set_value(key, value))
        self.send(lambda: self._cf.param.request_param_update(key))

    # Trajectories

    @property
    def room(self) -> int:
        """Bytes of trajectory memory."""
        return sum(memory.size for memory in self._trajectory_memories())

    def write(self, entry: Entry) -> None:
        """Write a trajectory's bytes and read them from board; `upload` says how that went."""
        memory, mem = self._trajectory_memories()[0], self._cf.mem
        self.upload = None

        class _Bytes:
            def pack(self) -> bytes:
                return entry.data

        def read(element: Any, address: int, data: bytes) -> None:
            if element.id == memory.id and address == entry.offset:
                mem.mem_read_cb.remove_callback(read)
                self.upload = bytes(data) == entry.data

        def written(_element: object, _address: int) -> None:
            mem.mem_read_cb.add_callback(read)
            mem.read(memory, entry.offset, len(entry.data))

        def failed(_element: object, _address: int) -> None:
            self.upload = False

        def write() -> None:
            memory.trajectory = [_Bytes()]
            memory.write_data(written, failed, start_addr=entry.offset)

        self.send(write)

    def define(self, entry: Entry) -> bool:
        """Have it know where a trajectory lies; return whether it has acknowledged that."""
        define = self._cf.high_level_commander.define_trajectory
        arguments = (entry.trajectory_id, entry.offset, entry.pieces, entry.kind)
        return self._ask(("define", entry.trajectory_id, entry.offset, entry.pieces), _DEFINE, lambda: define(*arguments))

    def _trajectory_memories(self) -> Any:
        from cflib.crazyflie.mem import MemoryElement

        return self._cf.mem.get_mems(MemoryElement.TYPE_TRAJ)

    # Commands

    def go_to(self, place: tuple[float, float, float, float], seconds: float) -> bool:
        """Have it go to x, y, z in m with a heading in rad; return whether it has acknowledged that."""
        go_to = self._cf.high_level_commander.go_to
        return self._ask(("go to", *place, seconds), _GO_TO, lambda: go_to(*place, seconds))

    def land(self, height: float, seconds: float) -> bool:
        """Have it sink to a height in m; return whether it has acknowledged that."""
        land = self._cf.high_level_commander.land
        return self._ask(("land", height, seconds), _LAND, lambda: land(height, seconds, yaw=None))

    def stop(self) -> bool:
        """Have it stop its motors; return whether it has acknowledged that, or its supervisor lets no motor turn."""
        done = self._ask(("stop",), _STOP, self._cf.high_level_commander.stop)
        fresh = self.state is not None and self.state_at > self._sent
        return done or (fresh and State.CAN_FLY not in (self.state or State.CAN_FLY))

    def expect_start(self) -> None:
        """Take the next answer to a start for that of the start that comes now."""
        self._asked = ("start",)
        self._answers.pop(_START, None)

    def start(self, number: int) -> None:
        """Have it start a stored trajectory."""
        self.send(lambda: self._cf.high_level_commander.start_trajectory(number))

    @property
    def started(self) -> int | None:
        """What it answered to the start that was expected: 0 where it flies; None before it has."""
        return self._answers.get(_START)

    @property
    def refused(self) -> int:
        """Its last answer, where that was no acknowledgement; 0 else."""
        return next((answer for answer in self._answers.values() if answer), 0)

    def start_packet(self, number: int) -> Any:
        """Return the packet that starts a stored trajectory, as all vehicles of a channel understand it."""
        from cflib.crtp.crtpstack import CRTPPacket

        if self._cf.platform.get_protocol_version() < 10:
            data = struct.pack("<BBBBBf", _OLDER[_START], 0, 0, 0, number, 1.0)
        else:
            data = struct.pack("<BBBBBBf", _START, 0, 0, 0, 0, number, 1.0)
        return _packet(CRTPPacket, _COMMANDER, 0, data)

    def arm(self) -> None:
        """Ask it to arm."""
        self._supervise((_ARM, 1), (_PLATFORM, 0, (1, 1)))

    def emergency(self) -> None:
        """Have it stop its motors whatever it does; it has to be switched off and on then."""
        self._supervise((_EMERGENCY,), (_LOCALIZATION, 1, (3,)))

    def alive(self) -> None:
        """Say that somebody is here: from the first time on it stops its motors 1 s after the last."""
        if self._calls.qsize() < _FULL:
            self._supervise((_WATCHDOG,), (_LOCALIZATION, 1, (4,)))

    def show(self, position: tuple[float, float, float], attitude: tuple[float, float, float, float]) -> None:
        """Send it where motion capture sees it.

        Args:
            position: x, y, z in m.
            attitude: Quaternion x, y, z, w.
        """
        if self._calls.qsize() < _FULL:
            self.send(lambda: self._cf.extpos.send_extpose(*position, *attitude))

    def _supervise(self, data: tuple[int, ...], older: tuple[int, int, tuple[int, ...]]) -> None:
        """Send to the supervisor's port, or where older firmware has the same: port, channel and data."""
        from cflib.crtp.crtpstack import CRTPPacket

        own = self._cf.platform.get_protocol_version() >= _OWN_PORT
        port, channel, content = (_SUPERVISOR, 1, data) if own else older
        packet = _packet(CRTPPacket, port, channel, bytes(content))
        self.send(lambda: self._cf.send_packet(packet))

    def _ask(self, what: tuple[object, ...], code: int, send: Callable[[], object]) -> bool:
        """Send a command until it is answered; return whether it was acknowledged."""
        now = self.now()
        if what != self._asked:
            self._asked, self._sent = what, -math.inf
            self._answers.clear()
        if self._answers.get(code) == 0:
            return True
        if now - self._sent >= AGAIN and not self.failure:
            self._sent = now
            self.send(send)
        return False

    def _answer(self, packet: Any) -> None:
        """Take in the commander's answer: the command, two of its bytes, and 0 or why not."""
        data = bytes(packet.data)
        if len(data) >= 4:
            code = next((code for code, older in _OLDER.items() if older == data[0]), data[0])
            self._answers[code] = data[3]


def _packet(make: Any, port: int, channel: int, data: bytes) -> Any:  # cflib's packets have no types
    packet = make()
    packet.set_header(port, channel)
    packet.data = data
    return packet
