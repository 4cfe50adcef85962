"""A hunt: random certified missions, each sentence of whose certificates is read as a person would, and held against dense samples."""

from __future__ import annotations

from pathlib import Path
from random import Random

import numpy as np
import pytest

import ltlplan
from ltlplan.pipeline import certified_team
from tests.helpers.missions.worlds import world
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.helpers.sentences import Flown, faults
from tests.verify.test_run_folder import write_folder
from verify import judge, recheck
from verify.data import LtlplanError, Mission, Plan, Trajectory, Visit, Word, parse_mission
from verify.data.plan import Meeting, Precedence
from verify.data.sections import Action

MEETINGS = (
    "F(count({0}) >= 2)", "F(count({0}) >= 2 & F all({1}))", "F(count({0}) == 1 & F(count({1}) >= 2)) & G(count({2}) <= 1)",
    "F(all({0})) & F {1}", "F(count({0}) >= 2) & F(count({1}) >= 2)",
)  # fmt: skip
ORDERS = (
    "!{0} U {1} & F {0}",
    "F {0} & F {1} & (!{1} U {2})",
    "F({0} & F {1}) & (!{2} U {0}) & F {2}",
    "F {0} & F {1} & G !({0} & {1})",
)
LAPS = ("G F(count({0}) >= 2)", "G F {0} & G F {1}", "F {2} & G F(count({0}) >= 2) & G F {1}")


def random_mission(random: Random) -> Mission:
    """Return a mission of two or three robots: meetings, orders of visits, or laps; some start in a region, some meet an obstacle."""
    kind = random.choice(("meetings", "orders", "laps"))
    team = "own" if kind == "orders" else "joint"
    names = random.sample("abc", 3)
    formula = random.choice({"meetings": MEETINGS, "orders": ORDERS, "laps": LAPS}[kind]).format(*names)
    places = dict(zip("abc", [(-1.6, 1.2), (1.6, 1.3), (0.1, -1.7)], strict=True))
    lines = ["format: 1", "name: hunted", "regions:"]
    for name, (x, y) in places.items():
        x, y, radius = x + random.uniform(-0.3, 0.3), y + random.uniform(-0.3, 0.3), random.uniform(0.75, 0.95)
        places[name] = (x, y)
        box = [round(1.5 * radius, 2), round(1.7 * radius, 2), 1.2]
        shape = f"radii: [{radius:.2f}, {radius:.2f}, 0.6]" if random.random() < 0.6 else f"size: {box}"
        lines.append(f"  {name}: {{center: [{x:.2f}, {y:.2f}, 1.0], {shape}}}")
    starts = [(-3.0, -0.6), (3.0, -0.4), (-0.2, 3.1)]
    if random.random() < 0.5:
        starts[0] = places["a"]
    lines += [
        "agents:",
        *(f"  q{i}: {{start: [{x:.2f}, {y:.2f}, 1.0]}}" for i, (x, y) in enumerate(starts[: random.randint(2, 3)])),
    ]
    if random.random() < 0.4:
        lines.append("obstacles: {pillar: {center: [0.1, 0.35, 1.0], size: [0.25, 0.2, 1.9]}}")
    trace = ", trace: infinite, repeat: 3" if kind == "laps" else ""
    lines += [
        f"spec: {{formula: '{formula}', team: {team}{trace}}}", "vehicle: crazyflie-2.1", "margin: 0.03", "separation: 0.25",
        f"limits: {{speed: {random.choice((0.7, 1.0, 1.4))}}}",
        "workspace: {min: [-4.0, -4.0, 0.1], max: [4.0, 4.0, 2.0]}",
        "planner: {cost: {length: 1.0}}",
    ]  # fmt: skip
    return parse_mission("\n".join(lines))


def hunted(folder: Path, plan: Plan, team: dict[str, Trajectory], certificate: object) -> tuple[Flown, list[str]]:
    """Write a folder and return what is wrong in its certificate's sentences."""
    laps = plan.mission.spec.repeat if plan.mission.spec.trace == "infinite" else 1
    flown = Flown(write_folder(folder, plan, team, certificate, laps))
    flown.vehicle = plan.mission.vehicle_of(next(iter(plan.robots)))
    return flown, faults(flown)


def hunt(folder: Path, seeds: range) -> dict[str, int]:
    """Plan, fly and certify random missions; return how many certificates there were, and how many sentences about waits."""
    seen = {"certified": 0, "waits": 0}
    for seed in seeds:
        try:
            plan = ltlplan.plan(random_mission(Random(seed)))
            done = certified_team(plan)
        except LtlplanError:
            continue
        flown, wrong = hunted(folder / str(seed), done.plan, done.team, done.certificate)
        assert not wrong, (seed, wrong)
        seen["certified"] += 1
        seen["waits"] += sum(claim["name"] == "precedences" for claim in flown.certificate["claims"])
    return seen


@pytest.mark.slow
def test_sentences_of_planned_flights_say_what_is_flown(tmp_path: Path) -> None:
    seen = hunt(tmp_path, range(2, 4))
    assert seen["certified"] >= 1
    assert seen["waits"] >= 1


@pytest.mark.slow
def test_many_sentences_of_planned_flights_say_what_is_flown(tmp_path: Path) -> None:
    seen = hunt(tmp_path, range(4, 34))
    assert seen["certified"] >= 12
    assert seen["waits"] >= 10


ROOMS = {"a": (0.0, 0.0), "b": (3.0, 0.0), "c": (0.0, 3.0)}


@pytest.mark.slow
@pytest.mark.parametrize(
    "formula",
    [
        "G F all(a) & G F all(b)",
        pytest.param("G F(all(a) & F(all(b) & F(all(c)))) & G !(a & b)", marks=pytest.mark.slow),
        pytest.param("G F(count(a)==1 & F(count(c) >= 2)) & G F(count(b)>=2)", marks=pytest.mark.slow),
    ],
)
def test_waits_of_planned_laps_are_proved_and_flown_in_every_lap(tmp_path: Path, formula: str) -> None:
    mission = world(
        formula, robots=2, regions=ROOMS, radii=dict.fromkeys(ROOMS, 0.9), starts=((-2.0, -1.0), (3.0, 3.0)), trace="infinite",
        team="joint", repeat=3, extra="margin: 0.03\nseparation: 0.25\nlimits: {speed: 1.0}",
    )  # fmt: skip
    done = certified_team(ltlplan.plan(mission))
    assert done.plan.meetings
    flown, wrong = hunted(tmp_path / "run", done.plan, done.team, done.certificate)
    assert not wrong
    waits = [claim["sentence"] for claim in flown.certificate["claims"] if claim["name"] == "precedences"]
    assert len(waits) == len(done.plan.meetings)
    assert all(", in each lap, by at least " in sentence for sentence in waits)
    assert recheck(tmp_path / "run").holds


FILL = Action.model_validate({"at": "a", "from": "idle", "to": "busy"})
TASK = "robot: {initial: idle, states: {idle: [], busy: [busy]}, actions: [{at: a, from: idle, to: busy}]}"
REGIONS = "a: {center: [1.0, 0.0, 1.0], radii: [0.3, 0.3, 0.3]}\nb: {center: [1.0, 2.0, 1.0], size: [0.5, 0.5, 0.5]}"


def drawn(random: Random) -> tuple[Plan, dict[str, Trajectory]]:
    """Return flights drawn by hand, which hold, rest and wander before they come to their regions, under a wait of any kind."""
    acts = random.random() < 0.5
    mission = small_mission("F a & F b", regions=REGIONS, starts=((0, 0, 1), (0, 2, 1)), margin=0.02, extra=TASK)
    action = (FILL,) if acts else ()
    busy = [["a"], ["a", "busy"], ["busy"]] if acts else [["a"], []]
    twice = random.random() < 0.5
    visits = {"r0": [Visit(region="a", actions=action)], "r1": [Visit(region="b")] * (2 if twice else 1)}
    words = {"r0": Word.of([[], *busy]), "r1": Word.of([[], ["b"], [], ["b"]] if twice else [[], ["b"]])}
    done = random.choice(("left", "entered", "acted") if acts else ("left", "entered"))
    wait: Precedence | Meeting = Meeting(first=("r0", 0), then=("r1", int(twice)))
    if random.random() < 0.4:
        wait = Precedence(first=("r0", 0), then=("r1", int(twice)), done=done, due=random.choice(("enters", "leaves")))
    plan = plan_of(mission, visits, words)
    plan = plan.changed(**{"meetings" if isinstance(wait, Meeting) else "precedences": (wait,)})
    wander = [[0.0, 2.0, 1.0 + random.uniform(0.05, 0.4)] for _ in range(random.randint(0, 2))]
    stop = random.randint(0, 24)
    to_b = [[0, 2, 1], *wander, *[[1.0, 2.0, 1.0]] * (1 + stop)]
    r1 = legs(
        [*to_b, [1.8, 2.0, 1.0], [1.0, 2.0, 1.0]] if twice else to_b,
        speed=random.uniform(0.15, 0.6),
        hold=random.uniform(0.1, 8.0),
    )
    r0 = legs([[0, 0, 1], [1, 0, 1], [2, 0, 1]], speed=random.uniform(0.3, 0.7), hold=random.choice((0.0, 1.0)))
    return plan, {"r0": r0, "r1": r1}


def hunt_drawn(folder: Path, seeds: range) -> int:
    """Judge drawn flights, and hold whatever holds against samples; return how many waits held."""
    held = 0
    for seed in seeds:
        plan, team = drawn(Random(seed))
        flown, wrong = hunted(folder / str(seed), plan, team, judge(plan, team, largest=False))
        assert not wrong, (seed, wrong)
        held += sum(claim["name"] == "precedences" and claim["verdict"] == "holds" for claim in flown.certificate["claims"])
    return held


def test_sentences_of_drawn_flights_say_what_is_flown(tmp_path: Path) -> None:
    assert hunt_drawn(tmp_path, range(3)) >= 1


@pytest.mark.slow
def test_sentences_of_many_drawn_flights_say_what_is_flown(tmp_path: Path) -> None:
    assert hunt_drawn(tmp_path, range(5, 105)) >= 20


@pytest.mark.slow
def test_the_reader_of_sentences_refutes_what_is_not_so(tmp_path: Path) -> None:
    """Each number of a true certificate, made stronger, is refuted: the hunt would see a false one."""
    plan, team = next(made for made in map(drawn, map(Random, range(99))) if judge(*made, largest=False).holds)
    flown, wrong = hunted(tmp_path / "run", plan, team, judge(plan, team, largest=False))
    assert not wrong
    for word, factor in (("at most", 0.97), ("at least", 1.03), ("stays", 1.01), ("stay", 1.05)):
        for claim in flown.certificate["claims"]:
            before, _, after = claim["sentence"].partition(f" {word} ")
            number, _, rest = after.partition(" ")
            if not after or "jumps" in before or not number.replace(".", "").isdigit() or float(number) == 0.0:
                continue
            true = claim["sentence"]
            claim["sentence"] = f"{before} {word} {float(number) * factor:.6g} {rest}"
            assert faults(flown), claim["sentence"]
            claim["sentence"] = true
    assert not np.isnan(flown.end)
