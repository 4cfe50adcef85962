"""Feed of a flight in the air to a service: frames ten times a second over one socket, and orders to stop back.

Nothing of it can delay the flight. The flight's thread leaves its newest observation in a slot and goes on; a thread of its own sends what is newest then,
and blocks where the line is slow. Another one receives orders. A line that breaks is begun anew, twice a second. An order that is older than `FRESH` by
the flight's own clock is not heeded, so that a line that was stuck stops no later flight.
"""

from __future__ import annotations

import json
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from flight.link.observed_link import Observation
from flight.link.stop_orders import Level, StopOrders
from ltlplan.service.client_parts.transport import segment
from ltlplan.service.event_inbox.names import parts_of
from ltlplan.service.live_view.messages import FRESH, Frame, OrderOutcome, RobotFrame, Said, Sent, Shown, StopOrder, Track
from verify.data import MissingEngine

if TYPE_CHECKING:
    from websockets.sync.client import ClientConnection

    from ltlplan.service.client_parts.long_polling import FollowedService
    from verify.data import Mission, Trajectory

EVERY = 0.1
"""s between two frames."""
PAUSE = 0.5
"""s before a line that broke is begun anew."""
PATIENCE = 5.0
"""s that beginning a line may take."""
GOODBYE = 1.0
"""s that the last frame may take."""
_POINTS = 20_000
"""Places of all robots' tracks together."""
_SAID = 100
_LETTERS = 2000


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
        self._uri = f"ws{url.removeprefix('http')}/api/live/{segment(name)}/feed"
        self._headers = {} if listener.token is None else {"authorization": f"Bearer {listener.token}"}
        self._listener, self._mission, self._orders, self._hears = listener, mission, orders, hears
        self._slot: Observation | None = None
        self._seen = time.monotonic()
        self._said: deque[Said] = deque(maxlen=_SAID)
        self._outcomes: deque[OrderOutcome] = deque(maxlen=10)
        self._asked_first: set[str] = set()
        self._over, self._ended = False, threading.Event()
        self._number, self._pictures = 0, _Pictures()
        self._line: ClientConnection | None = None
        self._sending = threading.Thread(target=self._run, name=f"feeds {listener.address}", daemon=True)
        self._sending.start()

    def show(self, seen: Observation) -> None:
        """Leave the newest observation for the next frame; it returns at once.

        Args:
            seen: The observation.
        """
        for event in seen.said:
            self._said.append(Said(time=event.time, robot=event.robot, kind=event.kind, sentence=event.sentence[:_LETTERS]))
        self._slot, self._seen = seen, time.monotonic()

    def end(self) -> None:
        """Send a last frame that says that the flight is over, and let go of the line, within `GOODBYE` s."""
        self._over = True
        self._ended.set()
        self._sending.join(GOODBYE)
        self._close()

    # What the threads do

    def _run(self) -> None:
        """Keep a line up, and send frames over it, until the end."""
        from websockets.exceptions import WebSocketException
        from websockets.sync.client import connect

        while not self._ended.is_set():
            with suppress(OSError, WebSocketException, TimeoutError, ValueError), self._connected(connect) as line:
                self._line = line
                self._pictures.forget()
                threading.Thread(target=self._receive, args=(line,), name="hears orders to stop", daemon=True).start()
                self._feed(line)
            self._close()
            self._ended.wait(PAUSE)

    def _connected(self, connect: Callable[..., ClientConnection]) -> ClientConnection:
        return connect(
            f"{self._uri}?flight={self._listener.flight}", additional_headers=self._headers, open_timeout=PATIENCE,
            close_timeout=GOODBYE, ping_interval=None, proxy=None,
        )  # fmt: skip

    def _feed(self, line: ClientConnection) -> None:
        """Send frames until the end, or until the line breaks."""
        due = time.monotonic()
        while True:
            over = self._over
            seen = self._slot
            if seen is not None:
                shown = self._pictures.new(seen.paths, self._mission(), _margin_of(seen))
                if shown is not None:
                    line.send(_message("shown", shown))
            line.send(_message("frame", self._frame(seen, over=over)))
            if over:
                return
            due = max(due + EVERY, time.monotonic())
            self._ended.wait(due - time.monotonic())

    def _close(self) -> None:
        line, self._line = self._line, None
        if line is not None:
            with suppress(Exception):  # whatever is wrong with it, it is let go of
                line.socket.close()

    def _frame(self, seen: Observation | None, *, over: bool) -> Frame:
        self._number += 1
        said = tuple(self._said.popleft() for _ in range(min(len(self._said), _SAID)))
        now = time.monotonic()
        known: dict[str, Any] = (
            {} if seen is None else _known(seen, now - self._seen, self._pictures.number)
        )  # of any type: fields
        return Frame(
            number=self._number, sent=now, said=said, over=over, orders=tuple(self._outcomes), hears=self._hears, **known
        )

    def _receive(self, line: ClientConnection) -> None:
        """Receive orders until the line breaks."""
        with suppress(Exception):  # the line is gone: the other thread begins another
            for text in line:
                with suppress(ValidationError):
                    self._take(StopOrder.model_validate_json(text))

    def _take(self, order: StopOrder) -> None:
        """Take an order, unless it is old, or of another flight, or of motors by somebody who ordered no stop before."""
        age = time.monotonic() - order.after - order.since
        if order.flight != self._listener.flight:
            outcome, sentence = "refused", "it is meant for another flight"
        elif not age <= FRESH:
            outcome, sentence = "expired", f"it came {age:.1f} s after it was given"
        elif order.level == "motors" and order.who not in self._asked_first:
            outcome, sentence = "refused", f"{order.who} has not ordered to land before"
        else:
            self._asked_first.add(order.who)
            self._orders.give(
                Level.MOTORS if order.level == "motors" else Level.LAND, f"stopped by {order.who} through the service."
            )
            outcome, sentence = "taken", "all motors stop" if order.level == "motors" else "all hold, and land"
        self._outcomes.append(OrderOutcome(order=order.order, outcome=outcome, sentence=sentence))


class _Pictures:
    """Pictures that were sent: another one is, where another trajectory is flown or the mission has changed."""

    def __init__(self) -> None:
        self.number = 0
        self._of: tuple[Mapping[str, Trajectory], Mission, float] | None = None

    def forget(self) -> None:
        """Have the next one sent whatever it is: the line is another one."""
        self._of = None

    def new(self, paths: Mapping[str, Trajectory], mission: Mission, margin: float) -> Shown | None:
        """Return what another picture is made of; None where the last one is right.

        Args:
            paths: What is flown.
            mission: As it is now.
            margin: m.
        """
        if self._of is not None and self._of[0] is paths and self._of[1] is mission and self._of[2] == margin:
            return None
        self._of = (paths, mission, margin)
        self.number += 1
        text = json.dumps(mission.resolved(), allow_nan=False)
        lasts = sum(path.duration for path in paths.values())
        step = max(0.05, lasts / _POINTS)
        return Shown(number=self.number, mission=text, margin=margin, tracks={n: _track(p, step) for n, p in paths.items()})


def _track(path: Trajectory, step: float) -> Track:
    count = max(int(np.ceil(path.duration / step)), 1)
    times = np.minimum(np.arange(count + 1) * step, path.duration)
    return Track(step=step, points=tuple((x, y, z) for x, y, z in np.round(path.evaluate(times)[:, :3], 4).tolist()))


def _margin_of(seen: Observation) -> float:
    return 0.0 if seen.look is None else seen.look.margin


def _message(kind: str, value: Frame | Shown) -> str:
    return Sent.model_validate({kind: value}).model_dump_json(include={kind})


def _known(seen: Observation, stale: float, picture: int) -> dict[str, Any]:  # of any type: fields of a frame
    """Return what a frame says of an observation."""
    look = seen.look
    known: dict[str, Any] = {
        "time": seen.time,
        "stale": stale,
        "picture": picture,
        "begun": seen.time - seen.began,
        "ending": seen.ending,
        "robots": {name: _robot(seen, name) for name in seen.robots},
    }
    if look is not None:
        parts = tuple((text[:10_000], state) for text, state in look.parts)
        known |= {"stage": look.stage, "into": look.time, "lasts": look.duration, "margin": look.margin, "parts": parts}
    return known


def _robot(seen: Observation, name: str) -> RobotFrame:
    robot, look = seen.robots[name], seen.look
    pose, battery = robot.pose, robot.health.endurance
    off = None if look is None or seen.ending else _finite(look.errors.get(name))
    return RobotFrame(
        at=None if pose is None else pose.position,
        yaw=None if pose is None else pose.heading,
        age=None if pose is None else seen.time - pose.time,
        off=off,
        left=None if look is None or off is None else look.margin - off - seen.accuracy,
        battery=_finite(battery),
        fault=robot.health.fault,
        acknowledged=robot.acknowledged,
    )


def _finite(number: float | None) -> float | None:
    return number if number is not None and np.isfinite(number) else None
