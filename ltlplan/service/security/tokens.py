"""Bearer tokens: made once, shown once, kept as digests.

A token has 256 random bits, so a plain digest hides it: there is nothing to guess.
"""

from __future__ import annotations

import fcntl
import hashlib
import hmac
import json
import os
import re
import secrets
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from verify.data.errors import BadInput, did_you_mean
from verify.data.storage.safe_reading import parse_json, read_bytes

FILE = "tokens.json"
DEFAULT_ROLE = "pilot"
"""Role of a token that has none of its own and belongs to no account: what tokens could do before there were roles, but for administering."""
_FORMAT = 2
_READ = (1, 2)
"""Formats that are read; the first has neither roles nor accounts."""
_PREFIX = "ltlplan_"
_MOST = 1_000_000
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,59}")
LOCAL = "local"
"""User of a service without accounts and tokens: whoever asks from its own machine."""


def digest_of(secret: str) -> str:
    """Return what is kept of a token or of a session's name."""
    return hashlib.sha256(secret.encode("utf-8", "surrogateescape")).hexdigest()


def require_name(name: str, of: str) -> None:
    """Reject what cannot name a user: letters of other kinds, an address, or the service's own word for nobody in particular.

    Args:
        name: The name.
        of: What is named, for the message.

    Raises:
        BadInput: It cannot.
    """
    if not _NAME.fullmatch(name):
        raise BadInput(f"{name[:60]!r} cannot name {of}; use letters, digits, '-', '_' and '.', at most 60 of them.")
    if re.fullmatch(r"[0-9.]+", name) or name.lower() == LOCAL:
        raise BadInput(f"'{name}' cannot name {of}: the service itself calls clients so. Take another name.")


@dataclass(frozen=True, slots=True)
class Entry:
    """A token as it is kept.

    Attributes:
        digest: Its SHA-256.
        role: What it may do at most; empty for what its account may, or the default.
        account: Name of the account that it belongs to; empty for none.
    """

    digest: str
    role: str
    account: str


@dataclass
class Tokens:
    """The tokens of a data folder; what another process adds or takes away counts at once.

    Attributes:
        folder: Where they are kept; for its owner's eyes only.
    """

    folder: Path
    _known: dict[str, Entry] = field(default_factory=dict[str, Entry], init=False, repr=False)
    _seen: tuple[int, int, int] | None = field(default=None, init=False, repr=False)

    @property
    def needed(self) -> bool:
        """True if there are any: then every client needs one."""
        return bool(self.entries())

    def names(self) -> tuple[str, ...]:
        """Return the names of all tokens, in the order in which they were made."""
        return tuple(self.entries())

    def new(self, name: str, *, role: str = "", account: str = "") -> str:
        """Make a token and return it; it cannot be shown again.

        Args:
            name: Names it, and its user where it belongs to no account.
            role: What it may do at most.
            account: Name of the account that it belongs to.

        Raises:
            BadInput: The name is none, or taken, or the folder cannot be written.
        """
        require_name(name, "a token")
        with self._locked():
            entries = self._read()
            if any(entry["name"] == name for entry in entries):
                raise BadInput(
                    f"There is a token '{name}' already; revoke it first (--revoke-token {name}), or take another name."
                )
            token = _PREFIX + secrets.token_urlsafe(32)
            made = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
            more = {key: value for key, value in (("role", role), ("account", account)) if value}
            self._write([*entries, {"name": name, "sha256": digest_of(token), "made": made, **more}])
        return token

    def revoke(self, name: str) -> None:
        """Take a token away; who uses it is rejected from now on.

        Raises:
            BadInput: There is none of that name.
        """
        with self._locked():
            entries = self._read()
            kept = [entry for entry in entries if entry["name"] != name]
            if len(kept) == len(entries):
                known = [str(entry["name"]) for entry in entries]
                listed = ", ".join(known) or "none"
                raise BadInput(f"There is no token '{name[:60]}'.{did_you_mean(name, known)} Tokens: {listed}.")
            self._write(kept)

    def owner(self, token: str) -> str | None:
        """Return the name of a token, or None where it is none of ours."""
        given, found = digest_of(token), None
        for name, entry in self.entries().items():
            if hmac.compare_digest(given, entry.digest):
                found = name
        return found

    def digest(self, name: str) -> str | None:
        """Return the digest of the token of a name, or None where there is none."""
        entry = self.entry(name)
        return None if entry is None else entry.digest

    def entry(self, name: str) -> Entry | None:
        """Return what is kept of the token of a name, or None where there is none."""
        return self.entries().get(name)

    def entries(self) -> dict[str, Entry]:
        """Return what is kept of all tokens, read again where the file has changed."""
        try:
            found = os.stat(self.folder / FILE)  # noqa: PTH116  # asked at every request
        except OSError:
            self._known, self._seen = {}, None
            return self._known
        seen = (found.st_ino, found.st_mtime_ns, found.st_size)
        if seen != self._seen:
            self._known = {
                each["name"]: Entry(each["sha256"], str(each.get("role", "")), str(each.get("account", "")))
                for each in self._read()
            }
            self._seen = seen
        return self._known

    def _read(self) -> list[dict[str, Any]]:  # of any type: JSON nests
        path = self.folder / FILE
        if not path.exists():
            return []
        data = parse_json(read_bytes(path, most=_MOST, what="file of tokens"), str(path))
        entries = data.get("tokens") if isinstance(data, dict) and data.get("format") in _READ else None
        if not isinstance(entries, list) or not all(
            isinstance(each, dict) and isinstance(each.get("name"), str) and isinstance(each.get("sha256"), str)
            for each in entries
        ):
            raise BadInput(f"{path} is no file of tokens of this version; move it away and make new tokens.")
        return entries

    def _write(self, entries: list[dict[str, Any]]) -> None:  # of any type: JSON nests
        text = json.dumps({"format": _FORMAT, "tokens": entries}, indent=1) + "\n"
        write_private(self.folder / FILE, text.encode())

    def _locked(self) -> _Lock:
        return _Lock(self.folder / f"{FILE}.lock")


class _Lock:
    """Held while the tokens are changed."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._handle = -1

    def __enter__(self) -> None:
        try:
            self._handle = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o600)
        except OSError as error:
            raise BadInput(f"{self._path.parent} cannot be written: {(error.strerror or str(error)).lower()}.") from None
        fcntl.flock(self._handle, fcntl.LOCK_EX)

    def __exit__(self, *_: object) -> None:
        os.close(self._handle)


def write_private(path: Path, data: bytes) -> None:
    """Write a file that its owner alone may read, whole or not at all.

    Raises:
        BadInput: It cannot be written.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        handle = os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, path)  # noqa: PTH105  # one call for one file
    except OSError as error:
        beside.unlink(missing_ok=True)
        raise BadInput(f"{path} cannot be written: {(error.strerror or str(error)).lower()}.") from None
