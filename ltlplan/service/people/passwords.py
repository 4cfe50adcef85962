"""Passwords: hashed by Argon2id, checked in the same time whether or not there is an account."""

from __future__ import annotations

import secrets
import threading
from functools import cache
from typing import TYPE_CHECKING

from verify.data.errors import BadInput, MissingEngine

if TYPE_CHECKING:
    from argon2 import PasswordHasher

SHORTEST, LONGEST = 12, 200
"""Letters of a password."""
_AT_ONCE = threading.BoundedSemaphore(2)
"""Each hash takes 64 MB while it is computed."""


def hashed(password: str) -> str:
    """Return what is kept of a password.

    Raises:
        BadInput: It is too short or too long.
        MissingEngine: argon2-cffi is not installed.
    """
    if not SHORTEST <= len(password) <= LONGEST:
        raise BadInput(f"A password has {SHORTEST} to {LONGEST} letters; this one has {len(password)}.")
    with _AT_ONCE:
        return hasher().hash(_bytes(password))


def matches(kept: str | None, password: str) -> bool:
    """Return whether a password is the one that is kept; where none is, false after the same time.

    Args:
        kept: What `hashed` returned.
        password: As it was given.
    """
    from argon2.exceptions import Argon2Error, InvalidHashError

    with _AT_ONCE:
        try:
            return hasher().verify(kept or _nobodys(), _bytes(password[: LONGEST + 1])) and kept is not None
        except (Argon2Error, InvalidHashError):
            return False


def drawn() -> str:
    """Return a new password that nobody chose: 80 random bits."""
    return "-".join(secrets.token_hex(2) for _ in range(5))


@cache
def hasher() -> PasswordHasher:
    """Return the function that hashes, with the parameters of RFC 9106 for machines with little memory.

    Raises:
        MissingEngine: argon2-cffi is not installed.
    """
    try:
        from argon2 import PasswordHasher
    except ModuleNotFoundError:
        raise MissingEngine("Accounts need argon2-cffi: pip install 'ltlplan[service]'.") from None
    return PasswordHasher()


@cache
def _nobodys() -> str:
    return hasher().hash(secrets.token_bytes(16))


def _bytes(password: str) -> bytes:
    return password.encode("utf-8", "surrogatepass")
