"""Process that feeds a service with a flight in the air: `python -m ltlplan.service.client_parts.feed_process`, begun by `flight_feed`.

One thread takes the flight's news from standard input, a socket, as they come, so that the flight's end of it has room. Another sends what is newest then,
ten times a second, and may wait for the service for as long as that takes. A third one receives orders to stop, and hands them to the flight as they are, a line
each. A line to the service that breaks is begun anew, twice a second. Frames end while the flight's process gives no sign of life, so that nobody takes
it for one that hears.
"""

from __future__ import annotations

import json
import os
import pickle
import signal
import socket
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from ltlplan.service.client_parts.feed_pipe import GOODBYE, Line, News, read_from
from ltlplan.service.live_view.messages import Frame, OrderOutcome, RobotFrame, Said, Sent, Shown, Track

if TYPE_CHECKING:
    from websockets.sync.client import ClientConnection

    from ltlplan.service.models import StopLevel
    from verify.data import Trajectory

EVERY = 0.1
"""s between two frames."""
PAUSE = 0.5
"""s before a line that broke is begun anew."""
PATIENCE = 5.0
"""s that beginning a line may take."""
SILENT = 1.0
"""s without a sign of life of the flight's process after which no frames are sent."""
NICE = 5
"""How far this process stands back behind the flight's where both want to compute."""
_POINTS = 20_000
"""Places of all robots' tracks together."""
_SAID = 100


class Feeding:
    """Feeding of one flight."""

    def __init__(self, flight: socket.socket) -> None:
        """Begin to feed, as the flight's first message says.

        Args:
            flight: To the flight's process.
        """
        self._flight = flight
        self._news = flight.makefile("rb")
        self._line: Line = read_from(self._news)
        self._known: dict[str, Any] | None = None  # of any type: fields of a frame
        self._seen = self._lived = time.monotonic()
        self._said: deque[Said] = deque(maxlen=_SAID)
        self._outcomes: tuple[OrderOutcome, ...] = ()
        self._shown: Shown | None = None
        self._sent_picture: Shown | None = None
        self._number, self._over, self._ended = 0, False, threading.Event()
        self._ordered: StopLevel | None = None
        self._alive = threading.Event()
        self._open: ClientConnection | None = None
        self._sending = threading.Thread(target=self._run, name="sends frames", daemon=True)

    def run(self) -> None:
        """Take news until the flight is over, or its process is gone."""
        self._flight.sendall(b"\n")
        self._sending.start()
        with suppress(EOFError, OSError):
            while not self._over:
                self._take(read_from(self._news))
        self._ended.set()
        self._alive.set()
        self._sending.join(GOODBYE)
        self._close()

    def _take(self, message: Any) -> None:  # of any type: news, or a picture
        if isinstance(message, News):
            self._said.extend(Said(time=s, robot=robot, kind=kind, sentence=text) for s, robot, kind, text in message.said)
            self._outcomes = tuple(OrderOutcome(order=o, outcome=out, sentence=text) for o, out, text in message.outcomes)  # type: ignore[arg-type]
            self._lived = time.monotonic()
            if message.known is not None:
                self._known, self._seen = message.known, self._lived
            self._ordered, self._over = message.ordered, message.over
            self._alive.set()
        else:
            number, pickled = message
            self._shown = _shown(number, *pickle.loads(pickled))

    # The line to the service

    def _run(self) -> None:
        """Keep a line up, and send frames over it, until the end."""
        from websockets.exceptions import WebSocketException
        from websockets.sync.client import connect

        while not self._ended.is_set():
            with suppress(OSError, WebSocketException, TimeoutError, ValueError), self._connected(connect) as line:
                self._open, self._sent_picture = line, None
                threading.Thread(target=self._receive, args=(line,), name="hears orders to stop", daemon=True).start()
                self._feed(line)
            self._close()
            self._ended.wait(PAUSE)

    def _connected(self, connect: Callable[..., ClientConnection]) -> ClientConnection:
        return connect(
            self._line.uri, additional_headers=self._line.headers, open_timeout=PATIENCE, close_timeout=GOODBYE,
            ping_interval=None, proxy=None,
        )  # fmt: skip

    def _feed(self, line: ClientConnection) -> None:
        """Send frames until the end, or until the line breaks."""
        due = time.monotonic()
        while True:
            ended = self._ended.is_set()
            over = ended and self._over
            if time.monotonic() - self._lived > SILENT and not ended:
                self._alive.clear()
                self._alive.wait()
                continue
            if self._shown is not self._sent_picture:
                self._sent_picture = self._shown
                line.send(_message("shown", self._sent_picture))
            if over or not ended:  # one whose process is gone is not said to be over
                line.send(_message("frame", self._frame(over=over)))
            if ended:
                return
            due = max(due + EVERY, time.monotonic())
            self._ended.wait(due - time.monotonic())

    def _frame(self, *, over: bool) -> Frame:
        self._number += 1
        said = tuple(self._said.popleft() for _ in range(len(self._said)))
        now, known = time.monotonic(), dict(self._known or {})
        if known:
            known |= {
                "stale": now - self._seen,
                "robots": {name: RobotFrame(**robot) for name, robot in known["robots"].items()},
            }
        return Frame(
            number=self._number,
            sent=now,
            said=said,
            over=over,
            orders=self._outcomes,
            ordered=self._ordered,
            hears=self._line.hears,
            **known,
        )

    def _receive(self, line: ClientConnection) -> None:
        """Hand orders to the flight until the line breaks."""
        with suppress(Exception):  # the line is gone: the other thread begins another
            for text in line:
                if isinstance(text, str):
                    self._flight.sendall(text.replace("\n", " ").encode() + b"\n")

    def _close(self) -> None:
        line, self._open = self._open, None
        if line is not None:
            with suppress(Exception):  # whatever is wrong with it, it is let go of
                line.socket.close()


def _shown(number: int, paths: dict[str, Trajectory], mission: Any, margin: float) -> Shown:  # of any type: a mission
    """Return what a picture is made of."""
    text = json.dumps(mission.resolved(), allow_nan=False)
    step = max(0.05, sum(path.duration for path in paths.values()) / _POINTS)
    return Shown(number=number, mission=text, margin=margin, tracks={n: _track(p, step) for n, p in paths.items()})


def _track(path: Trajectory, step: float) -> Track:
    count = max(int(np.ceil(path.duration / step)), 1)
    times = np.minimum(np.arange(count + 1) * step, path.duration)
    return Track(step=step, points=tuple((x, y, z) for x, y, z in np.round(path.evaluate(times)[:, :3], 4).tolist()))


def _message(kind: str, value: Frame | Shown | None) -> str:
    return Sent.model_validate({kind: value}).model_dump_json(include={kind})


def main() -> None:
    """Feed until the flight is over."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(OSError, AttributeError):  # not every system has these
        os.nice(NICE)
        os.sched_setscheduler(
            0, os.SCHED_BATCH, os.sched_param(0)
        )  # what is written to it wakes it, and takes no processor away
    with socket.socket(fileno=os.dup(sys.stdin.fileno())) as flight, suppress(EOFError):
        Feeding(flight).run()


if __name__ == "__main__":
    main()
