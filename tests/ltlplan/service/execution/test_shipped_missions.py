"""Every shipped mission through `ltlplan batch`, the service and a Dask cluster: certified, and the same bytes wherever it was made."""

from __future__ import annotations

from collections.abc import Callable, Collection
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest

import ltlplan
from ltlplan.missions import shipped_mission_text, shipped_missions
from ltlplan.service.execution.batches import RECORD, run_batch
from ltlplan.service.execution.clusters import Cluster
from ltlplan.service.execution.workers import LocalWorkers
from ltlplan.service.models import ONLY_OF_JOBS
from tests.helpers.serving.clusters import local_cluster
from tests.helpers.serving.job_services import ended, run, service
from verify import recheck
from verify.data.progress import silent

pytestmark = pytest.mark.xdist_group("service")

MISSIONS = tuple(shipped_missions())
PATIENCE = 3600.0
"""s that all missions may take: many times what an idle machine needs."""


def folder_of(place: Path, names: Collection[str]) -> Path:
    """Write shipped missions into a folder."""
    place.mkdir()
    for name in names:
        (place / f"{name}.yaml").write_text(shipped_mission_text(name), encoding="utf-8")
    return place


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def assert_certified(folder: Path, out: Path, workers: Any) -> None:
    """Run the missions of a folder as `ltlplan batch` does, and prove each one's certificate again from its files."""
    entries = run_batch(folder, out, workers=workers)
    assert [(entry.name, entry.exit_code, entry.sentence) for entry in entries] == [
        (path.stem, 0, "") for path in sorted(folder.iterdir())
    ]
    for entry in entries:
        assert recheck(out / entry.name).holds


class Here:
    """A worker that does everything at once, in this process."""

    count = 1

    def submit(self, work: Callable[..., Any], /, *arguments: Any, progress: Any = None) -> Future[Any]:
        del progress
        future: Future[Any] = Future()
        try:
            future.set_result(work(*arguments, silent))
        except Exception as error:
            future.set_exception(error)
        return future


@pytest.mark.slow
def test_shipped_missions_are_certified_in_a_batch(tmp_path: Path) -> None:
    assert_certified(folder_of(tmp_path / "missions", ["hoops-ltl", "hoops-published"]), tmp_path / "out", Here())


@pytest.fixture(scope="module")
def batch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return what `ltlplan batch` makes of all shipped missions on processes of this machine."""
    place = tmp_path_factory.mktemp("shipped")
    workers = LocalWorkers(2)
    try:
        assert_certified(folder_of(place / "missions", MISSIONS), place / "out", workers)
    finally:
        workers.close()
    return place


@pytest.mark.slow
def test_all_shipped_missions_are_certified_in_a_batch(batch: Path) -> None:
    assert sorted(path.name for path in (batch / "out").iterdir()) == sorted(MISSIONS)


@pytest.mark.slow
def test_all_shipped_missions_are_the_same_on_a_cluster(batch: Path, tmp_path: Path) -> None:
    with local_cluster(workers=2) as machines, Cluster(machines.address) as cluster:
        assert_certified(batch / "missions", tmp_path / "out", cluster)
    assert contents(tmp_path / "out") == contents(batch / "out")


@pytest.mark.slow
def test_all_shipped_missions_are_what_the_command_writes(batch: Path, tmp_path: Path) -> None:
    for name in MISSIONS:
        ltlplan.run(name, tmp_path / name)
        ours, theirs = contents(tmp_path / name), contents(batch / "out" / name)
        assert theirs.keys() - ours.keys() == {RECORD}, name
        assert [file for file in ours if ours[file] != theirs.get(file)] == ["manifest.json"], name


@pytest.mark.slow
def test_all_shipped_missions_are_the_same_as_jobs(batch: Path, tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data") as jobs:
            accepted = {name: await jobs.submit(ltlplan.load_mission(name)) for name in MISSIONS}
            for name, job in accepted.items():
                found = await ended(jobs, job)
                assert (name, found.state, found.problem) == (name, "done", None)
                made = {file.name: (await jobs.file(job.id, file.name)).path.read_bytes() for file in found.files}
                made = {file: data for file, data in made.items() if file not in ONLY_OF_JOBS}
                written = contents(batch / "out" / name)
                assert made == {file: data for file, data in written.items() if file not in (RECORD, "manifest.json")}

    run(check(), PATIENCE)
