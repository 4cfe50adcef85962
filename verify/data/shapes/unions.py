"""Unions: several shapes, each where it is, as one region."""

from __future__ import annotations

import itertools
import math
from typing import Annotated, Any

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from verify.data.errors import BadInput, did_you_mean
from verify.data.shapes.convex_parts import convex_body
from verify.data.shapes.inequalities import Inequality, Point, moved
from verify.data.shapes.measures import MOST_PARTS, measures
from verify.data.shapes.region_shapes import REGION_SHAPES, Placed, RegionShape, compiled_parts
from verify.data.value import faults_of
from verify.data.vehicle import Number

_JOINED = 1e-9
"""m; faces of two parts that come as near as this to each other, or overlap by as little, are made one."""


def union(members: tuple[dict[str, Any], ...], yaw: float) -> Placed:  # noqa: ARG001  # it takes none
    """Return the parts of all members, around the deepest of their centres.

    Args:
        members: Each a shape as a region has it, with `center` and `yaw_deg` where the shape takes them, in the world's frame.
        yaw: 0.

    Raises:
        ValueError: A member is no shape, or there are too many.
    """
    placed: list[tuple[Point, tuple[Inequality, ...]]] = []
    for index, member in enumerate(members):
        try:
            one = _member(member)
            placed += [(one.center, tuple(part)) for part in one.parts]
        except ValidationError as error:
            raise ValueError(f"member {index + 1}: {' '.join(faults_of(error, 'this'))}") from None
        except (ValueError, BadInput) as error:
            raise ValueError(f"member {index + 1}: {error}") from None
    if len(placed) > MOST_PARTS:
        raise ValueError(f"a region has at most {MOST_PARTS} convex parts, and these are {len(placed)}")
    depths = [float(convex_body(part).depths(np.zeros((1, 3)))[0]) for _, part in placed]
    center = placed[depths.index(max(depths))][0]
    return Placed(center, _joined([[moved(one, center, own) for one in part] for own, part in placed]))


def _member(member: dict[str, Any]) -> Placed:
    """Return one member's body and where it is.

    Raises:
        ValueError: It is no shape, or not a whole one.
        ValidationError: A key holds what it may not.
    """
    around = {"center", "yaw_deg"}
    names = tuple(REGION_SHAPES.built_in) if REGION_SHAPES.built_in.keys() >= member.keys() - around else REGION_SHAPES.names()
    shapes = [key for key in member if key in names]
    if len(shapes) != 1:
        raise ValueError(f"it needs one shape, and has {' and '.join(shapes) or 'none'}. Shapes: {', '.join(names)}")
    (key,) = shapes
    shape = REGION_SHAPES.find(key)
    known = (key,) if shape.places_itself else (key, "center", "yaw_deg")
    for strange in member.keys() - set(known):
        raise ValueError(f"unknown key '{strange}'.{did_you_mean(str(strange), known)} Keys: {', '.join(known)}")
    if not shape.places_itself and "center" not in member:
        raise ValueError("`center` is missing: where the member is, in the world's frame")
    yaw = math.radians(TypeAdapter(Number).validate_python(member.get("yaw_deg", 0.0)))
    found = compiled_parts(shape, member[key], yaw)
    if isinstance(found, Placed):
        return found
    place = Placed(TypeAdapter(Point).validate_python(member["center"]), found)
    measures(tuple(map(tuple, place.parts)))
    return place


def _joined(parts: list[list[Inequality]]) -> list[list[Inequality]]:
    """Make faces one that rounding has parted: of two parts, with opposite normals, a nanometre or less from each other."""
    for (i, one), (j, other) in itertools.combinations(enumerate(parts), 2):
        for a, first in enumerate(one):
            for b, second in enumerate(other):
                if any(map(any, first.quadratic)) or any(map(any, second.quadratic)):
                    continue
                aside = max(abs(x + y) for x, y in zip(first.linear, second.linear, strict=True))
                if aside <= 1e-12 and abs(first.bound + second.bound) <= _JOINED * math.hypot(*first.linear):
                    opposite = tuple(-x for x in first.linear)
                    parts[j][b] = Inequality.model_validate({"linear": opposite, "bound": -parts[i][a].bound})
    return parts


UNION = RegionShape(
    schema=Annotated[tuple[dict[str, Any], ...], Field(min_length=1)],
    compiled=union,
    meaning="a list of shapes, each with its own `center` and `yaw_deg` where it takes them; they may touch and overlap",
    places_itself=True,
)
