"""Event sources of a flight, as `--follow` names them: the keyboard, a ROS 2 topic, a planning service, or else a file."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from ltlplan.online.event_queue import Told
    from verify.data.events import WorldEvent


class Source(Protocol):
    """Somewhere events are told."""

    def __call__(self) -> Sequence[WorldEvent | Told | str]:
        """Return what was told since it was asked last, without waiting; a text says what was told and is no event."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


TOKEN = "LTLPLAN_TOKEN"
"""The environment's variable that holds the token for a service, where it needs one: a command's options are seen by everybody on its machine."""


def followed(name: str, mission: str) -> Source:
    """Begin to follow what is told.

    Args:
        name: `-` for the keyboard, `ros2:/TOPIC`, `http://HOST:PORT/live/NAME` for a service, or a file or a named pipe.
        mission: Name of the mission that is flown.

    Raises:
        BadInput: It cannot be followed.
        MissingEngine: A library that is needed for it is not installed.
    """
    from ltlplan.online.event_sources.files import FollowedFile
    from ltlplan.online.event_sources.topics import PREFIX, FollowedTopic

    if re.match(r"https?://", name):
        from ltlplan.service.client_parts.long_polling import FollowedService

        return FollowedService(name, mission, os.environ.get(TOKEN) or None)
    return FollowedTopic(name.removeprefix(PREFIX)) if name.startswith(PREFIX) else FollowedFile(name)
