"""One simulated flight of a team, from its plan and trajectories to its log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Unpack

import numpy as np

from flight.certificate_checks import require_certificate
from flight.closed_loop import steps
from flight.conditions import CALM, ConditionKeywords, Conditions
from flight.logs.log import Event, FlightLog
from flight.model.airframe import Airframe, airframes_of
from flight.model.attitude import Floats, euler
from flight.model.reference import Reference, flown, sample_reference
from flight.model.timing import CONTROL_STEP, FRAME_STEPS, STEP, SUBSTEPS
from flight.monitoring.alarm_response import LANDING_TIME, Reaction, Stop
from flight.monitoring.formula_state import has_formula
from flight.monitoring.letters import PlannedAction, RegionMasks, internal_letters, planned_actions, region_letters
from flight.monitoring.monitor import Monitor
from flight.simulation_setup import Setup, Snapshot, not_simulated, require_seed
from verify.certificate import Certificate
from verify.data import BadInput, Mission, Plan, Trajectory, check_plan, check_trajectories
from verify.data.progress import Progress
from verify.recordings.planned_paths import PlannedPath, planned_paths

_NOT_JUDGED = "whether hoops were passed in their order was not judged; `ltlplan certify RUN --flight` does, of the log."


# as many parameters as `ltlplan fly` has choices: each may be made alone, by its keyword
def fly(
    plan: Plan,
    team: Mapping[str, Trajectory],
    cert: Certificate | None = None,
    *,
    seed: int = 0,
    conditions: Conditions = CALM,
    reaction: Reaction | None = None,
    progress: Progress | None = None,
    **changes: Unpack[ConditionKeywords],
) -> FlightLog:
    """Simulate the team's flight in closed loop and return its log.

    Args:
        plan: The plan that the trajectories fly; carries the mission.
        team: One trajectory a robot; a cycle is flown as often as the mission's `repeat` says.
        cert: A certificate of this team; gives the tube's margin and the instants of planned actions. Without one
            the log says that the flight is not certified.
        seed: Of every random number; the same seed gives the same log.
        conditions: Wind, sensors, model, controller and airframe.
        reaction: What the team does when the monitor raises the alarm; the mission's own choice by default.
        progress: Called with a sentence and the share done.
        changes: Some of the conditions as keywords, `wind="1.5+0.4"` for instance, in place of those of `conditions`.

    Raises:
        BadInput: There are no such conditions, plan or trajectories are not sound or do not fit each other, the
            certificate's margin is 0, or what a vehicle's profile says cannot be simulated.
        NotCertified: The certificate is of other trajectories or of another mission.
    """
    conditions = conditions.changed(**changes)
    require_seed(seed)
    plan, team = check_plan(plan), check_trajectories(team)
    mission = plan.mission
    if cert is not None:
        require_certificate(cert, plan, team)
    flight = _Flight(
        mission=mission,
        cert=cert,
        airframes=(conditions.airframe,) if conditions.airframe else airframes_of(mission, mission.agents),
        reference=sample_reference(flown(mission, team), CONTROL_STEP, SUBSTEPS, onward=flown(mission, team, more_laps=1)),
        actions=planned_actions(plan, team, cert),
        paths=planned_paths(mission, team),
        conditions=conditions,
        reaction=mission.reaction if reaction is None else reaction,
        seed=seed,
    )
    watcher = _Watcher(flight)
    setup = Setup(flight.airframes, watcher, conditions)
    entries: list[Snapshot] = []
    count = (len(flight.reference.times) - 1) * SUBSTEPS // FRAME_STEPS
    with np.errstate(all="ignore"):  # who is nowhere any more is named
        for entry in steps(setup, [seed]):
            if not np.isfinite(entry.position).all():
                robot = watcher.robots[int(np.argmin(np.isfinite(entry.position).all(axis=0)))]
                raise not_simulated(robot, mission.vehicle_of(robot), f"at {entry.step * STEP:.2f} s")
            entries.append(entry)
            if watcher.over(entry):
                break
            if progress is not None and len(entries) % 100 == 0:
                progress("simulating the flight", min(len(entries) / (count + 1), 1.0))
    watcher.monitor.finish(flight.reference.duration)
    return _log(flight, watcher, entries)


@dataclass(frozen=True, eq=False, slots=True)
class _Flight:
    """One flight before it happens.

    Attributes:
        mission: Whose formula is watched.
        cert: The certificate, or None.
        airframes: What flies: one for all, or one a robot.
        reference: The plan, sampled.
        actions: When internal states change.
        paths: The plan's paths, with bounds for all times.
        conditions: What it flies in and with.
        reaction: What the team does after an alarm.
        seed: Of every random number.
    """

    mission: Mission
    cert: Certificate | None
    airframes: tuple[Airframe, ...]
    reference: Reference
    actions: tuple[PlannedAction, ...]
    paths: Mapping[str, PlannedPath]
    conditions: Conditions
    reaction: Reaction
    seed: int

    @property
    def margin(self) -> float | None:
        """The tube's radius, m; None without a certificate."""
        return None if self.cert is None else float(self.cert.margin)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes of the log on the flight as a whole."""
        notes: list[str] = [] if self.conditions == CALM else [self.conditions.sentence]
        notes += dict.fromkeys(doubt for airframe in self.airframes if (doubt := airframe.doubt))
        if self.cert is None:
            notes.append(
                "this flight has no certificate; planned actions happen in the middle of their visits on the sampled path."
            )
        return tuple(notes)


class _Watcher:
    """The monitor at work during a simulation, and what the team flies: its plan, and another one after the monitor's alarm."""

    def __init__(self, flight: _Flight) -> None:
        reference, sensor = flight.reference, flight.conditions.noise
        if flight.reaction not in ("carry_on", "hold", "land"):
            raise BadInput(f"reaction must be 'carry_on', 'hold' or 'land', not {flight.reaction!r}.")
        self._mission = flight.mission
        self._reaction: Reaction = flight.reaction
        self._delay = 0 if sensor is None else int(np.ceil(sensor.delay / CONTROL_STEP))
        self._ticks = len(reference.times) - 1
        landing = flight.reaction == "land"
        self.reference = reference.extended(LANDING_TIME, CONTROL_STEP, SUBSTEPS) if landing else reference
        self.monitor = Monitor(
            flight.mission,
            flight.actions,
            margin=flight.margin,
            measurement=0.0 if sensor is None else sensor.bound,
            planned_acceleration=max(path.acceleration for path in flight.paths.values()),
            planned=flight.paths,
        )
        self._alarm: int | None = None
        self._stop: Stop | None = None

    def over(self, entry: Snapshot) -> bool:
        """Let the monitor see one entry of the log; return whether the flight is over."""
        time = entry.step * STEP
        seen = entry.position if entry.measured is None else entry.measured
        self.monitor.see(time, seen, self.reference.fine[entry.step])
        if self._alarm is None and self.monitor.alarmed and self._reaction != "carry_on":
            self._alarm = -(-entry.step // SUBSTEPS) + 1 + self._delay
        last = self._ticks * STEP * SUBSTEPS if self._stop is None else max(self._ticks * STEP * SUBSTEPS, self._stop.end)
        return time >= last - 1e-9

    @property
    def robots(self) -> tuple[str, ...]:
        return self.reference.robots

    @property
    def start(self) -> Floats:
        return self.reference.start

    @property
    def ticks(self) -> int:
        return self.reference.ticks

    def planned(self, step: int) -> Floats:
        return self.reference.planned(step)

    def wanted(self, tick: int) -> Floats:
        """Return the plan, or from the control instant on at which the team reacts to the alarm its way to a stop."""
        if self._alarm is None or tick < self._alarm:
            return self.reference.wanted(tick)
        time = tick * CONTROL_STEP
        if self._stop is None:
            self._stop = Stop(self.reference.flat[tick], time, self._mission, self._reaction)
            what = "hold where they can stop" if self._reaction == "hold" else "stop and land"
            self.monitor.events.append(Event(time, None, "reaction", f"all robots {what}."))
        return self._stop.flat(time)


def _log(flight: _Flight, watcher: _Watcher, entries: list[Snapshot]) -> FlightLog:
    """Put the log together from the simulation's entries and what the monitor said of them."""
    mission, reference, monitor = flight.mission, watcher.reference, watcher.monitor
    steps_taken = np.array([entry.step for entry in entries])
    times, robots = steps_taken * STEP, range(len(reference.robots))
    position = _stacked([entry.position for entry in entries])
    planned = reference.fine[steps_taken].transpose(0, 2, 1)
    table = region_letters(mission)
    regions = RegionMasks(mission)
    masks = [regions.of(position[:, j].T).tolist() for j in robots]
    inner = [internal_letters(mission, robot, flight.actions, times) for robot in reference.robots]
    first, sensed = entries[0], entries[0].measured is not None
    return FlightLog(
        mission=mission.name,
        robots=reference.robots,
        times=times,
        position=position,
        velocity=_stacked([entry.velocity for entry in entries]),
        attitude=_stacked([euler(entry.attitude) for entry in entries]),
        thrust=np.array([entry.thrust for entry in entries]),
        rates=_stacked([entry.rates for entry in entries]),
        error=np.linalg.norm(position - planned, axis=2),
        letters=tuple(tuple(table[masks[j][i]] | inner[j][i] for j in robots) for i in range(len(times))),
        rotors=None if first.rotors is None else _stacked([_known(entry.rotors) for entry in entries]),
        measured=_stacked([_known(entry.measured) for entry in entries]) if sensed else None,
        estimated=_stacked([entry.estimated for entry in entries]) if sensed else None,
        peak=entries[-1].peak,
        margin=flight.margin,
        events=tuple(monitor.events),
        satisfied={"satisfied": True, "violated": False}.get(monitor.formula) if has_formula(mission) else None,
        tube=monitor.tube,
        seed=flight.seed,
        certificate=None if flight.cert is None else flight.cert.digest(),
        controllers=tuple(flight.conditions.follower(mission.vehicle_of(robot)) for robot in reference.robots),
        notes=flight.notes if mission.passages is None or monitor.tube == "inside" else (*flight.notes, _NOT_JUDGED),
    )


def _stacked(values: list[Floats]) -> Floats:
    return np.array(values).transpose(0, 2, 1)


def _known(values: Floats | None) -> Floats:
    assert values is not None, "every entry of a log has the same parts"
    return values
