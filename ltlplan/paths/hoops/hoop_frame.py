"""The five control points of a hoop (2019 paper, Fig. 2) and the hoop's own frame.

The frame's x axis is the hoop's normal, from rear to front; y is horizontal, to the left of the normal; z completes it.
Rear and front lie `reach` from the centre along the normal, the two avoid points `clearance` from it along y.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from verify.data.arrays import Floats
from verify.data.language.sequence import Direction
from verify.data.shapes.region import Hoop


@dataclass(frozen=True, eq=False, slots=True)
class ControlPoints:
    """Points at which a hoop is approached, flown through and passed by.

    Attributes:
        centre: m. Shape (3,).
        front: m, ahead of the centre along the normal. Shape (3,).
        rear: m, behind it. Shape (3,).
        avoid: m, to the left and to the right. Shape (2, 3).
        frame: Columns are the hoop's own x (normal), y (left) and z. Shape (3, 3).
    """

    centre: Floats
    front: Floats
    rear: Floats
    avoid: Floats
    frame: Floats

    def ends(self, direction: Direction) -> tuple[Floats, Floats]:
        """Return where a passage begins and where it ends: rear and front for F, front and rear for R."""
        return (self.rear, self.front) if direction == "F" else (self.front, self.rear)


def control_points(hoop: Hoop) -> ControlPoints:
    """Return the control points of a hoop, at its own `reach` and `clearance`."""
    axes = frame(hoop)
    centre = np.array(hoop.center)
    ahead = float(hoop.reach or 0.0) * axes[:, 0]
    aside = float(hoop.clearance or 0.0) * axes[:, 1]
    return ControlPoints(centre, centre + ahead, centre - ahead, np.stack([centre + aside, centre - aside]), axes)


def frame(hoop: Hoop) -> Floats:
    """Return the hoop's own axes as columns: normal, left, and the third. Shape (3, 3)."""
    normal = np.array(hoop.normal)
    left = np.cross([0.0, 0.0, 1.0], normal)
    left /= np.linalg.norm(left)
    return np.stack([normal, left, np.cross(normal, left)], axis=1)
