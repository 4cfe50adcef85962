import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ltlplan import translate
from ltlplan.missions import load_mission
from ltlplan.paths.costs import Sampling
from ltlplan.paths.hoops import route, route_sequence
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from ltlplan.paths.sampling.path_problem import word_filter
from tests.helpers.few import few_of
from tests.helpers.missions.courses import courses
from tests.helpers.words.sampled_labels import label, run
from verify.data import Visit, Word, parse_mission


def paths_near(plan, seed, count, spread):
    rng = np.random.default_rng(seed)
    points = np.array([w.position for w in plan.waypoints])
    moved = points + spread * rng.standard_normal((count, *points.shape))
    moved[:, 0], moved[:, -1] = points[0], points[-1]
    return Sampling(LeastSnapSpline(plan.times, plan.cycle_waypoint), 300).paths(moved).axes(0)


@pytest.fixture(scope="module")
def sequence():
    mission = load_mission("hoops-sequence")
    return mission, route_sequence(mission)


@given(st.integers(0, 1000), st.floats(-0.05, 0.1))
@settings(max_examples=10, deadline=None)
def test_labels_are_those_of_each_point(seed, grow):
    mission = load_mission("hoops-sequence")
    positions = np.random.default_rng(seed).uniform(-1.2, 1.2, (7, 3, 11)) + np.array([0, 0, 1.0])[:, None]
    found = label(mission, positions, grow=grow)
    for i in range(7):
        for k in range(11):
            expected = {n for n, r in mission.all_regions.items() if r.level(positions[i, :, k]) <= (1 + grow / 0.2) ** 2}
            assert found.letter(int(found.codes[i, k])) == expected


def test_runs_are_those_of_the_automaton_step_by_step(sequence):
    mission, plan = sequence
    automaton = translate("F hoop1 & (!hoop2 U hoop0)", trace="finite")
    positions = paths_near(plan, 1, 40, 0.3)
    labels = label(mission, positions)
    accepted = run(automaton, labels)
    expected = []
    for k in range(40):
        state = automaton.initial
        for code in labels.codes[:, k]:
            state = None if state is None else automaton.successor(state, labels.letter(int(code)))
        expected.append(state in automaton.accepting)
    assert accepted.tolist() == expected
    assert 0 < sum(expected) < 40


def brute(mission, plan, path):
    """Word, passages, rings and walls of one densely sampled path, one sample after the other."""
    near, radius = mission.margin, mission.vehicle.radius
    low, high = np.array(mission.workspace.min) + near, np.array(mission.workspace.max) - near
    if np.any(path < low) or np.any(path > high):
        return False
    words = []
    for sign in (-1, 1):
        word = []
        for point in path:
            letter = frozenset(
                (n, bool((point - np.array(h.center)) @ np.array(h.normal) > 0))
                for n, h in mission.hoops.items()
                if h.level(point) <= (1 + sign * near / min(h.radii)) ** 2
            )
            if not word or word[-1] != letter:
                word.append(letter)
        words.append(word)
    wanted = [frozenset()]
    for visit in plan.visits:
        halves = (False, True) if visit.direction == "F" else (True, False)
        wanted += [frozenset({(visit.region, half)}) for half in halves] + [frozenset()]
    if words[0] != wanted or words[1] != wanted:
        return False
    visited = {visit.region for visit in plan.visits}
    for name, hoop in mission.hoops.items():
        offset = path - np.array(hoop.center)
        along = offset @ np.array(hoop.normal)
        across = np.sqrt(np.maximum(np.sum(offset**2, axis=1) - along**2, 0))
        close = np.abs(along) <= hoop.rim / 2 + radius + near
        outer = across <= hoop.opening + hoop.rim + radius + near
        inner = across >= hoop.opening - radius - near if name in visited else True
        if np.any(close & outer & inner):
            return False
    return True


@few_of(1, "seed", range(3))
def test_the_filter_agrees_with_a_plain_loop_over_the_samples(seed):
    mission, plan = courses(seed=30 + seed, count=1)[0]
    positions = paths_near(plan, seed, 30, 0.04)
    kept = word_filter(mission, plan).keeps(positions)
    assert kept.tolist() == [brute(mission, plan, positions[:, :, k]) for k in range(30)]
    assert 0 < kept.sum() < 30


def test_the_nominal_path_is_kept_and_its_reverse_is_not(sequence):
    mission, plan = sequence
    keeps = word_filter(mission, plan)
    positions = paths_near(plan, 0, 1, 0.0)
    assert keeps.keeps(positions).tolist() == [True]
    assert keeps.keeps(positions[::-1]).tolist() == [False]


def test_a_passage_on_the_wrong_side_is_not_kept(sequence):
    mission, plan = sequence
    visits = [v.model_copy(update={"direction": "F"}) for v in plan.visits]
    other = plan.model_copy(update={"visits": tuple(visits)})
    assert word_filter(mission, other).keeps(paths_near(plan, 0, 1, 0.0)).tolist() == [False]


def test_internal_letters_do_not_change_what_is_kept():
    mission = load_mission("firefighting")
    plan = route(mission, "quad0", [Visit(region="water", actions=mission.robot.actions), Visit(region="smoke")])
    keeps = word_filter(mission, plan)
    assert keeps.keeps(paths_near(plan, 0, 1, 0.0)).tolist() == [True]
    assert set(keeps.weights) == {"water", "smoke"}


def test_a_lap_of_a_lasso_is_kept():
    mission = load_mission("hoops-published")
    plan = route_sequence(mission)
    assert word_filter(mission, plan).keeps(paths_near(plan, 0, 1, 0.0)).tolist() == [True]


def many_regions(count):
    text = "format: 1\nname: many\nspec: {formula: 'true'}\nvehicle: crazyflie-2.1\n"
    text += "workspace: {min: [-2, -2, 0.2], max: [60, 2, 2]}\nagents: {quad0: {start: [-1, 0, 1]}}\nregions:\n"
    text += "".join(f"  r{i}: {{center: [{i}, 0, 1], radii: [0.2, 0.2, 0.2]}}\n" for i in range(count))
    return parse_mission(text)


@pytest.mark.parametrize("count", [15, 45])
def test_long_words_over_many_regions_are_told_apart(count):
    mission = many_regions(count)
    plan = route(mission, "quad0", [Visit(region=f"r{i}") for i in range(count)])
    keeps = word_filter(mission, plan)
    points = np.array([w.position for w in plan.waypoints])
    sampling = Sampling(LeastSnapSpline(plan.times), 40 * count)
    swapped = plan.model_copy(update={"word": Word(plan.word.prefix[:1] + plan.word.prefix[3:])})
    assert keeps.keeps(sampling.paths(points).axes(0)).tolist() == [True]
    assert word_filter(mission, swapped).keeps(sampling.paths(points).axes(0)).tolist() == [False]
