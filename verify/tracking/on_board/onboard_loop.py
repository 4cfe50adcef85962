"""The linear loop of a vehicle that `mellinger` flies on its filter.

A frame of 10 ms begins with a jump, at which the filter takes what the cameras saw; five steps of 2 ms follow, each with the controller's law, the motion
of body and rotors under what it asks for, and what the sensors add up. The loop is linear by choice: what laws and motion are beside it are inputs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from flint import arb, arb_mat, ctx

from verify.arithmetic.balls import Floats, gamma
from verify.tracking.sampled_loop import GROW, Matrix

SUBSTEPS = 5
"""Steps on board in a frame."""
H = 0.002
"""s of a step on board."""
STATES = (
    *("x", "y", "z", "vx", "vy", "vz", "ex", "ey", "ez", "wx", "wy", "wz", "tu", "tz", "ty", "tx"),
    *("Ix", "Iy", "Iz", "Ih", "sx", "sy", "sz"),
    *("X", "Y", "Z", "VX", "VY", "VZ", "EX", "EY", "EZ"),
    *("gx", "gy", "gz", "lift"),
    *("rx", "ry", "rz", "rex", "rey", "rez", "ox", "oy", "oz", "oex", "oey", "oez"),
)
PLACE, SPEED, TILT, RATES, ROTORS = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12), slice(12, 16)
SUMS, TURNED, SLIP = slice(16, 19), 19, slice(20, 23)
ESTIMATE, GYRO, LIFT = slice(23, 32), slice(32, 35), 35
SEEN, OLDER = slice(36, 42), slice(42, 48)
LINKED = len(STATES)
"""Of the states, those that act on each other; behind them stands the filter's covariance, which only follows."""
COVARIANCES = 45
SPREAD = slice(LINKED, LINKED + COVARIANCES)
N = LINKED + COVARIANCES
FILTERED = np.r_[ESTIMATE, SPREAD]
BODY = 16
"""Of the states, those of body and rotors."""
MOTION, DRIVEN = slice(3, 12), slice(3, 16)
"""Of these, velocity, attitude and rates; with thrusts: whose derivatives are not linear."""


@dataclass(frozen=True, eq=False, slots=True)
class Linear:
    """Linear laws, by choice: matrices of exact floats.

    Attributes:
        motion: Derivatives of velocity, attitude and rates, by these and rotors (13), what rotors strive for (4). Shape (9, 17).
        law: What rotors strive for, and what the sum about z takes, by estimate (9), rates (3), sums (4), last slips (3). Shape (5, 19).
        estimate: After the filter, of estimate and covariance, by estimate (9), gyroscopes (3), lift (1), place and attitude seen (6), covariance.
            Shape (54, 64).
        setpoint: As `law`, by set-points: place, speed, acceleration, rates. Shape (5, 12).
        lag: Of the rotors, s.
        late: Steps by which cameras are late.
    """

    motion: Floats
    law: Floats
    estimate: Floats
    setpoint: Floats
    lag: float
    late: int


@dataclass(frozen=True, eq=False, slots=True)
class Flow:
    """Body and rotors over a step.

    Attributes:
        state: Map of their states. Shape (BODY, BODY).
        asked: What rotors strive for. Shape (BODY, 4).
        pushed: Constant inputs of velocity, attitude, rates and thrusts. Shape (BODY, 13).
        derivative: Of their states, by them. Shape (BODY, BODY).
    """

    state: Matrix
    asked: Matrix
    pushed: Matrix
    derivative: Floats

    @classmethod
    def of(cls, linear: Linear) -> Flow:
        """Integrate exactly."""
        size = BODY + 4 + 13
        whole = np.zeros((size, size))
        whole[PLACE, SPEED] = np.eye(3)
        whole[MOTION, 3 : BODY + 4] = linear.motion
        whole[DRIVEN, BODY + 4 :] = np.eye(13)
        fast = 1.0 / linear.lag
        whole[ROTORS, ROTORS], whole[ROTORS, BODY : BODY + 4] = -fast * np.eye(4), fast * np.eye(4)
        before, ctx.prec = ctx.prec, 200
        try:
            exact = arb_mat([[arb(float(value)) for value in row] for row in whole])
            step = arb(2) / arb(1000)
            over = Matrix.of((exact * step).exp())
        finally:
            ctx.prec = before
        state, asked, pushed = (
            Matrix(over.mid[:BODY, columns], over.rad[:BODY, columns])
            for columns in (slice(0, BODY), slice(BODY, BODY + 4), slice(BODY + 4, None))
        )
        return cls(state, asked, pushed, whole[:BODY, :BODY])


@dataclass(frozen=True, eq=False, slots=True)
class Frame:
    """The maps of a frame, and the columns of its inputs.

    Attributes:
        step: Without the cameras' record. Shape (N, N).
        recorded: After which step cameras see, 1 to 5.
        jump: Shape (N, N).
        stepped: By name: what an input within 1 in a step leaves at its end. Shape (N, k) each.
        jumped: By name: what one at a jump leaves. Shape (N, k) each.
    """

    step: Matrix
    recorded: int
    jump: Matrix
    stepped: Mapping[str, Matrix]
    jumped: Mapping[str, Matrix]

    def see(self, values: Matrix, step: int) -> Matrix:
        """Return states after a step, with what the cameras see then."""
        if step != self.recorded:
            return values
        mid, rad = values.mid.copy(), values.rad.copy()
        for target, source in ((slice(36, 39), PLACE), (slice(39, 42), TILT)):
            mid[target], rad[target] = mid[source], rad[source]
        return Matrix(mid, rad)


def frame_of(linear: Linear) -> tuple[Frame, Flow]:
    """Return the maps of a frame, and those of body and rotors."""
    flow = Flow.of(linear)
    law, gyro = np.zeros((4, N)), linear.law[:4, 9:12]
    law[:, ESTIMATE], law[:, RATES], law[:, SUMS], law[:, SLIP] = (
        linear.law[:4, :9], gyro, linear.law[:4, 12:15], linear.law[:4, 16:19],
    )  # fmt: skip
    law[:, TURNED] = linear.law[:4, 15]
    lifting = np.eye(N)
    lifting[LIFT, 5] = 100.0  # 1 / 5 of a change of speed over 2 ms
    after = Matrix.exact(lifting)
    asked = _rows(flow.asked)
    keeping = np.eye(N)
    keeping[:BODY, :BODY] = 0.0
    keeping[SLIP] = 0.0
    keeping[SLIP, RATES] = -np.eye(3)
    keeping[SUMS, 23:26] = -H * np.eye(3)
    keeping[TURNED, ESTIMATE], keeping[TURNED, TURNED] = linear.law[4, :9], 1.0
    keeping[GYRO, RATES] = 0.2 * np.eye(3)
    keeping[LIFT, 5] = -100.0
    step = after @ total(Matrix.exact(keeping), _rows(flow.state, columns=BODY), asked @ Matrix.exact(law))
    stepped = {
        "motion": after @ _rows(flow.pushed),
        "asked": after @ asked,
        "turned": Matrix.exact(np.eye(N)[:, [TURNED]]),
        "lift": Matrix.exact(0.2 * np.eye(N)[:, [LIFT]]),
        "setpoint": total(after @ (asked @ Matrix.exact(linear.setpoint[:4])), Matrix.exact(_told(linear.setpoint[4]))),
    }
    jump = np.eye(N)
    jump[GYRO], jump[LIFT], jump[OLDER] = 0.0, 0.0, 0.0
    jump[OLDER, SEEN] = np.eye(6)
    jump[FILTERED] = 0.0
    seen = OLDER if linear.late >= SUBSTEPS else SEEN
    jump[np.ix_(FILTERED, np.r_[ESTIMATE, GYRO, [LIFT], seen, SPREAD])] = linear.estimate
    jumped = {"estimate": Matrix.exact(np.eye(N)[:, ESTIMATE]), "spread": Matrix.exact(np.eye(N)[:, SPREAD])}
    return Frame(step, SUBSTEPS - linear.late % SUBSTEPS, Matrix.exact(jump), stepped, jumped), flow


def _told(turned: Floats) -> Floats:
    """Return what a set-point leaves in sums and in what is remembered of rates, of what the sum about z takes of it."""
    found = np.zeros((N, 12))
    found[SUMS, 0:3], found[TURNED], found[SLIP, 9:12] = H * np.eye(3), turned, np.eye(3)
    return found


def _rows(values: Matrix, columns: int = 0) -> Matrix:
    """Return a matrix over all states of one over those of body and rotors."""
    width = N if columns else values.mid.shape[1]
    mid, rad = np.zeros((N, width)), np.zeros((N, width))
    mid[:BODY, : values.mid.shape[1]], rad[:BODY, : values.mid.shape[1]] = values.mid, values.rad
    return Matrix(mid, rad)


def total(*parts: Matrix) -> Matrix:
    """Return the sum of matrices."""
    mid = sum((p.mid for p in parts[1:]), start=parts[0].mid)
    size = sum((np.abs(p.mid) for p in parts[1:]), start=np.abs(parts[0].mid))
    rad = sum((p.rad for p in parts[1:]), start=parts[0].rad) + gamma(len(parts)) * size
    return Matrix(mid, rad * GROW)
