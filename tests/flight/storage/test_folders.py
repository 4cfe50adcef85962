"""Folders are written whole or not at all, and nothing of a user's in them is overwritten or lost, whatever is killed when."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from flight.storage.folders import check_folder, write_files, write_folder
from flight.storage.ownership import read_contents
from verify.data import BadInput

ROOT = Path(__file__).parents[4]
FIRST = {"mission.yaml": b"first", "r0.csv": b"1", "r1.csv": b"2", "crazyswarm2/crazyflies.yaml": b"uri"}
SECOND = {"mission.yaml": b"second", "r0.csv": b"3", "crazyswarm2/crazyflies.yaml": b"uri"}


def everything(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def without_manifest(folder: Path) -> dict[str, bytes]:
    return {name: content for name, content in everything(folder).items() if name != "manifest.json"}


def test_a_second_run_replaces_what_the_first_wrote_and_nothing_else(tmp_path: Path) -> None:
    run = tmp_path / "run"
    write_files(run, FIRST)
    mine = {"recorded.csv": b"flown", "mocap.csv": b"seen", "crazyswarm2/fly_twice.py": b"script", "a/b/c.bag": b"bag"}
    for name, content in mine.items():
        (run / name).parent.mkdir(parents=True, exist_ok=True)
        (run / name).write_bytes(content)
    (run / "empty").mkdir(mode=0o500)
    (run / "link").symlink_to("a/b")
    (run / "nowhere").symlink_to("gone")
    (run / "a" / "b" / "c.bag").chmod(0o400)
    os.utime(run / "a", (1e9, 1e9))
    files = write_files(run, SECOND)
    assert [path.name for path in files] == ["crazyflies.yaml", "mission.yaml", "r0.csv", "manifest.json"]
    assert without_manifest(run) == SECOND | mine, "r1.csv was ours alone, and is gone"
    assert (run / "link").readlink() == Path("a/b")
    assert (run / "nowhere").is_symlink()
    assert (run / "empty").stat().st_mode & 0o777 == 0o500
    assert (run / "a" / "b" / "c.bag").stat().st_mode & 0o777 == 0o400
    assert (run / "a").stat().st_mtime == 1e9
    assert [path.name for path in tmp_path.iterdir()] == ["run"]
    assert write_files(run, SECOND) == files, "and again"


def test_an_export_that_was_made_anew_is_replaced_by_the_next_run_and_others_stay(tmp_path: Path) -> None:
    def fly(run: Path, content: bytes) -> None:
        (run / "mission.yaml").write_bytes(content)
        write_files(run / "swarm", {"robots.yaml": content, "fly.py": content})

    run = tmp_path / "run"
    write_folder(run, lambda folder: fly(folder, b"first"))
    write_files(run / "swarm", {"robots.yaml": b"exported", "r0.csv": b"path"})
    write_files(run / "stream", {"robots.yaml": b"exported"})
    write_folder(run, lambda folder: fly(folder, b"second"))
    assert {name: content for name, content in everything(run).items() if "manifest" not in name} == {
        "mission.yaml": b"second", "stream/robots.yaml": b"exported", "swarm/fly.py": b"second", "swarm/robots.yaml": b"second",
    }  # fmt: skip
    (run / "swarm" / "robots.yaml").write_bytes(b"mine")
    with pytest.raises(BadInput, match=r"swarm/robots\.yaml is yours, or was changed"):
        write_folder(run, lambda folder: fly(folder, b"third"))
    assert (run / "swarm" / "robots.yaml").read_bytes() == b"mine"
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_a_file_that_is_being_recorded_goes_on_in_the_new_folder(tmp_path: Path) -> None:
    write_files(tmp_path / "run", FIRST)
    with (tmp_path / "run" / "recorded.csv").open("w") as recording:
        recording.write("before\n")
        write_files(tmp_path / "run", SECOND)
        recording.write("after\n")
    assert (tmp_path / "run" / "recorded.csv").read_text() == "before\nafter\n"


def edited(path: Path) -> None:
    path.write_bytes(path.read_bytes() + b" # mine")


def protected(path: Path) -> None:
    path.chmod(0o444)


def linked(path: Path) -> None:
    path.rename(path.parents[1] / "elsewhere")
    path.symlink_to(path.parents[1] / "elsewhere")


def folder_instead(path: Path) -> None:
    path.unlink()
    path.mkdir()


@pytest.mark.parametrize("how", [edited, protected, linked, folder_instead])
@pytest.mark.parametrize("name", ["mission.yaml", "crazyswarm2/crazyflies.yaml"])
def test_what_is_not_as_we_left_it_is_refused_by_its_name(how, name: str, tmp_path: Path) -> None:
    run = tmp_path / "run"
    write_files(run, FIRST)
    how(run / name)
    before = everything(run)
    with pytest.raises(BadInput, match=rf"{name} is yours, or was changed since ltlplan wrote it"):
        check_folder(run, SECOND)
    with pytest.raises(BadInput, match=rf"{name} is yours, or was changed since ltlplan wrote it"):
        write_files(run, SECOND)
    assert everything(run) == before
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


def test_a_changed_file_that_is_not_needed_is_kept(tmp_path: Path) -> None:
    write_files(tmp_path / "run", FIRST)
    edited(tmp_path / "run" / "r1.csv")
    write_files(tmp_path / "run", SECOND)
    assert without_manifest(tmp_path / "run") == {**SECOND, "r1.csv": b"2 # mine"}
    with pytest.raises(BadInput, match=r"r1\.csv is yours"):
        write_files(tmp_path / "run", FIRST)


@pytest.mark.parametrize(
    ("mine", "ours"),
    [
        ("Flight.csv", "flight.csv"),
        ("STRASSE.csv", "straße.csv"),
        ("e\u0301.csv", "\u00e9.csv"),
        ("crazyswarm2", "crazyswarm2/a.csv"),
        ("Crazyswarm2/mine.txt", "crazyswarm2/a.csv"),
        ("flight.csv/mine.txt", "flight.csv"),
        ("Manifest.json", "flight.csv"),
    ],
)
def test_names_that_some_file_system_holds_for_the_same_collide(mine: str, ours: str, tmp_path: Path) -> None:
    write_files(tmp_path / "run", {"other.txt": b""})
    (tmp_path / "run" / mine).parent.mkdir(exist_ok=True)
    (tmp_path / "run" / mine).write_bytes(b"mine")
    with pytest.raises(BadInput, match="is yours, or was changed"):
        write_files(tmp_path / "run", {ours: b"ours"})
    assert (tmp_path / "run" / mine).read_bytes() == b"mine"


@pytest.mark.parametrize("name", ["mission.yaml", "flight.csv", "certificate.json", ".hidden", "folder/deeper"])
def test_a_folder_without_a_manifest_is_somebody_elses(name: str, tmp_path: Path) -> None:
    (tmp_path / "mine" / name).parent.mkdir(parents=True)
    (tmp_path / "mine" / name).write_text("written by hand")
    with pytest.raises(BadInput, match=r"is not empty and has no manifest\.json, so ltlplan did not write it"):
        write_files(tmp_path / "mine", FIRST)
    assert (tmp_path / "mine" / name).read_text() == "written by hand"


def test_a_manifest_that_was_changed_owns_nothing(tmp_path: Path) -> None:
    run = tmp_path / "run"
    write_files(run, FIRST)
    right = (run / "manifest.json").read_text()
    for wrong in (
        "",
        "{}",
        "[]",
        "[" * 100_000,
        "null",
        right[:-5],
        right.replace("r0", "rr"),
        right.replace('"format": 1', '"format": 2'),
    ):
        (run / "manifest.json").write_text(wrong)
        with pytest.raises(BadInput, match=r"manifest\.json is not as ltlplan wrote it, so nothing in"):
            write_files(run, SECOND)
        assert (run / "r0.csv").read_bytes() == b"1"
    (run / "manifest.json").write_text(right)
    write_files(run, SECOND)


def test_the_record_of_a_live_flight_is_not_lost_to_what_is_none(tmp_path: Path) -> None:
    write_files(tmp_path / "live", {"live.json": b"{}", "poses.csv": b"t"})
    with pytest.raises(BadInput, match="record of a live flight, which would be lost"):
        write_files(tmp_path / "live", SECOND)
    with pytest.raises(BadInput, match="record of a live flight"):
        check_folder(tmp_path / "live", SECOND)
    assert without_manifest(tmp_path / "live") == {"live.json": b"{}", "poses.csv": b"t"}
    write_files(tmp_path / "live", {"live.json": b"{ }"})


def test_a_certified_flight_is_not_lost_to_one_that_is_not(tmp_path: Path) -> None:
    write_files(tmp_path / "run", {**FIRST, "certificate.json": b"{}"})
    with pytest.raises(BadInput, match="certified flight, which would be lost"):
        write_files(tmp_path / "run", SECOND)
    with pytest.raises(BadInput, match="certified flight"):
        check_folder(tmp_path / "run", SECOND)
    assert without_manifest(tmp_path / "run") == {**FIRST, "certificate.json": b"{}"}


def test_a_file_that_appears_while_a_run_computes_is_kept_or_refused(tmp_path: Path) -> None:
    run = tmp_path / "run"
    write_files(run, FIRST)

    def write(folder: Path) -> None:
        (folder / "r0.csv").write_text("new")
        (run / "recorded.csv").write_text("meanwhile")

    write_folder(run, write)
    assert without_manifest(run) == {"r0.csv": b"new", "recorded.csv": b"meanwhile"}

    def collide(folder: Path) -> None:
        (folder / "r0.csv").write_text("newer")
        (run / "r0.csv").write_text("mine")

    with pytest.raises(BadInput, match=r"r0\.csv is yours"):
        write_folder(run, collide)
    assert (run / "r0.csv").read_text() == "mine"

    def appear(folder: Path) -> None:
        (folder / "r0.csv").write_text("ours")
        (tmp_path / "late").mkdir()
        (tmp_path / "late" / "mine.txt").write_text("mine")

    with pytest.raises(BadInput, match=r"has no manifest\.json"):
        write_folder(tmp_path / "late", appear)
    assert everything(tmp_path / "late") == {"mine.txt": b"mine"}


def test_a_link_to_a_folder_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir(mode=0o2770)
    (tmp_path / "there").chmod(0o2770)
    (tmp_path / "run").symlink_to("there")
    write_files(tmp_path / "run", FIRST)
    write_files(tmp_path / "run", SECOND)
    assert (tmp_path / "run").is_symlink()
    assert without_manifest(tmp_path / "there") == SECOND
    assert (tmp_path / "there").stat().st_mode & 0o7777 == 0o2770


def test_targets_that_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(BadInput, match="is a file; name a folder"):
        check_folder(tmp_path / "file")
    with pytest.raises(BadInput, match=r"file is a file, so .* cannot be a folder"):
        check_folder(tmp_path / "file" / "run")
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(BadInput, match="loop cannot be used"):
        check_folder(tmp_path / "loop")
    write_files(tmp_path / "kept", FIRST)
    (tmp_path / "kept").chmod(0o555)
    with pytest.raises(BadInput, match="kept was made read-only"):
        check_folder(tmp_path / "kept")
    (tmp_path / "empty" / "below").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "empty")
    with pytest.raises(BadInput, match=r"\. is the folder you are in"):
        check_folder(".")
    monkeypatch.chdir(tmp_path / "empty" / "below")
    with pytest.raises(BadInput, match="is around the folder you are in"):
        check_folder("..")
    (tmp_path / "empty" / "below").rmdir()
    write_files(tmp_path / "kept2", FIRST)
    write_files(tmp_path / "kept2", FIRST)  # from a folder that is gone
    with pytest.raises(BadInput, match="File name too long"):
        check_folder(tmp_path / ("x" * 300))


def test_a_disk_error_is_told_and_leaves_nothing(tmp_path: Path) -> None:
    def full(folder: Path) -> None:
        (folder / "mission.yaml").write_text("half")
        raise OSError(28, "No space left on device")

    with pytest.raises(BadInput, match="cannot be written: No space left on device"):
        write_folder(tmp_path / "run", full)
    assert list(tmp_path.iterdir()) == []


def test_without_exchange_and_hard_links_the_same_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on file systems that have neither."""
    asked: list[object] = []

    def refuse(asked_of: object, *_arguments: object, **_options: object) -> None:
        asked.append(asked_of)
        raise OSError(1, "Operation not permitted")

    monkeypatch.setattr("ctypes.CDLL", refuse)
    monkeypatch.setattr("os.link", refuse)
    test_a_second_run_replaces_what_the_first_wrote_and_nothing_else(tmp_path)
    run = tmp_path / "run"
    assert {None, run / "recorded.csv", run / "a" / "b" / "c.bag"} <= set(asked), "an exchange and links were asked for"


KILLED_AT_STEP = """
import ctypes, os, signal, sys
from pathlib import Path
from tests.verify.data.storage.test_folders import SECOND
from flight.storage.folders import write_files

WATCHED = {"open", "os.rename", "os.link", "os.remove", "os.mkdir", "os.rmdir", "os.chmod", "os.chown", "os.scandir", "os.listdir"}
late, exchange = sys.argv[1] == "late", sys.argv[2] == "exchange"

def refuse(*arguments, **options):
    raise OSError(1, "no")

if not exchange:
    ctypes.CDLL = os.link = refuse

def write(last, run):
    steps, busy = 0, False

    def watch(event, arguments):
        nonlocal steps, busy
        if event not in WATCHED or busy:
            return
        busy, steps = True, steps + 1
        if late and run.is_dir() and (steps + last) % 7 == 0:
            (run / f"late{steps}.csv").write_text("late")
            os.write(1, b"%d " % steps)
        if steps == last:
            os.kill(os.getpid(), signal.SIGKILL)
        busy = False

    sys.addaudithook(watch)
    write_files(run, SECOND)
    os._exit(0)

for line in sys.stdin:
    last, run = line.split()
    child = os.fork()
    if child == 0:
        write(int(last), Path(run))
    os.write(1, b"%d\\n" % os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


@pytest.mark.slow
@pytest.mark.parametrize("exchange", ["exchange", "renames"])
@pytest.mark.parametrize("late", ["late", "quiet"])
def test_a_kill_at_any_step_leaves_the_old_folder_or_the_new_one_with_all_of_the_users_files(
    late: str, exchange: str, tmp_path: Path
) -> None:
    """Each system call on files is the last one once; with `late`, a user's file appears in the target before some of them."""
    mine = {"recorded.csv": b"flown", "crazyswarm2/mine.py": b"script"}
    writer = subprocess.Popen(
        [sys.executable, "-c", KILLED_AT_STEP, late, exchange],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert writer.stdin is not None
    assert writer.stdout is not None
    with writer, writer.stdin, writer.stdout:
        for step in range(1, 400):
            run = tmp_path / str(step) / "run"
            write_files(run, FIRST)
            for name, content in mine.items():
                (run / name).write_bytes(content)
            writer.stdin.write(f"{step} {run}\n")
            writer.stdin.flush()
            *seen, code = writer.stdout.readline().split()
            expected = {f"late{number}.csv": b"late" for number in seen} | mine
            if run.is_dir():  # a mixture never; what came in the last moment may still be beside
                whole = {name: content for name, content in without_manifest(run).items() if name not in expected}
                assert whole in (FIRST, SECOND)
                assert mine.items() <= everything(run).items()
                assert set(read_contents(run).ours) == {*whole, "manifest.json"}
            else:
                assert exchange == "renames"
            write_files(run, SECOND)  # the next writer
            assert without_manifest(run) == SECOND | expected
            assert list(run.parent.iterdir()) == [run]
            if int(code) == 0:
                assert step > 30
                return
            assert int(code) == -signal.SIGKILL
    raise AssertionError("the writer never came to its end")


WRITES_ON = """
import itertools, sys
from pathlib import Path
from tests.verify.data.storage.test_folders import FIRST, SECOND
from flight.storage.folders import write_files
print("writing", flush=True)
for files in itertools.cycle((FIRST, SECOND)):
    write_files(Path(sys.argv[1]), files)
"""


@pytest.mark.slow
def test_kills_at_random_instants_while_the_user_adds_files(tmp_path: Path) -> None:
    run, mine = tmp_path / "run", dict[str, bytes]()
    write_files(run, FIRST)
    draw = random.Random(7)
    for turn in range(25):
        writer = subprocess.Popen(
            [sys.executable, "-c", WRITES_ON, str(run)], stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(ROOT)}
        )
        assert writer.stdout is not None
        writer.stdout.readline()
        ends = time.monotonic() + draw.uniform(0.0, 0.3)
        while time.monotonic() < ends:
            name = f"recorded{len(mine)}.csv"
            try:
                (run / name).write_bytes(name.encode())
            except FileNotFoundError:  # the system had found the old folder, and it went before the file was made
                continue
            mine[name] = name.encode()
            time.sleep(draw.uniform(0.0, 0.01))
        writer.kill()
        writer.communicate(timeout=60)
        whole = {name: content for name, content in without_manifest(run).items() if name not in mine}
        assert whole in (FIRST, SECOND), turn
        write_files(run, FIRST)
        assert without_manifest(run) == FIRST | mine
        assert [path.name for path in tmp_path.iterdir()] == ["run"]
