"""The mission: what was asked, as one frozen value (format 1 of the mission file).

The classes here are the file's schema; `mission_file` reads YAML into them with line numbers and checks what
spans several keys. Lengths are m, times s, angles rad; keys of the file that end in `_deg` are degrees, with a
property beside them that gives radians.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Collection, Mapping
from functools import cached_property
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, model_validator

from verify.data.errors import BadInput
from verify.data.language.formula import FREE, TRUE, Formula, parse_formula
from verify.data.language.sequence import Sequence, parse_sequence
from verify.data.language.word import Letter
from verify.data.shapes.inequalities import Point
from verify.data.shapes.region import Hoop, Region
from verify.data.storage.file_names import MAX_LENGTH, name_fault
from verify.data.value import Value
from verify.data.vehicle import NotNegative, Number, Positive, Vehicle, load_vehicle

MISSION_FORMAT = 1
_CHAIN = 40
"""Terms of a conjunction that are joined one after another; more are halved."""

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


def _named_vehicle(value: object) -> object:
    """Replace the name of a shipped profile by the profile."""
    if not isinstance(value, str):
        return value
    try:
        return load_vehicle(value)
    except BadInput as error:
        raise ValueError(str(error)) from None


def _name_of_files(value: str) -> str:
    """Refuse a mission's name that folders and pages could not have."""
    if (fault := name_fault(value)) is not None:
        raise ValueError(fault)
    return value


MissionName = Annotated[
    str,
    Field(min_length=1, max_length=MAX_LENGTH, pattern=r"^[A-Za-z0-9][A-Za-z0-9_. -]*$"),
    AfterValidator(_name_of_files),
]


class Mission(Value):
    """Everything that was asked, with every default filled in."""

    format: Literal[1] = MISSION_FORMAT
    name: MissionName = Field(description="letters, digits, `_ . -`, space")
    spec: Spec = Field(default_factory=lambda: Spec())
    hoops: dict[str, Hoop] = Field(default_factory=dict, description="regions with a ring")
    regions: dict[str, Region] = Field(default_factory=dict, description="regions without a ring")
    environment: Environment | None = Field(default=None, description="omitted: every region can be reached from every other")
    robot: Robot = Field(default_factory=lambda: Robot(), description="omitted: one internal state, no propositions")
    agents: dict[str, Agent] = Field(min_length=1, description="the quadcopters, by name")
    vehicle: Annotated[Vehicle, BeforeValidator(_named_vehicle)] = Field(
        description="a shipped profile's name or an inline table"
    )
    limits: Limits = Field(default_factory=lambda: Limits())
    workspace: Box = Field(description="where the vehicles' centres, with the margin, must stay")
    separation: NotNegative = Field(default=0.3, description="m, between centres of robots")
    separation_z: NotNegative | None = Field(
        default=None, description="m, taller clearance in z for downwash: distance in z counts separation / separation_z"
    )
    margin: NotNegative = Field(default=0.05, description="m, the certificate's delta")
    reaction: Literal["carry_on", "hold", "land"] = Field(
        default="carry_on", description="what the team does in flight when its monitor raises the alarm"
    )
    planner: Planner = Field(default_factory=lambda: Planner())
    sequence: str | None = Field(default=None, description="hoop passages to fly exactly, such as `hoop0F (hoop1R)*`")

    def changed(self, **fields: Any) -> Mission:
        """Return a mission with some fields replaced, which has passed every check that a mission file undergoes.

        Raises:
            BadInput: There is no such field, or the new mission is not allowed; all faults are listed, each with its keys.
        """
        from verify.data.mission_file import check_mission  # it imports this module

        self._require_fields(fields)
        return check_mission(self.model_copy(update=fields))

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy with changed fields; what is computed from fields is computed anew."""
        copied = super().model_copy(update=update, deep=deep)
        for name in ("formula", "passages", "effective_limits"):
            vars(copied).pop(name, None)
        return copied

    @property
    def all_regions(self) -> dict[str, Region]:
        """Hoops and plain regions together, hoops first."""
        return {**self.hoops, **self.regions}

    @property
    def internal_propositions(self) -> frozenset[str]:
        """Propositions of the robot's internal states."""
        return frozenset(name for names in self.robot.states.values() for name in names)

    @property
    def propositions(self) -> frozenset[str]:
        """Names that the formula may use, `free` included."""
        return frozenset(self.all_regions) | self.internal_propositions | {FREE}

    @cached_property
    def formula(self) -> Formula:
        """The formula over regions and internal propositions; `free` is written out as "in no region"."""
        if self.spec.formula is None:
            return TRUE
        written = parse_formula(self.spec.formula, self.propositions, allow_next=False)
        return written.substitute({FREE: in_no_region(self.all_regions)})

    @cached_property
    def passages(self) -> Sequence | None:
        """The sequence to fly exactly, or None."""
        return None if self.sequence is None else parse_sequence(self.sequence, tuple(self.hoops))

    @cached_property
    def effective_limits(self) -> EffectiveLimits:
        """The vehicle's limits, tightened by the mission's."""
        own, asked = self.vehicle, self.limits

        def tighter(limit: float, wish: float | None) -> float:
            return limit if wish is None else min(limit, wish)

        return EffectiveLimits(
            speed=tighter(own.speed, asked.speed),
            acceleration=tighter(own.acceleration, asked.acceleration),
            thrust_min=max(own.thrust_min, asked.thrust_min or 0.0),
            thrust_max=tighter(own.thrust_max, asked.thrust_max),
            rotor_thrust_min=own.rotor_thrust_min,
            rotor_thrust_max=own.rotor_thrust_max,
            tilt=math.radians(tighter(own.tilt_deg, asked.tilt_deg)),
            body_rate=math.radians(tighter(own.body_rate_deg, asked.body_rate_deg)),
            yaw_rate=math.radians(tighter(own.yaw_rate_deg, asked.yaw_rate_deg)),
        )

    def initial_internal(self, agent: str) -> str:
        """Internal state of one agent at time 0."""
        own = self.agents[agent].internal
        return self.robot.initial if own is None else own

    def initial_letter(self, agent: str) -> Letter:
        """Propositions of one agent's internal state at time 0."""
        return frozenset(self.robot.states[self.initial_internal(agent)])

    def resolved(self) -> dict[str, Any]:
        """Return the mission as plain data with every default, matrix and vehicle number written out."""
        return self.model_dump(mode="json", by_alias=True, exclude_none=True)

    def digest(self) -> str:
        """Return the SHA-256 of the resolved mission, in hexadecimal."""
        text = json.dumps(self.resolved(), sort_keys=True, allow_nan=False, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()


def in_no_region(regions: Collection[str]) -> Formula:
    """Return the formula for `free`: in none of these regions. The conjunction of many is halved, so that it is never deep."""
    names = list(regions)
    if len(names) > _CHAIN:
        half = len(names) // 2
        return Formula("&", (in_no_region(names[:half]), in_no_region(names[half:])))
    formula = TRUE
    for name in names:
        outside = Formula("!", (Formula("name", (), name),))
        formula = outside if formula == TRUE else Formula("&", (formula, outside))
    return formula
