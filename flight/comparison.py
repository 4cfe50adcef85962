"""Hold a flight against its certificate: how far from the plan it was, and whether the certificate covers it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flight.certificate_checks import certified_mission
from flight.logs.log import Event, FlightLog
from flight.logs.own_logs import as_recording
from flight.logs.placed import samples_of
from flight.logs.recordings import Recording
from flight.model.attitude import Floats
from flight.model.reference import flown
from flight.monitoring.formula_state import FormulaVerdict
from flight.monitoring.letters import certified_actions
from flight.monitoring.monitor import Monitor
from flight.monitoring.tube import TubeVerdict, relative_acceleration
from verify.certificate import Certificate
from verify.data import BadInput, Letter, Mission, NotCertified, Plan, Trajectory, check_trajectories
from verify.recordings.flight_log import Samples
from verify.recordings.flight_reference import FlightReference
from verify.recordings.flight_verdict import FlightVerdict, check_flight

LONGEST_GAP = 1.0
"""s between two samples, from which on a log has a hole rather than a rate."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """A flight beside its certificate.

    Attributes:
        robots: Names.
        margin: delta, m.
        worst_error: Each robot's largest distance from the plan at a sample, m.
        worst_time: When, s.
        rms_error: Root mean square of it, m.
        bound: Each robot's largest distance that cannot be ruled out at any time, samples or not, m.
        tube: `inside` only where every robot is proved to have stayed in its tube at every time.
        formula: State of the formula on the sampled path.
        closest: Least distance between two robots at a sample, m, and who; None for one robot.
        events: What a monitor says of it, in order.
        judged: Every claim of the certificate's paths, compared with the flight; None without the trajectories.
    """

    robots: tuple[str, ...]
    margin: float
    worst_error: dict[str, float]
    worst_time: dict[str, float]
    rms_error: dict[str, float]
    bound: dict[str, float]
    tube: TubeVerdict
    formula: FormulaVerdict
    closest: tuple[float, str, str] | None
    events: tuple[Event, ...]
    judged: FlightVerdict | None = None

    @property
    def covered(self) -> bool:
        """True if the certificate covers this flight."""
        return self.tube == "inside"

    @property
    def sentences(self) -> tuple[str, ...]:
        """The results, a sentence each."""
        errors = tuple(
            f"{name}: worst {1000 * self.worst_error[name]:.1f} mm at {self.worst_time[name]:.2f} s, "
            f"RMS {1000 * self.rms_error[name]:.1f} mm, margin {1000 * self.margin:.1f} mm."
            for name in self.robots
        )
        return (*errors, *(f"{event.time:.2f} s: {event.sentence}" for event in self.events))


# as many parameters as a recording may need to be told of; each may be given alone, by its keyword
def compare(
    log: FlightLog | Recording,
    cert: Certificate | None,
    team: Mapping[str, Trajectory] | None = None,
    *,
    plan: Plan | None = None,
    measurement: float = 0.0,
    max_speed: float | None = None,
    start: float | None = None,
) -> Comparison:
    """Hold a simulated, logged or recorded flight against a certificate: `verify.check_flight`, with figures for a person.

    Args:
        log: The flight, in whatever frame it is; of a FlightLog the positions are taken as measured.
        cert: The certificate.
        team: The certified trajectories. A FlightLog can do without, by the errors that it holds; then only the tube is checked,
            and pieces are taken to be longer than the gaps between samples.
        plan: The plan, so that visits and passages are checked too.
        measurement: Bound on a measured position's error, m.
        max_speed: Bound on every robot's speed, m/s; None takes what the vehicle's rotors allow between the samples, which bound the
            acceleration.
        start: When the flight began on the log's clock, s. None takes what the log says; of a recording that does not say it, one start for
            the whole team is fitted to the plan.

    Raises:
        BadInput: Other robots, units that cannot be metres and seconds, holes, too short a flight, or a recording
            without a team.
        NotCertified: The certificate does not cover the team.
    """
    if cert is None:
        raise NotCertified("there is no certificate to compare with.")
    mission = certified_mission(cert)
    team = None if team is None else check_trajectories(team)
    if set(log.robots) != set(mission.agents):
        raise BadInput(f"the log has robots {', '.join(log.robots)}; the mission has {', '.join(mission.agents)}.")
    if not (np.isfinite(measurement) and measurement >= 0):
        raise BadInput(f"measurement must be 0 m or more, not {measurement}.")
    if team is not None and not cert.covers(team):
        raise NotCertified("the certificate does not cover these trajectories.")
    order = [log.robots.index(name) for name in mission.agents]
    found = as_recording(log) if isinstance(log, FlightLog) else log
    samples = samples_of(found, mission, _internal(log))
    begins = found.begins if start is None else (start, start)
    position = np.stack([samples.positions[name] for name in mission.agents], axis=1)
    shortest, longest = _durations(cert, mission, team)
    shift = 0.0 if begins is None else begins[0] / 2 + begins[1] / 2
    _require_sense(log.times - shift, shortest, longest)
    judged = None
    if team is not None:
        asked = FlightReference.of_certificate(cert, team, plan)
        judged = _judged(samples, asked, measurement=measurement, max_speed=max_speed, begins=begins)
        shift = shift if judged.alignment.fitted is None else judged.alignment.fitted
    times = log.times - shift
    errors = _errors(log, order, position, times, mission, team)
    monitor = Monitor(
        mission,
        certified_actions(cert, team),
        margin=float(cert.margin) if judged is None else None,
        measurement=measurement,
        planned_acceleration=max(mission.limits_of(robot).acceleration for robot in mission.agents),
    )
    for time, place, off in zip(times.tolist(), position, errors, strict=True):
        monitor.see_errors(time, place.T, off)
    monitor.finish(shortest)
    seen = np.where(np.isnan(errors), -1.0, errors)
    names = tuple(mission.agents)
    tube, bound, said = (monitor.tube, monitor.bounds, ()) if judged is None else _tube(judged, float(cert.margin))
    assert tube is not None, "a certificate gives the monitor a tube"
    return Comparison(
        robots=names,
        margin=float(cert.margin),
        worst_error={name: float(np.max(seen[:, j])) for j, name in enumerate(names)},
        worst_time={name: float(times[np.argmax(seen[:, j])]) for j, name in enumerate(names)},
        rms_error={name: float(np.sqrt(np.nanmean(errors[:, j] ** 2))) for j, name in enumerate(names)},
        bound=bound,
        tube=tube,
        formula=monitor.formula,
        closest=monitor.closest,
        events=(*monitor.events, *said),
        judged=judged,
    )


def _durations(cert: Certificate, mission: Mission, team: Mapping[str, Trajectory] | None) -> tuple[float, float]:
    """Return how long the flight lasts at least and at most, s."""
    if team is not None:
        shortest = max(path.duration for path in flown(mission, team).values())
        return shortest, shortest
    shortest = float(cert.duration)
    return shortest, shortest * mission.spec.repeat  # how much of it is the lap is not known without the trajectories


def _internal(log: FlightLog | Recording) -> dict[str, list[Letter]] | None:
    """Return each robot's letters, where the log has them."""
    if isinstance(log, Recording):
        return None
    return {name: [row[column] for row in log.letters] for column, name in enumerate(log.robots)}


def _judged(
    samples: Samples, asked: FlightReference, *, measurement: float, max_speed: float | None, begins: tuple[float, float] | None
) -> FlightVerdict:
    """Let the checker judge the flight."""
    mission = asked.mission
    push = max(relative_acceleration(mission.vehicle_of(robot), 0.0) for robot in mission.agents)

    def judged(speed: float) -> FlightVerdict:
        return check_flight(samples, asked, max_speed=speed, max_acceleration=push, error=measurement, start=begins)

    if max_speed is not None:
        return judged(max_speed)
    whole, end = measurement + samples.rounding[1], max(path.duration for path in flown(mission, asked.team or {}).values())
    low, high = begins or (float(samples.times[0]),) * 2
    speed = _fastest(samples, push, whole, low, high + end)
    for _ in range(_ROUNDS):
        if not np.isfinite(speed):
            break
        verdict = judged(speed)
        needed = _fastest(samples, push, whole, verdict.alignment.low, verdict.alignment.high + end)
        if needed <= speed:
            return verdict
        speed = needed * 1.001  # a fitted start left more of the flight unseen
    raise BadInput(
        "no bound on the robots' speed can be had of these samples and the digits of their times; give max_speed, in m/s."
    )


_ROUNDS = 5
"""How often a bound on the speed is made anew for the start that was fitted with it."""


def _fastest(samples: Samples, push: float, error: float, start: float, stop: float) -> float:
    """Bound the robots' speed from `start` to `stop`, m/s.

    On average it is what a robot's samples show, as far as their places and times are known; at any time between them it is off that
    by at most the acceleration that the rotors can give, `push`, times the gap. Where a robot was not seen at an end, likewise.
    """
    late, fastest = samples.rounding[0], 0.0
    for places in samples.positions.values():
        seen = ~np.isnan(places).any(axis=1)
        times, steps = samples.times[seen], np.linalg.norm(np.diff(places[seen], axis=0), axis=1)
        if len(times) == 1:
            return np.inf
        if not len(times):
            continue  # refused in words where the flight is checked
        shortest, longest = np.diff(times) - 2 * late, np.diff(times) + 2 * late
        moved = np.divide(steps + 2 * error, shortest, out=np.full(len(steps), np.inf), where=shortest > 0)
        beyond = max(float(times[0]) - start, stop - float(times[-1]), 0.0)
        fastest = max(fastest, float(np.max(moved + push * longest)) + push * beyond)
    return fastest * (1 + 1e-9)


def _tube(judged: FlightVerdict, margin: float) -> tuple[TubeVerdict, dict[str, float], tuple[Event, ...]]:
    """Return the team's tube, each robot's bound, m, and what is to be said of both."""
    claims = [claim for claim in judged.claims if claim.name == "tube"]
    bound = {str(claim.robot): math.inf if claim.bound is None else claim.bound for claim in claims}
    refused = tuple(
        Event(claim.time or 0.0, claim.robot, "tube", claim.sentence) for claim in claims if claim.outcome != "holds"
    )
    if refused:
        outside = any(claim.outcome == "fails" for claim in claims)
        return "outside" if outside else "unknown", bound, refused
    sentence = (
        f"every robot stayed within {max(bound.values()):.4f} m of its plan at every time, inside the tube of {margin:g} m: the "
        "certificate covers this flight."
    )
    return "inside", bound, (Event(max(claim.time or 0.0 for claim in claims), None, "tube", sentence),)


def _errors(
    log: FlightLog | Recording,
    order: list[int],
    position: Floats,
    times: Floats,
    mission: Mission,
    team: Mapping[str, Trajectory] | None,
) -> Floats:
    """Return each robot's distance from the plan at each sample, m. Shape (samples, robots)."""
    if team is not None:
        paths = flown(mission, team)
        planned = np.stack([path.evaluate(np.maximum(times, 0.0))[:, :3] for path in paths.values()], axis=1)
        return np.linalg.norm(position - planned, axis=2)
    if isinstance(log, FlightLog):
        return log.error[:, order]
    raise BadInput("a recording does not know the plan; pass the team's trajectories as well.")


def _require_sense(times: Floats, duration: float, longest: float) -> None:
    """Reject a log whose times cannot be this flight's in seconds."""
    span = float(times[-1] - times[0])
    if span > 50.0 * max(longest, 1.0):
        raise BadInput(
            f"the log lasts {span:g} where the flight lasts {duration:g} s; are its times in ms or us? Give them in s."
        )
    if span < 0.02 * duration:
        raise BadInput(f"the log lasts {span:g} s where the flight lasts {duration:g} s; are its times in other units than s?")
    gaps = np.diff(times)
    worst = int(np.argmax(gaps)) if len(gaps) else 0
    if len(gaps) and gaps[worst] > LONGEST_GAP:
        raise BadInput(
            f"the log has a gap of {gaps[worst]:.3g} s after {times[worst]:.3f} s; at most {LONGEST_GAP:g} s is accepted."
        )
    if times[0] > LONGEST_GAP:
        raise BadInput(f"the log begins {times[0]:.3g} s after the flight; its times count from the flight's start.")
    if times[-1] < duration - LONGEST_GAP:
        raise BadInput(f"the log ends at {times[-1]:.3f} s, before the flight does at {duration:.3f} s.")
