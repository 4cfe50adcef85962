"""Figures of a job: cost, duration, margins, words and claims out of what its stages found, for tables and comparisons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

from ltlplan.service.models import Job
from ltlplan.service.study_models import ClaimFigure, Comparison, Figures

Found = Mapping[str, Any]  # of any type: what stages found is JSON


def figures_of(job: Job) -> Figures:
    """Return the figures of a job, as far as it has come.

    Args:
        job: With what its stages found.
    """
    stages = {stage.name: stage.found for stage in job.stages}
    rounds = [found for name, found in stages.items() if name.startswith("round") and found]
    plan, flight, summary = stages.get("plan", {}), stages.get("flight", {}), job.summary or {}
    refined = rounds[-1] if rounds else {}
    claims = summary.get("claims") or refined.get("claims", ())
    return Figures(
        job=job.id,
        mission=job.mission,
        seed=job.seed,
        state=job.state,
        problem="" if job.problem is None else job.problem.detail,
        cost=summary.get("cost", plan.get("cost")),
        lower_bound=plan.get("lower_bound"),
        duration=summary.get("duration", refined.get("duration")),
        margin=summary.get("margin", refined.get("margin")),
        largest_margin=summary.get("largest_margin", refined.get("largest_margin")),
        worst_error=flight.get("worst"),
        rounds=len(rounds),
        seconds=_seconds(job),
        words=summary.get("words") or plan.get("words", {}),
        claims=tuple(map(_claim, claims)),
    )


def without_details(figures: Figures) -> Figures:
    """Return figures as a table has them: without words and claims."""
    return figures.model_copy(update={"words": {}, "claims": ()})


def compared(first: Figures, second: Figures, difference: str) -> Comparison:
    """Return two results side by side, with claims of both in one order.

    Args:
        first: The one.
        second: The other.
        difference: Between their missions.
    """
    known = {_key(claim): claim for claim in second.claims}
    common = [known.pop(_key(claim)) for claim in first.claims if _key(claim) in known]
    return Comparison(
        first=first,
        second=second.model_copy(update={"claims": (*common, *known.values())}),
        difference=difference,
    )


def claim_pairs(comparison: Comparison) -> list[tuple[ClaimFigure | None, ClaimFigure | None]]:
    """Return the claims of two results in pairs; None where only one of them has a claim."""
    second = {_key(claim): claim for claim in comparison.second.claims}
    pairs: list[tuple[ClaimFigure | None, ClaimFigure | None]] = [
        (claim, second.pop(_key(claim), None)) for claim in comparison.first.claims
    ]
    return [*pairs, *((None, claim) for claim in second.values())]


def _key(claim: ClaimFigure) -> tuple[str, str]:
    return claim.name, claim.robot


def _claim(claim: Found) -> ClaimFigure:
    bound, limit = claim.get("bound"), claim.get("limit")
    robots: Sequence[str] = [name for name in (claim.get("robot"), claim.get("other")) if name]
    return ClaimFigure(
        name=claim["name"],
        robot=" and ".join(robots),
        verdict=claim.get("verdict") or claim.get("outcome", ""),
        proof=claim.get("proof", ""),
        bound=bound,
        limit=limit,
        room=None if bound is None or limit is None else abs(limit - bound),
        unit=claim.get("unit", ""),
    )


def _seconds(job: Job) -> float | None:
    if job.started is None or job.ended is None:
        return None
    return (datetime.fromisoformat(job.ended) - datetime.fromisoformat(job.started)).total_seconds()
