"""Placement of a mission in the laboratory: turned about z and moved, as motion capture or lighthouses see it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from verify.data.arrays import Floats
from verify.data.shapes.inequalities import Point
from verify.data.value import Value
from verify.data.vehicle import Number


class Frame(Value):
    """Placement of the mission's frame in the laboratory's: a place there is the mission's, turned about z, then moved."""

    rotation_deg: Number = Field(
        default=0.0, description="deg, by which the mission's axes are turned about z, against the clock"
    )
    offset: Point = Field(default=(0.0, 0.0, 0.0), description="m, where the mission's origin lies in the laboratory")

    @property
    def matrix(self) -> Floats:
        """Rotation from the mission to the laboratory; exact for quarter turns. Shape (3, 3)."""
        quarters, rest = divmod(self.rotation_deg, 90.0)
        cosine, sine = math.cos(math.radians(rest)), math.sin(math.radians(rest))
        for _ in range(int(quarters) % 4):
            cosine, sine = -sine, cosine
        return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]) + 0.0

    def to_laboratory(self, places: ArrayLike) -> Floats:
        """Return places of the mission as the laboratory sees them, m. Shape (..., 3).

        Args:
            places: m, in the mission's frame. Shape (..., 3).
        """
        return np.asarray(places, dtype=np.float64) @ self.matrix.T + np.array(self.offset)

    def to_mission(self, places: ArrayLike) -> Floats:
        """Return places of the laboratory in the mission's frame, m. Shape (..., 3).

        Args:
            places: m, as the laboratory sees them. Shape (..., 3).
        """
        return (np.asarray(places, dtype=np.float64) - np.array(self.offset)) @ self.matrix

    @property
    def sentence(self) -> str:
        """The placement as a sentence."""
        x, y, z = self.offset
        return f"the mission turned by {self.rotation_deg:g} degrees about z and moved by ({x:g}, {y:g}, {z:g}) m"
