"""Campaigns: each run is the flight with its seed, shares have honest intervals, and contradictions are found."""

from __future__ import annotations

import dataclasses
import importlib
from fractions import Fraction

import numpy as np
import pytest

import flight
from tests.helpers.motion.stand_ins import Instant, hop, stand_in
from tests.helpers.motion.stand_ins import flight as made_flight
from verify.data import BadInput, NotCertified

CONDITIONS = {"wind": "0.4,0.2,0+0.3", "noise": 0.001}


@pytest.fixture(scope="module")
def made():
    plan, team = made_flight()
    return plan, team, stand_in(plan, team)


@pytest.fixture(scope="module")
def short():
    plan, team = hop()
    return plan, team, stand_in(plan, team, duration=1.0)


@pytest.fixture(scope="module")
def found(made):
    return flight.campaign(*made, runs=4, seed=40, **CONDITIONS)


def test_a_calm_campaign_keeps_all_its_promises(found):
    assert found.share_inside.value == found.share_satisfied.value == 1.0
    assert found.contradictions == ()
    assert found.seeds.tolist() == list(range(40, 44))
    assert found.worst_seed in found.seeds
    assert "4 of 4" in found.sentences[0]


def test_a_run_of_a_campaign_is_the_flight_with_its_seed(made, found):
    seed = found.worst_seed
    log = flight.fly(*made, seed=seed, **CONDITIONS)
    run = seed - 40
    assert found.worst_error[run] == pytest.approx(log.worst_error(), abs=1e-4)  # plus what may happen between steps
    assert found.worst_error[run] >= log.worst_error()
    assert found.robots[found.worst_robot[run]] == max(log.robots, key=log.worst_error)
    assert found.error_over_time[-1, 2] >= np.float32(np.max(log.error[-1]))


def test_findings_do_not_depend_on_batches(made, found, monkeypatch):
    monkeypatch.setattr(importlib.import_module("flight.campaigns"), "_BATCH", 3)
    shares = []
    again = flight.campaign(*made, runs=4, seed=40, progress=lambda _, share: shares.append(share), **CONDITIONS)
    assert again.to_dict() == found.to_dict()
    assert np.array_equal(again.error_over_time, found.error_over_time)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [2, 3, 16])
def test_findings_do_not_depend_on_the_number_of_processes(made, found, monkeypatch, workers):
    monkeypatch.setattr(importlib.import_module("flight.campaigns"), "LEAST_SHARE", 1)
    shares = []
    again = flight.campaign(
        *made, runs=4, seed=40, workers=workers, progress=lambda _, share: shares.append(share), **CONDITIONS
    )
    assert again.to_dict() == found.to_dict()
    for name in ("seeds", "worst_error", "worst_robot", "inside", "satisfied", "times", "error_over_time"):
        assert getattr(again, name).tobytes() == getattr(found, name).tobytes(), name
    assert shares == sorted(shares)


def test_no_process_is_started_that_could_save_no_time(made, found, monkeypatch):
    def none(*_arguments, **_options):
        raise AssertionError("a process was started for a handful of runs")

    monkeypatch.setattr("multiprocessing.context.SpawnProcess._Popen", none)
    again = flight.campaign(*made, runs=4, seed=40, workers=2, **CONDITIONS)
    assert again.to_dict() == found.to_dict()


@pytest.mark.parametrize(
    "conditions", [{}, {"wind": 1.0}, {"noise": flight.MotionCapture(noise=0, dropout=0, attitude_noise=0, rate_noise=0)}]
)
def test_where_nothing_varies_one_is_flown_and_no_confidence_claimed(short, conditions):
    alone = flight.campaign(*short, runs=60, seed=7, **conditions)
    assert alone.seeds.tolist() == [7]
    assert (alone.asked, alone.varied) == (60, False)
    assert (
        "nothing varies between runs without noise and gusts, so one was flown for the 60 runs asked for" in alone.sentences[0]
    )
    assert "every robot stayed inside its tube of 0.05 m." in alone.sentences
    assert "confidence" not in " ".join(alone.sentences)
    assert alone.to_dict()["share_inside"] is alone.to_dict()["share_satisfied"] is None
    others = [flight.fly(*short, seed=seed, **conditions) for seed in (7, 8)]
    assert others[0].to_csv() == others[1].to_csv(), "it is true that nothing varies"


@pytest.mark.parametrize(
    "varying", [{"wind": "1+0.1"}, {"noise": 0.0}, {"noise": flight.MotionCapture(noise=0, dropout=0, rate_noise=0)}]
)
def test_where_anything_varies_all_are_flown(short, varying):
    assert flight.campaign(*short, runs=2, **varying).varied
    assert flight.fly(*short, seed=7, **varying).to_csv() != flight.fly(*short, seed=8, **varying).to_csv()


@pytest.mark.slow
def test_a_storm_throws_runs_out_of_their_tube(made):
    plan, team, cert = made
    found = flight.campaign(plan, team, dataclasses.replace(cert, margin=0.001), runs=3, model="paper", noise=0.001)
    assert found.share_inside.count == 0
    assert found.contradictions == ()


def test_a_run_inside_its_tube_that_breaks_the_formula_is_reported_as_a_bug(made):
    """A false certificate: the tank is filled after `right` has been reached."""
    plan, team, cert = made
    false = dataclasses.replace(cert, actions=(Instant("quad0", 0, Fraction(49, 10), "empty", "full"),))
    found = flight.campaign(plan, team, false, runs=2, model="paper")
    assert found.contradictions == (0,), "the one run that stands for both"
    assert any(sentence.startswith("BUG") for sentence in found.sentences)


@pytest.mark.slow
def test_without_a_certificate_nothing_is_said_of_tubes(made):
    plan, team, _ = made
    found = flight.campaign(plan, team, runs=2, model="paper")
    assert found.inside is None
    assert found.share_inside is None
    assert found.contradictions == ()
    assert found.to_dict()["share_inside"] is None


@pytest.mark.parametrize(("count", "of", "low", "high"), [(0, 10, 0.0, 0.3085), (10, 10, 0.6915, 1.0), (7, 10, 0.3475, 0.9333)])
def test_confidence_intervals_are_clopper_and_pearsons(count, of, low, high):
    """Against the table values of exact binomial limits."""
    share = flight.Proportion.make(np.arange(of) < count)
    assert (share.low, share.high) == (pytest.approx(low, abs=1e-4), pytest.approx(high, abs=1e-4))


@pytest.mark.parametrize(
    "options",
    [
        {"runs": 0},
        {"runs": 10**7},
        {"runs": 2.5},
        {"runs": True},
        {"workers": 0},
        {"workers": None},
        {"workers": 1.5},
        {"seed": -1},
        {"seed": 1.5},
    ],
)
def test_campaigns_out_of_range_are_refused(made, options):
    with pytest.raises(BadInput, match=next(iter(options))):
        flight.campaign(*made, **options)


def test_a_campaign_with_another_teams_certificate_is_refused(made):
    plan, team, cert = made
    with pytest.raises(NotCertified):
        flight.campaign(plan, {**team, "quad0": team["quad1"]}, cert, runs=1)
