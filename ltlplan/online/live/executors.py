"""Questions that are asked while a team flies, and who computes their answers: another process, or this one while time stands still.

Questions are values and what answers them are pure functions, so that it does not matter where that is done; only `beside` a flight it may take the time
that it takes. Functions are given whom to tell their progress as their last argument, as all work that is handed to a process.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from ltlplan.online.segments.braking import Stop, StoppingManoeuvre, come_to_rest
from ltlplan.online.segments.segment_planning import Found, Left, WholeFlight, find_piece, require_proved
from ltlplan.transfers import Place, Solo, Transfer, to_ground, to_join
from verify.data import LtlplanError, Mission, Trajectory
from verify.data.progress import Progress


class NoAnswer(LtlplanError):
    """Computation that was ended, or takes too long; the message says which."""

    exit_code = 1


class Answer(Protocol):
    """An answer to come."""

    def done(self) -> bool:
        """Return whether it is there; returns at once."""
        ...

    def result(self) -> Any:
        """Return it, once it is there.

        Raises:
            LtlplanError: What was raised in its place.
            NoAnswer: There will be none.
        """
        ...

    def drop(self) -> None:
        """Give it up, whether it is there or not, and free what computes it."""
        ...


class Computer(Protocol):
    """Executor of queries."""

    def ask(self, work: Callable[..., Any], question: object) -> Answer:
        """Have a question answered.

        Args:
            work: A function of a module, which is given the question and whom to tell its progress.
            question: Can be pickled, as the answer can.
        """
        ...


class Given:
    """An answer that is there."""

    def __init__(self, value: Any, error: LtlplanError | None = None) -> None:
        """Take it.

        Args:
            value: The answer.
            error: What was raised in its place.
        """
        self._value, self._error = value, error

    def done(self) -> bool:
        """Return true."""
        return True

    def result(self) -> Any:
        """Return the answer.

        Raises:
            LtlplanError: What was raised in its place.
        """
        if self._error is not None:
            raise self._error
        return self._value

    def drop(self) -> None:
        """Do nothing: nothing computes it."""


def way_to_stop(stop: Stop, _progress: Progress) -> StoppingManoeuvre:
    """Answer how a team may come to rest.

    Args:
        stop: The question.
    """
    return come_to_rest(stop)


def next_piece(left: Left, _progress: Progress) -> Found:
    """Answer what is flown of what is left.

    Args:
        left: The question.

    Raises:
        LtlplanError: As `find_piece`.
    """
    return find_piece(left)


def judgement(flight: WholeFlight, _progress: Progress) -> None:
    """Answer whether a whole flight is proved, by raising where it is not.

    Args:
        flight: The question.

    Raises:
        NotCertified: The whole formula is not proved.
    """
    require_proved(flight)


def way_up(question: tuple[Mission, str, Place, Mapping[str, Trajectory]], _progress: Progress) -> tuple[Solo, ...]:
    """Answer how a robot comes from the ground to its start while all others hover.

    Args:
        question: The world with everybody in it, the robot, where it stands, and what the others flew last.

    Raises:
        Infeasible: There is no way.
        NotCertified: None is proved.
    """
    return to_join(*question)


def way_down(
    question: tuple[Mission, Mapping[str, Trajectory], Mapping[str, Place]], _progress: Progress
) -> tuple[Transfer, ...]:
    """Answer how robots land.

    Args:
        question: The world, what they flew last, and where each of them stood.

    Raises:
        Infeasible: There is no way.
        NotCertified: None was certified.
    """
    mission, team, places = question
    return to_ground(mission, team, places)
