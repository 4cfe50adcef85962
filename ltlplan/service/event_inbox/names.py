"""Names of flights that listen, and the addresses at which they are sent events."""

from __future__ import annotations

import re

from verify.data import BadInput

NAME = r"^[A-Za-z0-9][A-Za-z0-9._-]{0,59}$"
"""What a flight listens as."""
FLIGHT = r"^[0-9a-f]{32}$"
"""A flight's own name for itself, drawn by chance."""

_ADDRESS = re.compile(r"(https?://[^/?#\s]+(?:/[^/?#\s]+)*?)/live/([A-Za-z0-9][A-Za-z0-9._-]{0,59})/?")


def parts_of(address: str) -> tuple[str, str]:
    """Return the service's address and the flight's name of one such as http://127.0.0.1:8000/live/lab.

    Raises:
        BadInput: It is none.
    """
    found = _ADDRESS.fullmatch(address)
    if found is None:
        raise BadInput(
            f"'{address[:200]}' is no flight of a service; one is written http://127.0.0.1:8000/live/NAME, its name in up to 60 of "
            "letters, digits, '.', '_' and '-'."
        )
    return found[1].removesuffix("/api"), found[2]
