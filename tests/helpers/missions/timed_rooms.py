"""A room of three regions, for missions with bounds in seconds."""

from __future__ import annotations

from verify.data import Mission
from verify.data.files.mission_file import parse_mission

ROOM = """
format: 1
name: times
spec: {{formula: '{formula}'{more}}}
regions:
  dock: {{center: [1.6, 0.4, 1.0], size: [0.5, 0.5, 0.8]}}
  shelf: {{center: [1.6, 1.6, 1.0], size: [0.5, 0.5, 0.8]}}
  pit: {{center: [0.8, 1.6, 1.0], size: [0.4, 0.4, 0.8]}}
agents:
  quad0: {{start: [0.4, 0.4, 1.0]}}
{agents}
vehicle: crazyflie-2.1
workspace: {{min: [0.0, 0.0, 0.5], max: [2.0, 2.0, 1.5]}}
margin: 0.03
{planner}
"""


def room(formula: str, *, more: str = "", agents: str = "", planner: str = "") -> Mission:
    return parse_mission(ROOM.format(formula=formula, more=more, agents=agents, planner=planner))
