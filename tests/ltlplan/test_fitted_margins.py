"""Margins that are taken from the proof of tracking: `margin: auto`."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

import ltlplan
from ltlplan import load_mission, pipeline
from ltlplan.commands.support import options
from ltlplan.logic.budget import DEFAULT_BUDGET
from tests.helpers.motion.flights import small_mission
from verify import certify, recheck
from verify.data import NotCertified, load_vehicle, parse_mission
from verify.data.airframe import load_airframe
from verify.data.disturbance import Disturbance
from verify.data.files.mission_file import mission_to_yaml
from verify.data.validation.faults import MissionError
from verify.data.witness import Witness

TOLD = Disturbance(airframe=load_airframe("crazyflie-2.1"), wind=0.05)


def fitted(monkeypatch, bounds, **told):
    """Return the margins that are tried, and the one that is taken, where flights at a margin have some bound."""
    tried: list[float] = []

    def certified_team(mission, progress, budget):
        del budget
        tried.append(mission.margin)
        bound = bounds(mission.margin)
        if bound is not None and bound <= mission.margin:
            return SimpleNamespace(
                certificate=SimpleNamespace(margin=mission.margin, claims=[SimpleNamespace(name="tracking", bound=bound)])
            )
        raise NotCertified("no", [Witness(claim="tracking", sentence="no", bound=bound)])

    monkeypatch.setattr(pipeline, "certified_team", certified_team)
    monkeypatch.setattr(pipeline, "_kept", lambda best, margin, refusal: best)
    mission = small_mission("F a", margin=0.05).changed(disturbance=TOLD.changed(**{"fitted": True, **told}))
    taken = pipeline._certified(mission, lambda mission, progress: mission, lambda sentence, share: None, DEFAULT_BUDGET)
    return tried, taken.certificate.margin


@pytest.mark.parametrize(
    ("bounds", "tried", "taken"),
    [
        (lambda margin: 0.0123, [0.05, 0.013], 0.013),
        (lambda margin: 0.0701, [0.05, 0.071], 0.071),
        (lambda margin: 0.0123 if margin > 0.02 else 0.0135, [0.05, 0.013, 0.014], 0.014),
        (lambda margin: 0.0123 if margin > 0.02 else margin + 0.001, [0.05, 0.013, 0.014], 0.05),
        (lambda margin: 0.0123 if margin > 0.02 else None, [0.05, 0.013], 0.05),
    ],
)
def test_margins_are_fitted_in_at_most_three_flights(monkeypatch, bounds, tried, taken):
    assert fitted(monkeypatch, bounds) == (tried, taken)


def test_margins_that_are_stated_stay(monkeypatch):
    assert fitted(monkeypatch, lambda margin: 0.0123, fitted=False) == ([0.05], 0.05)


def test_a_margin_that_a_command_states_is_not_fitted():
    assert load_mission("proved-inspection").disturbance.fitted
    mission = options.read_mission("proved-inspection", margin=0.01)
    assert mission.margin == 0.01
    assert not pipeline.fits_margin(mission)
    assert pipeline.fits_margin(options.read_mission("proved-inspection"))


def test_a_margin_that_is_kept_has_a_note_on_the_one_that_was_refused(monkeypatch):
    whole = pipeline.certified_team

    def certified_team(made, **options):
        if made.mission.margin < 0.05:
            raise NotCertified("Not certified. r0: no proof for flights in parts.")
        return whole(made, **options)

    monkeypatch.setattr(pipeline, "certified_team", certified_team)
    mission = small_mission("F a", margin=0.05).changed(
        vehicle=load_vehicle("crazyflie-2.1").changed(controller="geometric"),
        limits={"speed": 0.2, "acceleration": 0.2},
        disturbance=TOLD.changed(wind=0.02, fitted=True),
    )
    result = ltlplan.run(mission)
    assert result.certificate.margin == 0.05
    assert result.certificate.tube == "proved"
    (note,) = (note for note in result.plan.notes if "margin" in note)
    assert note.endswith(
        "mm, which the proof of tracking allows of this flight, was refused: r0: no proof for flights in parts."
    )
    assert certify(result.plan, result.team).digest() == result.certificate.digest()


def test_what_is_not_proved_is_refused(monkeypatch):
    with pytest.raises(NotCertified):
        fitted(monkeypatch, lambda margin: None)
    with pytest.raises(NotCertified):
        fitted(monkeypatch, lambda margin: margin + 0.01)


def test_margin_auto_is_read_where_disturbances_are_stated():
    told = small_mission("F a", margin=0.05).changed(disturbance=TOLD)
    text = mission_to_yaml(told)
    assert "margin: 0.05\n" in text
    read = parse_mission(text.replace("margin: 0.05\n", "margin: auto\n"))
    assert read.disturbance is not None
    assert read.disturbance.fitted
    assert read.margin == 0.05
    alone = mission_to_yaml(small_mission("F a", margin=0.05))
    with pytest.raises(MissionError, match="needs `disturbance`"):
        parse_mission(alone.replace("margin: 0.05\n", "margin: auto\n"))


@pytest.mark.slow
def test_the_shipped_mission_is_proved_at_the_margin_that_its_proof_allows(tmp_path):
    result = ltlplan.run("proved-inspection", tmp_path / "run")
    assert result.certificate.tube == "proved"
    bounds = [claim.bound for claim in result.certificate.claims if claim.name == "tracking"]
    assert len(bounds) == 2
    assert result.certificate.margin - 0.001 < max(bounds) <= result.certificate.margin == 0.005
    assert 0.0 < result.log.worst_error() < max(bounds), "within the stated disturbances"
    assert recheck(tmp_path / "run").tube == "proved"
