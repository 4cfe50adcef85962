"""Small flights by hand, one for each kind of claim, with their plans: the judge and the kernel need some milliseconds for each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from tests.helpers.motion.flights import legs, plan_of, quantised, through
from verify.data.files.mission_file import parse_mission
from verify.data.language.word import Word
from verify.data.mission import Mission
from verify.data.plan import Meeting, Plan, Precedence, Visit
from verify.data.trajectory import Trajectory

Flight = tuple[Plan, dict[str, Trajectory]]
BALL = "radii: [0.2, 0.2, 0.2]"
A, B, C = (f"{name}: {{center: {center}, {BALL}}}" for name, center in (("a", [1, 0, 1]), ("b", [1, 2, 1]), ("c", [-1, 1, 1])))
CARRIES = "initial: dry, states: {dry: [], wet: [carrying]}, actions: [{from: dry, to: wet, at: a}]"
RING = "h: {center: [0, 0, 1], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.4, rim: 0.05}"


def mission(formula: str, *starts: Sequence[float], **sections: str) -> Mission:
    """Return a mission of robots r0 and so on in a roomy box; sections are YAML in one line."""
    agents = ", ".join(f"r{number}: {{start: {list(start)}}}" for number, start in enumerate(starts))
    spec, margin, agents = (sections.pop(*one) for one in (("spec", "trace: finite"), ("margin", "0.05"), ("agents", agents)))
    box = sections.pop("workspace", "min: [-3, -3, 0.2], max: [3, 3, 2.2]")
    asked = f'formula: "{formula}", ' if formula else ""
    rest = "\n".join(f"{name}: {{{text}}}" if ":" in text else f"{name}: {text}" for name, text in sections.items())
    text = f"""
format: 1
name: small
spec: {{{asked}{spec}}}
agents: {{{agents}}}
vehicle: crazyflie-2.1
workspace: {{{box}}}
margin: {margin}
{rest}
"""
    return parse_mission(text)


def planned(of: Mission, visits: Mapping[str, Sequence[Visit]], words: Mapping[str, Any] | None = None, **more: Any) -> Plan:
    """Return a plan with visits, words, waits, and where laps begin: `cycles`, by robot."""
    cycles, plan = (
        more.pop("cycles", {}),
        plan_of(of, dict(visits), {name: Word.of(word) for name, word in (words or {}).items()}),
    )
    robots = {name: one.model_copy(update={"cycle_visit": cycles.get(name)}) for name, one in plan.robots.items()}
    return plan.changed(robots=robots, **more)


def to(*regions: str) -> list[Visit]:
    """Return visits of regions, or, with the direction behind a dot, passages of hoops."""
    return [Visit(region=one.split(".")[0], direction=([*one.split("."), None])[1]) for one in regions]  # type: ignore[arg-type]


def ends(of: Mission, hoop: str, direction: str = "F") -> list[list[float]]:
    """Return the points on both sides of a hoop that lead through it."""
    return [point.tolist() for point in through(of, hoop, direction)]


def split(path: Trajectory, piece: int) -> Trajectory:
    """Cut a piece into two in its middle, where it moves."""
    times, rows = list(path.durations), list(path.coefficients)
    half = times[piece] / 2
    factors = np.cumprod([1, *range(1, 8)])
    later = np.array([[polyval(half, polyder(row, k)) / factors[k] for k in range(8)] for row in rows[piece]])
    times[piece : piece + 1], rows[piece : piece + 1] = [half, half], [rows[piece], later]
    return quantised(Trajectory(times, np.stack(rows), cycle=path.cycle))


def turning(path: Trajectory, turn: float) -> Trajectory:
    """Turn by so many rad on each piece, at rest at its ends."""
    rows, start = path.coefficients.copy(), 0.0
    for row, time in zip(rows, path.durations, strict=True):
        row[3] = [start, 0, 0, 0, *(turn * c / time**k for k, c in zip(range(4, 8), (35, -84, 70, -20), strict=True))]
        start += turn
    return quantised(Trajectory(path.durations, rows, cycle=path.cycle))


def cut(path: Trajectory, *cuts: int) -> Trajectory:
    """Have parts begin with some pieces."""
    return Trajectory(path.durations, path.coefficients, cycle=path.cycle, cuts=cuts)


def _one() -> Flight:
    of = mission("F a", [0, 0, 1], regions=A, limits="endurance: 40")
    return planned(of, {"r0": to("a")}), {"r0": legs([[0, 0, 1], [1, 0, 1]])}


def _end_and_turn() -> Flight:
    agents = "r0: {start: [0, 0, 1], yaw_deg: 30, end: [1, 1, 1.2]}"
    of = mission("F a & G !c", regions=f"{A}, {C}", agents=agents)
    path = turning(legs([[0, 0, 1], [1, 0, 1], [1, 1, 1.2]], speed=0.6), 1.2)
    rows = path.coefficients.copy()
    rows[:, 3, 0] += np.float32(np.pi / 6)
    return planned(of, {"r0": to("a")}), {"r0": quantised(Trajectory(path.durations, rows))}


def _waits(team: str, *waits: Precedence | Meeting, **sections: str) -> Flight:
    of = mission("!b U a", [0, 0, 1], [0, 2, 1], regions=f"{A}, {B}", spec=f"team: {team}", robot=CARRIES, **sections)
    visits = {"r0": [Visit(region="a", actions=of.robot.actions)], "r1": to("b")}
    words = {"r0": [[], ["a"], ["a", "carrying"], ["carrying"]], "r1": [[], ["b"]]}
    chosen: dict[str, Any] = {"precedences": tuple(one for one in waits if isinstance(one, Precedence))}
    plan = planned(of, visits, words, **chosen, meetings=tuple(one for one in waits if isinstance(one, Meeting)))
    return plan, {"r0": legs([[0, 0, 1], [1, 0, 1], [2, 0, 1]]), "r1": legs([[0, 2, 1], [1, 2, 1]], hold=7.0)}


def _own_waits() -> Flight:
    return _waits("own", Precedence(first=("r0", 0), then=("r1", 0)), Precedence(first=("r0", 0), then=("r1", 0), done="acted"))


def _joint_waits() -> Flight:
    return _waits("joint", Precedence(first=("r0", 0), then=("r1", 0), done="entered"), clock_error="0.01")


def _counted() -> Flight:
    of = mission(
        "F(count(a) >= 2) & F r0.a & G(count(a | b) <= 3)", [0, -0.6, 1], [0, 0.6, 1], [-1, 2, 1],
        regions="a: {center: [1, 0, 1], size: [0.8, 2, 0.8]}, b: {center: [2.5, 2, 1], radii: [0.2, 0.2, 0.2]}",
        spec="team: joint", clock_error="0.02", separation_z="0.6",
    )  # fmt: skip
    plan = planned(of, {"r0": to("a"), "r1": to("a")}, meetings=(Meeting(first=("r0", 0), then=("r1", 0)),))
    team = {
        "r0": legs([[0, -0.6, 1], [1, -0.6, 1]]),
        "r1": legs([[0, 0.6, 1], [1, 0.6, 1]], hold=3.0),
        "r2": legs([[-1, 2, 1], [-1, 2, 1.3]], speed=0.3),
    }
    return plan, team


def _opening() -> Flight:
    of = mission(
        "F h & F b & G(b -> carrying)", [-1, 0, 1], hoops=RING, regions=f"b: {{center: [1.5, 0, 1.2], {BALL}}}",
        obstacles="wall: {center: [0, 0, 1.2], size: [0.1, 5, 2.4], openings: [h]}, box: {center: [1, 1, 1], size: [0.5, 0.5, 0.5]}",
        robot=CARRIES.replace("at: a", "at: h"), environment="start: home, edges: [[home, h], [h, b]]",
    )  # fmt: skip
    visits = [Visit(region="h", direction="F", actions=of.robot.actions), Visit(region="b")]
    return planned(of, {"r0": visits}), {"r0": legs([[-1, 0, 1], *ends(of, "h"), [0.9, 0, 1], [1.5, 0, 1.2]])}


def _sequence() -> Flight:
    rings = f"{RING}, g: {{center: [1.5, 0, 1], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.4, rim: 0.05}}"
    of = mission("", [-1, 0, 1], hoops=rings, sequence="hF gF")
    path = legs([[-1, 0, 1], *ends(of, "h"), *ends(of, "g"), [2.2, 0, 1]])
    return planned(of, {"r0": to("h.F", "g.F")}), {"r0": path}


def _union() -> Flight:
    room = (
        "{center: [1, 0, 1], size: [1, 1, 0.8]}, {center: [2, 0, 1], size: [1, 1, 0.8]}, {center: [2, 1, 1], size: [1, 1, 0.8]}"
    )
    rod = "c: {center: [-1, 1, 1], cylinder: {radius: 0.4, height: 0.8}}"
    of = mission("F room & F c", [0, 1.5, 1], regions=f"room: {{union: [{room}]}}, {rod}")
    points = [[0, 1.5, 1], [-1, 1.2, 1], [0, 0, 1], [1, 0, 1], [2, 0.1, 1], [2, 1, 1]]
    return planned(of, {"r0": to("c", "room")}), {"r0": split(legs(points), 4)}


def _corner() -> Flight:
    of = mission(
        "F a", [0, -0.8, 1], regions=A,
        obstacles="box: {center: [0, 0, 1], size: [0.6, 0.6, 0.6]}, ball: {center: [-1, 0, 1], radii: [0.3, 0.4, 0.5]}",
    )  # fmt: skip
    return planned(of, {"r0": to("a")}), {"r0": legs([[0, -0.8, 1], [0.8, 0, 1], [1, 0, 1]], speed=0.3)}


def _legs() -> Flight:
    of = mission(
        "F a & F b", [0, 0, 1], regions=f"{A}, {B}", limits="legs: {b: {speed: 0.7, acceleration: 0.6}, a: {speed: 1.2}}"
    )
    return planned(of, {"r0": to("a", "b")}), {"r0": legs([[0, 0, 1], [1, 0, 1], [1, 2, 1]], speed=0.3)}


def _parts() -> Flight:
    of = mission("F a & F b", [0, 0, 1], [0, 2.6, 1], regions=f"{A}, {B}", limits="endurance: 200, pieces: 2")
    team = {"r0": cut(legs([[0, 0, 1], [1, 0, 1], [1, 2, 1]]), 1), "r1": legs([[0, 2.6, 1], [0, 2.6, 1.2]])}
    length = float(team["r0"].durations[0])
    other = Trajectory([length, 1.0], np.stack([team["r1"].coefficients[0], team["r1"].coefficients[0]]))
    rows = other.coefficients.copy()
    rows[0, 2] = [1, *[0.0] * 7]
    rows[1, 2] = [1, 0, 0, 0, *(0.1 * c for c in (35, -84, 70, -20))]
    return planned(of, {"r0": to("a", "b")}), {"r0": team["r0"], "r1": cut(quantised(Trajectory([length, 1.0], rows)), 1)}


def _lap() -> Flight:
    of = mission(
        "G F a & G F b & F c", [-1, 1, 1], regions=f"{A}, {B}, {C}", spec="trace: infinite, repeat: 2", limits="endurance: 300"
    )
    path = legs([[-1, 1, 1], [0, 0, 1], [1, 0, 1], [1, 2, 1], [0, 0, 1]], cycle=1)
    return planned(of, {"r0": to("a", "b")}, cycles={"r0": 0}), {"r0": path}


def _laps(team: str) -> Flight:
    of = mission(
        "G F a & G F b & G(a -> F b)", [0, 0, 1], [0, 2, 1], regions=f"{A}, {B}", spec=f"trace: infinite, repeat: 3, team: {team}",
        clock_error="0.02",
    )  # fmt: skip
    out = [legs([[0, y, 1], [1, y, 1], [0, y, 1]], cycle=0) for y in (0, 2)]
    return planned(of, {"r0": to("a"), "r1": to("b")}, cycles={"r0": 0, "r1": 0}), {"r0": out[0], "r1": out[1]}


def _lap_through_hoop() -> Flight:
    of = mission("", [-1, 0, 1], hoops=RING, sequence="hF (hR hF)*", spec="trace: infinite, repeat: 2")
    there, back = ends(of, "h"), ends(of, "h", "R")
    path = legs([[-1, 0, 1], *there, [1.2, 0, 1], *back, [-1.2, 0, 1], *there, [1.2, 0, 1]], cycle=3)
    return planned(of, {"r0": to("h.F", "h.R", "h.F")}, cycles={"r0": 1}), {"r0": path}


def _lap_with_actions() -> Flight:
    carries = (
        "initial: dry, states: {dry: [], wet: [carrying]}, actions: [{from: dry, to: wet, at: a}, {from: wet, to: dry, at: b}]"
    )
    of = mission(
        "G F (a & carrying) & G F (b & !carrying)", [0, 0, 1], regions=f"{A}, {B}", spec="trace: infinite, repeat: 3", robot=carries,
        limits="legs: {b: {speed: 1.2}, a: {acceleration: 2.0}}", environment="start: home, edges: [[home, a], [a, b]]",
    )  # fmt: skip
    fill, empty = of.robot.actions
    visits = [Visit(region="a", actions=(fill,)), Visit(region="b", actions=(empty,))]
    return planned(of, {"r0": visits}, cycles={"r0": 0}), {"r0": legs([[0, 0, 1], [1, 0, 1], [1, 2, 1], [0, 0, 1]], cycle=0)}


def _lap_waits() -> Flight:
    plan, _ = _laps("joint")
    waits = Precedence(first=("r0", 0), then=("r1", 0), done="entered", due="leaves")
    first, then = [[0, 0, 1], [1, 0, 1], [0, 0, 1], [0, 0, 1]], [[0, 2, 1], [0, 2, 1], [1, 2, 1], [0, 2, 1]]
    return plan.changed(precedences=(waits,)), {"r0": legs(first, cycle=0), "r1": legs(then, cycle=0)}


def _lap_waits_for_prefix() -> Flight:
    regions = f"{A}, {B}, c: {{center: [-1, 2, 1], {BALL}}}"
    of = mission(
        "F a & F c & G F b", [0, 0, 1], [0, 2, 1], regions=regions, spec="trace: infinite, repeat: 2", clock_error="0.02"
    )
    team = {
        "r0": legs([[0, 0, 1], [1, 0, 1], [0, 0, 1], [0, -1, 1], [0, 0, 1]], cycle=2),
        "r1": legs([[0, 2, 1], [-1, 2, 1], [0, 2, 1], [1, 2, 1], [0, 2, 1]], cycle=2),
    }
    waits = (Precedence(first=("r0", 0), then=("r1", 1)),)
    return planned(of, {"r0": to("a"), "r1": to("c", "b")}, cycles={"r0": 1, "r1": 1}, precedences=waits), team


def _fills_and_empties() -> Flight:
    carries = (
        "initial: dry, states: {dry: [], wet: [carrying]}, actions: [{from: dry, to: wet, at: a}, {from: wet, to: dry, at: a}]"
    )
    of = mission("F (a & carrying) & F (b & !carrying)", [0, 0, 1], regions=f"{A}, {B}", robot=carries)
    visits = [Visit(region="a", actions=of.robot.actions), Visit(region="b")]
    return planned(of, {"r0": visits}), {"r0": legs([[0, 0, 1], [1, 0, 1], [1, 2, 1]])}


def _crossing() -> Flight:
    of = mission("F a", [-1, 0, 1], [0, -1, 1], regions=A, clock_error="0.03")
    return planned(of, {"r0": to("a")}), {"r0": legs([[-1, 0, 1], [1, 0, 1]]), "r1": legs([[0, -1, 1], [0, 1, 1]], hold=2.0)}


def _closely() -> Flight:
    of = mission(
        "F a", [-1, 0, 1], [0, -1, 1], [0, 1, 0.4], regions=A, clock_error="0.0", separation="0.25", separation_z="0.4"
    )
    team = {
        "r0": legs([[-1, 0, 1], [1, 0, 1]]),
        "r1": legs([[0, -1, 1], [0, 1, 1]], hold=1.5),
        "r2": legs([[0, 1, 0.4], [0, -1, 0.4]]),
    }
    return planned(of, {"r0": to("a")}), team


def _steps() -> Flight:
    of = mission("F a & G(a -> !c)", [0, 0, 1], [0.2, -0.5, 1.3], regions=f"{A}, {C}", clock_error="0.05")
    path, other = legs([[0, 0, 1], [0.5, 0, 1], [1, 0, 1]]), legs([[0.2, -0.5, 1.3], [1.1, -0.5, 1.2]])
    rows = path.coefficients.copy()
    rows[1, :3, 0] += [3e-5, -4e-5, 2e-5]
    return planned(of, {"r0": to("a")}), {"r0": quantised(Trajectory(path.durations, rows)), "r1": other}


def _begins_inside() -> Flight:
    of = mission("(F b | G a) & (a xor b) & (!c W b) & (b R !c) & (b M (a | b | free))", [1, 0.1, 1], regions=f"{A}, {B}, {C}")
    return planned(of, {"r0": to("b")}), {"r0": legs([[1, 0.1, 1], [1, 2, 1]])}


def _deadlines() -> Flight:
    of = mission(
        "F[0,2.5] G[0,2] a & F[1,5.5] count(a | b) >= 2 & (!b U[0,2.5] r0.a) & G (r0.a -> F[0,4] b) & G[0,1.25] !(r0.a xor r1.b)", [0, 0, 1], [0, 2, 1],
        regions=f"{A}, {B}", spec="team: joint", clock_error="0.02",
    )  # fmt: skip
    team = {"r0": legs([[0, 0, 1], [1, 0, 1]]), "r1": legs([[0, 2, 1], [1, 2, 1]], hold=3.0)}
    return planned(of, {"r0": to("a"), "r1": to("b")}), team


def _deadline_and_action() -> Flight:
    of = mission("F[2,3] carrying & (carrying R[0.5,3] !c) & (free W[0,1.25] a)", [0, 0, 1], regions=f"{A}, {C}", robot=CARRIES)
    return planned(of, {"r0": [Visit(region="a", actions=of.robot.actions)]}), {"r0": legs([[0, 0, 1], [1, 0, 1], [2, 0, 1]])}


FLIGHTS: Mapping[str, Callable[[], Flight]] = {
    "one": _one, "end and turn": _end_and_turn, "own waits": _own_waits, "joint waits": _joint_waits, "counted": _counted,
    "opening": _opening, "two hoops": _sequence, "union": _union, "corner": _corner, "legs": _legs, "parts": _parts, "lap": _lap,
    "laps, own": lambda: _laps("own"), "laps, joint": lambda: _laps("joint"),
    "lap through hoop": _lap_through_hoop, "lap with actions": _lap_with_actions, "lap waits": _lap_waits, "lap waits for prefix": _lap_waits_for_prefix, "fills and empties": _fills_and_empties, "crossing": _crossing,
    "closely": _closely, "steps": _steps, "begins inside": _begins_inside, "deadlines": _deadlines, "deadline and action": _deadline_and_action,
}  # fmt: skip
"""By what they show. All of their claims hold, and are checked."""


@cache
def small_flight(name: str) -> Flight:
    """Return a plan and a flight whose claims all hold."""
    return FLIGHTS[name]()


def spoiled(team: Mapping[str, Trajectory], draw: Any) -> Iterator[dict[str, Trajectory]]:
    """Yield teams with one robot's flight changed, most of which break some claim."""
    for name, path in team.items():
        for shift in (0.03, 0.12, 0.4):
            rows = path.coefficients.copy()
            rows[draw.randrange(len(rows)) :, draw.randrange(3), 0] += shift
            yield {**team, name: quantised(Trajectory(path.durations, rows, cycle=path.cycle, cuts=path.cuts))}
