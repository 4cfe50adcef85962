"""Single files that are written into a folder of the user's: added beside what is there, never over it.

A file that we wrote is replaced while it is as we left it: one that a folder's manifest lists, or a page that ends with the
digest of what stands above. Everything else is the user's.
"""

from __future__ import annotations

import hashlib
import os
import secrets
from contextlib import suppress
from pathlib import Path

from flight.storage.ownership import MANIFEST, manifest_bytes, read_contents
from verify.data.errors import BadInput
from verify.data.storage.safe_reading import read_bytes

_MAX_BYTES = 200_000_000
_STAMP = "<!-- written by ltlplan; SHA-256 of all above: "


def replace_listed(folder: Path, name: str, text: str | bytes) -> Path:
    """Write a file into a folder, over one that the folder's manifest lists and that is as we left it, and list it there.

    Args:
        folder: Where the file and the manifest stand.
        name: Of the file, in the folder.
        text: Its contents; a text is written as UTF-8.

    Returns:
        The file's path.

    Raises:
        BadInput: There is a file of that name that is the user's, or it cannot be written.
    """
    path, content = folder / name, text if isinstance(text, bytes) else text.encode()
    try:
        if path.is_file() and not path.is_symlink() and path.read_bytes() == content:
            return path
        contents = read_contents(folder)
        theirs = next(contents.in_the_way((name, MANIFEST)), None)
        if theirs is not None:
            raise BadInput(f"{folder / theirs} is yours, or was changed since ltlplan wrote it; move it away and try again.")
        listed, new = contents.listed or {}, frozenset((hashlib.sha256(content).hexdigest(),))
        either = listed.get(name, frozenset()) | new
        _replace(folder / MANIFEST, manifest_bytes({**listed, name: either}))  # a kill from here on leaves a true list
        _replace(path, content)
        _replace(folder / MANIFEST, manifest_bytes({**listed, name: new}))
    except OSError as error:
        raise BadInput(f"{path} cannot be written: {error.strerror or error}.") from None
    return path


def check_page(path: Path) -> None:
    """Reject to replace a page that is not one of ours as we left it.

    Raises:
        BadInput: It is the user's, a folder, or cannot be read.
    """
    if path.is_dir():
        raise BadInput(f"{path} is a folder; name a page to write, such as {path / 'show.html'}.")
    if not os.path.lexists(path):
        return
    above, stamp, rest = read_bytes(path, most=_MAX_BYTES, what="page").rpartition(_STAMP.encode())
    if path.is_symlink() or not stamp or rest != _stamp(above).removeprefix(stamp):
        raise BadInput(
            f"{path} is yours, or was changed since ltlplan wrote it; move it away, or name another file with --out."
        )


def replace_page(path: Path, text: str) -> None:
    """Write an HTML page with a stamp by which it will be known as ours; whole or not at all.

    Raises:
        BadInput: What is there is the user's, or the page cannot be written.
    """
    check_page(path)
    above = text.encode() if text.endswith("\n") else f"{text}\n".encode()
    try:
        _replace(path, above + _stamp(above))
    except OSError as error:
        raise BadInput(f"{path} cannot be written: {error.strerror or error}.") from None


def write_single(path: Path, content: bytes, *, overwrite: bool = False) -> None:
    """Write a file, whole or not at all; one that is there is kept unless `overwrite` says otherwise or it is the same.

    Args:
        path: The file.
        content: Its bytes.
        overwrite: Whether another file of that name may be replaced.

    Raises:
        BadInput: There is another file of that name, or it cannot be written.
    """
    try:
        if not overwrite and os.path.lexists(path):
            if path.is_file() and path.read_bytes() == content:
                return
            raise BadInput(f"{path} exists already; name another file, or remove it first.")
        _replace(path, content)
    except OSError as error:
        raise BadInput(f"{path} cannot be written: {error.strerror or error}.") from None


def _stamp(above: bytes) -> bytes:
    return f"{_STAMP}{hashlib.sha256(above).hexdigest()} -->\n".encode()


def _replace(path: Path, content: bytes) -> None:
    """Write a file beside its place, under a name that nobody has, and rename it there."""
    aside = path.with_name(f".{path.name}.{secrets.token_hex(6)}.new")
    try:
        with aside.open("xb") as file:
            file.write(content)
        aside.replace(path)
    except BaseException:
        with suppress(OSError):  # what could not be written may not be removable either
            aside.unlink()
        raise
