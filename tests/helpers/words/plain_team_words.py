"""What formulas with counts mean, written plainly: a team word is a sequence of what each robot shows, and nothing is shortened."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from random import Random

from verify.data import Formula, Letter
from verify.model_checking.timeline import Timeline

Held = Mapping[str, Letter]
"""What each robot shows at one position."""

_COMPARED = {
    ">=": lambda a, b: a >= b,
    "<=": lambda a, b: a <= b,
    "==": lambda a, b: a == b,
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
}


def holds(formula: Formula, word: Sequence[Held], at: int = 0, me: str | None = None) -> bool:
    """Tell whether a formula as it was written holds of a team word from a position on; `me`: whose names plain ones are."""
    rest = range(at, len(word))
    here, arguments = word[at], formula.arguments
    match formula.operator:
        case "true" | "false":
            return formula.operator == "true"
        case "name":
            owner = formula.robot or me
            return formula.name in here[owner] if owner else any(formula.name in letter for letter in here.values())
        case "count" | "all" | "some":
            number = sum(holds(arguments[0], [{name: letter}], 0, name) for name, letter in here.items())
            if formula.operator == "count":
                return _COMPARED[formula.bound[0]](number, formula.bound[1])
            return number == len(here) if formula.operator == "all" else number > 0
        case "each":
            return all(holds(arguments[0], word, at, name) for name in here)
        case "!":
            return not holds(arguments[0], word, at, me)
        case "&":
            return all(holds(part, word, at, me) for part in arguments)
        case "|":
            return any(holds(part, word, at, me) for part in arguments)
        case "->":
            return not holds(arguments[0], word, at, me) or holds(arguments[1], word, at, me)
        case "xor" | "<->":
            same = holds(arguments[0], word, at, me) == holds(arguments[1], word, at, me)
            return same == (formula.operator == "<->")
        case "F":
            return any(holds(arguments[0], word, i, me) for i in rest)
        case "G":
            return all(holds(arguments[0], word, i, me) for i in rest)
    first, second = arguments
    ends = [i for i in rest if holds(second if formula.operator in "UW" else first, word, i, me)]
    if formula.operator in "UW":
        kept = any(all(holds(first, word, i, me) for i in range(at, end)) for end in ends)
        return kept or (formula.operator == "W" and all(holds(first, word, i, me) for i in rest))
    released = any(all(holds(second, word, i, me) for i in range(at, end + 1)) for end in ends)
    return released or (formula.operator == "R" and all(holds(second, word, i, me) for i in rest))


def in_turn(words: Mapping[str, Sequence[Letter]]) -> Iterator[list[Held]]:
    """Yield the team words of robots that fly one after another, in every order."""
    for order in itertools.permutations(words):
        held = {name: word[0] for name, word in words.items()}
        found = [dict(held)]
        for name in order:
            for letter in words[name][1:]:
                held[name] = letter
                found.append(dict(held))
        yield found


def at_once(words: Mapping[str, Sequence[Letter]]) -> Iterator[list[Held]]:
    """Yield the team words in which some robots, any number of them, go on by one letter at each position."""
    names = list(words)

    def further(at: tuple[int, ...]) -> Iterator[list[Held]]:
        here = {name: words[name][i] for name, i in zip(names, at, strict=True)}
        if all(i + 1 == len(words[name]) for name, i in zip(names, at, strict=True)):
            yield [here]
        choices = [(i, i + 1) if i + 1 < len(words[name]) else (i,) for name, i in zip(names, at, strict=True)]
        for after in itertools.product(*choices):
            if after != at:
                for rest in further(after):
                    yield [here, *rest]

    yield from further((0,) * len(names))


def some_flight(rng: Random, timelines: Mapping[str, Timeline], clock_error: Fraction) -> list[Held]:
    """Return a team word of one flight that agrees with the timelines: membership of each region at each time, regions closed.

    It lasts until the robot whose clock is furthest behind has finished.
    """
    inside = {name: _memberships(rng, timeline, clock_error) for name, timeline in timelines.items()}
    duration = next(iter(timelines.values())).duration + clock_error
    times = {Fraction(0), duration}
    for spells in inside.values():
        times |= {t for found in spells.values() for low, high in found for t in (low, high) if 0 <= t <= duration}
    ordered = sorted(times)
    middles = [(a + b) / 2 for a, b in itertools.pairwise(ordered)]
    return [
        {
            name: frozenset(region for region, found in spells.items() if any(low <= time <= high for low, high in found))
            for name, spells in inside.items()
        }
        for time in sorted({*ordered, *middles})
    ]


def _memberships(rng: Random, timeline: Timeline, clock_error: Fraction) -> dict[str, list[tuple[Fraction, Fraction]]]:
    """Return for each region the closed spells for which a robot is in it, on a clock that is off by up to the error."""
    late = clock_error * Fraction(rng.randint(0, 4), 4)
    found: dict[str, list[tuple[Fraction, Fraction]]] = {}
    for region, initial in timeline.initial.items():
        since, status = Fraction(-100), initial
        spells: list[tuple[Fraction, Fraction]] = []
        for change in [c for c in timeline.changes if c.region == region]:
            at = change.time.low + (change.time.high - change.time.low) * Fraction(rng.randint(0, 4), 4)
            spells += _spells(rng, status, since, at)
            since, status = at, change.status
        spells += _spells(rng, status, since, Fraction(100))
        found[region] = [(low + late, high + late) for low, high in spells]
    return found


def _spells(rng: Random, status: str, low: Fraction, high: Fraction) -> list[tuple[Fraction, Fraction]]:
    if status == "no" or (status == "may" and rng.random() < 0.3):
        return []
    if status == "must" or rng.random() < 0.2:
        return [(low, high)]
    low, high = max(low, Fraction(0)), min(high, Fraction(12))
    cuts = sorted(low + (high - low) * Fraction(rng.randint(0, 8), 8) for _ in range(4)) if low <= high else []
    return list(zip(cuts[::2], cuts[1::2], strict=True))
