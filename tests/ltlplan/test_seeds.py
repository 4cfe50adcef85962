"""A seed that is given is the one that draws, and the one that plan, flight and files state."""

import numpy as np
import pytest

import ltlplan
from ltlplan.online.simulated_online_flight import fly_online
from ltlplan.pipeline import plan, run
from tests.helpers.few import few_of
from verify.data import BadInput, Mission, load_plan, parse_mission
from verify.data.files.mission_file import load_mission_file

TEXT = """
format: 1
name: small
spec: {{formula: F a & F b}}
hoops: {{a: {{center: [0.5, 0, 1], yaw_deg: 60, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}}}}
regions: {{b: {{center: [0.5, 1, 1], radii: [0.2, 0.2, 0.2]}}}}
agents: {{quad0: {{start: [-0.2, 0, 1]}}, quad1: {{start: [-0.2, 1, 1]}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-2, -2, 0.2], max: [2, 2, 2]}}
planner: {{method: {method}, seed: {seed}, pace: nominal, samples: 20, iterations: 2}}
"""


def small(method: str, seed: int) -> Mission:
    return parse_mission(TEXT.format(method=method, seed=seed))


@few_of(1, "method", ["exact", "mtac-e"])
def test_a_given_seed_is_the_missions_own_from_then_on(method: str) -> None:
    given, own = plan(small(method, 0), seed=7), plan(small(method, 7))
    assert given == own
    assert given.seed == given.mission.planner.seed == 7
    assert given.mission.digest() == own.mission.digest() != small(method, 0).digest()
    assert given.robots != plan(small(method, 0)).robots, "other draws, other paths"


@pytest.mark.slow
def test_a_run_flies_with_the_given_seed_and_writes_it_down(tmp_path) -> None:
    done = run(small("mtac-e", 0), tmp_path / "run", seed=7)
    assert done.plan.seed == done.log.seed == done.mission.planner.seed == 7
    mission = load_mission_file(tmp_path / "run" / "mission.yaml")
    assert mission.planner.seed == load_plan(tmp_path / "run" / "plan.json", mission).seed == 7
    again = run(mission, tmp_path / "again")
    for path in done.files:
        if path.name not in ("plan.json", "certificate.json", "report.html"):
            assert path.read_bytes() == (tmp_path / "again" / path.relative_to(tmp_path / "run")).read_bytes(), path.name
    assert again.certificate.to_json() == done.certificate.to_json()


@pytest.mark.slow
def test_an_online_flight_states_its_seed() -> None:
    flown = fly_online(small("exact", 0), seed=7)
    assert flown.mission.planner.seed == flown.log.seed == 7
    assert "paper" not in flown.summary()


def test_what_is_no_seed_is_refused() -> None:
    assert plan(small("exact", 0), seed=np.int64(3)).seed == 3  # type: ignore[arg-type]
    for wrong in (-1, 1.5, "7", True):
        with pytest.raises(BadInput, match="A seed is a whole number from 0 on"):
            ltlplan.plan(small("exact", 0), seed=wrong)  # type: ignore[arg-type]
