"""The errors that a user of ltlplan can meet, and the exit code of each.

Every error that we raise on purpose derives from `LtlplanError`. Six classes under it carry one exit
code each; more special classes derive from those and only add what a caller may want to look at (two, an engine that is absent and
one whose clock ran out, are no kind of the six and share a code with one of them).
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import Self

    from verify.data.obstruction import Obstruction
    from verify.data.witness import Witness


class LtlplanError(Exception):
    """Base of every error raised on purpose; `exit_code` is what the command line ends with."""

    exit_code: int = 1


class InternalError(LtlplanError):
    """A bug of ours: two independent answers disagree, or an invariant broke."""

    exit_code = 1


class BadInput(LtlplanError):
    """The caller's file, formula, number or array is wrong; the message says what would be right."""

    exit_code = 2


class Unsatisfiable(LtlplanError):
    """No word that these robots can fly satisfies the specification."""

    exit_code = 3


class Infeasible(LtlplanError):
    """No trajectory keeps the limits and labels that were asked for.

    Attributes:
        witness: The limit or label that cannot be met and by how much, where known.
        obstruction: Narrow place, robots, what was tried and what would help, where known; the message is made of it.
    """

    exit_code = 4

    def __init__(self, message: str, witness: Witness | None = None) -> None:
        super().__init__(message)
        self.witness = witness
        self.obstruction: Obstruction | None = None

    def because(self, obstruction: Obstruction) -> Self:
        """Return the error with what stands in the way, and the message that says it.

        Args:
            obstruction: What is known of it.
        """
        self.obstruction, self.args = obstruction, (obstruction.sentence,)
        return self


class NotCertified(LtlplanError):
    """The checker could not prove the claim; the witnesses say where and why.

    Attributes:
        witnesses: One or more refused claims, most important first.
    """

    exit_code = 5

    def __init__(self, message: str, witnesses: Iterable[Witness] = ()) -> None:
        super().__init__(message)
        self.witnesses = tuple(witnesses)


class DoesNotFit(LtlplanError):
    """The flight is sound but the vehicle or its file format cannot hold it."""

    exit_code = 6


class MissingEngine(LtlplanError):
    """An optional or platform-bound library is absent; the message says how to get it."""

    exit_code = 2


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return " Did you mean 'x'?" for the nearest known name, or an empty string."""
    near = difflib.get_close_matches(name, list(known), n=1)
    return f" Did you mean '{near[0]}'?" if near else ""
