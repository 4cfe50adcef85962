"""The report: one self-contained page with the 3-D scene that plays, labels, sub-formulas, claims and errors.

The page fetches nothing: plotly's script, the styles and the data are all in it. The same run gives the same bytes.
"""

from __future__ import annotations

import html
import json
from importlib import resources
from string import Template
from typing import TYPE_CHECKING, Any

import numpy as np
import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

from flight.draw import Floats, over_time, region_colours, robot_colour, sample_paths, scene, spells
from ltlplan.report.history import Reading, Spell, letter_spells, still_to_do, team_readings, truth_spells
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
    laps = mission.spec.repeat
    times, paths = sample_paths(result.team, STEP, laps)
    letters = _letters(mission, certificate, times, paths)
    readings = team_readings(letters, joint=mission.spec.team == "joint")
    cycle = _cycle_start(result)
    end = float(times[-1])
    flown = {name: result.log.position[:, i] for i, name in enumerate(result.log.robots)}
    waypoints = {name: [w.position for w in robot.waypoints] for name, robot in result.plan.robots.items()}
    figures: dict[str, go.Figure] = {
        "scene": scene(mission, paths, flown=flown, waypoints=waypoints, tube=certificate.margin),
        "labels": _label_chart(certificate, letters, end),
        "errors": _error_chart(result),
    }
    sections = [
        _section(
            "Labels over time",
            "labels",
            "Dark: the robot is in the region for sure, wherever it is within the margin. Light: it may be in it.",
        ),
    ]
    if mission.spec.formula is not None:
        figures["truth"] = _truth_chart(result, readings, end, cycle)
        sections.append(
            _section(
                "Sub-formulas over time",
                "truth",
                "Where a bar is drawn, the sub-formula holds from then on, judged on the nominal letters.",
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
        figures["rotors"] = _rotor_chart(result, result.log.rotors)
        sections.append(
            _section("Rotor thrusts", "rotors", "Greatest and least rotor of each robot, against the vehicle's limits.")
        )
    sections += [_plan_table(result), _claim_table(certificate), _flight_notes(result)]
    data = {
        "figures": {name: json.loads(figure.to_json() or "{}") for name, figure in figures.items()},
        "paths": {name: [[round(float(v), 4) for v in row[:3]] for row in path] for name, path in paths.items()},
        "step": float(times[1] - times[0]),
        "colours": [robot_colour(i) for i in range(len(mission.agents))],
        "letters": {name: [[s.start, show_letter(s.letter)] for s in mine] for name, mine in letters.items()},
        "todo": _todo(mission, readings),
    }
    for figure in data["figures"].values():
        figure.get("layout", {}).pop("template", None)
    return _page(result, data, sections, end)


def _page(result: Result, data: dict[str, Any], sections: list[str], end: float) -> str:
    from ltlplan.commands.summary import holds

    mission, certificate = result.mission, result.certificate
    good = holds(result)
    verdict = (
        f"Certified for all t in [0, {certificate.duration:.2f} s] at margin {certificate.margin:g} m, and flown in simulation inside it."
        if good
        else "Not everything holds; see the claims and the tracking error below."
    )
    folder = resources.files("ltlplan.report")
    template = Template((folder / "page.html").read_text(encoding="utf-8"))
    return template.substitute(
        title=html.escape(mission.name),
        style=(folder / "style.css").read_text(encoding="utf-8"),
        verdict=html.escape(verdict),
        verdict_class="holds" if good else "fails",
        formula=html.escape(mission.spec.formula or mission.sequence or ""),
        duration=f"{end:.3f}",
        sections="\n".join(sections),
        footer=html.escape(
            f"Certificate {certificate.digest()}. It does not cover climb, landing, another airframe or another time scale."
        ),
        plotly=get_plotlyjs().replace("</script", "<\\/script"),
        data=json.dumps(data, allow_nan=False, separators=(",", ":")).replace("</", "<\\/"),
        player=(folder / "player.js").read_text(encoding="utf-8"),
    )


def _letters(mission: Mission, certificate: Certificate, times: Floats, paths: dict[str, Floats]) -> dict[str, list[Spell]]:
    result: dict[str, list[Spell]] = {}
    for name, path in paths.items():
        actions = sorted((action.time, action.target) for action in certificate.actions if action.robot == name)
        result[name] = letter_spells(mission, name, times, path, actions)
    return result


def _cycle_start(result: Result) -> float | None:
    (first, *_rest) = result.team.values()
    return None if first.cycle is None else float(first.knots[first.cycle])


def _todo(mission: Mission, readings: list[Reading]) -> list[list[Any]]:
    if mission.spec.formula is None or mission.spec.trace == "infinite":
        return [
            [0.0, "the sequence" if mission.spec.formula is None else "for ever: the formula is judged on the repeated cycle"]
        ]
    return [[time, text] for time, text in still_to_do(mission.formula, readings)]


def _label_chart(certificate: Certificate, letters: dict[str, list[Spell]], end: float) -> go.Figure:
    """Regions by robot: what must be and what may be, from the certificate's timelines."""
    rows: list[tuple[str, float, float, str, str]] = []
    order: list[str] = []
    colours = region_colours(certificate.mission)
    for robot, timeline in certificate.timelines.items():
        for region, initial in timeline.initial.items():
            changes = [(0.0, initial), *((float(c.time.low), c.status) for c in timeline.changes if c.region == region)]
            spans = [
                (a, b, status)
                for (a, status), (b, _) in zip(changes, [*changes[1:], (float(timeline.duration), "no")], strict=True)
            ]
            row = f"{robot} {region}"
            if any(status != "no" for _, _, status in spans):
                order.append(row)
            for start, stop, status in spans:
                if status != "no":
                    colour = colours[region] if status == "must" else colours[region] + "55"
                    rows.append((row, start, stop, colour, f"{robot} {status} be in {region}: {start:.2f} to {stop:.2f} s"))
        internal = f"{robot} internal"
        held = [s for s in letters[robot] if s.letter - set(colours)]
        if held:
            order.append(internal)
            rows += [(internal, s.start, s.end, "#555b66", f"{robot}: {show_letter(s.letter - set(colours))}") for s in held]
    figure = spells(rows, order)
    figure.update_xaxes(range=[0, end])
    return figure


def _truth_chart(result: Result, readings: list[Reading], end: float, cycle: float | None) -> go.Figure:
    truth = truth_spells(result.mission.formula, readings, end, cycle)
    rows = [
        (
            _shorten(name),
            spell.start,
            spell.end,
            "#2f7d4f",
            f"{html.escape(name)} holds: {spell.start:.2f} to {spell.end:.2f} s",
        )
        for name, mine in truth.items()
        for spell in mine
    ]
    figure = spells(rows, [_shorten(name) for name in truth])
    figure.update_xaxes(range=[0, end])
    return figure


def _error_chart(result: Result) -> go.Figure:
    names = result.log.robots
    lines = {name: (result.log.times, 1000 * result.log.error[:, i]) for i, name in enumerate(names)}
    colours = {name: robot_colour(i) for i, name in enumerate(names)}
    margin = 1000 * result.certificate.margin
    return over_time(lines, "distance from the certified path (mm)", limits={f"margin {margin:g} mm": margin}, colours=colours)


def _rotor_chart(result: Result, rotors: Floats) -> go.Figure:
    limits = result.mission.effective_limits
    lines: dict[str, tuple[Floats, Floats]] = {}
    colours: dict[str, str] = {}
    for index, name in enumerate(result.log.robots):
        for word, values in (("greatest", np.max(rotors[:, index], axis=1)), ("least", np.min(rotors[:, index], axis=1))):
            lines[f"{name} {word}"] = (result.log.times, values)
            colours[f"{name} {word}"] = robot_colour(index)
    marks = {"most": limits.rotor_thrust_max, "least": limits.rotor_thrust_min}
    return over_time(lines, "thrust of one rotor (N)", limits=marks, colours=colours)


def _section(title: str, figure: str, note: str) -> str:
    return f'<section><h2>{html.escape(title)}</h2><p class="note">{html.escape(note)}</p><div id="{figure}" class="figure"></div></section>'


def _plan_table(result: Result) -> str:
    from ltlplan.commands.summary import tracking

    flown = tracking(result)
    rows = []
    for name, robot in result.plan.robots.items():
        visits = " ".join(visit.region + (visit.direction or "") for visit in robot.visits) or "stays at its start"
        rows.append([name, visits, str(robot.word), f"{robot.cost:.3f}", f"{1000 * flown[name]['worst']:.1f} mm"])
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
    head = "".join(f"<th>{html.escape(cell)}</th>" for cell in header)
    body = ""
    for row in rows:
        cells = ""
        for index, cell in enumerate(row):
            kind = "number" if index in numbers else cell if index == verdict else ""
            cells += f'<td class="{kind}">{html.escape(cell)}</td>'
        body += f"<tr>{cells}</tr>"
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def _shorten(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "..."
