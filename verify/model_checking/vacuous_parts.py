"""Implications that hold only because what they speak of never happens: a warning, on which no claim rests."""

from __future__ import annotations

from collections.abc import Iterable

from verify.data.language.formula import Formula
from verify.logic.explanation import show
from verify.logic.normal_form import Normal, conjuncts, normal_form
from verify.logic.progression import OutOfBudget
from verify.logic.vacuity import implications
from verify.model_checking.inclusion import find_broken
from verify.model_checking.lassos import search_run
from verify.model_checking.robot_letters import cut_timeline, from_timeline
from verify.model_checking.team_graph import JointGraph
from verify.model_checking.timeline import Relations, Timeline


def vacuous_parts(formula: Formula, timelines: Iterable[Timeline], relations: Relations, budget: int) -> tuple[str, ...]:
    """Name the implications whose left side is false at every position of every robot's word.

    Args:
        formula: Asked.
        timelines: One for each robot.
        relations: What is proved of the regions at large.
        budget: Configurations that each question may take; beyond, nothing is said.
    """
    found, robots = list[str](), list(timelines)
    for implication, left in implications(formula):
        if left.counts:
            continue  # of one robot alone it says nothing
        never = conjuncts(normal_form(Formula("G", (Formula("!", (left,)),))))
        try:
            if all(_alone(timeline, part, relations, budget) for timeline in robots for part in never):
                found.append(f"`{show(implication)}` holds only because `{show(left)}` never happens.")
        except OutOfBudget:
            continue  # a warning less; no claim rests on it
    return tuple(dict.fromkeys(found))


def _alone(timeline: Timeline, part: Normal, relations: Relations, budget: int) -> bool:
    """Return whether every word of one robot by itself satisfies a conjunct (no claim: asked of ourselves only)."""
    robot = from_timeline(cut_timeline(timeline, part.propositions), relations)
    if robot.laps:
        return search_run(robot, part, budget) is None
    return find_broken(JointGraph([robot], timed=False), part, budget) is None
