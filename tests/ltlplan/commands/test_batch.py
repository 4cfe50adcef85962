"""`ltlplan batch` and `--dask` on the command line: a table, exit codes, and clusters that are not there."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.helpers.commands import Command
from tests.helpers.few import few_of
from tests.helpers.motion.flights import small_mission
from tests.helpers.serving.clusters import ROOT, LocalCluster, local_cluster
from verify.data import mission_to_yaml


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "missions"
    folder.mkdir()
    for name, formula in {"good": "F a", "never": "F a & G !a"}.items():
        (folder / f"{name}.yaml").write_text(mission_to_yaml(small_mission(formula, margin=0.05)))
    return folder


@pytest.mark.slow
def test_a_table_tells_what_became_of_each(ltlplan: Command, folder: Path, tmp_path: Path) -> None:
    told = ltlplan("batch", str(folder), cwd=tmp_path)
    header, good, never, why, *_ = told.stdout.splitlines()
    assert told.returncode == 3
    assert header.split() == ["mission", "outcome", "checked", "cost", "seconds", "exit", "code"]
    assert (good.split()[:2], good.split()[-1]) == (["good", "certified"], "0")
    assert (never.split()[:2], never.split()[-1]) == (["never", "unsatisfiable"], "3")
    assert why.startswith("never: ")
    assert (tmp_path / "out" / "missions" / "good" / "certificate.json").exists()
    again = ltlplan("batch", str(folder), "--json", cwd=tmp_path)
    found = json.loads(again.stdout)
    count = found["missions"][0]["checked"]
    assert (count.split(" of ")[0], found["missions"][1]["checked"]) == (count.split(" of ")[1], "")
    assert f" {count} " in good
    assert again.returncode == found["exit_code"] == 3
    assert [(entry["mission"], entry["found"], entry["exit_code"]) for entry in found["missions"]] == [
        ("good", True, 0), ("never", False, 3),
    ]  # fmt: skip
    assert ltlplan("recheck", "out/missions/good", cwd=tmp_path).returncode == 0


@few_of(1, "arguments", [("batch", "missions"), ("campaign", "missions/good.yaml", "--runs", "3")])
def test_a_cluster_that_is_not_there_is_one_sentence(
    arguments: tuple[str, ...], ltlplan: Command, folder: Path, tmp_path: Path
) -> None:
    told = ltlplan(*arguments, "--dask", "nowhere", "--json", cwd=folder.parent)
    error = json.loads(told.stdout)
    assert (told.returncode, error["error"]) == (2, "ClusterError")
    assert error["message"].startswith("No Dask scheduler answers at nowhere (")
    told = ltlplan(*arguments, "--dask", "nowhere", "--workers", "2", cwd=folder.parent)
    assert (told.returncode, "leave one of them out" in told.stderr) == (2, True)
    assert not (tmp_path / "out").exists()


def begun(*arguments: str, cwd: Path) -> subprocess.Popen[str]:
    """Begin a command in a process group of its own, as a terminal does."""
    code = "from ltlplan.start import main; main()"
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    return subprocess.Popen(
        [sys.executable, "-c", code, *arguments], cwd=cwd, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler) and None,
    )  # fmt: skip


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0.5, 2.0, 5.0])
def test_ctrl_c_leaves_whole_folders_and_no_processes(delay: float, folder: Path, tmp_path: Path) -> None:
    for number in range(3):
        (folder / f"good{number}.yaml").write_text((folder / "good.yaml").read_text())
    running = begun("batch", "missions", "--workers", "2", cwd=tmp_path)
    time.sleep(delay)
    os.killpg(running.pid, signal.SIGINT)
    _, said = running.communicate(timeout=60)
    assert (running.returncode, said.splitlines()[-1]) == (130, "interrupted; no file was left half-written.")
    assert "Traceback" not in said, said
    for made in (tmp_path / "out" / "missions").glob("*"):
        assert made.name.startswith("good"), made
        assert (made / "manifest.json").exists()
    again = begun("batch", "missions", "--workers", "2", cwd=tmp_path)
    again.communicate(timeout=300)
    assert again.returncode == 3


@pytest.mark.slow
def test_a_cluster_makes_the_same_files(folder: Path, tmp_path: Path) -> None:
    campaign = ("campaign", "missions/good.yaml", "--runs", "1200", "--noise", "0.001", "--out")
    with local_cluster(workers=2) as machines:
        for place, options in {"here": (), "there": ("--dask", machines.address)}.items():
            for arguments in (("batch", "missions", "--out", f"{place}/batch"), (*campaign, f"{place}/campaign")):
                running = begun(*arguments, *options, cwd=tmp_path)
                _, said = running.communicate(timeout=600)
                assert running.returncode == (3 if arguments[0] == "batch" else 0), said
    assert files(tmp_path / "here") == files(tmp_path / "there")


@pytest.mark.slow
def test_a_scheduler_that_goes_away_is_one_sentence_and_loses_nothing(tmp_path: Path, folder: Path) -> None:
    for number in range(12):
        (folder / f"good{number}.yaml").write_text((folder / "good.yaml").read_text())
    machines = LocalCluster()
    try:
        machines.work(1)
        running = begun("batch", "missions", "--dask", machines.address, cwd=tmp_path)
        made = tmp_path / "out" / "missions" / "good" / "manifest.json"
        while not made.exists():
            assert running.poll() is None
            time.sleep(0.05)
        machines.scheduler.kill()
        _, said = running.communicate(timeout=20)
    finally:
        machines.kill()
    *_, last = said.splitlines()
    assert "Traceback" not in said, said
    assert running.returncode == 2
    assert last.startswith(f"bad input: The Dask scheduler at {machines.address} went away in the middle")
    done = {path.name for path in (tmp_path / "out" / "missions").iterdir()}
    again = begun("batch", "missions", "--json", cwd=tmp_path)
    told, _ = again.communicate(timeout=600)
    assert {entry["mission"] for entry in json.loads(told)["missions"] if entry["found"]} == done
