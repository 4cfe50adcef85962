"""Options for reading a recording, which its files do not give: names, the start of the flight, the recording's frame."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np

from flight.model.attitude import Floats
from verify.data import BadInput
from verify.data.errors import did_you_mean
from verify.data.names.former_names import former_arguments, warn_former
from verify.recordings.measurement import LARGEST

Axes = tuple[tuple[int, float], tuple[int, float], tuple[int, float]]
"""For the mission's x, y and z the index of the recording's axis, and 1 or -1."""

SAME: Axes = ((0, 1.0), (1, 1.0), (2, 1.0))
"""The recording's axes are the mission's."""

_AXIS = re.compile(r"(-?)([xyz])")


@dataclass(frozen=True)
class RecordingOptions:
    """Options for reading a recording.

    Attributes:
        start: When the flight began on the recording's clock, s; one and the same instant on each robot's own clock, by robot; None
            where nobody says it.
        start_error: How far that may be off, s.
        rename: The recording's names of robots, and of a table's columns: `{"quad0": "cf231", "t": "Frame time"}`.
        axes: The mission's x, y, z as axes of the recording ("x,-z,y" where its y points up); empty takes what its format says.
        origin: Where the recording's origin lies in the mission's frame, m, by robot; "" is for all others.
    """

    start: float | Mapping[str, float] | None = None
    start_error: float = 0.0
    rename: Mapping[str, str] = field(default_factory=dict)
    axes: str = ""
    origin: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)

    def names(self, robots: Sequence[str]) -> tuple[str, ...]:
        """Return what the recording calls each robot.

        Args:
            robots: Names in the mission.

        Raises:
            BadInput: Two robots are called the same, or something is said of a robot that the mission does not have.
        """
        found = tuple(self.rename.get(robot, robot) for robot in robots)
        twice = sorted({name for name in found if found.count(name) > 1})
        if twice:
            both = " and ".join(robot for robot, name in zip(robots, found, strict=True) if name == twice[0])
            raise BadInput(f"{both} are both called '{twice[0]}' in the recording; each robot has a name of its own.")
        for what, given in (("origin", set(self.origin) - {""}), ("start", self._started())):
            for name in sorted(given - set(robots)):
                raise BadInput(f"the {what} of '{name}' is given, which is no robot.{did_you_mean(name, robots)}")
        return found

    def columns(self, robots: Sequence[str]) -> dict[str, str]:
        """Return what the recording calls anything but the robots."""
        return {ours: theirs for ours, theirs in self.rename.items() if ours not in robots}

    def no_columns(self, robots: Sequence[str], what: str) -> None:
        """Reject names of columns for what has none.

        Args:
            robots: Names in the mission.
            what: What it is, with its article.

        Raises:
            BadInput: Something but a robot is given a name.
        """
        for ours in self.columns(robots):
            raise BadInput(f"'{ours}' is no robot ({', '.join(robots)}), and {what} has no columns that could be called so.")

    @property
    def began(self) -> tuple[float, float] | None:
        """From when to when the flight may have begun, s from the start that is told; None where nobody says it.

        How far starts on several clocks may be off is part of their times' own error.
        """
        if self.start is None:
            return None
        off = 0.0 if isinstance(self.start, Mapping) else self.start_error
        return (0.0 - off, off)

    def require_start_only(self, source: str) -> None:
        """Reject to be told more of a log of ours than when the flight began on its clock.

        Args:
            source: Names the log in messages.

        Raises:
            BadInput: As said.
        """
        if self.axes or self.origin or isinstance(self.start, Mapping):
            raise BadInput(
                f"{source} is a log of ours, on one clock and in the mission's frame: for it only one start may be given."
            )

    def begins(self, robots: Sequence[str]) -> dict[str, Fraction] | None:
        """Return when the flight began on each robot's clock, exactly; None where nobody says it.

        Raises:
            BadInput: It is no time, or not said of every robot.
        """
        if not 0 <= self.start_error < math.inf:
            raise BadInput(f"start_error must be a time in s of at least 0, not {self.start_error!s:.40}.")
        if self.start is None:
            return None
        if not isinstance(self.start, Mapping):
            return dict.fromkeys(robots, exact_time(self.start))
        for robot in robots:
            if robot not in self.start:
                raise BadInput(
                    f"start says when the flight began for {', '.join(self.start)}, but not for {robot}; say it for every robot."
                )
        return {robot: exact_time(self.start[robot]) for robot in robots}

    def in_mission(self, position: Floats, robots: Sequence[str], usual: Axes) -> tuple[Floats, tuple[str, ...]]:
        """Return positions in the mission's frame, and what was done to them in sentences.

        Args:
            position: m, in the recording's frame. Shape (samples, robots, 3).
            robots: Names in the mission.
            usual: Axes that the format says, where no others are told.

        Raises:
            BadInput: There are no such axes or no such origin.
        """
        axes = _axes(self.axes) if self.axes else usual
        notes: list[str] = []
        if axes != SAME:
            position = np.stack([sign * position[..., index] for index, sign in axes], axis=-1)
            named = ", ".join(
                f"{ours} is {'-' * (sign < 0)}{'xyz'[index]}" for ours, (index, sign) in zip("xyz", axes, strict=True)
            )
            notes.append(f"Of the mission's axes {named} of the recording.")
        if self.origin:
            position = position.copy()
            for j, robot in enumerate(robots):
                place = self.origin.get(robot, self.origin.get("", (0.0, 0.0, 0.0)))
                if len(place) != 3 or not all(math.isfinite(value) for value in place):
                    raise BadInput(f"an origin is three finite numbers in m, not {place!s:.60}.")
                position[:, j] += np.array(place)
                notes.append(
                    f"The origin of {robot}'s positions lies at ({', '.join(f'{x:g}' for x in place)}) m of the mission."
                )
        return position, tuple(notes)

    def _started(self) -> set[str]:
        return set(self.start) if isinstance(self.start, Mapping) else set()

    @property
    def called(self) -> Mapping[str, str]:
        """Former name of `rename`."""
        warn_former("`called`", "`rename`")
        return self.rename


RecordingOptions.__init__ = former_arguments(called="rename")(RecordingOptions.__init__)


def exact_time(start: float) -> Fraction:
    """Return the decimal that a start was meant as: tables hold decimals, and floats print as the shortest one.

    Args:
        start: s.

    Raises:
        BadInput: It is no such number.
    """
    number = not isinstance(start, bool) and isinstance(start, int | float)  # pyright: ignore[reportUnnecessaryIsInstance]  # a caller may err
    if not number or not abs(start) <= LARGEST:
        raise BadInput(f"start must be a time of the recording, in s, within {LARGEST:g}, not {start!s:.40}.")
    return Fraction(repr(float(start))) if isinstance(start, float) else Fraction(start)


def _axes(text: str) -> Axes:
    """Read axes such as "x,-z,y".

    Raises:
        BadInput: They are none, not all three, or mirror the world.
    """
    found: list[tuple[int, float]] = []
    for part in text.split(","):
        match = _AXIS.fullmatch(part.strip())
        if match is None:
            break
        found.append(("xyz".index(match[2]), -1.0 if match[1] else 1.0))
    if len(found) != 3 or sorted(index for index, _ in found) != [0, 1, 2]:
        raise BadInput(
            f"axes are the mission's x, y and z in the recording's axes, such as x,-z,y where its y points up; not {text[:40]!r}."
        )
    turned = np.zeros((3, 3))
    for row, (index, sign) in enumerate(found):
        turned[row, index] = sign
    if np.linalg.det(turned) < 0:
        raise BadInput(f"the axes {text[:40]} mirror the world; of x, y and z in these directions one has the wrong sign.")
    return (found[0], found[1], found[2])
