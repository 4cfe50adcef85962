"""Regions of a mission: bodies that formulas name, with a ring around them or without."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from verify.data.shapes.inequalities import Point
from verify.data.shapes.placed_body import PlacedBody
from verify.data.vehicle import Number, Positive


class Region(PlacedBody):
    """A closed body that formulas name."""

    called: ClassVar[str] = "a region"

    only: Annotated[tuple[str, ...], Field(min_length=1)] | None = Field(
        default=None, description="names of `robots` tables: who may enter; all where it is left out"
    )


class Hoop(Region):
    """A region with a ring that is flown through.

    The normal is Rz(yaw) Ry(pitch) e_x: with pitch 0 it is horizontal, positive pitch turns it downwards. Ring and region have one
    centre; a shape that says itself where it is stays there, and `center` and `yaw_deg` are the ring's.
    """

    has_own_place: ClassVar[bool] = True

    computed_from: ClassVar[dict[str, tuple[str, ...]]] = {**Region.computed_from, "normal": ("yaw_deg", "pitch_deg")}

    pitch_deg: Annotated[Number, Field(gt=-90, lt=90)] = Field(0.0, description="deg, turns the ring's normal (not the region)")
    opening: Positive = Field(description="m, inner radius of the ring")
    rim: Positive = Field(
        description="m, thickness of the ring: it fills radii opening to opening + rim, and rim along the normal"
    )
    reach: Positive | None = Field(default=None, description="m, front and rear control points lie this far from the centre")
    clearance: Positive | None = Field(default=None, description="m, avoid points lie this far from the centre, to both sides")
    normal: Point | None = Field(default=None, description="unit vector from rear to front; written into resolved missions")

    @property
    def pitch(self) -> float:
        """Pitch in rad."""
        return math.radians(self.pitch_deg)

    @model_validator(mode="after")
    def _with_normal(self) -> Hoop:
        cos_pitch = math.cos(self.pitch)
        wanted = (cos_pitch * math.cos(self.yaw), cos_pitch * math.sin(self.yaw), -math.sin(self.pitch))
        if self.normal is None:
            object.__setattr__(self, "normal", wanted)
        elif not np.allclose(self.normal, wanted, rtol=0, atol=1e-9):
            raise ValueError("normal does not belong to this yaw_deg and pitch_deg; leave it out to have it computed")
        if self.reach is None:
            object.__setattr__(self, "reach", self.outer_radius + 0.15)
        if self.clearance is None:
            object.__setattr__(self, "clearance", max(self.opening + self.rim, self.outer_radius) + 0.2)
        return self
