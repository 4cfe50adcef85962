"""The flight that was planned, sampled once for all runs: position to snap and heading of every robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flight.model.attitude import Floats
from verify.data import BadInput, Mission, Trajectory

MAX_DURATION = 3600.0
"""Longest flight that is simulated, s."""


@dataclass(frozen=True, slots=True)
class Reference:
    """Planned position of every robot at every control instant.

    Attributes:
        robots: Names, in the mission's order.
        times: Control instants, s. Shape (ticks,).
        flat: x, y, z, yaw and their derivatives up to the fourth. Shape (ticks, 5, 4, robots).
        fine: Positions at every step of the dynamics. Shape (steps + 1, 3, robots), m.
        duration: T of the team, s: all laps of a cycle included.
        greatest_acceleration: A bound on |r''| over all robots and times, m/s^2 (sampled, and widened by 5 %).
    """

    robots: tuple[str, ...]
    times: Floats
    flat: Floats
    fine: Floats
    duration: float
    greatest_acceleration: float

    @property
    def start(self) -> Floats:
        """Pose of every robot at time 0: x, y, z and yaw. Shape (4, robots)."""
        return self.flat[0, 0]

    @property
    def ticks(self) -> int:
        """Control instants before the last one, from which nothing is flown any more."""
        return len(self.times) - 1

    def wanted(self, tick: int) -> Floats:
        """Return the plan at a control instant. Shape (5, 4, robots)."""
        return self.flat[tick]

    def planned(self, step: int) -> Floats:
        """Return the plan's positions at a step of the dynamics, m. Shape (3, robots)."""
        return self.fine[step]

    def extended(self, more: float, control_step: float, substeps: int) -> Reference:
        """Return the reference with `more` seconds of hover behind it.

        Args:
            more: s.
            control_step: Time between control instants, s.
            substeps: Steps of the dynamics in each.
        """
        ticks = int(np.ceil(more / control_step))
        hover = np.zeros_like(self.flat[-1])
        hover[0] = self.flat[-1, 0]
        times = np.arange(len(self.times) + ticks, dtype=np.float64) * control_step
        flat = np.concatenate([self.flat, np.repeat(hover[None], ticks, axis=0)])
        fine = np.concatenate([self.fine, np.repeat(self.fine[-1:], ticks * substeps, axis=0)])
        return Reference(self.robots, times, flat, fine, self.duration, self.greatest_acceleration)


def flown(mission: Mission, team: Mapping[str, Trajectory], *, more_laps: int = 0) -> dict[str, Trajectory]:
    """Return what is flown: every robot's trajectory in the mission's order, cycles repeated as asked.

    Args:
        mission: Says who flies, and how many laps.
        team: One trajectory a robot.
        more_laps: Laps beyond those.

    Raises:
        BadInput: A robot is missing, unknown, or does not begin where the mission says.
    """
    if set(team) != set(mission.agents):
        missing = ", ".join(sorted(set(mission.agents) ^ set(team)))
        raise BadInput(f"the team must have one trajectory for each robot of the mission; these differ: {missing}.")
    return {name: team[name].flattened(mission.spec.repeat + more_laps) for name in mission.agents}


def sample_reference(
    team: Mapping[str, Trajectory], control_step: float, substeps: int, *, onward: Mapping[str, Trajectory] | None = None
) -> Reference:
    """Sample a team of finite flights at the control and dynamics rates; who is done hovers until the last is.

    Args:
        team: One finite flight a robot.
        control_step: Time between control instants, s.
        substeps: Steps of the dynamics in each.
        onward: The same flights and what comes after them, where a cycle would go on: the last control instant is
            after the end by less than a step, and who flies on has not stopped there.

    Raises:
        BadInput: The flight is too long to simulate.
    """
    duration = max(trajectory.duration for trajectory in team.values())
    onward = team if onward is None else onward
    if duration > MAX_DURATION:
        raise BadInput(f"the flight lasts {duration:.0f} s; at most {MAX_DURATION:.0f} s are simulated.")
    ticks = int(np.ceil(round(duration / control_step, 3)))  # float32 durations end a microsecond late
    times = np.arange(ticks + 1, dtype=np.float64) * control_step
    flat = np.stack(
        [np.stack([path.evaluate(times, order).T for order in range(5)]) for path in onward.values()], axis=-1
    ).transpose(2, 0, 1, 3)
    fine_times = np.arange(ticks * substeps + 1) * (control_step / substeps)
    fine = np.stack([path.evaluate(fine_times)[:, :3] for path in onward.values()], axis=-1)
    acceleration = max(float(np.max(np.linalg.norm(path.evaluate(fine_times, 2)[:, :3], axis=1))) for path in onward.values())
    return Reference(tuple(onward), times, np.ascontiguousarray(flat), fine, duration, 1.05 * acceleration)
