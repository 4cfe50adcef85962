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
