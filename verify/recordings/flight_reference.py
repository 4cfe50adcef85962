"""Reference of a recording: a run with its plan and trajectories, a flight in a changing world, or a mission alone.

Nothing in `certificate.json` is believed: it is proved again before its margin and its actions are used.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path

from verify.certificate import ActionInstant, Certificate
from verify.certification import judge
from verify.data.errors import BadInput, NotCertified
from verify.data.events import EVENTS_FILE, RobotJoins, RobotLeaves, WorldEvent, load_events, require_known
from verify.data.files.mission_file import load_mission_file
from verify.data.mission import Mission, check_mission
from verify.data.plan import Plan, check_plan, load_plan
from verify.data.trajectory import PAUSE, Trajectory, check_trajectories
from verify.run_folder import CERTIFICATE_FILE, PLAN_FILE, ProvedRun, mission_of, proved_run, read_folder


@dataclass(frozen=True, slots=True)
class World:
    """The mission as it is from one time on.

    Attributes:
        since: s of the recording; the first world's does not matter.
        mission: Regions, formula and robots.
    """

    since: float
    mission: Mission


@dataclass(frozen=True, slots=True)
class Joined:
    """Times at which a robot that stood on the ground joined the team.

    Attributes:
        since: When it hovered and took part, s of the recording: from then on it is checked like all others.
        climbs: When it left the ground, s: from then on it keeps away from all others, and from rims and obstacles.
    """

    since: float
    climbs: float


@dataclass(frozen=True, eq=False)
class FlightReference:
    """Reference that a recording is compared with.

    Attributes:
        worlds: The mission, and as what it changed in flight, in order of time.
        team: Trajectories that were to be flown, where there are any.
        plan: Visits and passages that were planned, where there is a plan.
        margin: delta, m.
        clock_error: How far clocks may differ, s.
        actions: Instants of planned actions, proved, on the plan's clock.
        gone: Robots that left the team in flight, and when, s.
        joined: Robots that joined the team in flight from the ground, and when.
    """

    worlds: tuple[World, ...]
    team: Mapping[str, Trajectory] | None = None
    plan: Plan | None = None
    margin: float = 0.0
    clock_error: float = 0.0
    actions: tuple[ActionInstant, ...] = ()
    gone: Mapping[str, float] = field(default_factory=dict)
    joined: Mapping[str, Joined] = field(default_factory=dict)

    @classmethod
    def of_mission(cls, mission: Mission) -> FlightReference:
        """Ask a mission alone, of which nothing was planned."""
        return cls((World(0.0, mission),))

    @classmethod
    def of_certificate(
        cls, certificate: Certificate, team: Mapping[str, Trajectory], plan: Plan | None = None
    ) -> FlightReference:
        """Ask what a certificate claims; its actions must have been checked, not read.

        Args:
            certificate: What was claimed.
            team: Trajectories that it is about, by robot.
            plan: Visits and passages that were planned; None leaves them out.
        """
        return cls(
            (World(0.0, certificate.mission),), team, plan, float(certificate.margin),
            float(getattr(certificate, "clock_error", 0.0)), tuple(certificate.actions),
        )  # fmt: skip

    def checked(self) -> FlightReference:
        """Return the same after every check that the files of its parts undergo.

        Raises:
            BadInput: A mission, the plan, a trajectory or a number is not sound.
        """
        for name, value in (("margin", self.margin), ("clock_error", self.clock_error)):
            if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < math.inf:  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
                raise BadInput(f"{name} must be a number of at least 0, not {value!r:.40}.")
        self._require_order()
        checked = replace(
            self,
            worlds=tuple(World(world.since, check_mission(world.mission, to_plan=False)) for world in self.worlds),
            team=None if self.team is None else check_trajectories(self.team),
            plan=None if self.plan is None else check_plan(self.plan),
        )
        checked._require_fit()
        return checked

    def _require_order(self) -> None:
        """Reject worlds that do not follow one another, and robots that left or joined at no time or were never there."""
        if not self.worlds:
            raise BadInput("There must be at least one world: the mission at take-off.")
        for what, time in [
            *(("change of the world", w.since) for w in self.worlds),
            *(("leaving", t) for t in self.gone.values()),
            *(("joining", t) for one in self.joined.values() for t in (one.since, one.climbs)),
        ]:
            if isinstance(time, bool) or not isinstance(time, int | float) or not math.isfinite(time):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
                raise BadInput(f"The time of a {what} must be a number of seconds, not {time!r:.40}.")
        for before, after in itertools.pairwise(self.worlds[1:]):
            if after.since < before.since:
                raise BadInput(
                    f"The world's changes must go forward in time, but {after.since:g} s follows {before.since:g} s."
                )
        for robot in self.gone:
            if robot not in self.mission.agents:
                raise BadInput(f"'{robot:.40}' leaves but is no robot of the mission ({', '.join(self.mission.agents)}).")
        for robot, one in self.joined.items():
            if robot not in self.mission.agents:
                raise BadInput(f"'{robot:.40}' joins but is no robot of the mission ({', '.join(self.mission.agents)}).")
            if not one.climbs <= one.since <= self.gone.get(robot, math.inf):
                raise BadInput(
                    f"'{robot}' must climb before it joins, and leave after it, not climb at {one.climbs:g} s and join at {one.since:g} s."
                )

    def _require_fit(self) -> None:
        """Reject worlds with other regions, and a plan or trajectories of other robots."""
        regions = set(self.mission.all_regions)
        for world in self.worlds:
            if set(world.mission.all_regions) != regions or set(world.mission.hoops) != set(self.mission.hoops):
                other = min(regions ^ set(world.mission.all_regions), default="a hoop")
                raise BadInput(f"Regions may move, but none comes or goes: '{other}' is not in every world.")
        robots = {"plan": None if self.plan is None else self.plan.robots, "team": self.team}
        for what, found in robots.items():
            if found is not None and set(found) != set(self.mission.agents):
                raise BadInput(f"The {what} has robots {', '.join(found)}; the mission has {', '.join(self.mission.agents)}.")

    @property
    def changes(self) -> bool:
        """True if the world or the team changed in flight, at times that count from the flight's start."""
        return len(self.worlds) > 1 or bool(self.gone) or bool(self.joined)

    @property
    def mission(self) -> Mission:
        """The mission as it was at the end: its formula is asked of the whole flight."""
        return self.worlds[-1].mission


def load_reference(source: str | Path, pauses: Sequence[float] = ()) -> FlightReference:
    """Read what a flight was to do.

    Args:
        source: A folder that `ltlplan run` or `ltlplan fly` wrote, or a mission file.
        pauses: How long the team hovered between the parts of a flight in parts, s each; none where it did not. The flight is compared with
            its plan with hovers of these lengths, which is proved anew; laps, which are flown as often as is asked, are certified for pauses.

    Raises:
        NotCertified: The folder's certificate is not proved any more, or a file was changed since; or what was flown with these pauses
            is not proved, as where they outlast an endurance.
        BadInput: A file is missing or unreadable, or the flight has no such pauses.
    """
    source = Path(source)
    if pauses:
        return _paused(source, pauses)
    if not source.is_dir():
        return FlightReference.of_mission(load_mission_file(source, installed=False))
    if (source / CERTIFICATE_FILE).exists():
        run = proved_run(source)
        return FlightReference.of_certificate(run.certificate, run.team, run.plan)
    if (source / EVENTS_FILE).exists():
        return of_events(mission_of(source), load_events(source / EVENTS_FILE))
    if not (source / PLAN_FILE).exists():
        return FlightReference.of_mission(mission_of(source))
    mission = mission_of(source)
    if not any((source / f"{name}.csv").exists() for name in mission.agents):
        plan = load_plan(source / PLAN_FILE, mission)
        return FlightReference((World(0.0, mission),), None, plan, mission.margin)
    plan, team = read_folder(source)
    return FlightReference.of_certificate(judge(plan, team, largest=False), team, plan)


def _paused(source: Path, pauses: Sequence[float]) -> FlightReference:
    """Read what a flight in parts was to do, with hovers between them."""
    if not source.is_dir() or not (source / CERTIFICATE_FILE).exists():
        raise BadInput(f"{source} is no certified run, of which a flight in parts could have paused.")
    for pause in pauses:
        if isinstance(pause, bool) or not isinstance(pause, int | float) or not 0 <= pause < math.inf:  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
            raise BadInput(f"A pause must be a number of seconds of at least 0, not {pause!r:.40}.")
    run = proved_run(source)
    if any(path.cycle is not None for path in run.team.values()):
        return _paused_laps(source, run, pauses)
    team = {name: path.paused(pauses) for name, path in run.team.items()}
    certificate = judge(run.plan, team, margin=run.certificate.margin, clock_error=run.certificate.clock_error, largest=False)
    if not certificate.holds:
        refused = " ".join(claim.sentence for claim in certificate.claims if claim.outcome != "holds")
        raise NotCertified(f"{source}: with these pauses the flight is not proved. {refused}")
    return FlightReference.of_certificate(certificate, team, run.plan)


def _paused_laps(source: Path, run: ProvedRun, pauses: Sequence[float]) -> FlightReference:
    """Return what laps in parts were to do with hovers between them: their certificate holds for pauses of any length, but for endurance.

    That is counted there with a number of seconds for each pause, so that it holds where all pauses together are no longer.
    """
    mission = run.certificate.mission
    laps, counted = mission.spec.repeat, PAUSE * len(pauses)
    team = {name: path.flattened(laps).paused(pauses) for name, path in run.team.items()}
    if mission.longest_flight is not None and sum(pauses) > counted:
        raise NotCertified(
            f"{source}: with these pauses the flight is not proved: they last {sum(pauses):.1f} s in all, and its endurance counts {counted:g} s."
        )
    actions: list[ActionInstant] = []
    for entry in run.certificate.actions:
        whole = run.team[entry.robot].flattened(laps)
        begins = whole.knots[list(whole.cuts)].tolist()
        for time in lap_times(entry.time, run.team[entry.robot], laps):
            late = sum(pause for begin, pause in zip(begins, pauses, strict=True) if begin < time)
            actions.append(replace(entry, time=float(time) + late))
    return replace(FlightReference.of_certificate(run.certificate, team, run.plan), actions=tuple(actions))


def lap_times(time: float, path: Trajectory, laps: int) -> tuple[Fraction, ...]:
    """Return when what happens at a time of prefix or lap happens: once, or in each lap, s.

    Args:
        time: s on the plan's clock.
        path: The robot's flight.
        laps: How many are flown.
    """
    if path.cycle is None or time < (begin := float(path.knots[path.cycle])):
        return (Fraction(time),)
    lap = Fraction(path.duration - begin)
    return tuple(Fraction(time) + number * lap for number in range(laps))


def of_events(mission: Mission, events: Sequence[WorldEvent]) -> FlightReference:
    """Ask a mission whose world changed in flight.

    Args:
        mission: As it was at take-off.
        events: What happened, in order of time, s of the recording.

    Raises:
        BadInput: An event cannot be.
    """
    worlds, gone, joined = [World(0.0, mission)], dict[str, float](), dict[str, Joined]()
    for event in events:
        require_known(mission, event)
        if isinstance(event, RobotLeaves):
            if event.robot in gone:
                raise BadInput(f"'{event.robot}' leaves twice, at {gone[event.robot]:g} s and at {event.time:g} s.")
            gone[event.robot] = event.time
            continue
        if isinstance(event, RobotJoins) and event.climbs is not None:
            joined[event.robot] = Joined(event.time, event.climbs)
        try:
            mission = event.apply(mission)
        except ValueError as error:
            raise BadInput(f"At {event.time:g} s {event}: {error}") from None
        worlds.append(World(event.time, mission))
    return FlightReference(tuple(worlds), margin=mission.margin, gone=gone, joined=joined)
