"""Shows as they are flown: paths that begin over their homes and end in the air, landing times, headings, and distances above a height.

Three forms of genuine files are written here: paths from 1 m above a home, from `takeoffTime` on, in steps of half a second, with a
`landingTime` a little after the last point; paths from the ground to 5 m above it, where `landAt` is, with a `landingTime` in full digits;
and Studio's own export with neither homes nor times.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import verify
from tests.helpers.few import few_of
from tests.helpers.motion.fleets import compiled_show, exported_show, sampled, trajectory_of, write_show
from verify.data import BadInput
from verify.third_party.fleet import Fleet
from verify.third_party.importers import read_fleet


def audited(
    tmp_path: Path,
    drones: dict[str, dict[str, Any]],
    *,
    own: dict[str, float] | None = None,
    separation: float = 2.0,
    **limits: Any,
) -> verify.Audit:
    path = write_show(tmp_path / "show.skyc", *compiled_show(drones, **(own or {})))
    return verify.audit(path, limits=verify.AuditLimits(separation=separation, **limits))


def outcomes(found: verify.Audit, name: str = "separation") -> list[str]:
    return [claim.outcome for claim in found.claims if claim.name == name]


def over_home(x: float, y: float, *, takeoff: float, top: float = 8.0, **more: Any) -> dict[str, Any]:
    """A drone whose path begins 1 m above its home and ends 0.97 m above it, as the viewer's demonstration has them."""
    heights = [1.0, 1.72, 2.44, top, top, 2.41, 1.69, 0.97]
    points = [[0.5 * k if k < 3 else 10 + k, [x, y, z], []] for k, z in enumerate(heights)]
    end = takeoff + 17.26
    return {
        "home": [x, y, 0],
        "mode": "show",
        "trajectory": trajectory_of(points, takeoffTime=takeoff, landingTime=end),
        **more,
    }


def to_landing(x: float, y: float, goal: tuple[float, float], *, wait: float = 5.0, end: float = 30.0) -> dict[str, Any]:
    """A drone that waits on the ground, climbs on a cubic curve and ends 5 m above its landing place, as the ground station's has them."""
    rise = [wait + 3.5, [x, y, 5.0], [[x, y, 0.0], [x, y, 2.91]]]
    up, over = [wait + 8, [x, y, 12.0], []], [end - 6, [*goal, 12.0], []]
    points = [[0, [x, y, 0.0], []], [wait, [x, y, 0.0], []], rise, up, over, [round(end, 3), [*goal, 5.0], []]]
    return {
        "home": [x, y, 0.0], "landAt": [*goal, 5],
        "trajectory": trajectory_of(points, takeoffTime=0, landingTime=end),
    }  # fmt: skip


def test_paths_that_begin_over_their_homes_are_judged(tmp_path: Path) -> None:
    drones = {f"d{k}": over_home(3.0 * k, 0, takeoff=11.66 + 0.28 * k) for k in range(4)}
    found = audited(tmp_path, drones)
    assert found.holds
    assert outcomes(found) == ["holds", "holds"]
    assert any("4 of 4 drones are assumed to climb straight up" in note and "z = 0 m and 1 m" in note for note in found.notes)
    assert any("4 of 4 drones are assumed to land straight down" in note and "0.97 m" in note for note in found.notes)
    assert any("Wherever 4 drones are straight below the beginnings" in claim.sentence for claim in found.claims)


def test_paths_that_end_in_the_air_are_landed(tmp_path: Path) -> None:
    drones = {"a": to_landing(0, 0, (3, 0)), "b": to_landing(0, 6, (3, 6), end=25.9714285), "c": to_landing(0, 12, (3, 12))}
    found = audited(tmp_path, drones)
    assert found.holds
    assert outcomes(found) == ["holds", "holds"]
    assert not any("climb straight up" in note for note in found.notes)


def test_an_excerpt_of_a_show_may_be_judged_without_columns(tmp_path: Path) -> None:
    """Two drones above each other in the air, whose columns are one."""
    drones = {f"d{k}": {"trajectory": trajectory_of([[0, [0, 0, 3 + 3 * k]], [5, [4, 0, 3 + 3 * k]]])} for k in range(2)}
    assert "fails" in outcomes(audited(tmp_path, drones))
    found = audited(tmp_path, drones, columns=False)
    assert found.holds
    assert "Take-off and landing outside the paths are not judged: as asked." in found.notes


@pytest.mark.parametrize("height", [0.0, 2.0])
def test_a_drone_that_parks_under_a_landing_column_is_found(tmp_path: Path, height: float) -> None:
    """b rests at (3, 0.4), on the ground, from 12 s on; a ends its path 5 m above (3, 0) at 30 s."""
    points = [[0, [3, 8, 0]], [4, [3, 8, 3]], [8, [3, 0.4, 3]], [12, [3, 0.4, height]]]
    drones = {"a": to_landing(0, 0, (3, 0)), "b": {"home": [3, 8, 0], "trajectory": trajectory_of(points)}}
    found = audited(tmp_path, drones)
    assert "fails" in outcomes(found)
    assert not found
    (claim,) = [claim for claim in found.claims if claim.outcome == "fails"]
    assert "a, which lands" in claim.sentence or "b, which lands" in claim.sentence
    assert (claim.bound or 0) == pytest.approx(0.4)


def test_who_crosses_a_column_before_or_after_is_judged_by_its_time(tmp_path: Path) -> None:
    """b flies through the column of a's landing at 2 m: before a is there that is fine, afterwards nobody can say."""
    for when, expected in ((10.0, "holds"), (40.0, "undecided")):
        points = [[0, [3, 9, 0]], [2, [3, 9, 2]], [when, [3, 9, 2]], [when + 5, [3, -9, 2]], [when + 9, [3, -9, 0]]]
        found = audited(tmp_path, {"a": to_landing(0, 0, (3, 0), wait=1.0), "b": {"trajectory": trajectory_of(points)}})
        assert outcomes(found)[-1] == expected
        assert found.holds == (expected == "holds")


def test_times_that_are_null_are_none(tmp_path: Path) -> None:
    trajectory = trajectory_of([[0, [0, 0, 0]], [3, [0, 0, 4]]], takeoffTime=None, landingTime=None)
    plain = trajectory_of([[0, [0, 0, 0]], [3, [0, 0, 4]]])
    fleets = [
        read_fleet(write_show(tmp_path / "show.skyc", exported_show({"a": {"trajectory": one}}))) for one in (trajectory, plain)
    ]
    assert fleets[0].digest == fleets[1].digest
    (column,) = fleets[0].columns
    assert (column.kind, column.low, column.high, column.since, column.until) == ("landing", 0.0, 4.0, 3, None)


def test_a_landing_before_the_end_of_a_path_adds_a_column(tmp_path: Path) -> None:
    trajectory = trajectory_of([[0, [0, 0, 0]], [4, [0, 0, 4]], [8, [8, 0, 4]]], takeoffTime=1.0, landingTime=7.0)
    path = write_show(tmp_path / "show.skyc", exported_show({"a": {"home": [0, 0, 0], "trajectory": trajectory}}))
    fleet = read_fleet(path)
    assert [(c.place, c.high, c.since) for c in fleet.columns] == [((4, 0), 4.0, 7), ((8, 0), 4.0, 9)]
    assert any("landingTime before their path ends" in note for note in fleet.assumed)
    trajectory["landingTime"] = 0.5
    with pytest.raises(BadInput, match=r"landingTime 0\.5 s is before its path begins at 1 s"):
        read_fleet(write_show(tmp_path / "show.skyc", exported_show({"a": {"trajectory": trajectory}})))


def test_columns_count_for_the_floor_and_for_what_a_mission_s_words_say(tmp_path: Path) -> None:
    drones = {f"d{k}": over_home(3.0 * k, 0, takeoff=1.0) for k in range(2)}
    found = audited(tmp_path, drones, min_height=0.5)
    assert outcomes(found, "height") == ["fails", "fails"]
    assert outcomes(audited(tmp_path, drones, min_height=0.0), "height") == ["holds"]


def test_turning_is_held_against_its_limit_exactly(tmp_path: Path) -> None:
    drones = {f"d{k}": over_home(3.0 * k, 0, takeoff=1.0) for k in range(3)}
    setpoints = [[0, 10.0], [0.5, 25.0], [2.5, -35.0]]
    drones["d0"]["yawControl"] = {"version": 1, "setpoints": setpoints}
    drones["d1"]["yawControl"] = {"version": 1, "setpoints": [[10, 42]]}
    found = audited(tmp_path, drones, own={"maxYawRate": 30, "minDistance": 2})
    (claim,) = [claim for claim in found.claims if claim.name == "limits.yaw_rate"]
    assert claim.outcome == "holds"
    assert "2 of 3 drones, those whose file says how they turn, keep" in claim.sentence
    setpoints[1][1] = 25.0 + 1e-9
    assert outcomes(audited(tmp_path, drones, own={"maxYawRate": 30}), "limits.yaw_rate") == ["fails"]
    assert outcomes(audited(tmp_path, drones, yaw_rate=31.0), "limits.yaw_rate") == ["holds"]
    setpoints[1][0] = 0
    with pytest.raises(BadInput, match=r"setpoints\[1\] is at 0 s, after one at 0 s; times must rise"):
        audited(tmp_path, drones)
    with pytest.raises(BadInput, match="does not say how any drone turns"):
        audited(tmp_path, {"a": over_home(0, 0, takeoff=1.0)}, yaw_rate=3.0)


def test_distances_may_be_asked_above_a_height(tmp_path: Path) -> None:
    """Pads 1 m apart, and paths that spread to 3 m below 2.5 m; one pair comes within 2 m at 6 m."""

    def drone(k: int, near: float = 0.0) -> dict[str, Any]:
        points = [
            [0, [k, 0, 0]],
            [2, [3 * k, 0, 2.4]],
            [4, [3 * k, 0, 6]],
            [6, [3 * k - near, 0, 6]],
            [9, [3 * k, 0, 2.4]],
            [12, [k, 0, 0]],
        ]
        return {"home": [k, 0, 0], "trajectory": trajectory_of(points)}

    drones = {f"d{k}": drone(k) for k in range(8)}
    assert set(outcomes(audited(tmp_path, drones, separation=3.0))) == {"fails"}
    found = audited(tmp_path, drones, separation=3.0, separation_above=2.5, own={"minNavAltitude": 2.5})
    (claim,) = [claim for claim in found.claims if claim.name == "separation"]
    assert claim.outcome == "holds"
    assert "3.0000 m apart at all times while both are above z = 2.5 m" in claim.sentence
    found = audited(tmp_path, {**drones, "d8": drone(8, near=1.5)}, separation=3.0, separation_above=2.5)
    (claim,) = [claim for claim in found.claims if claim.name == "separation"]
    assert claim.outcome == "fails"
    assert "d7 and d8 are nearer than 3.0000 m above z = 2.5 m" in claim.sentence
    assert claim.bound == pytest.approx(1.5)
    with pytest.raises(BadInput, match=r"separation_above is 2\.5 m, and no separation is required"):
        verify.audit(tmp_path / "show.skyc", limits=verify.AuditLimits(speed=9.0, separation_above=2.5))


def wild_show(rng: np.random.Generator, drones: int) -> dict[str, dict[str, Any]]:
    """Drones near each other, that begin and end on the ground or in the air, at home or not, at random times."""
    result: dict[str, dict[str, Any]] = {}
    for k in range(drones):
        pad, goal = rng.uniform(0, 8, 2).round(2).tolist(), rng.uniform(0, 8, 2).round(2).tolist()
        first, last = (float(rng.choice([0.0, 1.0, 3.0])) for _ in range(2))
        middle = rng.uniform([0, 0, 1], [8, 8, 9], (2, 3)).round(2).tolist()
        times = np.cumsum(rng.uniform(1, 6, 4)).round(2).tolist()
        points = [
            [0, [*pad, first], []],
            *([t, p, []] for t, p in zip(times, [*middle, [*goal, last], [*goal, last]], strict=True)),
        ]
        trajectory = trajectory_of(points, takeoffTime=float(rng.choice([0.0, 3.0, 9.0])))
        result[f"d{k}"] = {"trajectory": trajectory, **({"home": [*pad, 0]} if rng.random() < 0.7 else {})}
    return result


def flown(fleet: Fleet, rng: np.random.Generator, times: np.ndarray) -> np.ndarray:
    """Where drones are at times, before 0 and after the end too, where each climbs and lands when and as fast as it likes. Shape (drones, n, 3)."""
    end = float(fleet.end)
    found = np.stack([sampled(fleet, drone, np.clip(times, 0.0, end)) for drone in range(len(fleet))])
    for column in fleet.columns:
        speed = float(rng.uniform(0.3, 20.0))
        if column.until is not None:
            leaves = min(float(column.until) - float(rng.exponential(4.0)), float(column.until))
            rise = (times - leaves) * speed
            before = times <= float(column.until)
            found[column.drone, before, 2] = np.clip(column.low + rise, column.low, column.high)[before]
            found[column.drone, before, :2] = [float(x) for x in column.place]
        if column.since is not None:
            sinks = float(column.since) + float(rng.exponential(4.0))
            after = times >= float(column.since)
            found[column.drone, after, 2] = np.clip(column.high - (times - sinks) * speed, column.low, column.high)[after]
            found[column.drone, after, :2] = [float(x) for x in column.place]
    return found


def assert_flights_agree(tmp_path: Path, rng: np.random.Generator, count: int) -> tuple[bool, bool]:
    """Audit a show and fly it in several ways: what holds is kept by all of them, and what surely fails is met by each."""
    path = write_show(tmp_path / "wild.skyc", *compiled_show(wild_show(rng, int(rng.integers(2, 5)))))
    limit, above = float(rng.uniform(0.3, 1.5)), float(rng.choice([0.0, 0.9, 2.0]))
    limits = verify.AuditLimits(separation=limit, separation_above=above or None)
    try:
        found = verify.audit(path, limits=limits)
    except BadInput:
        return False, False
    fleet = read_fleet(path)
    times = np.linspace(-15.0, float(fleet.end) + 30.0, 1500)
    sure = {(c.robot, c.other) for c in found.claims if c.name == "separation" and c.outcome == "fails"}
    for _ in range(count):
        places = flown(fleet, rng, times)
        for one in range(len(fleet)):
            for other in range(one):
                apart = np.linalg.norm(places[one] - places[other], axis=-1)
                high = np.minimum(places[one, :, 2], places[other, :, 2]) > (above or -np.inf)
                least = float(apart[high].min(initial=np.inf))
                if all(outcome == "holds" for outcome in outcomes(found)):
                    assert least >= limit - 1e-9
                pair = fleet.names[one], fleet.names[other]
                if pair in sure or pair[::-1] in sure:
                    assert least < limit + 0.25  # between samples they are somewhat nearer
    return all(outcome == "holds" for outcome in outcomes(found)), bool(sure)


@few_of(1, ("seed", "count"), [(0, 2), (0, 4), (1, 8), (2, 8)])
def test_flights_of_any_timing_keep_what_is_claimed(tmp_path: Path, seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    found = [assert_flights_agree(tmp_path, rng, 2) for _ in range(count)]
    assert any(kept for kept, _ in found) or any(sure for _, sure in found)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 110))
def test_many_flights_of_any_timing_keep_what_is_claimed(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    found = [assert_flights_agree(tmp_path, rng, 8) for _ in range(60)]
    assert sum(kept for kept, _ in found) > 3
    assert sum(sure for _, sure in found) > 3


@pytest.mark.parametrize(("pitch", "kept"), [(2.0, True), (float(np.nextafter(2.0, 0)), False)])
def test_columns_that_stand_exactly_as_far_apart_as_asked_hold(tmp_path: Path, pitch: float, kept: bool) -> None:
    found = audited(tmp_path, {f"d{k}": over_home(pitch * k, 0, takeoff=float(k)) for k in range(3)})
    assert (set(outcomes(found)) == {"holds"}) == kept
