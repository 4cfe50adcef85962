"""Long polling of events that operators send to a flight through a service: in a thread, by requests that wait for an answer.

The flight has a number for itself, and asks for events of greater numbers than it has. So a line that breaks, or a service that is started anew,
costs time only: what was accepted meanwhile comes when it answers again, in order and once. What the flight did with each event goes back by
another thread, tried again until it is taken.
"""

from __future__ import annotations

import queue
import threading
import time
import uuid
from collections.abc import Callable, Sequence
from contextlib import suppress
from math import inf

from ltlplan.online.event_queue import TOO_LATE, Told
from ltlplan.online.event_sources.lines import event_told
from ltlplan.service.client_parts.transport import Wire, checked, segment
from ltlplan.service.event_inbox.names import parts_of
from ltlplan.service.models import FlightAnswered, LiveEvent
from ltlplan.service.problems import Conflict, NotFound
from verify.data import BadInput, LtlplanError

WAIT = 10.0
"""s that the service waits for an event before it answers that there is none."""
PATIENCE = 15.0
"""s without an answer after which the line is down."""
PAUSE = 0.5
"""s before a question that failed is asked again."""
GOODBYE = 5.0
"""s that the last answers may take at the end."""

_LETTERS = 2000


class FollowedService:
    """Events as they are told; asking for them never waits.

    Attributes:
        address: Of the service and of the flight in it.
        token: A bearer token, where the service needs one.
    """

    def __init__(self, address: str, mission: str, token: str | None = None) -> None:
        """Begin to listen.

        Args:
            address: Of the service and of the flight in it, such as http://127.0.0.1:8000/live/lab.
            mission: Name of the mission that is flown.
            token: A bearer token, where the service needs one.

        Raises:
            BadInput: It is no such address, the service does not answer or refuses, or another flight listens as that.
            MissingEngine: The extra `service` is not installed.
        """
        url, name = parts_of(address)
        self.address, self.token = address, token
        self._mission, self._path = mission, f"/api/live/{segment(name)}"
        self._wire = Wire(url, token, PATIENCE)
        self._flight, self._after = uuid.uuid4().hex, 0
        self._told: queue.SimpleQueue[LiveEvent | str] = queue.SimpleQueue()
        self._answers: queue.SimpleQueue[tuple[str, FlightAnswered] | None] = queue.SimpleQueue()
        self._ended, self._until = threading.Event(), inf
        try:
            self._begin()
        except LtlplanError:
            self._wire.close()
            raise
        self._listening = threading.Thread(target=self._listen, name=f"hears {address}", daemon=True)
        self._answering = threading.Thread(target=self._answer, name=f"answers {address}", daemon=True)
        self._listening.start()
        self._answering.start()

    @property
    def flight(self) -> str:
        """The flight's own name for itself, drawn by chance."""
        return self._flight

    def __call__(self) -> Sequence[Told | str]:
        """Return what was told since it was asked last; a text where the line broke, or came back."""
        found: list[Told | str] = []
        while (each := _next(self._told)) is not None:
            if isinstance(each, str):
                found.append(each)
                continue
            try:
                found.append(Told(event_told(each.line), self._answer_to(each)))
            except BadInput as error:  # a service of another version took it
                self._answer_to(each)(False, str(error))
                found.append(f"Not done: {error}")
        return found

    def close(self) -> None:
        """Answer what was not heard, say that the flight has ended, and let go of the line, within `GOODBYE` s."""
        while (each := _next(self._told)) is not None:
            if isinstance(each, LiveEvent):
                self._answer_to(each)(False, TOO_LATE)
        self._until = time.monotonic() + GOODBYE
        self._ended.set()
        self._answers.put(None)
        self._answering.join(GOODBYE + PAUSE)
        self._wire.close()
        self._listening.join(1.0)

    def _answer_to(self, event: LiveEvent) -> Callable[[bool, str], None]:
        flight = self._flight

        def answer(heard: bool, sentence: str) -> None:
            shown = "".join(letter if letter.isprintable() else " " for letter in sentence)[:_LETTERS]
            self._answers.put((flight, FlightAnswered(number=event.number, heard=heard, sentence=shown)))

        return answer

    def _begin(self) -> None:
        self._wire.ask("PUT", self._path, json={"flight": self._flight, "mission": self._mission})

    def _listen(self) -> None:
        """Ask for events, one question after the other, until the end."""
        down = False
        while not self._ended.is_set():
            try:
                self._hear(0.0 if down else WAIT)
            except Conflict as error:
                self.say(f"{error} It hears nothing from there any more.")
                return
            except NotFound:
                self._begin_anew()
            except LtlplanError as error:
                if not down:
                    self.say(f"it cannot be heard: {error} It is tried again, and what it accepts meanwhile comes later.")
                down = True
                self._ended.wait(PAUSE)
                continue
            except Exception as error:  # the line was closed while it waited, or is broken in a way that httpx does not know
                if self._ended.is_set():
                    return
                self.say(f"it cannot be heard any more ({type(error).__name__}).")
                return
            if down:
                self.say("it is heard again.")
            down = False

    def _hear(self, wait: float) -> None:
        asked = {"after": self._after, "wait": wait, "flight": self._flight}
        for each in self._wire.ask("GET", f"{self._path}/events", params=asked).json():
            event = checked(LiveEvent, each)
            if event.number > self._after:
                self._after = event.number
                self._told.put(event)

    def _begin_anew(self) -> None:
        """Listen again at a service that does not know this flight, such as one with another data folder."""
        self._flight, self._after = uuid.uuid4().hex, 0
        try:
            self._begin()
            self.say("the service did not know this flight any more; it listens anew.")
        except LtlplanError:
            self._ended.wait(PAUSE)

    def _answer(self) -> None:
        """Send back what was done with events, until the end, and then that the flight has ended."""
        while (each := self._answers.get()) is not None:
            self._send(*each)
        with suppress(LtlplanError):
            self._wire.ask("POST", f"{self._path}/end", json={"flight": self._flight})

    def _send(self, flight: str, answer: FlightAnswered) -> None:
        """Send one answer, again and again until it is taken; after the end, for `GOODBYE` s."""
        told = {"flight": flight, "answers": [answer.model_dump()]}
        while time.monotonic() < self._until:
            try:
                self._wire.ask("POST", f"{self._path}/answers", json=told)
                return
            except (Conflict, NotFound):  # nobody waits for it
                return
            except LtlplanError:
                time.sleep(PAUSE / 5 if self._ended.is_set() else PAUSE)

    def say(self, sentence: str) -> None:
        """Have a sentence returned to the flight among what it is told.

        Args:
            sentence: Names the address before it.
        """
        self._told.put(f"{self.address}: {sentence}")


def _next(waiting: queue.SimpleQueue[LiveEvent | str]) -> LiveEvent | str | None:
    with suppress(queue.Empty):
        return waiting.get_nowait()
    return None
