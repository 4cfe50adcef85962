"""Notes on missions that are valid and yet may not be meant."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from refine.obstacles.gaps import widest_gap
from verify.data import Mission
from verify.data.shapes.inequalities import Parts

_TOUCHING = 1e-9
"""m; parts that are not farther from each other than this touch."""


def notes_of(mission: Mission) -> tuple[str, ...]:
    """Return sentences about what a mission's writer may not have meant; none of it is a fault."""
    return tuple(_in_pieces(mission))


def _in_pieces(mission: Mission) -> Iterator[str]:
    """Unions whose parts do not all touch."""
    for table, bodies in (("hoops", mission.hoops), ("regions", mission.regions), ("obstacles", mission.obstacles)):
        for name, body in bodies.items():
            pieces = _pieces(body.body)
            if len(pieces) == 1:
                continue
            listed = "; ".join(
                f"part{'s' if len(piece) > 1 else ''} {', '.join(str(k + 1) for k in piece)}" for piece in pieces
            )
            means = "" if table == "obstacles" else ", and a robot leaves it on the way from one to another"
            yield f"{table}.{name} is {len(pieces)} bodies that do not touch ({listed}){means}."


def _pieces(parts: Parts) -> list[list[int]]:
    """Return the parts that hang together, each group in order."""
    groups: list[list[int]] = []
    for k in range(len(parts)):
        met = [group for group in groups if any(widest_gap((parts[k],), (parts[i],), np.zeros(3)) <= _TOUCHING for i in group)]
        groups = [group for group in groups if group not in met] + [[i for group in met for i in group] + [k]]
    return sorted(groups)
