"""Feed of a flight in the air to a service: its newest observation ten times a second, and orders to stop back.

Nothing of it can delay the flight. A process of its own (`feed_process`) makes frames and holds the line to the service. The flight's thread writes plain
data into a pipe to it, without waiting: while the pipe is full, observations are dropped. A thread here waits for orders, and begins the process anew where
it has ended or does not read any more, `LIVES` times in all. An order that is older than `FRESH` by this machine's clock is not heeded, so that a line that
was stuck stops no later flight.
"""

from __future__ import annotations

import os
import pickle
import socket
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from importlib.util import find_spec
from multiprocessing.connection import wait as wait_for
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from flight.link.holding import LONGEST
from flight.link.observed_link import Observation
from flight.link.stop_orders import Level, StopOrders
from ltlplan.service.client_parts.feed_pipe import GOODBYE, Line, News, framed
from ltlplan.service.client_parts.transport import segment
from ltlplan.service.event_inbox.names import parts_of
from ltlplan.service.live_view.messages import FRESH, StopOrder
from ltlplan.service.models import StopLevel
from verify.data import MissingEngine

if TYPE_CHECKING:
    from ltlplan.service.client_parts.long_polling import FollowedService
    from verify.data import Mission, Trajectory

BEAT = 0.25
"""s between two signs of life to the process."""
PAUSE = 0.5
"""s before a process that ended is begun anew."""
LIVES = 5
"""How often it is begun in all; after that the flight is not seen any more."""
STUCK = 10.0
"""s that the pipe may be full before the process is taken to hang."""
READY = 5.0
"""s that beginning to feed waits for the process: what it costs to start comes before the flight."""
_LEVELS: dict[StopLevel, Level] = {"hold": Level.HOLD, "land": Level.LAND, "motors": Level.MOTORS}
_NAMES: dict[Level, StopLevel] = {level: name for name, level in _LEVELS.items()}
_DOES: dict[StopLevel, str] = {
    "hold": f"all hold, and land after {LONGEST:g} s at most",
    "land": "all land",
    "motors": "all motors stop",
}
"""What each order does."""
_SAID = 100
_LETTERS = 2000
_READ = 65536


class FlightFeed:
    """Feed of one flight."""

    def __init__(
        self, listener: FollowedService, mission: Callable[[], Mission], orders: StopOrders, *, hears: bool = True
    ) -> None:
        """Begin to feed a service.

        Args:
            listener: Listens there for the flight.
            mission: Returns the mission as it is now.
            orders: Receives orders to stop, for the flight to heed.
            hears: Whether the flight takes events.

        Raises:
            MissingEngine: The extra `service` is not installed.
        """
        if find_spec("websockets") is None:
            raise MissingEngine("To be seen at a service a flight needs websockets: pip install 'ltlplan[service]'.")
        url, name = parts_of(listener.address)
        headers = {} if listener.token is None else {"authorization": f"Bearer {listener.token}"}
        uri = f"ws{url.removeprefix('http')}/api/live/{segment(name)}/feed?flight={listener.flight}"
        self._line = Line(uri, headers, hears)
        self._listener, self._mission, self._orders = listener, mission, orders
        self._said: deque[tuple[float, str | None, str, str]] = deque(maxlen=_SAID)
        self._outcomes: deque[tuple[str, str, str]] = deque(maxlen=10)
        self._asked_first: set[str] = set()
        self._writing = threading.Lock()
        self._pipe: socket.socket | None = None
        self._rest, self._full_since = memoryview(b""), 0.0
        self._drawn: tuple[Mapping[str, Trajectory], Mission, float] | None = None
        self._picture = 0
        self._ended, self._ready = threading.Event(), threading.Event()
        self._keeping = threading.Thread(target=self._keep, name=f"feeds {listener.address}", daemon=True)
        self._keeping.start()
        self._ready.wait(READY)

    @property
    def process(self) -> int | None:
        """The process that holds the line; None while there is none."""
        return self._child.pid if self._pipe is not None else None

    def show(self, seen: Observation) -> None:
        """Write the newest observation for the next frame; it returns at once, whatever the process does.

        Args:
            seen: The observation.
        """
        for event in seen.said:
            self._said.append((event.time, event.robot, event.kind, event.sentence[:_LETTERS]))
        self._write(seen)

    def end(self) -> None:
        """Have a last frame sent that says that the flight is over, and let go of the line, within 2 `GOODBYE` s."""
        until = time.monotonic() + GOODBYE
        while not self._write(None, over=True) and self._pipe is not None and time.monotonic() < until:
            time.sleep(BEAT / 25)
        while not self._flush() and self._pipe is not None and time.monotonic() < until:
            time.sleep(BEAT / 25)
        self._ended.set()
        self._keeping.join(2.0 * GOODBYE)

    # What is written to the process

    def _write(self, seen: Observation | None, *, over: bool = False) -> bool:
        """Write what is new, unless another thread writes or the pipe is full; return whether it was taken."""
        if not self._writing.acquire(blocking=False):
            return False
        try:
            if self._pipe is None or not self._flushed():
                return False
            if seen is not None:
                self._draw(seen)
            said = tuple(self._said.popleft() for _ in range(len(self._said)))
            known = None if seen is None else _known(seen, self._picture)
            self._put(News(known, said, tuple(self._outcomes), _NAMES.get(self._orders.level), over))
            self._flushed()
        finally:
            self._writing.release()
        return True

    def _draw(self, seen: Observation) -> None:
        """Write what a picture is made of where another trajectory is flown or the mission has changed."""
        paths, mission, margin = seen.paths, self._mission(), 0.0 if seen.look is None else seen.look.margin
        if self._drawn is not None and self._drawn[0] is paths and self._drawn[1] is mission and self._drawn[2] == margin:
            return
        self._drawn, self._picture = (paths, mission, margin), self._picture + 1
        self._put((self._picture, pickle.dumps((dict(paths), mission, margin))))

    def _put(self, message: object) -> None:
        self._rest = memoryview(bytes(self._rest) + framed(message))

    def _flush(self) -> bool:
        with self._writing:
            return self._flushed()

    def _flushed(self) -> bool:
        """Write what waits, as far as there is room; return whether nothing waits any more."""
        while self._rest and self._pipe is not None:
            try:
                self._rest = self._rest[self._pipe.send(self._rest) :]
            except BlockingIOError:
                self._full_since = self._full_since or time.monotonic()
                return False
            except OSError:  # the process has ended: the thread begins another
                self._rest = memoryview(b"")
                return False
        self._full_since = 0.0
        return True

    # The process

    def _keep(self) -> None:
        """Keep a process up until the end, or until it has ended too often."""
        for _ in range(LIVES):
            with suppress(OSError):  # none can be started now
                self._begin()
                self._hear()
            self._let_go()
            if self._ended.wait(PAUSE):
                return
        self._listener.say(
            f"the flight is not seen there any more: its feed has ended {LIVES} times. It can still be told events."
        )

    def _begin(self) -> None:
        """Start a process, and write it what it needs first."""
        ours, theirs = socket.socketpair()
        paths = os.pathsep.join(path for path in sys.path if path)
        with theirs, ExitStack() as undone:
            undone.callback(ours.close)
            self._child = subprocess.Popen(
                [sys.executable, "-P", "-m", "ltlplan.service.client_parts.feed_process"],
                stdin=theirs.fileno(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
                env={**os.environ, "PYTHONPATH": paths, "OMP_NUM_THREADS": "1"},
            )  # fmt: skip
            undone.pop_all()
        ours.setblocking(False)
        with self._writing:
            self._rest, self._full_since, self._drawn = memoryview(framed(self._line)), 0.0, None
            self._pipe = ours
            self._flushed()

    def _hear(self) -> None:
        """Receive orders from the process until it ends, hangs, or the flight is over."""
        pipe, heard = self._pipe, b""
        assert pipe is not None, "it has begun"
        while not self._ended.is_set():
            if wait_for([pipe], BEAT):
                read = pipe.recv(_READ)
                if not read:
                    return
                *lines, heard = (heard + read).split(b"\n")
                for line in lines:
                    self._take_line(line)
            elif self._full_since and time.monotonic() - self._full_since > STUCK:
                return
            else:
                self._write(None)

    def _let_go(self) -> None:
        """Close the pipe, and have the process gone."""
        with self._writing:
            pipe, self._pipe = self._pipe, None
        if pipe is not None:
            pipe.close()
            with suppress(subprocess.TimeoutExpired):
                self._child.wait(GOODBYE if self._ended.is_set() else 0.0)
            self._child.kill()
            self._child.wait()

    def _take_line(self, line: bytes) -> None:
        if not line:  # it has begun
            self._ready.set()
            return
        with suppress(ValidationError):
            self._take(StopOrder.model_validate_json(line))

    def _take(self, order: StopOrder) -> None:
        """Take an order, unless it is old, or of another flight, or of motors by somebody who ordered no stop before."""
        age = time.monotonic() - order.after - order.since
        if order.flight != self._listener.flight:
            outcome, sentence = "refused", "it is meant for another flight"
        elif not age <= FRESH:
            outcome, sentence = "expired", f"it came {age:.1f} s after it was given"
        elif order.level == "motors" and order.who not in self._asked_first:
            outcome, sentence = "refused", f"{order.who} has not ordered a stop before"
        else:
            self._asked_first.add(order.who)
            raises = self._orders.give(_LEVELS[order.level], f"stopped by {order.who} through the service.")
            outcome, sentence = "taken", _DOES[order.level] if raises else "this or more was ordered, or is done, already"
        self._outcomes.append((order.order, outcome, sentence))


def _known(seen: Observation, picture: int) -> dict[str, Any]:  # of any type: fields of a frame
    """Return what a frame says of an observation, as plain data."""
    look = seen.look
    known: dict[str, Any] = {
        "time": seen.time,
        "picture": picture,
        "begun": seen.time - seen.began,
        "ending": seen.ending,
        "robots": {name: _robot(seen, name) for name in seen.robots},
    }
    if look is not None:
        parts = tuple((text[:10_000], state) for text, state in look.parts)
        known |= {"stage": look.stage, "into": look.time, "lasts": look.duration, "margin": look.margin, "parts": parts}
    return known


def _robot(seen: Observation, name: str) -> dict[str, Any]:  # of any type: fields of a robot in a frame
    robot, look = seen.robots[name], seen.look
    pose, battery = robot.pose, robot.health.endurance
    off = None if look is None or seen.ending else _finite(look.errors.get(name))
    return {
        "at": None if pose is None else pose.position,
        "yaw": None if pose is None else pose.heading,
        "age": None if pose is None else seen.time - pose.time,
        "off": off,
        "left": None if look is None or off is None else look.margin - off - seen.accuracy,
        "battery": _finite(battery),
        "fault": robot.health.fault,
        "acknowledged": robot.acknowledged,
    }


def _finite(number: float | None) -> float | None:
    return number if number is not None and np.isfinite(number) else None
