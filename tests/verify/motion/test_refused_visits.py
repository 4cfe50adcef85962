"""Hoops missed or passed from the wrong side, visits and actions that the path does not make: refused where they are planned."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.kernel.witnesses import ANY, PLAN, TEAM, Right, around, assert_refused, judged
from tests.helpers.motion.flights import legs, plan_of, small_mission, through
from verify.data.plan import Plan, Visit
from verify.data.sections import Action
from verify.data.trajectory import Trajectory

# Smooth paths that are not the planned ones: hoops missed, taken from the wrong side, or not left.


def course(robot: str, moved: Mapping[int, np.ndarray] | None = None) -> Trajectory:
    """Return a robot's path with some of its points moved: it stays smooth, with a full stop at each."""
    mission = PLAN.mission
    start = np.array(mission.agents[robot].start)
    hoops = ("water", "smoke", "loc2") if robot == "quad0" else ("loc1",)
    points = [
        start,
        *([] if robot == "quad0" else [np.array([0.6, 0.1, 0.9])]),
        *(p for h in hoops for p in through(mission, h)),
    ]
    return legs([p + (moved or {}).get(i, 0.0) for i, p in enumerate(points)], hold=0.0 if robot == "quad0" else 6.0)


HOOPS = [
    ("quad0", (1, 2), "water", 0),
    ("quad0", (3, 4), "smoke", 1),
    ("quad0", (5, 6), "loc2", 2),
    ("quad1", (2, 3), "loc1", 0),
]


@few_of(4, ("robot", "pair", "hoop", "visit"), HOOPS)
@few_of(2, "height", [0.15, -0.15, 0.25, 0.45, -0.45])
def test_a_hoop_missed_by_a_smooth_path(robot, pair, hoop, visit, height):
    """Flown over or under its middle: near it off the axis, at its rim into it, further away without a visit."""
    path = course(robot, {i: np.array([0, 0, height]) for i in pair})
    certificate = judged(PLAN, {**TEAM, robot: path})
    knots = path.knots if robot == "quad0" else path.knots[1:]
    window = (knots[pair[0]], knots[pair[1]])
    if abs(height) == 0.15:
        assert_refused(certificate, Right("passages", robot, hoop, visit, window, says="off the axis", off=around(0.02, 1e-3)))
    elif abs(height) == 0.25:
        assert_refused(
            certificate,
            Right("rims", robot, hoop, time=window, off=around(0.12, 1e-3)),
            Right("passages", robot, hoop, time=window),
            Right("visits", robot, ANY, visit),
        )
    else:
        reached = Right("formula", robot, hoop, visit, None, says=f"`{hoop}` never happens")
        if hoop == "water":
            reached = Right("formula", "quad0", "smoke", says="`carrying` does not")
        if hoop == "smoke":
            reached = Right("transitions", "quad0", "loc2", 1, says="straight from water")
        assert_refused(certificate, Right("visits", robot, ANY, visit), reached)


RING = "h: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2], opening: 0.3, rim: 0.05}"
FORTH = (Visit(region="h", direction="F"),)
ROOM = 0.3 - 0.07 - 0.05  # opening less the vehicle's radius and the margin
RINGED = [
    # name, visits, points, what the witness says; the legs' plane is at x = 1
    ("a wrong side", FORTH, [[2, 0, 1], [0, 0, 1]], Right("passages", "r0", "h", 0, says="passage 0 is hR, planned is hF")),
    ("planned from the wrong side", (Visit(region="h", direction="R"),), [[0, 0, 1], [2, 0, 1]],
     Right("passages", "r0", "h", 0, says="passage 0 is hF, planned is hR")),
    ("a U-turn in the opening", FORTH, [[0, 0, 1], [1.02, 0, 1], [0, 0, 1]], Right("passages", "r0", "h", 0, says="turns back")),
    ("a U-turn within the margin of it", FORTH, [[0, 0, 1], [0.96, 0, 1], [0, 0, 1]],
     Right("passages", "r0", "h", 0, says="turns back")),
    ("a U-turn before it", FORTH, [[0, 0, 1], [0.9, 0, 1], [0, 0, 1]],
     Right("passages", "r0", "h", 0, says="hF does not happen")),
    ("through and back", FORTH, [[0, 0, 1], [2, 0, 1], [0, 0, 1]],
     Right("passages", "r0", "h", says="passes 'h' (R), which is not planned")),
    ("not to be passed", (Visit(region="h"),), [[0, 0, 1], [2, 0, 1]],
     Right("passages", "r0", "h", 0, says="passes 'h' (F), which is not planned")),
    ("out sideways", FORTH, [[0, 0, 1], [1, 0, 1], [1, 0, 2]], Right("passages", "r0", "h", 0, says="sideways")),
    ("to an end in the opening", FORTH, [[0, 0, 1], [1, 0, 1]], Right("passages", "r0", "h", 0, says="ends in the opening")),
    ("from a start in the opening", (), [[1, 0, 1], [2, 0, 1]], Right("passages", "r0", "h", says="begins or ends")),
    ("a millionth off the axis", FORTH, [[0, ROOM + 1e-6, 1], [2, ROOM + 1e-6, 1]],
     Right("passages", "r0", "h", says="off the axis", off=(0.5e-6, 1.5e-6), what="inside the rim")),
    ("outside the visit", FORTH, [[0, 0.17, 1], [2, 0.17, 1]], Right("passages", "r0", "h", 0, says="may not contain its passage")),
    ("a millionth too near the rim", (), [[0, 0.47 - 1e-6, 1], [2, 0.47 - 1e-6, 1]],
     Right("rims", "r0", "h", off=(0.5e-6, 1.5e-6))),
    ("into the rim", (), [[0, 0.33, 1], [2, 0.33, 1]], Right("rims", "r0", "h", off=(0.12, 0.1201))),
]  # fmt: skip


@few_of(6, ("visits", "points", "right"), [r[1:] for r in RINGED], ids=[r[0] for r in RINGED])
def test_passages(visits, points, right):
    mission = small_mission(regions="", hoops=RING, margin=0.05)
    path = legs(points)
    agents = {"r0": mission.agents["r0"].model_copy(update={"start": tuple(map(float, points[0]))})}
    mission = mission.model_copy(update={"agents": agents})
    (claim,) = assert_refused(judged(plan_of(mission, {"r0": visits}), {"r0": path}), right)
    if claim.time is not None and "passes 'h' (R)" not in claim.sentence:
        assert abs(path.evaluate(claim.time)[0] - 1) <= 0.13  # there it is near the plane of the ring


# Plans whose visits and actions are not those of the path.

FILL = Action.model_validate({"from": "no_water", "to": "carrying", "at": "water"})
BACK = Action.model_validate({"from": "carrying", "to": "no_water", "at": "water"})
ELSEWHERE = Action.model_validate({"from": "no_water", "to": "carrying", "at": "smoke"})
WATER, SMOKE, LOC2 = PLAN.robots["quad0"].visits
DRY = WATER.model_copy(update={"actions": ()})


def stay(region: str) -> tuple[float, float]:
    """Return when quad0 may be in a region, at the mission's margin of 0.05 m, by samples of 0.1 ms."""
    times = np.arange(0, TEAM["quad0"].duration, 1e-4)
    inside = PLAN.mission.all_regions[region].level(TEAM["quad0"].evaluate(times)[:, :3]) <= (1 + 0.05 / 0.2) ** 2
    found = times[inside]
    return float(found[0]) - 2e-4, float(found[-1]) + 2e-4


def acting(visit: Visit, *actions: Action) -> Visit:
    return visit.model_copy(update={"actions": actions})


def facing(visit: Visit, direction: str | None) -> Visit:
    return visit.model_copy(update={"direction": direction})


VISITS = [
    ("no action", [DRY, SMOKE, LOC2], Right("formula", "quad0", "smoke", 1, stay("smoke"), says="`smoke` holds there but `carrying`")),
    ("action in smoke", [DRY, acting(SMOKE, FILL), LOC2], Right("visits", "quad0", "smoke", 1, stay("smoke"), says="in 'smoke'")),
    ("action not of the mission", [DRY, acting(SMOKE, ELSEWHERE), LOC2], Right("visits", "quad0", "smoke", 1, stay("smoke"))),
    ("action backwards", [acting(DRY, BACK), SMOKE, LOC2], Right("visits", "quad0", "water", 0, stay("water"), says="'no_water'")),
    ("action twice", [acting(DRY, FILL, FILL), SMOKE, LOC2],
     Right("visits", "quad0", "water", 0, stay("water"), says="the state is 'carrying'")),
    ("action too late", [DRY, SMOKE, acting(LOC2, FILL)], Right("visits", "quad0", "loc2", 2, stay("loc2"), says="in 'loc2'")),
    ("action at a visit that does not happen", [WATER, SMOKE, LOC2, acting(DRY, BACK)],
     Right("visits", "quad0", "water", 3, None, says="does not happen")),
    ("water reversed", [facing(WATER, "R"), SMOKE, LOC2], Right("passages", "quad0", "water", 0, stay("water"), says="planned is waterR")),
    ("smoke reversed", [WATER, facing(SMOKE, "R"), LOC2], Right("passages", "quad0", "smoke", 1, stay("smoke"), says="planned is smokeR")),
    ("loc2 reversed", [WATER, SMOKE, facing(LOC2, "R")], Right("passages", "quad0", "loc2", 2, stay("loc2"), says="planned is loc2R")),
    ("smoke not passed", [WATER, facing(SMOKE, None), LOC2], Right("passages", "quad0", "smoke", 1, stay("smoke"))),
    ("smoke not planned", [WATER, LOC2], Right("visits", "quad0", "smoke", 1, stay("smoke"), says="planned in 'loc2'")),
    ("nothing planned", [], Right("visits", "quad0", "water", None, stay("water"), says="not planned")),
    ("one too many", [WATER, SMOKE, LOC2, SMOKE], Right("visits", "quad0", "smoke", 3, None, says="does not happen")),
    ("one twice", [WATER, WATER, SMOKE, LOC2], Right("visits", "quad0", "smoke", 1, stay("smoke"), says="planned in 'water'")),
    ("another order", [WATER, LOC2, SMOKE], Right("visits", "quad0", "smoke", 1, stay("smoke"), says="planned in 'loc2'")),
    ("another region", [WATER, SMOKE, Visit(region="loc1", direction="F")],
     Right("visits", "quad0", "loc2", 2, stay("loc2"), says="planned in 'loc1'")),
]  # fmt: skip


def with_visits(visits: list[Visit]) -> Plan:
    robot = PLAN.robots["quad0"].model_copy(update={"visits": tuple(visits)})
    return PLAN.model_copy(update={"robots": {**PLAN.robots, "quad0": robot}})


@few_of(8, ("visits", "right"), [row[1:] for row in VISITS], ids=[row[0] for row in VISITS])
def test_visits_and_actions_that_the_path_does_not_make(visits, right):
    assert_refused(judged(with_visits(visits), TEAM), right)


def test_around_the_smoke_to_loc2():
    """loc2 is reached only through smoke, so a way around it is no trace of the transition system."""
    mission = PLAN.mission
    start = np.array(mission.agents["quad0"].start)
    path = legs([start, *through(mission, "water"), [0.1, -0.4, 1.5], [-1.0, 0.0, 1.5], *through(mission, "loc2")])
    (claim,) = assert_refused(
        judged(with_visits([WATER, LOC2]), {**TEAM, "quad0": path}),
        Right("transitions", "quad0", "loc2", 1, (path.knots[-2], path.knots[-1]), says="straight from water"),
    )
    letters = [sorted(letter) for _, letter in claim.witness.word]
    assert letters == [[], ["water"], ["carrying", "water"], ["carrying"], ["carrying", "loc2"]]
    assert len(claim.witness.times) == len(letters)


def test_smoke_without_water():
    start = np.array(PLAN.mission.agents["quad0"].start)
    path = legs([start, [0.2, -0.5, 1.4], *through(PLAN.mission, "smoke"), *through(PLAN.mission, "loc2")])
    (claim,) = assert_refused(
        judged(with_visits([SMOKE, LOC2]), {**TEAM, "quad0": path}),
        Right("formula", "quad0", "smoke", 0, (path.knots[2], path.knots[3]), says="`carrying` does not"),
    )
    assert ("quad0", frozenset({"smoke"})) in claim.witness.word


@pytest.mark.parametrize("depth", [1e-3, 0.02, 0.05])
def test_an_action_where_the_region_may_be_missed(depth):
    """The path dips into a region by less than the margin, so the action there may happen outside."""
    extra = "robot: {initial: dry, states: {dry: [], wet: [wet]}, actions: [{from: dry, to: wet, at: a}]}"
    mission = small_mission("F wet", starts=[[0.0, 0.2 - depth, 1.0]], margin=0.06, extra=extra)
    fill = Action.model_validate({"from": "dry", "to": "wet", "at": "a"})
    path = legs([[0, 0.2 - depth, 1], [2, 0.2 - depth, 1]])
    assert_refused(
        judged(plan_of(mission, {"r0": [Visit(region="a", actions=(fill,))]}), {"r0": path}),
        Right("visits", "r0", "a", 0, around(path.duration / 2, 0.5), says="may miss the region"),
        Right("formula", says="`wet` never happens"),
    )
