"""The mission: what was asked, as one frozen value (format 1 of the mission file), and the check of one that code has made.

`sections` holds the types of its parts, `rules` what must hold between them; `files` reads YAML.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import cached_property
from typing import Any, Literal, Self

import numpy as np
from pydantic import Field

from verify.data.disturbance import Disturbance
from verify.data.errors import BadInput
from verify.data.frame import Frame
from verify.data.language.counting import written_out
from verify.data.language.formula import FREE, TRUE, Formula
from verify.data.language.formula_reader import parse_formula
from verify.data.language.free import in_no_region
from verify.data.language.relaxation import relaxed, without_idle_bounds
from verify.data.language.sequence import Sequence, parse_sequence
from verify.data.language.word import Letter
from verify.data.sections import (
    Agent,
    Box,
    Costs,
    Count,
    EffectiveLimits,
    Environment,
    LegLimits,
    Limits,
    Pace,
    Planner,
    Robot,
    SoftPart,
    Spec,
    both_limits,
    everywhere_but,
    limits_under,
)
from verify.data.shapes.obstacle import Obstacle
from verify.data.shapes.region import Hoop, Region
from verify.data.storage.file_names import MissionName
from verify.data.validation.faults import Fault, MissionError, sound_sections
from verify.data.validation.missions import broken_rules
from verify.data.value import Remembered, Value, plain, without_none
from verify.data.vehicle import CLIMB_AND_LANDING, NamedVehicle, NotNegative, Vehicle

MISSION_FORMAT = 1


class Mission(Value):
    """Everything that was asked, with every default filled in."""

    format: Literal[1] = MISSION_FORMAT
    name: MissionName = Field(description="letters, digits, `_ . -`, space")
    spec: Spec = Field(default_factory=lambda: Spec())
    hoops: dict[str, Hoop] = Field(default_factory=dict, description="regions with a ring")
    regions: dict[str, Region] = Field(default_factory=dict, description="regions without a ring")
    obstacles: dict[str, Obstacle] = Field(default_factory=dict, description="solid bodies, which no vehicle may meet")
    environment: Environment | None = Field(
        default=None, description="omitted: every region can be reached from every other, as far as there is a way"
    )
    robot: Robot = Field(default_factory=lambda: Robot(), description="omitted: one internal state, no propositions")
    robots: dict[str, Robot] | None = Field(default=None, description="more robot types, as `robot`, by name")
    agents: dict[str, Agent] = Field(min_length=1, description="the quadcopters, by name")
    vehicle: NamedVehicle = Field(description="a shipped profile's name or an inline table")
    limits: Limits = Field(default_factory=lambda: Limits())
    workspace: Box = Field(description="where the vehicles' centres, with the margin, must stay")
    frame: Frame | None = Field(
        default=None,
        description="where all this lies in the laboratory, as motion capture sees it; omitted: its frame is the mission's",
    )
    separation: NotNegative = Field(default=0.3, description="m, between centres of robots")
    separation_z: NotNegative | None = Field(
        default=None, description="m, taller clearance in z for downwash: distance in z counts separation / separation_z"
    )
    margin: NotNegative = Field(
        default=0.05, description="m, the certificate's delta; `auto`, beside `disturbance`: what the proof of tracking allows"
    )
    disturbance: Disturbance | None = Field(
        default=None,
        description="what may disturb a flight, under which robots are proved to stay within the margin; omitted: that they do is assumed",
    )
    clock_error: NotNegative | None = Field(
        default=None,
        description="s between any two robots' clocks at any moment; 0: they share one; omitted: what a common start leaves",
    )
    radios: Count | None = Field(default=None, description="radios that start the team one after the other; omitted: 1")
    reaction: Literal["carry_on", "hold", "land"] = Field(
        default="carry_on", description="what the team does in flight when its monitor raises the alarm"
    )
    planner: Planner = Field(default_factory=lambda: Planner())
    sequence: str | None = Field(default=None, description="hoop passages to fly exactly, such as `hoop0F (hoop1R)*`")

    def changed(self, **fields: Any) -> Mission:  # of any type: pydantic looks at them
        """Return a mission with some fields replaced, which has passed every check that a mission file undergoes.

        Raises:
            BadInput: There is no such field, or the new mission is not allowed; all faults are listed, each with its keys.
        """
        self._require_fields(fields)
        return check_mission(self.model_copy(update=fields))

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:  # as pydantic declares it
        """Return a copy with changed fields; what is computed from fields is computed anew."""
        copied = super().model_copy(update=update, deep=deep)
        for name in (
            "written",
            "formula",
            "bounded",
            "timed_parts",
            "passages",
            "effective_limits",
            "of_one_kind",
            "_alike",
            "_seen",
        ):
            vars(copied).pop(name, None)
        return copied

    @property
    def all_regions(self) -> dict[str, Region]:
        """Hoops and plain regions together, hoops first."""
        return {**self.hoops, **self.regions}

    @property
    def internal_propositions(self) -> frozenset[str]:
        """Propositions of the robots' internal states."""
        systems = (self.robot, *(self.robots or {}).values())
        return frozenset(name for system in systems for names in system.states.values() for name in names)

    @property
    def propositions(self) -> frozenset[str]:
        """Names that the formula may use, `free` included."""
        return frozenset(self.all_regions) | self.internal_propositions | {FREE}

    @cached_property
    def written(self) -> Formula:
        """The formula as it was written, `free` and counts in it; `true` where there is none."""
        if self.spec.formula is None:
            return TRUE
        return parse_formula(self.spec.formula, self.propositions, robots=self.agents, allow_next=False)

    @cached_property
    def bounded(self) -> Formula:
        """The formula with its bounds, over regions and internal propositions; `free` is written out as "in no region", counts for these robots."""
        free = in_no_region(self.all_regions)
        return without_idle_bounds(written_out(self.written.substitute({FREE: free}), tuple(self.agents)))

    @cached_property
    def formula(self) -> Formula:
        """The formula that words have to satisfy, over regions and internal propositions; bounds in seconds are left out (`timed_parts`)."""
        return relaxed(self.bounded)

    @cached_property
    def timed_parts(self) -> tuple[Formula, ...]:
        """The conjuncts that are bounded in seconds, over regions and internal propositions; a flight has to satisfy these too."""
        return tuple(part for part in self.bounded.conjuncts() if part.timed)

    @property
    def soft_parts(self) -> tuple[SoftPart, ...]:
        """The soft specifications, in the mission's order."""
        return self.spec.soft or ()

    def asking(self, formula: str | None) -> Mission:
        """Return the mission with another formula and without soft parts: for planning and judging a part by itself.

        Args:
            formula: As `spec.formula`; one that has been read before.
        """
        return self.model_copy(update={"spec": self.spec.model_copy(update={"formula": formula, "soft": None})})

    @cached_property
    def passages(self) -> Sequence | None:
        """The sequence to fly exactly, or None."""
        return None if self.sequence is None else parse_sequence(self.sequence, tuple(self.hoops))

    @cached_property
    def effective_limits(self) -> EffectiveLimits:
        """The vehicle's limits, tightened by the mission's: those of a robot that has none of its own."""
        return limits_under(self.vehicle, self.limits)

    def vehicle_of(self, agent: str) -> Vehicle:
        """Return what one agent flies.

        Args:
            agent: Its name.
        """
        return self.agents[agent].vehicle or self.vehicle

    def limits_of(self, agent: str) -> EffectiveLimits:
        """Return the limits that one agent's flight keeps.

        Args:
            agent: Its name.
        """
        return self.seen_by(agent).effective_limits

    def weights_of(self, agent: str) -> Costs:
        """Return what one agent's path is weighed by: its own cost terms, or the planner's.

        Args:
            agent: Its name.
        """
        return self.agents[agent].cost or self.planner.cost

    def pace_of(self, agent: str) -> Pace:
        """Return one agent's pace: its own, or the planner's.

        Args:
            agent: Its name.
        """
        own = self.agents[agent].pace
        return self.planner.pace if own is None else own

    def leg_limits_of(self, agent: str) -> dict[str, LegLimits]:
        """Return the limits of one agent on the way to some regions, by region.

        Args:
            agent: Its name.
        """
        return self.seen_by(agent).limits.legs

    @property
    def longest_flight(self) -> float | None:
        """S that the flight may last: all are in the air until the last robot has finished, and one has the least endurance.

        None where no vehicle has an endurance.
        """
        found = [limit for limit in (self.limits_of(agent).endurance for agent in self.agents) if limit is not None]
        return min(found) - CLIMB_AND_LANDING if found else None

    def kind_of(self, agent: str) -> str | None:
        """Return the name of one agent's table in `robots`; None where it names none.

        Args:
            agent: Its name.
        """
        return self.agents[agent].robot

    def robot_of(self, agent: str) -> Robot:
        """Return one agent's internal transition system.

        Args:
            agent: Its name.
        """
        kind = self.kind_of(agent)
        return self.robot if kind is None else (self.robots or {})[kind]

    def may_enter(self, agent: str, region: str) -> bool:
        """Return whether a region is open to one agent's kind.

        Args:
            agent: Its name.
            region: The region's.
        """
        only = self.all_regions[region].only
        return only is None or self.kind_of(agent) in only

    def least_distance(self, one: str, other: str) -> float:
        """Return how far apart the centres of two agents stay, in m; a distance in z counts as `separation_z` says.

        Args:
            one: Name of an agent.
            other: Name of another one.
        """
        touching = self.vehicle_of(one).radius + self.vehicle_of(other).radius
        z_scale = self.separation / self.separation_z if self.separation_z else 1.0
        return max(self.separation, touching * max(1.0, z_scale))

    @cached_property
    def of_one_kind(self) -> bool:
        """True if no agent has a vehicle, limits or internal states of its own, so that what one can do all can."""
        return self.robots is None and all(agent.vehicle is None and agent.limits is None for agent in self.agents.values())

    def seen_by(self, agent: str) -> Mission:
        """Return the mission as it is for one agent: what is its own stands where the mission has what all share.

        These are `vehicle`, `limits`, `robot`, the nominal speed where robots differ (no more than its limit), and the environment:
        edges that are closed to it are left out, and those into regions that are. It is for planning and refinement, never for
        files, and is asked about this agent only. Agents that are alike have one value; where all are, it is this mission.

        Args:
            agent: Its name.
        """
        if self.of_one_kind:
            return self
        return self._seen[self._alike[agent]]

    def alike_as(self, agent: str) -> str:
        """Return a key that agents have in common to whom this mission is the same; empty where it is to all.

        Args:
            agent: Its name.
        """
        return "" if self.of_one_kind else self._alike[agent]

    @cached_property
    def _alike(self) -> dict[str, str]:
        """Digests of each agent's own settings: the same key in every mission."""
        keys = {}
        for name, agent in self.agents.items():
            own = agent.model_dump_json(include={"vehicle", "limits", "robot"})
            keys[name] = hashlib.sha256(own.encode()).hexdigest()
        return keys

    @cached_property
    def _seen(self) -> dict[str, Mission]:
        """The mission as agents see it, one value for those that are alike."""
        found: dict[str, Mission] = {}
        for name, agent in self.agents.items():
            if self._alike[name] not in found:
                limits = self.limits if agent.limits is None else both_limits(self.limits, agent.limits)
                found[self._alike[name]] = self._as_seen(name, limits)
        return found

    def _as_seen(self, agent: str, limits: Limits) -> Mission:
        vehicle = self.vehicle_of(agent)
        speed = min(self.planner.speed, limits_under(vehicle, limits).speed)
        view = self.model_copy(
            update={
                "vehicle": vehicle,
                "limits": limits,
                "robot": self.robot_of(agent),
                "planner": self.planner.model_copy(update={"speed": speed}),
                "environment": self._open_to(agent),
            }
        )
        vars(view)["of_one_kind"] = True  # so that it is its own view
        return view

    def _open_to(self, agent: str) -> Environment | None:
        """Return the environment without what is closed to one agent; None where every region can be reached from every other."""
        closed = {region for region in self.all_regions if not self.may_enter(agent, region)}
        if self.environment is not None:
            return self.environment.without(closed, self.kind_of(agent))
        return everywhere_but(closed, tuple(self.all_regions)) if closed else None

    def initial_internal(self, agent: str) -> str:
        """Internal state of one agent at time 0."""
        own = self.agents[agent].internal
        return self.robot_of(agent).initial if own is None else own

    def initial_letter(self, agent: str) -> Letter:
        """Propositions of one agent's internal state at time 0."""
        return frozenset(self.robot_of(agent).states[self.initial_internal(agent)])

    def resolved(self) -> dict[str, Any]:  # of any type: JSON nests
        """Return the mission as plain data with every default, matrix and vehicle number written out.

        `obstacles` stands there only where there are some: missions without them read as they did before there were any.
        """
        data = self.model_dump(mode="json", by_alias=True, exclude_none=True)
        return data if self.obstacles else {key: value for key, value in data.items() if key != "obstacles"}

    def digest(self) -> str:
        """Return the SHA-256 of the resolved mission, in hexadecimal."""
        text = json.dumps(self.resolved(), sort_keys=True, allow_nan=False, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()


_SOUND = {to_plan: Remembered() for to_plan in (False, True)}


def check_mission(mission: Mission, *, to_plan: bool = True) -> Mission:
    """Return the mission after the same checks that a file undergoes, for missions built or changed in code.

    What is returned is the mission that its fields say, whatever was put into it behind its back.

    Args:
        mission: What claims to be one.
        to_plan: Whether it is to be planned. A flight that is there already can be judged and flown by a mission that asks
            for nothing, whose starts, ends and hoops leave no room, or whose planning method is not installed.

    Raises:
        MissionError: All faults, with keys but without lines.
        BadInput: It is no mission at all.
    """
    if not isinstance(mission, Mission):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
        raise BadInput(f"A mission is a Mission, not {type(mission).__name__}; `ltlplan.load_mission` reads one.")
    data = plain(mission)
    if _SOUND[to_plan].knows(mission, data):
        return mission.model_copy()
    data = without_none(data)
    values, faults = sound_sections(data, Mission.model_fields)
    with np.errstate(all="ignore"):
        broken = broken_rules(values, data, to_plan=to_plan, installed=to_plan)
        found = [Fault(keys, None, reason) for keys, reason in [*faults, *broken]]
    if found:
        name = data.get("name")
        raise MissionError(name if isinstance(name, str) and name else "mission", found)
    sound = Mission.model_validate(values)
    _SOUND[to_plan].add(sound)
    return sound
