"""The judge of words as it was: every robot's every letter interleaved with every other's, and each answer Spot's as well."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Literal

from verify.data import Formula
from verify.logic.normal_form import Normal, conjuncts, normal_form
from verify.logic.progression import OutOfBudget
from verify.model_checking.inclusion import find_broken, holds_for_all
from verify.model_checking.robot_letters import RobotBehaviour, from_timeline
from verify.model_checking.team_graph import JointGraph, OwnGraph
from verify.model_checking.timeline import Relations, Timeline


def plainly(
    formula: Formula,
    timelines: Sequence[Timeline],
    relations: Relations,
    team: str,
    *,
    timed: bool = True,
    clock_error: Fraction = Fraction(0),
    budget: int = 20_000,
    spot: bool = True,
) -> Literal["holds", "fails", "undecided"]:
    """Decide whether every team word satisfies the formula."""
    answers = [
        _part(part, [from_timeline(line, relations) for line in timelines], team, timed, clock_error, budget, spot)
        for part in conjuncts(normal_form(formula))
    ]
    return "fails" if False in answers else "undecided" if None in answers else "holds"


def _part(
    part: Normal, robots: list[RobotBehaviour], team: str, timed: bool, clock_error: Fraction, budget: int, spot: bool
) -> bool | None:
    graph = (JointGraph if team == "joint" else OwnGraph)(robots, timed=timed, clock_error=clock_error)
    try:
        return (holds_for_all if spot else find_broken)(graph, part, budget) is None
    except OutOfBudget:
        return None
