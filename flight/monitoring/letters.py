"""Letters along a flight: the regions that positions lie in, and internal propositions that flip when planned.

A robot's planned actions happen at the instants that its certificate records. Without a certificate they happen in the
middle of the planned visit on the sampled nominal path, and the log says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flight.model.attitude import Floats
from verify.certificate import Certificate
from verify.data import Letter, Mission, Plan, Trajectory
from verify.data.shapes.measures import Measures

SAMPLE_STEP = 0.002
"""s between samples of the nominal path, where the middle of a visit is looked for."""


_FEW = 64
"""Positions up to which each is looked at, whether it is near a region; of more their box."""
_BITS = 62
"""Regions whose bits fit a 64-bit integer."""


@dataclass(frozen=True, slots=True)
class PlannedAction:
    """A change of one robot's internal state: from `time` on it has `propositions`."""

    robot: str
    time: float
    source: str
    target: str
    propositions: Letter


class RegionMasks:
    """Tells which regions positions lie in, as bit masks: bit i is region i of `mission.all_regions`.

    Masks of up to 62 regions are 64-bit integers; those of more are Python's, in arrays of objects.
    """

    def __init__(self, mission: Mission) -> None:
        regions = list(mission.all_regions.values())
        self._centres = np.array([region.center for region in regions]).reshape(-1, 3)
        self._shapes = [region.shape.tolist() if region.is_ellipsoid else region.measures for region in regions]
        self._squares = (np.array([region.outer_radius for region in regions]).reshape(-1, 1) * (1 + 1e-9)) ** 2
        self._type: type = np.int64 if len(regions) <= _BITS else object

    def none(self, count: int) -> NDArray[Any]:  # integers of 64 bits, or Python's as objects
        """Return masks of so many positions in no region."""
        return np.zeros(count, dtype=self._type)

    def of(self, positions: Floats) -> NDArray[Any]:  # integers of 64 bits, or Python's as objects
        """Return the mask of each position.

        Args:
            positions: m. Shape (3, n).

        Returns:
            Shape (n,).
        """
        mask = self.none(positions.shape[1])
        if not mask.size:
            return mask
        for bit in self._near(positions):
            shape = self._shapes[bit]
            if isinstance(shape, Measures):
                mask |= (shape.levels(positions.T - self._centres[bit]) <= 1.0).astype(self._type) << bit
                continue
            x, y, z = (positions[i] - self._centres[bit, i] for i in range(3))
            ((a, b, c), (_, d, e), (_, _, f)) = shape
            level = a * x * x + d * y * y + f * z * z + 2.0 * (b * x * y + c * x * z + e * y * z)
            mask |= (level <= 1.0).astype(self._type) << bit
        return mask

    def _near(self, positions: Floats) -> list[int]:
        """Return the regions that may hold one of some positions; whatever is no number is nowhere. Shape (3, n)."""
        if positions.shape[1] <= _FEW:
            away = positions[None] - self._centres[:, :, None]
            return np.flatnonzero((np.einsum("rin,rin->rn", away, away) <= self._squares).any(axis=1)).tolist()
        low, high = np.fmin.reduce(positions, axis=1), np.fmax.reduce(positions, axis=1)
        beside = np.maximum(np.maximum(low - self._centres, self._centres - high), 0.0)
        return np.flatnonzero(np.einsum("ri,ri->r", beside, beside) <= self._squares[:, 0]).tolist()


def region_letters(mission: Mission) -> dict[int, Letter]:
    """Return a table that fills itself: mask of `RegionMasks` to set of names."""
    return _Table(tuple(mission.all_regions))


class _Table(dict[int, Letter]):
    def __init__(self, names: tuple[str, ...]) -> None:
        super().__init__()
        self._names = names

    def __missing__(self, mask: int) -> Letter:
        letter = frozenset(name for bit, name in enumerate(self._names) if mask >> bit & 1)
        self[mask] = letter
        return letter


def internal_letters(mission: Mission, robot: str, actions: Sequence[PlannedAction], times: Floats) -> list[Letter]:
    """Return a robot's internal propositions at each time, planned actions taken as made. Shape (samples,).

    Args:
        mission: Says what robots can do.
        robot: Its name.
        actions: All robots' planned actions.
        times: s. Shape (samples,).
    """
    own = sorted((a for a in actions if a.robot == robot), key=lambda a: a.time)
    states = [mission.initial_letter(robot), *(a.propositions for a in own)]
    index = np.searchsorted([a.time for a in own], times, side="right") if own else np.zeros(len(times), dtype=np.int64)
    return [states[i] for i in index]


def planned_actions(
    plan: Plan, team: Mapping[str, Trajectory], certificate: Certificate | None = None
) -> tuple[PlannedAction, ...]:
    """Return when each planned action happens, all laps of a cycle included, sorted by time.

    Args:
        plan: Whose visits carry the actions.
        team: The trajectories as planned (cycles not yet repeated).
        certificate: Gives the exact instants; without one the middle of each visit on the sampled path is taken.
    """
    if certificate is not None:
        return certified_actions(certificate, team)
    first = [entry for name in plan.robots for entry in _from_path(plan, name, team[name])]
    return _all_laps(plan.mission, first, team)


def certified_actions(certificate: Certificate, team: Mapping[str, Trajectory] | None) -> tuple[PlannedAction, ...]:
    """Return when each planned action happens by its certificate, all laps of a cycle included, sorted by time.

    Without the trajectories a mission with a cycle shows its first lap only.
    """
    first = [(a.robot, float(a.time), a.source, a.target) for a in certificate.actions]
    return _all_laps(certificate.mission, first, team)


def _all_laps(
    mission: Mission, first: Sequence[tuple[str, float, str, str]], team: Mapping[str, Trajectory] | None
) -> tuple[PlannedAction, ...]:
    """Repeat the actions of a cycle in every lap that is flown."""
    actions: list[PlannedAction] = []
    for robot, time, source, target in first:
        path = None if team is None else team[robot]
        begin, lap, laps = 0.0, 0.0, 1
        if path is not None and path.cycle is not None:
            begin = float(path.knots[path.cycle])
            lap, laps = path.duration - begin, mission.spec.repeat
        for k in range(laps if time >= begin else 1):
            actions.append(
                PlannedAction(robot, time + k * lap, source, target, frozenset(mission.robot_of(robot).states[target]))
            )
    return tuple(sorted(actions, key=lambda a: (a.time, a.robot)))


def _from_path(plan: Plan, name: str, path: Trajectory) -> list[tuple[str, float, str, str]]:
    """Match planned visits with stays of the sampled path, in order, and place each action in its stay."""
    visits = plan.robots[name].visits
    if not any(visit.actions for visit in visits):
        return []
    times = np.arange(int(np.ceil(path.duration / SAMPLE_STEP)) + 1) * SAMPLE_STEP
    inside = RegionMasks(plan.mission).of(path.evaluate(times)[:, :3].T)
    bits = {region: bit for bit, region in enumerate(plan.mission.all_regions)}
    found, after = [], 0
    for visit in visits:
        within = np.flatnonzero((inside[after:] >> bits[visit.region]) & 1)
        if not len(within):
            continue
        begin = after + int(within[0])
        left = np.flatnonzero(~((inside[begin:] >> bits[visit.region]) & 1).astype(bool))
        end = begin + int(left[0]) if len(left) else len(times)
        for k, action in enumerate(visit.actions):
            share = (k + 1) / (len(visit.actions) + 1)
            found.append((name, float(times[begin] + share * SAMPLE_STEP * (end - 1 - begin)), action.source, action.target))
        after = end
    return found
