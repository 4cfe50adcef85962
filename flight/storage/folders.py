"""Writing folders whole or not at all, so that nothing of a user's is overwritten, moved or lost.

New files are made in a folder beside the target (`.NAME.ltlplan-*`), which holds a lock for as long as its process lives. When
all are there, what in the target is the user's (`flight.storage.ownership`) is linked into the new folder under the same names,
and the two folders change places in one system call: at every instant the target is the old folder or the new one, with all of
the user's files in it. What a user put into the old folder after it was looked at, down to the last moment, goes over into the
new one while the old one is emptied: of it only files are removed that are ours and unchanged, or that the new folder holds too.
A name that both want by then is kept as `NAME.kept`. The next writer does the same with what a killed process left behind.

A folder that is not empty and has no manifest is somebody else's and is refused, as is a name that is needed and is the user's.
Where the system cannot exchange two folders (Linux can, on its usual file systems), two renames follow each other; a kill
between them leaves no target, and the next writer puts the old one back.
"""

from __future__ import annotations

import ctypes
import errno
import glob
import os
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from flight.storage.ownership import (
    MANIFEST,
    Contents,
    digest_of,
    files_in,
    folders_in,
    manifest_bytes,
    read_contents,
    read_manifest,
)
from verify.data.errors import BadInput

try:
    import fcntl
except ImportError:  # not a Unix: nothing can tell a dead process's folder from a living one's, so none is cleared up
    fcntl = None

PROOF = "certificate.json"
"""The file that makes a folder a certified flight; such a folder is replaced by another certified flight only."""

FLOWN = "live.json"
"""The file that makes a folder the record of a live flight; what is no live flight does not replace it."""

_ELSEWHERE = "name another folder with --out"
_AT_FDCWD, _EXCHANGE = -100, 2  # linux/fcntl.h
_NO_EXCHANGE = (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP, errno.EXDEV)


def check_folder(target: str | os.PathLike[str], written: Iterable[str] | None = None) -> Path:
    """Return the folder to write, refusing what `write_folder` would refuse: before minutes of work, not after.

    Args:
        target: The folder.
        written: The files that will be written, relative to it and with slashes, where they are known.

    Raises:
        BadInput: The target is a file or lies below one, cannot be written or replaced, is somebody else's, or holds a file of
            the user's, a certificate, or the record of a live flight, that would be lost.
    """
    target = Path(target)
    try:
        place = target.resolve()
        if target.exists():
            _check_replaceable(target, place)
            _check_contents(target, read_contents(place, written or ()), written)
        nearest = next(folder for folder in place.parents if folder.exists())
    except (OSError, RuntimeError) as error:  # a loop of links is a RuntimeError
        raise BadInput(f"{target} cannot be used: {getattr(error, 'strerror', None) or error}; {_ELSEWHERE}.") from None
    if not nearest.is_dir():
        raise BadInput(f"{nearest} is a file, so {target} cannot be a folder; {_ELSEWHERE}.")
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise BadInput(f"{nearest} cannot be written to; {_ELSEWHERE}.")
    return target


def write_folder(target: str | os.PathLike[str], write: Callable[[Path], None]) -> tuple[Path, ...]:
    """Let `write` fill a fresh folder, then put it in the target's place, together with what in there is the user's.

    Returns:
        The files that were written, sorted by name, at their final places, the manifest last.

    Raises:
        BadInput: As `check_folder`.
    """
    target = check_folder(target)
    place = target.resolve()
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        with _fresh_folder(place) as fresh:
            write(fresh)
            written = files_in(fresh)
            (fresh / MANIFEST).write_bytes(manifest_bytes({path: [digest_of(fresh / path)] for path in written}))
            with _turn(place.parent):
                _put(fresh, place, target, (*written, MANIFEST))
    except OSError as error:
        raise BadInput(f"{target} cannot be written: {error.strerror or error}; {_ELSEWHERE}.") from None
    return tuple(target / path for path in (*written, MANIFEST))


def write_files(target: str | os.PathLike[str], files: Mapping[str, bytes]) -> tuple[Path, ...]:
    """Write files by their names into a folder, as `write_folder` does."""
    return write_folder(target, lambda folder: put_files(files, folder))


def put_files(files: Mapping[str, bytes], folder: Path) -> None:
    """Write files by their names into a fresh folder."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)


def _check_replaceable(target: Path, place: Path) -> None:
    """Reject a target that is no folder, or one that must stay where it is."""
    if not target.is_dir():
        raise BadInput(f"{target} is a file; name a folder to write.")
    inside = _around_us(place)
    if inside is not None or place.is_mount():
        what = inside or "a mount point"
        raise BadInput(f"{target} is {what} and cannot be replaced; name a folder inside it, such as {target / 'run'}.")
    if not place.stat().st_mode & stat.S_IWUSR:
        raise BadInput(f"{target} was made read-only; {_ELSEWHERE}.")


def _around_us(place: Path) -> str | None:
    """Say that a folder is the one that this process is in, or around it; a shell there would be left nowhere."""
    try:
        here = Path.cwd()
        inside = next((folder for folder in (here, *here.parents) if folder.samefile(place)), None)
    except FileNotFoundError:  # it was removed while we are in it
        return None
    return None if inside is None else "the folder you are in" if inside == here else "around the folder you are in"


def _check_contents(target: Path, contents: Contents, written: Iterable[str] | None) -> None:
    """Reject a folder of somebody else's, and names that are needed and are the user's."""
    if contents.listed is None and (found := sorted({*contents.theirs, *contents.folders})):
        raise BadInput(
            f"{target} is not empty and has no {MANIFEST}, so ltlplan did not write it (it holds {found[0]}); {_ELSEWHERE}."
        )
    if written is None:
        return
    written = tuple(written)
    if found := list(contents.in_the_way(written)):
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        raise BadInput(
            f"{target / found[0]}{more} is yours, or was changed since ltlplan wrote it, and would be overwritten; "
            f"move it away, or {_ELSEWHERE}."
        )
    if PROOF in contents.ours and PROOF not in written:
        raise BadInput(f"{target} holds a certified flight, which would be lost; {_ELSEWHERE}.")
    if FLOWN in contents.ours and FLOWN not in written:
        raise BadInput(f"{target} holds the record of a live flight, which would be lost; {_ELSEWHERE}.")


@contextmanager  # pyright: ignore[reportDeprecated]  # of its annotation, not of the function
def _fresh_folder(place: Path) -> Iterator[Path]:
    """Yield an empty folder beside the target, locked while this process lives; what is left of it at the end goes."""
    with _turn(place.parent) as ours:
        if ours:
            _recover(place)
        aside = Path(tempfile.mkdtemp(prefix=f".{place.name}.ltlplan-", dir=place.parent))
        lock = (aside / "lock").open("wb")
        _locked(lock)
    try:
        fresh = aside / "new"
        fresh.mkdir()
        lock.write(str(fresh.stat().st_ino).encode())  # by this a later process tells whether folders changed places
        lock.flush()
        yield fresh
    finally:
        with lock, _turn(place.parent):
            _dispose(aside, place)


def _recover(place: Path) -> None:
    """Tidy what killed processes left beside the target; put back a folder that one of them had moved away."""
    for left in sorted(place.parent.glob(f".{glob.escape(place.name)}.ltlplan-*")):
        try:
            with (left / "lock").open("rb") as lock:
                if _locked(lock):
                    if (left / "old").exists() and not place.exists():
                        (left / "old").rename(place)
                    _dispose(left, place)
        except FileNotFoundError:  # killed as it began or as it ended: it is our turn, so nobody is in the middle of either
            with suppress(OSError):
                left.rmdir()


def _dispose(aside: Path, place: Path) -> None:
    """Remove a folder beside the target, handing over what in it is the user's."""
    with suppress(OSError):
        fresh = (aside / "lock").read_text()
        for folder in (aside / "new", aside / "old"):
            if not folder.is_dir():
                continue
            if folder.name == "new" and fresh in ("", str(folder.stat().st_ino)):  # never was in the target's place
                _unprotect(folder, folders_in(folder))
                shutil.rmtree(folder)  # what it has of the user's are links, or copies
            else:
                _hand_over(folder, place)
        (aside / "lock").unlink()
        aside.rmdir()


def _put(fresh: Path, place: Path, target: Path, written: tuple[str, ...]) -> None:
    """Let a folder take the target's place, with what in the target is the user's; leave the old one beside it."""
    if not place.exists():
        fresh.rename(place)
        return
    _check_replaceable(target, place)
    contents = read_contents(place, written)
    _check_contents(target, contents, written)
    _link_theirs(place, fresh, contents)
    if _exchange(fresh, place):
        return
    old = fresh.with_name("old")
    place.rename(old)
    try:
        fresh.rename(place)
    except BaseException:
        old.rename(place)
        raise


def _exchange(one: Path, other: Path) -> bool:
    """Let two folders change places in one step; tell whether the system can."""
    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (AttributeError, OSError, TypeError):  # another C library, or none that can be asked
        return False
    if rename(_AT_FDCWD, os.fsencode(one), _AT_FDCWD, os.fsencode(other), _EXCHANGE) == 0:
        return True
    number = ctypes.get_errno()
    if number in _NO_EXCHANGE:
        return False
    raise OSError(number, os.strerror(number))


def _link_theirs(place: Path, fresh: Path, contents: Contents) -> None:
    """Give the user's files and folders a second name in the new folder; links and special files as they are."""
    device = place.stat().st_dev
    folders = [path for path in contents.folders if path not in contents.shared or any(_holds(path, contents.theirs))]
    for path in folders:
        if (place / path).stat().st_dev != device:
            raise BadInput(f"{place / path} is a mount point, so {place} cannot be replaced; {_ELSEWHERE}.")
        (fresh / path).mkdir(parents=True, exist_ok=True)
    for path in sorted(contents.theirs):
        try:
            os.link(place / path, fresh / path, follow_symlinks=False)
        except FileNotFoundError:
            continue  # removed this moment
        except (OSError, NotImplementedError):  # the file system has no hard links, or the file is another user's
            shutil.copy2(place / path, fresh / path, follow_symlinks=False)
    for path in reversed(folders):
        _own_alike(place / path, fresh / path)
        shutil.copystat(place / path, fresh / path)
    _own_alike(place, fresh)
    shutil.copymode(place, fresh)


def _hand_over(old: Path, place: Path) -> None:
    """Empty a folder that was replaced: what is ours and unchanged goes, what is the user's is in the target, or goes there."""
    for _ in range(4):  # somebody may put a file in meanwhile
        try:
            contents = read_contents(old, _written_in(place))
        except BadInput:  # changed in the last moment: the user's too, and nothing is known to be ours any more
            _move_in(old / MANIFEST, place / MANIFEST)
            continue
        _unprotect(old, contents.folders)
        for path in sorted(contents.ours | contents.theirs, key=lambda path: path.endswith(MANIFEST)):  # which say what is ours
            if path == MANIFEST:
                continue
            if path in contents.ours or _same_file(old / path, place / path):
                (old / path).unlink()
            else:
                _move_in(old / path, place / path)
        for path in reversed(contents.folders):
            with suppress(OSError):
                (old / path).rmdir()
        if MANIFEST in contents.ours and not any(
            path.name != MANIFEST for path in old.iterdir()
        ):  # it says what is ours, should we be killed before
            (old / MANIFEST).unlink()
        with suppress(OSError):
            old.rmdir()
            return


def _written_in(place: Path) -> tuple[str, ...]:
    """Return what was written into a folder that took another one's place; nothing where that cannot be told any more."""
    try:
        return tuple(read_manifest(place) or ())
    except BadInput:
        return ()


def _unprotect(folder: Path, below: Iterable[str]) -> None:
    """Make folders that are to be removed writable; the ones that the user protected are in the target."""
    for path in below:
        with suppress(OSError):
            (folder / path).chmod(0o700)


def _move_in(file: Path, wanted: Path) -> None:
    """Move a user's file to its place in the target, or beside what is there by now."""
    names = (wanted, *(wanted.with_name(f"{wanted.name}.kept{number}") for number in ("", *range(1, 1000))))
    free = next(name for name in names if not os.path.lexists(name))
    free.parent.mkdir(parents=True, exist_ok=True)
    file.rename(free)


def _same_file(one: Path, other: Path) -> bool:
    """Return whether two names are of one file, or of two with the same bytes."""
    try:
        a, b = one.lstat(), other.lstat()
        if os.path.samestat(a, b):
            return True
        if stat.S_ISLNK(a.st_mode) and stat.S_ISLNK(b.st_mode):
            return one.readlink() == other.readlink()
        return stat.S_ISREG(a.st_mode) and stat.S_ISREG(b.st_mode) and digest_of(one) == digest_of(other)
    except OSError:
        return False


def _holds(folder: str, paths: Iterable[str]) -> Iterator[bool]:
    return (path.startswith(f"{folder}/") for path in paths)


def _own_alike(old: Path, new: Path) -> None:
    """Give a folder the owner of another, where we may."""
    with suppress(OSError, AttributeError):
        os.chown(new, old.stat().st_uid, old.stat().st_gid)


@contextmanager  # pyright: ignore[reportDeprecated]  # of its annotation, not of the function
def _turn(folder: Path) -> Iterator[bool]:
    """Let processes that write beside each other take turns in the short steps that another one must not see half done.

    Yields whether they do; some file systems know no locks, and some folders may be written but not read.
    """
    handle = None
    try:
        try:
            if fcntl is not None:
                handle = os.open(folder, os.O_RDONLY)
                fcntl.flock(handle, fcntl.LOCK_EX)
            ours = fcntl is not None
        except OSError:
            ours = False
        yield ours
    finally:
        if handle is not None:
            os.close(handle)


def _locked(lock: BinaryIO) -> bool:
    """Take a file's lock, which goes when its process ends, however it ends; tell whether it could be had."""
    if fcntl is None:
        return False
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:  # another process has it, or the file system knows no locks
        return False
    return True
