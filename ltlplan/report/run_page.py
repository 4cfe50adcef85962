"""The page of a run: one self-contained page with the 3-D scene that plays, labels, sub-formulas, claims and errors.

The first screen is the answer: is it certified, for how long, with how much room, and who flies what. The page fetches
nothing: plotly's script, the styles and the data are all in it (`inline`). The same run gives the same bytes.
"""

from __future__ import annotations

import html
from collections.abc import Mapping
from typing import TYPE_CHECKING

from flight.figures import Figure
from flight.pictures import MANY, Floats, scene
from ltlplan.report.charts import WORST, error_chart, label_chart, limit_chart, rotor_chart, truth_chart
from ltlplan.report.crowds import CROWD, lightened
from ltlplan.report.page import figure_place, folded, listed, page_html, section, table, warning
from ltlplan.report.player import player_data, player_section
from ltlplan.report.replay import replay_of
from ltlplan.report.summary import (
    PROOF_HEADER,
    certified_sentence,
    flight_sentences,
    holds,
    kind_text,
    proof_rows,
    shortfall,
    soft_sentences,
    tightest_rows,
    tracking,
    tracking_sentences,
    visits_text,
)
from ltlplan.report.views import VIEWS, clearance_sentences, views_html
from ltlplan.systems.objective import objective_text
from verify.checked_claims import NOT_COVERED, checked_of, proof_sentences

if TYPE_CHECKING:
    from ltlplan.result import Result
    from verify import Certificate

THIN = 5
"""Every so many entries of the flight's log are drawn in the scene: 20 a second, as of the paths."""


_LABELS = (
    "Dark: the robot is in the region for sure, wherever it is within the margin. Light: it may be in it. "
    "Grey: propositions of its internal state."
)
_TRUTH = (
    "A bar at a time: what is flown from then on satisfies the sub-formula. `F a` is true until a is reached for "
    "the last time. Judged on the nominal letters; the claim is the certificate's."
)
_UNTIMED = " Bounds in seconds are left out here; each has its row among the labels, and its claim."
BOUNDS = (
    " Light orange: the window of what is bounded in seconds. Dark orange: so much later all may come. Dark red: the point of no return, from which "
    "on no straight way from where the robot was before is quick enough."
)
"""How rows of bounds in seconds are read."""
_FEWER = f" Of more than {MANY} robots the {WORST} with the greatest values are drawn, and in grey the extremes of all."
_ERRORS = (
    "Distance of the simulated robot from its certified path; the certificate covers the flight while it stays below the margin."
    + _FEWER
)
_ROTORS = "Greatest (line) and least (dots) rotor of each robot, against the limits." + _FEWER
_LIMITS = (
    "Share of its limit that each robot's certified flight takes: at most 1, for all times by the certificate. Hovering takes a share of thrust. "
    "Limits of single legs are not drawn." + _FEWER.replace("extremes", "most")
)
_SCENE = (
    "Line: certified path; tube around it: the margin; dots: flown in simulation; diamonds: waypoints. Robots are discs to scale; the ring "
    "around each only shows where it is. Drag to turn, scroll to zoom, or use arrows, + and - once the scene has the focus; a click on a name "
    "hides that robot, or shows it again."
)


def report_html(result: Result) -> str:
    """Return the page for one run."""
    mission, certificate = result.mission, result.certificate
    replay = replay_of(result.plan, result.team, certificate)
    playing, end = replay.playing, replay.end
    drawn, note = _scene(result, playing.paths)
    figures: dict[str, Figure] = {"scene": drawn, "errors": error_chart(result), "limits": limit_chart(result)}
    label = f"Moving 3-D picture of the hoops and of the paths of {', '.join(mission.agents)}; the plan's table says the same."
    sections = [
        player_section(playing, label, note),
        section(
            "Labels over time",
            label_chart(certificate, playing.letters, end, replay.cycle),
            note=_LABELS + (BOUNDS if mission.timed_parts else ""),
        ),
    ]
    if mission.spec.formula is not None:
        reading = _TRUTH + (_UNTIMED if mission.timed_parts and replay.cycle is not None else "")
        sections.append(
            section(
                "Sub-formulas over time",
                truth_chart(mission, playing.letters, replay.readings, end, replay.cycle),
                note=reading,
            )
        )
    sections.append(_chart("Tracking error", "errors", _ERRORS))
    sections.append(_chart("Shares of limits", "limits", _LIMITS))
    if mission.obstacles:
        seen = views_html(mission, playing.paths) + listed(clearance_sentences(mission))
        sections.insert(1, section("From above and from two sides", seen, note=VIEWS))
    if result.log.rotors is not None:
        figures["rotors"] = rotor_chart(result, result.log.rotors)
        sections.append(_chart("Rotor thrusts", "rotors", _ROTORS))
    sections += [
        _plan_table(result),
        _claim_table(certificate, result.abort.sentence),
        _soft_parts(certificate),
        _flight_notes(result),
    ]
    return page_html(
        mission.name,
        header=_header(result, end),
        sections=sections,
        figures=figures,
        player=player_data(playing),
        footer=f"Certificate {certificate.digest()}. It does not cover climb, landing, another airframe or another time scale.",
    )


def _scene(result: Result, paths: Mapping[str, Floats]) -> tuple[Figure, str]:
    """Return the scene and how to read it; of very many robots with their paths alone."""
    mission = result.mission
    if len(mission.agents) > MANY:
        return lightened(scene(mission, paths)), CROWD
    flown = {name: result.log.position[::THIN, i] for i, name in enumerate(result.log.robots)}
    waypoints = {name: [w.position for w in robot.waypoints] for name, robot in result.plan.robots.items()}
    return scene(mission, paths, flown=flown, waypoints=waypoints, margin=result.certificate.margin), _SCENE


def _header(result: Result, end: float) -> str:
    """Return the answer: the verdict, what must be known before anything else, what was asked, the figures."""
    mission = result.mission
    good = holds(result)
    verdict = (
        f"{certified_sentence(result)}, and flown in simulation inside it."
        if good
        else f"{certified_sentence(result)}, but not everything holds: {shortfall(result)}."
    )
    notes = [note for note in result.plan.notes if note.startswith("Holds only vacuously")]
    asked = [("asks", mission.spec.formula), ("flies exactly", mission.sequence)]
    asked += [(f"wishes for (weight {part.weight:g})", part.formula) for part in mission.soft_parts]
    facts = "".join(
        f"<div><dt>{html.escape(name)}</dt><dd>{html.escape(value)} <small>{html.escape(more)}</small></dd></div>"
        for name, value, more in _facts(result, end)
    )
    return (
        f'<p class="verdict {"holds" if good else "fails"}">{html.escape(verdict)}</p>'
        + "".join(warning(note) for note in notes)
        + "".join(
            f'<p class="formula"><span>{word}</span> <code>{html.escape(text)}</code></p>' for word, text in asked if text
        )
        + f'<dl class="facts">{facts}</dl>'
    )


def _facts(result: Result, end: float) -> list[tuple[str, str, str]]:
    """Return the figures of the first screen: name, value, what to compare it with."""
    mission, certificate = result.mission, result.certificate
    idle = sum(not robot.visits for robot in result.plan.robots.values())
    many = len(mission.agents)
    flown = tracking(result)
    worst = max(flown, key=lambda name: flown[name]["worst"])
    largest = certificate.largest_margin
    facts = [
        ("Robots", str(many), "" if not idle else "it stays at its start" if many == 1 else f"{idle} of them not needed"),
        ("Flight", f"{end:.2f} s", f"{mission.spec.repeat} laps" if mission.spec.repeat > 1 else ""),
        ("Margin", f"{1000 * certificate.margin:g} mm", "" if largest is None else f"{1000 * largest:.1f} mm would hold too"),
        ("Worst tracking error", f"{1000 * flown[worst]['worst']:.1f} mm", f"{worst}, in simulation"),
    ]
    apart = [claim for claim in certificate.claims if claim.name == "separation" and claim.bound is not None]
    if apart:
        nearest = min(apart, key=lambda claim: claim.bound or 0.0)
        facts.append(("Closest two robots", f"{nearest.bound:.3f} m", f"{nearest.limit:.3g} m needed"))
        facts.append(("Clocks", f"{1000 * certificate.clock_error:g} ms", "apart at most, at every moment"))
    if certificate.kernel is None:
        facts.append(("Proof", "judged", "by the checker; there is none for the kernel"))
    else:
        facts.append(("Proof", checked_of(certificate.claims), "claims checked by the kernel"))
    alike = ", ".join(f"{name} {weight:g}" for name, weight in mission.planner.cost.items() if weight)
    weights = objective_text(mission) or alike
    facts.append(("Cost", result.plan.cost_text, f"{weights}; {result.plan.method}"))
    return facts


def _chart(title: str, figure: str, note: str) -> str:
    return section(title, figure_place(figure, f"Chart: {title.lower()}. {note}"), note=note)


def _plan_table(result: Result) -> str:
    flown = tracking(result)
    rows = [
        [name, visits_text(robot), str(robot.word), f"{robot.cost:.3f}", f"{1000 * flown[name]['worst']:.1f} mm"]
        for name, robot in result.plan.robots.items()
    ]
    titles, numbers = ("robot", "visits", "word", "cost", "worst error"), (3, 4)
    if not result.mission.of_one_kind:
        rows = [[row[0], kind_text(result.mission, row[0]), *row[1:]] for row in rows]
        titles, numbers = ("robot", "kind", *titles[1:]), (4, 5)
    content = folded(table(titles, rows, numbers=numbers), len(rows), "robots")
    notes = "".join(f'<p class="note">{html.escape(note)}</p>' for note in result.plan.notes)
    return section("Plan", notes + content)


def _claim_table(certificate: Certificate, abort: str) -> str:
    def claims(rows: list[tuple[str, ...]]) -> str:
        return table(PROOF_HEADER, rows, numbers=(4, 5, 6), verdict=2)

    note = "Each holds at all times, for every flight within the margin (limits: for the nominal flight). The tightest of each kind:"
    every = f"<details><summary>All {len(certificate.claims)} claims</summary>{claims(proof_rows(certificate))}</details>"
    said = f'<p class="note">{html.escape(f"{abort} ({NOT_COVERED})")}</p>'
    proof = listed([*tracking_sentences(certificate), *proof_sentences(certificate.claims, certificate.kernel)])
    return section("Claims", claims(tightest_rows(certificate)) + proof + said + every, note=note)


def _soft_parts(certificate: Certificate) -> str:
    note = "Wished for beside the formula. The certificate holds without them, and says of each whether it is proved."
    return section("Soft parts", listed(soft_sentences(certificate)), note=note) if certificate.soft else ""


def _flight_notes(result: Result) -> str:
    sentences = flight_sentences(result)
    return section("Monitor", listed(sentences)) if sentences else ""
