"""A mission flown online in simulation: from its start until the formula is satisfied, then checked.

This stands beside the pipeline, above planner, flight and judge: `sharing.team.OnlineTeam` says 50 times a second where the
robots should be, flight's closed loop flies there, and when it is over the checker checks the words that were flown. A flight of
this kind is not certified beforehand and cannot be exported; log, summary and result say so. Its verdict is over label
changes seen at 100 Hz, not over all times.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from flight.certificate_checks import require_tube
from flight.closed_loop import Setup, Snapshot, steps
from flight.conditions import CALM, ConditionKeywords, Conditions
from flight.logs.log import Event, FlightLog
from flight.model.airframe import airframe_in
from flight.model.attitude import euler
from flight.model.timing import CONTROL_STEP, STEP, SUBSTEPS
from ltlplan.online.checked_events import falls_on, in_order
from ltlplan.online.event_queue import GIVE_UP
from ltlplan.online.observed_timelines import judged_words, on_grid, seen_timeline
from ltlplan.online.online_flight import CERTIFIED, NOT_ALL_CERTIFIED, NOT_CERTIFIED, OnlineFlight
from ltlplan.online.segments.certified_team import CertifiedTeam
from ltlplan.online_mtac.initial_allocation import NEEDS_WAITS
from ltlplan.online_mtac.online_team import OnlineTeam
from ltlplan.online_mtac.team_in_flight import PERIOD, Desired
from ltlplan.planner import with_seed
from verify.data import BadInput, Formula, InternalError, Letter, Mission, Unsatisfiable, check_mission
from verify.data.events import NewFormula, ObstacleAppears, RobotJoins, RobotLeaves, WorldEvent
from verify.data.language.word import stutter_free
from verify.data.progress import Progress
from verify.data.sections import Robot
from verify.data.shapes.inequalities import Point
from verify.model_checking.timeline import InternalChange

Floats = NDArray[np.float64]

SINK = 0.5
"""m/s at which a robot that fails or leaves comes down."""

FLOOR = 0.02
"""m; where it stays."""


Led = OnlineTeam | CertifiedTeam
"""What says where robots should be; of both the loop uses what a `TeamInFlight` has, and what was proved of a certified one."""


# as many parameters as `ltlplan online` has choices: each may be made alone, by its keyword
def fly_online(
    mission: Mission,
    *,
    seed: int | None = None,
    certified: bool = False,
    events: Iterable[WorldEvent] = (),
    conditions: Conditions = CALM,
    max_seconds: float = 300.0,
    progress: Progress | None = None,
    **changes: Unpack[ConditionKeywords],
) -> OnlineFlight:
    """Fly a mission online in simulation and judge what was flown.

    Args:
        mission: What is asked.
        seed: Of every random number, the simulation's too; None takes the mission's own.
        certified: Hand each robot only pieces that are certified for what is left of the formula.
        events: What changes during the flight.
        conditions: Wind, sensors, model, controller and airframe, as `flight.fly` takes them.
        max_seconds: Longest flight, s.
        progress: Receives a sentence and the share done, 0 to 1.
        changes: Some of the conditions as keywords, `noise=0.001` for instance.

    Returns:
        The flight with its verdict; `require()` raises where that is not *holds*.

    Raises:
        BadInput: An event cannot be, N <= 1 / rho, the trace is infinite, or certified pieces are asked for at a margin of 0.
        Unsatisfiable: Nothing that these robots can fly satisfies the formula, at take-off already.
        Infeasible: No way between the hoops was found at take-off.
    """
    conditions = conditions.changed(**changes)
    mission = with_seed(check_mission(mission), seed)
    used_seed = mission.planner.seed
    if not 0 < max_seconds <= 3600:
        raise BadInput(f"max_seconds must be above 0 and at most 3600, not {max_seconds:g}.")
    if certified:
        require_tube(mission.margin)
    ordered = in_order(mission, events)
    if not certified and (mission.obstacles or any(isinstance(event, ObstacleAppears) for event in ordered)):
        raise BadInput(
            "Reassigning tasks in flight without certified segments follows paths that are checked against rings and regions at samples, and "
            "against nothing solid; fly among obstacles with `certified=True` (`ltlplan online MISSION --certified`), where each piece and "
            "each way of braking from it is proved clear of them before it is flown."
        )
    if not certified and (timed := next(_timed_parts(mission, ordered), None)) is not None:
        raise BadInput(
            f"`{timed}` is bounded in seconds, and reassigning tasks in flight without certified segments plans no times; fly it with "
            "`certified=True` (`ltlplan online MISSION --certified`)."
        )
    try:
        if certified:
            team: Led = CertifiedTeam(mission, seed=used_seed)
        else:
            team = OnlineTeam(mission, rng=np.random.default_rng(used_seed))
    except Unsatisfiable:
        from ltlplan.search.exact import assign

        if assign(mission).precedences:  # or it says which parts cannot hold together
            raise Unsatisfiable(NEEDS_WAITS) from None
        raise
    loop = _Loop(mission, team, ordered)
    return loop.fly(used_seed, conditions, max_seconds, progress)


def _timed_parts(mission: Mission, events: Iterable[WorldEvent]) -> Iterator[Formula]:
    """Yield conjuncts that are bounded in seconds, of a mission and of formulas that come in flight."""
    yield from mission.timed_parts
    for event in events:
        if isinstance(event, NewFormula):
            yield from event.apply(mission).timed_parts


@dataclass
class _Loop:
    """One flight while it happens: events when they are due, one step of the team before each command."""

    mission: Mission
    team: Led
    pending: tuple[WorldEvent, ...]
    now: float = 0.0
    entries: list[Snapshot] = field(default_factory=list)
    desired: list[Floats] = field(default_factory=list)
    letters: list[dict[str, Letter]] = field(default_factory=list)
    actions: dict[str, list[InternalChange]] = field(default_factory=dict)
    internal: dict[str, str] = field(default_factory=dict)
    landed: dict[str, tuple[float, Point, Letter]] = field(default_factory=dict)
    said: list[Event] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    earlier: list[tuple[float, Mission]] = field(default_factory=list)
    happened: list[WorldEvent] = field(default_factory=list)
    satisfied_at: float | None = None
    held_since: float | None = None
    holding: str | None = None
    refused: bool = False
    over: bool = False

    def fly(self, seed: int, conditions: Conditions, max_seconds: float, progress: Progress | None) -> OnlineFlight:
        """Fly until the formula is satisfied and everybody has come to rest, until it cannot be, or to the time limit."""
        joining = {event.robot: event.agent for event in self.pending if isinstance(event, RobotJoins)}
        self.agents = {**self.mission.agents, **joining}
        self.robots = tuple(self.agents)
        self.internal = {name: agent.internal or self._system(name).initial for name, agent in self.agents.items()}
        self.planned_cost = self.team.cost
        self.ticks = int(np.ceil(max_seconds / CONTROL_STEP))
        self.start = np.array([(*agent.start, agent.yaw) for agent in self.agents.values()]).T
        airframes = tuple(
            conditions.airframe or airframe_in(self.mission, agent.vehicle or self.mission.vehicle)
            for agent in self.agents.values()
        )
        setup = Setup(airframes, self, conditions)
        for entry in steps(setup, [seed]):
            self._record(entry)
            if progress is not None and len(self.entries) % 100 == 0:
                progress(f"flying online, {self.now:.0f} s", min(0.99, self.now / max_seconds))
            if self.over:
                break
        return self._result(seed)

    def planned(self, step: int) -> None:
        """Do nothing: no planned position exists between two commands."""

    def wanted(self, tick: int) -> Floats:
        """Do one step of online MTAC-E and return what every robot should do. Shape (5, 4, robots)."""
        self.now = tick * PERIOD
        positions = self._positions()
        while self.pending and self.pending[0].time <= self.now + 1e-9:
            event, self.pending = self.pending[0], self.pending[1:]
            self._happens(event, positions)
        flat = np.zeros((5, 4, len(self.robots)))
        flat[0] = self.start
        if self.team.pilots:
            begun = time.perf_counter()
            desired = self.team.step(self.now, {name: positions[name] for name in self.team.pilots})
            self.seconds.append(time.perf_counter() - begun)
            for j, name in enumerate(self.team.pilots):
                flat[:, :, self.robots.index(name)] = desired.flat[:, :, j]
            self._take_note(desired)
        else:
            self.held_since = self.now if self.held_since is None else self.held_since
        for name, (when, at, _) in self.landed.items():
            height = max(at[2] - SINK * (self.now - when), FLOOR)
            flat[0, :3, self.robots.index(name)] = (at[0], at[1], height)
        if self.held_since is not None and self.now - self.held_since > GIVE_UP and not self.pending:
            self.over = True
        self.desired.append(flat[0, :3])
        return flat

    def _take_note(self, desired: Desired) -> None:
        """Write down what this step changed: actions, hand-overs, satisfaction, waiting."""
        for name, pilot in self.team.pilots.items():
            if pilot.where.internal != self.internal[name]:
                self._acted(name, pilot.where.internal, pilot.where.inside)
        self.said += [Event(self.now, None, "reaction", sentence) for sentence in desired.switched]
        if desired.satisfied and self.satisfied_at is None:
            self.satisfied_at = self.now
            self.said.append(Event(self.now, None, "formula", f"The formula is satisfied after {self.now:.2f} s."))
        if not desired.satisfied:
            self.satisfied_at = None
        if desired.holding is None or (isinstance(self.team, CertifiedTeam) and not self.team.ended):
            self.held_since = None
        elif self.held_since is None:
            self.held_since = self.now
        if desired.holding is not None and desired.holding != self.holding:
            self.said.append(Event(self.now, None, "reaction", desired.holding))
        self.holding = desired.holding
        if desired.finished and not self.pending:
            self.over = True

    def _acted(self, name: str, target: str, inside: frozenset[str]) -> None:
        source, self.internal[name] = self.internal[name], target
        system = self._system(name)
        region = next((a.at for a in system.actions if (a.source, a.target) == (source, target) and a.at in inside), "")
        propositions = frozenset(system.states[target])
        done = self.actions.setdefault(name, [])
        done.append(InternalChange(on_grid(self.now), source, target, region, len(done), propositions))

    def _system(self, name: str) -> Robot:
        """Return the internal states of a robot that flies, or is to join."""
        kind = self.agents[name].robot
        return self.mission.robot if kind is None else (self.mission.robots or {})[kind]

    def _happens(self, event: WorldEvent, positions: Mapping[str, Point]) -> None:
        """Let the world change; a hoop on a robot ends the mission in a hover."""
        flying = {name: positions[name] for name in self.team.pilots}
        trouble = falls_on(self.team.mission, event, flying)
        self.said.append(Event(self.now, getattr(event, "robot", None), "note", f"{event}."))
        if isinstance(event, RobotLeaves):
            # from the very first moment on, what was seen last
            letter = self.letters[-1][event.robot] if self.letters else self.team.belief.held[event.robot]
            self.landed[event.robot] = (self.now, positions[event.robot], letter)
        self.earlier.append((self.now, self.team.mission))
        self.happened.append(replace(event, time=self.now))
        self.team.change(event, self.now)
        self.satisfied_at = None
        if trouble is not None or self.refused:
            self.refused = True
            self.team.give_up(trouble or "The robots hold their positions.")

    def _positions(self) -> dict[str, Point]:
        """Return every robot's last known position: by motion capture, or where that lost it by the robot's own estimate."""
        if not self.entries:
            return {name: agent.start for name, agent in self.agents.items()}
        last = self.entries[-1]
        seen = last.estimated if last.measured is None else np.where(np.isnan(last.measured), last.estimated, last.measured)
        if last.measured is None:
            seen = last.position
        return {name: tuple(float(x) for x in seen[:, j]) for j, name in enumerate(self.robots)}  # pyright: ignore[reportReturnType]  # three numbers

    def _record(self, entry: Snapshot) -> None:
        """Label one entry of the log by where the robots really are, in the world as it is now."""
        self.entries.append(entry)
        letters: dict[str, Letter] = {}
        for j, name in enumerate(self.robots):
            if name in self.landed:
                _, _, letters[name] = self.landed[name]
                continue
            held = frozenset(self._system(name).states[self.internal[name]])
            here = [
                region
                for region, shape in self.team.mission.all_regions.items()
                if float(shape.level(entry.position[:, j])) <= 1.0
            ]
            letters[name] = held.union(here)
        self.letters.append(letters)

    def _result(self, seed: int) -> OnlineFlight:
        mission = self.team.mission
        times = np.array([entry.step for entry in self.entries]) * STEP
        timelines = {
            name: seen_timeline(mission, name, times, [row[name] for row in self.letters], self.actions.get(name, ()))
            for name in mission.agents
        }
        verdict = judged_words(mission, timelines)
        frames = np.minimum((np.array([e.step for e in self.entries]) // SUBSTEPS), len(self.desired) - 1)
        position = np.array([entry.position for entry in self.entries]).transpose(0, 2, 1)
        wanted = np.array(self.desired)[frames].transpose(0, 2, 1)
        first = self.entries[0]
        proved = self.team if isinstance(self.team, CertifiedTeam) else None
        lost = None if proved is None else proved.lost
        note = NOT_CERTIFIED if proved is None else CERTIFIED if lost is None else f"{NOT_ALL_CERTIFIED} {lost}"
        self.said.append(
            Event(float(times[-1]), None, "formula", f"Verdict on the flown words: {verdict.outcome}. {verdict.sentence}")
        )
        log = FlightLog(
            mission=mission.name,
            robots=self.robots,
            times=times,
            position=position,
            velocity=np.array([entry.velocity for entry in self.entries]).transpose(0, 2, 1),
            attitude=np.array([euler(entry.attitude) for entry in self.entries]).transpose(0, 2, 1),
            thrust=np.array([entry.thrust for entry in self.entries]),
            rates=np.array([entry.rates for entry in self.entries]).transpose(0, 2, 1),
            error=np.linalg.norm(position - wanted, axis=2),
            letters=tuple(tuple(row[name] for name in self.robots) for row in self.letters),
            measured=_rows([entry.measured for entry in self.entries]) if first.measured is not None else None,
            estimated=_rows([entry.estimated for entry in self.entries]) if first.measured is not None else None,
            events=(Event(0.0, None, "note", note), *self.said),
            satisfied=None if verdict.outcome == "undecided" else bool(verdict),
            seed=seed,
            notes=(note,),
        )
        words = {name: stutter_free([row[name] for row in self.letters]) for name in self.robots}
        return OnlineFlight(
            mission, log, verdict, float(times[-1]), self.satisfied_at, self.planned_cost, self.team.cost,
            np.array(self.seconds), words, proved is not None and lost is None,
            () if proved is None else proved.certificates, () if proved is None else proved.all_pieces, tuple(self.earlier),
            tuple(self.happened),
        )  # fmt: skip


def _rows(values: list[Floats | None]) -> Floats:
    if any(value is None for value in values):
        raise InternalError("Every entry of a log has the same parts.")
    return np.array(values).transpose(0, 2, 1)
