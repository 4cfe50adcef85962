"""Contents that every page carries inside itself, so that it fetches nothing: styles, scripts, plotly, figures as data.

Plotly's script alone is 4.8 MB, more than a page may weigh that is sent to somebody. It is compressed, written in 85 letters,
and inflated by the browser itself (`DecompressionStream`): 1.84 MB, with all that its charts can do, from the package that is
installed anyway. Measured beside it (plotly.js 4.1.1): the same in base64 is 1.96 MB, which leaves no room for a flight below 2 MB;
plotly's own bundle for scenes would be 0.70 MB (1.75 MB unpacked), but lacks histograms, is in no Python package, and so would
have to be kept in the repository and follow plotly by hand; a scene of our own would be smaller still, and a second plotly to maintain.
"""

from __future__ import annotations

import base64
import functools
import gzip
import json
import zlib
from collections.abc import Mapping
from importlib import resources
from typing import Any, cast

import numpy as np
from plotly.offline import get_plotlyjs

from flight.figures import Figure

_EFFORT = 8
"""Of the compression, as zlib counts it: 0.04 s longer than the usual 6, for 4 kB less."""
_LETTERS = np.array([base64.b85encode(bytes([0, 0, 0, digit]))[-1] for digit in range(85)], dtype=np.uint8)
_SAFE = str.maketrans("<", ",")
"""The one letter of Python's base 85 that could begin markup, and what stands for it."""

_LONG = 24
"""Numbers from which a row is worth writing by its steps."""
_POINT = 3
_FEW, _PER = 100, 10_000
"""Coordinates and values on pages have four digits after the point, great ones two."""
_GREATEST = 2**50


def package_text(name: str) -> str:
    """Return a file of this package, such as `style.css`."""
    return (resources.files("ltlplan.report") / name).read_text(encoding="utf-8")


def packed(text: str) -> str:
    """Return a text compressed and in letters that may stand in a script element; `figures.js` unpacks it."""
    return _b85(gzip.compress(text.encode(), _EFFORT, mtime=0)).translate(_SAFE)


def _b85(data: bytes) -> str:
    """Return what `base64.b85encode` does, ten times sooner."""
    missing = -len(data) % 4
    words = np.frombuffer(data + bytes(missing), dtype=">u4").astype(np.uint32)
    letters = np.empty((len(words), 5), dtype=np.uint8)
    for place in range(4, -1, -1):
        words, digits = np.divmod(words, np.uint32(85))
        letters[:, place] = _LETTERS[digits]
    return letters.tobytes()[: 5 * len(words) - missing].decode()


@functools.cache
def plotly_script() -> str:
    """Return plotly's script, packed."""
    return packed(get_plotlyjs())


def figures_data(figures: Mapping[str, Figure]) -> dict[str, object]:
    """Return figures as plain data: each trace once, however many figures show it.

    Args:
        figures: By name.

    Returns:
        `traces`, and `figures`: for each name its `layout`, and as `data` the places of its traces among them.
    """
    places: dict[str, int] = {}
    shown: dict[str, Any] = {}
    for name, figure in figures.items():
        texts = [json.dumps(trace, allow_nan=False) for trace in figure.data]
        shown[name] = {"data": [places.setdefault(text, len(places)) for text in texts], "layout": figure.layout}
    return {"traces": [json.loads(text) for text in places], "figures": shown}


def script_data(data: dict[str, object]) -> str:
    """Return data as JSON, packed, with its long rows of numbers as `stepped` writes them."""
    return packed(json.dumps(stepped(data), allow_nan=False, separators=(",", ":")))


def stepped(value: object) -> object:
    """Return data with each long row of numbers written as whole numbers that compress well, to the last digit; `figures.js` undoes it.

    Numbers of at most four digits after the point become whole ones, and where that is shorter, their differences or the differences
    of these: those of a path that is sampled evenly are small. A row of points, such as a path, is written by columns.

    Args:
        value: What JSON can hold.

    Returns:
        The same; for a row `{"per": numbers to one, "sums": times to add up, "of": whole numbers}`, or `{"columns": [...]}`.
    """
    if isinstance(value, dict):
        return {key: stepped(part) for key, part in cast("dict[str, object]", value).items()}
    if not isinstance(value, list):
        return value
    row = cast("list[object]", value)
    if len(row) < _LONG:
        return [stepped(part) for part in row]
    if all(isinstance(part, list) and len(cast("list[object]", part)) == _POINT for part in row):
        columns = [_steps(list(column)) for column in zip(*cast("list[list[object]]", row), strict=True)]
        return [stepped(part) for part in row] if None in columns else {"columns": columns}
    return _steps(row) or [stepped(part) for part in row]


def _steps(row: list[object]) -> dict[str, object] | None:
    """Return a row of numbers as whole ones; None where some is no number, or has more digits."""
    if any(isinstance(value, bool) or not isinstance(value, int | float) for value in row):
        return None
    numbers = np.array(row, dtype=np.float64)
    for per in (1, _FEW, _PER):
        whole = np.round(numbers * per)
        if np.all(np.abs(whole) < _GREATEST) and np.array_equal(whole / per, numbers):
            break
    else:
        return None
    ways: list[tuple[int, int, list[int]]] = []
    for sums in range(3):
        ways.append((len(zlib.compress(json.dumps(whole.astype(int).tolist()).encode())), sums, whole.astype(int).tolist()))
        whole = np.diff(whole, prepend=0.0)
    _, sums, of = min(ways)
    return {"per": per, "sums": sums, "of": of}
