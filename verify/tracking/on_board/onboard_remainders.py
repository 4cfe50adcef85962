"""Remainders of a flight on board: what laws are beside linear ones, for all that bounds allow, as inputs of the loop.

Laws are bounded by slopes about the undisturbed flight: between any point of it and any that bounds allow.
"""

from __future__ import annotations

import numpy as np

from verify.arithmetic.balls import Floats
from verify.data.disturbance import Disturbance
from verify.tracking.error_model import NotProved
from verify.tracking.on_board.onboard_course import Course, slopes
from verify.tracking.on_board.onboard_laws import ASKED, FORCE
from verify.tracking.on_board.onboard_loop import BODY, COVARIANCES, DRIVEN, PLACE, ROTORS, SPEED, SUBSTEPS, TILT, H
from verify.tracking.on_board.onboard_model import SIGNS
from verify.tracking.on_board.onboard_sums import APART, ASKING, FORCING, SENSED, SUMMED

_ROOM = 1.5, 1.15
"""Factors from what slopes are asked for, at first and then, to the box for which they are found, so that they need not be found at each round."""
_SLACK = 1e-11
"""What the rounding of numbers near 1 may leave open."""


class Remainders:
    """Bounds of remainders, under bounds of errors.

    Attributes:
        rate: Bounds of the derivatives of the errors of body and rotors, as they were found last. Shape (frames, BODY).
    """

    def __init__(self, course: Course, told: Disturbance) -> None:
        """Take a flight and what disturbs it."""
        loop, plan = course.loop, course.flight
        self._course, self._told, self._loop, self._plan = course, told, loop, plan
        self._shape = course.frames, SUBSTEPS
        self._apart = max(told.latency[1] - H * loop.late, H * loop.late - told.latency[0], 0.0)
        body, asked = course.derivative(slice(None))
        self._body, self._by_asked = np.abs(body), np.abs(asked)
        self._held, self._curved = _held(body)
        self._own = np.abs(course.motion[..., :13] - loop.hover["motion"][:, :13])
        self._strong = np.abs(course.asked + np.array([1.0, 0.0, 0.0, 0.0]))
        self._settles = _powers(loop.hover["filter"][9:, 25:], course.frames)
        self._loose = np.sqrt(3.0) * plan.rest["setpoint"].reshape(4, 3).max(1) * (1.0 + 1e-9)
        by_setpoint = np.linalg.norm(course.setpoints(slice(None))[..., :4, :].reshape(*self._shape, 4, 4, 3), axis=-1)
        self._by_setpoint = by_setpoint @ self._loose
        self._force = np.linalg.norm(loop.told[:3].reshape(3, 4, 3), axis=-1) @ self._loose
        self._slopes: dict[str, tuple[Floats, Floats]] = {}
        self._last = False
        self.rate = np.zeros((course.frames, BODY))

    def forget(self) -> None:
        """Find slopes anew when they are asked for next, for no wider a box."""
        self._slopes.clear()
        self._last = True

    def allowed(self, e: Floats, between: Floats, spread: Floats) -> tuple[dict[str, Floats | float], Floats]:
        """Return bounds of all inputs, and of the covariance.

        Args:
            e: Bounds of outputs. Shape (frames, OUTPUTS + 1).
            between: Of body and rotors at all times. Shape (frames, BODY).
            spread: Of the covariance before jumps. Shape (frames, COVARIANCES).

        Raises:
            NotProved: A clip that is not followed may act, or a rotor stand still.
        """
        told, rest, least = self._told, self._plan.rest, self._loop.filter.noise.least_turn
        short, off, asked = self._asked(e, np.linalg.norm(self._loop.law_gyro, axis=1) * told.gyroscope)
        moved, self.rate = self._moved(between, asked)
        place, turn = self._seen(between)
        estimate, after = self._filtered(e, spread, place, turn)
        return {
            "body": moved, "asked": off + rest["asked"], "lift": (self._felt(between) + rest["lift"])[..., None],
            "turned": (H * short[..., 3] + rest["turned"])[..., None], "gyroscope": told.gyroscope, "wind": told.wind,
            "position": place[:, None, None], "attitude": turn[:, None, None], "dropped": least,
            "estimate": estimate[:, None], "setpoint": self._loose,
        }, after  # fmt: skip

    def _besides(self, name: str, sizes: Floats, linear: Floats) -> Floats:
        """Bound how far a law changes beside a linear one. Shape (..., variables) to (..., outputs)."""
        many = sizes.reshape(-1, sizes.shape[-1])
        if name not in self._slopes or not np.all(many <= self._slopes[name][0]):
            # slopes over a wider box hold for all that is within it
            wider = (1.0 + 1e-9 if self._last else _ROOM[name in self._slopes]) * many
            slope, wide = slopes(self._loop.laws[name], self._plan.middles[name], wider.T)
            self._slopes[name] = wider, (np.abs(slope - linear.reshape(slope.shape)) + wide) * (1.0 + 1e-12) + 1e-15
        return (self._slopes[name][1] @ many[..., None])[..., 0].reshape(*sizes.shape[:-1], -1) * (1.0 + 1e-9)

    def _asked(self, e: Floats, gyro: Floats) -> tuple[Floats, Floats, Floats]:
        """Return what the aim is beside a linear one; what thrusts that are asked for are beside linear ones; and how far they are from those of the plan.

        Raises:
            NotProved: A clip of the law may act, or a rotor be asked for what it cannot give.
        """
        loop, told, off = self._loop, self._told, self._plan.off
        gains, count = loop.gains, loop.law.count
        sizes = _repeated(np.concatenate([e[:, FORCING] + off[FORCE] + self._force, e[:, 29:32] + off[29:32]], axis=1))
        short = self._besides("aim", sizes, self._course.aim)
        turns = np.array([1.0, count * (gains.attitude[2] + H * gains.attitude_integral[2]), 0.5 * count * gains.attitude[0],
                          0.5 * count * gains.attitude[1]])  # fmt: skip
        beside = turns * short[..., [0, 3, 1, 2]] + _SLACK
        apart = _repeated(e[:, ASKING] + off[ASKED]) + self._by_setpoint + gyro + beside
        settled = np.array([0.0, 0.0, abs(loop.law.settled), 0.0])
        limits = np.array([*gains.integral_limit, gains.attitude_integral_limit[2]])
        summed = e[:, SUMMED] + np.abs(self._plan.values[..., 16:20]).max(1) + off[16:20] + settled
        if not np.all(summed[:, :3] < 0.999 * limits[:3]):
            raise NotProved("a summed error may reach its limit")
        if not np.all(summed[:, 3] < 0.999 * limits[3]):
            raise NotProved("the summed error of the heading may reach its limit")
        clip, apart = self._clipped(apart)
        beside += clip
        sags = told.sag * (1.0 + told.thrust)  # of what the thrust is
        beside = beside + (told.thrust + sags) * apart + sags * self._strong
        return short, beside, apart + (told.thrust + sags) * (apart + self._strong)

    def _clipped(self, apart: Floats) -> tuple[Floats, Floats]:
        """Bound what clips do to thrusts that are asked for beside what they do to those of the plan, and how far these are then.

        A moment that is clipped changes by less than it would; all are lowered by what the greatest changes at most; one that is not below 0 changes by no more.

        Raises:
            NotProved: A rotor of the plan may be asked for no thrust.
        """
        law, wanted, total = self._loop.law, self._plan.wanted, apart.sum(-1)
        each, least = 1.0 + np.clip(wanted, -law.moments, law.moments) @ SIGNS.T, law.ceiling * self._told.battery**2
        if not np.all(1.0 + (self._course.asked @ SIGNS.T).min(-1) > 0.02):
            raise NotProved("a rotor may be asked for no thrust")
        turned = np.where(np.abs(wanted) + apart > 0.999 * law.moments, apart, 0.0)
        lowered = np.where(each.max(-1) + total > 0.999 * least, total + law.ceiling - least, 0.0)
        none = each.min(-1) - np.maximum(each.max(-1) - least, 0.0) - total - lowered < 0.001
        most = np.where(none, total + lowered, np.inf)[..., None]
        after = apart + np.stack([lowered, *np.zeros((3, *lowered.shape))], axis=-1)
        return np.where(none[..., None], apart + most, turned + after - apart), np.minimum(after, most)

    def _moved(self, between: Floats, asked: Floats) -> tuple[Floats, Floats]:
        """Return what a step leaves of body and rotors beside what is linear, and how fast their errors change.

        Raises:
            NotProved: A rotor may stand still.
        """
        course, told, loop = self._course, self._told, self._loop
        lighter = told.mass / (1.0 - told.mass)
        around = 0.5 * H * course.rate  # the plan's own motion in a step
        near = _repeated(between) + self._plan.off[:BODY] + around
        rotors = self._plan.middles["motion"][9:13].T.reshape(*self._shape, 4) @ SIGNS.T
        if not np.all(1.0 + rotors.min(-1) - near[..., ROTORS].sum(-1) > 0.001):
            raise NotProved("a rotor may stand still")
        air, last = np.full((*self._shape, 3), told.wind), np.full((*self._shape, 2), (lighter, told.drag))
        sizes = np.concatenate([near[..., DRIVEN], asked, air, last], axis=-1)
        beside = self._besides("motion", sizes, course.motion)
        beside += told.drag * np.abs(course.motion[..., 21]) + self._plan.rest["motion"] + _SLACK
        beside += (self._own @ (H * H / 12.0 * course.bent[DRIVEN])[:, None])[..., 0]
        beside[..., 6:9] += told.moment / np.array(loop.vehicle.inertia)
        own = (self._own @ around[..., DRIVEN, None])[..., 0]
        gusts = np.abs(course.motion[..., :, 17:20]).sum(-1) * told.wind
        left = beside @ self._held.T + (own + gusts) @ self._curved.T
        whole = beside + own + gusts + np.abs(course.motion[..., 20]) * lighter
        rate = (self._body @ _repeated(between)[..., None] + self._by_asked @ asked[..., None])[..., 0]
        rate[..., DRIVEN] += whole
        return left * (1.0 + 1e-9), rate.max(1) * (1.0 + 1e-9)

    def _felt(self, between: Floats) -> Floats:
        """Bound how far the acceleration that is felt changes beside a linear one. Shape (frames, SUBSTEPS)."""
        sizes = np.concatenate(
            [between[:, TILT] + self._plan.off[TILT], self.rate[:, SPEED] + 2.0 / H * self._plan.off[SPEED]], axis=1
        )
        return self._besides("lift", _repeated(sizes), self._course.lift[..., None, :])[..., 0]

    def _seen(self, between: Floats) -> tuple[Floats, Floats]:
        """Bound the errors of what cameras see of place and attitude, latency that is another one included. Shape (frames,) each."""
        told, found = self._told, list[Floats]()
        whole = self._course.rate.max(1) + self.rate
        lean = np.linalg.norm(np.abs(self._plan.values[..., TILT]).max(1) + self._plan.off[TILT] + between[:, TILT], axis=1)
        half = (lean + told.attitude) / (1.0 + np.sqrt(1.0 - (lean + told.attitude) ** 2))
        turned = told.attitude * (
            0.5 * half + np.sqrt(1.0 + 0.25 * half**2)
        )  # numbers of an attitude change by more than it turns
        for rows, size in ((PLACE, np.full(len(whole), told.position)), (TILT, turned)):
            most = size + self._apart * np.linalg.norm(whole[:, rows], axis=1)
            for _ in range(3):  # what is seen is of this frame or of those before
                most[1:] = np.maximum(most[1:], most[:-1])
            found.append(most * (1.0 + 1e-9))
        return found[0], found[1]

    def _filtered(self, e: Floats, spread: Floats, place: Floats, turn: Floats) -> tuple[Floats, Floats]:
        """Bound what the filter is beside a linear one, and its covariance."""
        loop, plan, off, frames = self._loop, self._plan, self._plan.off, self._course.frames
        least = np.full((frames, 3), loop.filter.noise.least_turn)
        ends = off[-6 - COVARIANCES :]
        parts = [e[:, APART][:, :3] + ends[:3], e[:, 26:32] + off[26:32], e[:, SENSED] + off[32:36], e[:, APART][:, 3:] + ends[3:6],
                 *(np.repeat(one[:, None], 3, axis=1) for one in (place, turn)), least,
                 spread + loop.unsettled + ends[6:]]  # fmt: skip
        sizes, linear = np.concatenate(parts, axis=1), self._course.filtered
        beside = self._besides("filter", sizes, linear)
        beside += _SLACK * (
            1.0 + np.abs(self._plan.values[..., 23:26]).max(1).max(-1, keepdims=True) + e[:, 23:26].max(-1, keepdims=True)
        )
        beside += np.concatenate([plan.rest["estimate"], plan.rest["spread"]])
        hover = loop.hover["filter"][9:, 25:]
        driven = beside[:, 9:] + (np.abs(linear[:, 9:, :25]) @ sizes[:, :25, None])[..., 0]
        driven += (np.abs(linear[:, 9:, 25:] - hover) @ sizes[:, 25:, None])[..., 0]
        found, powers = np.zeros((frames, COVARIANCES)), self._settles
        for ago, power in enumerate(powers[: min(len(powers), frames) - 1], start=1):
            found[ago:] += driven[: frames - ago] @ power.T
        if len(powers) <= frames:
            found[len(powers) - 1 :] += spread[: frames - len(powers) + 1] @ powers[-1].T
        return beside[:, :9], found * (1.0 + 1e-9)


def _repeated(values: Floats) -> Floats:
    """Return what holds in a frame for each of its steps. Shape (frames, n) to (frames, SUBSTEPS, n)."""
    return np.repeat(values[:, None], SUBSTEPS, axis=1)


def _held(body: Floats) -> tuple[Floats, Floats]:
    """Return what inputs of body and rotors within 1, that vary in a step, leave at its end at most; and what those do beside their means. Shape (BODY, 13)."""
    most = np.abs(body).max((0, 1))
    gentle, grown, term = most.copy(), np.eye(BODY), np.eye(BODY)
    gentle[range(BODY), range(BODY)] = body.max((0, 1))[range(BODY), range(BODY)]
    held = part = H * np.eye(BODY)
    for k in range(1, 40):
        term, part = term @ most * (H / k), part @ gentle * (H / (k + 1))
        grown, held = grown + term, held + part
    return held[:, DRIVEN] * (1.0 + 1e-9), (H * H * most @ grown)[:, DRIVEN] * (1.0 + 1e-9)


def _powers(matrix: Floats, frames: int) -> list[Floats]:
    """Return magnitudes of a matrix's powers, from the unit matrix to one that halves what it is applied to, or to those of the flight."""
    found, now, weights = [np.abs(np.eye(len(matrix)))], np.eye(len(matrix)), np.ones(len(matrix))
    for _ in range(frames + 1):
        now = matrix @ now
        found.append(np.abs(now) * (1.0 + 1e-9) + 1e-12)
        if np.max(found[-1] @ weights) < 0.25:
            break
    return found
