"""Campaigns: the same flight a thousand times, in wind and noise, and what share of the runs kept its promises.

A run that stays inside its tube and yet breaks the formula would be a bug of the certificate; a campaign hunts for one.
Run k has seed `seed + k`, and `fly(..., seed=seed + k)` is, bit for bit, that run.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaincinv

from flight.batches import Job, simulate
from flight.certificate_checks import require_certificate
from flight.conditions import CALM, ConditionKeywords, Conditions
from flight.model.airframe import airframes_of
from flight.model.attitude import Floats
from flight.model.reference import flown, sample_reference
from flight.model.timing import CONTROL_STEP, FRAME_STEPS, STEP, SUBSTEPS
from flight.monitoring.formula_state import has_formula
from flight.monitoring.letters import planned_actions
from flight.monitoring.tube import stray_between_steps
from flight.processes import Processes, Workers, count_of
from flight.simulation_setup import Setup, is_whole, require_seed
from verify.certificate import Certificate
from verify.data import BadInput, Plan, Trajectory, check_plan, check_trajectories
from verify.data.progress import Progress
from verify.recordings.planned_paths import planned_paths

MAX_RUNS = 100_000
_BATCH = 500
"""Runs that are simulated side by side: enough to drown the cost of a call, few enough for the cache."""
LEAST_SHARE = 400
"""Fewest runs that a process of their own is worth: half as many take hardly less time, and starting one takes a second."""


@dataclass(frozen=True, slots=True)
class Proportion:
    """Proportion of runs, with its exact (Clopper-Pearson) 95 % confidence interval."""

    count: int
    of: int
    low: float
    high: float

    @classmethod
    def make(cls, good: NDArray[np.bool_]) -> Proportion:
        """Return the share of runs that are True."""
        n, k = len(good), int(np.count_nonzero(good))
        low = 0.0 if k == 0 else float(betaincinv(k, n - k + 1, 0.025))
        high = 1.0 if k == n else float(betaincinv(k + 1, n - k, 0.975))
        return cls(k, n, low, high)

    @property
    def value(self) -> float:
        """The share itself."""
        return self.count / self.of

    def __str__(self) -> str:
        return f"{self.count} of {self.of} ({100 * self.value:.1f} %, 95 % confidence {100 * self.low:.2f} to {100 * self.high:.2f} %)"


@dataclass(frozen=True, eq=False)
class Campaign:
    """Results of a campaign. Arrays are read-only, one entry a run.

    Attributes:
        mission: The mission's name.
        robots: Names.
        seeds: Shape (runs,).
        worst_error: Largest distance from the plan of any robot at any time, m. Shape (runs,).
        worst_robot: Index of that robot. Shape (runs,).
        inside: Whether every robot was inside its tube at every time; None without a certificate. Shape (runs,).
        satisfied: Whether the flown path (sampled at 100 Hz) satisfies the formula; None of a mission without one. Shape (runs,).
        margin: delta of the certificate, m, or None.
        times: s. Shape (samples,).
        error_over_time: Median, 95th percentile and maximum over the runs of the worst robot's error at each time, m.
            Shape (samples, 3).
        certificate: Its digest, or None.
        asked: How many runs were asked for.
        varied: Whether anything differs between runs; where nothing does, one was flown for all of them, and shares say nothing.
    """

    mission: str
    robots: tuple[str, ...]
    seeds: NDArray[np.int64]
    worst_error: Floats
    worst_robot: NDArray[np.int64]
    inside: NDArray[np.bool_] | None
    satisfied: NDArray[np.bool_] | None
    margin: float | None
    times: Floats
    error_over_time: Floats
    certificate: str | None
    asked: int
    varied: bool

    @property
    def share_inside(self) -> Proportion | None:
        """Share of runs inside the tube; None without a certificate."""
        return None if self.inside is None else Proportion.make(self.inside)

    @property
    def share_satisfied(self) -> Proportion | None:
        """Share of runs whose path satisfies the formula; None of a mission without one."""
        return None if self.satisfied is None else Proportion.make(self.satisfied)

    @property
    def worst_seed(self) -> int:
        """Seed of the run with the largest error."""
        return int(self.seeds[np.argmax(self.worst_error)])

    @property
    def contradictions(self) -> tuple[int, ...]:
        """Seeds of runs inside the tube that break the formula: each is a bug of the certificate, or of this judge."""
        if self.inside is None or self.satisfied is None:
            return ()
        return tuple(int(seed) for seed in self.seeds[self.inside & ~self.satisfied])

    @property
    def sentences(self) -> tuple[str, ...]:
        """The results, a sentence each."""
        worst = int(np.argmax(self.worst_error))
        if not self.varied:
            return self._sentences_of_one()
        shares = self.share_satisfied
        found = [self._without_formula if shares is None else f"the formula was satisfied in {shares}."]
        if self.share_inside is not None:
            found.insert(0, f"every robot stayed inside its tube of {self.margin:g} m in {self.share_inside}.")
        found.append(
            f"worst error {1000 * self.worst_error[worst]:.1f} mm by {self.robots[self.worst_robot[worst]]} "
            f"with seed {self.worst_seed}; median of the runs' worst {1000 * float(np.median(self.worst_error)):.1f} mm."
        )
        if self.contradictions:
            seeds = ", ".join(map(str, self.contradictions[:5]))
            found.append(f"BUG: {len(self.contradictions)} runs inside the tube broke the formula, with seeds {seeds}.")
        return tuple(found)

    @property
    def _without_formula(self) -> str:
        """Sentence about the hoops of a mission without a formula."""
        if self.inside is None:
            return "the mission has no formula; whether hoops were passed in their order was not judged."
        return "the mission has no formula; who stayed inside the tubes passed hoops in their order, which was not judged of others."

    def _sentences_of_one(self) -> tuple[str, ...]:
        """Return the outcome of the one flight that stands for all, without shares and confidence: no chance is in it."""
        runs = "1 run" if self.asked == 1 else f"{self.asked} runs"
        found = [
            f"nothing varies between runs without noise and gusts, so one was flown for the {runs} asked for; "
            "chance comes with noise (--noise 0.001) or gusts (--wind 1+0.3)."
        ]
        if self.inside is not None:
            where = "every robot stayed inside" if self.inside[0] else f"{self.robots[self.worst_robot[0]]} left"
            found.append(f"{where} its tube of {self.margin:g} m.")
        if self.satisfied is None:
            found.append(self._without_formula)
        else:
            found.append(f"the formula was {'satisfied' if self.satisfied[0] else 'not satisfied'}.")
        found.append(f"worst error {1000 * self.worst_error[0]:.1f} mm by {self.robots[self.worst_robot[0]]}.")
        if self.contradictions:
            found.append("BUG: the run stayed inside the tube and broke the formula.")
        return tuple(found)

    def to_dict(self) -> dict[str, Any]:  # of any type: JSON nests
        """Return the findings as plain data, a row for each run included."""
        inside = [None] * len(self.seeds) if self.inside is None else self.inside.tolist()
        judged = [None] * len(self.seeds) if self.satisfied is None else self.satisfied.tolist()
        rows = zip(
            self.seeds.tolist(),
            self.worst_error.tolist(),
            self.worst_robot.tolist(),
            inside,
            judged,
            strict=True,
        )
        return {
            "mission": self.mission,
            "certificate": self.certificate,
            "margin": self.margin,
            "runs": [
                {"seed": seed, "worst_error": error, "robot": self.robots[robot], "inside": kept, "satisfied": good}
                for seed, error, robot, kept, good in rows
            ],
            "asked": self.asked,
            "varied": self.varied,
            "share_inside": None if self.share_inside is None or not self.varied else _share(self.share_inside),
            "share_satisfied": None if self.share_satisfied is None or not self.varied else _share(self.share_satisfied),
            "worst_seed": self.worst_seed,
            "contradictions": list(self.contradictions),
        }


# as many parameters as `ltlplan campaign` has choices: each may be made alone, by its keyword
def campaign(
    plan: Plan,
    team: Mapping[str, Trajectory],
    cert: Certificate | None = None,
    *,
    runs: int = 100,
    seed: int = 0,
    conditions: Conditions = CALM,
    workers: int | Workers = 1,
    progress: Progress | None = None,
    **changes: Unpack[ConditionKeywords],
) -> Campaign:
    """Simulate many flights of the team, in which nobody reacts to alarms, and judge each.

    Args:
        plan: As for `fly`.
        team: As for `fly`.
        cert: As for `fly`; without one nothing is said of tubes.
        runs: How many; where nothing varies, one is flown.
        seed: Of the first run; run k has `seed + k`.
        conditions: As for `fly`.
        workers: How many processes, or whose; the findings do not depend on it. More than one needs a script that may be imported.
        progress: Called with a sentence and the share done.
        changes: As for `fly`.

    Raises:
        BadInput: There are no such conditions, trajectories do not fit the mission, the certificate's margin is 0, the
            number of runs or workers is out of range, or what a vehicle's profile says cannot be simulated.
        NotCertified: The certificate is of other trajectories or of another mission.
    """
    conditions = conditions.changed(**changes)
    if not is_whole(runs) or not 1 <= runs <= MAX_RUNS:
        raise BadInput(f"a campaign has 1 to {MAX_RUNS} runs, not {runs}.")
    most = count_of(workers)
    require_seed(seed)
    plan, team = check_plan(plan), check_trajectories(team)
    if cert is not None:
        require_certificate(cert, plan, team)
    mission = plan.mission
    reference = sample_reference(flown(mission, team), CONTROL_STEP, SUBSTEPS, onward=flown(mission, team, more_laps=1))
    airframes = (conditions.airframe,) if conditions.airframe else airframes_of(mission, reference.robots)
    setup = Setup(airframes, reference, conditions)
    job = Job(mission, reference, setup, planned_actions(plan, team, cert))
    varied = conditions.varies
    flown_runs = runs if varied else 1
    processes = max(min(most, flown_runs // LEAST_SHARE), 1)
    with _working(workers, processes) as those:
        parts = simulate(job, _batches(seed, flown_runs, processes), workers=those, progress=progress)
    peaks = np.concatenate([part.peaks for part in parts])
    errors = np.concatenate([part.errors for part in parts])
    worst = np.max(peaks, axis=1) + stray_between_steps(mission, planned_paths(mission, team), STEP)
    return Campaign(
        mission=mission.name,
        robots=reference.robots,
        seeds=_frozen(np.arange(seed, seed + flown_runs)),
        worst_error=_frozen(worst),
        worst_robot=_frozen(np.argmax(peaks, axis=1)),
        inside=None if cert is None else _frozen(worst < float(cert.margin)),
        satisfied=_frozen(np.concatenate([part.satisfied for part in parts])) if has_formula(mission) else None,
        margin=None if cert is None else float(cert.margin),
        times=_frozen(np.arange(errors.shape[1]) * FRAME_STEPS * STEP),
        error_over_time=_frozen(
            np.stack([np.median(errors, axis=0), np.percentile(errors, 95, axis=0), np.max(errors, axis=0)], axis=1)
        ),
        certificate=None if cert is None else cert.digest(),
        asked=runs,
        varied=varied,
    )


@contextmanager
def _working(workers: int | Workers, processes: int) -> Generator[Workers | None]:
    """Yield who does the work: whom the caller names, processes of our own, or None where one more would save no time."""
    if not isinstance(workers, int):
        yield workers
    elif processes == 1:
        yield None
    else:
        with Processes(processes) as pool:
            yield pool


def _batches(seed: int, runs: int, processes: int) -> list[range]:
    """Return the seeds of runs that are simulated side by side, as many batches for each process."""
    count = -(-runs // (_BATCH * processes)) * processes
    size = -(-runs // count)
    return [range(seed + first, seed + min(first + size, runs)) for first in range(0, runs, size)]


def _share(share: Proportion) -> dict[str, float]:
    return {"count": share.count, "of": share.of, "low": share.low, "high": share.high}


def _frozen(values: NDArray[Any]) -> NDArray[Any]:
    values = np.array(values, order="C")
    values.setflags(write=False)
    return values
