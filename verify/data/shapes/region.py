"""Regions of a mission: a body somewhere in the world, with a ring around it or without.

A region is written with one shape: `radii`, or a key that `verify.data.shapes.region_shapes` knows. The shape is compiled once, here; what
it compiles to is kept in `matrix` where it is an ellipsoid and in `parts` otherwise, and is the region from then on.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, model_validator

from verify.data.errors import BadInput
from verify.data.shapes.inequalities import (
    Inequality,
    Matrix,
    Parts,
    Point,
    centred_form,
    grown,
    half_lengths,
    quadratic_form,
    semi_axes,
    turned,
)
from verify.data.shapes.measures import Measures, measures
from verify.data.shapes.region_shapes import REGION_SHAPES, compiled, ellipsoid_matrix
from verify.data.value import FaultsWithin, Value
from verify.data.vehicle import Number, Positive


def _raised(value: Any) -> Any:  # of any type: what a mission file may hold, looked at before the schema
    """Raise what was found wrong with a region's shape, beside the faults of its other keys."""
    if isinstance(value, FaultsWithin):
        raise value
    return value


@lru_cache(maxsize=4096)
def _ellipsoid(matrix: Matrix) -> tuple[tuple[Inequality, ...], ...]:
    return quadratic_form(matrix)


class Region(Value):
    """A closed body around its centre: an ellipsoid, (r - center)' matrix (r - center) <= 1, or parts of inequalities."""

    computed_from: ClassVar[dict[str, tuple[str, ...]]] = {"matrix": ("radii", "yaw_deg")}

    center: Point = Field(description="m, world frame")
    radii: Annotated[tuple[Positive, Positive, Positive] | None, BeforeValidator(_raised)] = Field(
        default=None, description="m, along the region's own x, y, z; required unless another shape is given"
    )
    yaw_deg: Number = Field(default=0.0, description="deg, turns the region about z")
    matrix: Matrix | None = Field(
        default=None, description="m^-2; written into resolved missions and, where given, exactly the region"
    )
    parts: Parts | None = Field(
        default=None,
        description="inequalities of a shape other than `radii`, turned already; written into resolved missions, exactly the region",
    )

    @property
    def yaw(self) -> float:
        """Yaw in rad."""
        return math.radians(self.yaw_deg)

    @property
    def body(self) -> tuple[tuple[Inequality, ...], ...]:
        """The region as parts of inequalities around its centre, whatever its shape."""
        return _ellipsoid(self.quadratic) if self.parts is None else self.parts

    @property
    def quadratic(self) -> Matrix:
        """M of an ellipsoid (r - center)' M (r - center) <= 1, in m^-2.

        Raises:
            BadInput: The region is of another shape.
        """
        if self.matrix is not None:
            return self.matrix
        if self.parts is None:
            raise BadInput("This region has no shape; make it by `Region(center=..., radii=...)`.")
        return centred_form(self.parts)

    @property
    def shape(self) -> NDArray[np.float64]:
        """The matrix of the quadratic form as an array, in m^-2. Shape (3, 3)."""
        return np.array(self.quadratic, dtype=np.float64)

    @property
    def is_ellipsoid(self) -> bool:
        """Tell whether the region is one quadratic form around its centre."""
        if self.parts is None:
            return True
        if len(self.parts) != 1 or len(self.parts[0]) != 1:
            return False
        (only,) = self.parts[0]
        return only.bound == 1.0 and not any(only.linear) and any(map(any, only.quadratic))

    @property
    def measures(self) -> Measures:
        """How large the body is and how deep points lie in it, of any shape, in floats."""
        return measures(self.body)

    @property
    def semi_axes(self) -> tuple[float, float, float]:
        """Half axes of an ellipsoid in m: its radii where they are given."""
        return semi_axes(self.quadratic) if self.radii is None else self.radii

    @property
    def inner_radius(self) -> float:
        """Radius of a ball around the centre that lies in the region, in m; within d of a point sqrt(level) changes by d over it."""
        return min(self.semi_axes) if self.is_ellipsoid else self.measures.inner_radius

    @property
    def outer_radius(self) -> float:
        """Radius of a ball around the centre that holds the region, in m."""
        return max(self.semi_axes) if self.is_ellipsoid else self.measures.outer_radius

    @property
    def volume(self) -> float:
        """How large it is beside a ball of radius 1 m: the product of an ellipsoid's half axes; of other shapes roughly."""
        return math.prod(self.semi_axes) if self.is_ellipsoid else self.measures.volume

    @property
    def half_lengths(self) -> tuple[float, float, float]:
        """Half the edges of the least box along the world's axes that holds the region, in m."""
        if not self.is_ellipsoid:
            return self.measures.half_lengths
        if self.radii is None:
            return half_lengths(self.quadratic)
        (a, b, c), cos, sin = self.radii, math.cos(self.yaw), math.sin(self.yaw)
        return math.hypot(a * cos, b * sin), math.hypot(a * sin, b * cos), c

    def level(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what is at most 1 inside, in floats, for planning and pictures. Shape (..., 3) to (...).

        Of an ellipsoid it is (r - center)' matrix (r - center); of other shapes a square whose root falls from 1 on the surface to 0
        where a point is as deep as the centre, or deeper.
        """
        offset = points - np.array(self.center)
        if not self.is_ellipsoid:
            return self.measures.levels(offset)
        return np.einsum("...i,ij,...j->...", offset, self.shape, offset)

    def changed(self, **fields: Any) -> Self:  # of any type: pydantic looks at them
        """Return a new region with some fields replaced; a matrix and parts are turned with it.

        Raises:
            BadInput: There is no such field, or the new region is not allowed.
        """
        yaw = fields.get("yaw_deg")
        if self.parts is not None and "parts" not in fields and isinstance(yaw, int | float) and yaw != self.yaw_deg:
            fields["parts"] = turned(self.parts, math.radians(yaw) - self.yaw)
        return super().changed(**fields)

    def grown(self, margin: float) -> Self:
        """Return the region larger by a margin in m, as a certificate's *no* is, and not validated: what it was written as is not changed."""
        if not self.is_ellipsoid:
            return self.model_copy(update={"parts": grown(self.body, margin)})
        form = tuple(map(tuple, (self.shape / (1 + margin / self.inner_radius) ** 2).tolist()))
        if self.parts is None:
            return self.model_copy(update={"matrix": form})
        return self.model_copy(update={"parts": quadratic_form(form)})

    @model_validator(mode="before")
    @classmethod
    def _with_shape(cls, data: Any) -> Any:  # of any type: what a mission file may hold
        """Put the compiled form in the place of a shape's key."""
        if not isinstance(data, dict):
            return data
        own = data.get("radii") is not None and "matrix" not in data and "parts" not in data
        if own and data.keys() <= cls.__pydantic_fields__.keys():
            return data  # as nearly all are written
        given = {key: value for key, value in data.items() if value is not None or key not in ("radii", "matrix", "parts")}
        strange = [key for key in given if isinstance(key, str) and key not in cls.model_fields]
        built_in = REGION_SHAPES.built_in  # looked at first: other packages' names are searched for on disk
        known = tuple(built_in) if built_in.keys() >= set(strange) else REGION_SHAPES.names()
        shapes = [*(key for key in ("radii", "parts") if key in given), *(key for key in strange if key in known)]
        if not shapes:
            names = ", ".join(REGION_SHAPES.names())
            given["radii"] = FaultsWithin(
                "radii", f"missing: a region needs its shape, such as `radii: [0.2, 0.2, 0.2]`. Shapes: {names}"
            )
        elif len(shapes) > 1:
            listed = " and ".join(f"`{key}`" for key in shapes)
            given = {key: value for key, value in given.items() if key not in shapes}
            given["radii"] = FaultsWithin(shapes[1], f"a region has one shape, but {listed} are given; leave out all but one")
        elif shapes[0] in strange:
            yaw = given.get("yaw_deg", 0.0)
            if not isinstance(yaw, int | float) or not math.isfinite(yaw):
                yaw = 0.0  # it has a fault of its own
            given |= _compiled(shapes[0], given.pop(shapes[0]), math.radians(yaw), given)
        return given

    @model_validator(mode="after")
    def _with_matrix(self) -> Self:
        if self.parts is not None:
            if self.matrix is not None:
                raise ValueError("matrix belongs to `radii`; a region of another shape has `parts`")
            try:
                if self.is_ellipsoid:
                    centred_form(self.parts)
                else:
                    measures(self.parts)
            except BadInput as error:
                raise ValueError(str(error)) from None
            return self
        assert self.radii is not None  # or the validator before this one has refused it
        wanted = ellipsoid_matrix(self.radii, self.yaw)
        if self.matrix is None:
            object.__setattr__(self, "matrix", wanted)
        elif not np.allclose(self.matrix, wanted, rtol=1e-9, atol=1e-12):
            raise ValueError("matrix does not belong to these radii and yaw_deg; leave it out to have it computed")
        elif self.matrix != tuple(zip(*self.matrix, strict=True)):
            raise ValueError("matrix must be symmetric")
        return self


def ellipsoid_matrices(regions: Collection[Region]) -> NDArray[np.float64]:
    """Return the matrix of each ellipsoid among some regions, in m^-2, and zeros for other shapes. Shape (regions, 3, 3)."""
    zero = np.zeros((3, 3))
    return np.array([region.shape if region.is_ellipsoid else zero for region in regions]).reshape(-1, 3, 3)


def _compiled(key: str, raw: object, yaw: float, given: dict[str, Any]) -> dict[str, Any]:  # of any type: a file's
    """Return the fields that a shape's key stands for; of one that says where it is, the centre as well."""
    try:
        places_itself = REGION_SHAPES.find(key).places_itself
        found = compiled(key, raw, 0.0 if places_itself else yaw)
    except FaultsWithin as faults:
        return {"radii": faults, **({} if "center" in given else {"center": (0.0, 0.0, 0.0)})}
    except BadInput as error:
        return {"radii": FaultsWithin(key, str(error))}
    if not places_itself:
        return {"parts": found.parts}
    for other in ("center", "yaw_deg"):
        if other in given:
            return {"radii": FaultsWithin(other, f"`{key}` says itself where it is; leave `{other}` out")}
    return {"parts": found.parts, "center": found.center}


class Hoop(Region):
    """A region with a ring that is flown through.

    The normal is Rz(yaw) Ry(pitch) e_x: with pitch 0 it is horizontal, positive pitch turns it downwards.
    """

    computed_from: ClassVar[dict[str, tuple[str, ...]]] = {**Region.computed_from, "normal": ("yaw_deg", "pitch_deg")}

    pitch_deg: Annotated[Number, Field(gt=-90, lt=90)] = Field(
        0.0, description="deg, turns the ring's normal (not the ellipsoid)"
    )
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
        if not self.is_ellipsoid:
            raise ValueError("the region around a ring must be an ellipsoid in this version; give it `radii`")
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
