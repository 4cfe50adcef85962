"""Figures as plain data, in the words of plotly's JSON: traces and a layout, without plotly's objects, which take long to load and make.

Pages write them as they are. `Figure.plotly` makes plotly's own figure of one, which checks every word, and is what notebooks show.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    import plotly.graph_objects as go

Trace = dict[str, Any]  # of any type: plotly has hundreds of words
"""One thing drawn, under plotly's words."""


def trace(kind: str, **words: Any) -> Trace:  # of any type, likewise
    """Return a trace; words that are None are left out.

    Args:
        kind: Plotly's `type`, such as "scatter3d".
        words: Plotly's other words.
    """
    return {"type": kind, **{word: value for word, value in words.items() if value is not None}}


@dataclass(frozen=True, eq=False, slots=True)
class Figure:
    """Traces and how they are laid out.

    Attributes:
        data: The traces, in the order in which they are drawn.
        layout: Plotly's words for axes, legend, margins.
    """

    data: list[Trace] = field(default_factory=list[Trace])
    layout: dict[str, Any] = field(default_factory=dict[str, Any])  # of any type, likewise

    def add_trace(self, drawn: Trace) -> None:
        """Draw one thing more, on top."""
        self.data.append(drawn)

    def add_annotation(self, **words: Any) -> None:  # of any type, likewise
        """Write words into the picture."""
        self.layout.setdefault("annotations", []).append(words)

    def update_layout(self, layout: Mapping[str, Any] | None = None, **words: Any) -> Figure:  # of any type, likewise
        """Set parts of the layout, within what is there; return the figure itself."""
        _merge(self.layout, {**(layout or {}), **words})
        return self

    def plotly(self) -> go.Figure:
        """Return plotly's own figure.

        Raises:
            ValueError: A word is none of plotly's.
        """
        import plotly.graph_objects as go

        return go.Figure({"data": self.data, "layout": self.layout})

    def _repr_mimebundle_(self, *args: Any, **kinds: Any) -> Any:  # of any type: a notebook's own words
        return cast("Any", self.plotly())._repr_mimebundle_(*args, **kinds)


def _merge(own: dict[str, Any], more: Mapping[str, Any]) -> None:
    for word, value in more.items():
        if isinstance(value, Mapping) and isinstance(own.get(word), dict):
            _merge(own[word], cast("Mapping[str, Any]", value))
        else:
            own[word] = dict(cast("Mapping[str, Any]", value)) if isinstance(value, Mapping) else value
