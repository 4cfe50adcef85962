"""One robot's patrols among regions that lie in each other, about one middle or not: planned, refined and certified for ever."""

from __future__ import annotations

from random import Random

from ltlplan import parse_mission, plan
from ltlplan.pipeline import Candidate, Flight, attempted
from tests.helpers.few import few_of
from verify.data import Mission, MissionError, Unsatisfiable

HOUSES = {
    "house": ([-1.2, 0.0, 1.0], [0.95, 0.95, 0.75]),
    "room": ([-1.2, 0.0, 1.0], [0.55, 0.55, 0.5]),
    "b": ([1.2, 0.8, 1.0], [0.5, 0.5, 0.5]),
}
TOOL = "robot: {initial: e, states: {e: [], l: [tool]}, actions: [{from: e, to: l, at: room}, {from: l, to: e, at: b}]}\n"


def world(
    formula: str, start: list[float], houses: dict[str, tuple[list[float], list[float]]] = HOUSES, robot: str = ""
) -> Mission:
    regions = "".join(f"  {name}: {{center: {center}, radii: {radii}}}\n" for name, (center, radii) in houses.items())
    return parse_mission(
        f"format: 1\nname: houses\nspec: {{formula: '{formula}', trace: infinite}}\nregions:\n{regions}{robot}"
        f"agents: {{quad0: {{start: {start}}}}}\nvehicle: crazyflie-2.1\nlimits: {{speed: 1.0}}\n"
        "workspace: {min: [-2.6, -2.4, 0.2], max: [2.6, 2.6, 1.9]}\n"
    )


def certified(mission: Mission, pace: float | str = 0.7) -> bool:
    found = attempted(Candidate(plan(mission, pace=pace)))
    return isinstance(found, Flight) and found.certificate.holds


@few_of(
    1,
    ("formula", "start", "robot"),
    [
        ("G F room & G F b", [0.0, -1.6, 1.0], ""),
        ("G F room & G F(house & !room)", [-1.2, 0.0, 1.0], ""),  # it begins in the middle of both
        ("G F room & G F b & G F tool & G F !tool", [-1.2, -0.75, 1.0], TOOL),  # and acts in a visit within a visit
        ("F room & F G(house & !room)", [0.0, -1.6, 1.0], ""),  # hovers between the two
        ("F b & F G free", [0.0, -1.6, 1.0], ""),  # and outside of all
    ],
)
def test_patrols_of_houses_with_rooms_are_certified(formula: str, start: list[float], robot: str, pace: float | str) -> None:
    assert certified(world(formula, start, robot=robot), pace)


@few_of(
    1,
    ("formula", "a", "b"),
    [  # a region whose middle lies in b is left by going to the middle of b, and entered again from there: no flight in between
        ("G F (c & b) & G F (b & !c)", (1.5, 0.3), (0.4, 0.5)),
        ("G F (c & b) & G F (b & !c)", (-0.9, 0.3), (1.0, 1.2)),
        ("G F c & G F !c & F a", (-0.4, 0.5), (0.4, 0.3)),
    ],
)
def test_laps_between_middles_of_regions_that_overlap_are_certified(
    formula: str, a: tuple[float, float], b: tuple[float, float], pace: float | str
) -> None:
    balls = {name: ([x, 0.0, 1.0], [radius] * 3) for name, (x, radius) in {"a": a, "b": b, "c": (0.0, 0.3)}.items()}
    assert certified(world(formula, [0.0, -2.0, 1.0], balls), pace)


@few_of(1, "seed", [8, *(seed for seed in range(60) if seed != 8)])  # laps of 8 end in passing the region that they began in
def test_whatever_is_planned_among_drawn_houses_is_certified_at_once(seed: int) -> None:
    rng = Random(seed)
    houses = dict(HOUSES)
    if rng.random() < 0.4:
        houses["room"] = ([-1.2 + rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2), 1.0], [0.55, 0.55, 0.5])
    if rng.random() < 0.5:
        houses["core"] = ([-1.2, 0.0, 1.0], [0.22, 0.22, 0.22])
    if rng.random() < 0.5:
        houses["shed"] = ([1.2, 0.8, 1.0], [0.8, 0.8, 0.7])
    start = rng.choice([[0.0, -1.6, 1.0], [-1.2, 0.0, 1.0], [-1.2, -0.75, 1.0], [1.2, 0.8, 1.0]])
    names = list(houses)

    def letter() -> str:
        a, b = rng.choice(names), rng.choice(names)
        return rng.choice([a, f"({a} & !{b})", "free", f"!{a}"])

    formula = " & ".join(rng.choice(["G F ", "F "]) + letter() for _ in range(rng.randint(1, 3)))
    if rng.random() < 0.2:
        formula += f" & F G {letter()}"
    robot = TOOL if rng.random() < 0.4 else ""
    if robot:
        formula += rng.choice([" & G F tool", " & G F tool & G F !tool", " & F tool"])
    try:
        assert certified(world(formula, start, houses, robot))
    except (MissionError, Unsatisfiable):  # the start lies at a border, or no words satisfy the formula
        return
