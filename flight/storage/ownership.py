"""Ownership of files in our folders: ours if the folder's manifest lists a file and it is unchanged, else the user's.

`manifest.json` lists what was written, with digests, and carries a digest of itself. A listed file that was edited, replaced
by a link or made read-only is the user's from then on, as is everything that is not listed. Names are compared as the least
discerning file system would: whatever the case of letters, and however accents are composed.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from verify.data.errors import BadInput
from verify.data.storage.file_names import folded

MANIFEST = "manifest.json"
MANIFEST_FORMAT = 1

_WHAT = "Files that ltlplan wrote. It replaces these alone, and only while they are as it left them; all others are yours."
_MAX_BYTES = 20_000_000


@dataclass(frozen=True, slots=True)
class Contents:
    """Files of a folder, by owner; paths are relative to it, with slashes.

    Attributes:
        listed: What the manifest lists, each file with the digests that it may have; None where there is no manifest.
        ours: Files as we left them, the manifest included.
        theirs: All other files, links and special files.
        folders: All folders, outer ones first.
    """

    listed: Mapping[str, frozenset[str]] | None
    ours: frozenset[str]
    theirs: frozenset[str]
    folders: tuple[str, ...]

    @property
    def shared(self) -> frozenset[str]:
        """The folders that are there for listed files; all others are the user's, empty ones too."""
        return frozenset(folder for path in self.listed or () for folder in _above(path))

    def in_the_way(self, written: Iterable[str]) -> Iterator[str]:
        """Yield the user's files and folders that files which are to be written would overwrite or shadow."""
        files = {folded(path) for path in written}
        folders = {folded(folder): folder for path in written for folder in _above(path)}
        for path in sorted(self.theirs):
            if folded(path) in files or folded(path) in folders:
                yield path
        for path in self.folders:
            if folded(path) in files or folders.get(folded(path), path) != path:
                yield path


def read_contents(folder: Path, written: Iterable[str] = ()) -> Contents:
    """Return what lies in a folder, and whose each file is.

    Args:
        folder: The folder.
        written: Files that are to be written, relative to it and with slashes: an export below it, whose own manifest is among
            them, is to be made anew, and what that lists is ours, too.

    Raises:
        BadInput: The folder's manifest is none of ours, or was changed.
        OSError: The folder cannot be read.
    """
    listed = read_manifest(folder)
    if listed is not None:
        below = _listed_below(folder, written)
        listed |= {path: listed.get(path, frozenset()) | digests for path, digests in below.items()}
    ours, theirs, folders = set[str](), set[str](), list[str]()
    for path, entry in _walk(folder):
        if entry.is_dir(follow_symlinks=False):
            folders.append(path)
        elif listed is not None and (path == MANIFEST or (path in listed and _as_left(entry, listed[path]))):
            ours.add(path)
        else:
            theirs.add(path)
    return Contents(listed, frozenset(ours), frozenset(theirs), tuple(folders))


def _listed_below(folder: Path, written: Iterable[str]) -> dict[str, frozenset[str]]:
    """Return what manifests below a folder list that are to be written anew, and these manifests, as paths in the folder."""
    found: dict[str, frozenset[str]] = {}
    for path in written:
        below, _, name = path.rpartition("/")
        if not below or name != MANIFEST:
            continue
        with suppress(BadInput, OSError):  # changed, or gone: nothing is known to be ours there
            if (listed := read_manifest(folder / below)) is not None:
                found |= {f"{below}/{own}": digests for own, digests in listed.items()}
                found[path] = frozenset({digest_of(folder / path)})
    return found


def read_manifest(folder: Path) -> dict[str, frozenset[str]] | None:
    """Return the files that a folder's manifest lists, each with the digests that it may have; None without a manifest.

    Raises:
        BadInput: The file of that name is none of ours, or was changed.
    """
    path = folder / MANIFEST
    if not os.path.lexists(path):
        return None
    refused = BadInput(
        f"{path} is not as ltlplan wrote it, so nothing in {folder} is replaced; name another folder with --out."
    )
    if path.is_symlink() or not path.is_file() or path.stat().st_size > _MAX_BYTES:
        raise refused
    try:
        data: Any = json.loads(path.read_bytes())
        listed = {name: frozenset(digests) for name, digests in data["files"].items()}
        if data["format"] == MANIFEST_FORMAT and path.read_bytes() == manifest_bytes(listed):
            return listed
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        pass
    raise refused


def manifest_bytes(listed: Mapping[str, Iterable[str]]) -> bytes:
    """Return the contents of a manifest that lists files, each with the digests that it may have."""
    files = {path: sorted(listed[path]) for path in sorted(listed)}
    body = {"format": MANIFEST_FORMAT, "what": _WHAT, "files": files}
    digest = hashlib.sha256(json.dumps(body).encode()).hexdigest()
    return (json.dumps({**body, "digest": digest}, indent=1) + "\n").encode()


def digest_of(path: str | Path) -> str:
    """Return the SHA-256 digest of a file."""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def files_in(folder: Path) -> tuple[str, ...]:
    """Return all files below a folder, sorted, with slashes."""
    return tuple(sorted(path for path, entry in _walk(folder) if not entry.is_dir(follow_symlinks=False)))


def folders_in(folder: Path) -> tuple[str, ...]:
    """Return all folders below a folder, outer ones first, with slashes."""
    return tuple(path for path, entry in _walk(folder) if entry.is_dir(follow_symlinks=False))


def _walk(folder: Path, below: str = "") -> Iterator[tuple[str, os.DirEntry[str]]]:
    """Yield everything below a folder by its path in there, folders before what they hold; links are not followed."""
    with os.scandir(folder) as entries:
        found = sorted(entries, key=lambda entry: entry.name)
    for entry in found:
        path = f"{below}{entry.name}"
        yield path, entry
        if entry.is_dir(follow_symlinks=False):
            yield from _walk(Path(entry.path), f"{path}/")


def _as_left(entry: os.DirEntry[str], digests: frozenset[str]) -> bool:
    """Return whether a listed file is as we left it: a file of its own, not protected, with the same bytes."""
    mode = entry.stat(follow_symlinks=False).st_mode
    if not stat.S_ISREG(mode) or not mode & stat.S_IWUSR:
        return False
    try:
        return digest_of(entry.path) in digests
    except OSError:
        return False


def _above(path: str) -> Iterator[str]:
    parts = path.split("/")
    return ("/".join(parts[:length]) for length in range(1, len(parts)))
