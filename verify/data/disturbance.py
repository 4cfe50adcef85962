"""Disturbances under which a flight is proved to stay near its plan: what air, cameras, sensors and the airframe may do.

A mission's key `disturbance` states them; the claim `tracking` is about them (docs/tracking.md).
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, Strict, model_validator

from verify.data.airframe import NamedAirframe
from verify.data.value import Value


def _at_most(most: float) -> object:
    return Field(ge=0, le=most, allow_inf_nan=False)


_Number = Annotated[float, Strict()]


class Disturbance(Value):
    """Bounds of what disturbs a flight; what is left out is 0."""

    airframe: NamedAirframe = Field(description="lag, drag and gains: a shipped airframe's name or a table")
    wind: Annotated[_Number, _at_most(20.0)] = Field(
        default=0.0, description="m/s, of the air in any direction, however it gusts"
    )
    position: Annotated[_Number, _at_most(0.2)] = Field(
        default=0.0, description="m, error of a position that the controller is given"
    )
    velocity: Annotated[_Number, _at_most(2.0)] = Field(default=0.0, description="m/s, error of a velocity that it is given")
    latency: tuple[Annotated[_Number, _at_most(0.02)], Annotated[_Number, _at_most(0.02)]] = Field(
        default=(0.0, 0.0), description="s, age of what it is given: least and most"
    )
    attitude: Annotated[_Number, _at_most(0.2)] = Field(default=0.0, description="rad, error of the attitude on board")
    gyroscope: Annotated[_Number, _at_most(2.0)] = Field(default=0.0, description="rad/s, error of the body rates on board")
    mass: Annotated[_Number, _at_most(0.3)] = Field(default=0.0, description="share by which the mass may differ")
    thrust: Annotated[_Number, _at_most(0.3)] = Field(
        default=0.0, description="share by which the rotors' thrust may differ from what is commanded, all alike"
    )
    sag: Annotated[_Number, _at_most(0.1)] = Field(default=0.002, description="share by which thrust may change in one flight")
    drag: Annotated[_Number, _at_most(1.0)] = Field(default=0.0, description="share by which the rotors' drag may differ")
    moment: Annotated[_Number, _at_most(10.0)] = Field(default=0.0, description="N m, any further moment on the body")
    inertia: Annotated[_Number, _at_most(0.5)] = Field(
        default=0.0, description="share by which each moment of inertia may differ"
    )
    centre: Annotated[_Number, _at_most(0.01)] = Field(
        default=0.0, description="m by which the centre of mass may be off the rotors' middle"
    )
    battery: Annotated[float, Strict(), Field(gt=0.5, le=1.0, allow_inf_nan=False)] = Field(
        default=1.0, description="least share of the rotors' greatest speed that the battery leaves"
    )
    fitted: bool = Field(
        default=False, strict=True, description="whether `run` takes the margin from the proof; `margin: auto` says the same"
    )
    start: Annotated[_Number, _at_most(0.5)] = Field(
        default=0.0, description="m from the plan's start at which a flight may begin"
    )

    @model_validator(mode="after")
    def _ordered(self) -> Disturbance:
        if self.latency[0] > self.latency[1]:
            raise ValueError(f"latency {self.latency[0]:g} to {self.latency[1]:g} s is no range: the least comes first")
        return self

    def scaled(self, share: float) -> Disturbance:
        """Return disturbances that are a share of these; the latency's least end, the battery and the airframe stay.

        Args:
            share: From 0 to 1.
        """
        names = ("wind", "position", "velocity", "attitude", "gyroscope", "mass", "thrust", "sag", "drag", "moment")
        names += ("inertia", "centre", "start")
        early, late = self.latency
        changes = {name: share * getattr(self, name) for name in names}
        return self.model_copy(update={**changes, "latency": (early, early + share * (late - early))})
