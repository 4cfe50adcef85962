"""Regions that overlap or lie in each other: MTAC-E finds what the exact search finds, and what it plans is flown and proved."""

from functools import partial

import numpy as np
import pytest

from ltlplan.mtac.agent_moves import RobotTask, World
from ltlplan.mtac.beam_search import Options
from ltlplan.mtac.decomposable_task import Reader
from ltlplan.mtac.offline import mtac_e, share_tasks
from ltlplan.mtac.optimality_gap import straight_cost
from ltlplan.pipeline import certified_team, plan
from ltlplan.search.exact import assign
from ltlplan.systems.robot_systems import Systems
from tests.helpers.few import few_of
from tests.helpers.missions.overlaps import CASES, NEST, PAIR, THREE, holds_when_sampled, mission_of, overlapping, sampled_word
from verify import check_team
from verify.data import BadInput, Unsatisfiable

QUICK = Options(optimality_gap=False)
FULL = """robot: {initial: empty, states: {empty: [], full: [load]}, actions: [{from: empty, to: full, at: room}]}"""


def rng():
    return np.random.default_rng(0)


def by_straight_lines(mission, found):
    """What the visits come to when the robots fly straight from stop to stop."""
    return straight_cost(mission, found.robots)


DEFAULT = ("out of two, the other way about", "out of three")
ALL = [pytest.param(case, marks=() if case in DEFAULT else pytest.mark.slow) for case in CASES]


@few_of(1, "case", ALL)
def test_one_robot_s_visits_are_the_cheapest_and_are_proved(case, pace):
    mission = mission_of(case, "mtac-e")
    made = plan(mission, method=partial(mtac_e, options=QUICK), seed=1, pace=pace)
    found = share_tasks(mission, rng=rng(), options=QUICK)
    assert by_straight_lines(mission, found) == pytest.approx(assign(mission).cost, abs=1e-6)
    done = certified_team(made)
    assert all(claim.outcome == "holds" for claim in done.certificate.claims)
    assert sampled_word(mission, done.team["quad0"]) == done.plan.words["quad0"]
    assert holds_when_sampled(mission, done.team)
    assert not any("exact search's" in note for note in made.notes)


TEAMS = [
    (PAIR, "F c & F d & F (a & !b)", [(0.2, 0.0, 1.2), (-0.8, 1.0, 1.2)]),
    (PAIR, "F c & F d & G !(c & d)", [(0.2, 0.0, 1.2), (-2.2, 0.4, 1.2)]),
    (NEST, "F c & F d", [(0.35, 0.0, 1.2), (-0.5, 0.0, 1.2)]),
    (NEST, "F desk & F c & F d", [(-0.5, 0.0, 1.2), (2.6, 0.5, 1.2)]),
    (THREE, "F c & F d", [(0.25, 0.2, 1.2), (-1.4, -0.8, 1.2)]),
]


@few_of(
    2, ("regions", "formula", "starts", "team"), [*((*one, "own") for one in TEAMS), *((*TEAMS[k], "joint") for k in (2, 3, 4))]
)
def test_a_team_s_words_hold_in_every_order_at_no_less_than_the_exact_cost(regions, formula, starts, team):
    mission = overlapping(formula, *starts, regions=regions, method="mtac-e", team=team)
    exact = assign(mission)
    found = share_tasks(mission, rng=rng(), options=QUICK)
    assert exact.complete
    assert found is not None
    assert exact.cost - 1e-6 <= by_straight_lines(mission, found) <= 1.05 * exact.cost
    words = {name: path.plan.word for name, path in found.paths.items()}
    assert check_team(mission.formula, words, team=team).sequential


@pytest.mark.slow
@pytest.mark.parametrize(("regions", "formula", "starts"), TEAMS)
@pytest.mark.parametrize("method", ["mtac-e", "online-mtac-e"])
def test_a_team_s_plan_is_refined_and_certified(regions, formula, starts, method, pace):
    mission = overlapping(formula, *starts, regions=regions, method=method)
    done = certified_team(plan(mission, seed=1, pace=pace))
    assert all(claim.outcome == "holds" for claim in done.certificate.claims)
    assert all(sampled_word(mission, done.team[name]) == done.plan.words[name] for name in mission.agents)
    assert holds_when_sampled(mission, done.team)


@few_of(1, "case", ALL)
def test_online_mtac_e_plans_them_too(case, pace):
    mission = mission_of(case, "online-mtac-e")
    made = plan(mission, seed=1, pace=pace)
    assert not any("exact search's" in note for note in made.notes)
    done = certified_team(made)
    assert all(claim.outcome == "holds" for claim in done.certificate.claims)
    assert sampled_word(mission, done.team["quad0"]) == done.plan.words["quad0"]
    assert holds_when_sampled(mission, done.team)


def test_an_action_of_the_outer_region_is_made_in_the_middle_of_the_inner_one():
    mission = overlapping("F c & G(c -> load)", (0.35, 0.0, 1.2), regions=NEST, method="mtac-e", extra=FULL)
    found = share_tasks(mission, rng=rng(), options=QUICK).paths["quad0"].plan
    assert str(found.word) == "{desk, room} {desk, load, room} {load, room} {load} {c, load}"
    assert [(visit.region, len(visit.actions)) for visit in found.visits] == [("desk", 0), ("room", 1), ("c", 0)]
    assert assign(mission).robots["quad0"].word == found.word


def test_what_the_exact_search_cannot_fly_mtac_e_cannot_either():
    mission = overlapping("F (desk & !room)", (0.35, 0.0, 1.2), regions=NEST, method="mtac-e")
    with pytest.raises(Unsatisfiable):
        plan(mission)


@pytest.mark.parametrize("method", ["mtac-e", "online-mtac-e"])
def test_an_infinite_trace_is_refused_before_anything_is_planned(method):
    given = mission_of("in the outer one", method)
    endless = given.model_copy(update={"spec": given.spec.model_copy(update={"trace": "infinite"})})
    with pytest.raises(BadInput, match="laps for ever are planned"):
        plan(endless)


@pytest.mark.parametrize("case", CASES)
def test_moves_are_ways_of_the_exact_search_s_system(case):
    mission = mission_of(case)
    world = World(mission)
    system = Systems(mission).of("quad0")
    # every word of two visits is a word of A
    for first in world.moves(world.start("quad0"), first=True):
        for second in world.moves(first.end):
            task = RobotTask(world.start("quad0"), (first, second), leaves=second.left is not None)
            word = (world.letter(task.where), *task.ahead)
            at = {system.initial}
            assert system.labels[system.initial] == word[0]
            for letter in word[1:]:
                at = {target for node in at for target, _ in system.edges[node] if system.labels[target] == letter}
                assert at, (case, word)


def test_the_letters_of_the_decomposition_set_are_all_that_can_be_planned():
    for regions, start in ((PAIR, (0.2, 0.0, 1.2)), (NEST, (0.35, 0.0, 1.2)), (THREE, (0.25, 0.2, 1.2))):
        mission = overlapping("F c", start, regions=regions)
        shown = set(Reader(World(mission)).shown)
        assert set(Systems(mission).of("quad0").labels) <= shown


@pytest.mark.parametrize(
    ("edges", "visits"),
    [("[a, b], [b, a], [a, c], [b, c]", ["a", "b", "c"]), ("[b, c], [c, a]", None), ("[a, c], [c, b]", None)],
)
def test_a_start_in_two_regions_goes_on_where_it_may_from_each(edges, visits, pace):
    world = f"environment: {{start: home, directed: true, edges: [{edges}]}}"
    mission = overlapping("F c & G(c -> !a)", (0.2, 0.0, 1.2), method="mtac-e", extra=world)
    if visits is None:
        with pytest.raises(Unsatisfiable):
            assign(mission)
        return
    assert [visit.region for visit in assign(mission).robots["quad0"].visits] == visits
    done = certified_team(plan(mission, seed=1, pace=pace))
    assert all(claim.outcome == "holds" for claim in done.certificate.claims)
