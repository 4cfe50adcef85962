"""The readable summary that closes a run, and the same as plain data for `--json`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ltlplan.pipeline import Result
    from verify import Certificate, Claim
    from verify.data import Plan


def plan_lines(plan: Plan) -> list[str]:
    """Return the plan for a person: formula, each robot's visits and word, the cost."""
    mission = plan.mission
    lines = [f"mission   {mission.name}"]
    if mission.spec.formula is not None:
        lines.append(f"formula   {mission.spec.formula}  ({mission.spec.trace} trace, team: {mission.spec.team})")
    if mission.sequence is not None:
        lines.append(f"sequence  {mission.sequence}")
    for name, robot in plan.robots.items():
        visits = [visit.region + (visit.direction or "") + ("*" if visit.actions else "") for visit in robot.visits]
        if robot.cycle_visit is not None:
            visits = [*visits[: robot.cycle_visit], "(" + " ".join(visits[robot.cycle_visit :] or ["hover"]) + ")*"]
        lines.append(f"{name:<9} {' '.join(visits) or 'stays at its start'}")
        lines.append(f"          word {robot.word}")
    bound = "" if plan.lower_bound is None else f", at least {plan.lower_bound:.3f} by the search's bound"
    proved = ", optimal assignment" if plan.complete and plan.method == "exact" else ""
    lines.append(f"cost      {plan.cost:.3f} ({plan.method}{proved}{bound}, seed {plan.seed})")
    lines += [f"note      {note}" for note in plan.notes]
    return lines


def claim_rows(certificate: Certificate) -> list[tuple[str, str, str, str, str, str]]:
    """Return the claims as rows of text: claim, robot, verdict, bound, limit, margin or time where it is tight."""
    return [
        (
            claim.name,
            claim.robot or "team",
            claim.verdict,
            _figure(claim.bound, claim.unit),
            _figure(claim.limit, claim.unit),
            _tight(claim),
        )
        for claim in certificate.claims
    ]


def claim_lines(certificate: Certificate) -> list[str]:
    """Return the claims as an aligned table."""
    header = ("claim", "robot", "verdict", "bound", "limit", "tight at")
    rows = [header, *claim_rows(certificate)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(header))]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def summary_lines(result: Result) -> list[str]:
    """Return the whole summary of a run."""
    certificate = result.certificate
    lines = [*plan_lines(result.plan), ""]
    largest = "" if certificate.largest_margin is None else f", the largest that holds is {certificate.largest_margin:.4f} m"
    rounds = "1 round" if result.rounds == 1 else f"{result.rounds} rounds"
    lines.append(
        f"certified for all t in [0, {certificate.duration:.2f} s] at margin {certificate.margin:g} m{largest} ({rounds} of refinement)"
    )
    lines += ["  " + line for line in claim_lines(certificate)]
    lines.append("")
    for name, flown in tracking(result).items():
        lines.append(
            f"flight    {name}: worst tracking error {1000 * flown['worst']:.1f} mm, RMS {1000 * flown['rms']:.1f} mm "
            f"(margin {1000 * certificate.margin:.1f} mm)"
        )
    lines += [f"flight    {sentence}" for sentence in flight_sentences(result)]
    lines += [f"wrote     {path}" for path in result.files]
    return lines


def tracking(result: Result) -> dict[str, dict[str, float]]:
    """Return each robot's worst and RMS tracking error in m."""
    log = result.log
    worst = log.error.max(axis=0) if log.peak is None else log.peak
    return {name: {"worst": float(worst[i]), "rms": log.rms_error[name]} for i, name in enumerate(log.robots)}


def flight_sentences(result: Result) -> tuple[str, ...]:
    """Return what the monitor said of the flight, for a person."""
    events = [
        f"{event.time:.2f} s{'' if event.robot is None else ' ' + event.robot}: {event.sentence}" for event in result.log.events
    ]
    return (*events, *result.log.notes)


def holds(result: Result) -> bool:
    """Tell whether everything holds: all claims, and the simulated flight inside its tube and by its formula."""
    inside = all(flown["worst"] <= result.certificate.margin for flown in tracking(result).values())
    return inside and result.log.satisfied is not False and all(claim.verdict == "holds" for claim in result.certificate.claims)


def summary_data(result: Result) -> dict[str, Any]:
    """Return the summary as plain data."""
    certificate = result.certificate
    return {
        "mission": result.mission.name,
        "holds": holds(result),
        "cost": result.plan.cost,
        "words": {name: str(word) for name, word in result.plan.words.items()},
        "visits": {name: [v.region + (v.direction or "") for v in robot.visits] for name, robot in result.plan.robots.items()},
        "margin": certificate.margin,
        "largest_margin": certificate.largest_margin,
        "duration": certificate.duration,
        "claims": [
            {
                "name": c.name,
                "robot": c.robot,
                "verdict": c.verdict,
                "bound": c.bound,
                "limit": c.limit,
                "unit": c.unit,
                "time": c.time,
            }
            for c in certificate.claims
        ],
        "tracking": tracking(result),
        "flight": list(flight_sentences(result)),
        "notes": list(result.plan.notes),
        "rounds": result.rounds,
        "files": [str(path) for path in result.files],
    }


def _figure(value: float | None, unit: str) -> str:
    return "" if value is None else f"{value:.4g} {unit}".rstrip()


def _tight(claim: Claim) -> str:
    return "" if claim.time is None else f"{claim.time:.2f} s"
