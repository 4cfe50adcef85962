"""What every page carries inside itself, so that it fetches nothing: styles, scripts, figures as data."""

from __future__ import annotations

import json
from importlib import resources
from typing import Any

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs


def package_text(name: str) -> str:
    """Return a file of this package, such as `style.css`."""
    return (resources.files("ltlplan.report") / name).read_text(encoding="utf-8")


def plotly_script() -> str:
    """Return plotly's script, fit to stand inside a page."""
    return get_plotlyjs().replace("</script", "<\\/script")


def figure_data(figure: go.Figure) -> dict[str, Any]:
    """Return a figure as plain data, without plotly's template, which is larger than most figures."""
    data: dict[str, Any] = json.loads(figure.to_json() or "{}")
    data.get("layout", {}).pop("template", None)
    return data


def script_data(data: dict[str, Any]) -> str:
    """Return data as JSON that may stand in a script element."""
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("</", "<\\/")
