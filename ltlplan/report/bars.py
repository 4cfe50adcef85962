"""Spells of time as horizontal bars, in plain HTML: names of any length wrap, on any width, with or without JavaScript."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ltlplan.report.page import folded

_MOST_TICKS = 8
_LONGEST_NAME = 200


@dataclass(frozen=True, slots=True)
class Bar:
    """Something that lasts.

    Attributes:
        row: Name of the row that it is drawn in.
        start: s.
        end: s.
        colour: Of the bar, as CSS has it.
        text: Shown on pointing at it, with its times.
    """

    row: str
    start: float
    end: float
    colour: str
    text: str


def bars_html(name: str, bars: Sequence[Bar], rows: Sequence[str], end: float, label: str) -> str:
    """Return the bars as markup.

    Args:
        name: The markup's id.
        bars: What is drawn.
        rows: Names of the rows from top to bottom, those without a bar too.
        end: s, where the axis ends.
        label: What is seen, for those who cannot see it.
    """
    step = tick_step(end)
    lines = "".join(_row(row, _joined([bar for bar in bars if bar.row == row]), end) for row in rows)
    ticks = "".join(f'<b style="left:{_share(k * step, end)}">{k * step:g}</b>' for k in range(int(end / step + 1e-9) + 1))
    chart = (
        f'<div id="{name}" class="bars" role="img" aria-label="{html.escape(label)}" style="--step:{_share(step, end)}">'
        f'{lines}<div class="axis"><span class="name">time (s)</span><span class="ticks">{ticks}</span></div></div>'
    )
    return folded(chart, len(rows), "rows")


def tick_step(end: float) -> float:
    """Return the distance between two ticks of an axis from 0 to `end`: 1, 2 or 5 times a power of ten."""
    rough = max(end, 1e-6) / _MOST_TICKS
    power = 10.0 ** math.floor(math.log10(rough))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= rough * (1 - 1e-9))


def _joined(bars: Sequence[Bar]) -> list[Bar]:
    """Return bars that differ only in their times as one where they touch: a seam would look like an interruption."""
    joined: list[Bar] = []
    for bar in bars:
        last = joined[-1] if joined else None
        if last is not None and last.end == bar.start and (last.colour, last.text) == (bar.colour, bar.text):
            joined[-1] = replace(last, end=bar.end)
        else:
            joined.append(bar)
    return joined


def _row(name: str, bars: Sequence[Bar], end: float) -> str:
    drawn = "".join(
        f'<i style="left:{_share(bar.start, end)};width:{_share(bar.end - bar.start, end)};background:{bar.colour}" '
        f'title="{html.escape(bar.text)}: {bar.start:.2f} to {bar.end:.2f} s"></i>'
        for bar in bars
    )
    shown = name if len(name) <= _LONGEST_NAME else name[: _LONGEST_NAME - 3] + "..."
    return f'<div><span class="name" title="{html.escape(name)}">{html.escape(shown)}</span><span class="track">{drawn}</span></div>'


def _share(time: float, end: float) -> str:
    return f"{100 * time / max(end, 1e-6):.3f}%"
