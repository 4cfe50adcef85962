"""Corners of what is not known of a team's airframes: every least and most of mass, thrust, drag, latency and noise, flown together.

A profile's `uncertain` gives the intervals, as `ltlplan identify` writes them; what it leaves out is as below.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from flight.conditions import LABORATORY, Conditions
from flight.control.controller import CONTROLLERS
from flight.control.profiles import PROFILES, controller_name
from flight.mixed_fleet import kinds_of
from flight.model.airframe import Airframe, Drag, airframe_of, airframes_of
from flight.model.attitude import Floats
from flight.model.reference import Reference, flown, sample_reference
from flight.model.sensing import MotionCapture
from flight.model.timing import CONTROL_STEP, STEP, SUBSTEPS
from flight.monitoring.tube import stray_between_steps
from flight.onboard_simulation.fleet import Differences, Fleet
from flight.random_streams import Draws
from flight.rehearsal.batches import Air, Chance, peaks
from verify.data import BadInput, Mission, Trajectory, Vehicle
from verify.data.progress import Progress, part_of, silent
from verify.data.uncertain import Uncertain
from verify.recordings.planned_paths import planned_paths

USUAL: Mapping[str, tuple[float, float]] = {
    "mass": (0.98, 1.02),
    "thrust": (0.92, 1.08),
    "latency": (0.005, 0.025),
    "noise": (0.0005, 0.002),
}
"""Least and most where a profile says nothing: share of its mass, thrust over commanded thrust, s, and m."""
NAMES = (*USUAL, "drag")
"""What has corners, in the order in which ends are listed."""
_NOISE = 0.001
"""m, of the motion capture whose noise is scaled."""


@dataclass(frozen=True, slots=True)
class Corner:
    """The flights of one corner.

    Attributes:
        ends: `least` or `most` of each quantity that has two ends.
        worst: Largest distance of any robot from its plan at any time, m; infinite where one was lost.
        robot: Whose.
        seed: Of that flight.
        left: How many of the flights left the tube; None without a margin.
    """

    ends: Mapping[str, str]
    worst: float
    robot: str
    seed: int
    left: int | None

    @property
    def phrase(self) -> str:
        """The corner, for a person."""
        return said_of(self.ends)


def said_of(ends: Mapping[str, str]) -> str:
    """Return ends for a person: "least mass; most thrust, latency".

    Args:
        ends: `least` or `most` by what has two ends.
    """
    found: dict[str, list[str]] = {}
    for name, end in ends.items():
        found.setdefault(end, []).append(name)
    return "; ".join(f"{end} {', '.join(names)}" for end, names in found.items())


@dataclass(frozen=True, slots=True)
class Corners:
    """Results at the corners.

    Attributes:
        margin: Radius of the tube, m; None without one.
        runs: Flights of each corner.
        controllers: Who flew each robot.
        intervals: Least and most of each quantity, by robot: mass as a share of the profile's, drag in kg, latency in s, noise in m.
        corners: In order.
    """

    margin: float | None
    runs: int
    controllers: Mapping[str, str]
    intervals: Mapping[str, Mapping[str, tuple[float, float]]]
    corners: tuple[Corner, ...]

    @property
    def worst(self) -> Corner:
        """The corner where a robot strays farthest."""
        return max(self.corners, key=lambda corner: corner.worst)

    @property
    def sentences(self) -> tuple[str, ...]:
        """The results, for a person."""
        worst = self.worst
        far = "a robot is lost" if worst.worst == float("inf") else f"worst {1000 * worst.worst:.1f} mm"
        said = f"{far} by {worst.robot}, flown by {self.controllers[worst.robot]}, at {worst.phrase} (seed {worst.seed})."
        if self.margin is None:
            return (f"At {len(self.corners)} corners of what is not known: {said}",)
        left = [corner for corner in self.corners if corner.left]
        kept = len(self.corners) - len(left)
        lines = [
            f"At the corners of what is not known the team stayed in the tube of {self.margin:g} m in {kept} of {len(self.corners)}; {said}"
        ]
        if left:
            always = [
                f"{name} {end}" for name in NAMES for end in ("least", "most") if all(c.ends.get(name) == end for c in left)
            ]
            whenever = f", all with {', '.join(always)}" if always else ""
            lines.append(f"The tube is left at {len(left)} corners{whenever}.")
        return tuple(lines)

    def to_dict(self) -> dict[str, Any]:  # of any type: JSON nests
        """Return the findings as plain data; a lost robot's error is null."""
        return {
            "margin": self.margin,
            "runs": self.runs,
            "controllers": dict(self.controllers),
            "intervals": {robot: {name: list(ends) for name, ends in own.items()} for robot, own in self.intervals.items()},
            "corners": [
                {**asdict(c), "ends": dict(c.ends), "worst": None if c.worst == float("inf") else c.worst} for c in self.corners
            ],
        }


def fly_corners(
    mission: Mission,
    team: Mapping[str, Trajectory],
    margin: float | None,
    *,
    seeds: Sequence[int] = (0,),
    profiles: Sequence[Vehicle] = (),
    progress: Progress | None = None,
) -> Corners:
    """Fly a team at every corner of what is not known of its vehicles, by the controllers of their profiles, in a laboratory's air.

    Args:
        mission: Who flies.
        team: Its trajectories.
        margin: Radius of the tube, m; None for none.
        seeds: Of the flights of each corner.
        profiles: Of vehicles by their names, whose intervals are flown in place of the mission's own.
        progress: Called with a sentence and the share done.

    Raises:
        BadInput: Nobody flies the vehicle of a profile.
    """
    reference = sample_reference(flown(mission, team), CONTROL_STEP, SUBSTEPS, onward=flown(mission, team, more_laps=1))
    told = _told(airframes_of(mission, mission.agents), profiles)
    airframes, own = [airframe for airframe, _ in told], [intervals for _, intervals in told]
    names = [name for name in USUAL if any(ends[name][0] < ends[name][1] for ends in own)]
    drags: tuple[Drag, ...] = ("least", "most") if any(airframe.drag_range for airframe in airframes) else ("profile",)
    sides = list(itertools.product((0, 1), repeat=len(names)))
    spread = _Spread(reference, airframes, own, names, sides, seeds)
    between = stray_between_steps(mission, planned_paths(mission, team), STEP)
    say, found = progress or silent, list[Corner]()
    for k, drag in enumerate(drags):
        errors = spread.flown(drag, part_of(say, k / len(drags), (k + 1) / len(drags))) + between
        for side, each in zip(sides, errors, strict=True):
            ends = {name: ("least", "most")[end] for name, end in zip(names, side, strict=True)}
            ends |= {} if drag == "profile" else {"drag": drag}
            run, robot = np.unravel_index(np.argmax(each), each.shape)
            left = None if margin is None else int(np.count_nonzero(np.max(each, axis=1) >= margin))
            found.append(Corner(ends, float(each[run, robot]), reference.robots[robot], seeds[int(run)], left))
    robots = reference.robots
    follow = {name: controller_name(airframe.vehicle) for name, airframe in zip(robots, airframes, strict=True)}
    return Corners(margin, len(seeds), follow, dict(zip(robots, own, strict=True)), tuple(found))


def _told(airframes: Sequence[Airframe], profiles: Sequence[Vehicle]) -> list[tuple[Airframe, dict[str, tuple[float, float]]]]:
    """Return the airframe that flies and its intervals, of each robot."""
    of_name = {profile.name: profile for profile in profiles}
    names = {airframe.vehicle.name for airframe in airframes}
    for name in of_name.keys() - names:
        raise BadInput(f"the profile is of '{name}', which nobody flies here: {', '.join(sorted(names))}.")
    found: list[tuple[Airframe, dict[str, tuple[float, float]]]] = []
    for airframe in airframes:
        profile = of_name.get(airframe.vehicle.name)
        if profile is None:
            found.append((airframe, intervals_of(airframe)))
            continue
        other = airframe_of(profile)
        share = profile.mass / airframe.vehicle.mass
        intervals = intervals_of(other)
        intervals["mass"] = (share * intervals["mass"][0], share * intervals["mass"][1])
        drag = {"rotor_drag": other.rotor_drag, "inflow_drag": other.inflow_drag, "drag_range": other.drag_range}
        found.append((airframe.changed(**drag), intervals))
    return found


def intervals_of(airframe: Airframe) -> dict[str, tuple[float, float]]:
    """Return the least and most of what is not known of an airframe, in the units of `Corners.intervals`.

    Args:
        airframe: Its vehicle's profile may say.
    """
    vehicle = airframe.vehicle
    said = (vehicle.uncertain or Uncertain()).ends
    found = {name: said.get(name, usual) for name, usual in USUAL.items()}
    if "mass" in said:
        found["mass"] = (said["mass"][0] / vehicle.mass, said["mass"][1] / vehicle.mass)
    reach, drag = airframe.drag_range, airframe.rotor_drag
    found["drag"] = (drag, drag) if reach is None else reach.rotor_drag
    return found


@dataclass(frozen=True, slots=True)
class _Spread:
    """All corners of one drag, side by side."""

    reference: Reference
    airframes: Sequence[Airframe]
    own: Sequence[Mapping[str, tuple[float, float]]]
    names: Sequence[str]
    sides: Sequence[tuple[int, ...]]
    seeds: Sequence[int]

    def flown(self, drag: Drag, report: Progress) -> Floats:
        """Return each robot's largest distance from its plan, m. Shape (corners, runs, robots).

        Args:
            drag: Of those whose drag has a range.
            report: Told how far it is.
        """
        robots, runs = len(self.reference.robots), len(self.seeds)
        flights = len(self.sides) * runs
        sensor = MotionCapture(noise=_NOISE)
        differences = Differences(self._each("latency"), self._each("mass"), self._each("thrust"), drag)
        start = np.tile(self.reference.start, (1, flights))
        fleet = Fleet(kinds_of(tuple(self.airframes), flights), CONTROLLERS.find(PROFILES), start, differences)
        draws = Draws(Conditions(LABORATORY, sensor), self.seeds, robots)
        air = Air((LABORATORY,), draws, [0] * len(self.sides))
        return peaks(self.reference, fleet, Chance(draws, sensor, air, len(self.sides), self._each("noise") / _NOISE), report)

    def _each(self, name: str) -> Floats:
        """Return a number of every vehicle. Shape (n,)."""
        ends = np.array([own[name] for own in self.own])  # (robots, 2)
        side = [side[self.names.index(name)] if name in self.names else 0 for side in self.sides]
        return np.concatenate([np.tile(ends[:, end], len(self.seeds)) for end in side])
