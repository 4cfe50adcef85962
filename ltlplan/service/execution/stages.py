"""A job's work in stages: each takes the bytes of what is known so far and returns more, in any process on any machine.

    mission - plan - round 1 ... round 6 - flight - files
    files of such a job - export, campaign, rehearsal or recording

They are the pipeline's own steps (`ltlplan.pipeline`), so that a job's files are those that `ltlplan run` writes, byte for byte,
and `watch.json`, which the page plays.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ltlplan.logic.budget import Budget, watched
from ltlplan.service.execution.derived import KINDS, derive
from ltlplan.service.execution.serialization import from_bytes, to_bytes
from ltlplan.service.execution.stop_requests import is_asked
from ltlplan.service.models import Problem
from ltlplan.service.problems import problem_of, witness_data
from verify.data import InternalError, LtlplanError, Mission, NotCertified, Plan
from verify.data.progress import Progress, part_of

if TYPE_CHECKING:
    from ltlplan.pipeline import Candidate
    from ltlplan.result import Result
    from verify import Certificate, Claim

PLAN = "plan"
ROUND = "round"
FLIGHT = "flight"
FILES = "files"

MAX_ROUNDS = 6

_PLANNED, _CERTIFIED, _FLOWN = 0.25, 0.7, 0.9
"""Shares of a job's work that are done after planning, after refinement and after the flight."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """Outcome of a stage.

    Attributes:
        value: What the next stage takes; empty after the last.
        found: What was found, as plain data for people.
        following: Name of the next stage; None after the last.
        files: What is to be kept for the user, by name.
        summary: After the last stage: what `ltlplan run --json` prints.
        problem: Why the job has failed, where it has something to show for it.
        stopped: Whether its search was ended with the best plan so far, on request.
    """

    value: bytes
    found: dict[str, Any]  # of any type: JSON nests
    following: str | None = None
    files: tuple[tuple[str, bytes], ...] = ()
    summary: dict[str, Any] | None = None
    problem: Problem | None = None
    stopped: bool = False


def mission_bytes(mission: Mission) -> bytes:
    """Return what the first stage takes."""
    return to_bytes(mission)


def mission_of(value: bytes) -> Mission:
    """Return the mission that is in what the first stage takes."""
    return from_bytes(value)


def run_stage(name: str, value: bytes, progress: Progress) -> Outcome:
    """Do one stage.

    Args:
        name: "plan", "round 1" to "round 6", "flight" or "files"; the kind of what is derived.
        value: What the stage before it made; of what is derived what `derived_bytes` made.
        progress: Receives a sentence and the share of the whole job done, 0 to 1.

    Raises:
        LtlplanError: The mission has no plan, or no certified flight was found, and why.
    """
    if name in KINDS:
        made = derive(name, value, progress)
        return Outcome(b"", made.found, files=made.files, problem=made.problem)
    stage = _STAGES.get(name.split()[0])
    if stage is None:
        raise InternalError(f"There is no stage '{name:.40}'.")
    known = from_bytes(value)
    progress(f"{name} begins", share_before(name))
    with watched(is_asked) as watch:
        made = stage(known, progress, Budget(watch=watch))
    return replace(made, stopped=watch.states is not None)


def share_before(name: str) -> float:
    """Return the share of a job's work that is done before a stage, 0 to 1."""
    kind, _, number = name.partition(" ")
    if kind == ROUND:
        return _PLANNED + (_CERTIFIED - _PLANNED) * min(int(number) - 1, MAX_ROUNDS) / MAX_ROUNDS
    return 0.0 if kind in KINDS else {PLAN: 0.0, FLIGHT: _CERTIFIED, FILES: _FLOWN}[kind]


def share_after(name: str) -> float:
    """Return the share of a job's work that is done after a stage, 0 to 1."""
    kind, _, number = name.partition(" ")
    if kind == ROUND:
        return _PLANNED + (_CERTIFIED - _PLANNED) * min(int(number), MAX_ROUNDS) / MAX_ROUNDS
    return 1.0 if kind in KINDS else {PLAN: _PLANNED, FLIGHT: _FLOWN, FILES: 1.0}[kind]


def plan_of(value: bytes) -> Plan:
    """Return the plan that is in what a stage made."""
    found = from_bytes(value)
    return found if isinstance(found, Plan) else found.plan


def _plan(mission: Mission, progress: Progress, budget: Budget) -> Outcome:
    from ltlplan import pipeline
    from ltlplan.allocation import Known
    from ltlplan.report.summary import plan_lines
    from ltlplan.report.summary import visits_text as visits

    made = pipeline.plan(mission, progress=part_of(progress, 0.0, _PLANNED), known=Known(budget=budget))
    found: dict[str, Any] = {
        "words": {name: str(word) for name, word in made.words.items()},
        "visits": {name: visits(robot) for name, robot in made.robots.items()},
        "cost": made.cost,
        "cost_text": made.cost_text,
        "lower_bound": made.lower_bound,
        "complete": made.complete,
        "method": made.method,
        "notes": list(made.notes),
        "lines": plan_lines(made),
    }
    return Outcome(to_bytes(pipeline.Candidate(made)), found, f"{ROUND} 1")


def _round(first: Candidate, progress: Progress, budget: Budget) -> Outcome:
    from ltlplan.allocation import Known
    from ltlplan.pipeline import Conflict, Flight, attempted, candidates, fits_margin, no_flight, plan, refitted
    from ltlplan.service.views.watching import NAME, watch_json

    low, width, number = _PLANNED, (_CERTIFIED - _PLANNED) / MAX_ROUNDS, min(first.rounds, MAX_ROUNDS - 1)
    say = part_of(progress, low + number * width, low + (number + 1) * width)
    refused: list[Flight | Conflict] = []
    candidate, tried = first, None
    for candidate in candidates(first, refused, budget):  # other words, until a flight can be checked
        if isinstance(tried, Flight):
            waits = [wait.sentence(candidate.plan.robots) for wait in candidate.plan.precedences]
            found = {**_round_data(tried.certificate, certified=False), "precedences": waits}
            return Outcome(to_bytes(candidate), found, f"{ROUND} {candidate.rounds + 1}")
        tried = attempted(candidate, progress=say)
        refused.append(tried)
    made = candidate.better_of(refused[-1]) or no_flight(candidate, refused[-1])
    if fits_margin(first.plan.mission):
        made = refitted(made, first.plan.mission, partial(plan, known=Known(budget=budget)), say, budget)
    if not isinstance(made, LtlplanError):
        found = _round_data(made.certificate, certified=True)
        if made.plan.mission.margin != first.plan.mission.margin:
            margin = f"{1000 * made.plan.mission.margin:g} mm"
            found["fitted"] = (
                f"Planned again with the margin that the proof of tracking allows, {margin}: cost {made.plan.cost_text}."
            )
        return Outcome(to_bytes(made), found, FLIGHT)
    if not isinstance(tried, Flight):
        raise made
    seen = watch_json(tried.plan, tried.team, tried.certificate)
    return Outcome(b"", _round_data(tried.certificate, certified=False), files=((NAME, seen),), problem=problem_of(made))


def _round_data(certificate: Certificate, *, certified: bool) -> dict[str, Any]:
    """Return what a round found, as plain data for people."""
    from ltlplan.report.summary import soft_sentences, tracking_sentences

    return {
        "certified": certified,
        "claims": [_claim_data(claim) for claim in certificate.claims],
        "margin": certificate.margin,
        "tube": certificate.tube,
        "tracking_proved": tracking_sentences(certificate),
        "largest_margin": certificate.largest_margin,
        "duration": certificate.duration,
        "soft": soft_sentences(certificate),
    }


def _flight(certified: Any, progress: Progress, budget: Budget) -> Outcome:  # a Certified; the pipeline is loaded by then
    from flight.conditions import conditions_of
    from ltlplan.following import followed
    from ltlplan.pipeline import attempted
    from ltlplan.report.summary import flight_sentences, tracking
    from ltlplan.result import Result

    say = part_of(progress, _CERTIFIED, _FLOWN)
    say("flying in simulation", 0.0)
    conditions = conditions_of(certified.plan.mission)
    certified, log = followed(
        certified, attempted, seed=certified.plan.seed, conditions=conditions, progress=say, budget=budget
    )
    plan = certified.plan
    result = Result(plan.mission, plan, certified.team, certified.certificate, log, certified.rounds)
    found = {
        "tracking": tracking(result),
        "worst": log.worst_error(),
        "satisfied": log.satisfied,
        "tube": log.tube,
        "sentences": list(flight_sentences(result)),
    }
    return Outcome(to_bytes((certified, log)), found, FILES)


def _files(flown: Any, progress: Progress, _budget: Budget) -> Outcome:  # a Certified and its log
    from ltlplan.output import write_run
    from ltlplan.report.summary import shortfall, summary_data
    from ltlplan.result import Result
    from ltlplan.service.views.watching import NAME, watch_json

    certified, log = flown
    part_of(progress, _FLOWN, 1.0)("writing files", 0.0)
    plan = certified.plan
    result: Result = Result(plan.mission, plan, certified.team, certified.certificate, log, certified.rounds)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "run"
        result = write_run(result, folder)
        names = sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
        files = tuple((name, (folder / name).read_bytes()) for name in names)
        result = replace(result, files=tuple(path.relative_to(folder) for path in result.files))
    files += ((NAME, watch_json(plan, result.team, result.certificate, log)),)
    missing = shortfall(result)
    refusal = NotCertified(f"The simulated flight is not the certified one: {missing}.")
    problem = problem_of(refusal) if missing else None
    found = {"files": list(names), "proof": _proof_data(result.certificate)}
    return Outcome(b"", found, None, files=files, summary=summary_data(result), problem=problem)


def _proof_data(certificate: Certificate) -> dict[str, Any]:
    """Return what the kernel says of a certificate, as plain data for people: how many of its claims are checked, and which not."""
    from verify.checked_claims import proof_sentences

    return {
        "kernel": certificate.kernel,
        "checked": certificate.checked,
        "claims": len(certificate.claims),
        "sentences": list(proof_sentences(certificate.claims, certificate.kernel)),
    }


_STAGES: dict[str, Callable[[Any, Progress, Budget], Outcome]] = {PLAN: _plan, ROUND: _round, FLIGHT: _flight, FILES: _files}


def _claim_data(claim: Claim) -> dict[str, Any]:
    """Return a claim as plain data, with all of its witness where it does not hold."""
    from verify.certificate import claim_data

    data = {"outcome" if key == "verdict" else key: value for key, value in claim_data(claim).items()}
    return data if claim.witness is None else {**data, "witness": witness_data(claim.witness)}
