"""Bearer tokens: made once, shown once, kept as digests; and sessions of a browser, which hold no token.

A token has 256 random bits, so a plain digest hides it: there is nothing to guess. A session is a name, an end and a code over both and
the token's digest with a key of this folder's; it lapses with its token, and outlives a restart.
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
from verify.data.storage.reading import parse_json, read_bytes

FILE = "tokens.json"
KEY_FILE = "session.key"
SESSION_SECONDS = 30 * 24 * 3600
_FORMAT = 1
_PREFIX = "ltlplan_"
_MOST = 1_000_000
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,59}")


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode("utf-8", "surrogateescape")).hexdigest()


@dataclass
class Tokens:
    """The tokens of a data folder; what another process adds or takes away counts at once.

    Attributes:
        folder: Where they are kept; for its owner's eyes only.
    """

    folder: Path
    _known: dict[str, str] = field(default_factory=dict, init=False, repr=False)
    _seen: tuple[int, int, int] | None = field(default=None, init=False, repr=False)

    @property
    def needed(self) -> bool:
        """Whether there are any: then everybody needs one."""
        return bool(self._digests())

    def names(self) -> tuple[str, ...]:
        """Return the names of all tokens, in the order in which they were made."""
        return tuple(self._digests())

    def new(self, name: str) -> str:
        """Make a token and return it; it cannot be shown again.

        Raises:
            BadInput: The name is none, or taken, or the folder cannot be written.
        """
        if not _NAME.fullmatch(name):
            raise BadInput(f"{name[:60]!r} cannot name a token; use letters, digits, '-', '_' and '.', at most 60 of them.")
        with self._locked():
            entries = self._read()
            if any(entry["name"] == name for entry in entries):
                raise BadInput(
                    f"There is a token '{name}' already; revoke it first (--revoke-token {name}), or take another name."
                )
            token = _PREFIX + secrets.token_urlsafe(32)
            made = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
            self._write([*entries, {"name": name, "sha256": _digest(token), "made": made}])
        return token

    def revoke(self, name: str) -> None:
        """Take a token away; who uses it is refused from now on.

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
        given, found = _digest(token), None
        for name, digest in self._digests().items():
            if hmac.compare_digest(given, digest):
                found = name
        return found

    def session(self, name: str) -> str:
        """Return a session of a token's owner, for a browser's cookie."""
        end = str(int(time.time()) + SESSION_SECONDS)
        return f"{name}:{end}:{self._code(name, end)}"

    def owner_of_session(self, session: str) -> str | None:
        """Return whose session this is, or None where it has ended or is none of ours."""
        name, _, rest = session.partition(":")
        end, _, code = rest.partition(":")
        if name not in self._digests() or not end.isascii() or not end.isdigit() or len(end) > 12 or int(end) < time.time():
            return None
        return name if hmac.compare_digest(code.encode(), self._code(name, end).encode()) else None

    def _code(self, name: str, end: str) -> str:
        text = f"{name}:{end}:{self._digests()[name]}".encode()
        return hmac.new(self._key(), text, hashlib.sha256).hexdigest()

    def _key(self) -> bytes:
        path = self.folder / KEY_FILE
        if not path.exists():
            with self._locked():
                if not path.exists():
                    _write_private(path, secrets.token_bytes(32))
        return read_bytes(path, most=1000, what="session key")

    def _digests(self) -> dict[str, str]:
        """Return the digests by name, read again where the file has changed."""
        try:
            found = os.stat(self.folder / FILE)  # noqa: PTH116  # asked at every request
        except OSError:
            self._known, self._seen = {}, None
            return self._known
        seen = (found.st_ino, found.st_mtime_ns, found.st_size)
        if seen != self._seen:
            self._known, self._seen = {entry["name"]: entry["sha256"] for entry in self._read()}, seen
        return self._known

    def _read(self) -> list[dict[str, Any]]:  # of any type: JSON nests
        path = self.folder / FILE
        if not path.exists():
            return []
        data = parse_json(read_bytes(path, most=_MOST, what="file of tokens"), str(path))
        entries = data.get("tokens") if isinstance(data, dict) and data.get("format") == _FORMAT else None
        if not isinstance(entries, list) or not all(
            isinstance(each, dict) and isinstance(each.get("name"), str) and isinstance(each.get("sha256"), str)
            for each in entries
        ):
            raise BadInput(f"{path} is no file of tokens of this version; move it away and make new tokens.")
        return entries

    def _write(self, entries: list[dict[str, Any]]) -> None:  # of any type: JSON nests
        text = json.dumps({"format": _FORMAT, "tokens": entries}, indent=1) + "\n"
        _write_private(self.folder / FILE, text.encode())

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


def _write_private(path: Path, data: bytes) -> None:
    """Write a file that its owner alone may read, whole or not at all."""
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
