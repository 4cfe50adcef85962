"""Halls in which robots are counted: many come from one side, some gather, few pass a door's width, all go home; or all cross side by side."""

from __future__ import annotations

import ltlplan
from refine import refine
from verify.data import Mission, Plan

_HALL = """
format: 1
name: hall
regions:
  a: {{center: [0, 0, 1], radii: [2, 2, 1]}}
  b: {{center: [6, 0, 1], radii: [2, 2, 1]}}
  home: {{center: [0, 8, 1], radii: [2, 2, 1]}}
agents: {{{agents}}}
vehicle: crazyflie-2.1
separation: 0.3
workspace: {{min: [-20, -20, 0.2], max: [20, 20, 4]}}
planner: {{pace: {pace}}}
spec: {{formula: "{formula}", team: joint}}
"""


def hall(count: int, formula: str, pace: str) -> Mission:
    """Return a mission of robots q0, q1, ... that depart from rows of ten."""
    starts = [(-8 + 1.6 * (i % 10), -6 - 1.6 * (i // 10)) for i in range(count)]
    agents = ", ".join(f"q{i}: {{start: [{x:.2f}, {y:.2f}, 1]}}" for i, (x, y) in enumerate(starts))
    return ltlplan.parse_mission(_HALL.format(agents=agents, formula=formula, pace=pace))


def gathering(count: int, pace: str) -> Mission:
    """Return the hall in which half of the robots gather, and never more than two are in b."""
    return hall(count, f"F(count(a) >= {count // 2}) & F(count(b) >= 2) & G(count(b) <= 2) & F all(home)", pace)


_LANES = """
format: 1
name: lanes
regions:
  first: {center: [-1.5, 0, 1], size: [0.8, 2, 0.6]}
  second: {center: [0, 0, 1], size: [0.8, 2, 0.6]}
  third: {center: [1.5, 0, 1], size: [0.8, 2, 0.6]}
agents: {a: {start: [-2.4, -0.6, 1]}, b: {start: [-2.4, 0, 1]}, c: {start: [-2.4, 0.6, 1]}}
vehicle: crazyflie-2.1
limits: {speed: 1}
workspace: {min: [-3, -1.6, 0.2], max: [3, 1.6, 2]}
planner: {pace: PACE}
spec: {formula: "F(all(first) & F(all(second) & F all(third)))", team: joint}
"""


def abreast(pace: str) -> Mission:
    """Return a mission of three robots that cross three fields, each field all together."""
    return ltlplan.parse_mission(_LANES.replace("PACE", pace))


def longest_alone(plan: Plan) -> float:
    """Return how long the flight of a plan's robots lasts that takes longest if each flies alone, s."""
    mission = plan.mission
    flights = []
    for name, robot in plan.robots.items():
        only = mission.changed(agents={name: mission.agents[name]}, spec=mission.spec.model_copy(update={"formula": "true"}))
        flights.append(
            refine(plan.model_copy(update={"robots": {name: robot}, "meetings": (), "precedences": (), "mission": only}))[name]
        )
    return max(flight.duration for flight in flights)
