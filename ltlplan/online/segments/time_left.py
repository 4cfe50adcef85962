"""Progression of formulas that are bounded in seconds by what was flown: what is left of each, with its bounds counted from a later time.

`F[0,30] a` leaves `F[0,18] a` after 12 s without a. A dwell that has begun leaves its rest, or another one. `F[0,15] G[0,5] a` leaves
`G[0,2] a | F[0,3] G[0,5] a` after 12 s, the last 3 s of them in a. Whatever is asked for a span of time that was flown is asked at the instants at
which letters change and a millisecond around them.

What comes of it guides planning: a whole flight is judged by its own letters. So it asks for more where it has to choose: what only may have been
shown was not. Bounds hold for every time between the earliest and the latest at which the rest may begin.

References: F. Bacchus and F. Kabanza, Planning for temporally extended goals, Annals of Mathematics and Artificial Intelligence 22, 1998;
O. Maler and D. Nickovic, Monitoring temporal properties of continuous signals, FORMATS 2004.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import reduce
from math import ceil, floor
from typing import Literal

from verify.data import Formula, Mission, NotCertified, Unsatisfiable
from verify.data.events import changed
from verify.data.language.counting import atoms, negated
from verify.data.language.formula import FALSE, TEMPORAL, TRUE, Window
from verify.data.validation.clocks import clock_error_of
from verify.flight_segments import Piece, relations_of, timelines_of
from verify.logic.explanation import show
from verify.logic.progression import OutOfBudget
from verify.logic.team_letters import TeamLetters
from verify.logic.verdict import Verdict
from verify.model_checking.timeline import Relations, Timeline
from verify.model_checking.timing.instants import at
from verify.model_checking.timing.team_instants import Clocks, TeamInstants, robot_instants, ticks_per_second, times_of
from verify.model_checking.timing.timed_formula import TimedFormula, bounds_of

_NEAR = Fraction(1, 1000)
"""s around a change of letters at which it is asked, too, what was shown; bounds are rounded to it."""
_MOST = 300
"""Parts of what is left of one conjunct; of more it is not planned."""

_Kind = Literal["U", "R"]


@dataclass(frozen=True, slots=True)
class Flown:
    """Stretch of a flight that is over, and what may follow.

    Attributes:
        timelines: What each robot may show, and holds from its end on.
        relations: What is proved of the regions at large.
        clock_error: How far two clocks, the reference clock one of them, may be apart, s.
        since: Flight time at which the rest begins at the earliest, s; by then all letters are held.
        latest: Flight time at which it begins at the latest, s.
        drift: By how much more clocks may be apart in the whole flight than in its rest alone, s.
    """

    timelines: Mapping[str, Timeline]
    relations: Relations
    clock_error: Fraction
    since: Fraction
    latest: Fraction
    drift: Fraction = Fraction(0)

    @classmethod
    def of(cls, mission: Mission, pieces: Sequence[Piece], now: Fraction, latest: Fraction) -> Flown:
        """Return what a flight in pieces showed.

        Args:
            mission: The whole formula, and every robot that ever was in the air.
            pieces: What was flown; at the end of the last one robots hover.
            now: Flight time, s.
            latest: When the rest begins at the latest, s of the flight.

        Raises:
            NotCertified: The order of letters cannot be told.
        """
        timelines, since = timelines_of(mission, pieces), max(now, pieces[-1].end)
        if isinstance(timelines, Verdict):
            raise NotCertified(timelines.sentence, [timelines.witness()])
        at_start, error = (Fraction(clock_error_of(mission, seconds)) for seconds in (0, since))
        return cls(timelines, relations_of(pieces), error, since, max(since, latest), error - at_start)


def with_times_left(left: Mission, asked: Mission, flown: Flown) -> Mission:
    """Return what is left of a mission with what is left of the conjuncts that are bounded in seconds.

    Args:
        left: What is left of all others.
        asked: The whole mission.
        flown: What was flown.

    Raises:
        Unsatisfiable: One of them can no longer be met.
        NotCertified: Too much is left open.
    """
    try:
        rest = {part: part_left(part, flown) for part in asked.timed_parts}
    except OutOfBudget as error:
        raise NotCertified(f"{error}.") from None
    lost = [f"`{show(part)}`" for part, after in rest.items() if after == FALSE]
    if lost:
        raise Unsatisfiable(f"what was flown cannot be completed in time: {' and '.join(lost)} can no longer be met.")
    formula = joined("&", [left.formula, *rest.values()])
    return changed(left, spec=left.spec.model_copy(update={"formula": str(formula)}))


def part_left(part: Formula, flown: Flown) -> Formula:
    """Return what is left of one conjunct, its bounds counted from where the rest begins; `false` where nothing that comes can satisfy it.

    Args:
        part: Bounded in seconds, written out for the team.
        flown: What was flown.

    Raises:
        NotCertified: Too much is left open.
        OutOfBudget: Too many letters are open at one time.
    """
    reading = TeamLetters.of(part, atoms(part))
    times = {flown.clock_error, flown.since, _NEAR}.union(*(times_of(timeline) for timeline in flown.timelines.values()))
    scale = ticks_per_second([*times, *bounds_of(part)])
    shown = [robot_instants(reading, name, line, flown.relations, scale) for name, line in flown.timelines.items()]
    error, now = int(flown.clock_error * scale), int(flown.since * scale)
    seen = TeamInstants.of(reading, shown, Clocks(error, error)).until(now)
    held = TeamInstants.of(reading, shown, Clocks(0, 0)).letters[-1]
    count = sum(cut < 2 * now for cut in seen.cuts)
    team = TeamInstants((*seen.cuts[:count], 2 * now, 2 * now + 1), (*seen.letters[:count], held, None))
    return _Left(TimedFormula(team, now, scale), flown, tuple({cut // 2 for cut in seen.cuts[:count]})).of(part, 0)


@dataclass(frozen=True)
class _Left:
    """Progression of the parts of one formula.

    Attributes:
        evaluated: On what was shown, and all that may come.
        flown: What was flown.
        changes: When letters changed, in ticks.
    """

    evaluated: TimedFormula
    flown: Flown
    changes: tuple[int, ...]
    _known: dict[tuple[int, int, bool], Formula] = field(default_factory=dict)
    _kept: list[Formula] = field(default_factory=list)

    def of(self, node: Formula, time: int, *, negative: bool = False) -> Formula:
        """Return what is left of a formula, or of its negation, that is asked at a time of the flight, in ticks."""
        key = (id(node), time, negative)
        if key not in self._known:
            self._kept.append(node)  # so that no other one gets its identity
            self._known[key] = self._of(node, time, negative=negative)
        return self._known[key]

    def _of(self, node: Formula, time: int, *, negative: bool) -> Formula:
        if at(self.evaluated.sure(node, negated=negative).held, time):
            return TRUE
        if not _is_temporal(node) or at(self.evaluated.sure(node, negated=not negative).held, time):
            return FALSE
        parts = node.arguments
        match node.operator:
            case "!":
                return self.of(parts[0], time, negative=not negative)
            case "&" | "|" | "->":
                signs = [negative != (node.operator == "->" and index == 0) for index in range(len(parts))]
                left = [self.of(part, time, negative=sign) for part, sign in zip(parts, signs, strict=True)]
                return joined("&" if (node.operator == "&") != negative else "|", left)
            case "xor" | "<->":
                same = (node.operator == "<->") != negative
                pairs = [
                    joined("&", [self.of(parts[0], time, negative=sign), self.of(parts[1], time, negative=sign == same)])
                    for sign in (False, True)
                ]
                return joined("|", pairs)
            case _:
                return self._temporal(node, time, negative=negative)

    def _temporal(self, node: Formula, time: int, *, negative: bool) -> Formula:
        window = (Fraction(0), None) if node.window is None else node.window
        *first, last = node.arguments
        match node.operator:
            case "F" | "G":
                kind: _Kind = "U" if node.operator == "F" else "R"
                left, right = TRUE if kind == "U" else FALSE, last
            case "M":  # right U (left & right)
                kind, left, right = "U", last, Formula("&", (first[0], last))
            case "W":  # right R (left | right)
                kind, left, right = "R", last, Formula("|", (first[0], last))
            case _:
                kind, left, right = ("U" if node.operator == "U" else "R"), first[0], last
        reaches = (kind == "U") != negative
        return self._until(left, right, window, time, reaches=reaches, negative=negative)

    # six values say what is asked, of what, when, and which way round
    def _until(
        self, left: Formula, right: Formula, window: Window, time: int, *, reaches: bool, negative: bool
    ) -> Formula:  # fmt: skip
        """Return what is left of `left U right`, or where it does not reach of `left R right`, of both or of their negations."""
        scale, now = self.evaluated.scale, self.evaluated.end
        assert isinstance(now, int), "laps are not flown in pieces"
        within, beside = ("&", "|") if reaches else ("|", "&")
        low = time + int(window[0] * scale)
        high = None if window[1] is None else time + int(window[1] * scale)
        last = now if high is None else min(now, high)
        before = TRUE if reaches else FALSE  # what is left of the first operand up to a time
        found: list[Formula] = []
        for tick in self._asked(time, low, last):
            if low <= tick <= last:
                found.append(joined(within, [before, self.of(right, tick, negative=negative)]))
            if tick < last or (high is None or high > now):
                before = joined(within, [before, self.of(left, tick, negative=negative)])
            if before == (FALSE if reaches else TRUE):
                break
        else:
            if high is None or high > now:
                found.append(
                    joined(within, [before, self._to_come(left, right, window, time, reaches=reaches, negative=negative)])
                )
        return joined(beside, found)

    # as above
    def _to_come(
        self, left: Formula, right: Formula, window: Window, time: int, *, reaches: bool, negative: bool
    ) -> Formula:  # fmt: skip
        """Return what is asked of the time to come, whenever between its earliest and its latest time the rest begins."""
        asked, (since, latest) = (
            Fraction(time, self.evaluated.scale),
            (self.flown.since - self.flown.drift, self.flown.latest + self.flown.drift),
        )
        early, late = (since, latest) if reaches else (latest, since)
        low = max(_rounded(asked + window[0] - early, up=reaches), Fraction(0))
        high = None if window[1] is None else _rounded(asked + window[1] - late, up=not reaches)
        if high is not None and high < low:
            return FALSE if reaches else TRUE
        bounds = None if (low, high) == (0, None) else (low, high)
        one, other = (negated(part) if negative else part for part in (left, right))
        if one in (TRUE, FALSE):
            return Formula("F" if reaches else "G", (other,), window=bounds)
        return Formula("U" if reaches else "R", (one, other), window=bounds)

    def _asked(self, begin: int, low: int, end: int) -> list[int]:
        """Return the times of a span at which what was flown is asked, in order, in ticks."""
        near = int(_NEAR * self.evaluated.scale)
        around = {change + step for change in self.changes for step in (-near, 0, near)}
        return sorted({begin, end} | {tick for tick in around | {low} if begin <= tick <= end}) if begin <= end else []


def joined(operator: Literal["&", "|"], parts: Iterable[Formula]) -> Formula:
    """Join formulas; what follows from another one is left out.

    Args:
        operator: All of them, or one.
        parts: Formulas.

    Raises:
        NotCertified: They are too many.
    """
    neutral, ruling = (TRUE, FALSE) if operator == "&" else (FALSE, TRUE)
    found = dict.fromkeys(part for each in parts for part in _flat(operator, each))
    found.pop(neutral, None)
    if ruling in found:
        return ruling
    kept = [part for part in found if not any(_idle(operator, part, other) for other in found if other is not part)]
    if len(kept) > _MOST:
        raise NotCertified(f"what is left of a formula that is bounded in seconds has more than {_MOST} parts.")
    return reduce(lambda one, other: Formula(operator, (one, other)), kept) if kept else neutral


def _flat(operator: str, formula: Formula) -> Sequence[Formula]:
    if formula.operator != operator:
        return (formula,)
    return [part for argument in formula.arguments for part in _flat(operator, argument)]


def _idle(operator: str, part: Formula, other: Formula) -> bool:
    """Return whether a part says nothing beside another one: the same, asked for a wider or a narrower window."""
    if part.operator != other.operator or part.operator not in ("F", "G", "U", "R") or part.arguments != other.arguments:
        return False
    wider = (operator == "&") == (part.operator in ("F", "U"))  # which of two windows is idle
    (low, high), (other_low, other_high) = (
        (Fraction(0), None) if window is None else window for window in (part.window, other.window)
    )
    if wider:
        return low <= other_low and (high is None or (other_high is not None and other_high <= high))
    return other_low <= low and (other_high is None or (high is not None and high <= other_high))


def _is_temporal(node: Formula) -> bool:
    return any(part.operator in TEMPORAL for part in node.nodes())


def _rounded(seconds: Fraction, *, up: bool) -> Fraction:
    return (ceil if up else floor)(seconds / _NEAR) * _NEAR
