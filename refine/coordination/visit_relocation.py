"""Other places for visits within their regions, where no departures keep robots apart that fly to the planned ones."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from refine.coordination.avoidance.conflict_resolution import departures_of
from refine.coordination.departures import DepartureConflict
from refine.coordination.spacing import idle_others
from refine.corridor.legs import HOVERING
from refine.corridor.relocation import relocations
from refine.obstacles.keep_out_bodies import Ball, keep_out
from refine.single_robot.flight import robot_flight
from refine.single_robot.task import Problem, RobotFlight
from verify.data import Infeasible, Plan
from verify.data.validation.spacing import Spacing

_PLACES = 3
"""Other places that each visit of a robot in conflict is tried at."""
_LOOKED_AT = 4096
_COMBINATIONS = 64
_RESTING = 16
"""Combinations of places that are tried with waits on the way."""


def with_visits_relocated(
    problem: Problem, robots: dict[str, RobotFlight]
) -> tuple[dict[str, RobotFlight], dict[str, float]] | None:
    """Return the team with visits of robots in conflict made elsewhere in their regions; None where that does not part them.

    Combinations are tried from the planned places outwards; one in which some two robots cannot be parted even by themselves
    is passed over.

    Args:
        problem: What is refined.
        robots: The team's flights, which no departures keep apart.
    """
    apart: dict[tuple[str, int, str, int], bool] = {}
    choices = {name: [robot] for name, robot in robots.items()}

    def parted(one: str, i: int, other: str, j: int) -> bool:
        key = (one, i, other, j)
        if key not in apart:
            pair = {one: choices[one][i], other: choices[other][j]}
            apart[key] = not isinstance(departures_of(problem, pair), DepartureConflict)
        return apart[key]

    pairs = list(itertools.combinations(robots, 2))
    met = {name for one, other in pairs if not parted(one, 0, other, 0) for name in (one, other)}
    for name in (name for name in robots if name in met or not met):
        choices[name] += _relocated(problem, name)
    worth_trying = (
        at
        for at in itertools.islice(_combined(choices), 1, _LOOKED_AT)
        if all(parted(one, at[one], other, at[other]) for one, other in pairs)
    )
    fastest: dict[tuple[str, int], RobotFlight] = {(name, 0): robot for name, robot in robots.items()}
    for at in itertools.islice(worth_trying, _COMBINATIONS):
        team = {name: choices[name][index] for name, index in at.items()}
        if isinstance(departures_of(problem, team), DepartureConflict):
            continue
        for name, index in at.items():
            if (name, index) not in fastest:
                fastest[name, index] = _at_best(problem, choices[name][index])
            team[name] = fastest[name, index]
        found = departures_of(problem, team)
        if not isinstance(found, DepartureConflict):
            return team, found
    return None


def _at_best(problem: Problem, tried: RobotFlight) -> RobotFlight:
    """Return the fastest flight to the places of one that was tried quickly; that one itself where it flies as planned."""
    plan, name = problem.plan, tried.name
    if problem.options.share(plan.mission, name) is None:
        return tried
    changed = plan.model_copy(update={"robots": {**plan.robots, name: tried.plan}})
    return robot_flight(replace(problem, plan=changed), name, idle_others(problem, name))


def _relocated(problem: Problem, name: str) -> list[RobotFlight]:
    """Return flights of one robot whose visits are made at other places of their regions, found quickly."""
    problem = replace(problem, options=replace(problem.options, effort="least"))
    plan, idle = problem.plan, idle_others(problem, name)
    ways = [place for other in plan.robots if other != name for place in _passages(plan, other, problem.spacing)]
    flights = []
    for relocated in relocations(plan.mission, name, plan.robots[name], idle, (*idle, *ways), _PLACES):
        changed = plan.model_copy(update={"robots": {**plan.robots, name: relocated}})
        try:
            flights.append(robot_flight(replace(problem, plan=changed), name, idle))
        except Infeasible:
            continue  # the other places may do
    return flights


def _combined(choices: dict[str, list[RobotFlight]]) -> Iterator[dict[str, int]]:
    """Yield combinations of choices, those nearest to everyone's first one first."""
    sizes = [len(each) for each in choices.values()]
    for total in range(sum(sizes) - len(sizes) + 1):
        for choice in _summing_to(total, sizes):
            yield dict(zip(choices, choice, strict=True))


def _summing_to(total: int, sizes: list[int]) -> Iterator[tuple[int, ...]]:
    """Yield tuples of indices below these sizes with a given sum, in order."""
    if not sizes:
        yield from [()] if total == 0 else []
        return
    for first in range(min(total, sizes[0] - 1) + 1):
        for others in _summing_to(total - first, sizes[1:]):
            yield (first, *others)


def resting_teams(problem: Problem) -> list[dict[str, RobotFlight]]:
    """Return teams whose robots rest at every point, with visits at the planned places and at others.

    Args:
        problem: What is refined.
    """
    choices: dict[str, list[RobotFlight]] = {}
    for name in problem.plan.robots:
        choices[name] = _relocated(problem, name)
        try:
            choices[name].insert(0, robot_flight(problem, name, idle_others(problem, name)))
        except Infeasible:
            continue  # the other places may do
    return [{name: choices[name][index] for name, index in at.items()} for at in itertools.islice(_combined(choices), _RESTING)]


def _passages(plan: Plan, name: str, spacing: Spacing) -> list[Ball]:
    """Return the places that a robot cannot but fly through: where it passes hoops."""
    points = plan.robots[name].waypoints
    through = [
        (np.array(a.position), np.array(b.position))
        for a, b in itertools.pairwise(points)
        if a.visit is not None and a.visit == b.visit and a.region in plan.mission.hoops
    ]
    return [
        keep_out(f"the passage of {name}", a + share * (b - a), spacing.distance + HOVERING, spacing.z_scale)
        for a, b in through
        for share in (0.0, 0.5, 1.0)
    ]
