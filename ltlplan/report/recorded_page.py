"""The page of a flight that was flown and recorded: the flown path in its tube, how far it was from the plan, and claim by claim what holds."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING

import numpy as np

from flight.figures import Figure
from flight.pictures import MANY, robot_colour, sample_paths, scene, scene_layout
from flight.shapes import Floats, line, points
from ltlplan.report.crowds import CROWD, lightened
from ltlplan.report.over_time import Line, over_time
from ltlplan.report.page import figure_place, folded, listed, page_html, section, table
from ltlplan.report.summary import HEADER, claim_rows
from verify.recordings.geometric_claims import TELLS
from verify.recordings.planned_paths import planned_paths

if TYPE_CHECKING:
    from verify import FlightVerdict
    from verify.recordings.flight_log import Samples
    from verify.recordings.flight_reference import FlightReference

MOST_POINTS = 2000
"""Of each robot that are drawn; the checker looked at all samples."""

MOST_STEPS = 600
"""Of the chart of distances: in each the farthest sample is drawn."""

_SCENE = (
    "Line: certified path; tube around it: the margin; amber dots: where the robot was measured. Grey: before the flight and after it, which nothing is "
    "claimed of. Drag to turn, scroll to zoom; a click on a name hides that robot."
)
_ALONE = "Amber dots: where the robot was measured. Drag to turn, scroll to zoom; a click on a name hides that robot."
_ERRORS = (
    "Distance of each measured position from the plan at its time, the measurement's error not taken off. Where a line ends, the robot was not "
    "seen; what it may have done between samples is in the claims."
)
_KIND = {"holds": "holds", "fails": "fails", "undecided": "fails"}
_BEYOND = "#8b93a1"
_FLOWN = "#ffb000"
"""Amber, on the colours of robots and on white and black."""


def recorded_html(asked: FlightReference, samples: Samples, verdict: FlightVerdict, *, source: str) -> str:
    """Return one self-contained page for a recorded flight. The same flight gives the same bytes.

    Args:
        asked: What it was compared with.
        samples: What was measured.
        verdict: What that shows.
        source: Names the recording.
    """
    mission = asked.mission
    label = f"3-D picture of where {', '.join(mission.agents)} were measured, and of what was planned; the table of claims says what holds."
    drawn, note = _scene(asked, samples, verdict)
    figures: dict[str, Figure] = {"scene": drawn}
    sections = [section("The flown path", figure_place("scene", label, scene=True), note=note)]
    if asked.team is not None:
        figures["errors"] = _errors(asked, samples, verdict)
        sections.append(
            section("Distance from the plan", figure_place("errors", f"Chart: distance from the plan. {_ERRORS}"), note=_ERRORS)
        )
    sections += [_claims(verdict), section("What the verdict rests on", listed(verdict.assumptions))]
    return page_html(
        f"{mission.name}, as it was flown",
        header=_header(asked, samples, verdict, source),
        sections=sections,
        figures=figures,
        footer=f"Judged from the recording {source}: positions at instants, and everything that robots may have done between them.",
    )


def _header(asked: FlightReference, samples: Samples, verdict: FlightVerdict, source: str) -> str:
    """Return the verdict and the figures of the first screen."""
    facts = [("Recording", source, f"{len(samples.times)} instants"), ("Robots", str(len(samples.positions)), "")]
    begin, end = _window(asked, samples, verdict)
    facts.append(("Flight", f"{end - begin:.2f} s", f"from {begin:g} s of the recording" if begin else ""))
    tubes = [claim for claim in verdict.claims if claim.name == "tube" and claim.bound is not None]
    if tubes:
        worst = max(tubes, key=lambda claim: (claim.outcome == "fails", claim.bound or 0.0))
        kind = "at least" if worst.outcome == "fails" else "at most"
        facts.append(("Farthest from the plan", f"{1000 * (worst.bound or 0.0):.1f} mm", f"{worst.robot}, {kind}"))
        facts.append(("Margin", f"{1000 * asked.margin:g} mm", ""))
    apart = [claim for claim in verdict.claims if claim.name == "separation" and claim.bound is not None]
    if apart:
        nearest = min(apart, key=lambda claim: (claim.outcome != "fails", claim.bound or 0.0))
        kind = "at most" if nearest.outcome == "fails" else "at least"
        value = max(nearest.bound or 0.0, 0.0)
        facts.append(("Closest two robots", f"{value:.3f} m", f"{kind}; {nearest.limit:.3g} m needed"))
    shown = "".join(
        f"<div><dt>{html.escape(name)}</dt><dd>{html.escape(value)} <small>{html.escape(more)}</small></dd></div>"
        for name, value, more in facts
    )
    asks = "".join(
        f'<p class="formula"><span>{word}</span> <code>{html.escape(text)}</code></p>'
        for word, text in (("asks", asked.mission.spec.formula), ("flies exactly", asked.mission.sequence))
        if text
    )
    return (
        f'<p class="verdict {_KIND[verdict.outcome]}">{html.escape(verdict.sentence)}</p>{asks}<dl class="facts">{shown}</dl>'
    )


def _window(asked: FlightReference, samples: Samples, verdict: FlightVerdict) -> tuple[float, float]:
    """Return from when until when the flight lasted, s of the samples' clock, as far as that is known."""
    first, last = samples.span
    if not verdict.alignment.trusted:
        return first, last
    begin = verdict.alignment.low / 2 + verdict.alignment.high / 2
    if asked.team is None:
        return begin, last
    return begin, begin + max(path.end for path in planned_paths(asked.worlds[0].mission, asked.team).values())


def _scene(asked: FlightReference, samples: Samples, verdict: FlightVerdict) -> tuple[Figure, str]:
    """Return the scene and how to read it; of very many robots with their flown paths alone."""
    mission = asked.mission
    begin, end = _window(asked, samples, verdict)
    inside = (samples.times >= begin) & (samples.times <= end)
    flown = {name: _drawn(places[inside]) for name, places in samples.positions.items()}
    flown = {name: path for name, path in flown.items() if len(path)}
    earlier = [(after.since, before.mission) for before, after in zip(asked.worlds, asked.worlds[1:], strict=False)]
    if len(mission.agents) > MANY:
        return lightened(scene(mission, flown, earlier=earlier)), CROWD
    planned = {} if asked.team is None else sample_paths(asked.team, laps=mission.spec.repeat)[1]
    figure = scene(mission, planned, margin=asked.margin if planned else None, earlier=earlier)
    beyond = [
        _drawn(places[part]) for places in samples.positions.values() for part in (samples.times < begin, samples.times > end)
    ]
    beyond = [path for path in beyond if len(path) > 1]
    moving = figure.data[-len(mission.agents) :]
    del figure.data[-len(mission.agents) :]
    for name, path in flown.items():
        figure.add_trace(points(path, f"{name}, flown", {"size": 2, "color": _FLOWN}, group=name))
    for path in beyond:
        figure.add_trace(line(path, "before and after", _BEYOND, dash="dot", width=2, shown=False))
    figure.data.extend(moving)
    figure.update_layout(scene_layout(mission, [*planned.values(), *flown.values(), *beyond]))
    return figure, _SCENE if planned else _ALONE


def _drawn(places: Floats) -> Floats:
    """Return positions that were seen, no more of them than are drawn. Shape (n, 3)."""
    seen = places[~np.isnan(places).any(axis=1)]
    return seen[:: max(1, -(-len(seen) // MOST_POINTS))]


def _errors(asked: FlightReference, samples: Samples, verdict: FlightVerdict) -> Figure:
    """Draw how far samples are from the plan: in each step of time the farthest."""
    begin, end = _window(asked, samples, verdict)
    shift = verdict.alignment.low / 2 + verdict.alignment.high / 2
    paths = planned_paths(asked.worlds[0].mission, asked.team or {})
    inside = np.flatnonzero((samples.times >= begin) & (samples.times <= end))
    times = samples.times[inside] - begin
    steps = max(2, min(MOST_STEPS, len(times)))
    bins = np.minimum((times / max(end - begin, 1e-9) * steps).astype(int), steps - 1)
    grid = (np.arange(steps) + 0.5) * (end - begin) / steps
    lines: dict[str, Line] = {}
    for index, (name, places) in enumerate(samples.positions.items()):
        away = 1000 * np.linalg.norm(places[inside] - paths[name].places(samples.times[inside] - shift), axis=1)
        worst = np.full(steps, np.nan)
        np.fmax.at(worst, bins, away)
        lines[name] = Line(grid, worst, robot_colour(index))
    return over_time(lines, "distance (mm)", {f"margin {1000 * asked.margin:g} mm": 1000 * asked.margin})


def _claims(verdict: FlightVerdict) -> str:
    """Return every claim, those first that do not hold."""
    order = sorted(range(len(verdict.claims)), key=lambda k: ("fails", "undecided", "holds").index(verdict.claims[k].outcome))
    rows = claim_rows(verdict)
    told = [[*rows[k][:2], TELLS[verdict.claims[k].outcome], *rows[k][3:], verdict.claims[k].sentence] for k in order]
    content = folded(table((*HEADER, ""), told, numbers=(3, 4, 5), verdict=2), len(told), "claims")
    note = "Each holds or is broken whatever happened between the samples; otherwise the samples cannot tell."
    return section("Claims", content, note=note)
