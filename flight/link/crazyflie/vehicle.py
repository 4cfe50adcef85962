"""One Crazyflie over cflib: commands go out by a thread of its own, and what it last said is kept.

cflib's calls may wait for the radio, for seconds where a vehicle is gone; nobody else's commands wait with them.
"""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

from flight.exports.crazyflies.memory import Entry
from flight.exports.scripts.flying.supervisor import State
from flight.link.crazyflie import packets
from flight.link.crazyflie.aim import LANDS, Aim
from flight.link.crazyflie.reports import Reports
from flight.link.link import Pose
from verify.data import MissingEngine

AGAIN = 0.1
"""s after which a command that was not answered is sent again."""
EBUSY = 16
"""What the high-level commander answers while the supervisor lets nothing fly."""
_FULL = 200
"""Commands that wait for the radio before nothing that comes again and again is added."""


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
        pose: Where motion capture saw it last.
        reports: What it says of itself.
        board: Parameters as they were last read from board.
        reads: How often each was read.
        aim: Sends it set-points.
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
        self.reports = Reports(now)
        self.board: dict[str, float] = {}
        self.reads: dict[str, int] = {}
        self.upload: bool | None = None
        self._answers: dict[int, int] = {}
        self._asked: tuple[object, ...] = ()
        self._asked_at, self._sent = 0.0, -math.inf
        self._connected = threading.Event()
        self._calls: SimpleQueue[Callable[[], object] | None] = SimpleQueue()
        self._cf: Any = Crazyflie()
        self.aim = Aim(self._cf, lambda call: self.send(call) if self._calls.qsize() < _FULL else None)
        self._cf.fully_connected.add_callback(lambda _: self._connected.set())
        self._cf.connection_failed.add_callback(self._fail)
        self._cf.connection_lost.add_callback(self._fail)
        self._cf.packet_received.add_callback(self._hear)
        self._cf.add_port_callback(packets.COMMANDER, self._answer)
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
        """True if it is reached, and all that it has is known."""
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

    def listen(self) -> list[str]:
        """Have it report; return what its firmware does not have of what is needed."""
        return self.reports.begin(self._cf, self.send)

    # Parameters

    def _read(self, key: str, value: str) -> None:
        self.board[key] = float(value)
        self.reads[key] = self.reads.get(key, 0) + 1

    def has(self, key: str) -> bool:
        """Return whether its firmware has a parameter, such as `ctrlMel.mass`."""
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
        return self._ask(
            ("define", entry.trajectory_id, entry.offset, entry.pieces), packets.DEFINE, lambda: define(*arguments)
        )

    def _trajectory_memories(self) -> Any:
        from cflib.crazyflie.mem import MemoryElement

        return self._cf.mem.get_mems(MemoryElement.TYPE_TRAJ)

    # Commands

    def go_to(self, place: tuple[float, float, float, float], seconds: float) -> bool:
        """Have it go to x, y, z in m with a heading in rad; return whether it has acknowledged that."""
        go_to = self._cf.high_level_commander.go_to
        return self._ask(("go to", *place, seconds), packets.GO_TO, lambda: go_to(*place, seconds))

    def land(self, height: float, seconds: float) -> bool:
        """Have it sink to a height in m; return whether it has acknowledged that."""
        land = self._cf.high_level_commander.land
        return self._ask(("land", height, seconds), packets.LAND, lambda: land(height, seconds, yaw=None), (0, LANDS))

    def stop(self) -> bool:
        """Have it stop its motors; return whether it has acknowledged that, or its supervisor lets no motor turn."""
        done = self._ask(("stop",), packets.STOP, self._cf.high_level_commander.stop)
        state = self.reports.state
        return done or (state is not None and State.CAN_FLY not in state and self.reports.state_at > self._asked_at)

    def expect_start(self) -> None:
        """Take the next answer to a start for that of the start that comes now."""
        self._asked = ("start",)
        self._answers.pop(packets.START, None)

    def start(self, number: int) -> None:
        """Have it start a stored trajectory."""
        self.send(lambda: self._cf.high_level_commander.start_trajectory(number))

    @property
    def started(self) -> int | None:
        """Its answer to the start that was expected: 0 where it flies; None before it has answered."""
        return self._answers.get(packets.START)

    def start_packet(self, number: int) -> Any:  # cflib's packets have no types
        """Return the packet that starts a stored trajectory, as all vehicles of a channel understand it."""
        return packets.start(self._version, number)

    def arm(self) -> None:
        """Ask it to arm."""
        self._supervise(packets.ARM)

    def emergency(self) -> None:
        """Have it stop its motors whatever it does; it has to be switched off and on then."""
        self._supervise(packets.EMERGENCY)

    def alive(self) -> None:
        """Say that somebody is here: from the first time on it stops its motors 1 s after the last."""
        if self._calls.qsize() < _FULL:
            self._supervise(packets.WATCHDOG)

    def show(self, position: tuple[float, float, float], attitude: tuple[float, float, float, float]) -> None:
        """Send it where motion capture sees it.

        Args:
            position: x, y, z in m.
            attitude: Quaternion x, y, z, w.
        """
        if self._calls.qsize() < _FULL:
            self.send(lambda: self._cf.extpos.send_extpose(*position, *attitude))

    @property
    def _version(self) -> int:
        return self._cf.platform.get_protocol_version()

    def _supervise(self, command: tuple[int, ...]) -> None:
        self.send(lambda: self._cf.send_packet(packets.supervise(self._version, command)))

    def _ask(
        self, what: tuple[object, ...], code: int, send: Callable[[], object], acknowledged: tuple[int, ...] = (0,)
    ) -> bool:
        """Send a command until it is answered; return whether it was acknowledged."""
        now = self.now()
        if what != self._asked:
            self._asked, self._asked_at, self._sent = what, now, -math.inf
            self._answers.clear()
        if self._answers.get(code) in acknowledged:
            return True
        if now - self._sent >= AGAIN and not self.failure:
            self._sent = now
            self.send(send)
        return False

    def _answer(self, packet: Any) -> None:
        """Take in the commander's answer: the command, two of its bytes, and 0 or why not."""
        if (answer := packets.answered(packet)) is not None:
            self._answers[answer[0]] = answer[1]
            self.aim.acknowledged(*answer)
