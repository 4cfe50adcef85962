"""Zip files from strangers: every name is looked at before anything is read, and nothing is ever unpacked by the names that it gives.

A name that leads out of the archive, a link, an encrypted or a twofold member refuses the whole file, whether it would be needed or not,
because whoever made such a file meant no good.
"""

from __future__ import annotations

import posixpath
import stat
import zipfile
from collections.abc import Iterable
from dataclasses import dataclass

from verify.data.errors import BadInput

_METHODS = {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}


@dataclass(frozen=True, slots=True)
class ArchiveBounds:
    """Bounds on what is read of an archive.

    Attributes:
        what: What such an archive holds, for messages: "show".
        members: How many.
        size: Bytes of all of them together when unpacked.
    """

    what: str
    members: int
    size: int


def checked_members(source: str, members: Iterable[zipfile.ZipInfo], bounds: ArchiveBounds) -> dict[str, zipfile.ZipInfo]:
    """Return an archive's members by their paths in it.

    Args:
        source: Names the file in messages.
        members: As the archive lists them.
        bounds: What is read at the most.

    Raises:
        BadInput: One is not allowed, or there are too many.
    """
    listed, what = list(members), bounds.what
    if len(listed) > bounds.members:
        raise BadInput(f"{source} holds {len(listed)} members; a {what} has at most {bounds.members}.")
    found: dict[str, zipfile.ZipInfo] = {}
    total = 0
    for member in listed:
        name = member.orig_filename
        if leads_out(name):
            raise BadInput(f"{source}: the member {name[:100]!r} leads out of the file; paths stay within it, without '..'.")
        if stat.S_ISLNK(member.external_attr >> 16):
            raise BadInput(f"{source}: the member {name[:100]!r} is a link; a {what} holds its files themselves.")
        if member.flag_bits & 0x1:
            raise BadInput(f"{source}: the member {name[:100]!r} is encrypted; export the {what} without a password.")
        if member.compress_type not in _METHODS:
            raise BadInput(
                f"{source}: the member {name[:100]!r} is compressed by method {member.compress_type}; {what}s are stored or deflated."
            )
        key = posixpath.normpath(name)
        if key in found:
            raise BadInput(f"{source} holds {name[:100]!r} twice; one of them would be checked and the other flown.")
        total += member.file_size
        if total > bounds.size:
            size = f"{bounds.size // 10**9} GB" if bounds.size >= 10**9 else f"{bounds.size // 10**6} MB"
            raise BadInput(f"{source} unpacks to more than {size}; that is no {what}.")
        found[key] = member
    return found


def leads_out(name: str) -> bool:
    """Return whether a path in an archive may lead out of it.

    Args:
        name: The path.
    """
    parts = name.split("/")
    return (
        not name or "\\" in name or "\0" in name or name.startswith("/") or ".." in parts or (len(name) > 1 and name[1] == ":")
    )
