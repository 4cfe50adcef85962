"""Candidates: what their cuts say of the way so far, and that a stored candidate goes on as the one that was stored."""

from __future__ import annotations

from functools import cache

import ltlplan
from ltlplan.replanning.cuts import MAX_ROUNDS, Candidate, Cut, CutKind, digest
from ltlplan.service.execution.serialization import from_bytes, to_bytes
from tests.helpers.missions.worlds import world
from verify.data import Plan, Witness

FORMULA, LIMIT = (Witness(claim=claim, sentence=claim, robot="quad0") for claim in ("formula", "limits.speed"))


@cache
def made() -> Plan:
    plain = world("F(a & F b)", robots=2, team="own")
    return ltlplan.plan(plain.changed(spec={**plain.spec.model_dump(), "soft": [{"formula": "F a"}, {"formula": "F b"}]}))


def after(*cuts: Cut) -> Candidate:
    plan = made()
    return Candidate(plan, cuts, rounds=cuts[-1].rounds if cuts else 0)


def test_other_words_begin_without_the_counterexamples_to_the_first_ones() -> None:
    waits = Cut("waits", "It fails.", 1, witnesses=(FORMULA, LIMIT))
    assert after(waits).witnesses == (FORMULA, LIMIT)
    assert after(waits, Cut("order", "It fails.", 2)).witnesses == (LIMIT,)
    others: tuple[CutKind, ...] = ("precedences", "words", "legs", "capacity", "soft part")
    for kind in others:
        assert after(waits, Cut(kind, "It fails.", 2)).witnesses == ()
        assert after(waits, Cut(kind, "It fails.", 2), waits).witnesses == (FORMULA, LIMIT)


def test_what_was_forbidden_is_forbidden_until_a_soft_part_is_given_up() -> None:
    leg = ("quad0", "a", "b")
    shut = Cut("legs", "They meet.", 1, anew=True, legs=frozenset({leg}))
    full = Cut("capacity", "It is full.", 2, anew=True, capacity=("a", 1))
    found = after(shut, full)
    assert (found.legs, found.capacities, found.others) == (frozenset({leg}), {"a": 1}, 2)
    less = after(shut, full, Cut("soft part", "None.", 3, anew=True, parts=(0, 1)))
    assert (less.legs, less.capacities, less.others) == (frozenset(), {}, 0)


def test_words_that_are_one_choice_of_several_have_fewer_rounds() -> None:
    assert after().last_round == MAX_ROUNDS
    assert after(Cut("waits", "It fails.", 3)).last_round == MAX_ROUNDS
    assert after(Cut("words", "It fails.", 3, anew=True)).last_round == 3 + MAX_ROUNDS
    assert after(Cut("legs", "It fails.", 3, anew=True)).last_round < 3 + MAX_ROUNDS
    lost = Cut("soft part", "It fails.", 3, anew=True, parts=(0, 1))
    assert after(lost).last_round < after(lost, lost, lost).last_round  # nothing more can be given up behind the third


def test_a_cut_says_what_it_forbids_and_why_and_whether_that_is_proved() -> None:
    leg = Cut("legs", "They come too near.", 1, legs=frozenset({("quad1", "a", "b")}))
    assert leg.sentence == "Given up: words along these legs: quad1 to b. They come too near."
    full = Cut("capacity", "Three do not fit.", 1, capacity=("base", 2), proved=True)
    assert full.sentence == "Proved impossible: more than 2 robots in 'base'. Three do not fit."


def test_a_stored_candidate_is_the_one_that_was_stored() -> None:
    cuts = (
        Cut("waits", "It fails.", 1, witnesses=(FORMULA,)),
        Cut("legs", "They meet.", 2, anew=True, legs=frozenset({("quad0", (0.0, 0.0, 1.0), "a")}), plan=digest(made())),
        Cut("capacity", "It is full.", 3, anew=True, capacity=("a", 1)),
    )
    candidate = after(*cuts)
    assert from_bytes(to_bytes(candidate)) == candidate
