"""Where events are told while a team flies, as `--follow` spells it: the keyboard, a ROS 2 topic, or else a file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from ltlplan.online.happenings import Told
    from verify.data.events import WorldEvent


class Source(Protocol):
    """Somewhere events are told."""

    def __call__(self) -> Sequence[WorldEvent | Told | str]:
        """Return what was told since it was asked last, without waiting; a text says what was told and is no event."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


def followed(name: str) -> Source:
    """Begin to follow what is told.

    Args:
        name: `-` for the keyboard, `ros2:/TOPIC`, or a file or a named pipe.

    Raises:
        BadInput: It cannot be followed.
        MissingEngine: A library that is needed for it is not installed.
    """
    from ltlplan.online.told.files import FollowedFile
    from ltlplan.online.told.topics import PREFIX, FollowedTopic

    return FollowedTopic(name.removeprefix(PREFIX)) if name.startswith(PREFIX) else FollowedFile(name)
