"""Teams in flight over regions that overlap: a robot's letter is all regions that hold it, as the log and the judge read it."""

import numpy as np
import pytest

from ltlplan.online.segments.certified_team import CertifiedTeam
from ltlplan.online_mtac.online_team import OnlineTeam
from verify.data import Mission, parse_mission


def overlapping(formula: str) -> Mission:
    return parse_mission(f"""
format: 1
name: overlap
spec: {{formula: "{formula}"}}
regions:
  a: {{center: [0, 0, 1], radii: [0.3, 0.3, 0.3]}}
  b: {{center: [0.4, 0, 1], radii: [0.3, 0.3, 0.3]}}
  c: {{center: [-1.5, 0, 1], radii: [0.3, 0.3, 0.3]}}
agents: {{quad0: {{start: [-0.8, 0, 1]}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-4, -4, 0.2], max: [4, 4, 2.2]}}
planner: {{method: online-mtac-e, samples: 50, elite: 0.1}}
""")


SEEN = [
    ((0.0, 0.0, 1.0), {"a"}),
    ((0.2, 0.0, 1.0), {"a", "b"}),
    ((0.4, 0.0, 1.0), {"b"}),
    ((0.8, 0.0, 1.0), set()),
]


@pytest.mark.parametrize("lead", [lambda m: OnlineTeam(m, rng=np.random.default_rng(0)), lambda m: CertifiedTeam(m, seed=0)])
def test_a_robot_shows_every_region_that_it_is_in(lead):
    mission = overlapping("F c")
    team = lead(mission)
    for number, (place, regions) in enumerate(SEEN, start=1):
        team.step(0.02 * number, {"quad0": place})
        assert {name for name, region in mission.all_regions.items() if region.level(np.array(place)) <= 1.0} == regions
        assert team.belief.held["quad0"] == regions
        assert team.pilots["quad0"].where.inside == regions


def test_what_is_forbidden_in_an_overlap_is_noticed_when_a_robot_is_seen_there():
    team = OnlineTeam(overlapping("F c & G !(a & b)"), rng=np.random.default_rng(0))
    team.step(0.02, {"quad0": (-0.5, 0.0, 1.0)})
    assert team.holding is None
    team.step(0.04, {"quad0": (0.2, 0.0, 1.0)})
    assert team.holding is not None
    assert not team.belief.accepts()
