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


def _require_range(name: str, ends: tuple[float, float]) -> None:
    if ends[0] > ends[1]:
        raise ValueError(f"{name} {ends[0]:g} to {ends[1]:g} s is no range: the least comes first")


def _narrowed(ends: tuple[float, float], share: float) -> tuple[float, float]:
    """Return a share of a range, from its least end on."""
    return ends[0], ends[0] + share * (ends[1] - ends[0])


class StreamedSetpoints(Value):
    """Bounds of what set-points are off by that a controller is sent, 50 times a second."""

    age: tuple[Annotated[_Number, _at_most(0.05)], Annotated[_Number, _at_most(0.05)]] = Field(
        default=(0.0, 0.0), description="s, age of the set-point that a command follows: least and most"
    )
    orders: Annotated[int, Strict(), Field(ge=2, le=4)] = Field(
        default=4, description="highest derivative of a position that set-points hold: those above are taken for 0"
    )
    position: Annotated[_Number, _at_most(0.1)] = Field(default=0.0, description="m, by which rounding moves a position")
    velocity: Annotated[_Number, _at_most(1.0)] = Field(default=0.0, description="m/s, by which it moves a velocity")
    acceleration: Annotated[_Number, _at_most(1.0)] = Field(default=0.0, description="m/s^2, by which it moves an acceleration")
    jerk: Annotated[_Number, _at_most(10.0)] = Field(default=0.0, description="m/s^3, by which it moves a jerk")
    snap: Annotated[_Number, _at_most(100.0)] = Field(default=0.0, description="m/s^4, by which it moves a snap")
    heading: Annotated[_Number, _at_most(0.1)] = Field(default=0.0, description="rad, by which it turns the heading")

    @model_validator(mode="after")
    def _ordered(self) -> StreamedSetpoints:
        _require_range("age", self.age)
        return self

    @property
    def rounding(self) -> tuple[float, ...]:
        """By how much rounding changes a position and each of its four derivatives, as lengths."""
        return self.position, self.velocity, self.acceleration, self.jerk, self.snap

    def covers(self, other: StreamedSetpoints) -> bool:
        """Return whether set-points of another stream are within these.

        Args:
            other: What that stream's set-points are off by.
        """
        rounded = all(mine >= own for mine, own in zip(self.rounding, other.rounding, strict=True))
        aged = self.age[0] <= other.age[0] and other.age[1] <= self.age[1]
        return rounded and aged and self.heading >= other.heading and self.orders <= other.orders

    def scaled(self, share: float) -> StreamedSetpoints:
        """Return a share of these errors; the age's least end and the orders stay.

        Args:
            share: From 0 to 1.
        """
        names = ("position", "velocity", "acceleration", "jerk", "snap", "heading")
        changes = {name: share * getattr(self, name) for name in names}
        return self.model_copy(update={**changes, "age": _narrowed(self.age, share)})


class Unrest(Value):
    """Bounds of how far from rest, level and in balance a robot may be when its flight begins; what is left out is 0."""

    speed: Annotated[_Number, _at_most(1.0)] = Field(
        default=0.0, description="m/s, of the robot at the start and as long before as what it is given may be old"
    )
    tilt: Annotated[_Number, _at_most(0.2)] = Field(default=0.0, description="rad, of its thrust's axis")
    turn: Annotated[_Number, _at_most(2.0)] = Field(default=0.0, description="rad/s, of its body rates")
    heading: Annotated[_Number, _at_most(0.3)] = Field(default=0.0, description="rad, by which its heading is off")
    rotors: Annotated[_Number, _at_most(0.3)] = Field(
        default=0.0, description="share by which each rotor's thrust may differ from that of the model's hover"
    )
    summed: Annotated[_Number, _at_most(5.0)] = Field(
        default=0.0, description="m/s^2, of the errors that the controller has summed"
    )

    def scaled(self, share: float) -> Unrest:
        """Return a share of all of these.

        Args:
            share: From 0 to 1.
        """
        return self.model_copy(update={name: share * getattr(self, name) for name in type(self).model_fields})


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
    gyroscope: Annotated[_Number, _at_most(2.0)] = Field(
        default=0.0, description="rad/s, error of the body rates on board, as a vector"
    )
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
    rest: Unrest | None = Field(default=None, description="how far from rest a flight may begin; left out, it begins at rest")
    setpoints: StreamedSetpoints | None = Field(
        default=None, description="what streamed set-points are off by; left out, they are those of the plan at each command"
    )

    @model_validator(mode="after")
    def _ordered(self) -> Disturbance:
        _require_range("latency", self.latency)
        return self

    @property
    def measured_rest(self) -> dict[str, tuple[float, float]]:
        """Bounds on how far from rest a flight may begin, and what a measurement of that may be off; of what is stated and can be measured."""
        rest = self.rest or Unrest()
        errors = {"speed": self.velocity, "tilt": self.attitude, "turn": self.gyroscope, "heading": self.attitude}
        return {name: (most, error) for name, error in errors.items() if (most := getattr(rest, name))}

    def scaled(self, share: float, only: str | None = None) -> Disturbance:
        """Return disturbances that are a share of these; the latency's least end, the battery and the airframe stay.

        Args:
            share: From 0 to 1.
            only: The key of the one that is scaled; None for all.
        """
        names = ("wind", "position", "velocity", "attitude", "gyroscope", "mass", "thrust", "sag", "drag", "moment")
        names += ("inertia", "centre", "start")
        changes: dict[str, object] = {name: share * getattr(self, name) for name in names}
        changes |= {"latency": _narrowed(self.latency, share), "rest": self.rest and self.rest.scaled(share)}
        changes["setpoints"] = self.setpoints and self.setpoints.scaled(share)
        return self.model_copy(update=changes if only is None else {only: changes[only]})

    @property
    def stated(self) -> tuple[str, ...]:
        """The keys of what disturbs at all and can be scaled."""
        none = self.scaled(0.0)
        return tuple(name for name in type(self).model_fields if getattr(none, name) != getattr(self, name))
