"""Reasons why a formula that is bounded in seconds is not proved, in words: what comes too late, too early or for too short a time."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from verify.data.language.formula import Formula
from verify.logic.explanation import show
from verify.model_checking.timing.instants import Instants, before, complement, intersection, intervals, since
from verify.model_checking.timing.laps import Recurrence
from verify.model_checking.timing.timed_formula import TimedFormula

Reason = tuple[str, float | None]
"""A sentence, and the time that it speaks of, s."""


def reason(part: Formula, evaluated: TimedFormula, *, refuted: bool) -> Reason:
    """Return why a conjunct is not proved, where one operator stands over the rest.

    Args:
        part: The conjunct.
        evaluated: On all that robots may do.
        refuted: Whether it surely fails; else it may.
    """
    said = _Reasons(evaluated, refuted)
    if part.operator == "F" and part.window is not None:
        return said.of_reaching(part.arguments[0], part.window)
    if part.operator == "G":
        return said.of_keeping(part.arguments[0], (Fraction(0), None) if part.window is None else part.window)
    return said.nowhere


@dataclass(frozen=True)
class _Reasons:
    evaluated: TimedFormula
    refuted: bool

    @property
    def nowhere(self) -> Reason:
        return "at no time of the flight is that so for all that its robots may do.", None

    def of_reaching(self, inner: Formula, window: tuple[Fraction, Fraction | None]) -> Reason:
        """Return why something is not reached in its window."""
        low, high = window
        shown = self._until(self._shown(inner), low)
        later = since(shown, int(low * self._scale))
        if not later and shown:
            time = self._seconds(shown[-1])
            return (
                f"`{show(inner)}` is {self._surely}shown until {decimals(time)} s only, before its time begins at {decimals(low)} s.",
                float(time),
            )
        if not later:
            return f"`{show(inner)}` {self._surely}never comes.", None
        if high is None:
            return self.nowhere
        time = self._seconds(later[0])
        return (
            f"`{show(inner)}` {self._surely}comes at {decimals(time)} s, {decimals(time - high)} s after its deadline.",
            float(time),
        )

    def of_keeping(self, inner: Formula, window: tuple[Fraction, Fraction | None]) -> Reason:
        """Return why something does not hold all the time of its window; of several deadlines in it, the one that is missed by most."""
        low, high = window
        doubt = since(self._until(self._doubt(inner), low if high is None else high), int(low * self._scale))
        within = doubt if high is None else before(doubt, int(high * self._scale))
        if not within:
            return self.nowhere
        deadline = _deadline(inner)
        if deadline is not None:
            asked, delay = self._latest(deadline, within)
            start = f"asked at {decimals(asked)} s, `{show(deadline.arguments[0])}` {self._surely}"
            if delay is None:
                return f"{start}never comes.", float(asked)
            assert deadline.window is not None
            assert deadline.window[1] is not None
            time = asked + deadline.window[1] + delay
            return f"{start}comes at {decimals(time)} s, {decimals(delay)} s after its deadline.", float(asked)
        time = self._seconds(within[0])
        word = "ends" if self.refuted else "may end"
        return f"`{show(inner)}` {word} at {decimals(time)} s, within the time in which it has to hold.", float(time)

    def _latest(self, deadline: Formula, doubt: Instants) -> tuple[Fraction, Fraction | None]:
        """Return when a deadline is asked for that is missed by most, and by how much, s; None where what is asked for never comes."""
        assert deadline.window is not None
        low, high = deadline.window
        assert high is not None
        found: list[tuple[Fraction, Fraction]] = []
        shown = self._shown(deadline.arguments[0])
        for cut, _ in intervals(doubt):
            asked = self._seconds(cut)
            later = intersection(self._until(shown, asked + low), (cut + 2 * int(low * self._scale),))
            if not later:
                return asked, None
            found.append((self._seconds(later[0]) - asked - high, asked))
        delay, asked = max(found, key=lambda each: each[0])
        return asked, delay

    def _shown(self, inner: Formula) -> Instants:
        return complement(self.evaluated.sure(inner, negated=True).held) if self.refuted else self.evaluated.sure(inner).held

    def _doubt(self, inner: Formula) -> Instants:
        return self.evaluated.sure(inner, negated=True).held if self.refuted else complement(self.evaluated.sure(inner).held)

    def _until(self, instants: Instants, time: Fraction) -> Instants:
        """Return a set, of laps up to a lap after a time: what lies behind is known no more."""
        laps = self.evaluated.end
        if not isinstance(laps, Recurrence):
            return instants
        last = max(int(time * self._scale), laps.begin) + laps.period
        return before(laps.repeated(instants, last), last)

    def _seconds(self, cut: int) -> Fraction:
        return Fraction(cut // 2, self._scale)

    @property
    def _scale(self) -> int:
        return self.evaluated.scale

    @property
    def _surely(self) -> str:
        return "" if self.refuted else "surely "


def _deadline(node: Formula) -> Formula | None:
    """Return the deadline that something asks for, whenever something else is so or always; None where it asks for anything else."""
    if node.operator == "F":
        return None if node.window is None or node.window[1] is None else node
    if node.operator not in ("->", "|"):
        return None
    asked = node.arguments[1:] if node.operator == "->" else node.arguments
    found = [deadline for part in asked if (deadline := _deadline(part)) is not None]
    return found[0] if len(found) == 1 else None


def decimals(seconds: Fraction) -> str:
    """Return seconds in words, to 0.1 ms."""
    return f"{float(seconds):.4f}".rstrip("0").rstrip(".")
