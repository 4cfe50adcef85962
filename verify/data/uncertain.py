"""Uncertain numbers of an airframe, each from a least to a most: what a flight of identification found, or a person says.

The judge never reads them. Simulation flies their ends (`ltlplan rehearse`, and `run` where a profile has them); they stand in a vehicle's
profile, so that they are part of a resolved mission.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, Strict, model_validator

from verify.data.value import Value

_Positive = Annotated[float, Strict(), Field(gt=0, allow_inf_nan=False)]
_NotNegative = Annotated[float, Strict(), Field(ge=0, allow_inf_nan=False)]
_Share = Annotated[float, Strict(), Field(ge=0.5, le=1.5)]
_Latency = Annotated[float, Strict(), Field(ge=0, le=0.2)]
_Noise = Annotated[float, Strict(), Field(ge=0, le=0.2)]


class Uncertain(Value):
    """Intervals of what is not known of an airframe; what is left out is as `ltlplan rehearse` takes it."""

    mass: tuple[_Positive, _Positive] | None = Field(default=None, description="kg")
    thrust: tuple[_Share, _Share] | None = Field(default=None, description="thrust over the thrust that is commanded")
    drag: tuple[_NotNegative, _NotNegative] | None = Field(
        default=None, description="kg, force across a rotor's axis per rad/s and m/s"
    )
    latency: tuple[_Latency, _Latency] | None = Field(
        default=None, description="s from a frame of motion capture to its use on board"
    )
    noise: tuple[_Noise, _Noise] | None = Field(default=None, description="m, standard deviation of motion capture's positions")

    @model_validator(mode="after")
    def _ordered(self) -> Uncertain:
        for name, ends in self.ends.items():
            if ends[0] > ends[1]:
                raise ValueError(f"{name} {ends[0]:g} to {ends[1]:g} is no range: the least comes first")
        return self

    @property
    def ends(self) -> dict[str, tuple[float, float]]:
        """Least and most of each number that is given, by its name."""
        given = {"mass": self.mass, "thrust": self.thrust, "drag": self.drag, "latency": self.latency, "noise": self.noise}
        return {name: ends for name, ends in given.items() if ends is not None}
