"""Teams of several kinds from mission to certified flight and exports."""

from pathlib import Path

import pytest

import flight
import ltlplan
from flight.exports.crazyflies.crazyswarm import file_names
from ltlplan.planner import make_plan
from refine import refine
from tests.helpers.missions.kinds import mixed
from tests.helpers.motion.flights import legs, plan_of
from verify import certify, judge, recheck
from verify.data import BadInput, DoesNotFit, NotCertified, Visit

FIRE = "F smoke & F desk & G(smoke -> carrying)"


def flown():
    """A certified flight of both, each to a place of its own."""
    mission = mixed("F desk")
    plan = plan_of(mission, {"fast": [Visit(region="desk")], "slow": []})
    team = {"fast": legs([[0, 0, 1], [0, 0.9, 1], [1, 0.9, 1]]), "slow": legs([[-1.9, 0.8, 1]])}
    return team, certify(plan, team)


def test_a_small_fast_robot_and_a_heavy_one_are_planned_refined_and_certified(pace):
    mission = mixed(FIRE, slow=", limits: {speed: 0.5, endurance: 60.0}", planner=", speed: 0.8", cost="{time: 1.0}")
    plan = make_plan(mission)
    assert {name: [v.region for v in robot.visits] for name, robot in plan.robots.items()} == {
        "fast": ["desk"],
        "slow": ["water", "smoke"],
    }
    certificate = judge(plan, refine(plan, pace=pace), largest=False)
    assert [claim.sentence for claim in certificate.claims if claim.outcome != "holds"] == []
    bounds = {(claim.name, claim.robot): claim.limit for claim in certificate.claims}
    assert (bounds["limits.speed", "fast"], bounds["limits.speed", "slow"]) == (1.0, 0.5)
    assert bounds["limits.endurance", "slow"] == 60.0
    assert ("limits.endurance", "fast") not in bounds


def test_each_robot_is_exported_for_what_can_hold_it(tmp_path: Path):
    team, certificate = flown()
    with pytest.raises(DoesNotFit, match=r"slow flies another vehicle: .* is no Crazyflie. Write fast by `robots`"):
        flight.export(team, certificate, tmp_path / "all", force=True)
    few = flight.export(team, certificate, tmp_path / "few", robots=["fast"], force=True)
    assert {path.relative_to(tmp_path / "few").as_posix() for path in few.files} == set(file_names(["fast"]))
    note = (tmp_path / "few" / "README.txt").read_text()
    assert "airframe: crazyflie-2.1, 0.033 kg, controller mellinger\nnot in this export: slow, of the same flight" in note
    every = flight.export(team, certificate, tmp_path / "ros", format="ros2", force=True)
    assert "airframe: heavy, 0.9 kg, controller geometric (slow)" in every.files[-1].read_text()


def test_exports_refuse_other_airframes_and_unknown_robots(tmp_path: Path):
    team, certificate = flown()
    with pytest.raises(NotCertified, match=r"the airframe 'heavy' of slow, not 'crazyflie-2\.1'"):
        flight.export(team, certificate, tmp_path / "a", format="ros2", vehicle="crazyflie-2.1", force=True)
    with pytest.raises(BadInput, match="'fats' is not a robot of the mission"):
        flight.export(team, certificate, tmp_path / "b", robots=["fats"], force=True)
    with pytest.raises(BadInput, match="robots is empty"):
        flight.export(team, certificate, tmp_path / "c", robots=[], force=True)


@pytest.mark.slow
def test_a_run_of_a_mixed_team_is_flown_written_and_proved_again(tmp_path: Path):
    result = ltlplan.run(mixed(FIRE), out=tmp_path / "run")
    assert result.certificate.holds
    assert any("no airframe is known for 'heavy'" in note for note in result.log.notes)
    assert sorted(path.name for path in (tmp_path / "run" / "crazyswarm2").glob("*.csv")) == ["fast.csv"]
    assert recheck(tmp_path / "run").holds
