"""Work on a Dask cluster: what is found is what is found here, to the last bit, and what goes away costs little and is said."""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import flight
from ltlplan.service.execution import clusters
from ltlplan.service.execution.clusters import Cluster, ClusterError
from ltlplan.service.execution.resource_limits import OutOfMemory
from ltlplan.service.execution.stages import Outcome, mission_bytes, run_stage
from ltlplan.service.provenance import here
from tests.helpers.few import few_of
from tests.helpers.motion.flights import small_mission
from tests.helpers.motion.stand_ins import flight as made_flight
from tests.helpers.motion.stand_ins import stand_in
from tests.helpers.serving import work_for_workers as work
from tests.helpers.serving.clusters import LocalCluster, local_cluster
from tests.helpers.serving.waiting import is_gone, pid_in, until
from verify.data import MissionError
from verify.data.progress import silent

PATIENCE = 60.0
"""s that an answer may take: many times what an idle machine needs."""

GUSTS = {"wind": "0.4,0.2,0+0.3", "noise": 0.001}


@pytest.fixture(scope="module")
def machines() -> Iterator[LocalCluster]:
    with local_cluster(workers=2) as running:
        yield running


@pytest.fixture(scope="module")
def cluster(machines: LocalCluster) -> Iterator[Cluster]:
    with Cluster(machines.address, seconds=PATIENCE, megabytes=600) as found:
        assert until(lambda: found.count == 2, PATIENCE)
        yield found


@pytest.mark.slow
def test_an_error_comes_back_with_its_class_its_words_and_what_it_carries(cluster: Cluster) -> None:
    with pytest.raises(MissionError, match="there is no such hoop") as caught:
        cluster.submit(work.wrong_mission).result(PATIENCE)
    assert caught.value.faults[0].line == 3


@pytest.mark.slow
def test_work_is_held_to_its_bounds_there_too(cluster: Cluster) -> None:
    with pytest.raises(OutOfMemory, match="600 MB"):
        cluster.submit(work.take_memory).result(PATIENCE)


def test_progress_comes_back(cluster: Cluster) -> None:
    told: list[tuple[str, float]] = []
    result, pid = cluster.submit(work.add, 1, 2, progress=lambda *said: told.append(said)).result(PATIENCE)
    assert result == 3
    assert pid != os.getpid()
    assert until(lambda: told == [("adding", 0.5)], PATIENCE)


@pytest.mark.slow
def test_cancelling_kills_at_once(cluster: Cluster, tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    future = cluster.submit(work.sleep, 600.0, str(mark))
    pid = pid_in(mark, PATIENCE)
    assert future.cancel()
    assert future.cancelled()
    assert until(lambda: is_gone(pid), 5.0)


@pytest.mark.slow
def test_stages_find_there_what_they_find_here(cluster: Cluster) -> None:
    mission = small_mission("F a", margin=0.05, extra="planner: {pace: nominal}")

    def staged(do: Callable[[str, bytes], Outcome]) -> list[Outcome]:
        following, value, outcomes = "plan", mission_bytes(mission), []
        while following is not None:
            outcomes.append(do(following, value))
            following, value = outcomes[-1].following, outcomes[-1].value
        return outcomes

    there = staged(lambda name, value: cluster.submit(run_stage, name, value).result(PATIENCE))
    assert there == staged(lambda name, value: run_stage(name, value, silent))


@pytest.mark.slow
def test_a_campaign_finds_there_what_it_finds_here(cluster: Cluster, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.import_module("flight.campaigns"), "LEAST_SHARE", 1)
    plan, team = made_flight()
    made = plan, team, stand_in(plan, team)
    ours = flight.campaign(*made, runs=4, seed=40, **GUSTS)
    shares: list[float] = []
    theirs = flight.campaign(*made, runs=4, seed=40, workers=cluster, progress=lambda _, share: shares.append(share), **GUSTS)
    assert theirs.to_dict() == ours.to_dict()
    for name in ("seeds", "worst_error", "worst_robot", "inside", "satisfied", "times", "error_over_time"):
        assert getattr(theirs, name).tobytes() == getattr(ours, name).tobytes(), name
    assert shares == sorted(shares)


def test_a_worker_of_another_version_is_refused(machines: LocalCluster, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "here", lambda: {**here(), "numpy": "0.1"})
    with pytest.raises(
        ClusterError, match=rf"Dask worker tcp://\S+ could find something else .*: numpy {here()['numpy']} there, 0.1 here"
    ):
        Cluster(machines.address)


@pytest.mark.slow
def test_so_is_one_that_comes_later(machines: LocalCluster) -> None:
    with Cluster(machines.address) as cluster:
        cluster.versions = {**here(), "numpy": "0.1"}
        with pytest.raises(ClusterError, match=r"0\.1 here"):
            cluster.submit(work.add, 1, 2).result(PATIENCE)


@pytest.mark.slow
def test_a_worker_that_dies_costs_its_own_work_only(machines: LocalCluster, cluster: Cluster, tmp_path: Path) -> None:
    """The other's goes on; what was lost is done again by a worker that is there."""
    marks = [tmp_path / "one", tmp_path / "other"]
    futures = [cluster.submit(work.sleep, 2.0, str(mark)) for mark in marks]
    began = [pid_in(mark, PATIENCE) for mark in marks]
    machines.workers[0].kill()
    machines.work(1)
    assert [future.result(PATIENCE) for future in futures] == [2.0, 2.0]
    after = [pid_in(mark, PATIENCE) for mark in marks]
    assert sum(one != other for one, other in zip(began, after, strict=True)) == 1
    assert all(map(is_gone, began))


@few_of(1, "address", ["tcp://127.0.0.1:9", "nowhere", "http://127.0.0.1:80", "tcp://127.0.0.1:port"])
@pytest.mark.slow
def test_a_scheduler_that_is_not_there_is_said(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "_CONNECT", 0.5)
    with pytest.raises(ClusterError, match=rf"No Dask scheduler answers at {address} \(.*\); start one with `dask scheduler`"):
        Cluster(address)


@pytest.mark.slow
def test_a_scheduler_without_workers_is_said() -> None:
    with (
        local_cluster(workers=0) as machines,
        pytest.raises(ClusterError, match="no workers; start some with `dask worker tcp://"),
    ):
        Cluster(machines.address)


@pytest.mark.slow
def test_a_search_there_is_ended_with_what_it_has(cluster: Cluster) -> None:
    mission = small_mission("F a", margin=0.05, extra="planner: {seed: 2}")
    told: list[str] = []
    found = cluster.submit(
        work.search_until_ended, "plan", mission_bytes(mission), progress=lambda said, _share: told.append(said)
    )
    assert until(lambda: bool(told), PATIENCE)
    cluster.end_search(found)
    assert found.result(PATIENCE).stopped
