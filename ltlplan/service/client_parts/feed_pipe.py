"""Messages from a flight to the process that feeds a service (`feed_process`), over a pipe: pickled plain data, each behind its length."""

from __future__ import annotations

import pickle
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, BinaryIO

if TYPE_CHECKING:
    from ltlplan.service.models import StopLevel

_LENGTH = struct.Struct("!I")
GOODBYE = 1.0
"""s that the last frame may take."""


@dataclass(frozen=True, slots=True)
class Line:
    """Line to a service: the first message.

    Attributes:
        uri: Of the flight's socket there.
        headers: Sent when the line begins.
        hears: Whether the flight takes events.
    """

    uri: str
    headers: dict[str, str]
    hears: bool


@dataclass(frozen=True, slots=True)
class News:
    """News of a flight, and a sign of life. Any other message is a picture: its number and the pickled paths, mission and margin.

    Attributes:
        known: Fields of a frame; None where nothing was observed since.
        said: What was said: s, robot, kind and sentence.
        outcomes: What became of the last orders: name, outcome and sentence.
        ordered: The highest level of a stop that was ordered; None before any.
        over: Whether the flight is over.
    """

    known: dict[str, Any] | None  # of any type: fields
    said: tuple[tuple[float, str | None, str, str], ...]
    outcomes: tuple[tuple[str, str, str], ...]
    ordered: StopLevel | None
    over: bool


def framed(message: object) -> bytes:
    """Return a message as it is written into the pipe.

    Args:
        message: Can be pickled.
    """
    data = pickle.dumps(message)
    return _LENGTH.pack(len(data)) + data


def read_from(pipe: BinaryIO) -> Any:  # of any type: a message
    """Wait for a message and return it; only a process' own parent writes there.

    Args:
        pipe: Read whole.

    Raises:
        EOFError: The flight's process let go of it, or has ended.
    """
    head = pipe.read(_LENGTH.size)
    data = pipe.read(_LENGTH.unpack(head)[0]) if len(head) == _LENGTH.size else b""
    if not data or len(data) < _LENGTH.unpack(head)[0]:
        raise EOFError
    return pickle.loads(data)
