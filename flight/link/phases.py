"""Phases of a live flight: certified flights one after another, each from a hover to a hover.

Most stages are begun once. A flight in parts is begun part by part: the team hovers between two of them for as long as it takes, while the plan's
clock stands still. Laps that end in full flight have a braking behind them: it lies on board with them and is flown without a pause, but
nothing of it is part of the claim, so it is watched for itself.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property

from flight.certificate_checks import require_certificate
from flight.model.reference import flown
from flight.monitoring.letters import planned_actions
from flight.monitoring.monitor import Monitor
from verify.certificate import Certificate
from verify.data import BadInput, Mission, NotCertified, Plan, Trajectory, check_plan, check_trajectories
from verify.flight_segments import judge_braking
from verify.recordings.planned_paths import PlannedPath, planned_paths

FLIGHT = "flight"
"""Name of the stage that the claim is about."""
BRAKING = "braking"
"""What comes behind a patrol's last lap, as it is watched."""


@dataclass(frozen=True, eq=False, slots=True)
class Part:
    """Part that all robots begin at one instant, from a hover.

    Attributes:
        name: The stage's, and which part of it.
        paths: What each robot flies, finite.
        margin: delta, m.
        duration: s of it that are claimed.
        stored: Which of what the stage has stored it is.
        pauses: Whether the team hovers behind it until another part begins.
        start: m from its beginning at which the proof of tracking lets robots begin; None where nothing is proved.
        rest: How far from rest it lets them, and what a measurement may be off, by name.
    """

    name: str
    paths: Mapping[str, Trajectory]
    margin: float
    duration: float
    stored: int = 0
    pauses: bool = False
    start: float | None = None
    rest: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])


@dataclass(frozen=True, eq=False, slots=True)
class Watched:
    """A flight that can be watched.

    Attributes:
        name: What it is called.
        paths: What each robot flies, finite; of a flight in parts the first of them.
        margin: delta, m.
        monitor: Sees it from its beginning, or from when on it is watched.
        lasts: s that it is watched, pauses left out; None until the last path ends.
        pauses: s after which the team hovers until another part begins; infinite where none does.
        first: Name of its first part; None where it has none.
    """

    name: str
    paths: Mapping[str, Trajectory]
    margin: float
    monitor: Monitor
    lasts: float | None = None
    pauses: float = math.inf
    first: str | None = None

    @property
    def duration(self) -> float:
        """S until the last robot has finished."""
        return max(path.duration for path in self.paths.values()) if self.lasts is None else self.lasts


@dataclass(frozen=True, eq=False)
class Stage:
    """One certified flight of a team.

    Attributes:
        name: `climb`, `way`, `flight`, `landing` or another one's.
        plan: Carries the mission.
        team: As certified.
        certificate: Theirs.
        braking: For the robot of a patrol that ends in full flight all laps and the braking behind them, finite; it is judged here.

    Raises:
        NotCertified: The certificate is of something else, or the braking is not proved.
        BadInput: The braking is nobody's.
    """

    name: str
    plan: Plan
    team: Mapping[str, Trajectory]
    certificate: Certificate
    braking: Mapping[str, Trajectory] = field(default_factory=dict[str, Trajectory])

    def __post_init__(self) -> None:
        plan, team = check_plan(self.plan), check_trajectories(self.team)
        require_certificate(self.certificate, plan, team)
        object.__setattr__(self, "plan", plan)
        object.__setattr__(self, "team", {name: team[name] for name in plan.mission.agents})
        braking = check_trajectories(self.braking) if self.braking else {}
        object.__setattr__(self, "braking", braking)
        for name, path in braking.items():
            self._require_braking(name, path)

    @property
    def margin(self) -> float:
        """delta, m."""
        return float(self.certificate.margin)

    @property
    def start(self) -> float | None:
        """M from its beginning at which the proof of tracking lets robots begin; None where nothing is proved."""
        disturbance = self.plan.mission.disturbance
        return None if disturbance is None else disturbance.start

    @property
    def rest(self) -> Mapping[str, tuple[float, float]]:
        """Bounds on how far from rest it lets them, and what a measurement may be off, by name."""
        disturbance = self.plan.mission.disturbance
        return {} if disturbance is None else disturbance.measured_rest

    @cached_property
    def claimed(self) -> dict[str, Trajectory]:
        """Flights that the certificate is about: cycles repeated."""
        return flown(self.plan.mission, self.team)

    @cached_property
    def paths(self) -> dict[str, Trajectory]:
        """Flight of each robot: cycles repeated, and the braking after them; pauses left out."""
        return {name: self.braking.get(name, path) for name, path in self.claimed.items()}

    @property
    def duration(self) -> float:
        """S until the last robot has finished, pauses left out."""
        return max(path.duration for path in self.paths.values())

    @cached_property
    def stored(self) -> tuple[dict[str, Trajectory], ...]:
        """Trajectories on board, each under a number of its own: all, or each part once."""
        ranges = {name: path.parts for name, path in self.team.items()}
        if not any(path.cuts for path in self.team.values()):
            return (self.paths,)
        return tuple(
            {name: path.part(*ranges[name][number]) for name, path in self.team.items()}
            for number in range(min(map(len, ranges.values())))
        )

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """Parts that begin one after another, each from a hover: a cycle in parts as often as cycles are flown."""
        cut = next((path for path in self.team.values() if path.cuts), None)
        if cut is None:
            claimed = max(path.duration for path in self.claimed.values())
            return (Part(self.name, self.paths, self.margin, claimed, start=self.start, rest=self.rest),)
        order = cut.flown_parts(self.plan.mission.spec.repeat)
        durations = [max(path.duration for path in paths.values()) for paths in self.stored]
        return tuple(
            Part(f"{self.name} part {k}", self.stored[index], self.margin, durations[index], index, k < len(order))
            for k, index in enumerate(order, 1)
        )

    @cached_property
    def planned(self) -> dict[str, PlannedPath]:
        """The paths with bounds for all times."""
        return planned_paths(self.plan.mission, self.paths)

    @cached_property
    def behind(self) -> dict[str, Trajectory]:
        """Flight after the last cycle, to a stop."""
        return {name: path.part(len(self.claimed[name]), len(path)) for name, path in self.braking.items()}

    @cached_property
    def world(self) -> Mission:
        """The mission of what is flown behind the last lap: the same world, and nothing is asked of it."""
        mission = self.plan.mission
        spec = mission.spec.model_copy(update={"formula": "true", "soft": None, "trace": "finite", "repeat": 1})
        return mission.model_copy(update={"spec": spec, "sequence": None, "environment": None})

    def watched(self, accuracy: float) -> Watched:
        """Return what is claimed of this flight as it is watched.

        Args:
            accuracy: Bound on a measured position's error, m.
        """
        first = self.parts[0]
        lasts = sum(part.duration for part in self.parts)
        monitor = Monitor(
            self.plan.mission,
            planned_actions(self.plan, self.team, self.certificate),
            margin=self.margin,
            measurement=accuracy,
            planned_acceleration=max(path.acceleration for path in self.planned.values()),
            planned=self.planned,
        )
        until = first.duration if first.pauses else math.inf
        return Watched(self.name, first.paths, self.margin, monitor, lasts, until, first.name)

    def watched_braking(self, accuracy: float) -> Watched:
        """Return what is flown behind the last lap as it is watched: the tube, and nothing of the formula.

        Args:
            accuracy: Bound on a measured position's error, m.
        """
        monitor = Monitor(
            self.world, (), margin=self.margin, measurement=accuracy,
            planned_acceleration=max(path.acceleration for path in self.planned.values()),
        )  # fmt: skip
        return Watched(BRAKING, self.paths, self.margin, monitor)

    def _require_braking(self, name: str, path: Trajectory) -> None:
        """Reject a braking that is not proved behind certified laps."""
        if list(self.team) != [name]:
            raise BadInput(f"{name} brakes behind laps of {', '.join(self.team)}; one robot's laps end in full flight.")
        laps = self.claimed[name]
        begins = list(itertools.accumulate(map(Fraction, path.durations.tolist()), initial=Fraction(0)))[len(laps) : -1]
        world = self.plan.mission.model_copy(update={"margin": self.margin})
        claims = (judge_braking(world, name, self.team[name], path, since) for since in begins)
        refused: list[str] = []
        for judged in claims:
            refused = [claim.sentence for claim in judged if claim.outcome != "holds"]
            if not refused:
                return
        raise NotCertified(f"how {name} brakes behind its last lap is not proved: {' '.join(refused) or 'it does not brake'}")
