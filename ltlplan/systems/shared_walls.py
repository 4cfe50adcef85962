"""Walls that two rooms share: where a robot goes straight from one room into the other and is in neither for sure on the way.

Words show both rooms' names there. Flown paths lie in a tube: where no ball of the margin's radius fits into what the rooms have in
common, a robot may be in both, in one or in none while it crosses, and come and go.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from verify.data import Letter, Mission
from verify.data.shapes.convex_parts import faces_around
from verify.data.shapes.region import Region

_LEAST = 1e-6
"""m; the least margin with which a room is told from another."""
_ROUNDING = 1e-9

Crossing = tuple[int, str, str]
"""Index of the letter that shows both names, the room that is left, and the one that is entered."""


class Walls:
    """The walls that rooms of a mission share.

    Args:
        mission: Whose regions and margin.
    """

    def __init__(self, mission: Mission) -> None:
        self._regions = mission.all_regions
        self._margin = max(mission.margin, _LEAST)
        self._sure: dict[frozenset[str], bool] = {}

    def on(self, letters: Sequence[Letter], following: Sequence[Letter] = ()) -> list[Crossing]:
        """Return where a word leads through such a wall.

        Args:
            letters: The word.
            following: What comes after its last letter, where anything does.
        """
        found: list[Crossing] = []
        for index, (before, both, after) in enumerate(
            zip(letters, letters[1:], (*letters[2:], *following), strict=False), start=1
        ):
            left, entered = (both - after) & self._regions.keys(), (both - before) & self._regions.keys()
            if len(left) == len(entered) == 1 and left <= before and entered <= after:
                (one,), (other,) = left, entered
                if not self._are_passed_for_sure(one, other):
                    found.append((index, one, other))
        return found

    def _are_passed_for_sure(self, one: str, other: str) -> bool:
        pair = frozenset((one, other))
        if pair not in self._sure:
            self._sure[pair] = hold_a_ball(self._regions[one], self._regions[other], self._margin)
        return self._sure[pair]


def wall_sentence(one: str, other: str, margin: float) -> str:
    """Return what may be shown at a wall, and what would make it sure, in a sentence.

    Args:
        one: A room.
        other: The room beyond the wall.
        margin: m.
    """
    return (
        f"'{one}' and '{other}' share a wall: a robot that goes straight from one into the other may, within the margin {margin:g} m of "
        f"it, be in both rooms, in one of them or in none. Give both rooms one name, a region that is their union, and ask for that "
        f"({one}_or_{other}: {{union: [...]}}, and `{one}_or_{other}` instead of `({one} | {other})`); or let them overlap by more than twice "
        "the margin."
    )


def hold_a_ball(one: Region, other: Region, radius: float) -> bool:
    """Return whether a ball lies in both of two regions at once.

    Args:
        one: A region.
        other: Another one.
        radius: Of the ball, m.
    """
    if one.is_ellipsoid or other.is_ellipsoid:
        return True  # ways past their borders are offered only where the order of these is clear
    from scipy.optimize import linprog  # here: it takes long to load, and few plans need it

    bodies = [[(*faces_around(body), np.array(region.center)) for body in region.measures.covers] for region in (one, other)]
    for faces, distances, centre in bodies[0]:
        for others, far, middle in bodies[1]:
            normals = np.concatenate([faces, others])
            bounds = np.concatenate([distances + faces @ centre, far + others @ middle])
            sides = np.column_stack([normals, np.ones(len(normals))])
            best = linprog((0.0, 0.0, 0.0, -1.0), sides, bounds, bounds=[(None, None)] * 4)
            if best.status != 0 or -best.fun > radius * (1 + _ROUNDING):
                return True
    return False
