"""Rehearse a certified flight: by several controllers, with masses, latencies and winds that may be."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np

from flight.certificate_checks import require_certificate
from flight.control.controller import CONTROLLERS
from flight.control.profiles import PROFILES, autopilot_of, controller_name
from flight.model.airframe import DRAGS, Airframe, Drag, airframes_of
from flight.model.attitude import Floats
from flight.model.disturbances import Wind
from flight.model.numbers import is_number
from flight.model.reference import flown, sample_reference
from flight.model.sensing import MotionCapture
from flight.model.timing import CONTROL_STEP, STEP, SUBSTEPS
from flight.monitoring.tube import stray_between_steps
from flight.processes import Processes, Workers, count_of, shared
from flight.rehearsal.batches import Job, worst_errors
from flight.rehearsal.corners import fly_corners
from flight.rehearsal.hunt import hunt, require_wind
from flight.rehearsal.table import Cell, Rehearsal
from flight.simulation_setup import is_whole, require_seed
from verify.certificate import Certificate
from verify.data import BadInput, Mission, Plan, Trajectory, Vehicle, check_plan, check_trajectories
from verify.data.errors import did_you_mean
from verify.data.progress import Progress, part_of, silent
from verify.recordings.planned_paths import planned_paths

_TOGETHER = 2000
"""Vehicles that are flown side by side at most: enough to drown the cost of a call, few enough for the cache."""
MAX_RUNS = 1000
_CORNERED = 4
"""Flights of a corner at most: corners are many, and it is they that matter."""


@dataclass(frozen=True, slots=True)
class Combinations:
    """Combinations that a rehearsal flies.

    Attributes:
        controllers: Names; None for `geometric` and those that the autopilots of all vehicles run.
        masses: Shares of the profile's mass that the vehicles weigh; controllers are told the profile's.
        latencies: s from a frame of motion capture to its use on board.
        winds: m/s, in every form that `Wind.parse` reads.
        drags: Of vehicles whose rotors' drag was not measured: the one that is simulated (`profile`), and the ends of its range (`least`,
            `most`). A team without such a vehicle is flown with the profile's alone.
        corners: Whether the corners of what is not known are flown as well; None: where a vehicle's profile says what that is (`uncertain`).
        hunt: m/s, speed of winds that are made to push robots out of their tubes and are flown as well; None for no hunt.
        profiles: Of vehicles by their names, whose intervals are flown at the corners in place of the mission's own.
    """

    controllers: tuple[str, ...] | None = None
    masses: tuple[float, ...] = (0.95, 1.0, 1.05)
    latencies: tuple[float, ...] = (0.005, 0.015, 0.025)
    winds: tuple[str, ...] = ("0", "0.2+0.1", "0.5+0.3")
    drags: tuple[Drag, ...] = DRAGS
    corners: bool | None = None
    profiles: tuple[Vehicle, ...] = ()
    hunt: float | None = None

    def __post_init__(self) -> None:
        for what, values in (
            ("controllers", self.controllers),
            ("masses", self.masses),
            ("latencies", self.latencies),
            ("winds", self.winds),
            ("drags", self.drags),
        ):
            if values is None:
                continue
            different = {Wind.parse(wind) for wind in self.winds} if values is self.winds else set(values)
            if not values or len(different) < len(values):
                raise BadInput(f"a rehearsal needs at least one of its {what}, each once, not {values!r}.")
        if self.hunt is not None:
            require_wind(self.hunt)
        for name in self.controllers or ():
            CONTROLLERS.find(name)
        for drag in self.drags:
            if drag not in DRAGS:
                raise BadInput(f"'{drag}' is not a drag.{did_you_mean(drag, DRAGS)} Names: {', '.join(DRAGS)}.")
        for mass in self.masses:
            if not (is_number(mass) and 0.5 <= mass <= 1.5):
                raise BadInput(f"a mass is a share of the profile's, 0.5 to 1.5, not {mass!r}.")
        for latency in self.latencies:
            if not (is_number(latency) and 0.0 <= latency <= 0.2):
                raise BadInput(f"a latency of {latency!r} s cannot be flown; latencies are 0 to 0.2 s.")

    def controllers_for(self, airframes: Sequence[Airframe]) -> tuple[str, ...]:
        """Return the controllers that fly a team: those that are named, or `geometric` and those that all of its autopilots run.

        Args:
            airframes: Of the team.
        """
        if self.controllers is not None:
            return self.controllers
        run = [autopilot_of(airframe).controllers for airframe in airframes]
        common = [name for name in run[0] if all(name in others for others in run)]
        own = dict.fromkeys(controller_name(airframe.vehicle) for airframe in airframes)
        return ("geometric", *common, *(() if set(own) <= {"geometric", *common} else (PROFILES,)))


USUAL = Combinations()
"""Every controller that all vehicles run, three masses, three latencies and three winds; of drags that are a guess three as well."""


# as many parameters as `ltlplan rehearse` has choices, each by its keyword
def rehearse(
    plan: Plan,
    team: Mapping[str, Trajectory],
    cert: Certificate | None = None,
    *,
    combinations: Combinations = USUAL,
    noise: MotionCapture | str | float = 0.001,
    runs: int = 20,
    seed: int = 0,
    workers: int | Workers = 1,
    progress: Progress | None = None,
) -> Rehearsal:
    """Fly every combination of controller, mass, latency and wind some times, and say which stay in the tube.

    Where the rotors' drag of a vehicle is a guess, all of it is flown with the ends of its range as well. All fly on the estimator on board
    (`ekf`), those from the ground too. The same seeds are used in every cell.

    Args:
        plan: As for `fly`.
        team: As for `fly`.
        cert: As for `fly`; without one nothing is said of tubes.
        combinations: What is combined.
        noise: Motion capture, or its noise in m; latencies are those of the combinations.
        runs: Flights of each cell.
        seed: Of the first of them; flight k of each cell has `seed + k`.
        workers: How many processes, or whose; the findings do not depend on it. More than one needs a script that may be imported.
        progress: Called with a sentence and the share done.

    Raises:
        BadInput: There are no such combinations, trajectories do not fit the mission, or a number is out of range.
        NotCertified: The certificate is of other trajectories or of another mission.
    """
    if not is_whole(runs) or not 1 <= runs <= MAX_RUNS:
        raise BadInput(f"a rehearsal flies each cell 1 to {MAX_RUNS} times, not {runs}.")
    require_seed(seed)
    count_of(workers)  # before anything is sampled
    plan, team = check_plan(plan), check_trajectories(team)
    if cert is not None:
        require_certificate(cert, plan, team)
    mission = plan.mission
    job = _job(mission, team, combinations, noise)
    teams, seeds = _teams(combinations, job.airframes), range(seed, seed + runs)
    corners = combinations.corners
    if corners is None:
        corners = any(airframe.vehicle.uncertain is not None for airframe in job.airframes)
    alone = not corners and combinations.hunt is None
    say = progress or silent
    found = _flown(job, teams, seeds, workers, say if alone else part_of(say, 0.0, 0.6))
    between = stray_between_steps(mission, planned_paths(mission, team), STEP) / min(*combinations.masses, 1.0)
    margin = None if cert is None else float(cert.margin)
    table = [
        _cells(job, one, errors + between, combinations.winds, seed, margin) for one, errors in zip(teams, found, strict=True)
    ]
    profile = dict.fromkeys(mission.vehicle_of(robot).controller for robot in job.reference.robots)
    return Rehearsal(
        mission=mission.name,
        margin=margin,
        certificate=None if cert is None else cert.digest(),
        runs=runs,
        seed=seed,
        profile=tuple(name or "geometric" for name in profile),
        cells=tuple(itertools.chain.from_iterable(table)),
        doubts=tuple(dict.fromkeys(airframe.doubt for airframe in job.airframes if airframe.doubt)),
        corners=fly_corners(
            mission, team, margin, seeds=seeds[:_CORNERED], profiles=combinations.profiles, progress=part_of(say, 0.6, 0.8)
        )
        if corners
        else None,
        hunt=None
        if combinations.hunt is None
        else hunt(mission, team, cert, wind=combinations.hunt, seed=seed, progress=part_of(say, 0.8, 1.0)),
    )


def _job(
    mission: Mission, team: Mapping[str, Trajectory], combinations: Combinations, noise: MotionCapture | str | float
) -> Job:
    """Return the settings that all flights have in common."""
    return Job(
        sensor=noise if isinstance(noise, MotionCapture) else MotionCapture.parse(noise),
        reference=sample_reference(flown(mission, team), CONTROL_STEP, SUBSTEPS, onward=flown(mission, team, more_laps=1)),
        airframes=airframes_of(mission, mission.agents),
        masses=combinations.masses,
        latencies=combinations.latencies,
        winds=tuple(Wind.parse(wind) for wind in combinations.winds),
    )


def _teams(combinations: Combinations, airframes: Sequence[Airframe]) -> list[tuple[str, Drag]]:
    """Return each controller with each drag that its vehicles may have."""
    guessed = any(airframe.drag_range is not None for airframe in airframes)
    drags: tuple[Drag, ...] = combinations.drags if guessed else ("profile",)
    return [(name, drag) for name in combinations.controllers_for(airframes) for drag in drags]


def _flown(job: Job, teams: Sequence[tuple[str, Drag]], seeds: range, workers: int | Workers, say: Progress) -> list[Floats]:
    """Fly all cells, and return each robot's largest distance from its plan at any step, m.

    Returns:
        For each controller with its drag. Shape (cells, seeds, robots).
    """
    size = max(_TOGETHER // (len(job.combinations) * len(job.reference.robots)), 1)
    batches = [seeds[k : k + size] for k in range(0, len(seeds), size)]
    parts: list[tuple[str, Drag, range]] = [(name, drag, batch) for name, drag in teams for batch in batches]
    found = _in_turn(job, parts, workers, say)
    return [np.concatenate(found[k : k + len(batches)], axis=1) for k in range(0, len(found), len(batches))]


def _in_turn(job: Job, parts: Sequence[tuple[str, Drag, range]], workers: int | Workers, say: Progress) -> list[Floats]:
    """Fly the parts, in order, and return what each found."""
    sentence = "rehearsing the flight"
    if count_of(workers) == 1 and isinstance(workers, int):
        found: list[Floats] = []
        for index, part in enumerate(parts):
            found.append(worst_errors(job, part, lambda _, share, index=index: say(sentence, (index + share) / len(parts))))
        return found
    with Processes(workers) if isinstance(workers, int) else nullcontext(workers) as those:
        return shared(worst_errors, job, parts, workers=those, progress=lambda share: say(sentence, share))


def _cells(
    job: Job, team: tuple[str, Drag], errors: Floats, winds: Sequence[str], seed: int, margin: float | None
) -> list[Cell]:
    """Return the cells of one controller with one drag, from the errors of its flights."""
    (name, drag), cells = team, list[Cell]()
    for (mass, latency, wind), each in zip(job.combinations, errors, strict=True):
        run, robot = np.unravel_index(np.argmax(each), each.shape)
        left = None if margin is None else int(np.count_nonzero(np.max(each, axis=1) >= margin))
        worst = float(each[run, robot])
        cells.append(Cell(name, mass, latency, winds[wind], worst, job.reference.robots[robot], seed + int(run), left, drag))
    return cells
