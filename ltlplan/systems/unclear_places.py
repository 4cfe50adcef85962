"""Messages about points that lie too near the border of a region: whose border, how far, what is needed, and the remedy."""

from __future__ import annotations

from collections.abc import Iterable

from ltlplan.systems.region_labels import Layout
from refine.corridor.legs import CLEARANCE
from verify.data.shapes.inequalities import Point

_ON = 1e-6
"""m; what is nearer than this to a border lies on it."""


def unclear_middle(layout: Layout, name: str) -> str:
    """Return why the middle of a region is not clear, and what would make it so.

    Args:
        layout: How the regions lie.
        name: The region's, whose middle is not clear.
    """
    near = layout.near_borders(layout.regions[name].center)
    own = near.get(name)
    others = {other: far for other, far in near.items() if other != name}
    borders = [] if own is None else [f"{own:.4g} m inside its own border"]
    borders += _borders(others)
    remedies: list[str] = []
    if own is not None:
        remedies.append(
            f"make {_field(layout, name)} wider than {2 * (layout.slack + CLEARANCE):.4g} m around its middle ({2 * own:.4g} m now)"
        )
    if others:
        away = " and ".join(f"'{other}'" for other in others)
        remedies.append(f"move {_field(layout, name)} farther than {layout.slack:g} m from the border of {away}")
    remedy = ", and ".join(remedies) + _smaller_margin(near.values())
    return (
        f"The middle of '{name}' lies {' and '.join(borders)}, and more than the margin, {layout.slack:g} m, is needed to visit it for "
        f"sure: {remedy}."
    )


def unclear_point(layout: Layout, what: str, point: Point) -> str:
    """Return why a point at which a robot starts or ends is not clear, and what would make it so.

    Args:
        layout: How the regions lie.
        what: Which robot does what there, such as "q0 starts".
        point: m; it is not clear.
    """
    near = layout.near_borders(point)
    return (
        f"{what} {' and '.join(_borders(near))}, and more than the margin, {layout.slack:g} m, is needed to tell whether it is inside: "
        f"move the point{_smaller_margin(near.values())}."
    )


def _borders(near: dict[str, float]) -> list[str]:
    """Return where a point lies beside each border; along a region's longer axes it may be farther away than is sure."""
    return [f"{'on' if far < _ON else f'at least {far:.4g} m from'} the border of '{name}'" for name, far in near.items()]


def _field(layout: Layout, name: str) -> str:
    return f"`{'hoops' if name in layout.mission.hoops else 'regions'}.{name}`"


def _smaller_margin(near: Iterable[float]) -> str:
    """Return the other remedy, where there is one: a margin that leaves the refinement its clearance too."""
    least = min(near) - CLEARANCE
    return f", or `margin` smaller than {least:.4g} m" if least >= CLEARANCE else ""
