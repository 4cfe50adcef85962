"""Plots of figures over values, as SVG that stands by itself and follows the colours of a page that it is put into."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass

from ltlplan.service.people.user_studies import written
from ltlplan.service.study_models import Figure, Study

NAMES: dict[Figure, str] = {
    "cost": "cost",
    "duration": "duration, s",
    "largest_margin": "largest margin that holds, mm",
    "worst_error": "worst tracking error, mm",
    "seconds": "time to compute, s",
}
"""Figures that are plotted, in words."""

_SCALE: dict[Figure, float] = {"largest_margin": 1000.0, "worst_error": 1000.0}
_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 640.0, 300.0, 64.0, 16.0, 16.0, 58.0
_MOST_LABELS = 12
_LONGEST_LABEL = 18
_STYLE = "font: 12px system-ui, sans-serif"


@dataclass(frozen=True, slots=True)
class _Axis:
    """An axis: from where to where, in data and in px, and its marks."""

    low: float
    high: float
    start: float
    end: float
    ticks: tuple[float, ...]

    def at(self, value: float) -> float:
        share = (value - self.low) / (self.high - self.low)
        return self.start + share * (self.end - self.start)


def study_plot(study: Study, figure: Figure) -> str:
    """Return a plot of one figure over a study's values: a dot a job; a cross on the axis for one that has failed.

    Args:
        study: With its members.
        figure: What is plotted.
    """
    values = [member.value for member in study.members]
    numeric = all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)
    places = [float(value) if numeric and isinstance(value, int | float) else float(i) for i, value in enumerate(values)]
    raw = [getattr(member.figures, figure) for member in study.members]
    heights = [None if each is None else _SCALE.get(figure, 1.0) * each for each in raw]
    failed = [member.figures.state in ("failed", "cancelled", "deleted") for member in study.members]
    across = _axis(places, _LEFT, _WIDTH - _RIGHT) if numeric else _named(len(values))
    up = _axis([each for each in heights if each is not None], _HEIGHT - _BOTTOM, _TOP)
    labels = {tick: f"{tick:g}" for tick in across.ticks} if numeric else _labels([written(value) for value in values])
    parts = [*_grid(across, up, labels), *_names(study.key, NAMES[figure])]
    known = sorted((across.at(x), up.at(y)) for x, y in zip(places, heights, strict=True) if y is not None)
    if numeric and len(known) > 1:
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in known)
        parts.append(
            f'<polyline class="line" points="{points}" fill="none" stroke="#2f6fde" stroke-width="1.5" opacity="0.5"/>'
        )
    for value, x, y, gone in zip(values, places, heights, failed, strict=True):
        told = html.escape(f"{study.key} {written(value)[:60]}: {'no result' if y is None else f'{y:.4g}'}")
        if y is not None:
            shape = f'<circle class="dot" cx="{across.at(x):.1f}" cy="{up.at(y):.1f}" r="4" fill="#2f6fde">'
            parts.append(f"{shape}<title>{told}</title></circle>")
        elif gone:
            parts.append(_cross(across.at(x), _HEIGHT - _BOTTOM, told))
    said = html.escape(f"{NAMES[figure]} over {study.key}, {len(known)} of {len(values)} known")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="plot" viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" role="img" '
        f'aria-label="{said}" style="{_STYLE}" fill="currentColor">{"".join(parts)}</svg>'
    )


def _axis(values: Sequence[float], start: float, end: float) -> _Axis:
    """Return an axis that holds values, with marks at round numbers."""
    low, high = (min(values), max(values)) if values else (0.0, 1.0)
    if high - low <= 1e-9 * max(abs(low), abs(high), 1e-9):
        pad = abs(low) / 10 or 1.0
        low, high = low - pad, high + pad
    else:
        pad = (high - low) / 20
        low, high = low - pad, high + pad
    step = _round_step((high - low) / 5)
    first = math.ceil(low / step)
    ticks = tuple(step * i for i in range(first, math.floor(high / step) + 1))
    return _Axis(low, high, start, end, ticks)


def _round_step(least: float) -> float:
    scale = 10.0 ** math.floor(math.log10(least))
    return next(scale * by for by in (1.0, 2.0, 5.0, 10.0) if scale * by >= least * (1 - 1e-9))


def _named(count: int) -> _Axis:
    every = max(1, -(-count // _MOST_LABELS))
    return _Axis(-0.5, count - 0.5, _LEFT, _WIDTH - _RIGHT, tuple(float(i) for i in range(0, count, every)))


def _labels(names: Sequence[str]) -> dict[float, str]:
    most = max(4, min(_LONGEST_LABEL, int(90 / min(max(len(names), 1), _MOST_LABELS))))
    return {float(i): name if len(name) <= most else name[: most - 1] + "…" for i, name in enumerate(names)}


def _grid(across: _Axis, up: _Axis, labels: dict[float, str]) -> list[str]:
    floor = _HEIGHT - _BOTTOM
    parts = [f'<line x1="{_LEFT}" y1="{floor}" x2="{_WIDTH - _RIGHT}" y2="{floor}" stroke="currentColor" opacity="0.6"/>']
    for tick in across.ticks:
        label = html.escape(labels[tick])
        parts.append(f'<text x="{across.at(tick):.1f}" y="{floor + 18}" text-anchor="middle">{label}</text>')
    for tick in up.ticks:
        y = up.at(tick)
        line = f'<line x1="{_LEFT}" y1="{y:.1f}" x2="{_WIDTH - _RIGHT}" y2="{y:.1f}" stroke="currentColor" opacity="0.15"/>'
        parts.append(f'{line}<text x="{_LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">{tick:.6g}</text>')
    return parts


def _names(across: str, up: str) -> list[str]:
    middle = (_HEIGHT - _BOTTOM + _TOP) / 2
    return [
        f'<text x="{(_LEFT + _WIDTH - _RIGHT) / 2}" y="{_HEIGHT - 10}" text-anchor="middle">{html.escape(across)}</text>',
        f'<text transform="translate(14 {middle}) rotate(-90)" text-anchor="middle">{html.escape(up)}</text>',
    ]


def _cross(x: float, y: float, told: str) -> str:
    path = f"M{x - 4:.1f} {y - 4:.1f}l8 8m0 -8l-8 8"
    return f'<path class="cross" d="{path}" stroke="#c62828" stroke-width="2" fill="none"><title>{told}</title></path>'
