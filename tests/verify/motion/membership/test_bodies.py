"""Labels of boxes, cylinders, prisms and unions, for all times: held to dense samples of the same bodies by school geometry."""

from __future__ import annotations

import itertools
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest

from tests.helpers.motion.flights import legs, small_mission, wandering
from tests.helpers.motion.solids import Holds, box, cylinder, ellipsoid, prism, random_solid, union
from verify.data.mission import Mission
from verify.data.shapes.inequalities import turned
from verify.data.shapes.region import Region
from verify.data.trajectory import Trajectory
from verify.motion.membership.bodies import Span
from verify.motion.membership.polynomials import membership_polynomials
from verify.motion.membership.statuses import statuses
from verify.motion.paths import read_team

L_ROOM = {
    "union": [{"prism": {"polygon": [[0, 0], [4, 0], [4, 1], [0, 1]], "z": [0, 2]}}, {"center": [0.5, 2, 1], "size": [1, 2, 2]}]
}


def region(data: dict[str, Any]) -> Region:
    return Region.model_validate(_floats(data))


def _floats(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _floats(value) for key, value in data.items()}
    return [_floats(x) for x in data] if isinstance(data, list) else float(data)


@cache
def _empty() -> Mission:
    return small_mission(regions="a: {center: [0, 0, 1], radii: [1, 1, 1]}")


def team_spans(regions: dict[str, Region], team: dict[str, Trajectory], margin: Fraction):
    """Judge a team's letters in a mission whose robots start where their flights do."""
    mission = _empty()
    agents = {
        name: mission.agents["r0"].model_copy(update={"start": tuple(flight.coefficients[0, :3, 0].tolist())})
        for name, flight in team.items()
    }
    mission = mission.model_copy(update={"agents": agents, "regions": regions})
    return statuses(membership_polynomials(read_team(mission, team)), margin)


def spans_of(regions: dict[str, Region], trajectory: Trajectory, margin: Fraction = Fraction(0)):
    return team_spans(regions, {"r0": trajectory}, margin)["r0"]


def marks(data: dict[str, Any], points: list[list[float]], margin: float = 0.0) -> list[str]:
    return [span.mark for span in spans_of({"a": region(data)}, legs(points), Fraction(margin))["a"]]


FLIGHTS = 4
"""So many are flown in each world that is drawn."""


def contradictions(rng: np.random.Generator, solids: list[tuple[dict[str, Any], Holds]], margin: Fraction) -> list[str]:
    """Fly at random and return where samples, pushed by the margin in any direction, contradict what was proved."""
    team = {f"r{k}": wandering(rng, pieces=2) for k in range(FLIGHTS)}
    regions = {f"s{k}": region(data) for k, (data, _) in enumerate(solids)}
    found = team_spans(regions, team, margin)
    return [what for robot, flight in team.items() for what in _contradicted(rng, flight, found[robot], solids, margin)]


def _contradicted(
    rng: np.random.Generator,
    trajectory: Trajectory,
    spans: dict[str, tuple[Span, ...]],
    solids: list[tuple[dict[str, Any], Holds]],
    margin: Fraction,
) -> list[str]:
    found: list[str] = []
    for (name, row), (_, holds) in zip(spans.items(), solids, strict=True):
        for before, after in itertools.pairwise(row):
            assert before.stop == after.start
            assert {before.mark, after.mark} != {"no", "must"}
        for span in row:
            if span.mark not in ("no", "must"):
                continue
            times = np.linspace(float(span.start), min(float(span.stop), trajectory.duration), 40)
            pushes = rng.normal(size=(40, 8, 3))
            pushes *= float(margin) * (1 - 1e-9) / np.linalg.norm(pushes, axis=2, keepdims=True)
            points = (trajectory.evaluate(times)[:, None, :3] + pushes).reshape(-1, 3)
            depth = holds(points)
            if np.any(depth < -1e-9 if span.mark == "must" else depth > 1e-9):
                found.append(f"{name} {span.mark} {float(span.start)} to {float(span.stop)}: {depth.min()} to {depth.max()}")
    return found


def campaign(seed: int, flights: int) -> list[str]:
    """Fly so often in random worlds, and return all contradictions."""
    rng, found = np.random.default_rng(seed), list[str]()
    for _ in range(flights // FLIGHTS):
        solids = [random_solid(rng) for _ in range(3)]
        margin = Fraction(int(rng.choice([0, 0, 20, 50, 150])), 1000)
        found += contradictions(rng, solids, margin)
    return found


def test_no_sample_contradicts_what_is_proved() -> None:
    assert campaign(0, 40) == []


@pytest.mark.slow
def test_no_sample_of_ten_thousand_flights_contradicts_what_is_proved() -> None:
    assert campaign(1, 10_000) == []


def test_statuses_are_sharp() -> None:
    """Within a micrometre beyond the margin of a face the status is no longer sure, and before it it is."""
    room = {"center": [0, 0, 1], "size": [2, 2, 1]}
    for depth, mark in ((0.050001, "must"), (0.049999, "may"), (-0.049999, "may"), (-0.050001, "no")):
        assert marks(room, [[1 - depth, -0.5, 1], [1 - depth, 0.5, 1]], 0.05) == [mark]


def test_a_corner_grazed_by_a_micrometre_is_refused() -> None:
    """Around an inner corner of an L-shaped room, and past the outer corner of a box: a micrometre decides."""
    # diagonal past (1, 1), the corner of the L that goes inwards
    inside, over = 1 - 1e-6, 1 + 1e-6
    assert marks(L_ROOM, [[inside + 0.4, inside - 0.4, 1], [inside - 0.4, inside + 0.4, 1]]) == ["must"]
    assert "no" in marks(L_ROOM, [[over + 0.4, over - 0.4, 1], [over - 0.4, over + 0.4, 1]])
    square = {"center": [0, 0, 1], "size": [2, 2, 1]}
    past, through = 2 + 2e-6, 2 - 2e-6  # x + y of the line; the corner (1, 1) has 2
    assert marks(square, [[past - 0.5, 0.5, 1], [0.5, past - 0.5, 1]]) == ["no"]
    assert marks(square, [[through - 0.5, 0.5, 1], [0.5, through - 0.5, 1]]) == ["no", "switch", "must", "switch", "no"]


def test_an_l_shaped_room_is_held_across_its_seam() -> None:
    around = [[3.5, 0.5, 1], [0.5, 0.5, 1], [0.5, 2.5, 1]]
    for margin in (0.0, 0.05, 0.4):
        assert marks(L_ROOM, around, margin) == ["must"]
    assert "may" in marks(L_ROOM, [[3.5, 0.5, 1], [0.5, 2.5, 1]], 0.05)
    along_the_seam = [[0.2, 1, 1], [0.8, 1, 1]]
    assert marks(L_ROOM, along_the_seam) == ["must"]
    assert marks(L_ROOM, along_the_seam, 0.1) == ["must"]


def test_where_four_boxes_meet_is_inside_their_union() -> None:
    four = {"union": [{"center": [x, y, 1], "size": [0.3, 0.3, 0.7]} for x in (0.15, 0.45) for y in (0.15, 0.45)]}
    assert marks(four, [[0.05, 0.05, 1], [0.55, 0.55, 1]]) == ["must"]
    assert marks(four, [[0.2, 0.2, 1], [0.4, 0.4, 1]], 0.1) == ["must"]
    assert marks(four, [[0.3, 0.3, 0.9], [0.3, 0.3, 1.1]], 0.2) == ["must"]


def test_a_gap_between_two_parts_is_seen() -> None:
    apart = {"union": [{"center": [0, 0, 1], "size": [1, 1, 1]}, {"center": [1.001, 0, 1], "size": [1, 1, 1]}]}
    assert marks(apart, [[0, 0, 1], [1, 0, 1]]) == ["must", "switch", "no", "switch", "must"]
    assert marks(apart, [[0, 0, 1], [1, 0, 1]], 0.01) == ["must", "may", "must"]


def test_a_face_that_a_path_runs_along_is_left_open() -> None:
    square = {"center": [0, 0, 1], "size": [2, 2, 1]}
    assert set(marks(square, [[1, -0.5, 1], [1, 0.5, 1]])) == {"may"}
    assert marks(square, [[1, -2, 1], [1, 2, 1]]) == ["no", "may", "no"]
    assert marks(square, [[-2, 2, 1], [0, 0, 1]])[0] == "no"  # in at a corner's edge, where two inequalities change at once


def test_one_body_written_in_several_ways_is_one_body() -> None:
    """A box as a prism, as a union of its halves and as a box turned by a right angle."""
    rng = np.random.default_rng(3)
    whole = box(np.array([0.25, 0.0, 1.0]), np.array([1.0, 0.5, 0.75]), 0.0)[0]
    corners = np.array([[-0.25, -0.25], [0.75, -0.25], [0.75, 0.25], [-0.25, 0.25]])
    halves = union(
        box(np.array([0.0, 0.0, 1.0]), np.array([0.5, 0.5, 0.75]), 0.0),
        box(np.array([0.5, 0.0, 1.0]), np.array([0.5, 0.5, 0.75]), 0.0),
    )
    turned = box(np.array([0.25, 0.0, 1.0]), np.array([0.5, 1.0, 0.75]), 90.0)
    ways = {"whole": whole, "prism": prism(corners, 0.625, 1.375)[0], "halves": halves[0], "turned": turned[0]}
    for margin in (Fraction(0), Fraction(1, 20)):
        for _ in range(10):
            spans = spans_of({name: region(data) for name, data in ways.items()}, wandering(rng, pieces=2), margin)
            shown = {
                name: [(span.mark, round(float(span.start), 4), round(float(span.stop), 4)) for span in row]
                for name, row in spans.items()
            }
            assert shown["prism"] == shown["turned"] == shown["halves"] == shown["whole"]


def test_a_moved_world_gives_the_same_labels() -> None:
    rng = np.random.default_rng(4)
    for _ in range(10):
        solids = {f"s{k}": region(random_solid(rng)[0]) for k in range(3)}
        trajectory = wandering(rng, pieces=2)
        step = np.array([4.0, -8.0, 2.0])
        coefficients = np.array(trajectory.coefficients)
        coefficients[:, :3, 0] += step
        there = {name: body.changed(center=tuple((np.array(body.center) + step).tolist())) for name, body in solids.items()}
        before, after = (
            spans_of(solids, trajectory, Fraction(1, 50)),
            spans_of(there, Trajectory(trajectory.durations, coefficients), Fraction(1, 50)),
        )
        for name in solids:
            assert [span.mark for span in before[name]] == [span.mark for span in after[name]]


@pytest.mark.slow
def test_a_scaled_and_a_turned_world_give_the_same_labels() -> None:
    rng = np.random.default_rng(5)
    for _ in range(10):
        solids = {f"s{k}": region(random_solid(rng)[0]) for k in range(3)}
        trajectory = wandering(rng, pieces=2)
        before = spans_of(solids, trajectory, Fraction(1, 50))
        twice, turn = np.array(trajectory.coefficients), np.array(trajectory.coefficients)
        twice[:, :3] *= 2.0
        turn[:, 0], turn[:, 1] = -trajectory.coefficients[:, 1], trajectory.coefficients[:, 0]
        large = {name: _scaled(body) for name, body in solids.items()}
        aside = {
            name: Region.model_validate(
                {"center": (-body.center[1], body.center[0], body.center[2]), "parts": turned(body.body, np.pi / 2)}
            )
            for name, body in solids.items()
        }
        after = spans_of(large, Trajectory(trajectory.durations, twice), Fraction(1, 25))
        beside = spans_of(aside, Trajectory(trajectory.durations, turn), Fraction(1, 50))
        for name in solids:
            assert (
                [span.mark for span in before[name]]
                == [span.mark for span in after[name]]
                == [span.mark for span in beside[name]]
            )


def _scaled(body: Region) -> Region:
    """The region twice as large, all of it twice as far from the origin."""
    parts = [
        [
            {
                "quadratic": (np.array(one.quadratic) / 4).tolist(),
                "linear": (np.array(one.linear) / 2).tolist(),
                "bound": one.bound,
            }
            for one in part
        ]
        for part in body.body
    ]
    return Region.model_validate({"center": tuple(2 * x for x in body.center), "parts": parts})


def test_an_ellipsoid_within_a_union_is_told_by_its_own_numbers() -> None:
    ball, _ = ellipsoid(np.array([0.0, 0.0, 1.0]), np.array([0.5, 0.5, 0.5]), 0.0)
    post, _ = cylinder(np.array([2.0, 0.0, 1.0]), 0.25, 1.0)
    together = {"union": [ball, post]}
    assert marks(together, [[-1, 0, 1], [3, 0, 1]], 0.05) == ["no", "may", "must", "may", "no", "may", "must", "may", "no"]
    assert marks(together, [[-1, 0, 1], [3, 0, 1]]) == [
        "no",
        "switch",
        "must",
        "switch",
        "no",
        "switch",
        "must",
        "switch",
        "no",
    ]
