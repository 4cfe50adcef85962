"""Simulated flights, recorded with bounded noise and drop-outs: the judge of recordings held against what the simulator knows.

Each flight is flown in its own wind, by one of several controllers, late and with noise, so that many leave their tubes. What is
recorded of it is off by at most what the judge is told: in position (also leant towards the plan, which hides most), in time, with
frames and whole stretches lost, with climb and landing around it or without, on one clock or on each robot's own, from starts that are off. Truth is looked at by plain means of its own.
"""

from __future__ import annotations

import csv
import io
import tempfile
from collections import Counter
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

import flight
from flight import RecordingOptions, read_flown
from flight.closed_loop import Setup, steps
from flight.logs.placed import samples_of
from flight.model.airframe import airframes_of
from flight.model.disturbances import Wind
from flight.model.reference import flown, sample_reference
from flight.model.sensing import MotionCapture
from flight.model.timing import CONTROL_STEP, SUBSTEPS
from flight.monitoring.formula_state import FormulaState
from tests.helpers.live.foreign_logs import crazyflie
from tests.helpers.live.recordings import fires, gates
from tests.helpers.motion.flights import legs, plan_of, small_mission
from verify import Certificate, FlightReference, FlightVerdict, certify, check_flight
from verify.data import Mission, Plan, Trajectory
from verify.data.plan import Visit

Made = tuple[Plan, dict[str, Trajectory], Certificate]
FRAME = 0.01
"""s between the truth's entries."""
CONTROLLERS = ("geometric", "mellinger", "lee")


@cache
def passing() -> Made:
    """Two robots that pass each other as near as their margins allow, one of them along a wall; certified."""
    mission = small_mission(
        "F a & F b & G !(c)",
        regions="a: {center: [1.6, 0.0, 1.0], radii: [0.15, 0.15, 0.15]}\nb: {center: [-0.1, 0.42, 1.0], radii: [0.15, 0.15, 0.15]}\n"
        "c: {center: [0.8, -0.2, 1.22], radii: [0.12, 0.12, 0.12]}",
        starts=((0.0, 0.0, 1.0), (1.5, 0.42, 1.0)),
        margin=0.05,
        extra="separation: 0.31",
    )
    mission = mission.model_copy(
        update={"workspace": mission.workspace.model_copy(update={"min": (-1.0, -1.0, 0.2), "max": (2.5, 0.48, 2.0)})}
    )
    plan = plan_of(mission, {"r0": (Visit(region="a"),), "r1": (Visit(region="b"),)})
    team = {"r0": legs([(0.0, 0.0, 1.0), (1.6, 0.0, 1.0)]), "r1": legs([(1.5, 0.42, 1.0), (-0.1, 0.42, 1.0)])}
    return plan, team, certify(plan, team)


FLIGHTS = (fires, gates, passing)


@dataclass(frozen=True, eq=False)
class Truth:
    """What happened: positions every 10 ms, and the largest error at any step of the simulation."""

    times: np.ndarray
    places: dict[str, np.ndarray]
    peaks: dict[str, float]

    @property
    def fastest(self) -> float:
        """Greatest speed from one entry to the next, m/s."""
        return max(float(np.linalg.norm(np.diff(p, axis=0), axis=1).max()) / FRAME for p in self.places.values())


@dataclass
class Tally:
    """What was found of many flights."""

    outcomes: Counter = field(default_factory=Counter)
    untold: Counter = field(default_factory=Counter)
    left: int = 0
    broken: Counter = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)

    @property
    def flights(self) -> int:
        return sum(self.outcomes.values())

    @property
    def said(self) -> str:
        """What was found so far, in a line."""
        said = ", ".join(f"{count} {name}" for name, count in sorted(self.outcomes.items()))
        truly, untold = (
            ", ".join(f"{name} {count}" for name, count in kept.most_common()) for kept in (self.broken, self.untold)
        )
        return f"{self.flights} flights: {said}; truly broken: {truly}; {len(self.faults)} wrong. Cannot tell: {untold}."


def fly_many(made: Made, seeds: range, rng: np.random.Generator) -> list[Truth]:
    """Fly a plan in a wind and with sensors that are drawn once, with many seeds."""
    plan, team, _ = made
    mission = plan.mission
    reference = sample_reference(flown(mission, team), CONTROL_STEP, SUBSTEPS, onward=flown(mission, team, more_laps=1))
    turn, speed = rng.uniform(0, 2 * np.pi), rng.choice([0.0, 0.05, 0.1, 0.2, 0.4])
    conditions = flight.Conditions(
        wind=Wind((float(speed * np.cos(turn)), float(speed * np.sin(turn)), 0.0), float(rng.choice([0.0, 0.2, 0.6]))),
        noise=MotionCapture(noise=float(rng.choice([0.0005, 0.001, 0.004])), delay=float(rng.choice([0.005, 0.015, 0.03]))),
        controller=str(rng.choice(CONTROLLERS)),
    )
    entries = list(steps(Setup(airframes_of(mission, mission.agents), reference, conditions), seeds))
    robots, runs = reference.robots, len(seeds)
    places = np.array([entry.position.reshape(3, runs, len(robots)) for entry in entries], dtype=float)
    peaks = np.asarray(entries[-1].peak, dtype=float).reshape(runs, len(robots))
    times = np.arange(len(entries)) * FRAME
    return [
        Truth(
            times,
            {name: places[:, :, run, j] for j, name in enumerate(robots)},
            {name: float(peaks[run, j]) for j, name in enumerate(robots)},
        )
        for run in range(runs)
    ]


# -- truth -----------------------------------------------------------------------------------------------------------


def broken_claims(made: Made, truth: Truth) -> set[str]:
    """Return which claims the truth breaks, looked at every 10 ms by plain means."""
    plan, _, certificate = made
    mission, end = plan.mission, certificate.duration
    inside = truth.times <= end
    places = {name: path[inside] for name, path in truth.places.items()}
    found = {"tube"} if max(truth.peaks.values()) > certificate.margin else set[str]()
    low, high = np.array(mission.workspace.min), np.array(mission.workspace.max)
    if any(np.any((path < low) | (path > high)) for path in places.values()):
        found.add("workspace")
    names = list(places)
    for i, one in enumerate(names):
        for other in names[i + 1 :]:
            if np.linalg.norm(places[one] - places[other], axis=1).min() < mission.least_distance(one, other):
                found.add("separation")
    for name, path in places.items():
        radius = mission.vehicle_of(name).radius
        if any(_touches(hoop, path, radius) for hoop in mission.hoops.values()):
            found.add("rims")
    for action in certificate.actions:
        region = mission.all_regions[plan.robots[action.robot].visits[action.visit].region]
        at = [np.interp(float(action.time), truth.times, axis) for axis in truth.places[action.robot].T]
        if region.level(np.array(at)) > 1 + 0.02:
            found.add("actions")
    if mission.spec.formula is not None and not _satisfied(made, places, truth.times[inside]):
        found.add("formula")
    return found


def _touches(hoop, path: np.ndarray, radius: float) -> bool:
    offset = path - np.array(hoop.center)
    along = offset @ np.array(hoop.normal)
    out = np.sqrt(np.maximum((offset**2).sum(axis=1) - along**2, 0.0))
    beside = np.maximum(np.maximum(hoop.opening - out, out - hoop.opening - hoop.rim), 0.0)
    return bool(np.any(np.hypot(beside, np.maximum(np.abs(along) - hoop.rim / 2, 0.0)) < radius))


def _satisfied(made: Made, places: dict[str, np.ndarray], times: np.ndarray) -> bool:
    """Judge the word of the truth's entries as the monitor does."""
    plan, _, certificate = made
    mission = plan.mission
    names = list(mission.agents)
    inner = {name: [mission.initial_letter(name)] * len(times) for name in names}
    for action in sorted(certificate.actions, key=lambda action: action.time):
        letter = frozenset(mission.robot_of(action.robot).states[action.target])
        inner[action.robot] = [
            letter if time >= action.time else old for time, old in zip(times, inner[action.robot], strict=True)
        ]
    levels = {
        name: {region: body.level(path) <= 1 for region, body in mission.all_regions.items()} for name, path in places.items()
    }

    def letters(k: int) -> list[frozenset[str]]:
        return [frozenset(region for region, row in levels[name].items() if row[k]) | inner[name][k] for name in names]

    state = FormulaState(mission.formula, mission.spec.team, letters(0), names)
    before = letters(0)
    for k in range(1, len(times)):
        now = letters(k)
        changed = {j: letter for j, letter in enumerate(now) if letter != before[j]}
        if changed:
            state.change(changed)
        before = now
    return state.end(finite=True) == "satisfied"


# -- recordings ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Tape:
    """A recording, and what the judge is told of it."""

    files: dict[str, str]
    told: RecordingOptions
    error: float
    speed: float


def record(truth: Truth, plans: dict[str, np.ndarray], end: float, rng: np.random.Generator) -> Tape:
    """Record a flight with bounded faults of every kind.

    Args:
        truth: What happened.
        plans: Where robots should have been at the truth's times.
        end: When the plan ends, s.
        rng: Draws the faults.
    """
    bound, late = float(rng.choice([0.0, 0.0005, 0.002, 0.006])), float(rng.choice([0.0, 0.0, 0.001, 0.003]))
    speed = truth.fastest * 1.03 + 0.02
    around = bool(rng.random() < 0.5)
    times, places = _with_ways(truth) if around else (truth.times, truth.places)
    shift = float(rng.integers(0, 2_000_000_000)) if rng.random() < 0.5 else 0.0
    known = around or rng.random() < 0.5
    lost = float(rng.choice([0.0, 0.02, 0.2]))
    kept = (rng.random(len(times)) >= lost) & (np.arange(len(times)) % int(rng.choice([1, 2, 4, 4, 8])) == 0)
    kept[[0, -1]] = True
    if not known:
        kept[times == 0.0] = True
    stamps = times + rng.uniform(-late, late, len(times)) * (np.arange(len(times)) > 0)
    lean = rng.choice(["any", "edge", "plan", "constant"])
    rows: dict[str, np.ndarray] = {}
    for name, path in places.items():
        aim = np.array([np.interp(np.clip(times, 0, end), truth.times, axis) for axis in plans[name].T]).T
        seen = path + bound * (1 - 1e-6) * _noise(path, aim, str(lean), rng)
        hidden = rng.random(len(times)) < lost / 2
        for _ in range(int(rng.integers(0, 3)) if rng.random() < 0.3 else 0):
            begin = int(rng.integers(0, len(times)))
            hidden[begin : begin + int(rng.integers(2, 30))] = True
        hidden[0] = False
        seen[hidden] = np.nan
        rows[name] = seen
    seen = {name: row[kept] for name, row in rows.items()}
    off = float(rng.choice([0.0, 0.0, 0.002, 0.01])) if known else 0.0
    error = bound + speed * late * 1.0001
    if known and rng.random() < 0.3:
        return Tape(*_by_themselves(stamps[kept], seen, off, rng), error, speed)
    start = shift + float(rng.uniform(-off, off)) if known else None
    text = _written(stamps[kept], seen, shift, long=bool(rng.random() < 0.5))
    return Tape(
        {"recording.csv": text}, RecordingOptions(start=start, start_error=off * 1.0001 + (1e-6 if off else 0.0)), error, speed
    )


def _by_themselves(
    times: np.ndarray, rows: dict[str, np.ndarray], off: float, rng: np.random.Generator
) -> tuple[dict[str, str], RecordingOptions]:
    """Return a log of each robot's own, on a clock of its own, and what is told of them: starts that are off."""
    boots = {name: float(rng.integers(10, 900)) for name in rows}
    files = {f"{name}.csv": crazyflie(times, row, booted=boots[name]) for name, row in rows.items()}
    starts = {name: round(boot + float(rng.uniform(-off, off)), 6) for name, boot in boots.items()}
    return files, RecordingOptions(start=starts, start_error=off * 1.0001 + (1e-6 if off else 0.0))


def _with_ways(truth: Truth) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the flight with a climb of 2 s from the ground before it, and a landing after it."""
    before = np.arange(-200, 0) * FRAME
    after = truth.times[-1] + np.arange(1, 201) * FRAME
    rise, sink = np.linspace(-0.3, 0.0, 200, endpoint=False), np.linspace(0.0, -0.3, 201)[1:]
    up = np.array([0.0, 0.0, 1.0])
    places = {
        name: np.concatenate([path[0] + rise[:, None] * up, path, path[-1] + sink[:, None] * up])
        for name, path in truth.places.items()
    }
    return np.concatenate([before, truth.times, after]), places


def _noise(path: np.ndarray, aim: np.ndarray, lean: str, rng: np.random.Generator) -> np.ndarray:
    """Return vectors no longer than 1: anywhere in the ball, on its edge, towards the plan, or all the same."""
    drawn = rng.normal(size=path.shape)
    drawn /= np.linalg.norm(drawn, axis=1, keepdims=True)
    if lean == "any":
        return drawn * rng.random((len(path), 1)) ** (1 / 3)
    if lean == "edge":
        return drawn
    if lean == "constant":
        return np.repeat(drawn[:1], len(path), axis=0)
    way = aim - path
    return way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)


def _written(times: np.ndarray, rows: dict[str, np.ndarray], shift: float, *, long: bool) -> str:
    """Return the recording as a table: a row a sample and robot, or a row a sample."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")

    def stamp(time: float) -> str:
        nanoseconds = round(time * 1e9) + int(shift) * 10**9
        sign, whole = "-" if nanoseconds < 0 else "", abs(nanoseconds)
        return f"{sign}{whole // 10**9}.{whole % 10**9:09d}"

    def cells(place: np.ndarray) -> list[str]:
        return ["", "", ""] if np.isnan(place[0]) else [f"{value:.7f}" for value in place]

    if long:
        writer.writerow(["t", "robot", "x", "y", "z"])
        for k, time in enumerate(times.tolist()):
            writer.writerows([stamp(time), name, *cells(path[k])] for name, path in rows.items() if not np.isnan(path[k][0]))
        return out.getvalue()
    writer.writerow(["t", *(f"{name}.{axis}" for name in rows for axis in "xyz")])
    for k, time in enumerate(times.tolist()):
        writer.writerow([stamp(time), *(cell for path in rows.values() for cell in cells(path[k]))])
    return out.getvalue()


# -- the judge against the truth ------------------------------------------------------------------------------------


def judge_tape(made: Made, tape: Tape, folder: Path) -> FlightVerdict:
    """Judge a recording as `certify --flight` does, but for the certificate, which was proved once."""
    plan, team, certificate = made
    with tempfile.TemporaryDirectory(dir=folder) as place:
        for name, text in tape.files.items():
            (Path(place) / name).write_text(text)
        path = Path(place) / "recording.csv" if "recording.csv" in tape.files else Path(place)
        found = read_flown(path, tuple(plan.mission.agents), tape.told)
    asked = FlightReference.of_certificate(certificate, team, plan)
    return check_flight(samples_of(found, plan.mission), asked, max_speed=tape.speed, error=tape.error, start=found.begins)


def disagreements(verdict: FlightVerdict, broken: set[str]) -> list[str]:
    """Return where a verdict says what the truth denies."""
    if verdict.outcome == "holds":
        return [f"satisfied, but {name} is broken" for name in sorted(broken)]
    held: dict[str, set[str]] = {}
    for claim in verdict.claims:
        held.setdefault(claim.name, set()).add(claim.outcome)
    told = {"tube", "workspace", "separation", "formula"}
    return [
        f"{name} is said to be broken, and is not"
        for name in sorted(told)
        if "fails" in held.get(name, ()) and name not in broken
    ] + [f"{name} is said to hold, and does not" for name in sorted(told) if held.get(name) == {"holds"} and name in broken]


def campaign(first: int, count: int, folder: Path, *, together: int = 100, say=lambda tally: None) -> Tally:
    """Fly, record and judge many flights.

    Args:
        first: Seed of the first batch.
        count: How many flights, rounded up to whole batches.
        folder: Where recordings are written, one at a time.
        together: Flights of a batch, which share a plan, a wind and a controller.
        say: Told what was found after each batch.
    """
    tally = Tally()
    for batch in range(first, first + -(-count // together)):
        rng = np.random.default_rng([77, batch])
        made: Mission = FLIGHTS[batch % len(FLIGHTS)]()
        _, team, certificate = made
        for k, truth in enumerate(fly_many(made, range(batch * together, (batch + 1) * together), rng)):
            own = np.random.default_rng([78, batch, k])
            plans = {name: team[name].evaluate(np.minimum(truth.times, team[name].duration))[:, :3] for name in team}
            tape = record(truth, plans, certificate.duration, own)
            broken = broken_claims(made, truth)
            verdict = judge_tape(made, tape, folder)
            tally.outcomes[verdict.outcome] += 1
            tally.left += "tube" in broken
            tally.broken.update(broken)
            if verdict.outcome == "undecided":
                tally.untold[verdict.sentence.split("(")[1].split(")")[0]] += 1
            for fault in disagreements(verdict, broken):
                tally.faults.append(f"batch {batch}, flight {k}: {fault}")
        say(tally)
    return tally
