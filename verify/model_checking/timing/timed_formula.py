"""Times at which a formula surely holds: sets of times from the inside out, three-valued.

A formula *must* hold at a time where it does for every flight that the labels leave possible, and *cannot* where its negation must.
`p U[a,b] q` is `p` on [t, t + a), and from t + a on (`p | q`) until `q` within b - a, which is the meaning that `docs/semantics.md` gives
it, and knows that p may end only where q begins. All else comes to `U`, negations and Boolean combinations. Each set is monotone in those
that it is made of, so that surely comes out for surely.

After a finite flight's end the last letter is held. What a bounded operator needs of that is told apart: *flown* times are proved without it.
Laps for ever have no end: their times repeat themselves (`laps`).
Reference: O. Maler and D. Nickovic, Monitoring temporal properties of continuous signals, FORMATS 2004.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction

from verify.data.language.formula import TEMPORAL, TRUE, Formula
from verify.model_checking.timing.instants import (
    Instants,
    before,
    complement,
    intersection,
    lasting,
    shifted,
    union,
    until,
)
from verify.model_checking.timing.laps import Recurrence
from verify.model_checking.timing.team_instants import TeamInstants


def bounds_of(formula: Formula) -> list[Fraction]:
    """Return all bounds in seconds of a formula."""
    windows = (node.window for node in formula.nodes() if node.window is not None)
    return [bound for window in windows for bound in window if bound is not None]


def horizon_of(formula: Formula) -> Fraction | None:
    """Return the time, from when a formula is asked, after which nothing matters to it, s; None where all time does."""
    parts = [horizon_of(part) for part in formula.arguments] if formula.operator != "count" else []
    known = [part for part in parts if part is not None]
    if len(known) < len(parts):
        return None
    latest = max(known, default=Fraction(0))
    if formula.operator not in TEMPORAL:
        return latest
    return None if formula.window is None or formula.window[1] is None else formula.window[1] + latest


@dataclass(frozen=True, slots=True)
class Sure:
    """Times at which something surely holds, in ticks.

    Attributes:
        flown: Without anything of the time after the flight that a bound asks for; up to the flight's end.
        held: With the last letter held for ever.
    """

    flown: Instants
    held: Instants


@dataclass(frozen=True)
class TimedFormula:
    """Evaluation of formulas on one team's letters.

    Attributes:
        team: Letters by time.
        end: The flight's end, in ticks, on the earliest clock; from when on letters repeat themselves, where it has none.
        scale: Ticks in a second.
    """

    team: TeamInstants
    end: int | Recurrence
    scale: int
    _known: dict[tuple[int, bool], Sure] = field(default_factory=dict, repr=False)
    _temporal: dict[int, bool] = field(default_factory=dict, repr=False)
    _kept: list[Formula] = field(default_factory=list, repr=False)

    def sure(self, formula: Formula, *, negated: bool = False) -> Sure:
        """Return when a formula, or its negation, surely holds.

        Args:
            formula: Written out for the team; without X.
            negated: Whether its negation is asked.
        """
        for node, sign in self._from_below(formula, negated):  # so that a deep formula needs no deep stack
            self._kept.append(node)  # so that no other one gets its identity
            self._known[id(node), sign] = self._sure(node, negated=sign)
        return self._known[id(formula), negated]

    def _from_below(self, formula: Formula, negated: bool) -> list[tuple[Formula, bool]]:
        """Return what of a formula is not known yet, each part before those that need it, with the sign with which it is needed."""
        found: dict[tuple[int, bool], tuple[Formula, bool]] = {}
        stack = [(formula, negated, False)]
        while stack:
            node, sign, ready = stack.pop()
            key = (id(node), sign)
            if ready:
                found.setdefault(key, (node, sign))
            elif key not in self._known and key not in found:
                stack.append((node, sign, True))
                stack += [(part, other, False) for part, other in self._needed(node, sign)]
        return list(found.values())

    def _needed(self, node: Formula, sign: bool) -> list[tuple[Formula, bool]]:
        if not self._is_temporal(node):
            return []
        if node.operator in ("xor", "<->"):
            return [(part, either) for part in node.arguments for either in (False, True)]
        flipped = {"!": (0,), "->": (0,)}.get(node.operator, ())
        return [(part, sign != (index in flipped)) for index, part in enumerate(node.arguments)]

    def _sure(self, node: Formula, *, negated: bool) -> Sure:
        if not self._is_temporal(node):
            return self._flown(self.team.sure(node, negated=negated))
        match node.operator:
            case "!":
                return self.sure(node.arguments[0], negated=not negated)
            case "&" | "|" | "->":
                first = node.operator == "->"
                parts = [
                    self.sure(part, negated=negated != (first and index == 0)) for index, part in enumerate(node.arguments)
                ]
                return _joined(parts, all_of=(node.operator == "&") != negated)
            case "xor" | "<->":
                same = (node.operator == "<->") != negated
                one, other = node.arguments
                pairs = [(self.sure(one, negated=sign), self.sure(other, negated=sign == same)) for sign in (False, True)]
                return _joined([_joined(list(pair), all_of=True) for pair in pairs], all_of=False)
            case _:
                return self._temporally(node, negated=negated)

    def _is_temporal(self, node: Formula) -> bool:
        if id(node) not in self._temporal:
            self._kept.append(node)
            self._temporal[id(node)] = any(part.operator in TEMPORAL for part in node.nodes())  # in counts are none
        return self._temporal[id(node)]

    def _temporally(self, node: Formula, *, negated: bool) -> Sure:
        """Return when a temporal formula surely holds, told by `U`."""
        window = (Fraction(0), None) if node.window is None else node.window
        left, right = (TRUE, node.arguments[0]) if len(node.arguments) == 1 else node.arguments
        match node.operator:
            case "F" | "U":
                return self._until(left, right, window, negated=negated)
            case "G" | "R":  # not (not left U not right)
                left = TRUE if node.operator == "G" else _not(left)
                return self._until(left, _not(right), window, negated=not negated)
            case "M":  # right U (left & right)
                return self._until(right, Formula("&", (left, right)), window, negated=negated)
            case _:  # W: not (not right U (not left & not right))
                broken = Formula("&", (_not(left), _not(right)))
                return self._until(_not(right), broken, window, negated=not negated)

    def _until(self, left: Formula, right: Formula, window: tuple[Fraction, Fraction | None], *, negated: bool) -> Sure:
        either = right if right.operator == "true" else Formula("|", (left, right))
        sets = [self.sure(part, negated=negated) for part in (left, right, either)]
        low, high = int(window[0] * self.scale), None if window[1] is None else int(window[1] * self.scale)
        if isinstance(self.end, Recurrence):
            return self._flown(_repeated(self.end, [one.held for one in sets], low, high, negated=negated))
        held = _of([one.held for one in sets], low, high, negated=negated)
        # without a bound the last letter is held, as in any formula without bounds; what is bounded is reached in flight
        landed = (2 * self.end + 1,)
        flown = [one.flown if high is not None else union(one.flown, intersection(one.held, landed)) for one in sets]
        if right.timed and not negated:
            flown[1] = sets[1].flown  # nobody wins by landing
        found = _of(flown, low, high, negated=negated, most=self.end if low else None)
        return Sure(before(found, self.end), held)

    def _flown(self, held: Instants) -> Sure:
        """Return times of letters, or of laps, with those of them that are flown."""
        if isinstance(self.end, Recurrence):
            held = self.end.repeated(held)
            return Sure(held, held)
        return Sure(before(held, self.end), held)


def _of(sets: list[Instants], low: int, high: int | None, *, negated: bool, most: int | None = None) -> Instants:
    """Return when `U` holds of sets of times or, negated, when it surely does not where these are times of negations."""
    held, reached, either = (complement(one) for one in sets) if negated else sets
    found = until(either, reached, None if high is None else high - low)
    if most is not None:  # what begins after the flight is not flown
        found = union(found, (2 * most + 1,)) if negated else before(found, most)
    found = intersection(lasting(held, low), shifted(found, low))
    return complement(found) if negated else found


def _repeated(laps: Recurrence, sets: list[Instants], low: int, high: int | None, *, negated: bool) -> Instants:
    """Return the same of sets that repeat themselves, up to the reach of their laps."""
    held, reached, either = (complement(one) for one in sets) if negated else sets
    found = laps.repeated(until(either, reached, laps.reach if high is None else min(high - low, laps.reach)))
    found = intersection(lasting(held, min(low, laps.reach)), laps.ahead(found, low))
    return complement(found) if negated else found


def _not(node: Formula) -> Formula:
    return Formula("!", (node,))


def _joined(parts: list[Sure], *, all_of: bool) -> Sure:
    join = intersection if all_of else union
    held = join(*(part.held for part in parts))
    return Sure(held if all(part.flown is part.held for part in parts) else join(*(part.flown for part in parts)), held)
