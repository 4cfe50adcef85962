"""Largest sums of what inputs do along a flight, for every frame in which they are read, every rounding counted.

All inputs' columns go on from frame to frame through the flight's maps. In each frame they are read, and their magnitudes are summed over the frames in which they
began: one by one the last ones, then in blocks, in which an input counts as its largest. Frames that are longer ago than `KEPT` act by the states that they left,
of which the bounds are known.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from verify.arithmetic.balls import Floats, gamma
from verify.tracking.on_board.onboard_course import Course, Maps, maps_of
from verify.tracking.on_board.onboard_loop import (
    BODY,
    GYRO,
    LIFT,
    LINKED,
    OLDER,
    PLACE,
    SEEN,
    SUBSTEPS,
    SUMS,
    TURNED,
)
from verify.tracking.on_board.onboard_responses import weights_of

KEPT = 400
"""Frames for which responses are summed; what is older is bounded by the states that it left."""
EVERY = 4
"""Frames between those whose states are followed."""
BLOCKS = (1, 2, 3, 4, 5, 7, 9, 13, 17, 25, 33, 49, 65, 97, 129, 193, 257, 321)
"""Frames ago at which blocks begin; block 0 is the frame itself."""
INPUTS = {
    "body": 16, "asked": 4, "lift": 1, "turned": 1, "gyroscope": 1, "wind": 1, "estimate": 9, "position": 1, "attitude": 1, "dropped": 3,
    "setpoint": 4,
}  # fmt: skip
"""Inputs in their order, by how many numbers bound them; those that are vectors are bounded by their lengths."""
_ENDS = np.cumsum([0, *INPUTS.values()])
INPUT = {name: slice(int(first), int(end)) for name, first, end in zip(INPUTS, _ENDS, _ENDS[1:], strict=False)}
COUNT = int(_ENDS[-1])
STEPPED = 24
_COLUMNS = 5 * 28 + 18 + 12
OUTPUTS = 48 + 16 + 3 + 4 + 6 + 4 + 4
ENTERED, MOVING, FORCING, ASKING, APART, SENSED, SUMMED = (
    slice(a, b) for a, b in ((0, 48), (48, 64), (64, 67), (67, 71), (71, 77), (77, 81), (81, 85))
)
"""Outputs: states when a frame begins; at any step of it body and rotors, force, thrusts asked for; at its end place and attitude estimated less those seen,
gyroscopes and lift, sums."""
LENGTH = OUTPUTS
"""Of the place."""
Short = NDArray[np.float32]
Either = NDArray[np.floating]

SINGLE = 2.0**-23
"""Spacing of the floats in which magnitudes are read."""


@dataclass(frozen=True, eq=False, slots=True)
class Sums:
    """Largest sums of what inputs do.

    Attributes:
        direct: Within a frame, by output (and the place's length), step in which it begins, and input of steps. Shape (frames, OUTPUTS + 1, SUBSTEPS, STEPPED).
        blocks: Later, by output, input and block; of inputs of steps as often as there are steps. Shape (frames, OUTPUTS + 1, COUNT, blocks).
        told: Within a frame, of its set-point. Shape (frames, OUTPUTS + 1, 4).
        begun: What a start off by a length of 1 does. Shape (frames, OUTPUTS + 1).
        steady: What lightness and strength do that are always 1. Shape (frames, 2, OUTPUTS + 1).
        older: Frame whose states stand for all that is older; -1 for none. Shape (frames,).
        left: What these within 1 do. Shape (frames, OUTPUTS + 1, LINKED).
        loose: What errors of all states within `weights` in every frame do. Shape (frames, OUTPUTS + 1).
        read: What is read of states within `weights`. Shape (frames, OUTPUTS + 1).
        weights: Of states. Shape (LINKED,).
        growth: Most by which rounding may grow within a frame, over those weights.
    """

    direct: Floats
    blocks: Short
    told: Floats
    begun: Floats
    steady: Floats
    older: NDArray[np.int64]
    left: Short
    loose: Floats
    read: Floats
    weights: Floats
    growth: float

    def driven(self, steps: Floats, jumps: Floats) -> Floats:
        """Return what inputs do at most. Shape (frames, OUTPUTS + 1).

        Args:
            steps: Bounds of inputs of steps. Shape (frames, SUBSTEPS, STEPPED).
            jumps: Bounds of those of jumps. Shape (frames, COUNT - STEPPED).
        """
        frames, ends = len(steps), (*BLOCKS[1:], KEPT + EVERY + 1)
        found = np.einsum("fosi,fsi->fo", self.direct, steps) + (self.told @ jumps[:, -4:, None])[..., 0]
        inputs = np.concatenate([steps.mean(1), jumps], axis=1) * (1.0 + 1e-12)
        for block, (first, end) in enumerate(zip(BLOCKS, ends, strict=True)):
            if first >= frames:
                break
            most = np.zeros_like(inputs)
            for ago in range(first, min(end, frames)):
                most[ago:] = np.maximum(most[ago:], inputs[: frames - ago])
            found += (self.blocks[..., block] @ most[..., None])[..., 0]
        return found * (1.0 + 1e-4)  # sums of hundreds of short floats


def sums_of(course: Course, *, chunk: int = 100) -> Sums:
    """Return the sums of a flight.

    Args:
        course: The flight.
        chunk: Frames whose maps are made at once.

    Raises:
        ArithmeticError: Rounding may be as large as the responses.
    """
    frames, outputs = course.frames, OUTPUTS + 1
    blocks = np.zeros((frames, outputs, COUNT, len(BLOCKS)), dtype=np.float32)
    direct, told = np.zeros((frames, outputs, SUBSTEPS, STEPPED)), np.zeros((frames, outputs, 4))
    begun, steady, loose, read = (np.zeros((frames, *shape)) for shape in ((outputs,), (2, outputs), (outputs,), (outputs,)))
    older, left = np.full(frames, -1), np.zeros((frames, outputs, LINKED), dtype=np.float32)
    columns, start, constant = _Columns(min(frames + 1, KEPT + 3 * EVERY)), np.zeros((LINKED, 3)), np.zeros((LINKED, 2))
    for rows in (PLACE, slice(23, 26), slice(36, 39), slice(42, 45)):
        start[rows] = np.eye(3)
    rounding: _Rough | None = None
    for frame, (tick, maps, index) in enumerate(_frames(course, chunk)):
        rounding = rounding or _Rough(weights_of(tick))
        columns.begin(frame)
        reading = _reading(course, maps, index)
        whole = np.concatenate([rows @ inside for rows, inside in zip(reading, _inside(maps, index), strict=True)])
        ends = np.cumsum([len(rows) for rows in reading])[:-1]
        direct[frame] = _direct(maps, index, reading)
        if frame:
            seen = np.abs(whole.astype(np.float32) @ columns.entered.astype(np.float32))
            blocks[frame] = _blocked(seen, ends)
        begun[frame] = _grouped([_triples(part)[:, 0] for part in np.split(whole @ start, ends)])
        moving = np.pad(constant, ((0, 0), (0, 12)))
        parts = [reading[0] @ moving]
        for j in range(SUBSTEPS):
            moving = maps.steps[index, j] @ moving + maps.held[index, j]
            parts.append(reading[j + 1] @ moving)
        steady[frame] = _grouped(_lengths([part[:, :2] for part in parts])).T
        told[frame] = _grouped([_triples(part[:, 2:]) for part in parts])
        rounding.grown(tick, maps, index)
        for found, size in ((loose, rounding.loose(whole, columns.begun)), (read, np.abs(whole) @ rounding.weights)):
            found[frame] = _grouped(_lengths([part[:, None] for part in np.split(size, ends)]))[:, 0]
        if columns.first:
            older[frame] = columns.first
            left[frame] = _grouped(_lengths([np.abs(part) for part in np.split(whole @ columns.begun[0], ends)]))
        columns.go_on(tick, _entering(maps, index, moving[:, 2:]))
        start, constant = tick @ start, maps.jumps[index] @ moving[:, :2]
    if rounding is None or not gamma(1000) * rounding.growth * loose.max() < 1e-4:
        raise ArithmeticError("rounding may be as large as the responses")
    return Sums(direct, blocks, told, begun, steady, older, left, loose, read, rounding.weights, rounding.growth)


class _Columns:
    """Columns of all inputs, as they are when a frame begins, oldest first.

    Attributes:
        first: Frame that is the first whose inputs are there.
        begun: What states have become that were 1 in one of every few frames from that one on.
    """

    def __init__(self, frames: int) -> None:
        self._window, self._size = np.zeros((LINKED, _COLUMNS * frames)), 0
        self.first, self.begun = 0, list[Floats]()

    @property
    def entered(self) -> Floats:
        """Columns that are there."""
        return self._window[:, : self._size]

    def begin(self, frame: int) -> None:
        """Follow the states of some frames, and leave inputs out that are long ago."""
        if frame % EVERY == 0:
            self.begun.append(np.eye(LINKED))
        if frame - self.first >= KEPT + EVERY:
            gone = EVERY * _COLUMNS
            self._window[:, : self._size - gone] = self._window[:, gone : self._size]
            self.first, self._size, self.begun = self.first + EVERY, self._size - gone, self.begun[1:]

    def go_on(self, tick: Floats, entering: Floats) -> None:
        """Go on to the next frame, at which others enter."""
        self._window[:, : self._size] = tick @ self.entered
        self._window[:, self._size : self._size + _COLUMNS] = entering
        self._size, self.begun = self._size + _COLUMNS, [tick @ each for each in self.begun]


class _Rough:
    """Bounds of what rounding leaves open.

    Attributes:
        weights: Of states. Shape (LINKED,).
        growth: Most by which rounding may grow within a frame, over those weights.
    """

    def __init__(self, weights: Floats) -> None:
        self.weights, self.growth, self._steep = weights, 1.0, 1.0

    def _norm(self, size: Floats) -> float:
        return float(np.max(size @ self.weights / self.weights))

    def grown(self, tick: Floats, maps: Maps, index: int) -> None:
        """Take a frame into account."""
        rough = np.abs(maps.jumps[index])
        for j in range(SUBSTEPS - 1, -1, -1):
            rough = rough @ np.abs(maps.steps[index, j])
        self.growth, self._steep = max(self.growth, self._norm(rough)), max(self._steep, self._norm(np.abs(tick)))

    def loose(self, whole: Floats, begun: list[Floats]) -> Floats:
        """Return what is read of errors within weights that began in any frame: in those that are followed, or a few before them."""
        following = np.abs(whole @ np.concatenate(begun, axis=1)).reshape(len(whole), -1, LINKED)
        within = sum(self._steep**k for k in range(EVERY))
        return ((following @ self.weights).sum(1) + np.abs(whole) @ self.weights) * within


def _frames(course: Course, chunk: int) -> Iterator[tuple[Floats, Maps, int]]:
    """Yield the map of each frame, with all maps of some and which it is."""
    for begin in range(0, course.frames, chunk):
        maps = maps_of(course, slice(begin, begin + chunk))
        for index in range(len(maps.jumps)):
            tick = maps.steps[index, 0]
            for j in range(1, SUBSTEPS):
                tick = maps.steps[index, j] @ tick
            yield maps.jumps[index] @ tick, maps, index


def _inside(maps: Maps, index: int) -> list[Floats]:
    """Return the maps from the frame's beginning to each of its steps."""
    found = [np.eye(LINKED)]
    for j in range(SUBSTEPS):
        found.append(maps.steps[index, j] @ found[-1])
    return found


def _reading(course: Course, maps: Maps, index: int) -> list[Floats]:
    """Return the rows that are read at the frame's beginning and at each step: place first. Shapes (rows, LINKED)."""
    force = np.zeros((3, LINKED))
    force[:, 23:32], force[:, SUMS] = course.loop.force[:, :9], course.loop.force[:, 12:15]
    one, apart = np.eye(LINKED), np.zeros((6, LINKED))
    seen = OLDER if course.loop.late >= SUBSTEPS else SEEN
    apart[:3, 23:26], apart[3:, 29:32] = np.eye(3), np.eye(3)
    apart[:, seen] -= np.eye(6)
    found = [np.concatenate([one, force, maps.laws[index, 0, :4]])]
    for j in range(1, SUBSTEPS):
        found.append(np.concatenate([one[:BODY], force, maps.laws[index, j, :4], one[[TURNED]]]))
    found.append(np.concatenate([one[:BODY], apart, one[GYRO], one[[LIFT]], one[SUMS], one[[TURNED]]]))
    return found


def _lengths(parts: Sequence[Floats]) -> list[Floats]:
    """Add to what is read at each step, place first, the length of the place, as the last row."""
    return [np.concatenate([np.abs(part), np.sqrt((part[:3] ** 2).sum(0))[None]]) for part in parts]


def _grouped(parts: Sequence[Either]) -> Either:
    """Return outputs, the largest of each at any step, of magnitudes with the place's length behind them. Shape (OUTPUTS + 1, ...)."""
    begin, steps, end = parts[0], parts[1:-1], parts[-1]
    found = np.zeros((OUTPUTS + 1, *begin.shape[1:]), dtype=begin.dtype)
    found[ENTERED] = begin[:LINKED]
    found[MOVING] = np.maximum.reduce([part[:BODY] for part in parts])
    found[FORCING] = np.maximum.reduce([begin[48:51], *(part[16:19] for part in steps)])
    found[ASKING] = np.maximum.reduce([begin[51:55], *(part[19:23] for part in steps)])
    found[APART], found[SENSED] = end[16:22], end[22:26]
    found[SUMMED] = np.maximum(np.concatenate([begin[SUMS], begin[[TURNED]]]), end[26:30])
    found[84] = np.maximum.reduce([found[84], *(part[23] for part in steps)])
    found[LENGTH] = np.maximum.reduce([part[-1] for part in parts])
    return found


def _direct(maps: Maps, index: int, reading: list[Floats]) -> Either:
    """Return what inputs of steps do within their frame. Shape (OUTPUTS + 1, SUBSTEPS, STEPPED)."""
    columns = np.zeros((LINKED, 0))
    parts: list[Either] = [np.zeros((len(reading[0]) + 1, SUBSTEPS, STEPPED))]
    for j in range(SUBSTEPS):
        columns = np.concatenate([maps.steps[index, j] @ columns, maps.stepped[index, j]], axis=1)
        size = np.abs(reading[j + 1] @ columns).reshape(len(reading[j + 1]), j + 1, 28)
        parts.append(np.pad(_vectors(size), ((0, 0), (0, SUBSTEPS - j - 1), (0, 0))))
    return _grouped(parts)


def _vectors(size: Either) -> Either:
    """Return magnitudes with those of vectors as lengths, and the place's length. Shape (rows, ..., 28) to (rows + 1, ..., STEPPED)."""
    found = np.empty((len(size) + 1, *size.shape[1:-1], STEPPED), dtype=size.dtype)
    found[:-1, ..., :22], found[-1, ..., :22] = size[..., :22], np.sqrt((size[:3, ..., :22] ** 2).sum(0))
    for column, at in ((22, 22), (23, 25)):
        vectors = size[..., at : at + 3]
        found[:-1, ..., column], found[-1, ..., column] = np.sqrt((vectors**2).sum(-1)), _norm(vectors[:3])
    return found


def _triples(columns: Either) -> Either:
    """Return lengths of vectors, and of what they make of the place. Shape (rows, ..., 3 k) to (rows + 1, ..., k)."""
    size = np.abs(columns).reshape(*columns.shape[:-1], -1, 3)
    length = np.stack([_norm(size[:3, ..., k, :]) for k in range(size.shape[-2])], axis=-1)
    return np.concatenate([np.sqrt((size**2).sum(-1)), length[None]])


def _norm(size: Either) -> Either:
    """Bound norms of matrices, by magnitudes. Shape (3, ..., 3) to (...)."""
    return np.sqrt(size.sum(0).max(-1) * size.sum(-1).max(0))


def _blocked(seen: Short, ends: NDArray[np.int64]) -> Short:
    """Return sums of magnitudes, by blocks of frames in which inputs began. Shape (OUTPUTS + 1, COUNT, blocks)."""
    ages = seen.shape[1] // _COLUMNS
    begins = [0, *(ages - ago + 1 for ago in reversed(BLOCKS[1:]) if ago <= ages)]  # of blocks, oldest first
    parts = list[Floats]()
    for part in np.split(seen.reshape(len(seen), ages, _COLUMNS), ends):
        steps, jumps = part[..., :140].reshape(len(part), ages, SUBSTEPS, 28), part[..., 140:]
        found = np.empty((len(part) + 1, ages, COUNT), dtype=seen.dtype)
        each = _vectors(steps)
        found[..., :22], found[..., 22:STEPPED] = SUBSTEPS * each[..., :22].max(2), each[..., 22:].sum(2)
        found[:-1, :, 24:33], found[-1, :, 24:33] = jumps[..., :9], np.sqrt((jumps[:3, :, :9] ** 2).sum(0))
        for column, at in ((33, 9), (34, 12)):
            found[:-1, :, column] = np.sqrt((jumps[..., at : at + 3] ** 2).sum(-1))
            found[-1, :, column] = _norm(jumps[:3, :, at : at + 3])
        found[:-1, :, 35:38], found[-1, :, 35:38] = jumps[..., 15:18], np.sqrt((jumps[:3, :, 15:18] ** 2).sum(0))
        found[:, :, 38:42] = _triples(jumps[..., 18:30])
        parts.append(np.add.reduceat(found, begins, axis=1))
    sums = _grouped(parts)[:, ::-1]  # newest first
    found = np.zeros((OUTPUTS + 1, COUNT, len(BLOCKS)), dtype=seen.dtype)
    found[:, :, : sums.shape[1]] = sums.swapaxes(1, 2)
    return found


def _entering(maps: Maps, index: int, told: Floats) -> Floats:
    """Return the columns of all inputs of a frame when the next one begins; `told` is what its set-point has left."""
    columns = np.zeros((LINKED, 0))
    for j in range(SUBSTEPS):
        columns = np.concatenate([maps.steps[index, j] @ columns, maps.stepped[index, j]], axis=1)
    return np.concatenate([maps.jumps[index] @ columns, maps.jumped[index], maps.jumps[index] @ told], axis=1)
