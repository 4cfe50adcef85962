"""The shipped missions, from the file to the written folder, judged by a dense sampler that shares nothing with us."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import ltlplan
import verify
from tests.helpers.missions.shipped import PAPER_MISSIONS
from tests.helpers.motion.dense_sampler import level, quantities, read_flight, read_mission, regions_of
from verify.data import load_plan

RATE = 2000.0
NAMES = PAPER_MISSIONS


@pytest.fixture(
    scope="module",
    params=[pytest.param(name, marks=() if name == "firefighting" else pytest.mark.slow) for name in NAMES],
)
def run_folder(request, shipped_run, shipped_folder) -> tuple[ltlplan.Result, Path]:
    return shipped_run(request.param), shipped_folder(request.param)


def test_everything_holds_and_every_file_is_there(run_folder) -> None:
    result, folder = run_folder
    assert all(claim.outcome == "holds" for claim in result.certificate.claims)
    wanted = {"mission.yaml", "plan.json", "certificate.json", "flight.csv", "report.html"}
    assert wanted | {f"{name}.csv" for name in result.mission.agents} <= {path.name for path in folder.iterdir()}
    assert verify.recheck(folder).margin == result.mission.margin


def test_labels_of_dense_samples_are_the_visits_of_the_plan(run_folder) -> None:
    result, folder = run_folder
    mission = read_mission(folder)
    regions = regions_of(mission)
    for name, robot in result.plan.robots.items():
        flight = read_flight(folder / f"{name}.csv", RATE)
        inside = np.stack([level(region, flight.d[0, :, :3]) <= 1.0 for region in regions.values()], axis=1)
        names = list(regions)
        seen = [
            names[np.flatnonzero(row)[0]] for i, row in enumerate(inside) if row.any() and (i == 0 or not inside[i - 1].any())
        ]
        visits = [visit.region for visit in robot.visits]
        if robot.cycle_visit is not None:
            visits = visits[: robot.cycle_visit] + visits[robot.cycle_visit :] * result.mission.spec.repeat
        assert seen == visits


def test_limits_of_dense_samples_are_below_the_certified_bounds(run_folder) -> None:
    result, folder = run_folder
    mission = read_mission(folder)
    limits = result.mission.effective_limits
    bounds = {(claim.name, claim.robot): claim.bound for claim in result.certificate.claims if claim.bound is not None}
    for name in result.mission.agents:
        sampled = quantities(mission, read_flight(folder / f"{name}.csv", RATE))
        tests = {
            "limits.speed": (sampled["speed"].max(), limits.speed),
            "limits.acceleration": (sampled["acceleration"].max(), limits.acceleration),
            "limits.thrust_max": (sampled["thrust"].max(), limits.thrust_max),
            "limits.tilt": (sampled["tilt"].max(), limits.tilt),
            "limits.body_rate": (sampled["body_rate"].max(), limits.body_rate),
            "limits.yaw_rate": (sampled["yaw_rate"].max(), limits.yaw_rate),
        }
        for claim, (worst, limit) in tests.items():
            assert worst <= limit * (1 + 1e-6)
            if (claim, name) in bounds:
                assert worst <= bounds[claim, name] * (1 + 1e-6) + 1e-9
        assert sampled["thrust"].min() >= limits.thrust_min


def test_the_team_keeps_apart_and_inside(run_folder) -> None:
    result, folder = run_folder
    mission = read_mission(folder)
    low, high = np.array(mission["workspace"]["min"]), np.array(mission["workspace"]["max"])
    end = result.certificate.duration
    grid = np.linspace(0.0, end, int(200 * end))
    paths = {}
    for name in mission["agents"]:
        flight = read_flight(folder / f"{name}.csv", RATE, end)
        paths[name] = np.stack([np.interp(grid, flight.t, flight.d[0, :, axis]) for axis in range(3)], axis=1)
        assert np.all(paths[name] >= low + mission["margin"] - 1e-6)
        assert np.all(paths[name] <= high - mission["margin"] + 1e-6)
    names = list(paths)
    for i, first in enumerate(names):
        for second in names[i + 1 :]:
            distance = np.linalg.norm(paths[first] - paths[second], axis=1).min()
            assert distance >= mission["separation"] + 2 * mission["margin"] - 1e-3


def test_hoops_are_passed_through_their_openings(run_folder) -> None:
    result, folder = run_folder
    mission = read_mission(folder)
    for name in result.mission.agents:
        flight = read_flight(folder / f"{name}.csv", RATE)
        for hoop in mission.get("hoops", {}).values():
            offset = flight.d[0, :, :3] - np.array(hoop["center"])
            along = offset @ np.array(hoop["normal"])
            across = np.linalg.norm(offset - along[:, None] * np.array(hoop["normal"]), axis=1)
            near = np.abs(along) <= hoop["rim"] / 2
            gap = np.minimum(np.abs(across - hoop["opening"]), np.abs(across - hoop["opening"] - hoop["rim"]))
            gap[(across > hoop["opening"]) & (across < hoop["opening"] + hoop["rim"])] = 0.0
            assert np.all(gap[near] >= mission["vehicle"]["radius"] + mission["margin"] - 1e-3)


def test_the_flown_robots_stay_in_the_tube(run_folder) -> None:
    result, _ = run_folder
    assert result.log.worst_error() < result.certificate.margin
    assert result.log.satisfied is not False


def test_the_plan_reads_back(run_folder) -> None:
    result, folder = run_folder
    assert load_plan(folder / "plan.json", result.mission) == result.plan


def test_a_changed_file_is_named(run_folder, tmp_path: Path) -> None:
    import shutil

    result, folder = run_folder
    name = next(iter(result.mission.agents))
    for file in ("mission.yaml", "plan.json", f"{name}.csv", "certificate.json"):
        copy = tmp_path / file / "run"
        shutil.copytree(folder, copy)
        text = (copy / file).read_text()
        digits = [
            i for i in range(1, len(text)) if text[i] in "123456789" and text[i - 1] == "."
        ]  # leading ones: float32 sees them
        position = digits[len(digits) // 2] if file != "certificate.json" else text.index('"bound"') + 12
        changed = "1" if text[position] != "1" else "2"
        (copy / file).write_text(text[:position] + changed + text[position + 1 :])
        with pytest.raises(ltlplan.LtlplanError) as caught:
            verify.recheck(copy)
        assert caught.value.exit_code in (2, 5)
        assert file in str(caught.value) or file == "mission.yaml"


def test_firefighting_has_the_best_assignment() -> None:
    plan = ltlplan.plan(ltlplan.load_mission("firefighting"))
    visits = sorted([v.region for v in robot.visits] for robot in plan.robots.values())
    assert visits == [[], ["loc1"], ["water", "smoke", "loc2"]]


@pytest.mark.slow
def test_same_seed_same_bytes(shipped_folder, tmp_path: Path) -> None:
    """In another process by the command line, where sets have another order: none may leak into a file."""
    ours, folder = shipped_folder("firefighting"), tmp_path / "firefighting"
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1]), "PYTHONHASHSEED": "1"}
    command = [sys.executable, "-m", "ltlplan", "run", "firefighting", "--out", str(folder), "--json"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=600)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["holds"] is True
    written = {path.relative_to(folder) for path in folder.rglob("*.*")}
    assert written == {path.relative_to(ours) for path in ours.rglob("*.*")}
    for path in sorted(written):
        assert (folder / path).read_bytes() == (ours / path).read_bytes(), path


def test_nothing_is_certified_beyond_what_holds(run_folder) -> None:
    result, _ = run_folder
    largest = result.certificate.largest_margin
    assert largest is None or (math.isfinite(largest) and largest >= result.certificate.margin)
