"""The checker of `proofs/Invariant.v` in Python, and a finder that writes what it checks.

Formulas are tuples, operator first: `("+", p)`, `("-", p)`, `("t",)`, `("f",)`, `("&", f, g)`, `("|", f, g)`, `("U", f, g)`,
`("R", f, g)`. A state is a set of alternatives, each a set of obligations.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

Formula = tuple[Any, ...]
State = frozenset[frozenset[Formula]]
Letter = frozenset[int]
Robot = tuple[list[Letter], list[tuple[int, int]]]
Places = tuple[int, ...]
Move = tuple[Letter | None, Any]
Alternative = frozenset[Formula]
Configuration = tuple[Any, Alternative]
Invariant = list[list[Configuration]]
NOTHING: State = frozenset({frozenset()})


# Progression


def normal(spec: Formula, sign: bool = True) -> Formula:
    """Return a mission's formula with negation at propositions only."""
    operator, *parts = spec
    if operator == "a":
        return ("+" if sign else "-", parts[0])
    if operator == "t":
        return ("t" if sign else "f",)
    if operator == "!":
        return normal(parts[0], not sign)
    dual = {"&": "|", "|": "&", "U": "R", "R": "U"}
    return (operator if sign else dual[operator], *(normal(part, sign) for part in parts))


def absorbed(alternatives: set[frozenset[Formula]]) -> State:
    return frozenset(c for c in alternatives if not any(d < c for d in alternatives))


def both(s: State, t: State) -> State:
    return absorbed({c | d for c in s for d in t})


def either(s: State, t: State) -> State:
    return absorbed(set(s | t))


def progress(letter: Letter, f: Formula) -> State:
    operator = f[0]
    if operator in "+-tf":
        now = operator == "t" or (operator in "+-" and (f[1] in letter) == (operator == "+"))
        return NOTHING if now else frozenset()
    left, right = progress(letter, f[1]), progress(letter, f[2])
    again = frozenset({frozenset({f})})
    if operator == "U":
        return either(right, both(left, again))
    if operator == "R":
        return both(right, either(left, again))
    return (both if operator == "&" else either)(left, right)


def progress_state(letter: Letter | None, state: State) -> State:
    if letter is None:
        return state
    after: State = frozenset()
    for alternative in state:
        owed = NOTHING
        for f in alternative:
            owed = both(owed, progress(letter, f))
        after = either(after, owed)
    return after


def accepts(state: State) -> bool:
    return any(all(f[0] in "Rt" for f in c) for c in state)


def satisfies(spec: Formula, word: list[Letter]) -> bool:
    state: State = frozenset({frozenset({normal(spec)})})
    for letter in word:
        state = progress_state(letter, state)
    return accepts(state)


# Invariants


@dataclass(frozen=True)
class Span:
    """Where the followed robots may be, and which letters others may show (joint: add)."""

    places: tuple[tuple[int, ...], ...]
    others: tuple[Letter, ...]


class Team:
    """The moves of followed robots: `joint`, of places; `own`, of places with who was read since its letter changed."""

    def __init__(self, robots: list[Robot], own: bool, last: list[Places]) -> None:
        self.robots = robots
        self.own = own
        self.last = last

    def starts(self, places: list[Places], first: Span) -> list[Move]:
        if self.own:
            return [(None, tuple((q, False) for q in at)) for at in places]
        return [move for at in places for move in self._shown(first, at)]

    def enters(self, span: Span, at: Any) -> list[Move]:
        places = tuple(q for q, _ in at) if self.own else at
        if not all(q in permitted for q, permitted in zip(places, span.places, strict=True)):
            return []
        return [(None, at)] if self.own else self._shown(span, at)

    def _shown(self, span: Span, at: Any) -> list[Move]:
        own = frozenset[int]().union(*(shown[q] for (shown, _), q in zip(self.robots, at, strict=True)))
        return [(own | letter, at) for letter in span.others]

    def final(self, at: Any) -> bool:
        places = tuple(q for q, _ in at) if self.own else at
        ended = all(q in permitted for q, permitted in zip(places, self.last, strict=True))
        return ended and (not self.own or all(read for _, read in at))

    def moves(self, span: Span, at: Any) -> list[Move]:
        if not self.own:
            choices = [[q, *(y for x, y in changes if x == q)] for (_, changes), q in zip(self.robots, at, strict=True)]
            return [move for to in product(*choices) for move in self.enters(span, to)]
        found: list[Move] = [(self.robots[i][0][q], (*at[:i], (q, True), *at[i + 1 :])) for i, (q, _) in enumerate(at)]
        found += [(letter, at) for letter in span.others]
        for i, ((shown, changes), (q, read)) in enumerate(zip(self.robots, at, strict=True)):
            for x, y in changes:
                if x == q and y in span.places[i] and (read or shown[x] == shown[y]):
                    found.append((None, (*at[:i], (y, read and shown[x] == shown[y]), *at[i + 1 :])))
        return found

    def below(self, other: Any, at: Any) -> bool:
        """Tell whether `other` may do all that `at` may: it was read at least where that was."""
        return other == at or (self.own and all(q == r and b >= c for (q, b), (r, c) in zip(other, at, strict=True)))


def after(letter: Letter | None, alternative: Alternative) -> State:
    return progress_state(letter, frozenset({alternative}))


def over(alternative: Alternative) -> bool:
    """Tell whether the empty word satisfies all that is owed."""

    def empty(f: Formula) -> bool:
        if f[0] in "&|":
            return (all if f[0] == "&" else any)(map(empty, f[1:]))
        return f[0] in "tR"

    return all(map(empty, alternative))


def check_invariant(team: Team, spec: Formula, starts: list[Move], spans: list[Span], invariant: Invariant) -> bool:
    def covered(entries: list[Configuration], at: Any, alternative: Alternative) -> bool:
        return any(less <= alternative and team.below(other, at) for other, less in entries)

    def all_covered(entries: list[Configuration], alternative: Alternative, moves: list[Move]) -> bool:
        return all(covered(entries, to, less) for letter, to in moves for less in after(letter, alternative))

    return (
        bool(invariant)
        and len(invariant) == len(spans)
        and all_covered(invariant[0], frozenset({normal(spec, False)}), starts)
        and all(
            all_covered(entries, alternative, team.moves(span, at))
            for span, entries in zip(spans, invariant, strict=True)
            for at, alternative in entries
        )
        and all(
            all_covered(later, alternative, team.enters(span, at))
            for span, entries, later in zip(spans[1:], invariant, invariant[1:], strict=False)
            for at, alternative in entries
        )
        and not any(team.final(at) and over(alternative) for at, alternative in invariant[-1])
    )


def find_invariant(team: Team, spec: Formula, starts: list[Move], spans: list[Span]) -> Invariant:
    """Return all that the team may be in while a word satisfies the negation, whether one does to its end or not."""
    entering = [(at, less) for letter, at in starts for less in after(letter, frozenset({normal(spec, False)}))]
    invariant: Invariant = []
    for number, span in enumerate(spans):
        found = dict.fromkeys(entering)
        waiting = list(found)
        while waiting:
            at, alternative = waiting.pop()
            for entry in ((to, less) for letter, to in team.moves(span, at) for less in after(letter, alternative)):
                if entry not in found:
                    found[entry] = None
                    waiting.append(entry)
        invariant.append(list(found))
        if number + 1 < len(spans):
            entering = [
                (to, less)
                for at, alternative in found
                for letter, to in team.enters(spans[number + 1], at)
                for less in after(letter, alternative)
            ]
    return invariant
