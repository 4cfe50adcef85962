"""Events that are told while a team flies: lines of a file that grows, of a named pipe, or from the keyboard."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ltlplan.online.event_sources.lines import events_told
from verify.data import BadInput

if TYPE_CHECKING:
    from verify.data.events import WorldEvent

KEYBOARD = "-"
"""What the keyboard is called where a file can be named."""
_MOST = 65_536
"""Bytes that are read at a time, and that a line may have."""


class FollowedFile:
    """Lines as they come; asking for them never waits."""

    def __init__(self, name: str) -> None:
        """Begin to follow.

        Args:
            name: A file, a named pipe, or `-` for the keyboard.

        Raises:
            BadInput: It cannot be read.
        """
        self._name, self._rest = name, b""
        try:
            self._open = sys.stdin.fileno() if name == KEYBOARD else os.open(name, os.O_RDONLY | os.O_NONBLOCK)
        except (OSError, ValueError) as error:
            made = "" if name == KEYBOARD else f"; make it before, such as by `mkfifo {name}`"
            raise BadInput(f"events cannot be read from {name}: {error}{made}.") from None

    def __call__(self) -> Sequence[WorldEvent | str]:
        """Return the events of lines that have come; a text where a line is none."""
        *lines, self._rest = (self._rest + self._read()).split(b"\n")
        found = events_told(line.decode("utf-8", errors="replace") for line in lines)
        if len(self._rest) > _MOST:
            self._rest = b""
            found.append(f"{self._name}: a line is too long to be an event.")
        return found

    def close(self) -> None:
        """Let go of the file; the keyboard stays."""
        if self._name != KEYBOARD:
            os.close(self._open)

    def _read(self) -> bytes:
        try:
            ready, _, _ = select.select([self._open], [], [], 0.0)
            return os.read(self._open, _MOST) if ready else b""
        except BlockingIOError:
            return b""
