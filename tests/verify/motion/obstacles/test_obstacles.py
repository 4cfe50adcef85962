"""The claim about obstacles against closed forms at dense instants, a micrometre on both sides of what is asked, and by its laws."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.motion.plans_by_hand import straight
from tests.helpers.motion.solid_distances import distances
from tests.helpers.motion.solids import random_solid
from verify.claims.claim import Claim
from verify.claims.evidence import Evidence
from verify.claims.obstacle_claims import obstacle_claims
from verify.data import Mission, Plan, Trajectory, load_vehicle
from verify.data.sections import Agent, Box, Spec
from verify.data.shapes.obstacle import Obstacle
from verify.data.shapes.region import Hoop
from verify.motion.obstacles.approaches import SolidWorld
from verify.motion.paths import read_team

RADIUS = load_vehicle("crazyflie-2.1").radius
SMOOTH = np.array([0, 0, 0, 0, 35, -84, 70, -20])
MICRO = 1e-6


def world(shapes: list[dict[str, Any]], start: tuple[float, ...], hoops: dict[str, Hoop] | None = None, **more: Any) -> Mission:
    """A mission whose rules of distance nobody asked: judging is what is tried here."""
    mission = Mission(
        name="solid",
        spec=Spec(formula="true"),
        hoops=hoops or {},
        agents={"r": Agent(start=start)},
        vehicle=load_vehicle("crazyflie-2.1"),
        workspace=Box(min=(-50, -50, -50), max=(50, 50, 50)),
        **more,
    )
    return mission.model_copy(update={"obstacles": {f"o{k}": Obstacle.model_validate(shape) for k, shape in enumerate(shapes)}})


def lines(*points: Any, duration: float = 1.0) -> Trajectory:
    """Straight pieces at constant speed, exactly from point to point."""
    corners = np.array(points, dtype=np.float64)
    table = np.zeros((len(corners) - 1, 4, 8))
    table[:, :3, 0], table[:, :3, 1] = corners[:-1], np.diff(corners, axis=0) / duration
    return Trajectory(np.full(len(table), duration), table)


def claims(mission: Mission, flight: Trajectory, margin: float | Fraction = 0.05) -> list[Claim]:
    plan = Plan.model_construct(mission=mission, robots={"r": straight(flight.coefficients[0, :3, 0], (0, 0, 0))}, notes=())
    return list(obstacle_claims(Evidence(plan, read_team(mission, {"r": flight})), Fraction(margin)))


def judged(shape: dict[str, Any], *points: Any, margin: float | Fraction = 0.05, hoops: dict[str, Hoop] | None = None) -> Claim:
    flight = lines(*points)
    (claim,) = claims(world([shape], tuple(map(float, points[0])), hoops), flight, margin)
    return claim


def random_flight(rng: np.random.Generator) -> Trajectory:
    """Pieces from rest to rest, or any polynomials, with steps between them."""
    count = int(rng.integers(1, 5))
    places, times = rng.normal(size=(count + 1, 3)) * [1.5, 1.5, 0.5] + [0, 0, 1], rng.uniform(0.5, 3, count)
    table, wild = np.zeros((count, 4, 8)), rng.random() < 0.3
    powers = times[:, None] ** np.arange(8)
    for axis in range(3):
        table[:, axis] = (rng.normal(size=(count, 8)) * 0.7 if wild else np.diff(places[:, axis])[:, None] * SMOOTH) / powers
        table[:, axis, 0] = places[:-1, axis]
    return Trajectory(times, table.astype(np.float32).astype(np.float64))


def dense(flight: Trajectory, count: int) -> np.ndarray:
    """Positions of a flight and of the straight steps between its pieces. Shape (n, 3)."""
    found: list[np.ndarray] = []
    for duration, rows in zip(flight.durations, flight.coefficients, strict=True):
        times = np.linspace(0, duration, count)
        piece = np.stack([np.polyval(rows[axis, ::-1], times) for axis in range(3)], axis=1)
        if found:
            found.append(np.linspace(found[-1][-1], piece[0], count))
        found.append(piece)
    return np.concatenate(found)


def assert_agrees_with_samples(rng: np.random.Generator, count: int, *, closely: bool) -> None:
    """Fly at random and hold what is proved against so many samples a piece, and what is decided just beyond them."""
    shapes = [random_solid(rng)[0] for _ in range(int(rng.integers(1, 4)))]
    flight = random_flight(rng)
    mission = world(shapes, tuple(flight.coefficients[0, :3, 0].tolist()))
    solid = SolidWorld.of(read_team(mission, {"r": flight}))
    nearest, *others = solid.approaches({"r": 0.12})["r"]
    path = dense(flight, count)
    sampled = np.array([distances(shape, path).min() for shape in shapes])
    least = float(sampled.min())
    step = float(np.linalg.norm(np.diff(path, axis=0), axis=1).max())
    assert nearest.low <= least + 1e-12
    assert max(nearest.low, 0.0) >= least - step - max(1e-4, 0.011 * least)
    assert {nearest.obstacle, *(one.obstacle for one in others)} >= {f"o{k}" for k in np.flatnonzero(sampled < 0.12 - 1e-3)}
    if least > 0.01 and closely:
        assert min(one.low for one in solid.nearer_than(0, Fraction(least))) <= least
        assert least < 0.05 or min(one.low for one in solid.nearer_than(0, Fraction(least - step))) > least - step


@few_of(2, "seed", range(6))
def test_what_is_proved_is_never_more_than_what_is_sampled(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(2):
        assert_agrees_with_samples(rng, 1500, closely=True)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 120))
def test_ten_thousand_random_flights(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for k in range(500):
        assert_agrees_with_samples(rng, 400, closely=k % 10 == 0)


BOX = {"center": [0.0, 0.0, 1.0], "size": [0.05, 2.0, 1.0]}
ROUND = {"center": [0.0, 0.0, 1.0], "cylinder": {"radius": 0.5, "height": 1.0}}
NEED = RADIUS + 0.05
DIAGONAL = NEED / np.sqrt(2)


@pytest.mark.parametrize(
    ("shape", "line"),
    [
        (BOX, lambda d: [(-0.025 - NEED - d, -2, 1), (-0.025 - NEED - d, 2, 1)]),  # along a thin wall's face
        (BOX, lambda d: [(-2, 1 + NEED + d, 1.2), (2, 1 + NEED + d, 1.2)]),  # past its end
        (BOX, lambda d: [(0.025 + DIAGONAL + d, 1 + DIAGONAL + d, 0), (0.025 + DIAGONAL + d, 1 + DIAGONAL + d, 2)]),  # an edge
        (  # across a corner
            BOX,
            lambda d: [
                np.array([0.025, 1, 1.5]) + (NEED + d) / np.sqrt(3) + side * np.array([1, -1, 0]) for side in (-0.5, 0.5)
            ],
        ),
        ({**BOX, "yaw_deg": 90}, lambda d: [(-2, 0.025 + NEED + d, 1.2), (2, 0.025 + NEED + d, 1.2)]),
        (ROUND, lambda d: [(0.5 + NEED + d, -1, 1), (0.5 + NEED + d, 1, 1)]),
        (ROUND, lambda d: [(0.5 + DIAGONAL + d, -1, 1.5 + DIAGONAL + d), (0.5 + DIAGONAL + d, 1, 1.5 + DIAGONAL + d)]),
        ({"center": [0, 0, 1.0], "radii": [0.5, 0.3, 0.2]}, lambda d: [(0.5 + NEED + d, -1, 1), (0.5 + NEED + d, 1, 1)]),
        (
            {"prism": {"polygon": [[0, 0], [1, 0], [0, 0.2]], "z": [0.5, 1.5]}},  # a sharp edge
            lambda d: [(1 + NEED + d, 0, 0), (1 + NEED + d, 0, 2)],
        ),
    ],
    ids=["face", "end", "edge", "corner", "turned", "round", "rim", "ellipsoid", "sharp"],
)  # fmt: skip
def test_a_micrometre_decides(shape: dict[str, Any], line: Any) -> None:
    outside, inside = judged(shape, *line(MICRO)), judged(shape, *line(-MICRO))
    assert outside.outcome == "holds"
    assert (outside.bound or 0.0) >= NEED
    assert inside.outcome == "fails"
    assert inside.witness is not None
    assert inside.witness.region == "o0"
    assert np.linalg.norm(inside.witness.way or ()) == pytest.approx(1.0)


DOOR = Hoop(center=(0.0, 0.0, 1.0), radii=(0.2, 0.2, 0.2), opening=0.3, rim=0.02)
WALL = {"center": [0.0, 0.0, 1.0], "size": [0.05, 2.0, 1.9], "openings": ["door"]}


def test_an_opening_is_as_wide_as_it_is() -> None:
    room = 0.3 - NEED
    for angle in np.linspace(0, 6, 7):
        for off, outcome in ((room - MICRO, "holds"), (room + MICRO, "fails"), (0.0, "holds"), (0.6, "fails")):
            y, z = off * np.cos(angle), 1 + off * np.sin(angle)
            assert judged(WALL, (-1, y, z), (1, y, z), hoops={"door": DOOR}).outcome == outcome
    assert judged({**WALL, "openings": []}, (-1, 0, 1), (1, 0, 1), hoops={"door": DOOR}).outcome == "fails"


def test_in_front_of_an_opening_its_edge_is_round() -> None:
    """0.05 m off the opening's edge, inwards: neither the wall's face nor the opening alone is far enough away."""
    inwards = 0.05
    ahead = np.sqrt(NEED**2 - inwards**2)
    for more, outcome in ((MICRO, "holds"), (-MICRO, "fails")):
        x = -0.025 - ahead - more
        claim = judged(WALL, (x, 0, 1 + 0.3 - inwards), (x - 0.5, 0, 1 + 0.3 - inwards), hoops={"door": DOOR})
        assert claim.outcome == outcome


def test_touching_is_meeting() -> None:
    """A path at exactly the distance that is asked: the sphere touches the face."""
    claim = judged(
        {"center": [0.0, 0.0, 1.0], "size": [0.5, 2.0, 1.0]},
        (-0.5, -1, 1),
        (-0.5, 1, 1),
        margin=Fraction(1, 4) - Fraction(RADIUS),
    )
    assert claim.outcome == "fails"


def test_how_deep_and_which_way_out() -> None:
    mission = world([BOX, {"center": [1.0, 0.0, 1.0], "size": [0.4, 2.0, 1.0]}], (-1.0, 0.0, 1.0))
    first, second = sorted(claims(mission, lines((-1, 0, 1), (0.9, 0, 1))), key=lambda claim: claim.witness.region)
    assert (first.witness.region, second.witness.region) == ("o0", "o1")
    assert first.bound == pytest.approx(-0.025, abs=1e-4)
    assert second.bound == pytest.approx(-0.1, abs=1e-3)
    assert second.time == pytest.approx(1.0, abs=1e-3)
    assert second.witness.way == pytest.approx((-1, 0, 0), abs=1e-6)
    assert "is 0.0250 m inside obstacle 'o0'" in first.sentence


def test_hovers_and_steps_are_judged() -> None:
    """A step between pieces leads through a wall; and a robot rests in one after its flight, while another one flies on."""
    jump = Trajectory(np.ones(2), np.zeros((2, 4, 8)))
    table = jump.coefficients.copy()
    table[:, 2, 0], table[:, 0, 0] = 1.0, [-1.0, 1.0]
    (claim,) = claims(world([BOX], (-1.0, 0.0, 1.0)), Trajectory(np.ones(2), table))
    assert claim.outcome == "fails"
    mission = world([BOX], (-1.0, 0.0, 1.0))
    pair = mission.model_copy(update={"agents": {"r": Agent(start=(-1, 0, 1)), "s": Agent(start=(0, 0, 1))}})
    still = Trajectory(
        np.ones(1), np.concatenate([table[:1], table[:1]])[:1] * 0 + np.array([0, 0, 1.0, 0])[:, None] * np.eye(8)[0]
    )
    team = {"r": lines((-1, 0, 1), (-1, 1, 1), (-1, 0, 1)), "s": still}
    solid = SolidWorld.of(read_team(pair, team))
    assert solid.approaches({"r": 0.1, "s": 0.1})["s"][0].high < 0
    assert solid.approaches({"r": 0.1, "s": 0.1})["r"][0].high == pytest.approx(0.975, abs=0.01)


def test_a_lap_is_judged_over_its_seam() -> None:
    """From the end of the lap back to its start the path steps through a wall."""
    mission = world([BOX], (-1.0, 0.0, 1.0))
    mission = mission.model_copy(update={"spec": Spec(formula="true", trace="infinite")})
    around = lines((-1, 0, 1), (-1, 2, 1), (1, 2, 1), (1, 0, 1))
    lasso = Trajectory(around.durations, around.coefficients, cycle=0)
    nearest, *_ = SolidWorld.of(read_team(mission, {"r": lasso})).approaches({"r": 0.1})["r"]
    assert nearest.high < 0
    assert nearest.time == 3


def test_moved_turned_and_scaled_worlds_give_the_same() -> None:
    rng = np.random.default_rng(5)
    cos, sin = np.cos(np.radians(40)), np.sin(np.radians(40))
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    moves = [(np.eye(3), 0.0), (np.eye(3), 3.0), (turn, 0.0), (2.5 * np.eye(3), 0.0)]
    for _ in range(3):
        points = rng.normal(size=(4, 3)) * [1, 1, 0.3] + [0, 0, 1]
        found = []
        for matrix, shift in moves:
            here, yaw = float(np.cbrt(np.linalg.det(matrix))), 40.0 if matrix is turn else 0.0
            center = (matrix @ [0.2, 0.1, 1.0] + shift).tolist()
            shape = {"center": center, "size": [here * 0.3, here * 1.0, here * 0.5], "yaw_deg": 20 + yaw}
            flight = lines(*(matrix @ point + shift for point in points))
            mission = world([shape], tuple(flight.coefficients[0, :3, 0].tolist()))
            (one, *_) = SolidWorld.of(read_team(mission, {"r": flight})).approaches({"r": 10.0 * here})["r"]
            found.append(one.high / here)
        assert found == pytest.approx([found[0]] * 4, abs=2e-4)


def test_a_box_is_a_prism_is_two_halves() -> None:
    prism = {"prism": {"polygon": [[-0.3, -1], [0.3, -1], [0.3, 1], [-0.3, 1]], "z": [0.5, 1.5]}}
    halves = {
        "union": [{"center": [0.0, y, 1.0], "size": [0.6, 1.0, 1.0]} for y in (-0.5, 0.5)],
    }
    whole = {"center": [0.0, 0.0, 1.0], "size": [0.6, 2.0, 1.0]}
    rng = np.random.default_rng(6)
    for _ in range(6):
        flight = random_flight(rng)
        start = tuple(flight.coefficients[0, :3, 0].tolist())
        found = []
        for shape in (whole, prism, halves):
            solid = SolidWorld.of(read_team(world([shape], start), {"r": flight}))
            found.append(max(solid.approaches({"r": 10.0})["r"][0].high, 0.0))  # how deep a point is depends on the parts
        assert found == pytest.approx([found[0]] * 3, abs=2e-4)


def test_absurd_numbers_prove_nothing() -> None:
    for size in (1e30, 1e200, 1e308):
        flight = lines((-1, 0, 1), (-1, 1, 1))
        table = flight.coefficients.copy()
        table[0, 0, 7] = size
        (claim,) = claims(world([BOX], (-1.0, 0.0, 1.0)), Trajectory(flight.durations, table))
        assert claim.outcome != "holds"


def test_far_obstacles_are_dropped_and_near_ones_found_among_many() -> None:
    near = {"center": [0.0, 0.5, 1.0], "cylinder": {"radius": 0.2, "height": 1.0}}
    many = [{"center": [x, y, 1.0], "size": [0.4, 0.4, 1.0]} for x in range(-10, 11, 2) for y in range(4, 20, 2)]
    (claim,) = claims(world([*many, near], (-3.0, 0.0, 1.0)), lines((-3, 0, 1), (3, 0, 1)))
    assert claim.outcome == "holds"
    assert claim.bound == pytest.approx(0.3, abs=0.01)
    assert f"'o{len(many)}'" in claim.sentence
