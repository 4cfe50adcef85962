"""A flight that a test has seen at a service, without flying one; and a line between the two that can be paused."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Callable, Generator
from contextlib import closing, contextmanager, suppress
from typing import Any

from websockets.sync.client import connect

from flight.link.link import Health, Pose
from flight.link.observed_link import Observation, SeenRobot
from flight.link.stop_orders import StopOrders
from flight.link.tracking_monitor import Look
from flight.logs.log import Event
from ltlplan.service.client_parts.flight_feed import FlightFeed
from ltlplan.service.client_parts.long_polling import FollowedService
from tests.helpers.live.live_missions import PAIR
from verify.data import Trajectory, parse_mission

ROBOTS = ("one", "two")
_STILL: dict[str, Trajectory] = {}
"""Nothing is flown; the same mapping, as nothing changes."""


class FedFlight:
    """A flight that is seen at a service: it stands still, and takes orders to stop.

    Attributes:
        orders: What it was ordered.
        feed: Its feed.
        longest: The longest that leaving an observation took, s.
    """

    def __init__(self, address: str, token: str | None = None, text: str = PAIR) -> None:
        self.mission, self.orders, self.longest = parse_mission(text), StopOrders(), 0.0
        self.listener = FollowedService(address, self.mission.name, token)
        self.feed = FlightFeed(self.listener, lambda: self.mission, self.orders)
        self._ended = threading.Event()
        self.acknowledged: str | None = None
        self._said: tuple[Event, ...] = ()
        self._looking = threading.Thread(target=self._look, daemon=True)
        self._looking.start()

    def speaks(self, said: tuple[Event, ...]) -> None:
        """Have the flight say something with each observation from now on."""
        self._said = said

    def _look(self) -> None:
        began = time.monotonic()
        while not self._ended.wait(0.05):
            now = time.monotonic() - began
            robot = SeenRobot(Pose(now, (0.0, 0.0, 1.0), 0.0), Health(endurance=300.0), self.acknowledged)  # type: ignore[arg-type]
            before = time.perf_counter()
            look = Look(
                "flight", now, 600.0, dict.fromkeys(ROBOTS, 0.012), 0.05, (), (), (("F left", "done"), ("F right", "to do"))
            )
            self.feed.show(Observation(now, dict.fromkeys(ROBOTS, robot), _STILL, 0.0, look, self._said, False, 0.005))
            self.longest = max(self.longest, time.perf_counter() - before)

    def close(self) -> None:
        """End the flight."""
        self._ended.set()
        self._looking.join()
        self.feed.end()
        self.listener.close()


@contextmanager
def fed(address: str, **more: Any) -> Generator[FedFlight]:
    """Have a flight that is seen at a service."""
    with closing(FedFlight(address, **more)) as flight:
        yield flight


class Watching:
    """A viewer of a flight."""

    def __init__(self, url: str, name: str, headers: dict[str, str] | None = None) -> None:
        self._line = connect(
            f"ws{url.removeprefix('http')}/api/live/{name}/watch",
            additional_headers=headers,
            max_size=None,
            ping_interval=None,
            proxy=None,
        )
        self.line = self._line.__enter__()

    def until(self, good: Callable[[dict[str, Any]], bool], seconds: float = 30.0) -> dict[str, Any]:
        """Return the first message that is as asked."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            with suppress(TimeoutError):
                message = json.loads(self.line.recv(timeout=left))
                if good(message):
                    return message
        raise AssertionError("nothing of that came")

    def frame(self, good: Callable[[dict[str, Any]], bool] = lambda frame: True, seconds: float = 30.0) -> dict[str, Any]:
        """Return the first frame that is as asked."""
        return self.until(lambda message: message["kind"] == "frame" and good(message["frame"]), seconds)["frame"]

    def close(self) -> None:
        """Look away."""
        self.line.close()


@contextmanager
def watching(url: str, name: str, headers: dict[str, str] | None = None) -> Generator[Watching]:
    """Look at a flight."""
    with closing(Watching(url, name, headers)) as viewer:
        yield viewer


class Network:
    """A line to a service that can be paused: what is sent meanwhile is kept, as networks do, and arrives later."""

    def __init__(self, url: str) -> None:
        host, _, port = url.rpartition("//")[2].partition(":")
        self._to = (host, int(port))
        self._server = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self._server.getsockname()[1]}"
        self.flows = threading.Event()
        self.flows.set()
        self._ends: list[socket.socket] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                one, _ = self._server.accept()
                self._ends.append(one)
                try:
                    other = socket.create_connection(self._to)
                except OSError:  # the service is down
                    one.close()
                    continue
                self._ends.append(other)
                for source, target in ((one, other), (other, one)):
                    threading.Thread(target=self._pump, args=(source, target), daemon=True).start()

    def _pump(self, source: socket.socket, target: socket.socket) -> None:
        with suppress(OSError):
            while data := source.recv(65536):
                self.flows.wait()
                target.sendall(data)
        with suppress(OSError):
            target.shutdown(socket.SHUT_WR)

    def close(self) -> None:
        """Take no more lines."""
        self.flows.set()
        for end in (self._server, *self._ends):
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()
