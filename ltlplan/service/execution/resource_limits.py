"""Resource limits of one piece of work, and the errors of one that exceeds them or dies."""

from __future__ import annotations

from dataclasses import dataclass

from verify.data import InternalError, LtlplanError

MEGABYTE = 1_000_000
"""Bytes."""

NICE = 5
"""How much workers give way to the service, whose readers wait for milliseconds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """Resource limits of one piece of work.

    Attributes:
        seconds: s of processor time, of the process and of all that it starts.
        megabytes: MB of memory, likewise.
        wall: s on the clock, whoever else is computing.
        nice: How far it gives way to others.
    """

    seconds: float = 3600.0
    megabytes: int = 4096
    wall: float = 86_400.0
    nice: int = NICE


class LimitReached(LtlplanError):
    """A piece of work was ended because it took more than it may."""

    exit_code = 4


class OutOfTime(LimitReached):
    """It took more time than it may."""

    @classmethod
    def of(cls, what: str) -> OutOfTime:
        """Return the error for work that took more than `what`, such as "5 s of processor time"."""
        return cls(
            f"This took more than the {what} that a stage may take; ask for less, or run it yourself with `ltlplan run`."
        )


class OutOfMemory(LimitReached):
    """It took more memory than it may."""

    @classmethod
    def of(cls, megabytes: int) -> OutOfMemory:
        """Return the error for work that took more than so many MB."""
        return cls(
            f"This took more than the {megabytes} MB of memory that a stage may take; simplify the formula, or take fewer robots and "
            "regions, or run it yourself with `ltlplan run`."
        )


class WorkerDied(InternalError):
    """A process was ended from outside, or by a fault of a library."""
