"""Values and files on disk by the digest of their bytes: whole or not at all, and never changed.

    data/values/ab/abcdef...        named by its SHA-256
    data/values/databases.txt       whose jobs they are of

A value is written beside its place, synced and renamed, so that a kill at any instant leaves it or nothing. One that is there is not
written again, unless its bytes are others than its name says: these are compared whenever it is read, served or kept once more.
"""

from __future__ import annotations

import errno
import hashlib
import os
import re
import shutil
import tempfile
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from verify.data import BadInput, InternalError

OWNERS = "databases.txt"
"""File of a store that names the databases whose jobs have values in it."""

_DIGEST = re.compile(r"[0-9a-f]{64}")
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class NoRoom(BadInput):
    """There is no room to write."""


class Damaged(InternalError):
    """A value is not there any more, or its bytes are not those that were kept."""

    def __init__(self, message: str = "", digest: str = "") -> None:
        super().__init__(message)
        self.digest = digest


def no_room(folder: Path, error: OSError) -> NoRoom:
    """Return what to say of a folder that the system does not let us write."""
    reason = "the disk is full" if error.errno in _FULL else os.strerror(error.errno or 0).lower()
    return NoRoom(f"{folder} cannot be written: {reason}. Make room there; what was accepted waits for it.")


@dataclass(frozen=True, slots=True)
class Store:
    """A folder of values.

    Attributes:
        folder: Where; made at first use.
    """

    folder: Path

    def open(self) -> None:
        """Make the folder where there is none, and remove what a kill left half-written; nobody else may be writing.

        Raises:
            NoRoom: It cannot be made.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            for path in self.folder.glob(".new-*"):
                path.unlink(missing_ok=True)
        except OSError as error:
            raise no_room(self.folder, error) from None

    def is_owned(self, database: str) -> bool:
        """Note that a database's jobs have their values here, and tell whether no other's ever had.

        Args:
            database: Its own name.

        Raises:
            NoRoom: That cannot be written.
        """
        note = self.folder / OWNERS
        try:
            known = note.read_text(encoding="utf-8").splitlines() if note.exists() else ["unknown"] if self.digests() else []
            if database not in known:
                known.append(database)
                self._write(note, "".join(f"{name}\n" for name in known).encode())
        except OSError as error:
            raise no_room(self.folder, error) from None
        return known == [database]

    def keep_only(self, digests: Collection[str]) -> int:
        """Remove all other values and return how many they were; nobody else may be writing.

        Args:
            digests: What is kept.
        """
        orphans = self.digests().difference(digests)
        for digest in orphans:
            self.drop(digest)
        return len(orphans)

    def put(self, data: bytes) -> str:
        """Keep bytes and return their digest, once they are on the disk.

        Raises:
            NoRoom: The disk is full, or may not be written.
        """
        digest = hashlib.sha256(data).hexdigest()
        place = self._place(digest)
        try:
            if self.is_sound(digest):
                return digest
            place.parent.mkdir(parents=True, exist_ok=True)
            self._write(place, data)
        except OSError as error:
            raise no_room(self.folder, error) from None
        return digest

    def _write(self, place: Path, data: bytes) -> None:
        handle, name = tempfile.mkstemp(prefix=".new-", dir=self.folder)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            os.replace(name, place)  # noqa: PTH105  # the temporary file has a name, not a path
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
        folder = os.open(place.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)

    def get(self, digest: str) -> bytes:
        """Return the bytes of a digest.

        Raises:
            Damaged: They are not there, or not those that were kept.
        """
        try:
            data = self.path(digest).read_bytes()
        except OSError as error:
            raise _damaged(digest, f"cannot be read: {os.strerror(error.errno or 0).lower()}") from None
        if hashlib.sha256(data).hexdigest() != digest:
            raise _damaged(digest, "was changed since it was written")
        return data

    def is_sound(self, digest: str) -> bool:
        """Return whether the bytes of a digest are there, and those that were kept."""
        try:
            with self.path(digest).open("rb") as file:
                return hashlib.file_digest(file, "sha256").hexdigest() == digest
        except OSError:
            return False

    def require(self, digest: str) -> Path:
        """Return where the bytes of a digest are, after a look at them.

        Raises:
            Damaged: They are not there, or not those that were kept.
        """
        if not self.is_sound(digest):
            raise _damaged(digest, "is not there any more, or was changed since it was written")
        return self.path(digest)

    def path(self, digest: str) -> Path:
        """Return where the bytes of a digest are.

        Raises:
            InternalError: That is no digest.
        """
        if not _DIGEST.fullmatch(digest):
            raise InternalError(f"{digest[:80]!r} is no digest.")
        return self._place(digest)

    def _place(self, digest: str) -> Path:
        return self.folder / digest[:2] / digest

    def drop(self, digest: str) -> None:
        """Remove a value, if it is there."""
        self.path(digest).unlink(missing_ok=True)

    def digests(self) -> set[str]:
        """Return the digests of all that is kept."""
        found: set[str] = set()
        for place in filter(Path.is_dir, self.folder.glob("??")):
            with os.scandir(place) as entries:
                found.update(entry.name for entry in entries if _DIGEST.fullmatch(entry.name))
        return found

    def free(self) -> int:
        """Return how many bytes are free on the disk."""
        return shutil.disk_usage(self.folder).free


def _damaged(digest: str, how: str) -> Damaged:
    return Damaged(f"A stored value {how} ({digest[:12]}...); submit the same mission again, which makes it anew.", digest)
