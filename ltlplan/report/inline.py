"""What every page carries inside itself, so that it fetches nothing: styles, scripts, plotly, figures as data.

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
from collections.abc import Mapping
from importlib import resources
from typing import Any

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

_SAFE = str.maketrans("<", ",")
"""The one letter of Python's base 85 that could begin markup, and what stands for it."""


def package_text(name: str) -> str:
    """Return a file of this package, such as `style.css`."""
    return (resources.files("ltlplan.report") / name).read_text(encoding="utf-8")


def packed(text: str) -> str:
    """Return a text compressed and in letters that may stand in a script element; `figures.js` unpacks it."""
    return base64.b85encode(gzip.compress(text.encode(), mtime=0)).decode().translate(_SAFE)


@functools.cache
def plotly_script() -> str:
    """Return plotly's script, packed."""
    return packed(get_plotlyjs())


def figures_data(figures: Mapping[str, go.Figure]) -> dict[str, object]:
    """Return figures as plain data: each trace once, however many figures show it, and no template of plotly's.

    Args:
        figures: By name.

    Returns:
        `traces`, and `figures`: for each name its `layout`, and as `data` the places of its traces among them.
    """
    places: dict[str, int] = {}
    shown: dict[str, Any] = {}
    for name, figure in figures.items():
        data: dict[str, Any] = json.loads(figure.to_json() or "{}")
        data["layout"].pop("template", None)
        texts = [json.dumps(trace, allow_nan=False) for trace in data["data"]]
        shown[name] = {"data": [places.setdefault(text, len(places)) for text in texts], "layout": data["layout"]}
    return {"traces": [json.loads(text) for text in places], "figures": shown}


def script_data(data: dict[str, object]) -> str:
    """Return data as JSON, packed."""
    return packed(json.dumps(data, allow_nan=False, separators=(",", ":")))
