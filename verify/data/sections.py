"""The sections of a mission, each a frozen value that is sound by itself: the schema of format 1 of the mission file.

Lengths are m, times s, angles rad; keys of the file that end in `_deg` are degrees, with a property beside them that gives
radians. What spans several sections is checked by `verify.data.validation`; `verify.data.mission` puts them together.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from typing import Annotated, Literal

from pydantic import AfterValidator, ConfigDict, Discriminator, Field, PlainValidator, Tag, model_validator

from verify.data.shapes.inequalities import Point
from verify.data.value import Value
from verify.data.vehicle import Held, NamedVehicle, NotNegative, Number, Positive, Vehicle

ChoiceName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_.-]{0,99}$")]
"""Name of something that another package may bring: which there are is known by `verify.data.names.choices`."""
Costs = dict[ChoiceName, NotNegative]
Trace = Literal["finite", "infinite"]
TeamReading = Literal["own", "joint"]
Count = Annotated[int, Field(strict=True, ge=1)]
Kinds = Annotated[tuple[str, ...], Field(min_length=1)]
"""Names of tables in a mission's `robots`."""


class SoftPart(Value):
    """Soft specification: a formula that is satisfied as far as it can be beside the mission's own."""

    formula: str = Field(description="as `spec.formula`")
    weight: Annotated[Positive, Field(le=1e12)] = Field(default=1.0, description="weight against the other soft specifications")


class Spec(Value):
    """Specification: the formula that must hold, and soft ones."""

    formula: str | None = Field(
        default=None,
        description="LTL without X over regions, internal propositions and `free`; under `team: joint` also counts and single robots' names",
    )
    trace: Trace = Field(default="finite", description="finite: LTLf until the mission ends; infinite: LTL over a lasso")
    team: TeamReading = Field(
        default="own", description="own: each robot's letters by themselves; joint: unions of all robots' letters"
    )
    repeat: Count = Field(default=1, description="laps of the cycle that are flown, for infinite traces")
    soft: tuple[SoftPart, ...] | None = Field(
        default=None, description="what is wished for: kept as far as it can be beside the formula, by weight"
    )


class Edge(Value):
    """An edge that is closed to some kinds of robots."""

    between: tuple[str, str] = Field(description="a pair of regions")
    only: Kinds = Field(description="names of `robots` tables: who may take it")


_EdgeForm = Annotated[
    Annotated[tuple[str, str], Tag("tuple[pair]")] | Annotated[Edge, Tag("tuple[table]")],
    Discriminator(lambda edge: "tuple[table]" if isinstance(edge, dict | Edge) else "tuple[pair]"),
]


class Environment(Value):
    """Graph of the regions that can be reached from each region (2022 paper, Def. 4.2)."""

    start: str = Field(default="robot", description="vertex where robots are before their first visit; left, never entered")
    edges: tuple[_EdgeForm, ...] = Field(
        description="pairs of regions, and `{between: [a, b], only: [kind]}` for edges that are closed to other kinds"
    )
    directed: bool = Field(default=False, strict=True, description="whether edges lead one way only")

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """All edges as pairs, whoever may take them."""
        return tuple(edge.between if isinstance(edge, Edge) else edge for edge in self.edges)

    def open_to(self, kind: str | None) -> tuple[tuple[str, str], ...]:
        """Return the edges that one kind of robot may take, as pairs.

        Args:
            kind: Name of its table in `robots`; None for a robot that names none.
        """
        return tuple(
            edge.between if isinstance(edge, Edge) else edge
            for edge in self.edges
            if not isinstance(edge, Edge) or kind in edge.only
        )

    def without(self, closed: Collection[str], kind: str | None) -> Environment:
        """Return the environment as one kind of robot has it.

        Args:
            closed: Regions that it may not enter.
            kind: Name of its table in `robots`; None for a robot that names none.
        """
        edges = self.open_to(kind)
        if not closed and edges == self.edges:
            return self
        kept = tuple((a, b) for a, b in edges if b not in closed and (self.directed or a not in closed))
        return self.model_copy(update={"edges": kept})


def everywhere_but(closed: Collection[str], regions: Sequence[str]) -> Environment:
    """Return an environment in which every region can be reached from every other, but for those that are closed.

    Args:
        closed: Regions that may not be entered.
        regions: All regions, in the mission's order.
    """
    start = "start" + "_" * sum(name.startswith("start") for name in regions)
    pairs = [(a, b) for a in (start, *regions) for b in regions if a != b and b not in closed]
    return Environment(start=start, edges=tuple(pairs), directed=True)


class Action(Value):
    """A change of the internal state, made inside one region."""

    source: str = Field(alias="from", description="internal state before")
    target: str = Field(alias="to", description="internal state after")
    at: str = Field(description="region in which it is permitted")

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True, serialize_by_alias=True)


class Robot(Value):
    """The internal transition system, of every agent that names no table of `robots` (2022 paper, Def. 4.1)."""

    initial: str = Field(default="idle", description="internal state at time 0")
    states: dict[str, tuple[str, ...]] = Field(default_factory=lambda: {"idle": ()}, description="state: its propositions")
    actions: tuple[Action, ...] = Field(default=(), description="changes of the internal state")


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
    endurance: Positive | None = Field(default=None, description="s, from take-off to touchdown")
    pieces: Held | None = Field(default=None, description="pieces of a flight that are held at once")
    legs: dict[str, LegLimits] = Field(default_factory=dict, description="region: limits on the way there")


GENTLE = 0.7
"""Share of the fastest flight at which robots fly where nobody says otherwise, and than which none is gentler for bounds in seconds."""


def _pace(value: object) -> float | str:
    """Return a pace as it is kept, or say what would be one."""
    if isinstance(value, str) and value == "nominal":
        return value
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value <= 1.0:
        raise ValueError(f"must be a share of the fastest flight, above 0 up to 1, or `nominal`, not {value!r}")
    return float(value)


Pace = Annotated[
    float | Literal["nominal"],
    PlainValidator(_pace, json_schema_input_type=Annotated[float, Field(gt=0, le=1)] | Literal["nominal"]),
]


class Agent(Value):
    """One quadcopter."""

    start: Point = Field(description="m, hovering there at time 0")
    yaw_deg: Number = Field(default=0.0, description="deg, heading at the start")
    heading: Literal["fixed", "path"] | Point = Field(
        default="fixed", description="fixed, along the path, or towards a point (m)"
    )
    end: Point | None = Field(default=None, description="m, where it must finish")
    internal: str | None = Field(default=None, description="internal state at time 0, instead of its robot's `initial`")
    visited: str | None = Field(
        default=None, description="region visited last before time 0, instead of the environment's start vertex"
    )
    cost: Costs | None = Field(default=None, description="weights of its own, instead of the planner's")
    vehicle: NamedVehicle | None = Field(
        default=None,
        description="what it flies, instead of the mission's `vehicle`: a shipped profile's name or an inline table",
    )
    limits: Limits | None = Field(default=None, description="tighten its vehicle's limits, beside the mission's `limits`")
    pace: Pace | None = Field(default=None, description="of its own, instead of the planner's")
    robot: str | None = Field(default=None, description="its kind: name of a table in `robots`, instead of `robot`")

    @property
    def yaw(self) -> float:
        """Start heading in rad."""
        return math.radians(self.yaw_deg)


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
        """Return whether a point lies in the box."""
        return all(low <= x <= high for low, x, high in zip(self.min, point, self.max, strict=True))


Objective = Annotated[Literal["sum", "longest", "max"], AfterValidator(lambda given: "longest" if given == "max" else given)]
"""`max` is read as `longest`, its name in files of format 1."""


class Planner(Value):
    """Settings of the planner."""

    method: ChoiceName = Field(
        default="exact",
        description="how robots and words are chosen: `exact`, `mtac-e`, `online-mtac-e`, or by another package",
    )
    objective: Objective = Field(
        default="sum", description="sum of the robots' costs, or the highest of them (`max`, or `longest`)"
    )
    cost: Costs = Field(
        default_factory=lambda: {"length": 1.0},
        description="weights of `length`, `effort`, `time`, `snap`, `energy`, or of terms that other packages bring",
    )
    speed: Positive = Field(default=0.45, description="m/s, nominal speed along the path")
    pace: Pace = Field(
        default=GENTLE,
        description="share of the fastest flight that limits, tube and labels allow, above 0 up to 1; or `nominal`, the plan's own times; the "
        "greatest that is allowed, and 1 where it is left out, where the formula has bounds in seconds",
    )
    directions: Literal["nearest", "cheapest"] = Field(default="nearest", description="how sides of hoops are chosen")
    visits: Literal["near", "middle"] = Field(
        default="near",
        description="where large regions are visited: as near as the way leads by, a little inside, or in their middles, as "
        "it is where the formula has bounds in seconds",
    )
    samples: Annotated[int, Field(strict=True, ge=2, le=100_000)] = Field(
        default=50, description="cross-entropy: paths a round"
    )
    elite: Annotated[Number, Field(gt=0, lt=1)] = Field(default=0.1, description="cross-entropy: share of elite paths")
    iterations: Annotated[int, Field(strict=True, ge=0, le=10_000)] = Field(default=12, description="cross-entropy: rounds")
    target: NotNegative = Field(default=0.0, description="cross-entropy: a cost that is good enough")
    seed: Annotated[int, Field(strict=True, ge=0)] = Field(default=0, description="source of every draw")


class EffectiveLimits(Value):
    """Limits of one robot's flight: its vehicle's, tightened by the mission's and its own. SI units, radians."""

    speed: float
    acceleration: float
    thrust_min: float
    thrust_max: float
    rotor_thrust_min: float
    rotor_thrust_max: float
    tilt: float
    body_rate: float
    yaw_rate: float
    endurance: float | None = None
    pieces: int | None = None


def limits_under(vehicle: Vehicle, asked: Limits) -> EffectiveLimits:
    """Return a vehicle's limits, tightened by those that are asked.

    Args:
        vehicle: Whose limits.
        asked: What tightens them.
    """

    def tighter(limit: float, wish: float | None) -> float:
        return limit if wish is None else min(limit, wish)

    return EffectiveLimits(
        speed=tighter(vehicle.speed, asked.speed),
        acceleration=tighter(vehicle.acceleration, asked.acceleration),
        thrust_min=max(vehicle.thrust_min, asked.thrust_min or 0.0),
        thrust_max=tighter(vehicle.thrust_max, asked.thrust_max),
        rotor_thrust_min=vehicle.rotor_thrust_min,
        rotor_thrust_max=vehicle.rotor_thrust_max,
        tilt=math.radians(tighter(vehicle.tilt_deg, asked.tilt_deg)),
        body_rate=math.radians(tighter(vehicle.body_rate_deg, asked.body_rate_deg)),
        yaw_rate=math.radians(tighter(vehicle.yaw_rate_deg, asked.yaw_rate_deg)),
        endurance=_least((vehicle.endurance, asked.endurance)),
        pieces=min((most for most in (vehicle.held, asked.pieces) if most is not None), default=None),
    )


def both_limits(one: Limits, other: Limits) -> Limits:
    """Return limits that are as tight as each of two, on the way to each region too.

    Args:
        one: Some limits.
        other: Some more.
    """
    upper = ("speed", "acceleration", "thrust_max", "tilt_deg", "body_rate_deg", "yaw_rate_deg", "endurance")
    legs = {
        region: LegLimits(
            speed=_least(each.legs[region].speed for each in (one, other) if region in each.legs),
            acceleration=_least(each.legs[region].acceleration for each in (one, other) if region in each.legs),
        )
        for region in dict.fromkeys((*one.legs, *other.legs))
    }
    least = [each.thrust_min for each in (one, other) if each.thrust_min is not None]
    return Limits(
        **{name: _least((getattr(one, name), getattr(other, name))) for name in upper},
        thrust_min=max(least, default=None),
        pieces=min((each.pieces for each in (one, other) if each.pieces is not None), default=None),
        legs=legs,
    )


def _least(values: Iterable[float | None]) -> float | None:
    return min((value for value in values if value is not None), default=None)
