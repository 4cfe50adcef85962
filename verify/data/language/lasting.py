"""Propositions that a formula fixes for a whole mission: rooms that a robot may not leave, and regions that it may never be in."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from verify.data.language.formula import Formula

if TYPE_CHECKING:  # a mission reads formulas
    from verify.data.mission import Mission

Literal = tuple[str, str, bool]
"""A name, the robot whose it is (empty: of each), and whether it is true."""


def lasting_regions(mission: Mission, robot: str, *, inside: bool) -> frozenset[str]:
    """Return the regions that a robot may never leave, or may never be in, as conjuncts `G` of the formula say.

    Args:
        mission: Whose formula.
        robot: The robot's name.
        inside: Whether it may not leave them; else it may not be in them.
    """
    each = len(mission.agents) == 1 or mission.spec.team != "joint"
    said = _lasting(mission.formula, each)
    return frozenset(
        name for name, whose, value in said if whose in ("", robot) and value == inside and name in mission.all_regions
    )


@lru_cache(maxsize=64)
def _lasting(formula: Formula, each: bool) -> frozenset[Literal]:
    """Return what conjuncts `G` say of robots at all times; plain names of each robot, or else true where some robot shows them."""
    always = (part.arguments[0] for part in formula.conjuncts() if part.operator == "G" and part.bound is None)
    return frozenset[Literal]().union(*(_literals(part, True, each) for part in always))


def _literals(formula: Formula, value: bool, each: bool) -> frozenset[Literal]:
    """Return literals that hold wherever a formula has this value."""
    match formula.operator:
        case "name":
            said = formula.robot or each or not value  # that some robot shows a name says nothing of any one of them
            return frozenset({(formula.name, formula.robot, value)}) if said else frozenset()
        case "!":
            return _literals(formula.arguments[0], not value, each)
        case "count" if not value and formula.bound == (">=", 1):
            return _literals(formula.arguments[0], False, True)
        case "&" | "|" as operator:
            found = [_literals(part, value, each) for part in formula.arguments]
            return frozenset[Literal]().union(*found) if (operator == "&") == value else frozenset.intersection(*found)
        case _:
            return frozenset()
