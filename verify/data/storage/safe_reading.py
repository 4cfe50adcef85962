"""The one door through which files are read: regular files of bounded size, and JSON with one meaning.

A pipe is not waited for, a device not drained, and no text is read on past its limit; each of them ends in one sentence.
"""

from __future__ import annotations

import codecs
import difflib
import json
import os
import re
import stat
from contextlib import suppress
from pathlib import Path
from typing import Any

from verify.data.errors import BadInput

MAX_DIGITS = 1000
"""Digits that an integer in JSON may have; no float has a tenth of them."""

_BLOCK = 65536
"""Bytes that are asked for at a time where a file does not say how many it has."""

_LONE_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")


def read_bytes(path: str | os.PathLike[str], *, most: int, what: str) -> bytes:
    """Read a regular file (or what a symbolic link to one holds).

    Args:
        path: The file.
        most: Bytes that it may have.
        what: Names what was expected in messages, such as "mission file".

    Raises:
        BadInput: It is missing, no regular file, unreadable or too large.
    """
    data = _read(path, most + 1, what)
    if len(data) > most:
        size = f"{most // 1_000_000} MB" if most >= 1_000_000 else f"{most // 1000} kB"
        raise BadInput(f"{path} is larger than {size}; that is no {what}.")
    return data


def begins_with(path: str | os.PathLike[str], text: bytes, what: str) -> bool:
    """Return whether a regular file begins so, a byte order mark aside, without reading on.

    Args:
        path: The file.
        text: What it may begin with.
        what: Names what was expected in messages, such as "mission file".

    Raises:
        BadInput: It is missing, no regular file, or unreadable.
    """
    return _read(path, len(text) + len(codecs.BOM_UTF8), what).removeprefix(codecs.BOM_UTF8).startswith(text)


def read_text(path: str | os.PathLike[str], *, most: int, what: str) -> str:
    """Read a regular file of UTF-8 text, without the mark that some programs put before it.

    Args:
        path: The file.
        most: Bytes that it may have.
        what: Names what was expected in messages, such as "mission file".

    Raises:
        BadInput: As `read_bytes`, or it is no UTF-8 text.
    """
    return decoded(read_bytes(path, most=most, what=what), str(path), what)


def decoded(data: bytes, source: str, what: str) -> str:
    """Return UTF-8 text; `source` and `what` name it in messages.

    Args:
        data: The bytes; a byte order mark before the text is left out.
        source: Names them in messages.
        what: Names what was expected, such as "mission file".

    Raises:
        BadInput: It is no UTF-8 text.
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        article = "an" if what[0] in "aeiou" else "a"
        raise BadInput(f"{source} is not UTF-8 text (byte {error.start}); {article} {what} is text.") from None


def parse_json(text: str | bytes, source: str, *, finite: bool = True) -> Any:  # of any type: what JSON may hold
    """Read JSON in which every name and number has one meaning.

    Args:
        text: The text, or its bytes in UTF-8.
        source: Names it in messages.
        finite: Whether numbers that no float holds are refused here, one by one; False for a reader of millions that looks itself.

    Raises:
        BadInput: It is no JSON, a key stands twice in one object, a number is none or too large for a float, a text
            is no Unicode, or values are nested too deeply.
    """
    if isinstance(text, bytes):
        text = decoded(text, source, "JSON file")
    try:
        value = json.loads(
            text,
            parse_constant=_refuse_constant,
            parse_float=_finite if finite else None,
            parse_int=_integer,
            object_pairs_hook=_no_duplicates,
        )
        if _LONE_SURROGATE.search(text):
            json.dumps(value, ensure_ascii=False).encode()
    except RecursionError:
        raise BadInput(f"{source} is no JSON file: its values are nested too deeply.") from None
    except UnicodeEncodeError:
        raise BadInput(f"{source} is no JSON: a text in it holds half of a surrogate pair.") from None
    except ValueError as error:
        raise BadInput(f"{source} is no JSON: {str(error).splitlines()[0]}.") from None
    return value


def _read(path: str | os.PathLike[str], count: int, what: str) -> bytes:
    """Return at most that many bytes of a regular file."""
    try:
        # Not to wait for the other end of a pipe; of a regular file the flag changes nothing.
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except (OSError, ValueError) as error:
        hint = _near(path) if isinstance(error, FileNotFoundError) else ""
        raise BadInput(f"{_shown(path)} cannot be read: {_reason(error)}.{hint}") from None
    try:
        found = os.fstat(handle)
        mode = found.st_mode
        if stat.S_ISDIR(mode):
            raise BadInput(f"{path} cannot be read: it is a folder; name a {what}.")
        if not stat.S_ISREG(mode):
            raise BadInput(f"{path} cannot be read: it is no file but a pipe, a socket or a device; name a {what}.")
        with os.fdopen(os.dup(handle), "rb") as file:
            parts: list[bytes] = []
            while count > 0:
                asked = min(count, max(found.st_size + 1, _BLOCK))  # all of it is taken from memory before anything is read
                parts.append(file.read(asked))
                count = count - asked if len(parts[-1]) == asked else 0
            return b"".join(parts)
    except OSError as error:
        raise BadInput(f"{path} cannot be read: {_reason(error)}.") from None
    finally:
        os.close(handle)


def _refuse_constant(name: str) -> float:
    raise ValueError(f"{name} is no JSON number")


def _finite(text: str) -> float:
    value = float(text)
    if value - value != 0:
        raise ValueError(f"the number {text[:40]} is too large")
    return value


def _integer(text: str) -> int:
    if len(text) > MAX_DIGITS:
        raise ValueError(f"the number {text[:20]}... has {len(text)} digits, more than {MAX_DIGITS}")
    return int(text)


def _no_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) != len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))
        raise ValueError(f"the key {twice[:40]!r} stands twice in one object")
    return result


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)


def _near(path: str | os.PathLike[str]) -> str:
    """Return the name that is there and nearest to one that is not, as a question; nothing where none is near."""
    wanted = Path(path)
    while not wanted.parent.is_dir():
        wanted = wanted.parent
    with suppress(OSError):
        near = difflib.get_close_matches(wanted.name, [each.name for each in wanted.parent.iterdir()], n=1)
        return f" Did you mean '{wanted.with_name(near[0])}'?" if near else ""
    return ""


def _shown(path: str | os.PathLike[str]) -> str:
    return str(path).replace("\0", "\\0")
