"""The statement that a certificate proves, written for the kernel: `statement.json`.

It holds what mission and plan come to for each robot: regions and obstacles as inequalities, limits after every tightening, edges and
closed regions of its kind, planned visits, and the instants of actions that the certificate names.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from verify.certificate import Certificate
from verify.data.mission import Mission
from verify.data.plan import Plan
from verify.data.shapes.inequalities import Inequality
from verify.data.shapes.obstacle import Obstacle
from verify.data.shapes.region import Hoop, Region
from verify.kernel.statement import FORMAT
from verify.proofs.formula_tree import formula_tree, tree_of

STATEMENT_FILE = "statement.json"

_LIMITS = (
    "speed", "acceleration", "thrust_max", "thrust_min", "tilt", "body_rate", "yaw_rate", "rotor_thrust_max", "rotor_thrust_min",
)  # fmt: skip

Table = dict[str, Any]  # of any type: JSON nests


def statement_of(plan: Plan, certificate: Certificate) -> str:
    """Return the text of the statement that a certificate proves."""
    mission = plan.mission
    table: Table = {
        "format": FORMAT,
        "name": mission.name,
        "digests": {"mission": certificate.mission_digest, "plan": certificate.plan_digest, **_named(certificate.trajectories)},
        "lasso": mission.spec.trace == "infinite",
        "repeat": mission.spec.repeat,
        "joint": mission.spec.team == "joint",
        "formula": formula_tree(mission),
        "sequence": _sequence(mission),
        "margin": certificate.margin,
        "clock_error": certificate.clock_error,
        "separation": mission.separation,
        "separation_z": mission.separation_z,
        "low": list(mission.workspace.min),
        "high": list(mission.workspace.max),
        "regions": {name: body_table(region) for name, region in mission.all_regions.items()},
        "obstacles": {name: body_table(obstacle) for name, obstacle in mission.obstacles.items()},
        "robots": {name: _robot(plan, certificate, name) for name in mission.agents},
        "waits": _waits(plan),
        "words": _words(plan) if any(claim.name == "ordered" for claim in certificate.claims) else {},
    }
    if mission.timed_parts:
        table["timed"] = [tree_of(part) for part in mission.timed_parts]
    return statement_text(table)


def statement_text(table: Table) -> str:
    """Return a statement's text; the order of robots is that of the table."""
    return json.dumps(_plain(table), allow_nan=False, separators=(",", ":")) + "\n"


def _plain(value: Any) -> Any:  # of any type: JSON nests
    """Return a value without negative zeros, which mean what zero does and may be lost on the way through a file."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_plain(one) for one in value]
    return value + 0.0 if isinstance(value, float) else value


def _named(digests: Mapping[str, str]) -> dict[str, str]:
    return {f"trajectory of {name}": digest for name, digest in digests.items()}


def body_table(body: Region | Obstacle) -> Table:
    """Return a region or an obstacle as it stands in a statement."""
    found: Table = {"center": list(body.center), "parts": [[_inequality(one) for one in part] for part in body.body]}
    if isinstance(body, Hoop):
        found["ring"] = {"normal": list(body.normal or ()), "opening": body.opening, "rim": body.rim}
    if isinstance(body, Obstacle) and body.openings:
        found["openings"] = list(body.openings)
    return found


def _inequality(one: Inequality) -> Table:
    found: Table = {"bound": one.bound}
    if any(one.linear):
        found["linear"] = list(one.linear)
    if any(map(any, one.quadratic)):
        found["quadratic"] = [list(row) for row in one.quadratic]
    return found


def _robot(plan: Plan, certificate: Certificate, name: str) -> Table:
    mission = plan.mission
    vehicle, agent, own, system = mission.vehicle_of(name), mission.agents[name], plan.robots[name], mission.robot_of(name)
    limits = mission.limits_of(name)
    legs = {region: leg.model_dump(exclude_none=True) for region, leg in mission.leg_limits_of(name).items()}
    start = "" if mission.environment is None else mission.environment.start
    return {
        "radius": vehicle.radius,
        "mass": vehicle.mass,
        "arm": vehicle.arm,
        "inertia": list(vehicle.inertia),
        "torque_to_thrust": vehicle.torque_to_thrust,
        "limits": {key: getattr(limits, key) for key in _LIMITS},
        "legs": legs,
        "endurance": limits.endurance,
        "pieces": limits.pieces,
        "start": list(agent.start),
        "yaw": agent.yaw,
        "end": None if agent.end is None else list(agent.end),
        "edges": _edges(mission, name),
        "vertex": agent.visited or start,
        "closed": sorted(region for region in mission.all_regions if not mission.may_enter(name, region)),
        "initial": mission.initial_internal(name),
        "states": {state: sorted(names) for state, names in system.states.items()},
        "actions": [{"before": one.source, "after": one.target, "at": one.at} for one in system.actions],
        "visits": [{"region": visit.region, "direction": visit.direction} for visit in own.visits],
        "cycle_visit": own.cycle_visit,
        "changes": [
            {"visit": one.visit, "time": one.time, "before": one.source, "after": one.target}
            for one in certificate.actions
            if one.robot == name
        ],
        "cycle": certificate.cycles[name],
        "cuts": list(certificate.cuts.get(name, ())),
    }


def _edges(mission: Mission, name: str) -> dict[str, list[str]] | None:
    """Return where a robot's kind may go from where, both ways where edges are no arrows; nothing leads to the vertex of starts."""
    environment = mission.environment
    if environment is None:
        return None
    found: dict[str, set[str]] = {}
    for source, target in environment.open_to(mission.kind_of(name)):
        for one, other in [(source, target)] if environment.directed else [(source, target), (target, source)]:
            if other != environment.start:
                found.setdefault(one, set()).add(other)
    return {source: sorted(targets) for source, targets in found.items()}


def _sequence(mission: Mission) -> list[Any] | None:  # of any type: JSON nests
    if mission.passages is None:
        return None
    prefix, cycle = ([[p.hoop, p.direction] for p in part or ()] for part in (mission.passages.prefix, mission.passages.cycle))
    return [prefix, cycle or None]


def _waits(plan: Plan) -> list[Table]:
    found: list[Table] = [
        {"first": list(one.first), "then": list(one.then), "done": one.done, "due": one.due} for one in plan.precedences
    ]
    return found + [
        {"first": list(one.first), "then": list(one.then), "done": "entered", "due": "sets out"} for one in plan.meetings
    ]


def _words(plan: Plan) -> dict[str, list[list[str]]]:
    return {name: [sorted(letter) for letter in robot.word.prefix] for name, robot in plan.robots.items()}
