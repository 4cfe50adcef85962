"""Plans with counts: held against all orders of their stages, and against all short courses of a small team."""

from __future__ import annotations

import heapq
import itertools
import math
from functools import cache
from random import Random

import numpy as np
import pytest

from ltlplan import parse_mission, plan
from ltlplan.logic.budget import Budget
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.logic.translation import translate
from ltlplan.missions import shipped_mission_text
from ltlplan.online_mtac.online_team import OnlineTeam
from ltlplan.pipeline import certified_team
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.counting.planning import plan_counts
from ltlplan.search.exact import assign
from ltlplan.search.explanations.unsatisfiable_cores import NoPlan
from ltlplan.systems.robot_systems import Systems
from refine.coordination.meeting_orders import one_at_a_time
from tests.helpers.few import few_of
from tests.helpers.missions import apart_missions
from tests.helpers.missions.counted_halls import gathering
from tests.helpers.missions.worlds import world
from tests.helpers.words.plain_team_words import at_once, holds
from tests.helpers.words.random_counts import random_counting_formula
from verify import check_team
from verify.data import BadInput, Infeasible, parse_formula
from verify.data.language.counting import atoms, written_out
from verify.data.plan import plan_from_json
from verify.data.validation.faults import MissionError

PLACES = {"a": (0.0, 0.0), "b": (2.0, 0.0)}
NAMES = ("quad0", "quad1")


@cache
def systems():
    mission = world("F(count(a) >= 2)", robots=2, regions=PLACES, team="joint")
    made = Systems(mission)
    return mission, tuple(made.of(name) for name in mission.agents)


def planned(formula):
    mission, each = systems()
    asked = written_out(formula, NAMES)
    kinds = [mission.alike_as(name) for name in NAMES]
    return plan_counts(each, kinds, Marks(conjunct_automata(asked, "finite"), atoms(asked)), Budget(states=4_000))


def team_words(found):
    """Yield the team's words: all orders within a stage, one stage after another."""
    _, each = systems()
    at = {name: each[i].labels[found.paths[i][0]] for i, name in enumerate(NAMES)}
    pieces = []
    for stage in found.stages:
        words = {name: [letter] for name, letter in at.items()}
        for turn in stage:
            robot, before, after = found.turns[turn]
            words[NAMES[robot]] += [each[robot].labels[node] for node in found.paths[robot][before:after]]
        pieces.append(list(itertools.islice(at_once({n: [k for k, _ in itertools.groupby(w)] for n, w in words.items()}), 60)))
        at = {name: word[-1] for name, word in words.items()}
    for chosen in itertools.islice(itertools.product(*pieces), 60):
        yield [at for piece in chosen for at in piece] or [at]


def short_courses():
    """Yield words of courses of up to three moves of one robot after another, each to a or b through free flight."""
    for count in range(4):
        for moves in itertools.product(itertools.product(NAMES, "ab"), repeat=count):
            at = dict.fromkeys(NAMES, frozenset())
            word = [dict(at)]
            for name, place in moves:
                if at[name]:
                    at[name] = frozenset()
                    word.append(dict(at))
                at[name] = frozenset({place})
                word.append(dict(at))
            yield word


COURSES = list(short_courses())


def check_against_brute_force(rng: Random) -> bool:
    formula = random_counting_formula(rng, rng.randint(1, 6), NAMES)
    found = planned(formula)
    if found is None:
        assert not any(holds(formula, word) for word in COURSES), str(formula)
        return False
    for word in team_words(found):
        assert holds(formula, word), (str(formula), word)
    return True


def test_plans_keep_their_formulas_and_are_found_where_there_are_some():
    rng = Random(5)
    found = [check_against_brute_force(rng) for _ in range(30)]
    assert any(found)
    assert not all(found)


@pytest.mark.slow
def test_many_plans_keep_their_formulas():
    rng = Random(6)
    for _ in range(1500):
        check_against_brute_force(rng)


def least_cost(formula):
    """Return what courses cost at the least in which one robot flies at a time, step by step and without any bound; None where there is none.

    A robot rests in regions and at its start, and may stay for good anywhere else where flights may end.
    """
    _, each = systems()
    asked = written_out(formula, NAMES)
    marks = Marks(conjunct_automata(asked, "finite"), atoms(asked))

    def sums(at):
        own = [marks.of(system.robot, system.labels[node]) for system, node in zip(each, at, strict=True)]
        return tuple(map(sum, zip(*own, strict=True)))

    def rests(robot, node):
        return node == each[robot].initial or bool(each[robot].nodes[node].regions)

    begin = tuple(system.initial for system in each)
    first = marks.read(marks.initial, sums(begin))
    heap = [] if first is None else [(0.0, first, begin, (False,) * len(each))]
    seen = set()
    while heap:
        cost, states, at, gone = heapq.heappop(heap)
        if (states, at, gone) in seen:
            continue
        seen.add((states, at, gone))
        if marks.accepting(states) and all(node in system.final for system, node in zip(each, at, strict=True)):
            return cost
        for robot, system in enumerate(each):
            others = [o for o in range(len(each)) if o != robot and not gone[o] and not rests(o, at[o])]
            if gone[robot] or any(at[o] not in each[o].final for o in others):
                continue
            left = tuple(was or o in others for o, was in enumerate(gone))
            for node, step in system.edges[at[robot]]:
                to = (*at[:robot], node, *at[robot + 1 :])
                after = marks.read(states, sums(to))
                if after is not None:
                    heapq.heappush(heap, (cost + step, after, to, left))
    return None


def check_costs(rng: Random) -> bool:
    formula = random_counting_formula(rng, rng.randint(1, 6), NAMES)
    found, least = planned(formula), least_cost(formula)
    assert (found is None) == (least is None), str(formula)
    if found is None or least is None:
        return False
    assert found.bound <= least + 1e-6, str(formula)
    assert least <= found.cost + 1e-6, str(formula)
    return found.cost > 0.0 and found.cost <= found.bound + 1e-6


def test_no_course_is_cheaper_than_a_plan_that_is_said_to_be_cheapest():
    rng = Random(15)
    assert sum(check_costs(rng) for _ in range(30)) > 5


@pytest.mark.slow
def test_no_course_is_cheaper_than_many_plans():
    rng = Random(16)
    assert sum(check_costs(rng) for _ in range(4_000)) > 500


def test_the_earlier_ones_wait_until_all_have_come():
    found = planned(parse_formula("F(count(a) >= 2) & F(count(b) >= 2)"))
    assert [len(stage) for stage in found.stages] == [2, 2]
    assert len(planned(parse_formula("F(count(a) >= 2)")).stages) == 1


def test_with_counts_too_the_dearest_robot_may_be_what_counts():
    formula, places = "F some(a) & F some(b) & F some(c)", {"a": (0.0, 0.0), "b": (2.0, 0.0), "c": (0.0, 2.5)}
    starts = ((-1.0, 0.3), (-4.5, 2.5))
    by_sum, longest = (
        assign(world(formula, robots=2, regions=places, starts=starts, team="joint", objective=what))
        for what in ("sum", "longest")
    )
    assert by_sum.robots["quad1"].cost == 0.0
    assert longest.complete
    assert longest.cost == max(robot.cost for robot in longest.robots.values()) == pytest.approx(4.5)
    words = {name: robot.word for name, robot in longest.robots.items()}
    assert check_team(written_out(parse_formula(formula), NAMES), words, team="joint").sequential


def test_where_nobody_has_anything_to_fly_for_the_dearest_robot_costs_nothing():
    found = assign(world("F(count(a) >= 1) | true", robots=2, regions=PLACES, team="joint", objective="longest"))
    assert found.complete
    assert found.cost == 0.0


def test_counts_beyond_the_team_cannot_be_kept_and_are_said_to_be():
    with pytest.raises(NoPlan, match=r"`count\(a\) >= 3` asks for more robots than the mission has: 2"):
        assign(world("F(count(a) >= 3) & F b", robots=2, regions=PLACES, team="joint"))
    roomy = dict.fromkeys(PLACES, 0.4)
    with pytest.raises(NoPlan) as error:
        assign(world("F b & F(count(a) >= 2) & G(count(!a) >= 1)", robots=2, regions=PLACES, radii=roomy, team="joint"))
    assert set(error.value.core) == {"F count(a) >= 2", "G count(!a) >= 1"}


def test_counts_are_refused_where_letters_are_robots_own():
    with pytest.raises(MissionError, match="under `team: own` each letter is one robot's by itself"):
        world("F(count(a) >= 2)", robots=2)
    mission = world("F(count(a) >= 2)", robots=2, regions=PLACES, team="joint")
    with pytest.raises(BadInput, match="which `online-mtac-e` does not plan"):
        plan(mission, method="online-mtac-e")
    assert assign(world("F(count(a) >= 1) & all(free)", regions=PLACES, team="joint")).robots["quad0"].visits


MEETING = """
format: 1
name: meeting
spec: {formula: "FORMULA", team: joint}
regions:
  dock: {center: [0.0, 0.0, 1.0], radii: [0.8, 0.8, 0.5]}
  home: {center: [0.0, 1.9, 1.0], radii: [0.8, 0.5, 0.5]}
agents:
  quad0: {start: [-1.1, -1.6, 1.0]}
  quad1: {start: [0.0, -1.6, 1.0]}
vehicle: crazyflie-2.1
limits: {speed: 1.0}
workspace: {min: [-2.2, -2.4, 0.2], max: [2.2, 3.0, 1.9]}
"""


def test_a_meeting_is_planned_flown_and_certified(pace):
    made = plan(parse_mission(MEETING.replace("FORMULA", "F(count(dock) >= 2)")), pace=pace)
    assert not made.meetings
    done = certified_team(made)
    assert all(claim.outcome == "holds" for claim in done.certificate.claims)


@few_of(1, "robots", [12, 30])
@pytest.mark.slow
def test_of_many_robots_those_that_gather_wait_for_each_other_only(robots: int) -> None:
    made = plan(gathering(robots, "nominal"))
    crowd = [name for name, robot in made.robots.items() if robot.visits[0].region == "a"]
    two = [name for name, robot in made.robots.items() if robot.visits[0].region == "b"]
    assert (len(crowd), len(two)) == (robots // 2, 2)
    waits = {(meeting.first, meeting.then) for meeting in made.meetings}
    assert waits == {((a, 0), (b, 1)) for group in (crowd, two) for a in group for b in group if a != b}


@pytest.mark.slow
def test_whoever_comes_first_waits_in_flight():
    made = plan(parse_mission(MEETING.replace("FORMULA", "F(count(dock) >= 2) & F all(home)")))
    assert {(meeting.first[0], meeting.then[0]) for meeting in made.meetings} == {("quad0", "quad1"), ("quad1", "quad0")}
    assert plan_from_json(made.to_json(), made.mission) == made
    assert len(one_at_a_time(made)) > len(made.meetings)
    done = certified_team(made)
    assert all(claim.outcome == "holds" for claim in done.certificate.claims)


@pytest.mark.slow
def test_fire_fighting_has_no_trap_for_robots_that_idle():
    text = shipped_mission_text("firefighting").replace("team: own", "team: joint")
    mission = parse_mission(text.replace("G(smoke -> carrying)", "G all(smoke -> carrying)"))
    done = certified_team(plan(mission))
    assert all(claim.outcome == "holds" for claim in done.certificate.claims)
    assert any(not robot.visits for robot in done.plan.robots.values())


@pytest.mark.slow
def test_four_robots_meet_and_go_home():
    more = "  quad2: {start: [1.1, -1.6, 1.0]}\n  quad3: {start: [-1.6, -0.8, 1.0]}\nvehicle:"
    text = MEETING.replace("FORMULA", "F(count(dock) >= 4) & F all(home)").replace("vehicle:", more)
    done = certified_team(plan(parse_mission(text)))
    assert all(claim.outcome == "holds" for claim in done.certificate.claims)


def test_what_shares_tasks_in_flight_refuses_counts():
    mission = parse_mission(MEETING.replace("FORMULA", "F(count(dock) >= 2)"))
    with pytest.raises(BadInput, match="ltlplan online MISSION --certified"):
        OnlineTeam(mission, rng=np.random.default_rng(0))
    with pytest.raises(BadInput, match="depends on how many robots there are"):
        translate("F all(a)")
    assert translate("F(count(a) >= 2) & F quad0.a").propositions == ("count(a) >= 2", "quad0.a")


def test_a_region_that_cannot_hold_so_many_gets_that_reason(pace):
    meeting = MEETING.replace("FORMULA", "F(count(dock) >= 2)")
    says = r"`count\(dock\) >= 2` asks for 2 robots in 'dock' \(room for 1\): their centres are 0.4 m apart .* at least 1.67 times that"
    with pytest.raises(NoPlan, match=says):
        plan(parse_mission(meeting.replace("radii: [0.8, 0.8, 0.5]", "radii: [0.15, 0.15, 0.15]")))
    tight = plan(
        parse_mission(meeting.replace("radii: [0.8, 0.8, 0.5]", "radii: [0.25, 0.25, 0.25]")), pace=pace
    )  # to the millimetre
    with pytest.raises(Infeasible, match=r"'dock' is too small: 2 robots are to be in it together \(quad0, quad1\)"):
        certified_team(tight)


def test_all_of_a_team_in_a_region_for_fewer_gets_that_reason():
    with pytest.raises(NoPlan, match=r"`F all\(a\)` cannot hold. `count\(a\) >= 2` asks for 2 robots in 'a' \(room for 1\)"):
        assign(world("F b & F all(a)", robots=2, regions=PLACES, team="joint"))
    with pytest.raises(NoPlan, match=r"asks for 3 robots in 'a' \(room for 1\) or 'b' \(room for 1\).*Make one of them larger"):
        assign(world("F(count(a | b) >= 3)", robots=3, regions=PLACES, team="joint"))
    with pytest.raises(NoPlan) as error:
        assign(world("F(count(a) == 2 & F(count(b) == 1))", robots=3, regions=PLACES, team="joint"))
    assert "2 robots in 'a' (room for 1)" in str(error.value)
    assert "'b'" not in str(error.value), "one robot has room there"
    with pytest.raises(NoPlan) as error:  # one robot is in no more than one place, however large
        assign(world("F(all(a & b))", robots=2, regions=PLACES, team="joint"))
    assert "room for" not in str(error.value)


def test_robots_spread_over_regions_that_are_too_small_for_all():
    found = assign(world("F(count(a | b) >= 2)", robots=2, regions=PLACES, team="joint"))
    assert {visit.region for robot in found.robots.values() for visit in robot.visits} == {"a", "b"}
    one_by_one = assign(world("each(F a)", robots=2, regions=PLACES, team="joint"))
    ends = [robot.word.letters[-1] for robot in one_by_one.robots.values()]
    assert ends.count(frozenset({"a"})) < 2, "both would hover there at the end"


def test_robots_change_places_in_rooms_for_one():
    starts = ((0.0, 0.0), (2.0, 0.0))
    found = assign(world("F(quad0.b & quad1.a)", robots=2, regions=PLACES, starts=starts, team="joint"))
    assert [[visit.region for visit in robot.visits] for robot in found.robots.values()] == [["a", "b"], ["b", "a"]]


@pytest.mark.parametrize("method", ["exact", "mtac-e"])
def test_robots_that_cost_differently_are_told_apart_wherever_they_are(method):
    mission = world(
        "F(count(a) >= 1 & F(count(b) >= 1))", robots=2, regions=PLACES, starts=((-1.0, 0.0), (-1.5, 0.0)), team="joint"
    )
    agents = {
        name: agent.model_copy(update={"cost": {"length": weight}})
        for (name, agent), weight in zip(mission.agents.items(), (10.0, 1.0), strict=True)
    }
    made = plan(mission.model_copy(update={"agents": agents}), method=method)
    assert [[visit.region for visit in robot.visits] for robot in made.robots.values()] == [[], ["a", "b"]]
    assert made.lower_bound == pytest.approx(3.5 - 2 * 0.3, abs=1e-5)  # from edge to edge of regions, where paths may turn


@pytest.mark.parametrize("method", ["exact", "mtac-e"])
def test_who_flies_far_to_a_small_region_is_planned_to_fly_there_straight(method):
    mission = world("F(count(b) >= 1)", robots=2, regions=PLACES, starts=((-2.0, 0.5), (-4.0, 0.0)), team="joint")
    made = plan(mission, method=method)
    assert made.cost == pytest.approx(math.hypot(4.0, 0.5), rel=0.03)
    assert made.cost >= made.lower_bound - 1e-6


@pytest.mark.slow
def test_two_that_met_meet_again_elsewhere():
    more = "  quad2: {start: [1.1, -1.6, 1.0]}\nvehicle:"
    text = MEETING.replace("FORMULA", "F(count(dock) >= 2) & F(count(home) >= 2)").replace("vehicle:", more)
    done = certified_team(plan(parse_mission(text)))
    assert all(claim.outcome == "holds" for claim in done.certificate.claims)


def show(robots: int, more: str = ""):
    """Return a light show: each robot flies to a place of its own and home, and `more`."""
    own = " & ".join(f"F(quad{i}.c{i} & F quad{i}.h{i})" for i in range(robots))
    regions = {f"{name}{i}": (2.0 * i, y) for name, y in (("c", 6.0), ("h", 0.0)) for i in range(robots)}
    return world(
        f"{own}{more}", robots=robots, regions=regions, starts=tuple((2.0 * i, 0.0) for i in range(robots)), team="joint"
    )


def test_what_robots_are_asked_for_by_name_is_added_up_over_robots():
    found = assign(show(8))
    assert found.cost == pytest.approx(8 * 12.0)
    assert found.complete
    assert found.lower_bound == pytest.approx(found.cost)
    assert not found.meetings
    assert not found.precedences
    reached = int(found.notes[0].split()[3].replace(",", ""))
    assert reached < 4_000  # a robot after another, not in all orders


def test_what_anybody_may_do_is_done_by_whom_it_costs_least_beyond_what_is_asked_by_name():
    alone = assign(show(4)).cost
    found = assign(show(4, " & F(count(c2) >= 1) & F c3 & F(quad0.h0 & quad1.c1)"))
    assert found.cost == pytest.approx(alone)
    assert found.complete


def test_robots_wait_for_nobody_because_of_small_regions_that_no_two_come_to():
    (wait,) = assign(apart_missions.show(4, " & G !(quad0.c0 & quad1.c1)")).meetings
    assert {wait.first[0], wait.then[0]} == {"quad0", "quad1"}
