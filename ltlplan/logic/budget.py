"""Budgets of searches: counted in states, never in seconds, so that a result does not depend on the machine.

Only the translation of a large formula also has a clock, and that can only end it with an error. A budget may carry a `Watch`: a request from
outside to end with the best plan so far. A search looks there after every `EVERY` states. One that is asked to end ends as if its budget of states
were spent just there, and those after it as if theirs were as small. Where nobody asks, an answer depends on its mission alone.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

from verify.data import BadInput

EVERY = 256
"""States between two looks at a watch."""
FEWEST = 20_000
"""States that each search after the one that was ended may go on with at least: it looks for any plan, or compares some."""
Report = Callable[[int, float], None]
"""Receives how many states a search went on with, and the objective that no plan for the mission is below."""


class TooLarge(BadInput):
    """A budget was used up before there was an answer; nothing is known about satisfiability.

    Attributes:
        shortage: What was too large, as a sentence.
        used: How many were needed at least.
        limit: How many were allowed.
    """

    def __init__(self, what: str, used: int, unit: str, limit: int, hint: str = "") -> None:
        advice = hint or "Simplify the formula, write it as a conjunction of smaller parts, or raise the budget."
        self.shortage = f"{what} more than {limit:,} {unit}."
        super().__init__(f"{self.shortage} {advice}")
        self.used = used
        self.limit = limit


class StoppedEarly(BadInput):
    """A search was stopped on request before it had any plan; nothing is known about satisfiability."""

    def __init__(self, states: int) -> None:
        super().__init__(
            f"The search was stopped on request after {states:,} states, before any plan was found. Let it run for longer."
        )


class Watch:
    """A watch on all searches of one plan.

    Attributes:
        states: States after which a search was ended; None while none was.
    """

    def __init__(self, asked: Callable[[], bool]) -> None:
        """Watch nothing yet.

        Args:
            asked: Tells whether the search is to end; called once more for each look until it says so.
        """
        self.states: int | None = None
        self._asked = asked

    def ends(self, explored: int) -> bool:
        """Tell whether a search is to end after so many states."""
        if self.states is not None:
            return explored > max(self.states, FEWEST)
        if self._asked():
            self.states = explored
            return True
        return False


@contextmanager
def watched(asked: Callable[[], bool]) -> Generator[Watch]:
    """Give a watch for budgets, by which what is planned with them can be ended at the best plan so far.

    Args:
        asked: As for `Watch`.

    Raises:
        StoppedEarly: It was ended before any plan was found.
    """
    watch = Watch(asked)
    try:
        yield watch
    except TooLarge as error:
        if watch.states is None:
            raise
        raise StoppedEarly(watch.states) from error


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """Bounds on planning.

    Attributes:
        states: States of the search that may be expanded, in all.
        courses: States of a search over interleavings that may be expanded; None for a fiftieth of `states`.
        lasso: States that an infinite trace's product of robot and automata may have.
        rounds: States that may be expanded in search of an infinite trace's cheapest round.
        candidates: Complete plans that may be tried where the first ones are rejected.
        automaton: States of one explicit automaton.
        seconds: s of processor time that the translation of one large formula may take, in a process of its own.
        megabytes: MB that this process may take.
        watch: Ends searches on request; None where nobody may ask for that.
        report: Receives what the search for a mission's cheapest words has proved so far; None where nobody listens.
    """

    states: int = 3_000_000
    courses: int | None = None
    lasso: int = 300_000
    rounds: int = 20_000
    candidates: int = 20_000
    automaton: int = 20_000
    seconds: float = 20.0
    megabytes: int = 2048
    watch: Watch | None = field(default=None, compare=False)
    report: Report | None = field(default=None, compare=False)

    def ends(self, explored: int, bound: float | None = None) -> bool:
        """Report how far a search has come, and tell whether it is to end on request.

        Args:
            explored: States that were gone on with.
            bound: No plan for the mission has a lower objective; None where the search is about something else.
        """
        if self.report is not None and bound is not None:
            self.report(explored, bound)
        return self.watch is not None and self.watch.ends(explored)

    def is_ended(self, explored: int) -> bool:
        """Tell whether the plan that is being made is to be the best so far.

        Args:
            explored: States that were gone on with.
        """
        return self.watch is not None and (self.watch.states is not None or self.watch.ends(explored))

    def rest(self) -> Budget:
        """Return what remains for another search: as many states as one was ended after on request, if one was."""
        ended = None if self.watch is None else self.watch.states
        return self if ended is None else self.of(min(self.states, max(ended, FEWEST)))

    def of(self, states: int) -> Budget:
        """Return the budget with another number of states."""
        return replace(self, states=states)

    def beside(self, other: Budget) -> Budget:
        """Return the bounds of a search beside the one for the mission: it ends on the same request and reports nothing.

        Args:
            other: Its bounds.
        """
        return replace(other, watch=self.watch, report=None)

    @property
    def alone(self) -> Budget:
        """The bounds by themselves, by which answers may be kept for long."""
        return replace(self, watch=None, report=None)

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences of a plan about its search having been ended; none where it was not."""
        if self.watch is None or self.watch.states is None:
            return ()
        return (f"The search was stopped on request after {self.watch.states:,} states; a cheaper plan may exist.",)


DEFAULT_BUDGET = Budget()
