"""The search that runs, seen from outside: what it has proved so far, and a request to end it with the best plan that it has.

Searches look here after every `EVERY` states. A search that is asked to end ends as if its budget of states were spent just there, and those after
it as if theirs were as small. Where nobody asks, an answer depends on its mission alone.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar

from ltlplan.logic.budget import StoppedEarly, TooLarge
from verify.data.progress import Progress

EVERY = 256
"""States between two looks."""
FEWEST = 20_000
"""States that each search after the one that was ended may go on with at least: it looks for any plan, or compares some."""


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


_watch: ContextVar[Watch | None] = ContextVar("watch", default=None)
_told: ContextVar[tuple[Progress, float, float] | None] = ContextVar("told", default=None)


@contextmanager
def watched(asked: Callable[[], bool]) -> Generator[Watch]:
    """Let what is planned here be ended at the best plan so far.

    Args:
        asked: As for `Watch`.

    Raises:
        StoppedEarly: It was ended before any plan was found.
    """
    watch = Watch(asked)
    token = _watch.set(watch)
    try:
        yield watch
    except TooLarge as error:
        if watch.states is None:
            raise
        raise StoppedEarly(watch.states) from error
    finally:
        _watch.reset(token)


@contextmanager
def bounds_told(progress: Progress, share: float, unit: float) -> Generator[None]:
    """Have the search for a mission's cheapest words tell what it has proved.

    Args:
        progress: Receives a sentence and the share.
        share: Share done meanwhile, 0 to 1.
        unit: Cost of what the search counts as 1.
    """
    token = _told.set((progress, share, unit))
    try:
        yield
    finally:
        _told.reset(token)


def look(explored: int, bound: float | None) -> bool:
    """Tell how far a search has come, and whether it is to end.

    Args:
        explored: States that were gone on with.
        bound: No plan for the mission has a lower objective; None where the search is about something else.
    """
    told, watch = _told.get(), _watch.get()
    if told is not None and bound is not None:
        progress, share, unit = told
        progress(f"searching: {explored:,} states, no words cost less than {bound * unit:.3f}", share)
    return watch is not None and watch.ends(explored)


def ended_after(states: int) -> int:
    """Return how many of a budget's states remain to be gone on with: as many as a search was ended after on request, if one was."""
    watch = _watch.get()
    return states if watch is None or watch.states is None else min(states, max(watch.states, FEWEST))


def is_ended() -> bool:
    """Return whether the plan that is being made is to be the best so far."""
    watch = _watch.get()
    return watch is not None and (watch.states is not None or watch.ends(0))


def notes() -> tuple[str, ...]:
    """Return what a plan has to say of its search having been ended; nothing where it was not."""
    watch = _watch.get()
    if watch is None or watch.states is None:
        return ()
    return (f"The search was stopped on request after {watch.states:,} states; a cheaper plan may exist.",)
