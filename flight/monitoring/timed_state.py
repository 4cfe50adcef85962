"""The parts of a formula that are bounded in seconds, while a team flies: what can no longer be met is said at once.

What comes is not known: any letters may be shown then. A part is satisfied, or broken, where it is for all of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

from flight.monitoring.formula_state import FormulaVerdict, PartState
from verify.data import Formula, Letter
from verify.data.language.counting import atoms
from verify.logic.explanation import show
from verify.logic.team_letters import TeamLetters
from verify.model_checking.timing.instants import at
from verify.model_checking.timing.team_instants import TeamInstants, ticks_per_second
from verify.model_checking.timing.timed_formula import TimedFormula, bounds_of, horizon_of

EVERY = Fraction(1, 10)
"""s between two looks at what is open, while no letter changes."""


def both(one: FormulaVerdict, other: FormulaVerdict) -> FormulaVerdict:
    """Return the verdict on two formulas together."""
    return next(verdict for verdict in ("violated", "undecided", "open", "satisfied") if verdict in (one, other))


class TimedState:
    """Follows the letters of a team with their times.

    Attributes:
        verdict: Of all parts so far.
        broken: The part that cannot hold any more, or None.
    """

    def __init__(self, parts: Sequence[Formula]) -> None:
        """Begin before the first letters.

        Args:
            parts: What is to hold; written out for the team.
        """
        self.verdict: FormulaVerdict = "open" if parts else "satisfied"
        self.broken: str | None = None
        self._parts = {part: TeamLetters.of(part, atoms(part)) for part in parts}
        self._open = list(self._parts)
        self._shown: list[tuple[Fraction, dict[str, Letter]]] = []
        self._seen = Fraction(0)

    def see(self, time: float, letters: Mapping[str, Letter]) -> FormulaVerdict:
        """Take what each robot shows from a time on, or still shows; return the verdict.

        Args:
            time: s from the flight's start, never less than before.
            letters: By robot.
        """
        now = max(Fraction(time), Fraction(0))
        changed = not self._shown or dict(letters) != self._shown[-1][1]
        if self.verdict == "open" and (changed or now >= self._seen + EVERY):
            if changed:
                self._shown.append((now if self._shown else Fraction(0), dict(letters)))
            self._seen = now
            self._judge(now, over=False)
        return self.verdict

    def end(self, time: float, *, finite: bool = True) -> FormulaVerdict:
        """Return the verdict when the flight is over: nobody wins by landing, so a part that needs more time is broken.

        Args:
            time: When it ended, s from its start.
            finite: Whether the trace ends with it; of laps for ever what is open stays open.
        """
        if self.verdict == "open" and self._shown:
            self._judge(max(Fraction(time), self._seen), over=finite)
        return self.verdict

    @property
    def to_do(self) -> tuple[str, ...]:
        """The parts that are neither satisfied nor broken, with the time by which it is known which."""
        ends = [(part, horizon_of(part)) for part in self._open]
        return tuple(show(part) if end is None else f"{show(part)} until {float(end):g} s" for part, end in ends)

    @property
    def parts(self) -> tuple[tuple[str, PartState], ...]:
        """Each part with its state."""
        texts = [(part, show(part)) for part in self._parts]
        return tuple(
            (text, "broken" if text == self.broken else "to do" if part in self._open else "done") for part, text in texts
        )

    def _judge(self, now: Fraction, *, over: bool) -> None:
        for part in tuple(self._open):
            scale = ticks_per_second([now, *(time for time, _ in self._shown), *bounds_of(part)])
            reading = self._parts[part]
            cuts = [2 * int(time * scale) for time, _ in self._shown]
            known: list[frozenset[Letter] | None] = [frozenset({reading.letter(letters)}) for _, letters in self._shown]
            if not over:  # what comes after now is not known
                cuts.append(2 * int(now * scale) + 1)
                known.append(None)
            formula = TimedFormula(TeamInstants(tuple(cuts), tuple(known)), int(now * scale), scale)
            found = formula.sure(part)
            if at(found.flown if over else found.held, 0):
                self._open.remove(part)
            elif over or at(formula.sure(part, negated=True).held, 0):
                self.verdict, self.broken = "violated", show(part)
                return
        if not self._open:
            self.verdict = "satisfied"
