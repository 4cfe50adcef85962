"""Missions of several kinds of robots."""

from verify.data import Mission, parse_mission

HEAVY = (
    "{name: heavy, mass: 0.9, radius: 0.16, arm: 0.12, inertia: [3.0e-3, 3.0e-3, 5.0e-3], torque_to_thrust: 0.02, "
    "rotor_thrust_min: 0.0, rotor_thrust_max: 5.0, thrust_min: 1.0, thrust_max: 18.0, speed: 0.6, acceleration: 4.0, "
    "tilt_deg: 35.0, body_rate_deg: 300.0, yaw_rate_deg: 120.0}"
)
"""Of 0.9 kg and slow: a tanker."""

MIXED = """
format: 1
name: mixed
spec: {formula: "%(formula)s"}
regions:
  water: {center: [-1.0, -0.8, 1.0], radii: [0.3, 0.3, 0.3]}
  smoke: {center: [1.0, -0.8, 1.0], radii: [0.3, 0.3, 0.3]}
  desk: {center: [1.0, 0.9, 1.0], radii: [0.3, 0.3, 0.3]%(desk)s}
environment: {edges: %(edges)s}
robots:
  tanker: {initial: empty, states: {empty: [], full: [carrying]}, actions: [{from: empty, to: full, at: water}]}
  scout: {initial: idle, states: {idle: []}}
agents:
  fast: {start: [0.0, 0.0, 1.0], robot: scout%(fast)s}
  slow: {start: [-1.9, 0.8, 1.0], robot: tanker, vehicle: %(heavy)s%(slow)s}
vehicle: crazyflie-2.1
limits: {speed: 1.0}
workspace: {min: [-2.4, -1.6, 0.2], max: [1.8, 1.6, 2.0]}
separation: 0.4
margin: 0.05
planner: {method: %(method)s, objective: %(objective)s, cost: %(cost)s, iterations: 2, samples: 20%(planner)s}
"""
EDGES = "[[robot, water], [robot, smoke], [robot, desk], [water, smoke], [smoke, desk], [water, desk]]"


def mixed_text(formula: str, **parts: str) -> str:
    """Return a mission of a small fast robot that carries nothing and a heavy slow one that carries water, as YAML.

    Args:
        formula: Over water, smoke, desk and carrying.
        parts: What is put in: `desk`, `fast`, `slow` and `planner` (more keys, with a comma first), `edges`, `method`, `objective`, `cost`.
    """
    empty = dict.fromkeys(("desk", "fast", "slow", "planner"), "")
    usual = {"edges": EDGES, "method": "exact", "objective": "sum", "cost": "{length: 1.0}", "heavy": HEAVY}
    return MIXED % {"formula": formula, **empty, **usual, **parts}


def mixed(formula: str, **parts: str) -> Mission:
    """Return the mission that `mixed_text` writes."""
    return parse_mission(mixed_text(formula, **parts))
