"""The readable summary that closes a run, and the same as plain data for `--json`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ltlplan.result import Result
    from verify import Certificate, Claim, FlightVerdict, ProofVerdict
    from verify.data import Mission, Plan, RobotPlan


TINY = 1e-12
"""Bounds below this, in any unit, are shown as 0: they come from rounding zero to the strict side."""


def plan_lines(plan: Plan) -> list[str]:
    """Return the plan for a person: formula, each robot's visits and word, the cost."""
    mission = plan.mission
    lines = [f"mission   {mission.name}"]
    if mission.spec.formula is not None:
        lines.append(f"formula   {mission.spec.formula}  ({mission.spec.trace} trace, team: {mission.spec.team})")
    if mission.sequence is not None:
        lines.append(f"sequence  {mission.sequence}")
    lines += [f"soft      {part.formula}  (weight {part.weight:g})" for part in mission.soft_parts]
    for name, robot in plan.robots.items():
        lines.append(f"{name:<9} {visits_text(robot)}")
        lines.append(f"          word {robot.word}")
        if not mission.of_one_kind:
            lines.append(f"          flies {kind_text(mission, name)}")
    lines.append(f"cost      {plan.cost_text} ({plan.method}, seed {plan.seed})")
    if plan.method == "exact" and plan.lower_bound is not None:
        gap = max(0.0, plan.cost / plan.lower_bound - 1) if plan.lower_bound > TINY else math.inf
        how = "not known" if math.isinf(gap) else f"{100 * gap:.1f} %"
        lines.append(
            f"          wherever regions are touched, no assignment costs less than {plan.lower_bound:.3f}: the gap is {how}"
        )
    lines += [f"note      {note}" for note in plan.notes]
    return lines


def kind_text(mission: Mission, robot: str) -> str:
    """Return what kind a robot is, for a person: its vehicle, its table of `robots`, its endurance.

    Args:
        mission: Says what it is.
        robot: Its name.
    """
    vehicle, kind, endurance = mission.vehicle_of(robot), mission.kind_of(robot), mission.limits_of(robot).endurance
    parts = [f"{vehicle.name}, {vehicle.mass:g} kg"]
    parts += [] if kind is None else [kind]
    parts += [f"at most {mission.limits_of(robot).speed:g} m/s"]
    parts += [] if endurance is None else [f"{endurance:g} s in the air"]
    return ", ".join(parts)


def visits_text(robot: RobotPlan) -> str:
    """Return a robot's visits for a person: hoops with their sides, actions in brackets, a cycle as (...)*."""
    visits = [
        visit.region + (visit.direction or "") + "".join(f" [{action.source} -> {action.target}]" for action in visit.actions)
        for visit in robot.visits
    ]
    if robot.cycle_visit is not None:
        visits = [*visits[: robot.cycle_visit], "(" + " ".join(visits[robot.cycle_visit :] or ["hover"]) + ")*"]
    return " ".join(visits) or "stays at its start"


HEADER = ("claim", "robot", "verdict", "bound", "limit", "tight at")
PROOF_HEADER = (*HEADER[:3], "proof", *HEADER[3:])
"""Of a certificate: `proof` says whether the kernel checked a claim, or the checker alone judged it."""


def claim_rows(certificate: Certificate | FlightVerdict) -> list[tuple[str, ...]]:
    """Return all claims as rows of text under `HEADER`."""
    return [_row(claim) for claim in certificate.claims]


def proof_rows(certificate: Certificate) -> list[tuple[str, ...]]:
    """Return all claims as rows of text under `PROOF_HEADER`."""
    return [_with_word(_row(claim), [claim]) for claim in certificate.claims]


def _with_word(row: tuple[str, ...], claims: Sequence[Claim]) -> tuple[str, ...]:
    from verify.checked_claims import word_of

    return (*row[:3], word_of(claims), *row[3:])


def tightest_rows(certificate: Certificate) -> list[tuple[str, ...]]:
    """Return one row for each kind of claim, under `PROOF_HEADER`: a refused one where there is any, else the one nearest to its limit."""
    kinds: dict[str, list[Claim]] = {}
    for claim in certificate.claims:
        kinds.setdefault(claim.name, []).append(claim)
    rows: list[tuple[str, ...]] = []
    for claims in kinds.values():
        worst = min(claims, key=lambda claim: (claim.outcome == "holds", _room(claim)))
        row = _with_word(_row(worst), claims)
        measured = worst.bound is not None
        rows.append(row if measured or worst.outcome != "holds" else (row[0], "all", *row[2:]))
    return rows


def nearest_to_limit(certificate: Certificate) -> str | None:
    """Return the measured claim with the least room to its limit, as a share of that; None where nothing is measured.

    Args:
        certificate: Of a flight.
    """
    measured = [claim for claim in certificate.claims if claim.limit and claim.margin is not None]
    if not measured:
        return None
    name, robots, _verdict, bound, limit, time = _row(min(measured, key=_room))
    return f"{name} of {robots}, {bound}, limit {limit}{time and f', at {time}'}"


def timing_sentences(certificate: Certificate) -> list[str]:
    """Return how late everything could be before a bound in seconds fails, and what they count from; empty where there are none.

    Args:
        certificate: Of a flight.
    """
    slack = [claim.bound for claim in certificate.claims if claim.name == "timing" and claim.bound is not None]
    if not slack:
        return []
    laps = "; laps follow one another without a wait" if certificate.mission.spec.trace == "infinite" else ""
    return [
        f"bounds in seconds have {min(slack):.4f} s to spare; t = 0 is the start of the certified flight, after climb and way{laps}"
    ]


def tracking_sentences(certificate: Certificate) -> list[str]:
    """Return what is proved of how near robots stay to their plans, of the one that may stray farthest; empty where nothing is.

    Args:
        certificate: Of a flight.
    """
    proved = [claim for claim in certificate.claims if claim.name == "tracking" and claim.outcome == "holds"]
    if not proved:
        return []
    farthest = max(proved, key=lambda claim: claim.bound or 0.0)
    others = len(proved) - 1
    more = (
        []
        if others == 0
        else ["The other robot strays no farther."]
        if others == 1
        else [f"{others} other robots stray no farther."]
    )
    return [" ".join([farthest.sentence, *more])]


def table_lines(rows: Sequence[tuple[str, ...]], header: tuple[str, ...] = HEADER) -> list[str]:
    """Return rows of claims as an aligned table."""
    table = [header, *rows]
    widths = [max(len(row[i]) for row in table) for i in range(len(header))]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in table]


def claim_lines(certificate: Certificate) -> list[str]:
    """Return all claims as an aligned table."""
    return table_lines(proof_rows(certificate), PROOF_HEADER)


def recorded_lines(verdict: FlightVerdict) -> list[str]:
    """Return what a recording shows of a flight: the verdict, every claim, what does not hold, and what all rests on."""
    from verify.recordings.geometric_claims import TELLS

    words = {"holds": "satisfied", "fails": "violated", "undecided": "cannot tell"}
    rows = [_row(claim) for claim in verdict.claims]
    told = [(*row[:2], TELLS[claim.outcome], *row[3:]) for row, claim in zip(rows, verdict.claims, strict=True)]
    refused = [f"{claim.name}: {claim.sentence}" for claim in verdict.claims if claim.outcome != "holds"]
    return [
        f"{words[verdict.outcome]}. {verdict.sentence}", *table_lines(told), *refused, "Assumed:", *verdict.assumptions
    ]  # fmt: skip


def summary_lines(result: Result) -> list[str]:
    """Return the whole summary of a run."""
    from flight.exports.crazyflies.crazyswarm import left_out
    from verify.checked_claims import NOT_COVERED, proof_sentences

    certificate = result.certificate
    lines = [*plan_lines(result.plan), ""]
    largest = "" if certificate.largest_margin is None else f", the largest that holds is {certificate.largest_margin:.4f} m"
    rounds = "1 round" if result.rounds == 1 else f"{result.rounds} rounds"
    lines.append(f"{certified_sentence(result)}{largest} ({rounds} of refinement)")
    lines += ["  " + line for line in table_lines(tightest_rows(certificate), PROOF_HEADER)]
    lines += [f"tracking  {sentence}" for sentence in tracking_sentences(certificate)]
    lines += [f"timing    {sentence}" for sentence in timing_sentences(certificate)]
    lines.append(f"abort     {result.abort.sentence} ({NOT_COVERED})")
    lines.append("")
    lines += [f"soft      {sentence}" for sentence in soft_sentences(certificate)]
    for name, flown in tracking(result).items():
        lines.append(
            f"flight    {name}: worst tracking error {1000 * flown['worst']:.1f} mm, RMS {1000 * flown['rms']:.1f} mm "
            f"(margin {1000 * certificate.margin:.1f} mm)"
        )
    lines += [f"flight    {sentence}" for sentence in flight_sentences(result)]
    lines += [f"wrote     {path}" for path in result.files]
    if result.files and (why := left_out(result.mission)):
        lines.append(f"note      {why}")
    lines += [f"proof     {sentence}" for sentence in proof_sentences(certificate.claims, certificate.kernel)]
    return lines


def certified_sentence(result: Result) -> str:
    """Return for which times a run is certified, at which margin, and with clocks how far apart."""
    certificate = result.certificate
    (first, *_others) = result.team.values()
    times = f"for all t in [0, {certificate.duration:.2f} s]"
    if first.cycle is not None:
        begins = float(first.knots[first.cycle])
        times = f"for all t in [0, {begins:.2f} s] and a cycle of {certificate.duration - begins:.2f} s that repeats for ever"
    return f"Certified {times}, at margin {certificate.margin:g} m{with_clocks(certificate)}, tube {certificate.tube}"


def with_clocks(certificate: Certificate) -> str:
    """Say how far apart the robots' clocks may be; nothing where they are one.

    Args:
        certificate: Of a flight.
    """
    return f", with clocks up to {certificate.clock_error:g} s apart" if certificate.clock_error else ""


def soft_data(certificate: Certificate) -> list[dict[str, object]]:
    """Return what is certified of the mission's soft specifications as plain data.

    Args:
        certificate: Of a flight.
    """
    return [
        {"formula": part.formula, "weight": part.weight, "verdict": part.outcome, "sentence": part.sentence}
        for part in certificate.soft
    ]


def soft_sentences(certificate: Certificate) -> list[str]:
    """Return what is certified of the mission's soft specifications, for a person; empty where it has none.

    Args:
        certificate: Of a flight; it holds whatever becomes of them.
    """
    from verify.checked_claims import NOT_COVERED

    if not certificate.soft:
        return []
    words = {"holds": "holds", "fails": "is not kept", "undecided": "is neither proved nor refuted"}
    whole = math.fsum(part.weight for part in certificate.soft)
    said = [
        f"`{part.formula}` (weight {part.weight:g}) {words[part.outcome]}"
        + (f": {part.sentence}" if part.outcome != "holds" else ".")
        for part in certificate.soft
    ]
    return [*said, f"Weight {certificate.soft_weight:g} of {whole:g} is certified ({NOT_COVERED})."]


def tracking(result: Result) -> dict[str, dict[str, float]]:
    """Return each robot's worst and RMS tracking error in m."""
    return {name: {"worst": result.log.worst_error(name), "rms": result.log.rms_error(name)} for name in result.log.robots}


def flight_sentences(result: Result) -> tuple[str, ...]:
    """Return what the monitor said of the flight, for a person."""
    corners = () if result.corners is None else result.corners.sentences
    return (*result.log.verdicts, *corners, *result.log.notes)


def holds(result: Result) -> bool:
    """Return whether everything holds: all claims, and the simulated flight inside its tube and by its formula."""
    return not shortfall(result)


def shortfall(result: Result) -> str:
    """Return what does not hold of a run, with the figures that broke it; empty where everything holds."""
    margin = result.certificate.margin
    refused = [f"the claim {claim.name} {claim.outcome}" for claim in result.certificate.claims if claim.outcome != "holds"]
    left = [
        f"{name} strayed {1000 * flown['worst']:.1f} mm from its certified path, the margin is {1000 * margin:g} mm"
        for name, flown in tracking(result).items()
        if flown["worst"] > margin
    ]
    broken = ["the flown path breaks the formula"] if result.log.satisfied is False else []
    return "; ".join([*refused, *left, *broken])


def summary_data(result: Result) -> dict[str, object]:
    """Return the summary as plain data."""
    from verify.certificate import proof_word

    certificate = result.certificate
    return {
        "mission": result.mission.name,
        "holds": holds(result),
        "cost": result.plan.cost,
        "words": {name: str(word) for name, word in result.plan.words.items()},
        "visits": {name: [v.region + (v.direction or "") for v in robot.visits] for name, robot in result.plan.robots.items()},
        "margin": certificate.margin,
        "largest_margin": certificate.largest_margin,
        "clock_error": certificate.clock_error,
        "duration": certificate.duration,
        "claims": [
            {
                "name": c.name,
                "robot": c.robot,
                "other": c.other,
                "verdict": c.outcome,
                **proof_word(c),
                "bound": c.bound,
                "limit": c.limit,
                "unit": c.unit,
                "time": c.time,
            }
            for c in certificate.claims
        ],
        **({"soft": soft_data(certificate), "soft_weight": certificate.soft_weight} if certificate.soft else {}),
        "tracking": tracking(result),
        "flight": list(flight_sentences(result)),
        **({} if result.corners is None else {"corners": result.corners.to_dict()}),
        "notes": list(result.plan.notes),
        "abort": {"certified": bool(result.abort), "length": result.abort.length, "sentence": result.abort.sentence},
        "rounds": result.rounds,
        "files": [str(path) for path in result.files],
        **({} if result.proof is None else {"proof": proof_data(result.proof)}),
    }


def proof_data(proof: ProofVerdict) -> dict[str, object]:
    """Return what the kernel says as plain data."""
    claims = [
        {"name": c.name, "robots": list(c.robots), "checked": not c.missing, "sentence": c.sentence or c.missing}
        for c in proof.claims
    ]
    return {"kernel": proof.kernel, "checked": proof.checked, "claims": claims}


def _row(claim: Claim) -> tuple[str, ...]:
    robots = claim.robot or "team"
    if claim.other is not None:
        robots = f"{robots}, {claim.other}"
    time = "" if claim.time is None else f"{claim.time:.2f} s"
    bound = _figure(claim.bound, claim.unit, claim)
    return (claim.name, robots, claim.outcome, bound, _figure(claim.limit, claim.unit), time)


def _room(claim: Claim) -> float:
    """Return a claim's margin to its limit, as a share of the limit; infinite where nothing is measured."""
    if claim.margin is None:
        return math.inf
    return claim.margin / abs(claim.limit) if claim.limit else claim.margin


def _figure(value: float | None, unit: str, bound_of: Claim | None = None) -> str:
    """Return a figure for a person; the bound of a claim is rounded to its safe side."""
    if value is None:
        return ""
    shown = 0.0 if abs(value) < TINY else value
    if unit in ("rad", "rad/s"):  # people and mission files have degrees
        shown, unit = math.degrees(shown), unit.replace("rad", "deg")
    if bound_of is None or bound_of.limit is None or bound_of.margin is None:
        return f"{shown:.4g} {unit}".rstrip()
    from verify.claims.claim import figures

    from_above = (value < bound_of.limit) == (bound_of.margin > 0)
    return f"{figures(shown, 4, up=from_above)} {unit}".rstrip()
