"""The summary of a run that fits a screen: what was asked, what was found, what is proved, how it flew, and what to do next."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING

from ltlplan.report.summary import (
    TINY,
    certified_sentence,
    nearest_to_limit,
    shortfall,
    soft_sentences,
    timing_sentences,
    tracking,
    tracking_sentences,
    visits_text,
)

if TYPE_CHECKING:
    from ltlplan.result import Result

WIDTH = 112
"""Characters of a formula, a robot's visits or a note; what is longer is cut here, and whole in `summary_lines`."""
ROBOTS = 6
"""Robots whose visits are shown."""
NOTES = 3
"""Notes that are shown."""


def brief_lines(result: Result) -> list[str]:
    """Return a run's summary for a screen of 24 lines.

    Args:
        result: Of the run.
    """
    mission = result.mission
    said = mission.spec.formula or f"sequence {mission.sequence}"
    sections = {
        "asked": [f"{mission.name}: {said}", f"{mission.spec.trace} trace, team: {mission.spec.team}, seed {result.plan.seed}"],
        "found": _found(result),
        "proved": _proved(result),
        "flown": _flown(result),
        "next": _next(result),
    }
    return [
        f"{'' if number else name:<8}{_cut(line) if name in ('asked', 'found') else line}"
        for name, lines in sections.items()
        for number, line in enumerate(lines)
    ]


def _found(result: Result) -> list[str]:
    """Return who goes where, the cost, and how long it takes."""
    plan = result.plan
    going = {name: robot for name, robot in plan.robots.items() if robot.visits or robot.cycle_visit is not None}
    shown = list(going)[:ROBOTS]
    lines = [f"{name} flies {visits_text(going[name])}" for name in shown]
    if more := len(going) - len(shown):
        lines.append(f"and {more} more {'robot flies' if more == 1 else 'robots fly'}")
    if still := [name for name in plan.robots if name not in going]:
        lines.append(
            f"{', '.join(still[:ROBOTS])}{', ...' if len(still) > ROBOTS else ''} {'stays' if len(still) == 1 else 'stay'}"
        )
    bound = plan.lower_bound
    known = f"; no plan costs less than {bound:.3f}" if plan.method == "exact" and bound is not None and bound > TINY else ""
    lines.append(f"cost {plan.cost_text} (method {plan.method}{known}), {result.certificate.duration:.2f} s of flight")
    notes = [f"note: {note}" for note in plan.notes]
    return [*lines, *notes[:NOTES]]


def _proved(result: Result) -> list[str]:
    """Return what is certified, by whom it is checked, and the claim that is nearest to its limit."""
    from verify.checked_claims import proof_sentences

    certificate = result.certificate
    lines = [certified_sentence(result)]
    lines += proof_sentences(certificate.claims, certificate.kernel)
    lines += [f"not so: {claim.sentence}" for claim in certificate.claims if claim.outcome != "holds"]
    if (tightest := nearest_to_limit(certificate)) is not None:
        lines.append(f"nearest to its limit: {tightest}")
    lines += [sentence.partition(" Assumed: ")[0] for sentence in tracking_sentences(certificate)]
    lines += [*timing_sentences(certificate), *soft_sentences(certificate)]
    abort = result.abort
    lines.append("braking to a hover from every instant: certified" if abort else abort.sentence)
    return lines


def _flown(result: Result) -> list[str]:
    """Return how the simulated flight went."""
    strayed = tracking(result)
    worst = max(strayed, key=lambda name: strayed[name]["worst"])
    margin = result.certificate.margin
    lines = [f"in simulation: {worst} strayed most, {1000 * strayed[worst]['worst']:.1f} mm of {1000 * margin:g} mm margin"]
    satisfied = result.log.satisfied
    if satisfied is not None:
        lines[0] += f"; the flown path {'satisfies' if satisfied else 'BREAKS'} the formula"
    lines += [] if result.corners is None else result.corners.sentences
    return [*lines, *([f"does not hold: {what}"] if (what := shortfall(result)) else [])]


def _next(result: Result) -> list[str]:
    """Return what to look at, and the commands that go on from here."""
    from flight.exports.crazyflies.crazyswarm import left_out

    report = next((path for path in result.files if path.name == "report.html"), None)
    if report is None:
        return []
    folder = shlex.quote(str(report.parent))
    lines = [f"open {report}", f"python {folder}/check.pyz {folder}: the kernel's check, from the files alone"]
    if not shortfall(result):
        lines.append(f"ltlplan campaign {folder}: many flights in wind and noise; ltlplan fly --help: over a link")
    if why := left_out(result.mission):
        lines.append(f"note: {why}")
    return [*lines, f"{len(result.files)} files are in {folder}; --verbose names them, and every claim"]


def _cut(line: str) -> str:
    return line if len(line) <= WIDTH else line[: WIDTH - 4].rstrip() + " ..."
