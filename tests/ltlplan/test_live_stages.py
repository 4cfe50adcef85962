"""What is flown live of a patrol: its laps, a braking from whose end it can land, and the landing there."""

from __future__ import annotations

import numpy as np
import pytest

import ltlplan
import ltlplan.live_phases
from flight.link.live_executive import fly_live
from flight.link.simulated import SimulatedLink
from ltlplan.live_phases import stages
from tests.helpers.motion.patrols import patrol
from verify import certify
from verify.data import Infeasible, NotCertified

PLACES = {"r0": (1.4, -0.2, 0.0)}


@pytest.fixture(scope="module")
def certified():
    plan, path = patrol()
    return plan, {"r0": path}, certify(plan, {"r0": path})


def test_a_patrol_lands_where_it_has_braked(certified) -> None:
    plan, team, cert = certified
    climb, way, flown, landing = stages(plan, team, cert, PLACES)
    assert [stage.name for stage in (climb, way, flown, landing)] == ["climb", "way", "flight", "landing"]
    laps, whole = team["r0"].flattened(2), flown.paths["r0"]
    assert whole.part(0, len(laps)) == laps
    assert flown.behind["r0"].duration > 0.4
    assert np.abs(whole.evaluate(whole.duration, 1)).max() < 1e-4
    begins = landing.paths["r0"].evaluate(0.0)[:3]
    assert np.abs(begins - whole.evaluate(whole.duration)[:3]).max() < 1e-4


def test_another_braking_is_flown_where_nobody_can_land_behind_the_first(certified, monkeypatch) -> None:
    plan, team, cert = certified
    real, tried = ltlplan.live_phases.to_ground, []

    def to_ground(mission, flown, places, **more):
        tried.append(flown["r0"])
        if len(tried) < 3:
            raise Infeasible("there is a column")
        return real(mission, flown, places, **more)

    monkeypatch.setattr(ltlplan.live_phases, "to_ground", to_ground)
    flown = stages(plan, team, cert, PLACES)[2]
    assert len(tried) == 3
    assert flown.paths["r0"] == tried[2]
    assert len(set(tried)) == 3


@pytest.mark.slow
def test_a_patrol_behind_which_nobody_lands_is_refused(certified, monkeypatch) -> None:
    plan, team, cert = certified

    def to_ground(*_args, **_more):
        raise Infeasible("there is a column")

    monkeypatch.setattr(ltlplan.live_phases, "to_ground", to_ground)
    with pytest.raises(
        NotCertified, match=r"r0 ends its last lap at 1\.00 m/s, and no braking behind it was proved from which it can land"
    ):
        stages(plan, team, cert, PLACES)


ROUND = """
format: 1
name: round
sequence: firstF (secondF firstF)*
spec: {trace: infinite, repeat: 2}
hoops:
  first: {center: [0.7, -0.6, 0.8], yaw_deg: 180, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}
  second: {center: [-0.5, 0.5, 1.0], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}
agents: {one: {start: [1.3, -0.6, 0.8]}}
vehicle: crazyflie-2.1
limits: {speed: 1.0}
workspace: {min: [-1.6, -1.3, 0.2], max: [1.6, 1.3, 1.8]}
"""


@pytest.mark.slow
def test_of_a_sequence_in_laps_the_recording_is_satisfied(tmp_path) -> None:
    mission, place = ltlplan.parse_mission(ROUND), {"one": (1.3, -0.6, 0.0)}
    run = ltlplan.run(mission, tmp_path / "run")
    flown = stages(run.plan, run.team, run.certificate, place)
    done = fly_live(SimulatedLink(mission, place), flown, grounds={"one": 0.0})
    assert done.flown, done.reason
    assert "braking" in done.record.starts
    (tmp_path / "live.csv").write_text(done.record.files()["live.csv"])
    judged = ltlplan.judge_flight(tmp_path / "run", tmp_path / "live.csv", start=0.0, error=1e-6, max_speed=1.3)
    assert judged.verdict.outcome == "holds", judged.verdict.sentence
