"""The laws of a vehicle on board, linear ones near them, and how far they are apart: what the proof of a hover is made of."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from verify.arithmetic.balls import Floats, gamma
from verify.data.airframe import AirframeTable
from verify.data.autopilot import Autopilot
from verify.data.vehicle import GRAVITY, Vehicle
from verify.tracking.on_board.onboard_filter import Filter
from verify.tracking.on_board.onboard_loop import (
    COVARIANCES,
    OLDER,
    SEEN,
    SPREAD,
    SUBSTEPS,
    SUMS,
    H,
    Linear,
    N,
    frame_of,
)
from verify.tracking.on_board.onboard_model import Body, Law
from verify.tracking.on_board.onboard_responses import Responses
from verify.tracking.on_board.rotations import along, flown, turned
from verify.tracking.on_board.slopes import Slopes, joined, stacked

PAIRS = [(i, j) for i in range(9) for j in range(i, 9)]
INDEX = np.array([[PAIRS.index((min(i, j), max(i, j))) for j in range(9)] for i in range(9)])
UNIT = 1e-6
"""Of covariances, that they are near 1."""
SETTLED = 1e-4
"""Most by which the covariance is off at the start, in its unit, of a filter that has settled."""
FORCE, ASKED = slice(N, N + 3), slice(N + 3, N + 7)
"""Of what is read beside the states: force and thrusts that are asked for."""
KNOWN = np.r_[23:32, 9:12, 16:20, 20:23]
"""States that the law takes: estimate, rates, sums, last errors of the rates."""


class BoardLoop:
    """A vehicle under `mellinger` on its filter: laws, linear loop and responses.

    Attributes:
        laws: `motion`, `aim`, `lift` and `filter`.
        hover: Their slopes at the hover, as the loop has them.
        force: What is asked for as a force, by what the law takes. Shape (3, 19).
        law_gyro: What errors of gyroscopes add to thrusts that are asked for. Shape (4, 3).
        told: Force and thrusts that are asked for, by set-points: place, speed, acceleration, rates. Shape (7, 12).
        unsettled: Bound of how far the covariance may still be off. Shape (COVARIANCES,).
    """

    def __init__(self, vehicle: Vehicle, airframe: AirframeTable, autopilot: Autopilot, late: int, frames: int) -> None:
        """Take what flies.

        Args:
            vehicle: Its mass, arm and rotors.
            airframe: Its lag and drag.
            autopilot: Its gains and filter.
            late: Steps by which cameras are late.
            frames: Of the flight.

        Raises:
            ArithmeticError: There is no proof with such gains.
        """
        if (gains := autopilot.mellinger) is None:
            raise ArithmeticError(f"the autopilot '{autopilot.name}' has no gains of `mellinger`")
        if any(airframe.body_drag) or any(gains.attitude_integral[:2]):
            raise ArithmeticError("drag of the body, and sums of errors of the tilt, are not in the model of `mellinger`")
        self.vehicle, self.airframe, self.gains, self.late = vehicle, airframe, gains, late
        self.body, self.law, self.filter = Body(vehicle, airframe), Law(vehicle, gains), Filter(autopilot.ekf)
        self.spread = _settled(self.filter)
        self.laws: dict[str, Callable[[Slopes], Slopes]] = {
            "motion": self._motion,
            "aim": self._aimed,
            "lift": _lifted,
            "filter": self._estimate,
        }
        self.hover = {name: _middle(law, count) for (name, law), count in zip(self.laws.items(), (22, 6, 6, 70), strict=True)}
        self.hover["motion"][:, 21], self.hover["lift"] = 0.0, np.eye(6)[[5]]
        self.hover["filter"] = self.arranged(self.hover["filter"])
        position, velocity, integral = (np.diag(part) for part in (gains.position, gains.velocity, gains.integral))
        self.force = np.zeros((3, 19))
        self.force[:, 0:3], self.force[:, 3:6], self.force[:, 12:15] = -position - H * integral, -velocity, integral
        law = self.law_of(self.hover["aim"])
        self.law_gyro = law[:4, 9:12]
        setpoint = self.setpoint_of(self.hover["aim"], law)
        heave = np.concatenate([-self.force[:, 0:6], vehicle.mass * np.eye(3), np.zeros((3, 3))], axis=1)
        self.told = np.concatenate([heave, setpoint[:4]])
        linear = Linear(self.hover["motion"][:9, :17], law, self._linear(), setpoint, airframe.rotor_lag, late)
        self.frame, self.flow = frame_of(linear)
        self.unsettled = self._settling(frames)
        self.responses = Responses(self.frame, frames, *self._rows(law))

    def known(self, name: str, values: Floats) -> tuple[Floats, Floats]:
        """Return what a law is beside its linear one at many instants, and how far off that may be. Shapes (outputs, instants).

        Args:
            name: `motion`, `aim`, `filter` or `lift`.
            values: Of the law's variables. Shape (variables, instants).
        """
        linear = self.hover[name]
        found, straight = self.laws[name](Slopes.known(values)).value, linear @ values
        off = 0.5 * (found.high - found.low) + gamma(len(values) + 4) * (np.abs(linear) @ np.abs(values) + np.abs(found.high))
        return 0.5 * (found.low + found.high) - straight, off

    def law_of(self, aim: Floats) -> Floats:
        """Return what rotors strive for, and the sum about z, by what the law takes. Shape (..., 4, 6) to (..., 5, 19).

        Args:
            aim: Slopes of the aim by force and attitude.
        """
        gains, count = self.gains, self.law.count
        aimed = aim[..., :3] @ self.force
        aimed[..., 6:9] += aim[..., 3:6]
        law, quick, turns = self.lawful(aimed), np.array(gains.rate_change) / H, count * np.array([0.5, -0.5, 1.0])
        law[..., 1, 15] += count * gains.attitude_integral[2]
        law[..., [2, 3, 1], [9, 10, 11]] -= turns * (np.array(gains.rate) + quick)
        law[..., [2, 3, 1], [16, 17, 18]] -= turns * quick
        law[..., 4, 15] += 1.0
        return law

    def setpoint_of(self, aim: Floats, law: Floats) -> Floats:
        """Return what set-points are to the law: place, speed, acceleration, rates. Shape (..., 5, 12).

        Args:
            aim: Slopes of the aim.
            law: As `law_of` returns it.
        """
        found = -np.concatenate([law[..., 0:6], 0.0 * law[..., 0:3], law[..., 9:12]], axis=-1)
        found[..., 6:9] = self.vehicle.mass * self.lawful(aim[..., :3])
        return found

    @staticmethod
    def arranged(found: Floats) -> Floats:
        """Return slopes of the filter as loops have them: a covariance that is off changes no estimate, and places count by their differences. Shape (..., 54, 70)."""
        found[..., :9, 25:] = 0.0
        found[..., 16:19] = -found[..., 0:3]
        found[..., :3, 16:19] += np.eye(3)
        found[..., 19:22] = -found[..., 13:16]
        return found

    def _motion(self, v: Slopes) -> Slopes:
        return self.body.motion(v[0:13], v[13:17], v[17:20], (1.0 + v[20], 1.0 + v[21]))

    def _aimed(self, v: Slopes) -> Slopes:
        return self.law.aimed(v[0:3], v[3:6])

    def _estimate(self, v: Slopes) -> Slopes:
        return _estimated(self.filter, self.spread, v)

    def _linear(self) -> Floats:
        """Return the filter as the loop at the hover has it, by states."""
        f = self.hover["filter"]
        return np.concatenate([f[:, 0:6], f[:, 6:9] + f[:, 13:16], f[:, 9:13], f[:, 16:22], f[:, 25:]], axis=1)

    def lawful(self, aimed: Floats) -> Floats:
        """Return what rotors strive for, and what the sum about z takes, of lift and errors of attitude. Shape (4, k) to (5, k)."""
        gains, count = self.gains, self.law.count
        turn = gains.attitude[2] + H * gains.attitude_integral[2]
        factors = (-count * turn, -0.5 * count * gains.attitude[0], 0.5 * count * gains.attitude[1], -H)
        rows = (aimed[..., 0, :], *(factor * aimed[..., row, :] for factor, row in zip(factors, (3, 1, 2, 3), strict=True)))
        return np.stack(rows, axis=-2)

    def lawful_size(self, aimed: Floats) -> Floats:
        """Return what `lawful` does at most, of magnitudes."""
        return np.abs(self.lawful(np.abs(aimed)))

    def _rows(self, law: Floats) -> tuple[Floats, Floats]:
        """Return the rows of what is bounded after jumps and steps, and before jumps."""
        outputs, ends = np.zeros((N + 7, N)), np.zeros((6 + COVARIANCES, N))
        outputs[:N] = np.eye(N)
        outputs[FORCE, KNOWN[:9]], outputs[FORCE, SUMS] = self.force[:, :9], self.force[:, 12:15]
        outputs[ASKED, KNOWN] = law[:4]
        ends[:3, 23:26], ends[3:6, 29:32], ends[6:, SPREAD] = np.eye(3), np.eye(3), np.eye(COVARIANCES)
        ends[:6, OLDER if self.late >= SUBSTEPS else SEEN] -= np.eye(6)
        return outputs, ends

    def _settling(self, frames: int) -> Floats:
        """Bound what is left of how far the covariance was off at the start."""
        now, most = np.eye(COVARIANCES), np.zeros(COVARIANCES)
        for _ in range(frames + 1):
            most = np.maximum(most, np.abs(now).sum(1))
            now = self.hover["filter"][9:, 25:] @ now
        return 1.001 * SETTLED * most


def _estimated(filter_: Filter, spread: Floats, v: Slopes) -> Slopes:
    """Return estimate and covariance a frame later, the place less the one that is seen; variables as of `beside_filter`."""
    covariance = UNIT * stacked([v[25 + INDEX[i]] for i in range(9)]) + spread
    seen = v[16:19], v[6:9] - v[13:16] + v[19:22], v[22:25]
    place, speed, attitude, after = filter_.after(v[0:3], v[3:6], v[6:9], covariance, (v[9:12], v[12] + GRAVITY), seen)
    return joined([place, speed, attitude, *((1.0 / UNIT) * (after[i, i:] - spread[i, i:]) for i in range(9))])


def _lifted(v: Slopes) -> Slopes:
    """Return the acceleration along the body's z, less gravity's, of attitude and acceleration."""
    up = turned(flown(v[0:3]))[:, 2]
    return stacked([along(up, v[3:6]) + GRAVITY * (up[2] - 1.0)])


def _settled(filter_: Filter) -> Floats:
    """Return the covariance at which a hover's settles, by Newton's method; how far it is off is a remainder."""
    spread: Floats = np.diag([1e-6] * 3 + [2e-4] * 3 + [1e-5] * 3)
    for k in range(40):
        found = _estimated(filter_, spread, Slopes.variables(np.zeros(70)))
        step = found.centre.low[9:]
        if k > 6:
            step = np.linalg.solve(np.eye(COVARIANCES) - found.slope[9:, 25:], step)
        spread = np.asarray(spread + UNIT * step[INDEX], dtype=np.float64)
        if np.abs(step).max() < 1e-10:
            break
    return spread


def _middle(law: Callable[[Slopes], Slopes], count: int) -> Floats:
    """Return the slopes of a law at the hover (not rounded to a side)."""
    return law(Slopes.variables(np.zeros(count))).slope
