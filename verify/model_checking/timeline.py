"""The label timeline of one robot: for all times, where it must, may or must not be.

`verify.motion.membership` makes timelines from polynomials, `verify.recordings.sampled_timelines` from recorded flights; `word_claims`
reads them.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Literal

Status = Literal["no", "may", "must"]
"""Within the margin of the path: out of the region for sure, unknown, in it for sure."""


@dataclass(frozen=True, slots=True)
class Enclosure:
    """A closed interval of exact times, in s, that holds one instant."""

    low: Fraction
    high: Fraction


@dataclass(frozen=True, slots=True)
class Change:
    """A region's status changes once, at one instant within `time`.

    A direct change between "no" and "must" is exactly one crossing of the boundary (at margin 0, one simple root);
    an interval of "may" allows any finite number of crossings.
    """

    time: Enclosure
    region: str
    status: Status


@dataclass(frozen=True, slots=True)
class InternalChange:
    """The internal propositions become `propositions`: at exactly `time`, or at some instant from there until `until`.

    Planned actions happen at exact times; of a recording it is only known between which samples they happened.
    """

    time: Fraction
    source: str
    target: str
    at: str
    visit: int
    propositions: frozenset[str]
    until: Fraction | None = None


@dataclass(frozen=True, slots=True)
class Timeline:
    """One robot's statuses over [0, duration]; every change is inside that interval.

    Attributes:
        robot: Name.
        initial: Status of every region at time 0.
        changes: Sorted by `time.low`; those of one region never overlap.
        duration: T of the whole team, in s. For a lasso: end of the first lap.
        internal: Internal propositions at time 0.
        actions: Changes of the internal state, sorted by time.
        cycle: Time at which the cycle begins, for a lasso; None for a finite flight.
        unplanned: Whether the stay in which the flight begins is no visit of the plan.
    """

    robot: str
    initial: dict[str, Status]
    changes: tuple[Change, ...]
    duration: Fraction
    internal: frozenset[str] = frozenset()
    actions: tuple[InternalChange, ...] = ()
    cycle: Fraction | None = None
    unplanned: bool = False


@dataclass(frozen=True, slots=True)
class Relations:
    """Proved relations of regions at large, so that impossible letters are left out.

    Attributes:
        disjoint: Pairs of regions (sorted by name) with no common point.
        nested: Pairs (inner, outer): every point of inner lies in outer.
        followed: Regions that letters tell of; nothing is concluded from others. None for all.
    """

    disjoint: frozenset[tuple[str, str]] = field(default_factory=frozenset)
    nested: frozenset[tuple[str, str]] = field(default_factory=frozenset)
    followed: frozenset[str] | None = None

    def among(self, regions: Collection[str]) -> Relations:
        """Return what is proved of these regions alone: where others are not followed, nothing can be told from them."""
        kept = frozenset(regions)
        return replace(self, followed=kept if self.followed is None else kept & self.followed)

    def allows(self, letter: frozenset[str]) -> bool:
        """Return whether a set of regions can be the set that one point lies in."""
        known = letter if self.followed is None else letter & self.followed
        if any(pair in self.disjoint for pair in itertools.combinations(sorted(known), 2)):
            return False
        return all(
            outer in known or inner not in known or not (self.followed is None or outer in self.followed)
            for inner, outer in self.nested
        )
