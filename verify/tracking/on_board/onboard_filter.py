"""The extended Kalman filter that a vehicle has on board, as a law in slopes: after Mueller, Hamer and D'Andrea (ICRA 2015), as the Crazyflie has it.

It predicts 100 times a second from the means of gyroscopes and of the acceleration along the body's z, and takes a measured place and attitude. It has speed
and small turns in body axes; here they are in the world's, where little of it depends on the attitude.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Floats
from verify.data.autopilot import FilterNoise
from verify.data.vehicle import GRAVITY
from verify.tracking.on_board.rotations import (
    along,
    applied,
    bent,
    conjugate,
    crossed,
    estimated,
    flown,
    half_turn,
    halves,
    little,
    product,
    skew,
    tilting,
    turned,
)
from verify.tracking.on_board.slopes import Slopes, joined, magnitude, root, stacked

FRAME = 0.01
"""s between two estimates and set-points."""
NOISE_STEPS = 10
"""Times in a frame that the filter adds noise."""


@dataclass(frozen=True, eq=False, slots=True)
class Filter:
    """The extended Kalman filter.

    Attributes:
        noise: That it assumes.
    """

    noise: FilterNoise

    @property
    def variances(self) -> tuple[float, float]:
        """Of a position and of an attitude that are measured."""
        return self.noise.position_noise**2, self.noise.attitude_noise**2

    @property
    def rough(self) -> Floats:
        """Variance that a frame adds. Shape (9,)."""
        short = FRAME / NOISE_STEPS
        acceleration, gyro = np.array(self.noise.acceleration_noise), np.array(self.noise.gyro_noise)
        return NOISE_STEPS * np.concatenate([acceleration * short * short, acceleration * short, gyro * short]) ** 2

    # six parameters: the estimate, its covariance, and what is sensed
    def after(
        self,
        place: Slopes,
        speed: Slopes,
        attitude: Slopes,
        spread: Slopes,
        sensed: tuple[Slopes, Slopes],
        seen: tuple[Slopes, Slopes, Slopes],
    ) -> tuple[Slopes, Slopes, Slopes, Slopes]:
        """Return place, speed, attitude and covariance a frame later.

        The filter has speed and small turns in body axes. Here they are in the world's, in which little of it depends on the attitude.

        Args:
            place: m. Shape (3,).
            speed: m/s. Shape (3,).
            attitude: Shape (3,).
            spread: Covariance of place, speed and small turns. Shape (9, 9).
            sensed: Means of gyroscopes and of the acceleration along the body's z. Shapes (3,) and ().
            seen: Place and attitude that are measured, and what is dropped of the correction of the attitude. Shape (3,) each.
        """
        gyro, lift = sensed
        q, small = estimated(attitude), FRAME * gyro
        turn = turned(q)
        place = place + FRAME * speed + (0.5 * FRAME * FRAME) * (turn[:, 2] * lift)
        place = stacked([place[0], place[1], place[2] - 0.5 * FRAME * FRAME * GRAVITY])
        p, (first, share) = applied(turn.T, speed), little(small)
        # p + dt (p x w) - dt g R'e_z + dt a e_z in body axes, turned by the gyroscopes: the world has V - dt g e_z of it already
        bend, rest = bent(first), bent(first, (2.0 * first[0] * share - 1.0) * small)
        moved = applied(rest, p) + applied(bend, crossed(p, small) - (FRAME * GRAVITY) * turn[2])
        moved = moved + (FRAME * lift) * stacked([bend[0, 2], bend[1, 2], 1.0 + bend[2, 2]])
        speed = speed + applied(turn, moved)
        speed = stacked([speed[0], speed[1], speed[2] - FRAME * GRAVITY])
        w, x, y, cosine, sine = halves(attitude)
        about = 1.0 - 2.0 * (sine * sine), 2.0 * (sine * cosine)
        first = stacked(
            [first[0], about[0] * first[1] - about[1] * first[2], about[0] * first[2] + about[1] * first[1], first[3]]
        )
        tilted = product(stacked([w, x, y, 0.0 * w]), first)
        q = product(tilted, stacked([cosine, 0.0 * w, 0.0 * w, sine]))
        spread, turn = self._predicted(spread, (turn, applied(turn, bend)), p, small)
        state, spread = self._placed(joined([place, speed, 0.0 * small]), spread, seen[0])
        off = product(flown(seen[1]), conjugate(q))
        state, spread = self._turned(state, spread, turn, 2.0 * off[1:4] / off[0])
        last, _ = little(self._corrected(state[6:9], turn, seen[2]))
        bend = bent(last)
        # the body's z axis says the tilt, whatever the heading
        f = first
        axis = applied(
            tilting(attitude),
            2.0 * stacked([f[1] * f[3] + f[0] * f[2], f[2] * f[3] - f[0] * f[1], 0.5 - (f[1] * f[1] + f[2] * f[2])]),
        )
        axis, tilted = axis + applied(bend, axis), product(last, tilted)
        whole = root(tilted[0] * tilted[0] + tilted[3] * tilted[3])
        found = stacked([-axis[1], axis[0], 2.0 * ((sine * tilted[0] + cosine * tilted[3]) / whole)])
        return state[0:3], state[3:6] + applied(bend, state[3:6]), found, carried(bend, spread)

    def _predicted(self, spread: Slopes, turns: tuple[Slopes, Slopes], p: Slopes, small: Slopes) -> tuple[Slopes, Slopes]:
        """Return the covariance before what is seen, and the attitude then; `turns` are the attitude and what it turns by."""
        turn, change = turns
        now, back = turn + change, turn.T
        speed, zero = applied(turn, p), 0.0 * p
        leaning = FRAME * skew(speed, 0.0)
        # R1 (I - [s x]) R' and R1 half(s) R', less the unit matrix
        kept = applied(turn, applied(bent_by(small, 1.0), back))
        half = applied(turn, applied(bent_by(small, 0.5), back))
        up = stacked([zero[0], zero[0], zero[0] + 1.0])
        tipped = (FRAME * GRAVITY) * skew(up, 0.0)
        tipped = tipped + applied(applied(change, back), tipped)
        for _ in range(2):
            speeds, turned_rows = spread[3:6], spread[6:9]
            rows = (
                spread[0:3] + FRAME * speeds + applied(leaning, turned_rows),
                speeds + applied(kept, speeds) + applied(tipped, turned_rows),
                turned_rows + applied(half, turned_rows),
            )
            spread = joined(rows).T
        rough = self.rough
        up = now[:, 2]
        noise = rough[3] * np.eye(3) + (rough[5] - rough[3]) * outer(up, up)
        spread = spread + np.diag([*rough[:3], 0.0, 0.0, 0.0, *rough[6:]])
        wide = spread[3:6]
        spread = joined([spread[0:3], joined_columns(wide[:, 0:3], wide[:, 3:6] + noise, wide[:, 6:9]), spread[6:9]])
        return self._floored(spread), now

    @staticmethod
    def _corrected(correction: Slopes, turn: Slopes, dropped: Slopes) -> Slopes:
        """Return a correction of the attitude less what is dropped of it in body axes, which is all or nothing."""
        found = correction - applied(turn, dropped)
        size = magnitude(turn)
        return found.within(np.einsum("ij...,kj...,k...->i...", size, size, magnitude(correction)) * (1.0 + 1e-12))

    def _placed(self, state: Slopes, spread: Slopes, seen: Slopes) -> tuple[Slopes, Slopes]:
        for k in range(3):
            gain = spread[:, k] / (spread[k, k] + self.variances[0])
            state = state + gain * (seen[k] - state[k])
            spread = self._floored(spread - outer(gain, spread[k]))
        return state, spread

    def _turned(self, state: Slopes, spread: Slopes, turn: Slopes, error: Slopes) -> tuple[Slopes, Slopes]:
        """Take the attitude's three numbers along the body's axes; `error` is in the world's.

        Were the variance far above the covariance, they would add the covariance over the variance times the error. What they add beside that is small.
        """
        variance, columns = self.variances[1], spread[:, 6:9]
        gains, pulls = list[Slopes](), list[Slopes]()
        state = state + applied_wide(columns, error) * (1.0 / variance)
        lost = applied_wide(columns, spread[6:9]) * (1.0 / variance)
        for i in range(3):
            axis = turn[:, i]
            whole = applied_wide(columns, axis)
            pull = whole
            for gain, before in zip(gains, pulls, strict=True):
                pull = pull - gain * along(before[6:9], axis)
            size = along(pull[6:9], axis)
            total = size + variance
            beside = ((pull - whole) - whole * (size * (1.0 / variance))) / total
            gain = pull / total
            state = state + beside * along(axis, error)
            lost = lost + outer(beside, pull) + outer(whole * (1.0 / variance), pull - whole)
            gains.append(gain)
            pulls.append(pull)
        return state, self._floored(spread - lost)

    def _floored(self, spread: Slopes) -> Slopes:
        """Return the covariance with no variance of a place below the least; that of speeds and turns stays above it in all axes.

        Raises:
            ArithmeticError: It may not.
        """
        least = self.noise.least_variance
        low, size = spread.value.low, magnitude(spread)
        for part in (slice(3, 6), slice(6, 9)):
            beside = size[part, part].sum(1) - size[part, part].diagonal().T
            if not np.all(low[part, part].diagonal().T - beside > 1.001 * least):
                raise ArithmeticError("a variance of the filter may reach its least")
        floor = np.full((9, 9), -np.inf)
        floor[range(3), range(3)] = least
        return spread.at_least(floor)


def carried(bend: Slopes, spread: Slopes) -> Slopes:
    """Return a covariance whose speeds and turns are turned by a matrix, of which the unit matrix is taken."""
    for _ in range(2):
        spread = joined([spread[0:3], spread[3:6] + applied(bend, spread[3:6]), spread[6:9] + applied(bend, spread[6:9])]).T
    return spread


def joined_columns(*parts: Slopes) -> Slopes:
    """Put matrices side by side."""
    return joined([part.T for part in parts]).T


def applied_wide(columns: Slopes, vector: Slopes) -> Slopes:
    """Return three columns times a vector of three, or a matrix of three rows."""
    if vector.value.low.ndim < columns.value.low.ndim:
        return sum((columns[:, k] * vector[k] for k in (1, 2)), start=columns[:, 0] * vector[0])
    return sum((outer(columns[:, k], vector[k]) for k in (1, 2)), start=outer(columns[:, 0], vector[0]))


def bent_by(small: Slopes, share: float) -> Slopes:
    """Return D (I - [share s x] + ...) less the unit matrix, where D turns by s; to second order in s / 2 where the share is a half."""
    turn = bent(little(small)[0])
    seen = skew(small, 0.0) if share == 1.0 else half_turn(small) - np.eye(3)
    return turn + seen + applied(turn, seen)


def outer(a: Slopes, b: Slopes) -> Slopes:
    """Return the products of all pairs."""
    return a[:, None] * b[None, :]
