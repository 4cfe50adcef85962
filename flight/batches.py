"""Runs of a campaign, simulated side by side and each checked by the words that it flew."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from flight.closed_loop import steps
from flight.model.attitude import Floats
from flight.model.reference import Reference
from flight.model.timing import FRAME_STEPS, STEP, SUBSTEPS
from flight.monitoring.formula_state import FormulaState
from flight.monitoring.letters import PlannedAction, RegionMasks, region_letters
from flight.monitoring.sampled_bounds import may_be_kept
from flight.processes import Workers, shared
from flight.simulation_setup import Setup, not_simulated
from verify.data import Mission
from verify.data.progress import Progress, silent

_SAMPLE = Fraction(FRAME_STEPS, round(1 / STEP))
"""Time between two samples, s."""


@dataclass(frozen=True, slots=True)
class Job:
    """Settings that all runs of a campaign have in common.

    Attributes:
        mission: Whose formula is checked.
        reference: The plan, sampled.
        setup: The simulation, but for seeds.
        actions: When internal states change.
    """

    mission: Mission
    reference: Reference
    setup: Setup
    actions: tuple[PlannedAction, ...]


@dataclass(frozen=True, slots=True)
class Part:
    """Findings of a batch.

    Attributes:
        peaks: Each robot's largest distance from the plan at any step, m. Shape (runs, robots).
        errors: Distance of the robot that is farthest from its plan, m. Shape (runs, samples).
        satisfied: Whether the flown path, at samples, satisfies the formula. Shape (runs,).
    """

    peaks: Floats
    errors: NDArray[np.float32]
    satisfied: NDArray[np.bool_]


def simulate(job: Job, batches: Sequence[range], *, workers: Workers | None, progress: Progress | None) -> list[Part]:
    """Simulate batches of runs and return what each found, in order.

    Args:
        job: What all runs have in common.
        batches: Seeds of the runs that are simulated side by side, a batch each.
        workers: Who does it; None does all in this process.
        progress: Receives a sentence and the share done, 0 to 1.

    Raises:
        BadInput: A process was ended from outside.
    """
    sentence, say = f"simulating {sum(map(len, batches))} runs", progress or silent
    if workers is not None:
        return shared(_batch, job, batches, workers=workers, progress=lambda share: say(sentence, share))

    def noting(index: int) -> Progress:
        return lambda _, share: say(sentence, (index + share) / len(batches))

    return [_batch(job, seeds, noting(index)) for index, seeds in enumerate(batches)]


def _batch(job: Job, seeds: range, report: Progress) -> Part:
    """Simulate runs side by side and note when which robot's regions change."""
    reference = job.reference
    robots, runs = len(reference.robots), len(seeds)
    samples = (len(reference.times) - 1) * SUBSTEPS // FRAME_STEPS + 1
    errors = np.empty((runs, samples), dtype=np.float32)
    regions = RegionMasks(job.mission)
    masks = regions.none(robots * runs)
    changes: list[list[tuple[int, int, int]]] = [[] for _ in range(runs)]  # of each run: sample, robot, regions
    peak = np.zeros(robots * runs)
    with np.errstate(all="ignore"):  # who is nowhere any more is named
        for sample, entry in enumerate(steps(job.setup, seeds)):
            away = (entry.position.reshape(3, runs, robots) - reference.fine[entry.step][:, None]).astype(np.float64)
            errors[:, sample] = np.sqrt(np.max(away[0] * away[0] + away[1] * away[1] + away[2] * away[2], axis=1))
            now = regions.of(entry.position)
            for vehicle in np.flatnonzero(now != masks) if sample else range(robots * runs):
                changes[vehicle // robots].append((sample, int(vehicle % robots), int(now[vehicle])))
            masks, peak = now, entry.peak
            if sample % 100 == 0:
                report("simulating", sample / samples)
    if not np.isfinite(peak).all():
        run, robot = divmod(int(np.argmin(np.isfinite(peak))), robots)
        name = reference.robots[robot]
        raise not_simulated(name, job.mission.vehicle_of(name), f"in the flight with seed {seeds[run]}")
    judge = _Judge(job, reference.robots)
    satisfied = np.array([judge.satisfied(found) for found in changes], dtype=np.bool_)
    report("simulating", 1.0)
    return Part(peak.reshape(runs, robots), errors, satisfied)


class _Judge:
    """Judges words of runs; runs whose letters change in the same order share one verdict."""

    def __init__(self, job: Job, robots: tuple[str, ...]) -> None:
        self._mission, self._table = job.mission, region_letters(job.mission)
        self._actions = sorted(
            (int(np.ceil(round(action.time / (FRAME_STEPS * STEP), 6))), robots.index(action.robot), action.propositions)
            for action in job.actions
        )
        self._count, self._robots, self._end = len(robots), robots, job.reference.duration
        self._known: dict[tuple[tuple[tuple[int, frozenset[str]], ...], ...], bool] = {}

    def satisfied(self, changes: list[tuple[int, int, int]]) -> bool:
        regions: list[frozenset[str]] = [frozenset()] * self._count
        inner = [self._mission.initial_letter(name) for name in self._robots]
        events: dict[int, dict[int, frozenset[str]]] = {}
        entries = [(sample, 1, robot, self._table[mask]) for sample, robot, mask in changes]
        entries += [(sample, 0, robot, letter) for sample, robot, letter in self._actions]
        for sample, kind, robot, letter in sorted(entries, key=lambda entry: entry[:3]):
            (regions if kind else inner)[robot] = letter
            events.setdefault(sample, {})[robot] = regions[robot] | inner[robot]
        word = tuple(tuple(sorted(change.items(), key=lambda item: item[0])) for _, change in sorted(events.items()))
        if word not in self._known:
            first, *rest = word
            letters = [letter for _, letter in first]
            state = FormulaState(self._mission.formula, self._mission.spec.team, letters, self._robots)
            for change in rest:
                state.change(dict(change))
            finite = self._mission.spec.trace == "finite"
            self._known[word] = state.end(finite=finite) in (("satisfied",) if finite else ("satisfied", "open"))
        return self._known[word] and self._in_time(events)

    def _in_time(self, events: Mapping[int, Mapping[int, frozenset[str]]]) -> bool:
        """Return whether what is bounded in seconds may have been satisfied: letters change between the samples at which that is seen."""
        changes = [
            (sample, {self._robots[robot]: letter for robot, letter in change.items()})
            for sample, change in sorted(events.items())
        ]
        finite = self._mission.spec.trace == "finite"
        return all(may_be_kept(part, changes, _SAMPLE, self._end, finite=finite) for part in self._mission.timed_parts)
