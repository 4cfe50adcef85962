"""Obstacles of a mission: solid bodies, of the same shapes as regions, that no vehicle may meet."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field, field_serializer

from verify.data.shapes.inequalities import Parts
from verify.data.shapes.placed_body import PlacedBody


class Obstacle(PlacedBody):
    """A closed body that is solid but for its openings.

    The opening of a hoop is, of each convex part that holds the hoop's centre, what lies nearer to the hoop's axis than its
    `opening`; every other part is solid.
    """

    called: ClassVar[str] = "an obstacle"

    openings: tuple[str, ...] = Field(
        default=(), description="hoops in it, each a hole of the hoop's `opening` along its normal; solid otherwise"
    )

    @field_serializer("parts", when_used="json-unless-none")
    def _without_zeros(self, parts: Parts) -> list[list[dict[str, Any]]]:  # of any type: JSON nests
        """Write inequalities without what they do not have, since a mission may have many walls."""
        return [[one.model_dump(mode="json", exclude_defaults=True) for one in part] for part in parts]
