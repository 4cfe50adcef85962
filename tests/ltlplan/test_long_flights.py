"""Flights with more pieces than a Crazyflie holds, from a mission to files that are proved again."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import ltlplan
from verify import recheck
from verify.data.files.mission_file import parse_mission
from verify.data.files.trajectory_csv import load_csv

HALL = """
format: 1
name: long
vehicle: crazyflie-2.1
workspace: {min: [-3, -3, 0.2], max: [3, 3, 2.5]}
planner: {iterations: 2, speed: 0.35}
"""


def goals(count: int, only: str = "") -> str:
    return "\n".join(
        f"  g{i}: {{{only}center: [{-2.2 + 0.9 * (i % 4):.2f}, {-1.8 + 1.0 * (i // 4):.2f}, {1.0 if i % 2 else 1.3}], radii: [0.2, 0.2, 0.2]}}"
        for i in range(count)
    )


def asked(*names: str) -> str:
    return " & ".join(f"F {name}" for name in names)


ONE = f"""{HALL}
regions:
{goals(14)}
agents: {{quad0: {{start: [-2.6, -2.6, 1.0]}}}}
spec: {{formula: {asked(*(f"g{i}" for i in range(14)))}}}
"""
THREE = f"""{HALL}
regions:
{goals(14, "only: [busy], ")}
  h0: {{only: [other], center: [1.9, -1.6, 1.2], radii: [0.2, 0.2, 0.2]}}
  h1: {{only: [other], center: [2.3, 2.2, 1.2], radii: [0.2, 0.2, 0.2]}}
robots: {{busy: {{}}, other: {{}}}}
agents:
  quad0: {{start: [-2.6, -2.6, 1.0], robot: busy}}
  quad1: {{start: [2.6, -2.6, 1.0], robot: other}}
  quad2: {{start: [2.6, 1.2, 1.0], robot: other}}
spec: {{formula: {asked(*(f"g{i}" for i in range(14)), "h0", "h1")}}}
"""
LAPS = f"""{HALL}
regions:
{goals(4)}
agents: {{quad0: {{start: [-2.6, -2.6, 1.0]}}}}
spec: {{formula: {" & ".join(f"G F g{i}" for i in range(4))}, trace: infinite, repeat: 10}}
"""


@pytest.mark.slow
@pytest.mark.parametrize(("text", "least"), [(ONE, 32), (THREE, 32), (LAPS, 80)], ids=["14 goals", "three robots", "ten laps"])
def test_it_is_run_in_parts_that_crazyflies_hold(text: str, least: int, tmp_path: Path) -> None:
    result = ltlplan.run(parse_mission(text), tmp_path / "out")
    laps = result.mission.spec.repeat
    assert max(len(path.flattened(laps)) for path in result.team.values()) >= least
    proved = recheck(tmp_path / "out")
    assert proved.covers(result.team)
    written = json.loads((tmp_path / "out" / "certificate.json").read_text())["trajectories"]
    for name, path in result.team.items():
        assert tuple(written[name]["cuts"]) == path.cuts
        files = sorted((tmp_path / "out" / "crazyswarm2").glob(f"{name}-part*.csv"))
        assert len(files) == len(path.parts)
        assert all(2 <= len(load_csv(file)) <= 31 for file in files)
