"""Robots that come to a region, wait there for others, and only then act."""

from __future__ import annotations

from random import Random

import pytest

from ltlplan import parse_mission, plan
from ltlplan.pipeline import certified_team
from refine.single_robot.task import Pace
from tests.helpers.few import few_of
from verify.data import Infeasible, Mission, NotCertified, Unsatisfiable

FILL = "{from: no_water, to: carrying, at: water}"
EMPTY = "{from: carrying, to: no_water, at: b}"
AWAY, INSIDE = "[-1.0, -1.8, 1.0]", "[-1.2, 0.3, 1.0]"


def world(formula: str, *, team: str = "joint", start: str = AWAY, actions: str = FILL) -> Mission:
    return parse_mission(
        f"format: 1\nname: filling\nspec: {{formula: '{formula}', team: {team}}}\n"
        "regions:\n  water: {center: [-1.2, 0.0, 1.0], radii: [0.7, 0.7, 0.5]}\n  b: {center: [1.2, 0.0, 1.0], radii: [0.7, 0.7, 0.5]}\n"
        f"robot: {{initial: no_water, states: {{no_water: [], carrying: [carrying]}}, actions: [{actions}]}}\n"
        f"agents: {{quad0: {{start: {start}}}, quad1: {{start: [1.0, -1.8, 1.0]}}}}\n"
        "vehicle: crazyflie-2.1\nlimits: {speed: 1.0}\nworkspace: {min: [-2.6, -2.4, 0.2], max: [2.6, 2.6, 1.9]}\n"
    )


MEETS = "F(quad0.water & !quad0.carrying & quad1.b) & F(quad0.carrying & quad1.free) & G(quad0.carrying -> !quad1.b)"


@few_of(
    1,
    ("formula", "start"),
    [
        ("F(water & !carrying & b) & G(carrying & water -> !b) & F carrying", AWAY),  # it ends where it acts
        (MEETS, AWAY),
        (f"{MEETS} & G !quad0.free", INSIDE),  # it never moves, and acts late for all that
    ],
)
def test_a_robot_waits_in_the_region_in_which_it_acts(formula: str, start: str, pace: Pace) -> None:
    made = plan(world(formula, start=start), pace=pace)
    assert any(wait.due == "acts" for wait in made.precedences)
    done = certified_team(made)
    assert all(claim.outcome == "holds" for claim in done.certificate.claims)


@pytest.mark.slow
def test_who_counts_acts_only_when_others_have_come() -> None:
    """Until now such words were planned without the wait, and failed in the planner's own check."""
    formula = "F(quad0.water & !quad0.carrying & quad1.b) & F quad0.carrying & G(quad0.carrying -> !quad1.b)"
    made = plan(world(formula))
    assert made.meetings
    assert [(wait.done, wait.due) for wait in made.precedences] == [("entered", "acts")]
    assert certified_team(made).certificate.holds


@pytest.mark.slow  # a minute: many small teams
@pytest.mark.parametrize("seed", range(80))
def test_what_is_planned_of_drawn_actions_is_certified(seed: int) -> None:
    rng = Random(seed)
    letters = ["water", "b", "carrying", "free", "!carrying", "!water", "!b"]
    if rng.random() < 0.4:
        letters += ["quad0.water", "quad1.b", "quad0.carrying", "quad1.carrying", "!quad0.carrying"]

    def both(count: int) -> str:
        return "(" + " & ".join(rng.choice(letters) for _ in range(count)) + ")"

    def part() -> str:
        place = rng.choice(["b", "water", "carrying"])
        return rng.choice([f"F {both(3)}", f"F {both(2)}", f"G({both(2)} -> !{place})", f"(!{place} U {both(2)})"])

    formula = " & ".join([*(part() for _ in range(rng.randint(1, 3))), "F carrying"])
    start, actions = rng.choice([AWAY, INSIDE]), rng.choice([FILL, f"{FILL}, {EMPTY}"])
    team = "joint" if len(letters) > 7 or rng.random() < 0.7 else "own"
    try:
        made = plan(world(formula, team=team, start=start, actions=actions))
    except (Unsatisfiable, Infeasible):
        return
    try:
        assert certified_team(made).certificate.holds
    except (Infeasible, NotCertified):
        assert not any(wait.due == "acts" for wait in made.precedences)
