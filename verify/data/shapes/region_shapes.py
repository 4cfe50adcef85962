"""Shapes of regions, by the key that mission files give them; other packages can bring more.

A shape says what may stand under its key and compiles that to a body (`verify.data.shapes.inequalities`). Nothing else in the project knows
shapes: pictures, bounding boxes, planning, refinement and the judge ask the body. It is written into the resolved mission, which is
therefore read, flown and judged without the package that brought the shape.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import TypeAdapter, ValidationError

from verify.data.errors import BadInput
from verify.data.registry import Registry
from verify.data.shapes.inequalities import GREATEST_RADIUS, LEAST_RADIUS, Inequality, Matrix, quadratic_form
from verify.data.value import FaultsWithin
from verify.data.vehicle import Positive

Body = Sequence[Sequence[Inequality]]
"""Parts, whose union the region is; of each its inequalities."""


@dataclass(frozen=True, slots=True)
class RegionShape:
    """A kind of region.

    Attributes:
        schema: What may stand under the shape's key: a pydantic model (a `Value`, best) or a type that pydantic knows.
        compiled: Makes the body of what stands there, checked by the schema, and of the region's yaw in rad. A `ValueError`
            (`BadInput` is none) says what is wrong beyond the schema.
        meaning: What stands under the key, with units, in a few words.
    """

    schema: Any  # a class, or a type such as tuple[float, float, float], for which Python has no common type
    compiled: Callable[[Any, float], Body]  # takes what the schema makes
    meaning: str


def ellipsoid_matrix(radii: tuple[float, float, float], yaw: float) -> Matrix:
    """Return Rz(yaw) diag(a^-2, b^-2, c^-2) Rz(yaw)', exactly symmetric, in m^-2.

    Raises:
        ValueError: A radius is absurd.
    """
    if not all(LEAST_RADIUS <= radius <= GREATEST_RADIUS for radius in radii):
        raise ValueError(f"radii {list(radii)} must lie between 1e-6 m and 1e6 m")
    a, b, c = (1.0 / (radius * radius) for radius in radii)
    cos, sin = math.cos(yaw), math.sin(yaw)
    xy = (a - b) * sin * cos
    return (
        (a * cos * cos + b * sin * sin, xy, 0.0),
        (xy, a * sin * sin + b * cos * cos, 0.0),
        (0.0, 0.0, c),
    )


ELLIPSOID = RegionShape(
    schema=tuple[Positive, Positive, Positive],
    compiled=lambda radii, yaw: quadratic_form(ellipsoid_matrix(radii, yaw)),
    meaning="m, along the region's own x, y, z",
)

REGION_SHAPES: Registry[RegionShape] = Registry(
    "a shape of regions", "ltlplan.region_shapes", {"radii": "verify.data.shapes.region_shapes:ELLIPSOID"}, RegionShape
)
"""By the key in mission files."""


def compiled(key: str, raw: object, yaw: float) -> list[list[dict[str, object]]]:
    """Return the body of what stands under a shape's key, as plain data for the schema to look at.

    Args:
        key: The shape's.
        raw: What stands there, as it was read.
        yaw: rad, turns the region about z.

    Raises:
        FaultsWithin: What stands there is not allowed, or the shape cannot be loaded or makes no body of it.
    """
    try:
        shape = REGION_SHAPES.find(key)
        return [
            [dict(_inequality(one)) for one in part]
            for part in shape.compiled(TypeAdapter(shape.schema).validate_python(raw), yaw)
        ]
    except ValidationError as error:
        raise FaultsWithin(key, error) from None
    except (ValueError, BadInput) as error:
        raise FaultsWithin(key, str(error)) from None
    except Exception as error:  # a shape of somebody else's may fail in any way
        raise FaultsWithin(key, f"this shape makes no body of it: {type(error).__name__}: {error}") from error


def _inequality(one: object) -> Inequality:
    if not isinstance(one, Inequality):
        raise ValueError(f"this shape makes no body of it: it gives {type(one).__name__} for an Inequality")
    return one
