"""Audits of folders of CSV files: claims, what is refused, and what a mission asks."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

import verify
from tests.helpers.motion.fleets import csv_text
from tests.helpers.motion.flights import small_mission
from verify.data import BadInput


def hop(x: float, y: float, z: float = 1.0, length: float = 2.0) -> str:
    """Return a flight of 2 s that goes `length` along x at one speed, and on for 1 s at rest."""
    return csv_text([(2.0, {"x": (x, length / 2), "y": (y,), "z": (z,)}), (1.0, {"x": (x + length,), "y": (y,), "z": (z,)})])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of two robots that fly side by side, 0.5 m apart, at 1 m/s."""
    (tmp_path / "cf1.csv").write_text(hop(0.0, 0.0))
    (tmp_path / "cf2.csv").write_text(hop(0.0, 0.5))
    return tmp_path


def outcomes(found: verify.Audit) -> dict[str, str]:
    return {claim.name: claim.outcome for claim in found.claims}


def test_every_claim_of_a_sound_folder_holds(folder: Path) -> None:
    asked = verify.AuditLimits(
        separation=0.5, workspace=(-1, -1, 0, 3, 3, 2), speed=1.0, acceleration=2.0, min_height=1.0, velocity_jump=1.01
    )
    found = verify.audit(folder, limits=asked)
    assert found
    assert set(outcomes(found)) == {"continuity", "workspace", "height", "limits.speed", "limits.acceleration", "separation"}
    assert (found.drones, found.duration) == (2, 3.0)
    assert found.tightest["separation"][0].value == pytest.approx(0.5)
    assert json.loads(found.to_json())["holds"]


@pytest.mark.parametrize(
    ("limit", "name", "sentence"),
    [
        ({"separation": 0.51}, "separation", "cf1 and cf2 are nearer than 0.5100 m from 0.0000 s to 3.0000 s"),
        ({"speed": math.nextafter(1.0, 0)}, "limits.speed", "cf1's speed reaches 1"),
        ({"workspace": (-1, -1, 0, 1.5, 3, 2)}, "workspace", "passes the wall x max at 1.5 m: it is at 2 m at"),
        ({"min_height": 1.0001}, "height", "comes down to z = 1 m"),
        ({"separation": 0.5, "margin": 0.001}, "separation", "cf1 and cf2 are nearer than 0.5020 m"),
        ({"min_height": 0.9995, "margin": 0.001}, "height", "comes down to z = 1 m"),
        ({"workspace": (-0.0005, -1, 0, 3, 3, 2), "margin": 0.001}, "workspace", "passes the wall x min at"),
        ({"workspace": (-1, -1, 0, 2.0005, 3, 2), "margin": 0.001}, "workspace", "passes the wall x max at"),
    ],
)
def test_what_a_limit_refuses(folder: Path, limit: dict[str, Any], name: str, sentence: str) -> None:
    found = verify.audit(folder, limits=verify.AuditLimits(**limit))
    assert not found
    broken = [claim for claim in found.claims if claim.name == name]
    assert sentence in broken[0].sentence
    assert all(claim.outcome == "fails" and claim.witness is not None for claim in broken)
    if name != "separation":
        assert all(claim.margin == -abs((claim.bound or 0.0) - (claim.limit or 0.0)) for claim in broken)


def test_acceleration_is_not_claimed_of_velocities_that_jump(folder: Path) -> None:
    found = verify.audit(folder, limits=verify.AuditLimits(acceleration=5.0))
    assert not found
    assert "its velocity jumps by 1 m/s at" in found.broken[0].sentence


def test_positions_that_jump_are_refused(tmp_path: Path) -> None:
    (tmp_path / "cf1.csv").write_text(csv_text([(1.0, {"x": (0.0, 1.0)}), (1.0, {"x": (1.25,)})]))
    found = verify.audit(tmp_path, limits=verify.AuditLimits(speed=3.0))
    assert "cf1: its position jumps by 0.25 m at 1.0000 s" in found.broken[0].sentence


def test_after_its_end_a_robot_is_where_it_came_to_rest(tmp_path: Path) -> None:
    (tmp_path / "cf1.csv").write_text(csv_text([(1.0, {"x": (0.0,)})]))
    (tmp_path / "cf2.csv").write_text(csv_text([(4.0, {"x": (4.0, -0.9)})]))
    found = verify.audit(tmp_path, limits=verify.AuditLimits(separation=0.5))
    assert found.broken[0].time == pytest.approx(4.0)
    assert found.broken[0].bound == pytest.approx(0.4, abs=1e-6)


@pytest.mark.parametrize(
    ("files", "asked", "message"),
    [
        ({}, {}, "holds no .csv file"),
        ({"a.csv": hop(0, 0), "b.csv": hop(0, 0, length=1.0)}, {"speed": 1.0}, "a and b both begin at"),
        ({"a.csv": hop(0, 0), "b.csv": hop(1, 0, length=1.0)}, {"speed": 1.0}, "a and b both end at"),
        (
            dict.fromkeys(("mission.yaml", "plan.json", "certificate.json", "flight.csv"), ""),
            {"speed": 1.0},
            "`ltlplan recheck .*` checks it",
        ),
        ({"a.csv": hop(math.nan, 0)}, {"speed": 1.0}, "x\\^0 is 'nan'"),
        ({"a.csv": hop(0, 0).replace("2.0,", "-2.0,", 1)}, {"speed": 1.0}, "durations"),
        ({"a.csv": hop(0, 0)}, {}, "Nothing is required"),
        ({"a.csv": hop(0, 0)}, {"speed": math.nan}, "speed must be a finite number"),
        ({"a.csv": hop(0, 0)}, {"separation": -1.0}, "separation must be at least 0"),
        ({"a.csv": hop(0, 0)}, {"workspace": (0, 1)}, "six numbers"),
        ({"a.csv": hop(0, 0)}, {"workspace": (1, 1, 1, 0, 0, 0)}, "must be below"),
        ({"a.csv": hop(0, 0)}, {"vehicle": "crazyfly"}, "is not a shipped vehicle"),
    ],
)
def test_bad_input(tmp_path: Path, files: dict[str, str], asked: dict[str, Any], message: str) -> None:
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(BadInput, match=message):
        verify.audit(tmp_path, limits=verify.AuditLimits(**asked))


def test_a_mission_says_what_is_asked_and_who_must_be_there(folder: Path) -> None:
    mission = small_mission("F a", starts=((0.0, 0.0, 1.0), (0.0, 0.5, 1.0)))
    (folder / "cf1.csv").rename(folder / "r0.csv")
    (folder / "cf2.csv").rename(folder / "r1.csv")
    found = verify.audit(folder, mission)
    assert {"workspace", "separation", "limits.speed", "limits.acceleration"} <= set(outcomes(found))
    moved = verify.audit(folder, small_mission("F a", starts=((0.0, 0.0, 1.0), (0.0, 0.75, 1.0))))
    assert any("r1: its start is 0.25 m from where its path begins" in claim.sentence for claim in moved.broken)
    (folder / "r1.csv").rename(folder / "r2.csv")
    with pytest.raises(BadInput, match=r"has no flight of 'r1', an agent .* Its flights: r0, r2"):
        verify.audit(folder, mission)


HOP = "a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}\nb: {center: [1.0, 0.5, 1.0], radii: [0.2, 0.2, 0.2]}"


@pytest.mark.parametrize(
    ("formula", "outcome"),
    [
        ("F a & F b", "holds"),
        ("F a & G !b", "fails"),
        ("F (a & F b)", "fails"),
        ("G (a -> F !a)", "holds"),
    ],
)
@pytest.mark.parametrize("margin", [0.0, 0.02])
def test_the_mission_s_formula_is_judged(folder: Path, formula: str, outcome: str, margin: float) -> None:
    for old, new in (("cf1", "r0"), ("cf2", "r1")):
        (folder / f"{old}.csv").rename(folder / f"{new}.csv")
    mission = small_mission(formula, regions=HOP, starts=((0.0, 0.0, 1.0), (0.0, 0.5, 1.0)), margin=margin)
    found = verify.audit(folder, mission, verify.AuditLimits(velocity_jump=1.01))
    assert outcomes(found)["formula"] == outcome
    assert bool(found) == (outcome == "holds")


def test_bounds_in_seconds_are_judged_on_clocks_that_differ(folder: Path) -> None:
    for old, new in (("cf1", "r0"), ("cf2", "r1")):
        (folder / f"{old}.csv").rename(folder / f"{new}.csv")

    def judged(formula: str) -> str:
        mission = small_mission(formula, regions=HOP, starts=((0.0, 0.0, 1.0), (0.0, 0.5, 1.0)), trace="finite, team: joint")
        return outcomes(verify.audit(folder, mission, verify.AuditLimits(velocity_jump=1.01)))["timing"]

    assert judged("F[0,2] a") == "holds"
    assert judged("F[0,0.5] a") == "fails"
    assert judged("F[2.99,3] !a") == "undecided"  # the flight ends at 3 s, on some clocks earlier


def test_obstacles_of_the_mission_are_judged(folder: Path) -> None:
    (folder / "cf1.csv").rename(folder / "r0.csv")
    (folder / "cf2.csv").unlink()
    post = "obstacles: {post: {center: [1.2, 0.3, 1.0], size: [0.2, 0.2, 2.0]}}"
    near = small_mission("F a", regions=HOP, extra=post)
    limits = verify.AuditLimits(velocity_jump=1.01)
    assert outcomes(verify.audit(folder, near, limits))["obstacles"] == "holds"
    met = small_mission("F a", regions=HOP, extra=post.replace("0.3, 1.0", "0.15, 1.0"))
    assert outcomes(verify.audit(folder, met, limits))["obstacles"] == "fails"


def test_an_infinite_trace_is_refused(folder: Path) -> None:
    mission = small_mission("G F a", trace="infinite")
    with pytest.raises(BadInput, match="asks for an infinite trace, and these flights end"):
        verify.audit(folder, mission)


def test_what_is_no_limit_mission_or_path_is_refused_in_words(folder: Path) -> None:
    calls: list[tuple[tuple[Any, ...], str]] = [
        ((7,), "a path or a list of paths"),
        (([],), "nothing to audit"),
        ((folder, {"name": "hall"}), "A mission is a Mission"),
        ((folder, None, {"speed": 1.0}), "limits must be verify.AuditLimits"),
        ((folder, None, verify.AuditLimits(vehicle=3)), "vehicle must be"),  # type: ignore[arg-type]
        ((folder, None, verify.AuditLimits(workspace="box")), "six numbers"),
    ]
    for arguments, message in calls:
        with pytest.raises(BadInput, match=message):
            verify.audit(*arguments)


def test_one_drone_has_none_to_keep_apart_from(tmp_path: Path) -> None:
    (tmp_path / "cf1.csv").write_text(hop(0.0, 0.0))
    found = verify.audit(tmp_path, limits=verify.AuditLimits(separation=1.0))
    assert found
    assert "There is one drone, cf1" in found.claims[-1].sentence
