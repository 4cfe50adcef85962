"""Regions that a formula forbids to a robot, for as long as it flies or for a while: to each leg what obstacles are."""

from __future__ import annotations

from functools import lru_cache

from ltlplan.logic.signed_parts import signed_parts
from verify.data import Formula, Mission

_Names = frozenset[tuple[str, str]]
"""Propositions, each with the robot whose it is; of any robot where that is empty."""


def regions_to_avoid(mission: Mission, robot: str) -> frozenset[str]:
    """Return the regions that the formula may forbid to a robot at some time: those by whose names it may lose. Counts forbid nothing to one robot.

    Args:
        mission: Whose formula.
        robot: The robot's name.
    """
    return frozenset(name for name, whose in _losing(mission.written) if whose in ("", robot) and name in mission.regions)


@lru_cache(maxsize=64)
def _losing(formula: Formula) -> _Names:
    parts = (node for node, gains in signed_parts(formula, counted=False) if not gains and node.operator == "name")
    return frozenset((node.name, node.robot) for node in parts)


def forbidden_regions(mission: Mission, robot: str) -> frozenset[str]:
    """Return the regions that a robot may never be in, as conjuncts `G` of the formula say.

    Args:
        mission: Whose formula.
        robot: The robot's name.
    """
    never = _never(mission.formula)
    return frozenset(name for name, whose in never if whose in ("", robot) and name in mission.regions)


@lru_cache(maxsize=64)
def _never(formula: Formula) -> _Names:
    always = [part.arguments[0] for part in formula.conjuncts() if part.operator == "G" and part.bound is None]
    return frozenset[tuple[str, str]]().union(*map(_false_in, always))


def _false_in(formula: Formula) -> _Names:
    """Return propositions that are false wherever a formula is true."""
    return _combined(formula, "&") if formula.operator != "!" else _true_in(formula.arguments[0])


def _true_in(formula: Formula) -> _Names:
    """Return propositions whose truth makes a formula true."""
    if formula.operator == "name":
        return frozenset({(formula.name, formula.robot)})
    return _combined(formula, "|") if formula.operator != "!" else _false_in(formula.arguments[0])


def _combined(formula: Formula, union: str) -> _Names:
    read = _false_in if union == "&" else _true_in
    if formula.operator not in ("&", "|"):
        return frozenset()
    each = [read(part) for part in formula.arguments]
    return frozenset[tuple[str, str]]().union(*each) if formula.operator == union else frozenset.intersection(*each)
