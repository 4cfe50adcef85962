"""Formulas of published case studies for teams, as missions: places in the air are ours, the work is theirs.

Bai: `bairuofei/sampling_ltl_planning`, both cases. KTH: its example for hard and soft formulas. LOMAP: `wasserfeder/lomap`, its example ijrr2013 with
two robots. Schillinger, Buerger and Dimarogonas: "Simultaneous task allocation and planning for temporal logic goals in heterogeneous multi-robot
systems" (IJRR 2018), its second and third case. What they say by "until, and then not" (`F(p & carry & (carry U (d10 & !carry)))`) is said by actions
here. What was picked up is put down where that is permitted and nowhere else, and the internal state after it, `left10`, is shown. `bosch` asks the
second to the letter, in a small hall.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

from verify.data import Mission, parse_mission

BAI_PLACES = {
    "r_begin": (0.0, 0.0), "r_l1": (2.0, 2.0), "r_l2": (4.0, -1.0), "r_l3": (5.0, 2.5), "r_c1": (-2.0, 2.5), "r_u1": (1.5, -2.5),
    "r_z": (3.0, 0.7),
}  # fmt: skip
BAI_SECOND = "F r_l1 & F r_l2 & F r_l3 & F r_c1 & G(r_begin -> F r_u1) & G !r_z"
_PUBLIC = "(n6_5 | n7_5)"  # one of two doors in the wall
_OFFICE = {
    "m1": (0, 3), "m2": (4, 2), "m3": (5, 6), "m4": (8, 2), "m5": (12, 3), "m6": (12, 6),
    "p": (1, 6), "d3": (2, 1), "d5": (9, 4), "d7": (12, 1), "d10": (10, 6), "d11": (4, 4),
}  # fmt: skip
_MEETING = "(m1 | m2 | m3 | m4 | m5 | m6)"
SECOND_TOGETHER = f"F some(left10) & F some(left7) & F some(left5) & G all(carry -> !{_PUBLIC})"
SECOND = f"F left10 & F left7 & F left5 & G(carry -> !{_PUBLIC})"
THIRD = (
    f"F(m1 & photo) & F(m4 & photo) & F(m6 & photo) & G(!{_MEETING} -> !camera) & F left3 & G(carry -> !{_PUBLIC}) & F brought6"
)
THIRD_TOGETHER = (
    f"F some(m1 & photo) & F some(m4 & photo) & F some(m6 & photo) & G all(camera -> {_MEETING}) & F some(left3) "
    f"& G all(carry -> !{_PUBLIC}) & F quad5.brought6"
)


def plane_mission_text(
    formula: str,
    *,
    robots: int,
    regions: Mapping[str, tuple[float, float]],
    starts: tuple[tuple[float, float], ...],
    radii: Mapping[str, float] | None = None,
    trace: str = "finite",
    team: str = "own",
    repeat: int = 1,
    objective: str = "sum",
    extra: str = "",
) -> str:
    """Return a mission file in a plane, at height 1 m, flown at nominal pace: its plan is what is looked at.

    Args:
        formula: What is asked.
        robots: How many.
        regions: Round places, m.
        starts: Of the robots, m.
        radii: Of places that are not 0.2 m large.
        trace: `finite` or `infinite`.
        team: `own` or `joint`.
        repeat: Laps.
        objective: `sum` or `longest`.
        extra: YAML for further keys.
    """
    radius = dict.fromkeys(regions, 0.2) | dict(radii or {})
    lines = [
        "format: 1", "name: world", "regions:",
        *(f"  {n}: {{center: [{x}, {y}, 1.0], radii: [{radius[n]}, {radius[n]}, {radius[n]}]}}" for n, (x, y) in regions.items()),
        "agents:",
        *(f"  quad{i}: {{start: [{x}, {y}, 1.0]}}" for i, (x, y) in enumerate(starts[:robots])),
        "vehicle: crazyflie-2.1",
        "workspace: {min: [-20, -20, 0.2], max: [20, 20, 3]}",
        f"planner: {{objective: {objective}, pace: nominal}}",
        f"spec: {{formula: '{formula}', trace: {trace}, team: {team}, repeat: {repeat}}}",
        extra,
    ]  # fmt: skip
    return "\n".join(lines)


def world(formula: str, **asked: Any) -> Mission:  # of any type: as `plane_mission_text` says
    """Return a mission in a plane.

    Args:
        formula: What is asked.
        asked: As `plane_mission_text` says.
    """
    return parse_mission(plane_mission_text(formula, **asked))


def office_grid(
    formula: str, *, named: Mapping[str, tuple[int, int]] | None = None, robot: str = "", team: str = "own"
) -> Mission:
    """Return a mission of six robots on a grid of 112 places with walls, `n0_0` to `n13_7` but for those that are named.

    Args:
        formula: What is asked.
        named: Cells by the names of their places.
        robot: YAML of internal states and actions.
        team: `own` or `joint`.
    """
    width, height = 14, 8
    cells = {(x, y): f"n{x}_{y}" for x in range(width) for y in range(height)}
    cells |= {cell: name for name, cell in (named or {}).items()}
    places = {name: (float(x), float(y)) for (x, y), name in cells.items()}
    edges = [f"[home, {cells[x, 0]}]" for x in range(0, width, 3)]
    for x, y in itertools.product(range(width), range(height)):
        edges += [f"[{cells[x, y]}, {cells[x + 1, y]}]"] if x + 1 < width and not (x == 6 and y not in (0, 5)) else []
        edges += [f"[{cells[x, y]}, {cells[x, y + 1]}]"] if y + 1 < height else []
    starts = tuple((float(x), -1.0) for x in range(0, 18, 3))
    extra = f"environment: {{start: home, edges: [{', '.join(edges)}]}}\n{robot}"
    return world(formula, robots=6, regions=places, starts=starts, team=team, extra=extra)


_LOADS = """
format: 1
name: loads
spec: {formula: G F (r1 & loaded) & G F (r1 & unloaded), soft: [{formula: G !r3}], trace: infinite}
regions:
  r1: {center: [0, 0, 1], radii: [0.25, 0.25, 0.25]}
  r2: {center: [1, 1, 1], radii: [0.25, 0.25, 0.25]}
  r3: {center: [0.7, -0.3, 1], radii: [0.25, 0.25, 0.25]}
environment: {start: home, edges: [[home, r1], [r1, r2], [r1, r3]]}
robot:
  initial: empty
  states: {empty: [unloaded], full: [loaded]}
  actions: [{from: empty, to: full, at: r3}, {from: full, to: empty, at: r1}, {from: empty, to: full, at: AT}]
agents: {turtle: {start: [-0.6, 0, 1]}}
vehicle: crazyflie-2.1
workspace: {min: [-1.5, -1.5, 0.2], max: [2, 2, 2]}
margin: 0.04
"""


def loads(also: str) -> Mission:
    """Return the example of `KTH-SML/ltl_automaton_core`: one robot that loads at r3 and at a further place, and wishes `G !r3`."""
    return parse_mission(_LOADS.replace("AT", also))


def bai_second(team: str = "own") -> Mission:
    """Return Bai's second case: two robots that begin in `r_begin`."""
    radii = {"r_begin": 0.8, "r_u1": 0.6, "r_z": 0.6}
    return world(BAI_SECOND, robots=2, regions=BAI_PLACES, radii=radii, starts=((-0.3, 0.0), (0.3, 0.0)), team=team)


BAI_FIRST = "G F f_b & G F f_h & G F f_n & (!(f_m | f_pg | f_n) U e_h)"
BAI_ROOMS = {
    "f_b": (-2.5, -2.0),
    "f_h": (0.0, -2.2),
    "f_n": (2.5, -2.0),
    "f_m": (-2.5, 2.0),
    "f_pg": (0.0, 0.5),
    "e_h": (2.5, 2.0),
}


def bai_first() -> Mission:
    """Return Bai's first case: two robots that come to three rooms again and again, and to some not before `e_h`."""
    radii, starts = dict.fromkeys(BAI_ROOMS, 0.5), ((-1.0, -0.8), (1.0, 2.0))
    return world(BAI_FIRST, robots=2, regions=BAI_ROOMS, radii=radii, starts=starts, trace="infinite")


LOMAP_FIFTH = "G F gather1 & G F gather2 & G F gather3 & G F gather4"


def lomap_fifth() -> Mission:
    """Return LOMAP's fifth case: a patrol of two, of whom neither is to fly much more than the other."""
    places = {"gather1": (-2.0, -2.0), "gather2": (2.0, -2.0), "gather3": (2.0, 2.0), "gather4": (-2.0, 2.0)}
    radii, starts = dict.fromkeys(places, 0.4), ((-1.0, 0.0), (1.0, 0.0))
    return world(LOMAP_FIFTH, robots=2, regions=places, radii=radii, starts=starts, trace="infinite", objective="longest")


def meeting_in_each_lap(objective: str = "sum") -> Mission:
    """Return two robots that meet again and again, and come to a place of their own in between."""
    places = {"post": (0.0, 0.0), "west": (-2.0, 0.0), "east": (2.0, 0.0)}
    formula = "G F(count(post) >= 2) & G F quad0.west & G F quad1.east"
    radii, starts = {"post": 0.6, "west": 0.4, "east": 0.4}, ((-1.0, 1.5), (1.0, 1.5))
    return world(
        formula, robots=2, regions=places, radii=radii, starts=starts, trace="infinite", team="joint", objective=objective
    )


def meeting_by_the_dearer_robot() -> Mission:
    """Return the same, of whom neither is to fly much more than the other."""
    return meeting_in_each_lap("longest")


def _robot(begun: dict[str, str], ended: dict[str, str], more: str = "", switches: str = "") -> str:
    """Return YAML of a robot: `begun` from a task's state to where it is begun, `ended` from what is shown then to "state place"."""
    hands_free = ["idle", *ended]
    actions = [f"{{from: {state}, to: {task}, at: {place}}}" for task, place in begun.items() for state in hands_free]
    for shown, task_and_place in ended.items():
        task, place = task_and_place.split()
        actions.append(f"{{from: {task}, to: {shown}, at: {place}}}")
    states = ["idle: []", *(f"{task}: [{task}]" for task in begun), *(f"{shown}: [{shown}]" for shown in ended)]
    return f"robot:\n  initial: idle\n  states: {{{', '.join(states)}{more}}}\n  actions: [{', '.join(actions)}{switches}]\n"


def schillinger_second(formula: str = SECOND, team: str = "own") -> Mission:
    """Return Schillinger's second case: three documents for three desks, which are not carried through public places."""
    robot = _robot({"carry": "p"}, {f"left{desk}": f"carry d{desk}" for desk in (5, 7, 10)})
    return office_grid(formula, named=_OFFICE, robot=robot, team=team)


def schillinger_second_together() -> Mission:
    """Return it for a team that is read at once, with counts."""
    return schillinger_second(SECOND_TOGETHER, "joint")


def schillinger_third(formula: str = THIRD, team: str = "own") -> Mission:
    """Return Schillinger's third case: photos in three rooms, a document, and a guest who is shown to a room."""
    rooms = ("m1", "m4", "m6")
    on = "".join(f", {{from: {free}, to: filming, at: {room}}}" for free in ("idle", "left3", "brought6") for room in rooms)
    off = "".join(f", {{from: filming, to: idle, at: {room}}}" for room in rooms)
    tasks, results = {"carry": "d5", "guide": "d11"}, {"left3": "carry d3", "brought6": "guide m6"}
    robot = _robot(tasks, results, ", filming: [camera, photo]", on + off)
    return office_grid(formula, named=_OFFICE, robot=robot, team=team)


def schillinger_third_together() -> Mission:
    """Return it for a team that is read at once, with counts and a robot that is named: the one whom the guest knows."""
    return schillinger_third(THIRD_TOGETHER, "joint")


_CARRIED = {desk: f"F(p & carry & (carry U ({desk} & !carry)))" for desk in ("d10", "d7", "d5")}


def bosch() -> Mission:
    """Return Schillinger's second case with its formula to the letter, read at once: six robots of which any may carry, in a small hall."""
    desks = {"d10": (3.0, 3.0), "d7": (3.0, -3.0), "d5": (-3.0, -3.0)}
    places = {"p": (0.0, 3.0), **desks, "public": (0.0, 0.0)}
    down = ", ".join(f"{{from: carrying, to: idle, at: {desk}}}" for desk in desks)
    robot = (
        f"{{initial: idle, states: {{idle: [], carrying: [carry]}}, actions: [{{from: idle, to: carrying, at: p}}, {down}]}}"
    )
    return world(
        " & ".join((*_CARRIED.values(), "G(carry -> !public)")),
        robots=6,
        regions=places,
        radii={"p": 0.3, **dict.fromkeys(desks, 0.3), "public": 0.8},
        starts=tuple((-2.5 + k, -1.5) for k in range(6)),
        team="joint",
        extra=f"robot: {robot}\nlimits: {{speed: 1.0}}",
    )


def gathering() -> Mission:
    """Return five robots that come together, and then home."""
    starts = ((-2.0, 0.0), (2.0, 0.0), (0.0, 2.0), (0.0, -2.0), (2.0, 2.0))
    places = {"meet": (0.0, 0.0), "home": (0.0, 4.0)}
    formula = "F(count(meet) >= 5 & F all(home))"
    return world(formula, robots=5, regions=places, radii={"meet": 1.0, "home": 1.0}, starts=starts, team="joint")


def many_meet(robots: int, home: float) -> Mission:
    """Return some robots, in rows of ten: five of them meet, few at a time pass by, and all come home, to a place of some radius in m."""
    places = {"a": (-2.5, 0.0), "b": (2.5, 0.0), "home": (0.0, 3.5)}
    starts = tuple((-4.5 + i % 10, -3.0 - i // 10) for i in range(robots))
    formula = "F(count(a) >= 5) & G(count(b) <= 2) & F all(home)"
    radii = {"a": 1.0, "b": 0.8, "home": home}
    return world(formula, robots=robots, regions=places, radii=radii, starts=starts, team="joint")
