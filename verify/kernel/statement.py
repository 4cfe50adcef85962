"""A statement that is to be proved, as exact values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any


@dataclass(frozen=True, slots=True)
class Robot:
    """One robot.

    Attributes:
        edges: Where it may go from a vertex; None for from everywhere to everywhere.
        vertex: Where it counts as coming from at the start.
        closed: Regions that it may not enter.
        states: The propositions of each internal state.
    """

    edges: Mapping[str, frozenset[str]] | None
    vertex: str
    closed: frozenset[str]
    states: Mapping[str, frozenset[str]]


@dataclass(frozen=True, slots=True)
class Statement:
    """All that is to be proved of a flight.

    Attributes:
        lasso: Whether laps are flown for ever.
        joint: Whether letters of robots are joined; else each robot is read by itself.
        formula: As nested lists.
        clock_error: s.
        regions: By name.
        robots: By name, in the mission's order.
    """

    lasso: bool
    joint: bool
    formula: Any  # of any type: JSON nests
    clock_error: Fraction
    regions: Mapping[str, object]
    robots: Mapping[str, Robot]
