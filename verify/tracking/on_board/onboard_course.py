"""The linear loops along an undisturbed flight: what laws do near it, step by step, as maps of the states' errors.

A frame begins behind a jump, at which the filter takes what the cameras saw; five steps follow. Maps are exact by choice: what the laws are beside them is counted
as inputs. Body and rotors move in continuous time; their maps over a step are series whose rounding is far below what `SLOP` counts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Floats
from verify.tracking.on_board.onboard_laws import KNOWN, BoardLoop
from verify.tracking.on_board.onboard_loop import (
    BODY,
    DRIVEN,
    ESTIMATE,
    GYRO,
    LIFT,
    LINKED,
    MOTION,
    OLDER,
    PLACE,
    RATES,
    ROTORS,
    SEEN,
    SLIP,
    SPEED,
    SUBSTEPS,
    SUMS,
    TILT,
    TURNED,
    H,
)
from verify.tracking.on_board.onboard_plan import Followed
from verify.tracking.on_board.slopes import Slopes

_TERMS = 24
_CHUNK = 64
"""Instants at which slopes are found at once."""


@dataclass(frozen=True, eq=False, slots=True)
class Course:
    """Slopes of all laws along an undisturbed flight.

    Attributes:
        loop: What flies.
        motion: Slopes of the motion in the middle of each step. Shape (frames, SUBSTEPS, 13, 22).
        aim: Of the aim at the start of each step. Shape (frames, SUBSTEPS, 4, 6).
        lift: Of the acceleration that is felt in each step. Shape (frames, SUBSTEPS, 6).
        filtered: Of the filter at the end of each frame. Shape (frames, 54, 70).
        asked: Thrusts that are asked for. Shape (frames, SUBSTEPS, 4).
        rate: Bounds of the derivatives of body and rotors. Shape (frames, SUBSTEPS, BODY).
        bent: Bounds of their second derivatives. Shape (BODY,).
    """

    loop: BoardLoop
    flight: Followed
    motion: Floats
    aim: Floats
    lift: Floats
    filtered: Floats
    asked: Floats
    rate: Floats
    bent: Floats

    @classmethod
    def of(cls, loop: BoardLoop, flight: Followed) -> Course:
        """Take the slopes of all laws along a flight.

        Args:
            loop: What flies.
            flight: Undisturbed.
        """
        middles = flight.middles
        motion, aim, lift, filtered = (slopes(law, middles[name])[0] for name, law in loop.laws.items())
        lift = lift[:, 0]
        loop.arranged(filtered)
        frames = len(filtered)
        body = flight.values[:, :, :BODY]
        linear = np.abs(loop.flow.derivative)
        bent = linear @ flight.quickest * (1.0 + 1e-9)
        rate = np.abs(np.diff(body, axis=1)) / H + 2.0 * flight.off[:BODY] / H + H * bent
        shape = (frames, SUBSTEPS)
        return cls(
            loop, flight, motion.reshape(*shape, 13, 22), aim.reshape(*shape, 4, 6), lift.reshape(*shape, 6), filtered,
            flight.asked, rate, bent,
        )  # fmt: skip

    @property
    def frames(self) -> int:
        """Of the flight."""
        return len(self.filtered)

    def derivative(self, part: slice) -> tuple[Floats, Floats]:
        """Return derivatives of body and rotors, by these and by thrusts that are asked for. Shapes (frames, SUBSTEPS, BODY, BODY) and (..., 4)."""
        motion, fast = self.motion[part], 1.0 / self.loop.airframe.rotor_lag
        found = np.zeros((*motion.shape[:2], BODY, BODY + 4))
        found[..., PLACE, SPEED] = np.eye(3)
        found[..., DRIVEN, 3:] = motion[..., :17]
        found[..., ROTORS, ROTORS] -= fast * np.eye(4)
        found[..., ROTORS, BODY:] += fast * np.eye(4)
        return found[..., :BODY], found[..., BODY:]

    def laws(self, part: slice) -> Floats:
        """Return what rotors strive for, and the sum about z, by states. Shape (frames, SUBSTEPS, 5, LINKED)."""
        found = np.zeros((*self.aim[part].shape[:2], 5, LINKED))
        found[..., KNOWN] = self.loop.law_of(self.aim[part])
        return found

    def setpoints(self, part: slice) -> Floats:
        """Return what set-points are to the law. Shape (frames, SUBSTEPS, 5, 12)."""
        return self.loop.setpoint_of(self.aim[part], self.loop.law_of(self.aim[part]))


@dataclass(frozen=True, eq=False, slots=True)
class Maps:
    """Maps of some frames.

    Attributes:
        steps: Shape (frames, SUBSTEPS, LINKED, LINKED).
        jumps: At the ends of frames. Shape (frames, LINKED, LINKED).
        laws: As `Course.laws`.
        stepped: What inputs of a step within 1 leave at its end: body (16), thrusts asked for (4), lift, the sum about z, gyroscopes (3), air (3).
            Shape (frames, SUBSTEPS, LINKED, 28).
        jumped: What inputs of a jump leave: estimate (9), errors of place and attitude seen (3 each), what is dropped (3). Shape (frames, LINKED, 18).
        held: What lightness, strength and set-points (12) that are off by 1 leave in each step. Shape (frames, SUBSTEPS, LINKED, 14).
    """

    steps: Floats
    jumps: Floats
    laws: Floats
    stepped: Floats
    jumped: Floats
    held: Floats


def maps_of(course: Course, part: slice) -> Maps:
    """Return the maps of some frames.

    Args:
        course: The flight.
        part: Which frames.
    """
    loop, laws = course.loop, course.laws(part)
    shape = laws.shape[:2]
    body, asked = course.derivative(part)
    over = H * body
    term = H * np.broadcast_to(np.eye(BODY), body.shape)
    held = term
    for k in range(2, _TERMS):
        term = term @ over / k
        held = held + term
    state, asked = np.eye(BODY) + held @ body, held @ asked
    steps = np.zeros((*shape, LINKED, LINKED))
    steps[..., BODY:, BODY:] = np.eye(LINKED - BODY)
    steps[..., SLIP, SLIP] = 0.0
    steps[..., TURNED, TURNED] = 0.0
    steps[..., :BODY, :BODY] = state
    steps[..., :BODY, :] += asked @ laws[..., :4, :]
    steps[..., SUMS, 23:26] = -H * np.eye(3)
    steps[..., TURNED, :] = laws[..., 4, :]
    steps[..., SLIP, RATES] = -np.eye(3)
    steps[..., GYRO, RATES] = 0.2 * np.eye(3)
    lift = course.lift[part]

    def felt(columns: Floats) -> None:
        """Add what the means of accelerations take of what moves body and rotors in a step."""
        tilt, speed = columns[..., TILT, :], columns[..., SPEED, :]
        columns[..., LIFT, :] += 0.2 * (lift[..., None, :3] @ tilt + (1.0 / H) * (lift[..., None, 3:] @ speed))[..., 0, :]

    felt(steps)
    steps[..., LIFT, SPEED] -= (0.2 / H) * lift[..., 3:]
    gyro = loop.law_gyro
    moved = held[..., :, MOTION] @ course.motion[part][..., :9, 17:21]
    stepped = np.zeros((*shape, LINKED, 28))
    stepped[..., :BODY, :16] = np.eye(BODY)
    stepped[..., :BODY, 16:20] = asked
    stepped[..., :BODY, 22:25] = asked @ gyro
    stepped[..., :BODY, 25:28] = moved[..., :3]
    felt(stepped)
    stepped[..., LIFT, 20] = 0.2
    stepped[..., TURNED, 21] = 1.0
    stepped[..., SLIP, 22:25] = -np.eye(3)
    stepped[..., GYRO, 22:25] = 0.2 * np.eye(3)
    told = np.zeros((*shape, LINKED, 14))
    told[..., :BODY, 0] = moved[..., 3]
    strong = course.asked[part] + np.array([1.0, 0.0, 0.0, 0.0])
    told[..., :BODY, 1] = (asked @ strong[..., None])[..., 0]
    setpoint = course.setpoints(part)
    told[..., :BODY, 2:] = asked @ setpoint[..., :4, :]
    felt(told)
    told[..., SUMS, 2:5], told[..., TURNED, 2:], told[..., SLIP, 11:] = H * np.eye(3), setpoint[..., 4, :], np.eye(3)
    last = SUBSTEPS - 1 - loop.late % SUBSTEPS  # after which the cameras see
    for each in (steps, stepped, told):
        each[:, last, 36:39], each[:, last, 39:42] = each[:, last, PLACE], each[:, last, TILT]
    jumps = np.zeros((shape[0], LINKED, LINKED))
    jumps[:, range(LINKED), range(LINKED)] = 1.0
    for rows in (GYRO, slice(LIFT, LIFT + 1), OLDER, ESTIMATE):
        jumps[:, rows] = 0.0
    jumps[:, OLDER, SEEN] = np.eye(6)
    f = course.filtered[part]
    seen = OLDER if loop.late >= SUBSTEPS else SEEN
    jumps[:, ESTIMATE, 23:29] = f[:, :9, 0:6]
    jumps[:, ESTIMATE, 29:32] = f[:, :9, 6:9] + f[:, :9, 13:16]
    jumps[:, ESTIMATE, 32:36] = f[:, :9, 9:13]
    jumps[:, ESTIMATE, seen] = f[:, :9, 16:22]
    jumped = np.zeros((shape[0], LINKED, 18))
    jumped[:, ESTIMATE, :9] = np.eye(9)
    jumped[:, ESTIMATE, 9:] = f[:, :9, 16:25]
    return Maps(steps, jumps, laws, stepped, jumped, told)


def slopes(
    law: Callable[[Slopes], Slopes], middles: Floats, size: Floats | float = 0.0, around: Floats | float = 0.0
) -> tuple[Floats, Floats]:
    """Return slopes of a law at many instants, and how far off they may be. Shapes (instants, outputs, variables).

    Args:
        law: The law.
        middles: Of its variables. Shape (variables, instants).
        size: By how much variables are off from middles. The same shape.
        around: By how much middles are off.
    """
    size, around = size + 0.0 * middles, around + 0.0 * middles
    found = list[tuple[Floats, Floats]]()
    for first in range(0, middles.shape[1], _CHUNK):
        part = slice(first, first + _CHUNK)
        one = law(Slopes.about(middles[:, part], size[:, part], around[:, part]))
        found.append((np.moveaxis(one.slope, 1, 0), np.moveaxis(one.wide, 1, 0)))
    slope, wide = zip(*found, strict=True)
    return np.concatenate(slope), np.concatenate(wide)
