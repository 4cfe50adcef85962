"""One robot's flight as polynomials, exactly as it is exported.

Conventions, stated here once: clocks start at zero when the mission starts (the robot already hovers at its
start); coefficients are ascending powers of the piece's local time; before its first piece there is nothing, and
after its last piece the robot hovers where the polynomial ended.
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from numbers import Integral

import numpy as np
from numpy.typing import ArrayLike

from verify.data.arrays import Booleans, Floats
from verify.data.errors import BadInput

AXES = ("x", "y", "z", "yaw")
DEGREE = 7
MAX_PIECES = 4096
PIECES = 31
"""Pieces that the usual vehicle holds of one flight: a Crazyflie's 4096 bytes of trajectory memory, at 132 bytes a piece."""
PAUSE = 60.0
"""s that each pause between parts counts in a vehicle's endurance; whoever pauses for longer lands."""
HOVER = 1.0
"""s of a hover that nobody asked a duration of: a cycle that only hovers, or the second piece of a flight that would have one, which
crazyswarm2's loader does not read."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """One robot's flight: polynomials in local time, joined end to end.

    Attributes:
        durations: Length of each piece, in s, all positive and finite. Shape (pieces,), read-only float64.
        coefficients: x, y, z in m and yaw in rad; ascending powers of local time. Shape (pieces, 4, 8),
            read-only float64.
        cycle: Index of the first piece of the part that repeats for ever, or None for a finite flight.
        cuts: Index of each piece with which a new part begins, increasing: parts are uploaded one after another, while the robot
            rests. Empty for a flight that is uploaded whole. Where laps are, the lap begins with a part, and so each lap does.

    Raises:
        BadInput: Shapes do not fit, a number is not finite, a duration is not positive, there are no
            pieces or more than 4096 of them, or the cuts are not in order or not at pieces.
    """

    durations: Floats
    coefficients: Floats
    cycle: int | None = None
    cuts: tuple[int, ...] = ()

    def __init__(
        self, durations: ArrayLike, coefficients: ArrayLike, *, cycle: int | None = None, cuts: Sequence[int] = ()
    ) -> None:
        times, values = _frozen(durations, "durations"), _frozen(coefficients, "coefficients")
        if times.ndim != 1 or len(times) == 0:
            raise BadInput(f"durations must have shape (pieces,) with at least one piece, not {times.shape}.")
        if len(times) > MAX_PIECES:
            raise BadInput(f"{len(times)} pieces; a trajectory has at most {MAX_PIECES}.")
        if values.shape != (len(times), len(AXES), DEGREE + 1):
            raise BadInput(
                f"coefficients must have shape ({len(times)}, 4, 8) for {len(times)} durations (degree at most 7), "
                f"not {values.shape}."
            )
        _require(np.isfinite(times) & (times > 0), times, "durations", "a positive, finite number of seconds")
        _require(np.isfinite(values), values, "coefficients", "finite")
        if cycle is not None and (isinstance(cycle, bool) or not isinstance(cycle, Integral) or not 0 <= cycle < len(times)):
            raise BadInput(f"cycle must be the index of a piece, 0 to {len(times) - 1}, not {cycle!r:.40}.")
        object.__setattr__(self, "durations", times)
        object.__setattr__(self, "coefficients", values)
        object.__setattr__(self, "cycle", None if cycle is None else int(cycle))
        object.__setattr__(self, "cuts", _cuts(cuts, len(times), self.cycle))

    def __repr__(self) -> str:
        laps = "" if self.cycle is None else f", laps from piece {self.cycle}"
        parts = f", {len(self.parts)} parts" if self.cuts else ""
        return f"<Trajectory of {self.duration:.2f} s in {len(self)} pieces{laps}{parts}>"

    def __len__(self) -> int:
        return len(self.durations)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Trajectory) and self.digest() == other.digest()

    def __hash__(self) -> int:
        return hash(self.digest())

    @cached_property
    def knots(self) -> Floats:
        """Start of each piece and the end of the last, in s. Shape (pieces + 1,)."""
        return np.concatenate([[0.0], np.cumsum(self.durations)])

    @property
    def duration(self) -> float:
        """Length of the flight in s (of prefix and one cycle, where there is a cycle)."""
        return float(self.knots[-1])

    @property
    def is_float32(self) -> bool:
        """True if every number survives the vehicle's float32 unchanged."""
        return all(np.array_equal(a.astype(np.float32).astype(np.float64), a) for a in (self.durations, self.coefficients))

    def digest(self) -> str:
        """Return the SHA-256 of the exact numbers (and of where the cycle and parts start), in hexadecimal."""
        hasher = hashlib.sha256(b"trajectory-1 %d " % (-1 if self.cycle is None else self.cycle))
        if self.cuts:
            hasher.update(b"cuts %s " % ",".join(map(str, self.cuts)).encode())
        hasher.update(self.durations.astype("<f8").tobytes())
        hasher.update(self.coefficients.astype("<f8").tobytes())
        return hasher.hexdigest()

    def evaluate(self, times: ArrayLike, derivative: int = 0) -> Floats:
        """Return x, y, z and yaw, or a derivative of them, at mission times.

        Args:
            times: In s, any shape. Times after the end give the hover there (or the cycle, repeated); times
                before zero are refused.
            derivative: 0 for position and yaw, 1 for their rates, and so on.

        Returns:
            Shape (*times.shape, 4), in m and rad per s**derivative.

        Raises:
            BadInput: A time is not finite or before zero, or the derivative is negative.
        """
        at = np.asarray(times, dtype=np.float64)
        if not np.all(np.isfinite(at)) or np.any(at < 0):
            raise BadInput("times must be finite and not before the mission's start at 0 s.")
        if derivative < 0:
            raise BadInput(f"derivative must be 0 or more, not {derivative}.")
        ended = at > self.duration
        if self.cycle is not None:
            start, length = self.knots[self.cycle], self.duration - self.knots[self.cycle]
            at = np.where(ended, start + np.mod(at - start, length), at)
            ended = np.zeros_like(ended)
        at = np.minimum(at, self.duration)
        piece = np.clip(np.searchsorted(self.knots, at, side="right") - 1, 0, len(self) - 1)
        local = np.clip(at - self.knots[piece], 0.0, self.durations[piece])[..., None]
        coefficients = self.derivative_coefficients(derivative)[piece]
        values = np.zeros(coefficients.shape[:-1])
        for power in range(coefficients.shape[-1] - 1, -1, -1):
            values = values * local + coefficients[..., power]
        return np.where(ended[..., None], 0.0, values) if derivative else values

    def derivative_coefficients(self, derivative: int) -> Floats:
        """Return the ascending coefficients of a derivative. Shape (pieces, 4, max(8 - derivative, 1))."""
        values = self.coefficients
        for _ in range(min(derivative, DEGREE + 1)):
            values = values[..., 1:] * np.arange(1, values.shape[-1]) if values.shape[-1] > 1 else values * 0.0
        return values

    def flattened(self, laps: int) -> Trajectory:
        """Return what is flown: the prefix and `laps` copies of the cycle, as a finite flight.

        A finite flight is returned as it is.

        Raises:
            BadInput: There is no lap.
        """
        if laps < 1:
            raise BadInput(f"laps must be at least 1, not {laps}.")
        if self.cycle is None:
            return self
        index = np.concatenate([np.arange(self.cycle), np.tile(np.arange(self.cycle, len(self)), laps)])
        length = len(self) - self.cycle
        cuts = [cut for cut in self.cuts if cut < self.cycle]
        cuts += [cut + lap * length for lap in range(laps) for cut in self.cuts if cut >= self.cycle]
        return Trajectory(self.durations[index], self.coefficients[index], cuts=[cut for cut in cuts if cut > 0])

    @property
    def parts(self) -> tuple[tuple[int, int], ...]:
        """First piece of each part and the one behind its last, in order; of laps, prefix and one lap. One where nothing is cut."""
        return tuple(itertools.pairwise(sorted({0, *self.cuts, len(self)})))

    def flown_parts(self, laps: int) -> tuple[int, ...]:
        """Return the index in `parts` of what is flown, in order: the prefix, and a number of laps."""
        parts = self.parts
        first = next((i for i, (begin, _) in enumerate(parts) if begin == self.cycle), len(parts))
        return (*range(first), *(tuple(range(first, len(parts))) * laps))

    def paused(self, pauses: Sequence[float]) -> Trajectory:
        """Return a finite flight in parts as it is flown: uncut, with a hover at each cut.

        Args:
            pauses: Length of each, s, one for each cut; 0 for none.

        Raises:
            BadInput: It has laps, there are more or fewer cuts, or a pause is no length of time.
        """
        if self.cycle is not None:
            raise BadInput("It has laps; say with `flattened` how many of them are flown before saying where it paused.")
        if len(pauses) != len(self.cuts):
            raise BadInput(
                f"{len(pauses)} pauses are given; the flight is in {len(self.cuts) + 1} parts, so {len(self.cuts)} are asked for."
            )
        times, pieces = list[Floats](), list[Floats]()
        for (begin, end), pause in zip(self.parts, (0.0, *pauses), strict=True):
            if pause != 0:
                hover = np.zeros((1, len(AXES), DEGREE + 1))
                hover[0, :, 0] = self.coefficients[begin, :, 0]
                times.append(np.array([pause], dtype=np.float64))
                pieces.append(hover)
            times.append(self.durations[begin:end])
            pieces.append(self.coefficients[begin:end])
        return Trajectory(np.concatenate(times), np.concatenate(pieces))

    def part(self, begin: int, end: int) -> Trajectory:
        """Return some of the pieces as a finite flight.

        Args:
            begin: Its first piece.
            end: The piece behind its last.
        """
        return Trajectory(self.durations[begin:end], self.coefficients[begin:end])


def check_trajectories(team: Mapping[str, Trajectory]) -> dict[str, Trajectory]:
    """Return a team's trajectories made anew from their numbers, whatever was put into them behind their back.

    Raises:
        BadInput: It is no table of trajectories, or their numbers are not allowed.
    """
    if not isinstance(team, Mapping) or not team:  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
        raise BadInput("A team is a table from each robot's name to its Trajectory.")
    checked: dict[str, Trajectory] = {}
    for name, trajectory in team.items():
        if not isinstance(trajectory, Trajectory):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
            raise BadInput(f"{name} must be given a Trajectory, not {type(trajectory).__name__}.")
        try:
            numbers = trajectory.durations, trajectory.coefficients
            checked[name] = Trajectory(*numbers, cycle=trajectory.cycle, cuts=trajectory.cuts)
        except AttributeError:
            raise BadInput(f"{name}: its Trajectory has no numbers; it was never made.") from None
        except BadInput as error:
            raise BadInput(f"{name}: {error}") from None
    return checked


def _cuts(cuts: Sequence[int], pieces: int, cycle: int | None) -> tuple[int, ...]:
    """Return cuts as a tuple of ints.

    Raises:
        BadInput: They are not, or not in order, or not at pieces, or a lap does not begin with one of them.
    """
    given = list(cuts)
    if any(isinstance(cut, bool) or not isinstance(cut, Integral) for cut in given):
        raise BadInput(f"cuts must be indices of pieces, not {str(given)[:60]}.")
    least = 0 if cycle == 0 else 1
    if any(b <= a for a, b in itertools.pairwise(given)) or (given and not least <= given[0] <= given[-1] < pieces):
        raise BadInput(
            f"cuts must be indices of pieces from {least} to {pieces - 1}, each greater than the one before, not {str(given)[:60]}."
        )
    if given and cycle is not None and cycle not in given:
        raise BadInput(
            f"the lap begins with piece {cycle}, and so does a part of a flight that is cut; cuts are {str(given)[:60]}."
        )
    return tuple(int(cut) for cut in given)


def _frozen(values: ArrayLike, name: str) -> Floats:
    try:
        array = np.array(values, dtype=np.float64, order="C", copy=True)
    except (TypeError, ValueError) as error:
        raise BadInput(f"{name} must be an array of numbers: {error}.") from None
    array.setflags(write=False)
    return array


def _require(good: Booleans, values: Floats, name: str, what: str) -> None:
    if not np.all(good):
        where = tuple(int(i) for i in np.argwhere(~good)[0])
        raise BadInput(f"{name}[{', '.join(map(str, where))}] is {values[where]}; it must be {what}.")
