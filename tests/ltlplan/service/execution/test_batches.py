"""Folders of missions: each becomes what `ltlplan run` makes of it, once, and nothing that fails stops or spoils the rest."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest

import ltlplan
from ltlplan.service.execution.batches import RECORD, exit_code, run_batch
from ltlplan.service.execution.clusters import Cluster, ClusterError
from ltlplan.service.execution.workers import LocalWorkers
from tests.helpers.few import few_of
from tests.helpers.motion.flights import small_mission
from tests.helpers.serving.clusters import local_cluster
from verify.data import BadInput, mission_to_yaml


class Here:
    """Workers that do everything at once, in this process, and remember what they were asked."""

    def __init__(self, before: Callable[[str], None] = lambda _stage: None, count: int = 2) -> None:
        self.count = count
        self.asked: list[str] = []
        self.futures: list[Future[Any]] = []
        self._before = before

    def submit(self, work: Callable[..., Any], /, stage: str, value: bytes, progress: Any = None) -> Future[Any]:
        self.asked.append(stage)
        future: Future[Any] = Future()
        self.futures.append(future)
        try:
            self._before(stage)
            future.set_result(work(stage, value, progress))
        except Exception as error:
            future.set_exception(error)
        return future


def missions(folder: Path, **formulas: str) -> Path:
    """Write a mission file for each formula."""
    folder.mkdir(exist_ok=True)
    for name, formula in formulas.items():
        (folder / f"{name}.yaml").write_text(
            mission_to_yaml(small_mission(formula, margin=0.05, extra="planner: {pace: nominal}"))
        )
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with missions and, in `out`, what became of them."""
    folder = missions(tmp_path_factory.mktemp("batch") / "missions", good="F a", never="F a & G !a")
    (folder / "wrong.yaml").write_text("format: 1\nname: wrong\n")
    (folder / "notes.txt").write_text("mine")
    entries = run_batch(folder, folder.parent / "out", workers=Here())
    assert [(entry.name, entry.exit_code, entry.found) for entry in entries] == [
        ("good", 0, False), ("never", 3, False), ("wrong", 2, False),
    ]  # fmt: skip
    assert exit_code(entries) == 3
    assert "wrong.yaml" in entries[2].sentence
    return folder


@pytest.mark.slow
def test_each_folder_is_what_run_writes_and_a_record(done: Path, tmp_path: Path) -> None:
    ltlplan.run(done / "good.yaml", tmp_path / "run")
    ours, theirs = contents(tmp_path / "run"), contents(done.parent / "out" / "good")
    assert theirs.keys() - ours.keys() == {RECORD}
    assert [name for name in ours if ours[name] != theirs[name]] == ["manifest.json"]
    assert [path.name for path in (done.parent / "out").iterdir()] == ["good"], "what fails leaves nothing"


def test_what_was_done_is_not_done_again(done: Path) -> None:
    workers = Here()
    before = contents(done.parent / "out")
    good, never, _ = run_batch(done, done.parent / "out", workers=workers)
    assert (good.found, good.cost is None, never.found) == (True, False, False)
    assert workers.asked == ["plan"], "of the mission that failed"
    assert contents(done.parent / "out") == before


@few_of(1, "change", ["seed", "version", "mission"])
def test_another_seed_version_or_mission_is_run(
    change: str, done: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(done.parent, tmp_path, dirs_exist_ok=True)
    if change == "version":
        monkeypatch.setattr("ltlplan.service.provenance.software", lambda: {"ltlplan": "0"})
    if change == "mission":
        missions(tmp_path / "missions", good="F a & F free")
    workers = Here()
    good, *_ = run_batch(tmp_path / "missions", tmp_path / "out", workers=workers, seed=7 if change == "seed" else None)
    assert (good.found, good.exit_code) == (False, 0)
    assert workers.asked.count("files") == 1


def test_a_folder_that_somebody_changed_is_theirs(done: Path, tmp_path: Path) -> None:
    shutil.copytree(done.parent, tmp_path, dirs_exist_ok=True)
    run = tmp_path / "out" / "good"
    (run / "report.html").write_text("mine")
    (run / "notes.txt").write_text("mine too")
    workers = Here()
    good, *_ = run_batch(tmp_path / "missions", tmp_path / "out", workers=workers)
    assert (good.exit_code, "report.html is yours" in good.sentence, "files" in workers.asked) == (2, True, False)
    (run / "report.html").unlink()
    good, *_ = run_batch(tmp_path / "missions", tmp_path / "out", workers=workers)
    assert (good.exit_code, good.found) == (0, False)
    assert (run / "notes.txt").read_text() == "mine too"
    (tmp_path / "out" / "never").mkdir()
    (tmp_path / "out" / "never" / "thesis.tex").write_text("mine")
    _, never, _ = run_batch(tmp_path / "missions", tmp_path / "out", workers=workers)
    assert "did not write it" in never.sentence


@pytest.mark.slow
@pytest.mark.parametrize("error", [KeyboardInterrupt, pytest.param(ClusterError, marks=pytest.mark.slow)])
def test_what_ends_the_whole_leaves_whole_folders_and_is_gone_on_with(error: type[BaseException], tmp_path: Path) -> None:
    folder = missions(tmp_path / "missions", one="F a", two="F a & F free")
    flown: list[str] = []

    def before(stage: str) -> None:
        flown.append(stage)
        if flown.count("flight") == 2:
            raise error

    workers = Here(before, count=1)
    with pytest.raises(error):
        run_batch(folder, tmp_path / "out", workers=workers)
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["one"]
    again = run_batch(folder, tmp_path / "out", workers=Here())
    assert [(entry.name, entry.exit_code, entry.found) for entry in again] == [("one", 0, True), ("two", 0, False)]


@pytest.mark.slow
def test_a_flight_that_leaves_its_tube_is_written_and_not_certified(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = missions(tmp_path / "missions", one="F a")
    monkeypatch.setattr("ltlplan.report.summary.shortfall", lambda _result: "r0 strayed")
    for found in (False, True):
        (entry,) = run_batch(folder, tmp_path / "out", workers=Here())
        assert (entry.exit_code, entry.found) == (5, found)
        assert entry.sentence == "The simulated flight is not the certified one: r0 strayed."
        assert (tmp_path / "out" / "one" / "certificate.json").exists()


def test_folders_that_are_no_folders_of_missions(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="is not a folder"):
        run_batch(tmp_path / "nowhere", tmp_path / "out", workers=Here())
    with pytest.raises(BadInput, match="no mission files"):
        run_batch(tmp_path, tmp_path / "out", workers=Here())
    for name in ("One.yaml", "one.yml"):
        (tmp_path / name).touch()
    with pytest.raises(BadInput, match=r"One\.yaml and one\.yml would have the same folder"):
        run_batch(tmp_path, tmp_path / "out", workers=Here())


@pytest.mark.slow
def test_folders_are_the_same_wherever_they_were_made(tmp_path: Path) -> None:
    """On this process, on processes of this machine, and on a Dask cluster of which a worker dies in the middle."""
    folder = missions(tmp_path / "missions", one="F a", two="F a & F free", never="F a & G !a")
    (folder / "firefighting.yaml").write_text(ltlplan.missions.shipped_mission_text("firefighting"))
    run_batch(folder, tmp_path / "here", workers=Here())
    local = LocalWorkers(2)
    run_batch(folder, tmp_path / "local", workers=local)
    local.close()
    with local_cluster(workers=2) as machines, Cluster(machines.address) as cluster:
        killed: list[bool] = []

        def progress(_sentence: str, share: float) -> None:
            if share > 0.5 and not killed:
                killed.append(True)
                machines.workers[0].kill()

        entries = run_batch(folder, tmp_path / "cluster", workers=cluster, progress=progress)
    assert killed
    assert [entry.exit_code for entry in entries] == [0, 3, 0, 0]
    assert contents(tmp_path / "here") == contents(tmp_path / "local") == contents(tmp_path / "cluster")
