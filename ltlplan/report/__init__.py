"""The report: one self-contained page with the 3-D scene that plays, labels, sub-formulas, claims and errors.

The first screen is the answer: is it certified, for how long, with how much room, and who flies what. The page fetches
nothing: plotly's script, the styles and the data are all in it. The same run gives the same bytes.
"""

from __future__ import annotations

import html
from string import Template
from typing import TYPE_CHECKING, Any

import plotly.graph_objects as go

from flight.draw import Floats, robot_colour, sample_paths, scene
from ltlplan.report.charts import error_chart, label_chart, rotor_chart, truth_chart
from ltlplan.report.history import Reading, Spell, letter_spells, still_to_do, team_readings
from ltlplan.report.inline import figure_data, package_text, plotly_script, script_data
from verify.data.word import show_letter

if TYPE_CHECKING:
    from ltlplan.pipeline import Result
    from verify import Certificate
    from verify.data import Mission

STEP = 0.05
"""Time between samples of the drawn paths, s."""


def report_html(result: Result) -> str:
    """Return the page for one run."""
    mission, certificate = result.mission, result.certificate
    times, paths = sample_paths(result.team, STEP, mission.spec.repeat)
    letters = _letters(mission, certificate, times, paths)
    readings = team_readings(letters, joint=mission.spec.team == "joint")
    cycle = _cycle_start(result)
    end = float(times[-1])
    flown = {name: result.log.position[:, i] for i, name in enumerate(result.log.robots)}
    waypoints = {name: [w.position for w in robot.waypoints] for name, robot in result.plan.robots.items()}
    figures: dict[str, go.Figure] = {
        "scene": scene(mission, paths, flown=flown, waypoints=waypoints, tube=certificate.margin),
        "labels": label_chart(certificate, letters, end, cycle),
        "errors": error_chart(result),
    }
    sections = [
        _section(
            "Labels over time",
            "labels",
            "Dark: the robot is in the region for sure, wherever it is within the margin. Light: it may be in it. "
            "Grey: propositions of its internal state.",
        ),
    ]
    if mission.spec.formula is not None:
        figures["truth"] = truth_chart(mission.formula, readings, end, cycle)
        sections.append(
            _section(
                "Sub-formulas over time",
                "truth",
                "A bar at a time: what is flown from then on satisfies the sub-formula. `F a` is true until a is reached for "
                "the last time. Judged on the nominal letters; the claim is the certificate's.",
            )
        )
    sections.append(
        _section(
            "Tracking error",
            "errors",
            "Distance of the simulated robot from its certified path; the certificate covers the flight while it stays below the margin.",
        )
    )
    if result.log.rotors is not None:
        figures["rotors"] = rotor_chart(result, result.log.rotors)
        sections.append(
            _section("Rotor thrusts", "rotors", "Greatest (line) and least (dots) rotor of each robot, against the limits.")
        )
    sections += [_plan_table(result), _claim_table(certificate), _flight_notes(result)]
    data = {
        "figures": {name: figure_data(figure) for name, figure in figures.items()},
        "paths": {name: [[round(float(v), 4) for v in row[:3]] for row in path] for name, path in paths.items()},
        "step": float(times[1] - times[0]),
        "letters": {name: [[s.start, _show(s)] for s in mine] for name, mine in letters.items()},
        "todo": _todo(mission, readings),
    }
    return _page(result, data, sections, end)


def _page(result: Result, data: dict[str, Any], sections: list[str], end: float) -> str:
    from ltlplan.commands.summary import certified_sentence, holds, shortfall

    mission, certificate = result.mission, result.certificate
    good = holds(result)
    verdict = (
        f"{certified_sentence(result)}, and flown in simulation inside it."
        if good
        else f"{certified_sentence(result)}, but not everything holds: {shortfall(result)}."
    )
    asked = [("asks", mission.spec.formula), ("flies exactly", mission.sequence)]
    warnings = [note for note in result.plan.notes if note.startswith("Holds only vacuously")]
    robots = ", ".join(mission.agents)
    return Template(package_text("page.html")).substitute(
        title=html.escape(mission.name),
        style=package_text("style.css"),
        verdict=html.escape(verdict),
        verdict_class="holds" if good else "fails",
        warnings="".join(f'<p class="warning">{html.escape(note)}</p>' for note in warnings),
        asked="".join(
            f'<p class="formula"><span>{word}</span> <code>{html.escape(text)}</code></p>' for word, text in asked if text
        ),
        facts="".join(
            f"<div><dt>{html.escape(name)}</dt><dd>{html.escape(value)} <small>{html.escape(more)}</small></dd></div>"
            for name, value, more in _facts(result, end)
        ),
        duration=f"{end:.3f}",
        scene_label=html.escape(
            f"Moving 3-D picture of the hoops and of the paths of {robots}; the plan's table says the same."
        ),
        robots=_robots(result),
        sections="\n".join(sections),
        footer=html.escape(
            f"Certificate {certificate.digest()}. It does not cover climb, landing, another airframe or another time scale."
        ),
        plotly=plotly_script(),
        data=script_data(data),
        script=package_text("figures.js") + package_text("player.js"),
    )


def _facts(result: Result, end: float) -> list[tuple[str, str, str]]:
    """Return the figures of the first screen: name, value, what to compare it with."""
    from ltlplan.commands.summary import tracking

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
    weights = ", ".join(f"{name} {weight:g}" for name, weight in mission.planner.cost.items() if weight)
    facts.append(("Cost", f"{result.plan.cost:.3f}", f"{weights}; {result.plan.method}"))
    return facts


def _robots(result: Result) -> str:
    """Return the list beside the scene: each robot, its visits, and room for the letter that it shows now."""
    from ltlplan.commands.summary import visits_text

    return "".join(
        f'<dt><i style="background:{robot_colour(index)}"></i>{html.escape(name)}</dt>'
        f'<dd class="visits">{html.escape(visits_text(robot))}</dd><dd class="letter" id="letter{index}"></dd>'
        for index, (name, robot) in enumerate(result.plan.robots.items())
    )


def _letters(mission: Mission, certificate: Certificate, times: Floats, paths: dict[str, Floats]) -> dict[str, list[Spell]]:
    result: dict[str, list[Spell]] = {}
    for name, path in paths.items():
        actions = sorted((action.time, action.target) for action in certificate.actions if action.robot == name)
        result[name] = letter_spells(mission, name, times, path, actions)
    return result


def _show(spell: Spell) -> str:
    return show_letter(spell.letter) if spell.letter else "{} (in no region)"


def _cycle_start(result: Result) -> float | None:
    (first, *_rest) = result.team.values()
    return None if first.cycle is None else float(first.knots[first.cycle])


def _todo(mission: Mission, readings: list[Reading]) -> list[list[Any]]:
    """Return rows of time in s and (part, how it stands) for each part of the formula."""
    if mission.spec.formula is None:
        return [[0.0, [["", "the sequence's passages, in order"]]]]
    if mission.spec.trace == "infinite":
        return [[0.0, [["", "for ever: the formula is judged on the repeated cycle"]]]]
    return [[time, [list(part) for part in parts]] for time, parts in still_to_do(mission.formula, readings)]


def _section(title: str, figure: str, note: str) -> str:
    return (
        f'<section><h2>{html.escape(title)}</h2><p class="note">{html.escape(note)}</p>'
        f'<div id="{figure}" class="figure" role="img" aria-label="Chart: {html.escape(title.lower())}. {html.escape(note)}"></div></section>'
    )


def _plan_table(result: Result) -> str:
    from ltlplan.commands.summary import tracking, visits_text

    flown = tracking(result)
    rows = [
        [name, visits_text(robot), str(robot.word), f"{robot.cost:.3f}", f"{1000 * flown[name]['worst']:.1f} mm"]
        for name, robot in result.plan.robots.items()
    ]
    table = _table(("robot", "visits", "word", "cost", "worst error"), rows, numbers=(3, 4))
    notes = "".join(f'<p class="note">{html.escape(note)}</p>' for note in result.plan.notes)
    return f"<section><h2>Plan</h2>{notes}{table}</section>"


def _claim_table(certificate: Certificate) -> str:
    from ltlplan.commands.summary import HEADER, claim_rows, tightest_rows

    def table(rows: list[tuple[str, ...]]) -> str:
        return _table(HEADER, [list(row) for row in rows], numbers=(3, 4, 5), verdict=2)

    note = "Each holds at all times, for every flight within the margin (limits: for the nominal flight). The tightest of each kind:"
    every = f"<details><summary>All {len(certificate.claims)} claims</summary>{table(claim_rows(certificate))}</details>"
    return f'<section><h2>Claims</h2><p class="note">{note}</p>{table(tightest_rows(certificate))}{every}</section>'


def _flight_notes(result: Result) -> str:
    from ltlplan.commands.summary import flight_sentences

    notes = "".join(f"<li>{html.escape(sentence)}</li>" for sentence in flight_sentences(result))
    return f"<section><h2>Monitor</h2><ul>{notes}</ul></section>" if notes else ""


def _table(header: tuple[str, ...], rows: list[list[str]], *, numbers: tuple[int, ...] = (), verdict: int | None = None) -> str:
    head = "".join(f'<th scope="col">{html.escape(cell)}</th>' for cell in header)
    body = ""
    for row in rows:
        cells = ""
        for index, cell in enumerate(row):
            kind = "number" if index in numbers else cell if index == verdict else ""
            cells += f'<td class="{kind}">{html.escape(cell)}</td>'
        body += f"<tr>{cells}</tr>"
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'
