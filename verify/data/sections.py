"""The sections of a mission, each a frozen value that is sound by itself: the schema of format 1 of the mission file.

Lengths are m, times s, angles rad; keys of the file that end in `_deg` are degrees, with a property beside them that gives
radians. What spans several sections is checked by `verify.data.rules`; `verify.data.mission` puts them together.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import ConfigDict, Field, model_validator

from verify.data.shapes.inequalities import Point
from verify.data.value import Value
from verify.data.vehicle import NotNegative, Number, Positive

ChoiceName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_.-]{0,99}$")]
"""Name of something that another package may bring: which there are is known by `verify.data.choices`."""
Costs = dict[ChoiceName, NotNegative]
Trace = Literal["finite", "infinite"]
TeamReading = Literal["own", "joint"]
Count = Annotated[int, Field(strict=True, ge=1)]


class Spec(Value):
    """What must hold."""

    formula: str | None = Field(default=None, description="LTL without X over regions, internal propositions and `free`")
    trace: Trace = Field(default="finite", description="finite: LTLf until the mission ends; infinite: LTL over a lasso")
    team: TeamReading = Field(
        default="own", description="own: each robot's letters by themselves; joint: unions of all robots' letters"
    )
    repeat: Count = Field(default=1, description="laps of the cycle that are flown, for infinite traces")


class Environment(Value):
    """Which regions can be reached from which (2022 paper, Def. 4.2)."""

    start: str = Field(default="robot", description="vertex where robots are before their first visit; left, never entered")
    edges: tuple[tuple[str, str], ...] = Field(description="pairs of regions")
    directed: bool = Field(default=False, strict=True, description="whether edges lead one way only")


class Action(Value):
    """A change of the internal state, made inside one region."""

    source: str = Field(alias="from", description="internal state before")
    target: str = Field(alias="to", description="internal state after")
    at: str = Field(description="region in which it is permitted")

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True, serialize_by_alias=True)


class Robot(Value):
    """The internal transition system, the same for every agent (2022 paper, Def. 4.1)."""

    initial: str = Field(default="idle", description="internal state at time 0")
    states: dict[str, tuple[str, ...]] = Field(default_factory=lambda: {"idle": ()}, description="state: its propositions")
    actions: tuple[Action, ...] = Field(default=(), description="changes of the internal state")


class Agent(Value):
    """One quadcopter."""

    start: Point = Field(description="m, hovering there at time 0")
    yaw_deg: Number = Field(default=0.0, description="deg, heading at the start")
    heading: Literal["fixed", "path"] | Point = Field(
        default="fixed", description="fixed, along the path, or towards a point (m)"
    )
    end: Point | None = Field(default=None, description="m, where it must finish")
    internal: str | None = Field(default=None, description="internal state at time 0, instead of `robot.initial`")
    visited: str | None = Field(
        default=None, description="region visited last before time 0, instead of the environment's start vertex"
    )
    cost: Costs | None = Field(default=None, description="weights of its own, instead of the planner's")

    @property
    def yaw(self) -> float:
        """Start heading in rad."""
        return math.radians(self.yaw_deg)


class LegLimits(Value):
    """Limits that hold while a robot flies to one region, from its previous visit to this one."""

    speed: Positive | None = Field(default=None, description="m/s")
    acceleration: Positive | None = Field(default=None, description="m/s^2")


class Limits(Value):
    """Tightens the vehicle's own limits."""

    speed: Positive | None = Field(default=None, description="m/s")
    acceleration: Positive | None = Field(default=None, description="m/s^2")
    thrust_min: Positive | None = Field(default=None, description="N, collective")
    thrust_max: Positive | None = Field(default=None, description="N, collective")
    tilt_deg: Positive | None = Field(default=None, description="deg")
    body_rate_deg: Positive | None = Field(default=None, description="deg/s, roll and pitch together")
    yaw_rate_deg: Positive | None = Field(default=None, description="deg/s, about the body's z")
    legs: dict[str, LegLimits] = Field(default_factory=dict, description="region: limits on the way there")


class Box(Value):
    """An axis-aligned box, closed."""

    min: Point = Field(description="m, lower corner")
    max: Point = Field(description="m, upper corner")

    @model_validator(mode="after")
    def _not_empty(self) -> Box:
        if any(low >= high for low, high in zip(self.min, self.max, strict=True)):
            raise ValueError(f"min {list(self.min)} must be below max {list(self.max)} on every axis")
        return self

    def holds(self, point: Point) -> bool:
        """Tell whether a point lies in the box."""
        return all(low <= x <= high for low, x, high in zip(self.min, point, self.max, strict=True))


class Planner(Value):
    """How to plan."""

    method: ChoiceName = Field(
        default="exact",
        description="how robots and words are chosen: `exact`, `mtac-e`, `online-mtac-e`, or by another package",
    )
    objective: Literal["sum", "longest"] = Field(default="sum", description="sum of the robots' costs, or the dearest robot's")
    cost: Costs = Field(
        default_factory=lambda: {"length": 1.0},
        description="weights of `length`, `effort`, `time`, `snap`, `energy`, or of terms that other packages bring",
    )
    speed: Positive = Field(default=0.45, description="m/s, nominal speed along the path")
    directions: Literal["nearest", "cheapest"] = Field(default="nearest", description="how sides of hoops are chosen")
    samples: Annotated[int, Field(strict=True, ge=2, le=100_000)] = Field(
        default=50, description="cross-entropy: paths a round"
    )
    elite: Annotated[Number, Field(gt=0, lt=1)] = Field(default=0.1, description="cross-entropy: share of elite paths")
    iterations: Annotated[int, Field(strict=True, ge=0, le=10_000)] = Field(default=12, description="cross-entropy: rounds")
    target: NotNegative = Field(default=0.0, description="cross-entropy: a cost that is good enough")
    seed: Annotated[int, Field(strict=True, ge=0)] = Field(default=0, description="source of every draw")


class EffectiveLimits(Value):
    """What the flight must keep: the vehicle's limits, tightened by the mission. SI units, radians."""

    speed: float
    acceleration: float
    thrust_min: float
    thrust_max: float
    rotor_thrust_min: float
    rotor_thrust_max: float
    tilt: float
    body_rate: float
    yaw_rate: float
