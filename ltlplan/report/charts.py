"""The report's charts over time: labels, sub-formulas, tracking error, rotor thrusts."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import plotly.graph_objects as go

from flight.draw import Floats, over_time, region_colours, robot_colour, spells
from ltlplan.report.history import Reading, Spell, truth_spells
from verify.data.word import show_letter

if TYPE_CHECKING:
    from ltlplan.pipeline import Result
    from verify import Certificate
    from verify.data import Formula, Mission

_INTERNAL = "#6b7280"
_TRUE = "#2f8d57"
_LONGEST_NAME = 60


def label_chart(certificate: Certificate, letters: Mapping[str, Sequence[Spell]], end: float, cycle: float | None) -> go.Figure:
    """Draw regions by robot: what must be and what may be, from the certificate's timelines.

    Args:
        certificate: Gives the timelines; of a cycle it holds one lap, which is drawn as often as it is flown.
        letters: Each robot's sampled letters, for its internal propositions.
        end: s, when the drawn flight ends.
        cycle: s, when the cycle begins, where there is one.
    """
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
            for start, stop, status in _laps(spans, float(timeline.duration), end, cycle):
                if status != "no":
                    colour = colours[region] if status == "must" else colours[region] + "66"
                    rows.append((row, start, stop, colour, f"{robot} {status} be in {region}: {start:.2f} to {stop:.2f} s"))
        held = [(spell, spell.letter - set(colours)) for spell in letters[robot] if spell.letter - set(colours)]
        for name in sorted(frozenset[str]().union(*(names for _, names in held))):
            row = f"{robot} {name}"
            order.append(row)
            rows += [
                (row, spell.start, spell.end, _INTERNAL, f"{robot}: {show_letter(names)}")
                for spell, names in held
                if name in names
            ]
    figure = spells(rows, order)
    figure.update_xaxes(range=[0, end])
    return figure


def _laps(
    spans: Sequence[tuple[float, float, str]], duration: float, end: float, cycle: float | None
) -> list[tuple[float, float, str]]:
    """Repeat the part from `cycle` on until `end`; all in s."""
    repeated = list(spans)
    lap = duration - cycle if cycle is not None else 0.0
    shift = lap
    while lap > 0.0 and duration + shift < end + lap / 2:
        repeated += [(max(a, cycle or 0.0) + shift, b + shift, status) for a, b, status in spans if b > (cycle or 0.0)]
        shift += lap
    return repeated


def shown_chart(mission: Mission, letters: Mapping[str, Sequence[Spell]], end: float) -> go.Figure:
    """Draw what each robot showed: regions and propositions of its internal states, as they were seen.

    Args:
        mission: Gives the regions.
        letters: Each robot's letters over time.
        end: s, when the drawn flight ends.
    """
    colours = region_colours(mission)
    rows: list[tuple[str, float, float, str, str]] = []
    order: list[str] = []
    for robot, mine in letters.items():
        seen = frozenset[str]().union(*(spell.letter for spell in mine))
        for name in (*(region for region in colours if region in seen), *sorted(seen - set(colours))):
            order.append(f"{robot} {name}")
            rows += [
                (order[-1], spell.start, spell.end, colours.get(name, _INTERNAL), f"{robot}: {show_letter(spell.letter)}")
                for spell in mine
                if name in spell.letter
            ]
    figure = spells(rows, order)
    figure.update_xaxes(range=[0, end])
    return figure


def truth_chart(formula: Formula, readings: list[Reading], end: float, cycle: float | None) -> go.Figure:
    """Draw when each sub-formula holds, on the readings of the team."""
    truth = truth_spells(formula, readings, end, cycle)
    rows = [
        (_shorten(name), spell.start, spell.end, _TRUE, f"{html.escape(name)} holds: {spell.start:.2f} to {spell.end:.2f} s")
        for name, mine in truth.items()
        for spell in mine
    ]
    figure = spells(rows, [_shorten(name) for name in truth])
    figure.update_xaxes(range=[0, end])
    return figure


def error_chart(result: Result) -> go.Figure:
    """Draw each robot's distance from its certified path, against the margin."""
    names = result.log.robots
    lines = {name: (result.log.times, 1000 * result.log.error[:, i]) for i, name in enumerate(names)}
    colours = {name: robot_colour(i) for i, name in enumerate(names)}
    margin = 1000 * result.certificate.margin
    return over_time(lines, "distance from the certified path (mm)", limits={f"margin {margin:g} mm": margin}, colours=colours)


def rotor_chart(result: Result, rotors: Floats) -> go.Figure:
    """Draw each robot's greatest and least rotor, against the vehicle's limits.

    Args:
        result: Gives the limits and the times.
        rotors: N. Shape (samples, robots, 4).
    """
    limits = result.mission.effective_limits
    lines: dict[str, tuple[Floats, Floats]] = {}
    colours: dict[str, str] = {}
    dashes: dict[str, str] = {}
    for index, name in enumerate(result.log.robots):
        for word, values in (("greatest", np.max(rotors[:, index], axis=1)), ("least", np.min(rotors[:, index], axis=1))):
            lines[f"{name} {word}"] = (result.log.times, values)
            colours[f"{name} {word}"] = robot_colour(index)
            dashes[f"{name} {word}"] = "solid" if word == "greatest" else "dot"
    marks = {f"most: {limits.rotor_thrust_max:g} N": limits.rotor_thrust_max}
    marks[f"least: {limits.rotor_thrust_min:g} N"] = limits.rotor_thrust_min
    return over_time(lines, "thrust of one rotor (N)", limits=marks, colours=colours, dashes=dashes)


def _shorten(text: str) -> str:
    return text if len(text) <= _LONGEST_NAME else text[: _LONGEST_NAME - 3] + "..."
