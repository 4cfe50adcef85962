"""Addresses of a mission's robots, one for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from verify.data import BadInput, Mission
from verify.data.events import unknown


def require_addresses(
    mission: Mission, addresses: Mapping[str, str], example: str, reached: Callable[[str], str] = str
) -> None:
    """Reject addresses that are missing, of nobody, or of two robots.

    Args:
        mission: Who flies.
        addresses: Robot to address.
        example: An address, for the message.
        reached: Turns an address into what is reached by it, so that two ways to write it are one.

    Raises:
        BadInput: As said.
    """
    for name in addresses:
        if name not in mission.agents:
            raise BadInput(unknown(name, "robot of the mission", mission.agents))
    if missing := [name for name in mission.agents if not addresses.get(name)]:
        raise BadInput(f"no address of {', '.join(missing)}; write {missing[0]}={example}.")
    of: dict[str, str] = {}
    for name in mission.agents:
        if (other := of.setdefault(reached(addresses[name]), name)) != name:
            raise BadInput(f"{other} and {name} have one address, {addresses[name]}.")


_MANY = {"sends": "send", "does": "do", "is": "are"}


def said_of(whom: Sequence[str], verb: str) -> str:
    """Return who does something: `one does not answer`, `one, two do not answer`.

    Args:
        whom: One or more.
        verb: What they do, as of one of them; it begins with the verb.
    """
    first, _, rest = verb.partition(" ")
    return f"{', '.join(whom)} {first if len(whom) == 1 else _MANY.get(first, first)} {rest}"
