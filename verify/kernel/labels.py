"""Labels of robots over time, as the geometric half proves them and as words are made of: plain values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations


@dataclass(frozen=True, slots=True)
class Span:
    """A closed time with one status: `no` and `must` hold at every instant of it, ends included; in `may` anything happens.

    A `rise` is exactly one change from `no` to `must` at an unknown instant, between a `no` and a `must`; a `fall` the other way.
    """

    start: Fraction
    stop: Fraction
    mark: str


Row = tuple[Span, ...]


@dataclass(frozen=True, slots=True)
class Timeline:
    """Labels of one robot over time.

    Attributes:
        robot: Name.
        duration: When the team's flight, or its first lap, ends, s.
        rows: For each region spans over all of [0, duration], one after another. Between a `no` and a `must` that are neighbours in
            time there is a `may`, if only of an instant.
        internal: Internal propositions at time 0.
        actions: Exact instants, rising, at which internal propositions change, and what they are from then on.
        cycle: When the lap begins; None for a finite flight.
    """

    robot: str
    duration: Fraction
    rows: Mapping[str, Row]
    internal: frozenset[str]
    actions: tuple[tuple[Fraction, frozenset[str]], ...]
    cycle: Fraction | None


@dataclass(frozen=True, slots=True)
class Relations:
    """Proved relations of regions.

    Attributes:
        disjoint: Pairs without a common point, each sorted by name.
        nested: Pairs (inner, outer): each point of the inner one lies in the outer one.
    """

    disjoint: frozenset[tuple[str, str]]
    nested: frozenset[tuple[str, str]]

    def allow(self, inside: frozenset[str], known: frozenset[str]) -> bool:
        """Return whether a point can lie in exactly these of the regions that are known."""
        apart = any(pair in self.disjoint for pair in combinations(sorted(inside), 2))
        return not apart and not any((inner, outer) in self.nested for inner in inside for outer in known - inside)
