"""A body somewhere in the world, of any shape: what regions, hoops and obstacles have in common.

A body is written with one shape: `radii`, or a key that `verify.data.shapes.region_shapes` knows. The shape is compiled once, here; what
it compiles to is kept in `matrix` where it is an ellipsoid and in `parts` otherwise, and is the body from then on.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, TypeAdapter, ValidationError, model_validator

from verify.data.errors import BadInput
from verify.data.shapes.inequalities import (
    Inequality,
    Matrix,
    Parts,
    Point,
    centred_form,
    grown,
    half_lengths,
    moved,
    quadratic_form,
    semi_axes,
    turned,
)
from verify.data.shapes.measures import Measures, measures
from verify.data.shapes.region_shapes import REGION_SHAPES, compiled, ellipsoid_matrix
from verify.data.value import FaultsWithin, Value
from verify.data.vehicle import Number, Positive


def _raised(value: Any) -> Any:  # of any type: what a mission file may hold, looked at before the schema
    """Raise what was found wrong with a body's shape, beside the faults of its other keys."""
    if isinstance(value, FaultsWithin):
        raise value
    return value


@lru_cache(maxsize=4096)
def _ellipsoid(matrix: Matrix) -> tuple[tuple[Inequality, ...], ...]:
    return quadratic_form(matrix)


class PlacedBody(Value):
    """A closed body around its centre: an ellipsoid, (r - center)' matrix (r - center) <= 1, or parts of inequalities."""

    called: ClassVar[str] = "a body"
    """What messages call it."""

    has_own_place: ClassVar[bool] = False
    """Whether `center` and `yaw_deg` say more than where the body is, and so stand beside a shape that says itself where it is."""

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
        """The body as parts of inequalities around its centre, whatever its shape."""
        return _ellipsoid(self.quadratic) if self.parts is None else self.parts

    @property
    def quadratic(self) -> Matrix:
        """M of an ellipsoid (r - center)' M (r - center) <= 1, in m^-2.

        Raises:
            BadInput: The body is of another shape.
        """
        if self.matrix is not None:
            return self.matrix
        if self.parts is None:
            raise BadInput(f"This body has no shape; make it by `{type(self).__name__}(center=..., radii=...)`.")
        return centred_form(self.parts)

    @property
    def shape(self) -> NDArray[np.float64]:
        """The matrix of the quadratic form as an array, in m^-2. Shape (3, 3)."""
        return np.array(self.quadratic, dtype=np.float64)

    @property
    def is_ellipsoid(self) -> bool:
        """Return whether the body is one quadratic form around its centre."""
        if self.parts is None:
            return True
        if len(self.parts) != 1 or len(self.parts[0]) != 1:
            return False
        (only,) = self.parts[0]
        return only.bound == 1.0 and not any(only.linear) and any(map(any, only.quadratic))

    @property
    def measures(self) -> Measures:
        """Size of the body and depth of points in it, for any shape, in floats."""
        return measures(self.body)

    @property
    def semi_axes(self) -> tuple[float, float, float]:
        """Half axes of an ellipsoid in m: its radii where they are given."""
        return semi_axes(self.quadratic) if self.radii is None else self.radii

    @property
    def inner_radius(self) -> float:
        """Radius of a ball around the centre that lies in the body, in m; within d of a point sqrt(level) changes by d over it."""
        return min(self.semi_axes) if self.is_ellipsoid else self.measures.inner_radius

    @property
    def outer_radius(self) -> float:
        """Radius of a ball around the centre that holds the body, in m."""
        return max(self.semi_axes) if self.is_ellipsoid else self.measures.outer_radius

    @property
    def volume(self) -> float:
        """Size beside a ball of radius 1 m: the product of an ellipsoid's half axes; approximate for other shapes."""
        return math.prod(self.semi_axes) if self.is_ellipsoid else self.measures.volume

    @property
    def half_lengths(self) -> tuple[float, float, float]:
        """Half the edges of the least box along the world's axes that holds the body, in m."""
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
        """Return a new body with some fields replaced; a matrix and parts are turned with it.

        Raises:
            BadInput: There is no such field, or the new body is not allowed.
        """
        yaw = fields.get("yaw_deg")
        if self.parts is not None and "parts" not in fields and isinstance(yaw, int | float) and yaw != self.yaw_deg:
            fields["parts"] = turned(self.parts, math.radians(yaw) - self.yaw)
        return super().changed(**fields)

    def grown(self, margin: float) -> Self:
        """Return the body larger by a margin in m, as a certificate's *no* is, and not validated: what it was written as is not changed."""
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
                "radii", f"missing: {cls.called} needs its shape, such as `radii: [0.2, 0.2, 0.2]`. Shapes: {names}"
            )
        elif len(shapes) > 1:
            listed = " and ".join(f"`{key}`" for key in shapes)
            given = {key: value for key, value in given.items() if key not in shapes}
            given["radii"] = FaultsWithin(
                shapes[1], f"{cls.called} has one shape, but {listed} are given; leave out all but one"
            )
        elif shapes[0] in strange:
            yaw = given.get("yaw_deg", 0.0)
            if not isinstance(yaw, int | float) or not math.isfinite(yaw):
                yaw = 0.0  # it has a fault of its own
            given |= _compiled(shapes[0], given.pop(shapes[0]), math.radians(yaw), given, anywhere=cls.has_own_place)
        return given

    @model_validator(mode="after")
    def _with_matrix(self) -> Self:
        if self.parts is not None:
            if self.matrix is not None:
                raise ValueError(f"matrix belongs to `radii`; {self.called} of another shape has `parts`")
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


def _compiled(key: str, raw: object, yaw: float, given: dict[str, Any], *, anywhere: bool) -> dict[str, Any]:  # a file's
    """Return the fields that a shape's key stands for; of one that says where it is, the centre as well, which may be given `anywhere`."""
    try:
        places_itself = REGION_SHAPES.find(key).places_itself
        found = compiled(key, raw, 0.0 if places_itself else yaw)
    except FaultsWithin as faults:
        return {"radii": faults, **({} if "center" in given else {"center": (0.0, 0.0, 0.0)})}
    except BadInput as error:
        return {"radii": FaultsWithin(key, str(error))}
    if not places_itself:
        return {"parts": found.parts}
    own = found.center
    if anywhere and own is not None:
        try:
            center = TypeAdapter(Point).validate_python(given.get("center", own))
        except ValidationError:
            return {"parts": found.parts}  # the centre has a fault of its own
        return {
            "parts": [[moved(Inequality.model_validate(one), center, own) for one in part] for part in found.parts],
            "center": center,
        }
    for other in ("center", "yaw_deg"):
        if other in given:
            return {"radii": FaultsWithin(other, f"`{key}` says itself where it is; leave `{other}` out")}
    return {"parts": found.parts, "center": found.center}
