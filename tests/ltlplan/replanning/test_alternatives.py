"""The stream of candidates: the same refusals give the same candidates, and each is another than the one before."""

from __future__ import annotations

import ltlplan
from ltlplan.replanning.alternatives import candidates
from ltlplan.replanning.cuts import Candidate, Conflict, Flight, digest
from ltlplan.service.execution.serialization import from_bytes, to_bytes
from tests.helpers.missions.worlds import world
from verify.data import Infeasible, Witness

MET = Conflict(Infeasible("They meet.", Witness(claim="separation", sentence="They meet.", robot="quad0", other="quad1")))


def test_the_same_refusals_give_the_same_candidates_also_from_a_stored_one() -> None:
    first = Candidate(ltlplan.plan(world("F(a & F b)", robots=2, team="own")))
    refused: list[Flight | Conflict] = []
    stream = candidates(first, refused)
    found = [next(stream)]
    for _ in range(2):
        refused.append(MET)
        found.append(next(stream))
    assert list(candidates(first, refused)) == found
    assert list(candidates(from_bytes(to_bytes(found[1])), refused[1:])) == found[1:]
    assert len({digest(candidate.plan) for candidate in found}) == len(found)


def test_other_words_are_not_called_the_cheapest_where_no_flight_was_found() -> None:
    made = ltlplan.plan(world("F(a & F b)", robots=2, team="own"))
    first, other = candidates(Candidate(made), [MET])
    assert first.plan.complete
    assert not other.plan.complete
    assert other.plan.lower_bound == made.lower_bound
    assert not other.cuts[-1].proved


def test_the_stream_ends_where_nothing_is_left_to_try() -> None:
    made = ltlplan.plan(world("F a"))
    alone = Conflict(Infeasible("It is too fast.", Witness(claim="limits.speed", sentence="It is too fast.", robot="quad0")))
    assert list(candidates(Candidate(made), [alone])) == [Candidate(made)]
