"""Backups of a data folder, made while the service runs, and restored into an empty folder.

Deletions pause, the databases are copied (each a snapshot of an instant), then the values. A value is on the disk before any record names it, so
whatever a snapshot names is there. Jobs in PostgreSQL become a file of SQLite in the backup, and are restored into either. People come before jobs: a job that is submitted between the two goes to its submitter at the next start. Secrets
stay behind: tokens are not in a backup, which could otherwise bring back revoked ones, and sessions are not. A backup is a tar archive whose last
member lists the digests of all others; one that was cut off or changed is rejected.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
import shutil
import sqlite3
import tarfile
import tempfile
import time
from collections.abc import Generator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import ltlplan
from ltlplan.service.job_queue.store import NoRoom, no_room
from ltlplan.service.storage.deletion_pause import paused
from verify.data.errors import BadInput
from verify.data.storage.safe_reading import parse_json

FORMAT = 2
"""1 had no recordings of flights."""
MANIFEST = "backup.json"
JOBS = "jobs.sqlite"
DATABASES = ("people.sqlite", JOBS, "live.sqlite", "drafts.sqlite")
"""In the order in which they are copied."""
_PLAIN = ("folder", "values/databases.txt")
_RECORDING = re.compile(r"flights/[0-9]{1,18}\.jsonl\.gz")
_VALUE = re.compile(r"values/([0-9a-f]{2})/(\1[0-9a-f]{62})")
_MOST_MANIFEST = 200_000_000


@dataclass(frozen=True, slots=True)
class Backup:
    """A backup.

    Attributes:
        jobs: How many jobs are in it.
        values: How many values.
        recordings: How many recordings of flights.
        bytes: Bytes of all of it, unpacked.
        damaged: Digests of values that were damaged already, and are not in it.
    """

    jobs: int
    values: int
    recordings: int
    bytes: int
    damaged: tuple[str, ...]


def back_up(data: Path, out: Path, database: str | None = None) -> Backup:
    """Back up a data folder, whole or not at all; its service may be running.

    Args:
        data: The folder.
        out: File to write; what is there already stays.
        database: PostgreSQL URL of its jobs; None where they are in the folder.

    Raises:
        BadInput: It is no data folder, its jobs are not there, or there is such a file.
        NoRoom: The disk is full.
    """
    if not (data / "folder").exists():
        raise BadInput(f"{data} is no data folder of a service; name it with --data.")
    if database is None and not (data / JOBS).exists():
        raise BadInput(
            f"The jobs of {data} are in PostgreSQL: name its database as for `ltlplan serve` (--db, --db-file, $LTLPLAN_DB)."
        )
    if out.exists():
        raise BadInput(f"{out} is there already; name another file.")
    beside = out.with_name(f".{out.name}.{os.getpid()}")
    try:
        with paused(data), tempfile.TemporaryDirectory(dir=out.parent, prefix=".backup-") as scratch:
            handle = os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with os.fdopen(handle, "wb") as file:
                made = _write(data, Path(scratch), file, database)
                file.flush()
                os.fsync(file.fileno())
        beside.replace(out)
    except OSError as error:
        raise no_room(out.parent, error) from None
    finally:
        beside.unlink(missing_ok=True)
    return made


def _write(data: Path, scratch: Path, file: BinaryIO, database: str | None) -> Backup:
    digests: dict[str, str] = {}
    size, values, recordings, damaged, jobs = 0, 0, 0, list[str](), 0
    with tarfile.open(fileobj=file, mode="w|") as archive:

        def put(name: str, content: bytes) -> None:
            nonlocal size
            entry = tarfile.TarInfo(name)
            entry.size, entry.mode, entry.mtime = len(content), 0o600, int(time.time())
            archive.addfile(entry, io.BytesIO(content))
            digests[name] = hashlib.sha256(content).hexdigest()
            size += len(content)

        for name in DATABASES:
            if name == JOBS and database is not None:
                jobs = _out_of_postgres(database, data, scratch / name)
            elif (data / name).exists():
                jobs += _snapshot(data / name, scratch / name)
            else:
                continue
            put(name, (scratch / name).read_bytes())
        for name in _PLAIN:
            if (data / name).exists():
                put(name, (data / name).read_bytes())
        for path in sorted((data / "values").glob("??/*")):
            name = str(path.relative_to(data))
            if _VALUE.fullmatch(name):
                content = path.read_bytes()
                if hashlib.sha256(content).hexdigest() == path.name:
                    put(name, content)
                    values += 1
                else:
                    damaged.append(path.name)
        for path in sorted((data / "flights").glob("*.jsonl.gz")):
            name = str(path.relative_to(data))
            with suppress(FileNotFoundError):  # of a flight that was forgotten just now
                if _RECORDING.fullmatch(name):
                    put(name, path.read_bytes())
                    recordings += 1
        told = {
            "format": FORMAT,
            "version": ltlplan.__version__,
            "made": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
            "files": dict(digests),
        }
        put(MANIFEST, json.dumps(told).encode())
    return Backup(jobs, values, recordings, size, tuple(damaged))


def _out_of_postgres(database: str, data: Path, target: Path) -> int:
    """Copy the jobs out of PostgreSQL into a file of SQLite, and return how many they are."""
    from ltlplan.service.job_queue.database import folder_name
    from ltlplan.service.job_queue.database_copies import save_jobs

    jobs = save_jobs(database, folder_name(data), target)
    with closing(sqlite3.connect(target)) as made:
        made.execute("PRAGMA journal_mode = DELETE")
    return jobs


def _snapshot(source: Path, target: Path) -> int:
    """Copy a database as it is at one instant, without sessions; return how many jobs are in it."""
    try:
        with closing(sqlite3.connect(source, timeout=10.0)) as ours, closing(sqlite3.connect(target)) as copy:
            ours.backup(copy)
            tables = {str(name) for (name,) in copy.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
            if "sessions" in tables:
                copy.execute("DELETE FROM sessions")
                copy.commit()
            copy.execute("VACUUM")  # what was deleted is not even in free pages
            copy.execute("PRAGMA journal_mode = DELETE")
            return copy.execute("SELECT count(*) FROM workflow_status").fetchone()[0] if "workflow_status" in tables else 0
    except sqlite3.OperationalError as error:
        if "full" in str(error):
            raise NoRoom(f"{target.parent} cannot be written: the disk is full.") from None
        raise BadInput(f"{source} cannot be read: {error}.") from None
    except sqlite3.DatabaseError as error:
        raise BadInput(f"{source} cannot be backed up: {error}.") from None


def restore(backup: Path, data: Path, database: str | None = None) -> Backup:
    """Restore a backup into a data folder that is empty or not there, whole or not at all.

    Args:
        backup: The backup's file.
        data: The folder.
        database: URL of an empty PostgreSQL database for the jobs; None keeps them in the folder.

    Raises:
        BadInput: It is no backup, was cut off or changed, is a newer version's, or folder or database are not empty.
        NoRoom: The disk is full.
    """
    if data.exists() and (not data.is_dir() or any(data.iterdir())):
        raise BadInput(f"{data} is not empty; name a new folder with --data.")
    data.parent.mkdir(parents=True, exist_ok=True)
    beside = Path(tempfile.mkdtemp(dir=data.parent, prefix=".restoring-"))
    try:
        with backup.open("rb") as file, _in_words(backup), tarfile.open(fileobj=file, mode="r|") as archive:
            made = _read(archive, beside, backup)
        if database is not None:
            from ltlplan.service.job_queue.database_copies import load_jobs

            load_jobs(beside / JOBS, database)
            for left in beside.glob(f"{JOBS}*"):
                left.unlink()
        if data.exists():
            data.rmdir()
        beside.replace(data)
    except OSError as error:
        if error.filename == str(backup):
            raise BadInput(f"{backup} cannot be read: {(error.strerror or str(error)).lower()}.") from None
        raise no_room(data.parent, error) from None
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    return made


def _read(archive: tarfile.TarFile, folder: Path, backup: Path) -> Backup:
    found: dict[str, str] = {}
    size, told = 0, None
    for entry in archive:
        if told is not None or not entry.isreg() or entry.name in found or not _is_ours(entry.name):
            raise BadInput(f"{backup} is no backup of a service: it holds {entry.name[:100]!r}, which is rejected.")
        source = archive.extractfile(entry)
        assert source is not None
        if entry.name == MANIFEST:
            told = parse_json(source.read(_MOST_MANIFEST), MANIFEST)
            continue
        place = folder / entry.name
        place.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        digest = hashlib.sha256()
        with os.fdopen(os.open(place, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as target:
            while part := source.read(1 << 20):
                digest.update(part)
                target.write(part)
            target.flush()
            os.fsync(target.fileno())
        found[entry.name], size = digest.hexdigest(), size + entry.size
    if not isinstance(told, dict) or not isinstance(told.get("format"), int):
        raise BadInput(f"{backup} was cut off, or is no backup of a service.")
    if told["format"] > FORMAT:
        raise BadInput(f"{backup} was written by a newer ltlplan: start that version.")
    if told.get("files") != found:
        raise BadInput(f"{backup} was changed since it was made: a file of it is not the one that was backed up.")
    with closing(sqlite3.connect(folder / JOBS)) as database:
        jobs = database.execute("SELECT count(*) FROM workflow_status").fetchone()[0]
    values, recordings = (sum(map(bool, map(each.fullmatch, found))) for each in (_VALUE, _RECORDING))
    return Backup(jobs, values, recordings, size, ())


def _is_ours(name: str) -> bool:
    return name in (MANIFEST, *DATABASES, *_PLAIN) or any(each.fullmatch(name) for each in (_VALUE, _RECORDING))


@contextmanager
def _in_words(backup: Path) -> Generator[None]:
    try:
        yield
    except (tarfile.TarError, EOFError, sqlite3.DatabaseError) as error:
        raise BadInput(f"{backup} was cut off, or is no backup of a service: {error}.") from None
