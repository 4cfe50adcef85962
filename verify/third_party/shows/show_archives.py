"""Show files as archives: zip files from strangers, of which single members are read and nothing is unpacked to a disk.

`verify.data.storage.archives` checks all names before anything is read. A member that was just read is kept, so that many references to it cost
one reading; a file that makes the reader unpack much more than it holds is rejected.
"""

from __future__ import annotations

import posixpath
import zipfile
import zlib
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from verify.data.errors import BadInput, did_you_mean
from verify.data.storage.archives import ArchiveBounds, checked_members, leads_out
from verify.data.storage.safe_reading import begins_with, parse_json

MOST_MEMBERS = 200_000
MOST_BYTES = 512_000_000
"""Bytes of one member when unpacked."""
MOST_IN_ALL = 8_000_000_000
"""Bytes of all members together when unpacked."""
DEEPEST = 8
"""References that lead to each other."""
KEPT_BYTES = 16_000_000
"""Bytes of the members that are kept after reading; the last one is kept whatever its size."""
MOST_READINGS = 2
"""Times that a file's members may be unpacked, all of them together, on average."""


class ShowArchive:
    """An open show file: its JSON members, with references between them followed.

    Args:
        source: Names the file in messages.
        archive: The open zip file.

    Raises:
        BadInput: A member is not allowed.
    """

    def __init__(self, source: str, archive: zipfile.ZipFile) -> None:
        self.source = source
        self._archive = archive
        self._members = _checked(source, archive.infolist())
        self._kept: dict[str, Any] = {}
        self._left = MOST_READINGS * sum(member.file_size for member in self._members.values())

    def value(self, name: str) -> Any:  # of any type: what JSON may hold
        """Read a member.

        Args:
            name: Its path in the archive.

        Raises:
            BadInput: There is none of that name, it is damaged or it is no JSON, or too much was unpacked already.
        """
        if name not in self._members:
            raise BadInput(f"{self.source} has no member {name[:100]!r}.{did_you_mean(name, self._printable())}")
        if name in self._kept:
            self._kept[name] = value = self._kept.pop(name)  # the last one to go
            return value
        value = self._read(name)
        self._kept[name] = value
        size = sum(self._members[kept].file_size for kept in self._kept)
        while size > KEPT_BYTES and len(self._kept) > 1:
            oldest = next(iter(self._kept))
            size -= self._members[oldest].file_size
            del self._kept[oldest]
        return value

    def table(self, value: Any, what: str) -> dict[str, Any]:
        """Return a value that must be a table.

        Args:
            value: What stands in the file.
            what: Names it in messages.

        Raises:
            BadInput: It is none.
        """
        if not isinstance(value, dict):
            raise BadInput(f"{self.source}: {what} must be a table (an object), not {value!r:.40}.")
        return value

    def _read(self, name: str) -> Any:
        where = f"{self.source}: {name}"
        self._left -= self._members[name].file_size
        if self._left < 0:
            raise BadInput(
                f"{self.source}: its references unpack more than {MOST_READINGS} times what the file holds; at {name[:100]!r} reading ends. "
                "Put what many drones share into one member."
            )
        try:
            data = self._archive.read(self._members[name])
        except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, OSError) as error:
            raise BadInput(f"{where} is damaged: {error}.") from None
        return parse_json(data, where, finite=False)

    def _printable(self) -> list[str]:
        return [name for name in list(self._members)[:1000] if name.isprintable()]

    def followed(self, value: Any, document: Any) -> Any:
        """Return what a value refers to (`{"$ref": "./drones/1/trajectory.json"}`), or the value itself.

        Args:
            value: What JSON may hold.
            document: The document that it stands in, for references like `#/swarm`.

        Raises:
            BadInput: A reference leads out of the archive, nowhere, or in a circle.
        """
        for _ in range(DEEPEST):
            if not isinstance(value, dict) or "$ref" not in value:
                return value
            target: object = value["$ref"]
            if not isinstance(target, str):
                raise BadInput(f"{self.source}: $ref must be a text such as './drones/1/trajectory.json', not {target!r:.60}.")
            path, _, pointer = target.removeprefix("zip:").partition("#")
            if path:
                document = self.value(self._path(path))
            value = self._pointed(document, pointer, target)
        raise BadInput(
            f"{self.source}: references lead on more than {DEEPEST} times, as in a circle; the last is {value!r:.80}."
        )

    def _path(self, path: str) -> str:
        name = posixpath.normpath(path)
        if ":" in path or leads_out(path) or leads_out(name):
            raise BadInput(f"{self.source}: the reference {path[:100]!r} leads out of the file; references stay within it.")
        return name

    def _pointed(self, document: Any, pointer: str, target: str) -> Any:
        value = document
        for part in pointer.split("/")[1:] if pointer.startswith("/") and pointer != "/" else []:
            key = part.replace("~1", "/").replace("~0", "~")
            if isinstance(value, dict) and key in value:
                value = value[key]
            elif isinstance(value, list) and key.isdecimal() and len(key) < 10 and int(key) < len(value):
                value = value[int(key)]
            else:
                raise BadInput(f"{self.source}: the reference {target[:100]!r} leads nowhere: there is no {key[:40]!r}.")
        return value


@contextmanager
def open_show(path: Path) -> Generator[ShowArchive]:
    """Open a show file.

    Args:
        path: The file.

    Raises:
        BadInput: It cannot be read, is no zip file, or holds what no show holds.
    """
    if not begins_with(path, b"PK", "show file"):
        raise BadInput(f"{path} is no show file: a .skyc file is a zip file that holds show.json.")
    try:
        with zipfile.ZipFile(path) as archive:
            yield ShowArchive(str(path), archive)
    except zipfile.BadZipFile as error:
        raise BadInput(f"{path} is a damaged zip file: {error}.") from None


def _checked(source: str, members: list[zipfile.ZipInfo]) -> dict[str, zipfile.ZipInfo]:
    found = checked_members(source, members, ArchiveBounds("show", MOST_MEMBERS, MOST_IN_ALL))
    for key, member in found.items():
        if key.endswith((".json", ".yaml")) and member.file_size > MOST_BYTES:
            raise BadInput(
                f"{source}: {member.orig_filename[:100]!r} unpacks to {member.file_size / 1e6:.0f} MB; at most {MOST_BYTES // 1_000_000} MB are "
                "read of one member. Large shows keep each drone's trajectory in a member of its own."
            )
    return found
