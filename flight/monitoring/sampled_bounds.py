"""Parts of a formula that are bounded in seconds, of a flight that is sampled: letters change somewhere between two samples."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from fractions import Fraction

from verify.data import Formula, Letter
from verify.data.language.counting import atoms
from verify.logic.team_letters import TeamLetters
from verify.model_checking.timing.instants import at
from verify.model_checking.timing.team_instants import TeamInstants, ticks_per_second
from verify.model_checking.timing.timed_formula import TimedFormula, bounds_of

_MOST = 8
"""Robots whose letters may change between the same two samples; of more nothing is known there."""

Known = tuple[int, frozenset[Letter] | None]
"""A cut, and the team's letters from it on: all that are possible; None where nothing is known."""
Changes = Sequence[tuple[int, Mapping[str, Letter]]]
"""Samples at which letters were seen to have changed, and to what, by robot; the first gives all letters."""


def may_be_kept(part: Formula, changes: Changes, step: Fraction, end: float, *, finite: bool = True) -> bool:
    """Return whether a flight may satisfy a part, as far as its samples tell. Nobody wins by landing.

    Args:
        part: Bounded in seconds, written out for the team.
        changes: In order.
        step: Time between two samples, s.
        end: When the flight ended, s.
        finite: Whether the trace ends with it; of laps for ever it is not known what comes.
    """
    scale = ticks_per_second([step, Fraction(end).limit_denominator(10**6), *bounds_of(part)])
    ticks, last = int(step * scale), int(Fraction(end).limit_denominator(10**6) * scale)
    reading = TeamLetters.of(part, atoms(part))
    held: dict[str, Letter] = {}
    seen: list[Known] = []
    between: list[Known] = []
    for sample, change in changes:
        new = {**held, **change}
        if sample > 0:
            between.append((2 * (sample - 1) * ticks + 1, _either(reading, held, change)))
        now = (2 * sample * ticks, frozenset({reading.letter(new)}))
        seen.append(now)
        between.append(now)
        held = new
    if not finite:
        between.append((2 * last + 1, None))
    plain, blurred = (TimedFormula(TeamInstants(*_columns(letters)), last, scale) for letters in (seen, between))
    found = plain.sure(part)
    landed = finite and at(found.held, 0) and not at(found.flown, 0)
    return not landed and not at(blurred.sure(part, negated=True).held, 0)


def _columns(letters: Sequence[Known]) -> tuple[tuple[int, ...], tuple[frozenset[Letter] | None, ...]]:
    return tuple(cut for cut, _ in letters), tuple(shown for _, shown in letters)


def _either(reading: TeamLetters, held: Mapping[str, Letter], change: Mapping[str, Letter]) -> frozenset[Letter] | None:
    """Return the team's letters while some robots show either what they showed or what they come to show."""
    if len(change) > _MOST:
        return None
    choices = [[(robot, held[robot]), (robot, letter)] for robot, letter in change.items()]
    return frozenset(reading.letter({**held, **dict(chosen)}) for chosen in itertools.product(*choices))
