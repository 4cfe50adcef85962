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
    ROTORS,
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
FORCE, ASKED, LAGGING = slice(N, N + 3), slice(N + 3, N + 7), slice(N + 7, N + 11)
AWAY, TIPPED, WIDE = slice(N + 11, N + 14), slice(N + 14, N + 17), slice(N + 17, N + 17 + COVARIANCES)
"""Of what is bounded beside the states: force, thrusts that are asked for, these less those that are there; before jumps place and attitude that are
estimated less those that are seen, and the covariance."""
KNOWN = np.r_[23:32, 9:12, 16:20, 20:23]
"""States that the law takes: estimate, rates, sums, last errors of the rates."""


class BoardLoop:
    """A vehicle under `mellinger` on its filter: laws, linear loop and responses.

    Attributes:
        motion: Slopes of velocity, attitude and rates by `beside_motion`'s variables, as the loop has them. Shape (9, 22).
        filtered: Of the filter by `beside_filter`'s. Shape (54, 70).
        told: Force and thrusts that are asked for, by set-points: place, speed, acceleration, rates. Shape (7, 12).
        terms: Magnitudes of the linear law, by what it takes. Shape (4, 19).
        gyro: Magnitudes of what errors of gyroscopes add to thrusts that are asked for. Shape (4, 3).
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
        self.motion = _middle(self._motion, 22)
        self.motion[:, 21] = 0.0
        self._aim = _middle(self._aimed, 6)
        self.filtered = self._filter_slopes()
        force, law, estimate = self._linear()
        setpoint = -np.concatenate([law[:, 0:6], np.zeros((5, 3)), law[:, 9:12]], axis=1)
        setpoint[:, 6:9] = vehicle.mass * self.lawful(self._aim[:, :3])
        heave = np.concatenate([-force[:, 0:6], vehicle.mass * np.eye(3), np.zeros((3, 3))], axis=1)
        self.told = np.concatenate([heave, setpoint[:4]])
        self.frame, self.flow = frame_of(Linear(self.motion[:, :21], law, estimate, setpoint, airframe.rotor_lag, late))
        self.terms = np.abs(law[:4])
        self.gyro, self.unsettled = np.abs(law[:4, 9:12]), self._settling(frames)
        self.responses = Responses(self.frame, frames, *self._rows(force, law))

    def beside_motion(self, sizes: Floats, around: Floats) -> Floats:
        """Bound how far the derivatives of velocity, attitude and rates change beside linear ones, from any middle on. Shape (9,).

        Args:
            sizes: How far from the middle are velocity, attitude, rates, thrusts (13), thrusts asked for (4), the air (3), and what lightness and drag are beside 1 (2).
            around: How far the middle is from the hover.
        """
        return _beside(self._motion, self.motion, sizes, around)

    def beside_aim(self, sizes: Floats, around: Floats) -> Floats:
        """Bound how far lift and errors of attitude change beside linear ones. Shape (4,).

        Args:
            sizes: How far from the middle are force and attitude. Shape (6,).
            around: How far the middle is from the hover.
        """
        return _beside(self._aimed, self._aim, sizes, around)

    def beside_filter(self, sizes: Floats, around: Floats) -> Floats:
        """Bound how far the filter and its covariance change beside linear ones. Shape (54,).

        Args:
            sizes: How far from the middle are the place less the one seen, speed, attitude, gyroscopes (3 each), lift (1), attitude less the one seen, errors of place and attitude
                seen, what is dropped (3 each), covariance (45).
            around: How far the middle is from the hover.
        """
        return _beside(self._estimate, self.filtered, sizes, around)

    def beside_lift(self, sizes: Floats, around: Floats) -> float:
        """Bound how far the acceleration along the body's z changes beside that along the world's.

        Args:
            sizes: How far from the middle are attitude and acceleration. Shape (6,).
            around: How far the middle is from the hover.
        """
        return float(_beside(_lifted, np.eye(6)[[5]], sizes, around)[0])

    def known(self, name: str, values: Floats) -> tuple[Floats, Floats]:
        """Return what a law is beside its linear one at many instants, and how far off that may be. Shapes (outputs, instants).

        Args:
            name: `motion`, `aim`, `filter` or `lift`.
            values: Of the law's variables. Shape (variables, instants).
        """
        laws = {
            "motion": (self._motion, self.motion),
            "aim": (self._aimed, self._aim),
            "filter": (self._estimate, self.filtered),
        }
        law, linear = laws.get(name, (_lifted, np.eye(6)[[5]]))
        found, straight = law(Slopes.known(values)).value, linear @ values
        off = 0.5 * (found.high - found.low) + gamma(len(values) + 4) * (np.abs(linear) @ np.abs(values) + np.abs(found.high))
        return 0.5 * (found.low + found.high) - straight, off

    def _motion(self, v: Slopes) -> Slopes:
        return self.body.motion(v[0:13], v[13:17], v[17:20], (1.0 + v[20], 1.0 + v[21]))

    def _aimed(self, v: Slopes) -> Slopes:
        return self.law.aimed(v[0:3], v[3:6])

    def _estimate(self, v: Slopes) -> Slopes:
        return _estimated(self.filter, self.spread, v)

    def _filter_slopes(self) -> Floats:
        """Return the slopes of the filter, as the loop has them: a covariance that is off changes no estimate, and places count by their differences."""
        found = _middle(self._estimate, 70)
        found[:9, 25:] = 0.0
        found[:, 16:19] = -found[:, 0:3]
        found[:3, 16:19] += np.eye(3)
        found[:, 19:22] = -found[:, 13:16]
        return found

    def _linear(self) -> tuple[Floats, Floats, Floats]:
        """Return force, law and filter as the loop has them, by states."""
        gains, count = self.gains, self.law.count
        position, velocity, integral = (np.array(part) for part in (gains.position, gains.velocity, gains.integral))
        turns = count * np.array([0.5, -0.5, 1.0])
        force = np.zeros((3, 19))
        force[:, 0:3], force[:, 3:6], force[:, 12:15] = -np.diag(position + H * integral), -np.diag(velocity), np.diag(integral)
        aimed = self._aim[:, :3] @ force
        aimed[:, 6:9] += self._aim[:, 3:6]
        law, quick = self.lawful(aimed), np.array(gains.rate_change) / H
        law[1, 15] += count * gains.attitude_integral[2]
        law[[2, 3, 1], [9, 10, 11]] -= turns * (np.array(gains.rate) + quick)
        law[[2, 3, 1], [16, 17, 18]] -= turns * quick
        law[4, 9:] = 0.0
        law[4, 15] = 1.0
        f = self.filtered
        seen = f[:, 6:9] + f[:, 13:16]
        estimate = np.concatenate([f[:, 0:6], seen, f[:, 9:13], f[:, 16:19], f[:, 19:22], f[:, 22:25], f[:, 25:]], axis=1)
        return force, law, estimate

    def lawful(self, aimed: Floats) -> Floats:
        """Return what rotors strive for, and what the sum about z takes, of lift and errors of attitude. Shape (4, k) to (5, k)."""
        gains, count = self.gains, self.law.count
        turn = gains.attitude[2] + H * gains.attitude_integral[2]
        factors = (-count * turn, -0.5 * count * gains.attitude[0], 0.5 * count * gains.attitude[1], -H)
        return np.stack([aimed[0], *(factor * aimed[row] for factor, row in zip(factors, (3, 1, 2, 3), strict=True))])

    def lawful_size(self, aimed: Floats) -> Floats:
        """Return what `lawful` does at most, of magnitudes."""
        return np.abs(self.lawful(np.abs(aimed)))

    def _rows(self, force: Floats, law: Floats) -> tuple[Floats, Floats]:
        """Return the rows of what is bounded after jumps and steps, and before jumps."""
        outputs, ends = np.zeros((N + 11, N)), np.zeros((6 + COVARIANCES, N))
        outputs[:N] = np.eye(N)
        outputs[FORCE, KNOWN[:9]], outputs[FORCE, SUMS] = force[:, :9], force[:, 12:15]
        outputs[ASKED, KNOWN] = law[:4]
        outputs[LAGGING] = outputs[ASKED]
        outputs[LAGGING, ROTORS] -= np.eye(4)
        ends[:3, 23:26], ends[3:6, 29:32], ends[6:, SPREAD] = np.eye(3), np.eye(3), np.eye(COVARIANCES)
        ends[:6, OLDER if self.late >= SUBSTEPS else SEEN] -= np.eye(6)
        return outputs, ends

    def _settling(self, frames: int) -> Floats:
        """Bound what is left of how far the covariance was off at the start."""
        now, most = np.eye(COVARIANCES), np.zeros(COVARIANCES)
        for _ in range(frames + 1):
            most = np.maximum(most, np.abs(now).sum(1))
            now = self.filtered[9:, 25:] @ now
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
            step = np.linalg.solve(np.eye(COVARIANCES) - found.slope.low[9:, 25:], step)
        spread = np.asarray(spread + UNIT * step[INDEX], dtype=np.float64)
        if np.abs(step).max() < 1e-10:
            break
    return spread


def _middle(law: Callable[[Slopes], Slopes], count: int) -> Floats:
    """Return the slopes of a law at the hover (not rounded to a side)."""
    slope = law(Slopes.variables(np.zeros(count))).slope
    return 0.5 * (slope.low + slope.high)


def _beside(law: Callable[[Slopes], Slopes], linear: Floats, sizes: Floats, around: Floats) -> Floats:
    """Bound how far a law changes beside a linear one, for all variables within their sizes of any middle."""
    found = law(Slopes.variables(sizes, around))
    apart = np.maximum(np.abs(found.slope.high - linear), np.abs(found.slope.low - linear))
    return apart @ sizes * (1.0 + 1e-9)
