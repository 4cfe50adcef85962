"""Backups: whole or rejected, without secrets, and with everything that was accepted, also while the service is at work."""

from __future__ import annotations

import hashlib
import io
import json
import sqlite3
import tarfile
import threading
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ltlplan import Client
from ltlplan.cli import app
from ltlplan.service.job_queue.job_records import Entry
from ltlplan.service.job_queue.results import Results
from ltlplan.service.models import Job
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Role
from ltlplan.service.security.tokens import Tokens
from ltlplan.service.storage.backups import MANIFEST, back_up, restore
from ltlplan.service.storage.deletion_pause import deleting, paused
from tests.helpers.serving.services import ONE_HOOP, serving, submitting
from verify.data import BadInput

STORED = Path(__file__).parent.parent / "stored" / "data-0.2.0.tar.xz"


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """Return a data folder with jobs, an account and a session."""
    return _folder(tmp_path / "data")


def _folder(folder: Path) -> Path:
    with tarfile.open(STORED) as packed:
        packed.extractall(folder, filter="data")
    people = People(Tokens(folder))
    people.accounts.add_by_openid("alice", Role.planner, "https://id.lab", "17")
    people.sessions.begin_of_account("alice")
    people.close()
    (folder / "flights").mkdir()
    (folder / "flights" / "1.jsonl.gz").write_bytes(b"a recording")
    (folder / "flights" / "notes.txt").write_text("somebody's own")
    return folder


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Return a backup."""
    place = tmp_path_factory.mktemp("backup")
    back_up(_folder(place / "data"), place / "lab.tar")
    return (place / "lab.tar").read_bytes()


def _files(folder: Path) -> dict[str, str]:
    kept = [
        path for path in folder.rglob("*") if path.is_file() and (path.parent.parent.name == "values" or path.suffix == ".gz")
    ]
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in kept}


def test_a_backup_is_restored_elsewhere_without_what_lets_anybody_in(data: Path, tmp_path: Path) -> None:
    kept = (data / "tokens.json").read_text()
    out, again = tmp_path / "lab.tar", tmp_path / "elsewhere" / "data"
    told = CliRunner().invoke(app, ["backup", str(out), "--data", str(data), "--json"])
    assert json.loads(told.stdout)["damaged"] == []
    assert out.stat().st_mode & 0o777 == 0o600
    for digest in [entry["sha256"] for entry in json.loads(kept)["tokens"]]:
        assert digest.encode() not in out.read_bytes()
    assert CliRunner().invoke(app, ["restore", str(out), "--data", str(again)]).stdout.startswith("5 jobs and ")
    assert _files(again) == _files(data)
    assert not (again / "tokens.json").exists()
    people = People(Tokens(again))
    assert [each.name for each in people.accounts.all()] == ["alice"]
    assert people.sessions.counts() == {}
    people.close()
    with closing(sqlite3.connect(again / "live.sqlite")) as live:
        assert live.execute("SELECT line FROM events").fetchall() == [("quad0 fails",)]
    assert People(Tokens(data)).log.entries()[0].action == "back up"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["data", "elsewhere", "lab.tar"], "nothing is left lying about"


def test_what_is_no_data_folder_or_is_there_already_is_left_alone(data: Path, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no data folder"):
        back_up(tmp_path, tmp_path / "x.tar")
    (tmp_path / "there").write_text("mine")
    with pytest.raises(BadInput, match="is there already"):
        back_up(data, tmp_path / "there")
    back_up(data, tmp_path / "lab.tar")
    with pytest.raises(BadInput, match="is not empty"):
        restore(tmp_path / "lab.tar", data)
    with pytest.raises(BadInput, match="cannot be read"):
        restore(tmp_path / "none.tar", tmp_path / "new")
    (data / "jobs.sqlite").unlink()
    with pytest.raises(BadInput, match="PostgreSQL"):
        back_up(data, tmp_path / "y.tar")


def test_a_damaged_value_is_told_and_left_out(data: Path, tmp_path: Path) -> None:
    value = next(path for path in sorted((data / "values").glob("??/*")))
    value.write_bytes(b"x")
    assert back_up(data, tmp_path / "lab.tar").damaged == (value.name,)
    restore(tmp_path / "lab.tar", tmp_path / "new")
    assert not (tmp_path / "new" / value.relative_to(data)).exists()


def _changed(backup: Path, change: Callable[[dict[str, tarfile.TarInfo], dict[str, bytes]], None]) -> None:
    """Write a backup anew with other members."""
    with tarfile.open(backup) as archive:
        entries = {entry.name: entry for entry in archive}
        contents = {name: archive.extractfile(entry).read() for name, entry in entries.items()}  # type: ignore[union-attr]
    change(entries, contents)
    with tarfile.open(backup, "w") as archive:
        for name, entry in entries.items():
            entry.size = len(contents.get(name, b"")) if entry.isreg() else 0
            archive.addfile(entry, io.BytesIO(contents.get(name, b"")))


def _link(entries: dict[str, tarfile.TarInfo], contents: dict[str, bytes]) -> None:
    entries["folder"].type, entries["folder"].linkname = tarfile.SYMTYPE, "/etc/passwd"


def _named(name: str) -> Callable[[dict[str, tarfile.TarInfo], dict[str, bytes]], None]:
    def change(entries: dict[str, tarfile.TarInfo], contents: dict[str, bytes]) -> None:
        last = entries.pop(MANIFEST)
        entries[name], contents[name] = tarfile.TarInfo(name), b"x"
        entries[MANIFEST] = last

    return change


def _other(entries: dict[str, tarfile.TarInfo], contents: dict[str, bytes]) -> None:
    contents["folder"] = b"0" * 33


def _without(entries: dict[str, tarfile.TarInfo], contents: dict[str, bytes]) -> None:
    del entries[MANIFEST]


def _newer(entries: dict[str, tarfile.TarInfo], contents: dict[str, bytes]) -> None:
    contents[MANIFEST] = json.dumps({**json.loads(contents[MANIFEST]), "format": 99}).encode()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_link, "rejected"), (_named("../escaped"), "rejected"), (_named("/tmp/escaped"), "rejected"), (_named("tokens.json"), "rejected"),
        (_named("values/ab/cd"), "rejected"), (_named("values/../x"), "rejected"), (_other, "changed since"), (_without, "cut off"), (_newer, "newer ltlplan"),
    ],
)  # fmt: skip
def test_a_backup_that_was_changed_restores_nothing(
    change: Callable[[dict[str, tarfile.TarInfo], dict[str, bytes]], None], words: str, made: bytes, tmp_path: Path
) -> None:
    out = tmp_path / "lab.tar"
    out.write_bytes(made)
    _changed(out, change)
    with pytest.raises(BadInput, match=words):
        restore(out, tmp_path / "new")
    assert not (tmp_path / "new").exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["lab.tar"]


@pytest.mark.parametrize("length", [0, 100, 100_000, -2000])
def test_a_backup_that_was_cut_off_restores_nothing(length: int, made: bytes, tmp_path: Path) -> None:
    out = tmp_path / "lab.tar"
    end = made.rindex(b'{"format"')
    out.write_bytes(made[: length if length >= 0 else end + length])
    with pytest.raises(BadInput, match="cut off"):
        restore(out, tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_deletions_wait_for_a_backup_and_are_done_after_it(tmp_path: Path) -> None:
    results = Results(tmp_path)
    results.store.open()
    digest, shared = results.store.put(b"a"), results.store.put(b"b")
    gone, other = (
        Entry(Job(id=name, mission="m", submitted=""), {"mission": each}) for name, each in (("a", digest), ("b", shared))
    )
    gone.kept.add(shared)
    with paused(tmp_path):
        results.drop(gone, [other])
        assert results.store.digests() == {digest, shared}
    results.drop_leaving([other])
    assert results.store.digests() == {shared}
    began: list[float] = []

    def begin() -> None:
        with paused(tmp_path):
            began.append(time.monotonic())

    with deleting(tmp_path) as may:
        assert may
        backup = threading.Thread(target=begin)
        backup.start()
        time.sleep(0.05)
        assert began == []
    backup.join()
    assert len(began) == 1


@pytest.mark.slow
def test_a_backup_under_load_has_all_that_was_accepted_before_it(tmp_path: Path) -> None:
    data = tmp_path / "data"
    with serving(data, workers=2) as served, Client(served.url) as client:
        before = [client.submit_text(ONE_HOOP, seed=seed) for seed in range(4)]
        first = before[0].wait()
        with submitting(served.url):
            for number in range(3):
                time.sleep(1)
                told = CliRunner().invoke(app, ["backup", str(tmp_path / f"lab-{number}.tar"), "--data", str(data), "--json"])
                assert json.loads(told.stdout)["damaged"] == []
    for number in range(3):
        again = tmp_path / f"again-{number}"
        restore(tmp_path / f"lab-{number}.tar", again)
        with serving(again, workers=2) as served, Client(served.url) as client:
            assert {job.id for job in before} <= {job.id for job in client.jobs(limit=500)}
            assert client.recheck(first.id).holds
            for job in client.jobs(limit=500):
                if job.state == "done":
                    for file in job.files:
                        assert hashlib.sha256(job.file(file.name)).hexdigest() == file.sha256
            if number == 2:
                assert all(client.job(job.id).wait().state == "done" for job in before), "what waited goes on elsewhere"
