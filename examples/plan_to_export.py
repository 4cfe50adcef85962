"""From a mission to files for real vehicles, a stage at a time: `python plan_to_export.py FOLDER`."""

import sys
from pathlib import Path

import flight
import ltlplan
import refine
import verify

MISSION = """
format: 1
name: delivery
spec: {formula: "F shelf & F desk & G(shelf -> badge)"}
regions:
  shelf: {center: [0.8, 0.8, 1.0], radii: [0.25, 0.25, 0.25]}
  desk: {center: [-0.8, 0.8, 1.0], radii: [0.25, 0.25, 0.25]}
  gate: {center: [0.9, -0.7, 1.0], radii: [0.25, 0.25, 0.25]}
robot: {initial: none, states: {none: [], cleared: [badge]}, actions: [{from: none, to: cleared, at: gate}]}
agents: {quad0: {start: [0.0, -0.9, 1.0]}, quad1: {start: [-0.9, -0.9, 1.0]}}
vehicle: crazyflie-2.1
workspace: {min: [-1.5, -1.5, 0.2], max: [1.5, 1.5, 1.8]}
"""

mission = ltlplan.parse_mission(MISSION)
plan = ltlplan.plan(mission, seed=0)  # who visits what, in which order, by which waypoints
for name, robot in plan.robots.items():
    print(f"{name}: {robot.word}, cost {robot.cost:.2f}")
team = refine.refine(plan)  # polynomials within every limit of the vehicle
certificate = verify.certify(plan, team)  # proved for all times, or NotCertified with a witness
print(f"certified for {certificate.duration:.1f} s at a margin of {certificate.margin} m")
conditions = flight.conditions_of(mission)  # by the controller that the margin is meant for, in wind and noise
log = flight.fly(plan, team, certificate, seed=0, conditions=conditions)  # closed loop, in simulation
print(f"flown in simulation, at most {1000 * log.worst_error():.1f} mm from its path")
exported = flight.export(team, certificate, Path(sys.argv[1]), format="crazyswarm2", flight=log)
print("exported", *(path.name for path in exported.files))
