"""Searches that are watched: what they tell is proved, and one that is asked to end has the best plan so far."""

from __future__ import annotations

import gc
import itertools
import weakref
from collections.abc import Callable

import numpy as np
import pytest

from ltlplan.allocation import Context, Known
from ltlplan.logic.budget import EVERY, Budget, StoppedEarly, TooLarge, watched
from ltlplan.planner import make_plan
from ltlplan.search.exact import assign, exact
from tests.helpers.few import few_of
from tests.helpers.missions.worlds import world
from verify import check_team

CHAINS = "F(a & F(b & F c)) & F(c & F(a & F d)) & F(d & F(b & F a)) & F(b & F(d & F c))"


def after(looks: int) -> Callable[[], bool]:
    """Return what asks a search to end at its look of this number."""
    count = itertools.count(1)
    return lambda: next(count) >= looks


@few_of(1, ("team", "objective"), [("own", "sum"), ("joint", "sum"), ("own", "longest")])
def test_a_search_that_is_asked_to_end_has_a_plan_and_a_proved_bound(team: str, objective: str) -> None:
    mission = world(CHAINS, robots=3, team=team)
    mission = mission.changed(planner=mission.planner.model_copy(update={"objective": objective}))
    best = assign(mission)
    with watched(after(2)) as watch:
        found = assign(mission, budget=Budget(watch=watch))
    assert watch.states == 2 * EVERY
    words = {name: robot.word for name, robot in found.robots.items()}
    assert check_team(mission.formula, words, team=mission.spec.team).sequential
    assert not found.complete
    assert found.lower_bound is not None
    assert found.lower_bound <= best.cost + 1e-6
    assert best.cost <= found.cost + 1e-6


def test_a_search_that_nobody_ends_has_the_answer_of_one_that_nobody_watches() -> None:
    mission = world(CHAINS, robots=3, team="joint")
    with watched(lambda: False) as watch:
        found = assign(mission, budget=Budget(watch=watch))
    assert watch.states is None
    assert found == assign(mission)


def test_bounds_that_are_told_hold_and_grow() -> None:
    mission, told = world(CHAINS, robots=3, team="joint"), list[str]()
    best = exact(mission, Context(np.random.default_rng(0), lambda sentence, _share: told.append(sentence)))
    bounds = [float(sentence.rpartition(" ")[2].rstrip(".")) for sentence in told if "no words cost less" in sentence]
    assert bounds == sorted(bounds)
    assert bounds
    assert bounds[-1] <= best.cost + 1e-3


def test_bounds_of_other_questions_are_not_told() -> None:
    """Such as of parts of the team, and of formulas without some of their parts."""
    told: list[tuple[int, float]] = []
    with watched(after(1)) as watch:
        found = assign(world(CHAINS, robots=3), budget=Budget(watch=watch, report=lambda *known: told.append(known)))
    ((states, bound),) = told
    assert states == EVERY
    assert 0.0 < bound <= found.cost


def test_the_plan_says_that_its_search_was_stopped() -> None:
    mission = world(CHAINS, robots=3)
    with watched(after(1)) as watch:
        plan = make_plan(mission, method="exact", seed=1, known=Known(budget=Budget(watch=watch)))
    assert plan.notes[0] == f"The search was stopped on request after {EVERY} states; a cheaper plan may exist."
    assert not plan.complete
    assert not any("stopped" in note for note in make_plan(mission, method="exact", seed=1).notes)


def test_a_search_that_is_ended_before_any_plan_says_so() -> None:
    def ended_without_a_plan() -> None:
        with watched(after(1)) as watch:
            assert watch.ends(EVERY)
            raise TooLarge("The search needs", EVERY, "states", EVERY - 1)

    with pytest.raises(StoppedEarly, match="after 256 states, before any plan was found"):
        ended_without_a_plan()
    with pytest.raises(TooLarge, match="more than 5 states"), watched(lambda: False) as watch:
        assign(world(CHAINS, robots=1), budget=Budget(states=5, watch=watch))


def test_what_is_kept_for_later_searches_keeps_no_watch() -> None:
    with watched(lambda: False) as watch:
        seen = weakref.ref(watch)
        assign(world("F(kept & F b)", robots=1, regions={"kept": (1.0, 0.0), "b": (2.0, 0.0)}), budget=Budget(watch=watch))
        del watch
    gc.collect()
    assert seen() is None
