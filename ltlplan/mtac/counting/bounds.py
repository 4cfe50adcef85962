"""How far robots surely have to fly for what a conjunct counts: a lower bound, by the cheapest ways of those that are nearest."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from ltlplan.search.counting.counting_propositions import shows
from ltlplan.search.label_setting import distances
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula
from verify.data.language.counting import Atom


def gathering(systems: Sequence[TransitionSystem], part: Formula, atoms: Mapping[str, Atom]) -> list[float]:
    """Return how far the robots have to fly at the least that a conjunct `F(...)` asks to be somewhere at one time.

    Args:
        systems: One for each robot.
        part: The conjunct, written out; of any other form nothing is known.
        atoms: Propositions of the whole team, by their texts.

    Returns:
        Costs of so many robots, the nearest ones, for the part of the conjunct that asks most; none where nothing is known.
    """
    if part.operator != "F":
        return []
    found = [_nearest(systems, asked, atoms) for asked in _together(part.arguments[0])]
    return max(found, key=sum, default=[])


def _together(formula: Formula) -> Iterator[Formula]:
    """Yield formulas that hold at one time where a conjunction does."""
    if formula.operator == "&":
        for argument in formula.arguments:
            yield from _together(argument)
    else:
        yield formula


def _nearest(systems: Sequence[TransitionSystem], asked: Formula, atoms: Mapping[str, Atom]) -> list[float]:
    """Return what the nearest robots pay to be where a count or a name asks them to be."""
    denied = asked.operator == "!"
    atom = atoms.get((asked.arguments[0] if denied else asked).atom)
    if atom is None or (denied and atom.robot):
        return []
    counted = Formula("!", (atom.counted,)) if denied else atom.counted
    number = len(systems) - atom.least + 1 if denied else atom.least
    far = [_far(system, counted) for system in systems if atom.robot in ("", system.robot)]
    nearest = sorted(far)[:number]
    return nearest if all(math.isfinite(cost) for cost in nearest) else []


def _far(system: TransitionSystem, counted: Formula) -> float:
    """Return what the cheapest way from a robot's start to where its letter satisfies a Boolean combination costs."""
    costs = distances([system.initial], lambda node: system.edges[node])
    return min((cost for node, cost in costs.items() if shows(counted, system.labels[node])), default=math.inf)
