"""Waits in the middle of flights, where no departure times keep the planned precedences."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from refine.coordination.departures import GRID, STEP
from refine.coordination.spacing import flight_of, idle_others
from refine.obstacles.keep_out_bodies import Ball
from refine.single_robot.flight import robot_flight
from refine.single_robot.hovers import hovering_longer, with_hovers
from refine.single_robot.task import NOWHERE, Problem, RefinementOptions, RobotFlight
from verify.data import Infeasible, Plan, Witness
from verify.data.plan import Meeting, Precedence

Halt = tuple[str, int]
"""A robot, and the visit for which it sets out after a wait."""


def with_waits(
    problem: Problem,
    robots: dict[str, RobotFlight],
    kept_clear: Mapping[str, tuple[Ball, ...]] = MappingProxyType({}),
    least: Mapping[Halt, float] = MappingProxyType({}),
) -> dict[str, RobotFlight]:
    """Return the team with hovers in the middle of flights, just long enough for the planned precedences.

    Each robot that must wait for another rests where it sets out for the visit concerned. Waits are made longer until all
    precedences hold with everyone departing at once; precedences that go round in a circle never settle. Where they do not, and
    robots wait to act, these come to their regions first, and rest there before they act.

    Args:
        problem: What is refined.
        robots: The team's flights without waits.
        kept_clear: For each robot bodies that its flight keeps out of, beside robots that never move.
        least: s for which robots wait at the least.

    Raises:
        Infeasible: They never settle, or a robot cannot rest where it would have to wait.
        SolverTimeout: An engine's seconds ran out.
    """
    try:
        return _with_waits(problem, robots, kept_clear, least)
    except Infeasible:
        if not any(wait.due == "acts" for wait in problem.plan.precedences):
            raise
        return _with_waits(replace(problem, options=replace(problem.options, lingers=True)), robots, kept_clear, least)


def _with_waits(
    problem: Problem, robots: dict[str, RobotFlight], kept_clear: Mapping[str, tuple[Ball, ...]], least: Mapping[Halt, float]
) -> dict[str, RobotFlight]:
    plan, precedences = problem.plan, problem.feedback.precedences
    rests: dict[str, frozenset[int]] = dict.fromkeys(robots, NOWHERE)
    for precedence in precedences:
        if isinstance(precedence, Precedence):  # where it waits for a meeting it rests anyway
            name, visit = _halt(precedence, problem.options)
            rests[name] |= {visit}
    resting = (
        robots
        if not any(rests.values()) and plan.meetings
        else {
            name: robot
            if robot.corridor is None
            else robot_flight(problem, name, (*idle_others(problem, name), *kept_clear.get(name, ())), rests[name])
            for name, robot in robots.items()
        }
    )
    waits = dict(least)
    gap = max(GRID, 2 * (problem.spacing.skew + STEP))
    for _ in range(4 * len(precedences) ** 2 + 8):
        held = {name: _holding(robot, waits) for name, robot in resting.items()}
        flights = {name: flight_of(plan, robot) for name, robot in held.items()}
        late: dict[tuple[str, int], float] = {}
        for precedence in precedences:
            (first, _), then = precedence.first, _halt(precedence, problem.options)
            short = flights[first].done(precedence) + gap - flights[then[0]].due(precedence)
            if short > 0.0:
                longer = short * _parts(plan, precedence) if problem.options.lingers else short + late.get(then, 0.0)
                late[then] = max(late.get(then, 0.0), float(np.ceil(longer / GRID) * GRID))
        if not late:
            return held
        waits.update({then: waits.get(then, 0.0) + longer for then, longer in late.items()})
    sentence = (
        "No waits keep all planned precedences: they go round in a circle, or a robot would have to wait within a region "
        "that it is to have left by then."
    )
    raise Infeasible(sentence, Witness(claim="formula", sentence=sentence))


def _halt(wait: Precedence | Meeting, options: RefinementOptions) -> tuple[str, int]:
    """Return who waits, and the visit that it sets out for afterwards; one more than its last where it flies to its end or stays."""
    name, visit = wait.then
    stays = isinstance(wait, Precedence) and (wait.due == "leaves" or (wait.due == "acts" and options.lingers))
    return name, visit + stays


def _parts(plan: Plan, wait: Precedence | Meeting) -> int:
    """Return by how much longer a robot stays than its first action there is to be later: actions are spread evenly over a stay."""
    if isinstance(wait, Meeting) or wait.due != "acts":
        return 1
    name, visit = wait.then
    return len(plan.robots[name].visits[visit].actions) + 1


def _holding(robot: RobotFlight, waits: dict[tuple[str, int], float]) -> RobotFlight:
    """Return a robot that hovers where it waits for a visit; one that never moves hovers for longer."""
    if robot.corridor is None:
        return hovering_longer(robot, sum(wait for (name, _), wait in waits.items() if name == robot.name))
    return with_hovers(robot, {node: waits.get((robot.name, visit), 0.0) for visit, node in robot.halts.items()})
