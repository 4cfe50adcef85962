"""Flights too long for the vehicle's memory, cut where they rest."""

from __future__ import annotations

import numpy as np
import pytest

import verify
from refine import minimum_snap, quantise, refine, split
from refine.spline.parts import rests
from refine.spline.spline import Spline
from tests.helpers.motion.plans_by_hand import ball, room, sequence_plan, straight
from verify.data import BadInput, DoesNotFit, Plan, Trajectory
from verify.data.sections import Agent

LEGS = ((0, 5), (5, 6), (6, 12), (12, 15))
POINTS = np.array([[-2 + 0.25 * i, 0.3 * (-1) ** i, 1 + 0.02 * i] for i in range(16)])


def flight() -> Trajectory:
    """Fifteen pieces that rest after five, six and twelve of them."""
    pieces = [minimum_snap(POINTS[a : b + 1], np.arange(b - a + 1) * 1.7) for a, b in LEGS]
    states = np.concatenate([pieces[0].states, *(piece.states[1:] for piece in pieces[1:])])
    states = np.concatenate([states, np.zeros((len(states), 4, 1))], axis=2)
    return quantise(Spline(np.concatenate([piece.durations for piece in pieces]), states))


def test_a_flight_is_cut_where_it_rests_and_each_part_is_certified() -> None:
    whole = flight()
    assert rests(whole) == (5, 6, 12)
    assert split(whole) == (whole,)
    parts = split(whole, 7)
    assert [len(part) for part in parts] == [6, 6, 3]
    np.testing.assert_array_equal(np.concatenate([part.coefficients for part in parts]), whole.coefficients)
    start = 0
    for part in parts:
        assert part.is_float32
        points = POINTS[start : start + len(part) + 1]
        mission = room({"far": ball(2.5, -2.5)}, {"q": Agent(start=tuple(points[0]))})
        certificate = verify.judge(Plan(mission=mission, robots={"q": straight(*points)}), {"q": part}, largest=False)
        assert [claim.sentence for claim in certificate.claims if claim.outcome != "holds"] == []
        start += len(part)


def test_a_part_of_one_piece_is_followed_by_a_hover() -> None:
    alone = split(Trajectory(flight().durations[5:], flight().coefficients[5:]), 6)
    assert [len(part) for part in alone] == [2, 6, 3]
    assert alone[0].is_float32
    np.testing.assert_array_equal(alone[0].coefficients[1, :, 1:], 0.0)
    gap = alone[0].evaluate(alone[0].duration) - alone[1].evaluate(0.0)
    assert np.abs(gap).max() < 1e-6


def test_where_rests_are_missing_the_error_says_how_many_parts_would_do() -> None:
    with pytest.raises(
        DoesNotFit, match=r"15 pieces and would do in 3 parts of at most 5.*piece 6 to piece 11 \(6 pieces.*holds 6"
    ):
        split(flight(), 5)
    with pytest.raises(BadInput, match="at least 2"):
        split(flight(), 1)
    with pytest.raises(BadInput, match="flatten"):
        split(Trajectory(flight().durations, flight().coefficients, cycle=3), 9)


@pytest.mark.slow
def test_a_flight_too_long_may_rest_on_the_way_and_be_split() -> None:
    plan = sequence_plan()
    with pytest.raises(DoesNotFit, match="Let it rest"):
        refine(plan, max_pieces=6)
    whole = refine(plan, max_pieces=6, too_long="rest", pace="nominal")["quad0"]
    assert verify.judge(plan, {"quad0": whole}, largest=False).holds
    parts = split(whole, 6)
    assert len(parts) > 1
    assert max(len(part) for part in parts) <= 6
    assert sum(part.duration for part in parts) >= whole.duration
