"""Errors over HTTP and back: the exception classes as problem details (RFC 9457), with the words that the command line prints.

`problem_of` turns what was raised into a value for others; `error_of` raises the same class with the same words at the other end. What
an error carries beside its words (a mission's faults, a refusal's witnesses) travels with it.
"""

from __future__ import annotations

import importlib
import math
import re
from dataclasses import asdict, fields
from typing import Any

from ltlplan.service.models import Problem, ProblemFault
from verify.data.errors import (
    BadInput,
    DoesNotFit,
    Infeasible,
    InternalError,
    LtlplanError,
    MissingEngine,
    NotCertified,
    Unsatisfiable,
)
from verify.data.validation.faults import Fault, MissionError
from verify.data.witness import Witness

MEDIA_TYPE = "application/problem+json"
_TYPE = "/problems/"


class NotFound(BadInput):
    """Nothing of that name is here."""

    status = 404


class Conflict(BadInput):
    """Request that cannot be satisfied in the present state."""

    status = 409


class _TryLater(BadInput):
    """Request that may be repeated.

    Attributes:
        seconds: After so many seconds it is worth another try.
    """

    seconds = 1.0

    def __init__(self, message: str, seconds: float | None = None) -> None:
        super().__init__(message)
        self.seconds = self.seconds if seconds is None else seconds


class TooManyRequests(_TryLater):
    """Too many requests, or too many that wait."""

    status = 429


class BodyTooLarge(BadInput):
    """A body is larger than is read."""

    status = 413


class BodyTooSlow(BadInput):
    """A body did not come in time."""

    status = 408


class UnsupportedMedia(BadInput):
    """A body of a kind that is not read."""

    status = 415


class MethodNotAllowed(BadInput):
    """A method that a path does not have."""

    status = 405


class NotAuthenticated(BadInput):
    """Request without valid credentials."""

    status = 401


class Forbidden(BadInput):
    """Request that its user may not make."""

    status = 403


class WrongHost(BadInput):
    """A name that is not this service's."""

    status = 421


class Busy(_TryLater):
    """The service cannot take more at the moment."""

    status, seconds = 503, 2.0


class Unreachable(BadInput):
    """A service does not answer, or what answers is none of ours."""

    status = 503


_STATUS: dict[type[LtlplanError], int] = {
    BadInput: 422,
    Unsatisfiable: 422,
    Infeasible: 422,
    NotCertified: 422,
    DoesNotFit: 422,
    MissingEngine: 501,
    InternalError: 500,
    LtlplanError: 422,
}
_STATUS_OF_KIND = {"no-room": 507}
_EXIT_CODES: dict[int, type[LtlplanError]] = {
    1: InternalError,
    2: BadInput,
    3: Unsatisfiable,
    4: Infeasible,
    5: NotCertified,
    6: DoesNotFit,
}
_ELSEWHERE = {
    "formula-error": "verify.data.language.formula_error:FormulaError",
    "sequence-error": "verify.data.language.sequence:SequenceError",
    "too-large": "ltlplan.logic.budget:TooLarge",
    "stopped-early": "ltlplan.logic.budget:StoppedEarly",
    "no-plan": "ltlplan.search.explanations.unsatisfiable_cores:NoPlan",
    "blocked": "ltlplan.paths.hoops.avoidance:Blocked",
    "spline-blocked": "ltlplan.paths.hoops.spline_repair:SplineBlocked",
    "cost-error": "ltlplan.paths.costs:CostError",
    "solver-timeout": "refine.solvers.timeout:SolverTimeout",
    "out-of-time": "ltlplan.service.execution.resource_limits:OutOfTime",
    "out-of-memory": "ltlplan.service.execution.resource_limits:OutOfMemory",
    "worker-died": "ltlplan.service.execution.resource_limits:WorkerDied",
    "damaged": "ltlplan.service.job_queue.store:Damaged",
    "no-room": "ltlplan.service.job_queue.store:NoRoom",
    "out-of-budget": "verify.logic.progression:OutOfBudget",
}
"""Classes that are loaded when one of them is met."""

_NO_PLAN = ("core", "reasons", "edges")
"""What the error of a formula that cannot be met carries."""

_TITLES = {
    "damaged": "A stored value is damaged",
    "internal-error": "A bug of ours",
    "infeasible": "No trajectory found",
    "does-not-fit": "Does not fit the vehicle",
}


def problem_of(error: BaseException) -> Problem:
    """Return an error as a value for others; what is no error of ours is told as a bug, without its words.

    Args:
        error: What was raised.
    """
    if not isinstance(error, LtlplanError):
        name = type(error).__name__
        error = InternalError(f"This is a bug of ltlplan ({name}); the service's log has more.")
    kind = _kind(type(error))
    return Problem(
        type=_TYPE + kind,
        title=_TITLES.get(kind, kind.replace("-", " ").capitalize()),
        status=_status(type(error)),
        detail=str(error),
        exit_code=error.exit_code,
        faults=faults_of(error) if isinstance(error, MissionError) else (),
        witnesses=tuple(witness_data(each) for each in _witnesses(error)),
        **{name: getattr(error, name) for name in _NO_PLAN if kind == "no-plan"},
    )


def faults_of(error: MissionError, text: str | None = None) -> tuple[ProblemFault, ...]:
    """Return a mission's faults for others.

    Args:
        error: Carries them.
        text: The file's text, where it is at hand; then faults have columns.
    """
    lines = [] if text is None else text.splitlines()
    return tuple(
        ProblemFault(line=fault.line, column=_column(fault, lines), keys=fault.keys, message=fault.reason)
        for fault in error.faults
    )


def _column(fault: Fault, lines: list[str]) -> int | None:
    """Return the column, from 1, at which a fault's key stands on its line."""
    if fault.line is None or not 0 < fault.line <= len(lines):
        return None
    line = lines[fault.line - 1]
    for key in reversed(fault.keys):
        found = re.search(rf"(?<![\w.-])[\"']?{re.escape(str(key))}[\"']?\s*:", line) if isinstance(key, str) else None
        if found is not None:
            return found.start() + 1
    return len(line) - len(line.lstrip()) + 1


def error_of(problem: Problem) -> LtlplanError:
    """Return the error that a problem was made of: the same class, the same words.

    Args:
        problem: As another's service told it.
    """
    kind = problem.type.removeprefix(_TYPE)
    found = _class_of(kind) or _EXIT_CODES.get(problem.exit_code, InternalError)
    error = found.__new__(found, problem.detail)
    Exception.__init__(error, problem.detail)
    carried: dict[str, object] = {"problem": problem}
    if isinstance(error, MissionError):
        carried["source"] = "mission"
        carried["faults"] = tuple(Fault(fault.keys, fault.line, fault.message) for fault in problem.faults)
    if isinstance(error, NotCertified):
        carried["witnesses"] = tuple(map(witness_from, problem.witnesses))
    if kind == "no-plan":
        carried |= {name: getattr(problem, name) for name in _NO_PLAN}
    if isinstance(error, Infeasible):
        carried["witness"] = next(iter(map(witness_from, problem.witnesses)), None)
    for name, value in carried.items():
        setattr(error, name, value)
    return error


def _class_of(kind: str) -> type[LtlplanError] | None:
    """Return the class of a kind of problem, or None where this version knows none."""
    if kind in _ELSEWHERE:
        module, _, name = _ELSEWHERE[kind].partition(":")
        return getattr(importlib.import_module(module), name)
    known = {_kind(each): each for each in (*_STATUS, MissionError, *_own())}
    return known.get(kind)


def kinds() -> dict[str, str]:
    """Return every kind of problem with a sentence on it, for the page that a problem's type leads to."""
    listed = {_kind(each): each for each in (*_STATUS, MissionError, *_own())}
    named = {kind: _class_of(kind) for kind in _ELSEWHERE}
    return {kind: (each.__doc__ or "").strip().splitlines()[0] for kind, each in {**listed, **named}.items() if each}


def _own() -> tuple[type[LtlplanError], ...]:
    """Return the errors of this module."""
    return tuple(each for each in globals().values() if isinstance(each, type) and each.__module__ == __name__)


def _kind(error: type[LtlplanError]) -> str:
    return re.sub(r"(?<!^)(?=[A-Z])", "-", error.__name__).lower()


def _status(error: type[LtlplanError]) -> int:
    """Return the HTTP status of a class: its own, or that of the nearest class above it."""
    if _kind(error) in _STATUS_OF_KIND:
        return _STATUS_OF_KIND[_kind(error)]
    for each in error.__mro__:
        own = vars(each).get("status")
        if isinstance(own, int):
            return own
        if each in _STATUS:
            return _STATUS[each]
    return 500


def _witnesses(error: LtlplanError) -> tuple[Witness, ...]:
    if isinstance(error, NotCertified):
        return error.witnesses
    one = getattr(error, "witness", None)
    return (one,) if isinstance(one, Witness) else ()


def witness_data(witness: Witness) -> dict[str, Any]:  # of any type: JSON nests
    """Return a witness as plain data for JSON, in which figures that are not finite are null."""
    data = asdict(witness)
    data["word"] = [[robot, sorted(letter)] for robot, letter in witness.word]
    data["times"] = [[_finite(time) for time in span] for span in witness.times]
    return {key: _finite(value) if isinstance(value, float) else value for key, value in data.items()}


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None


def witness_from(data: dict[str, Any]) -> Witness:  # of any type: JSON nests
    """Return the witness that plain data was made of; keys that this version does not know are left out."""
    known = {field.name for field in fields(Witness)}
    given = {key: value for key, value in data.items() if key in known}
    given["word"] = tuple((str(robot), frozenset(map(str, letter))) for robot, letter in given.get("word", ()))
    given["times"] = tuple(
        (-math.inf if start is None else float(start), math.inf if stop is None else float(stop))
        for start, stop in given.get("times", ())
    )
    given["order"] = tuple(((str(a), int(i)), (str(b), int(j))) for (a, i), (b, j) in given.get("order", ()))
    return Witness(**given)
