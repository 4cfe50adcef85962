"""Strategies for small missions, and for plans of them: round the middle of a room lie up to six regions, and robots start between them.

Regions lie on a circle and starts within it, so that no straight leg from one place to another touches a third region: the visits
alone say what a robot shows.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

from verify.data.errors import BadInput
from verify.data.language.formula import FREE
from verify.data.language.word import Letter, Word, stutter_free
from verify.data.mission import Mission, check_mission
from verify.data.plan import Plan, RobotPlan, Visit, Waypoint, check_plan
from verify.data.sections import TeamReading, Trace
from verify.data.trajectory import HOVER
from verify.motion.regions import relations
from verify.testing.drawn_words import formulas, soft_parts
from verify.testing.engine import DrawFn, SearchStrategy, composite
from verify.testing.engine import strategies as st

MOST = 6
"""Regions, and robots, that one mission has at most."""
_START = "home"
_FAR = 2.0
"""m from the middle of the room to that of each region."""
_NEAR = 0.75
"""m from the middle of the room to each robot's start."""
_HEIGHTS = st.sampled_from([1.0, 0.8, 1.3])
_SHAPES = st.sampled_from(["ball", "ellipsoid", "box", "cylinder"])
_HALVES = st.sampled_from([0.2, 0.15, 0.3])
_TURNS = st.sampled_from([0.0, 30.0, -75.0])


@composite
def missions(
    draw: DrawFn,
    *,
    team: TeamReading | None = None,
    trace: Trace = "finite",
    robots: int = 3,
    regions: int = 3,
    soft: int = 0,
) -> Mission:
    """Small missions that pass every check of a mission file; whether their formula can be satisfied is another matter.

    There are balls, ellipsoids, boxes and cylinders `a`, `b`, ..., robots `quad0`, `quad1`, ..., sometimes edges, and sometimes
    robots that take something in at `a` (`load`) and put it down again. Formulas speak of all of that and of `free`, and of counts
    and robots' names under `joint`. The simplest mission has one robot and one ball, and its formula is `a`.

    Args:
        draw: Hypothesis gives it.
        team: How a team is read; both ways where it is None.
        trace: "finite", or "infinite", which is one robot's.
        robots: How many there are at most, from 1 to 6.
        regions: How many there are at most, from 1 to 6.
        soft: How many soft specifications there are at most.

    Raises:
        BadInput: A number is out of range.
    """
    for what, most in (("robots", robots), ("regions", regions)):
        if not 1 <= most <= MOST:
            raise BadInput(f"{what} must be from 1 to {MOST}, not {most}.")
    reading = team or draw(st.sampled_from(("own", "joint")))
    agents = [f"quad{i}" for i in range(1 if trace == "infinite" else draw(st.integers(1, robots)))]
    names = [chr(ord("a") + i) for i in range(draw(st.integers(1, regions)))]
    loads = draw(st.booleans())
    counted = agents if reading == "joint" else []
    said = [*names, FREE, *(["load"] if loads else [])]
    data: dict[str, Any] = {
        "name": "drawn",
        "spec": {
            "formula": str(draw(formulas(said, robots=counted, size=6))),
            "team": reading,
            "trace": trace,
            "soft": [part.model_dump() for part in draw(soft_parts(said, robots=counted, most=soft))] or None,
        },
        "regions": {name: _region(draw, i, len(names)) for i, name in enumerate(names)},
        "environment": _environment(draw, names) if draw(st.booleans()) else None,
        "agents": {name: {"start": _around(i, len(agents), _NEAR)} for i, name in enumerate(agents)},
        "vehicle": "crazyflie-2.1",
        "workspace": {"min": (-3.5, -3.5, 0.2), "max": (3.5, 3.5, 2.2)},
    }
    if loads:
        data["robot"] = {
            "initial": "empty",
            "states": {"empty": (), "loaded": ("load",)},
            "actions": [
                {"from": "empty", "to": "loaded", "at": "a"}, {"from": "loaded", "to": "empty", "at": draw(st.sampled_from(names))}
            ],
        }  # fmt: skip
    return check_mission(Mission.model_validate(data))


@composite
def plans(draw: DrawFn, of: SearchStrategy[Mission] | None = None, *, visits: int = 3) -> Plan:
    """Plans that can be flown, whether they satisfy their missions' formulas or not; `plan.words` are the words of the team.

    Robots fly straight from the middle of one region to that of the next, along edges where there are some, and may act there.
    The simplest plan has robots that stay where they are.

    Args:
        draw: Hypothesis gives it.
        of: The missions; `missions()` where it is None. Others must have regions that lie apart, no hoops and no obstacles, and
            robots that start in free flight.
        visits: How many one robot makes at most (for an infinite trace: before its lap, and in it).

    Raises:
        BadInput: A mission is of another kind.
    """
    mission = draw(missions() if of is None else of)
    apart = relations(mission).disjoint
    if mission.hoops or mission.obstacles or any((a, b) not in apart for a, b in itertools.combinations(mission.regions, 2)):
        raise BadInput("plans are drawn of missions whose regions lie apart, without hoops and obstacles.")
    robots = {name: _robot(draw, mission, name, visits) for name in mission.agents}
    return check_plan(Plan(mission=mission, robots=robots, method="drawn"))


def _around(index: int, count: int, distance: float, turn: float = 0.0) -> tuple[float, float, float]:
    angle = 2.0 * math.pi * index / count + turn
    return (round(distance * math.cos(angle), 3), round(distance * math.sin(angle), 3), 1.0)


def _region(draw: DrawFn, index: int, count: int) -> dict[str, Any]:
    x, y, _ = _around(index, max(count, 3), _FAR, turn=0.3)
    place = {"center": (x, y, draw(_HEIGHTS))}
    match draw(_SHAPES):
        case "ball":
            return {**place, "radii": (draw(_HALVES),) * 3}
        case "ellipsoid":
            return {**place, "radii": (draw(_HALVES), draw(_HALVES), draw(_HALVES)), "yaw_deg": draw(_TURNS)}
        case "box":
            size = (2.0 * draw(_HALVES), 2.0 * draw(_HALVES), 2.0 * draw(_HALVES))
            return {**place, "size": size, "yaw_deg": draw(_TURNS)}
        case _:
            return {**place, "cylinder": {"radius": draw(_HALVES), "height": 2.0 * draw(_HALVES)}}


def _environment(draw: DrawFn, names: Sequence[str]) -> dict[str, Any]:
    directed = draw(st.booleans())
    pairs = list(itertools.permutations(names, 2) if directed else itertools.combinations(names, 2))
    entries = draw(st.lists(st.sampled_from(names), unique=True, min_size=1))
    edges = draw(st.lists(st.sampled_from(pairs), unique=True)) if pairs else []
    return {"start": _START, "directed": directed, "edges": [*((_START, name) for name in entries), *edges]}


def _robot(draw: DrawFn, mission: Mission, name: str, most: int) -> RobotPlan:
    """Draw a robot's visits, and write down what comes of them."""
    own = mission.seen_by(name)
    found: list[Visit] = []
    state, at = mission.initial_internal(name), mission.agents[name].visited
    for _ in range(draw(st.integers(0, most))):
        able = [region for region in own.regions if _joined(own, at, region) and mission.may_enter(name, region)]
        if not able:
            break
        at = draw(st.sampled_from(able))
        acts = [act for act in own.robot.actions if act.at == at and act.source == state]
        actions = (draw(st.sampled_from(acts)),) if acts and draw(st.booleans()) else ()
        state = actions[-1].target if actions else state
        found.append(Visit(region=at, actions=actions))
    if mission.spec.trace == "finite":
        return _written(own, name, found, None)
    laps = [first for first in range(len(found) - 1) if _repeats(own, found[first:])]
    return _written(own, name, found, draw(st.sampled_from([len(found), *laps])))


def _joined(mission: Mission, at: str | None, region: str) -> bool:
    """Return whether a robot that was in `at` last (None: nowhere yet) may enter a region."""
    environment = mission.environment
    if environment is None:
        return at != region
    pairs = environment.pairs
    before = environment.start if at is None else at
    return (before, region) in pairs or (not environment.directed and (region, before) in pairs)


def _repeats(mission: Mission, lap: Sequence[Visit]) -> bool:
    """Return whether visits can be made again and again."""
    return _joined(mission, lap[-1].region, lap[0].region) and not any(visit.actions for visit in lap)


def _written(mission: Mission, name: str, visits: Sequence[Visit], cycle: int | None) -> RobotPlan:
    """Return the word, the way and its times; `cycle`: with which visit the lap begins (their number: a hover at the end)."""
    states, state = mission.robot.states, mission.initial_internal(name)
    points = [Waypoint(position=mission.agents[name].start, role="start")]
    letters: list[Letter] = [frozenset(states[state])]
    entered: list[int] = []
    for index, visit in enumerate(visits):
        if index:
            letters.append(frozenset(states[state]))
        entered.append(len(letters))
        for now in (state, *(action.target for action in visit.actions)):
            letters.append(frozenset({visit.region, *states[now]}))
            state = now
        middle = mission.regions[visit.region].center
        points.append(Waypoint(position=middle, role="centre", region=visit.region, visit=index))
    word, waypoint = Word(stutter_free(letters)), None
    if cycle == len(visits):
        word, waypoint = Word(word.prefix[:-1], word.prefix[-1:]), len(points) - 1
        points.append(points[-1])
    elif cycle is not None:
        waypoint = cycle + 1
        points.append(points[waypoint])
        lap = [*letters[entered[cycle] :], frozenset(states[state])]
        word = Word(stutter_free(letters[: entered[cycle]]), stutter_free(lap))
    lengths = [math.dist(one.position, other.position) for one, other in itertools.pairwise(points)]
    steps = [length / mission.planner.speed or HOVER for length in lengths]
    return RobotPlan(
        word=word,
        visits=tuple(visits),
        waypoints=tuple(points),
        times=(0.0, *itertools.accumulate(steps)),
        cycle_visit=cycle,
        cycle_waypoint=waypoint,
        cost=sum(lengths),
    )
