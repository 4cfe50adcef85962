"""Shapes of regions, by the key that mission files give them; other packages can bring more.

A shape says what may stand under its key and compiles that to a body (`verify.data.shapes.inequalities`). Nothing else in the project knows
shapes: pictures, bounding boxes, planning, refinement and the judge ask the body. It is written into the resolved mission, which is
therefore read, flown and judged without the package that brought the shape.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from pydantic import TypeAdapter, ValidationError

from verify.data.errors import BadInput
from verify.data.names.registry import Registry
from verify.data.shapes.inequalities import GREATEST_RADIUS, LEAST_RADIUS, Inequality, Matrix, Point, quadratic_form
from verify.data.value import FaultsWithin
from verify.data.vehicle import Positive

Body = Sequence[Sequence[Inequality]]
"""Parts, whose union the region is; of each its inequalities."""


@dataclass(frozen=True, slots=True)
class Placed:
    """A body and where it is.

    Attributes:
        center: The region's centre, m, world frame.
        parts: The body around it.
    """

    center: Point
    parts: Body


@dataclass(frozen=True, slots=True)
class RegionShape:
    """A kind of region.

    Attributes:
        schema: What may stand under the shape's key: a pydantic model (a `Value`, best) or a type that pydantic knows.
        compiled: Makes the body of what stands there, checked by the schema, and of the region's yaw in rad. A `ValueError`
            (`BadInput` is none) says what is wrong beyond the schema.
        meaning: What stands under the key, with units, in a few words.
        places_itself: Whether the shape says where it is: then it takes no `center` and no `yaw_deg`, and `compiled`
            returns a `Placed`.
        adapter: The schema, made ready once.
    """

    schema: Any  # a class, or a type such as tuple[float, float, float], for which Python has no common type
    compiled: Callable[[Any, float], Body | Placed]  # takes what the schema makes
    meaning: str
    places_itself: bool = False
    adapter: TypeAdapter[Any] = field(init=False, repr=False, compare=False)  # of any type: as the schema

    def __post_init__(self) -> None:
        object.__setattr__(self, "adapter", TypeAdapter(self.schema))


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
    "a shape of regions",
    "ltlplan.region_shapes",
    {
        "radii": "verify.data.shapes.region_shapes:ELLIPSOID",
        "size": "verify.data.shapes.solids:BOX",
        "cylinder": "verify.data.shapes.solids:CYLINDER",
        "prism": "verify.data.shapes.solids:PRISM",
        "union": "verify.data.shapes.unions:UNION",
    },
    RegionShape,
)
"""By the key in mission files."""


def exact_turn(yaw: float) -> tuple[float, float]:
    """Return cosine and sine of a yaw in rad, those of quarter turns without rounding."""
    quarters = yaw / (math.pi / 2)
    if quarters == round(quarters):
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarters) % 4]
    return math.cos(yaw), math.sin(yaw)


@dataclass(frozen=True, slots=True)
class Compiled:
    """A shape's plain data under its key, for the schema.

    Attributes:
        parts: The body.
        center: Where it is, m, of a shape that says so itself; None of others.
    """

    parts: list[list[dict[str, object]]]
    center: Point | None


def compiled(key: str, raw: object, yaw: float) -> Compiled:
    """Return the body of what stands under a shape's key.

    Args:
        key: The shape's.
        raw: What stands there, as it was read.
        yaw: rad, turns the region about z.

    Raises:
        FaultsWithin: What stands there is not allowed, or the shape cannot be loaded or makes no body of it.
    """
    try:
        found = compiled_parts(REGION_SHAPES.find(key), raw, yaw)
        body = found.parts if isinstance(found, Placed) else found
        plain = [[dict(_inequality(one)) for one in part] for part in body]
        return Compiled(plain, found.center if isinstance(found, Placed) else None)
    except ValidationError as error:
        raise FaultsWithin(key, error) from None
    except (ValueError, BadInput) as error:
        raise FaultsWithin(key, str(error)) from None
    except Exception as error:  # a shape of somebody else's may fail in any way
        raise FaultsWithin(key, f"this shape makes no body of it: {type(error).__name__}: {error}") from error


def compiled_parts(shape: RegionShape, raw: object, yaw: float) -> Body | Placed:
    """Return the body of what stands under a shape's key, as the shape makes it.

    Args:
        shape: The shape.
        raw: What stands there, as it was read.
        yaw: rad.

    Raises:
        ValueError: The schema, as pydantic's `ValidationError`, or the shape refuses what stands there.
    """
    found = shape.compiled(shape.adapter.validate_python(raw), yaw)
    if isinstance(found, Placed) != shape.places_itself:
        raise ValueError("this shape makes no body of it: `places_itself` and what it returns contradict each other")
    return found


def _inequality(one: object) -> Inequality:
    if not isinstance(one, Inequality):
        raise ValueError(f"this shape makes no body of it: it gives {type(one).__name__} for an Inequality")
    return one
