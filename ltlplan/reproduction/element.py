"""The values of the reproduction: an element of a publication, and what is found when it is computed anew."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from flight.figures import Figure

Publication = Literal["2019", "2022", "published"]
Kind = Literal["definition", "equation", "algorithm", "figure", "scenario", "section", "problem"]

HEADINGS: dict[Publication, str] = {
    "2019": "Hoops: Banks, Slovak, Coogan, Egerstedt, IROS 2019",
    "2022": "MTAC-E: Banks, Coogan, Egerstedt, 2022",
    "published": "Published problems",
}
"""Heading of each publication's section."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """One thing that is computed: a number, a text, or a check.

    Attributes:
        name: Unique within its element.
        ours: What was computed. A check is True where it holds.
        unit: SI unit of a number.
        paper: What the publication gives for it, where it gives anything.
        digits: Digits behind the point that are shown of a number.
    """

    name: str
    ours: float | bool | str
    unit: str = ""
    paper: str = ""
    digits: int = 2

    @property
    def shown(self) -> str:
        """Text of what was computed, with its unit."""
        if isinstance(self.ours, bool):
            return "holds" if self.ours else "does not hold"
        if isinstance(self.ours, str):
            return self.ours
        return f"{self.ours:.{self.digits}f} {self.unit}".strip()


@dataclass(frozen=True, slots=True)
class Chart:
    """A picture of what was computed.

    Attributes:
        label: What it shows, in a sentence.
        figure: Its traces and layout.
        scene: Whether it is a 3-D scene.
    """

    label: str
    figure: Figure
    scene: bool = False


@dataclass(frozen=True, slots=True)
class Findings:
    """Everything that an element's computation returns.

    Attributes:
        quantities: In the order in which they are shown.
        charts: Likewise.
    """

    quantities: tuple[Quantity, ...]
    charts: tuple[Chart, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Element:
    """One element of a publication.

    Attributes:
        id: Unique; begins with the publication.
        publication: Which one.
        kind: Of the element.
        title: Its number and subject.
        says: What the publication says, in a sentence.
        differs: What differs here and why, in a sentence; empty where nothing does.
        by: Dotted names of the functions and classes that implement it.
        compute: Computes it anew.
        also: Ids under which the other publication has the same element.
        shares: Id of the element whose computation it shares: both are computed by one process.
    """

    id: str
    publication: Publication
    kind: Kind
    title: str
    says: str
    differs: str
    by: tuple[str, ...]
    compute: Callable[[], Findings]
    also: tuple[str, ...] = ()
    shares: str = ""


def holds(name: str, truth: object, paper: str = "") -> Quantity:
    """Return a check.

    Args:
        name: What is to hold.
        truth: Whether it does.
        paper: What the publication says of it.
    """
    return Quantity(name, bool(truth), paper=paper)
