"""The proof that `mellinger`, on the filter on board, keeps a vehicle near its plan.

What set-points make of a linear loop at hover is known; bounds are on what states are beside that. They allow remainders: what body, law and filter are
beside linear ones, for all that states may be, bounded by slopes. If the loop makes less than the bounds of these
and of the disturbances, strictly, nothing ever leaves them; as in `proof`, but with one bound of each state for the whole flight.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from verify.arithmetic.balls import Floats
from verify.data.airframe import AirframeTable
from verify.data.autopilot import Autopilot
from verify.data.disturbance import Disturbance
from verify.data.trajectory import Trajectory
from verify.data.vehicle import GRAVITY, Vehicle
from verify.tracking.error_model import NotProved
from verify.tracking.on_board.onboard_laws import ASKED, AWAY, FORCE, KNOWN, LAGGING, TIPPED, WIDE, BoardLoop
from verify.tracking.on_board.onboard_loop import (
    BODY,
    COVARIANCES,
    DRIVEN,
    GYRO,
    LIFT,
    MOTION,
    PLACE,
    RATES,
    ROTORS,
    SPEED,
    SUBSTEPS,
    SUMS,
    TILT,
    TURNED,
    H,
)
from verify.tracking.on_board.onboard_plan import Followed, follow

_ROUNDS = 40
_SETTLING = 6
"""Rounds after which bounds that grow faster and faster are given up."""
_TRIES = 4
_WIDER = 1.002
"""Factor from bounds that were found to those that are tried."""
_BEYOND = 1.15
"""Factor by which those go beyond where what was found tends to."""
_SLACK = 1e-11
"""Share of what is linear that the rounding of its numbers may leave open."""
_LARGEST = 0.5
"""m; a bound above is no bound."""
_LATEST = 9
"""Steps by which cameras may be late in the middle."""

_COVERED = {
    *("airframe", "wind", "position", "latency", "attitude", "gyroscope", "mass", "thrust", "sag", "drag", "moment", "battery"),
    *("fitted", "start"),
}
"""Disturbances that the model has; the filter estimates the velocity itself."""

Bounds = Mapping[str, Floats]
"""`states`: of all outputs, at the ends of steps and after jumps; `between`: of body and rotors at all times."""


@dataclass(frozen=True, eq=False, slots=True)
class BoardBound:
    """Bound that is proved of a flight.

    Attributes:
        bound: Largest distance from the plan at any time, m.
        costs: m of it that each cause makes.
        time: s, at which the set-points alone leave the vehicle farthest from it.
    """

    bound: float
    costs: Mapping[str, float]
    time: float


def prove_on_board(
    vehicle: Vehicle, autopilot: Autopilot, disturbance: Disturbance, flight: tuple[Trajectory, float], offset: float = 0.0
) -> BoardBound:
    """Bound a vehicle's distance from its plan, for all times of a flight and all its disturbances.

    Args:
        vehicle: What flies, at heading 0.
        autopilot: Its gains and filter.
        disturbance: What may disturb it.
        flight: The plan, and how long the team flies, s.
        offset: m from the plan's start to the start that is stated.

    Raises:
        NotProved: No bounds were found that are kept; the message says what stands in the way.
    """
    late = round(0.5 * sum(disturbance.latency) / H)
    if late > _LATEST:
        raise NotProved(f"cameras that are {1000 * H * late:.0f} ms late are not in the model of the filter")
    for name in type(disturbance).model_fields:
        if name not in _COVERED and getattr(disturbance, name):
            raise NotProved(f"`{name}` is not in the model of `mellinger` on its filter")
    frames = int(np.ceil(flight[1] / (H * SUBSTEPS)))
    loop = loop_of(vehicle, disturbance.airframe, autopilot, late, frames)
    try:
        plan = follow(loop, flight[0], frames)
    except ArithmeticError as reason:
        raise NotProved(str(reason)) from None
    return _Flight(loop, disturbance, plan, offset).proved()


def loop_of(vehicle: Vehicle, airframe: AirframeTable, autopilot: Autopilot, late: int, frames: int) -> BoardLoop:
    """Return the loop of a vehicle with its responses; it is shared, as none of the disturbances changes it.

    Args:
        vehicle: What flies.
        airframe: Its lag and drag.
        autopilot: Its gains and filter.
        late: Steps by which cameras are late.
        frames: Of the flight.

    Raises:
        NotProved: There is no proof with such gains.
    """
    try:
        return _shared(vehicle, airframe, autopilot, late, frames)  # pyright: ignore[reportArgumentType]  # frozen models are hashable
    except ArithmeticError as reason:
        raise NotProved(str(reason)) from None


@lru_cache(maxsize=8)
def _shared(vehicle: Vehicle, airframe: AirframeTable, autopilot: Autopilot, late: int, frames: int) -> BoardLoop:
    return BoardLoop(vehicle, airframe, autopilot, late, frames)


class _Flight:
    """A flight under some disturbances.

    Attributes:
        kept: Bounds of all states that were proved.
    """

    def __init__(self, loop: BoardLoop, told: Disturbance, plan: Followed, offset: float) -> None:
        self._loop, self._told, self._plan, self._offset = loop, told, plan, offset
        self._apart = max(told.latency[1] - H * loop.late, H * loop.late - told.latency[0], 0.0)
        if self._apart > 0.0:
            self._apart = H * np.ceil(self._apart / H - 1e-9)  # cameras see between two steps what lies between
        self._body, self._own = self._alone()
        self._inputs: dict[str, Floats] = {}
        self._rate = np.zeros(BODY)
        self.kept: Bounds = {}

    def proved(self) -> BoardBound:
        """Find bounds that are kept.

        Raises:
            NotProved: None were found.
        """
        first = self._linear()
        bounds: Bounds = {"states": first, "between": first[:BODY]}
        reason, before = "what the error's nonlinear parts allow grows as fast as the bounds do", np.inf
        for k in range(_ROUNDS):
            try:
                after = self._after(bounds)
                grown = float((after["between"] - bounds["between"])[PLACE].sum())
                ratio, before = grown / before, grown
                if ratio < 1.0:
                    further = _BEYOND * ratio / (1.0 - ratio)
                    tried = {name: _WIDER * value + further * (value - bounds[name]) + 1e-9 for name, value in after.items()}
                    if self._keeps(tried):
                        return self._bound(self.kept)
                elif k > _SETTLING:  # what is allowed is convex in the bounds, so that these have no end
                    break
            except (NotProved, ArithmeticError) as found:
                reason = f"they grow, as tilts, thrusts and the filter's gains act on each other, until {found}"
                break
            bounds = after
            if not float(bounds["between"][PLACE].max()) < _LARGEST:
                break
        dropped = 1000.0 * float(self._loop.responses.peaks["dropped"][0].sum()) * self._loop.filter.noise.least_turn
        raise NotProved(
            f"the bounds do not close: {reason}; corrections of the attitude that the filter drops, below "
            f"{self._loop.filter.noise.least_turn:g} rad, make {dropped:.0f} mm alone"
        )

    def _keeps(self, tried: Bounds) -> bool:
        """Return whether bounds are kept strictly, or those that are a little wider than what they allow."""
        for _ in range(_TRIES):
            try:
                after = self._after(tried)
            except (NotProved, ArithmeticError):
                return False
            self.kept = after
            if all(bool(np.all(after[name] < tried[name])) for name in tried):
                return True
            tried = {name: _WIDER * value + 1e-9 for name, value in after.items()}
        return False

    def _linear(self) -> Floats:
        """Return what disturbances make of the linear loop alone."""
        told, least = self._told, self._loop.filter.noise.least_turn
        sizes = {
            "wind": told.wind,
            "gyroscope": told.gyroscope,
            "position": told.position,
            "attitude": told.attitude,
            "dropped": least,
        }
        return (
            sum((self._loop.responses.peaks[name].sum(1) * size for name, size in sizes.items()), start=self._steady()) + 1e-9
        )

    def _steady(self) -> Floats:
        """Return what mass, thrust and the start make of the linear loop."""
        told, responses = self._told, self._loop.responses
        start = (told.start + self._offset) * responses.begun.sum(1)
        return start + responses.steady["mass"] * self._lighter + responses.steady["thrust"] * told.thrust

    @property
    def _lighter(self) -> float:
        return self._told.mass / (1.0 - self._told.mass)

    def _after(self, bounds: Bounds) -> dict[str, Floats]:
        """Return bounds of what the loop makes of all that bounds allow.

        Raises:
            NotProved: A clip may act, or a rotor saturate.
        """
        with np.errstate(all="ignore"):  # of numbers that are none nothing is proved
            off = self._plan.off
            return self._made(bounds["states"] + off, bounds["between"] + off[:BODY])

    def _made(self, e: Floats, between: Floats) -> dict[str, Floats]:
        """Return what `_after` does, of how far states may be from what set-points make of them, at the ends of steps and between them."""
        loop, told, n, rest = self._loop, self._told, self._plan.most, self._plan.rest
        z, whole, body = e + n, between + self._body, self._body
        wind, gyro = np.full(3, told.wind), loop.gyro @ np.full(3, told.gyroscope)
        short, wanted, off_asked = self._asked(e)
        strength = np.array([told.thrust + told.sag, 0.0, 0.0, 0.0])
        asked = wanted * (1.0 + strength[0]) + strength
        squares, lagging = self._squares(whole[ROTORS], asked, z[LAGGING] + gyro + off_asked + strength)
        lag = loop.airframe.rotor_lag
        near = between[DRIVEN] + H * self._own[DRIVEN]  # the middle of a step stands for all of it
        sizes = np.concatenate([near, e[ASKED] + gyro + off_asked + strength, wind, [self._lighter, told.drag]])
        around = np.concatenate([body[DRIVEN], n[ASKED], np.zeros(5)])
        beside = loop.beside_motion(sizes, around) + _SLACK * (np.abs(loop.motion) @ (sizes + around))
        beside[6:9] += told.moment / np.array(loop.vehicle.inertia)
        driven = np.concatenate([beside, squares / lag + _SLACK * lagging / lag]) + rest["motion"]
        gusts = np.abs(loop.motion[:, 17:20]) @ wind
        apart = self._turning(between, sizes[13:17])
        apart[MOTION] += np.abs(loop.motion[:, 17:]) @ sizes[17:] + beside
        apart[ROTORS] = (lagging + squares) / lag
        self._rate = apart + self._own
        self._inputs = {
            "motion": driven,
            "asked": off_asked + rest["asked"],
            "turned": H * short[3:] + _SLACK * z[TURNED] + rest["turned"],
            "lift": rest["lift"]
            + loop.beside_lift(np.concatenate([between[TILT], apart[SPEED]]), np.concatenate([n[TILT], self._plan.quickest])),
            "wind": wind,
            "gyroscope": np.full(3, told.gyroscope),
            "within": loop.flow.curved @ (driven + np.concatenate([gusts, np.zeros(4)])),
            "setpoint": rest["setpoint"],
            **self._filtered(e, whole),
        }
        responses = loop.responses
        states = sum((responses.peaks[name] @ size for name, size in self._inputs.items()), start=self._steady()) * (1.0 + 1e-9)
        return {"states": states, "between": (states[:BODY] + H * apart) * (1.0 + 1e-9)}

    def _turning(self, body: Floats, asked: Floats) -> Floats:
        """Bound the linear derivatives of body and rotors, these within bounds at all times. Shape (BODY,)."""
        loop = self._loop
        found = np.abs(loop.flow.derivative) @ body
        found[MOTION] += np.abs(loop.motion[:, 13:17]) @ asked
        found[ROTORS] = (body[ROTORS] + asked) / loop.airframe.rotor_lag
        return found

    def _alone(self) -> tuple[Floats, Floats]:
        """Bound body and rotors at all times, and their derivatives, where set-points alone lead.

        Raises:
            NotProved: They turn too fast.
        """
        plan = self._plan
        most, pushed = plan.most[:BODY], np.zeros(BODY)
        pushed[MOTION] = plan.pushed
        own, body = pushed, most
        for _ in range(100):
            after = self._turning(body, plan.most[ASKED]) + pushed
            if np.all(after < own):
                return body, own
            own = _WIDER * after + 1e-12
            body = most + H * own
        raise NotProved("its plan turns too fast")

    def _asked(self, e: Floats) -> tuple[Floats, Floats, Floats]:
        """Return what the aim is beside a linear one; the thrusts that the law wants; and how far those asked for are from linear ones.

        Raises:
            NotProved: A clip of the law may act, or a rotor be asked for what it cannot give.
        """
        loop, told, n = self._loop, self._told, self._plan.most
        gains, vehicle, count, z = loop.gains, loop.vehicle, loop.law.count, e + n
        aimed = np.r_[FORCE, 29:32]
        short = loop.beside_aim(e[aimed], n[aimed])
        turns = np.array([1.0, count * (gains.attitude[2] + H * gains.attitude_integral[2]), 0.5 * count * gains.attitude[0],
                          0.5 * count * gains.attitude[1]])  # fmt: skip
        off = turns * short[[0, 3, 1, 2]] + _SLACK * (z[ASKED] + loop.terms @ z[KNOWN])
        wanted = z[ASKED] + loop.gyro @ np.full(3, told.gyroscope) + off
        settled = np.array([0.0, 0.0, abs(loop.law.settled)])
        if not np.all(z[SUMS] + settled < 0.999 * np.array(gains.integral_limit)):
            raise NotProved("a summed error may reach its limit")
        if not z[TURNED] < 0.999 * gains.attitude_integral_limit[2]:
            raise NotProved("the summed error of the heading may reach its limit")
        if not wanted.sum() < 0.999:
            raise NotProved("a rotor may be asked for no thrust")
        greatest = 0.25 * vehicle.mass * GRAVITY * (1.0 + float(wanted.sum()))
        if not greatest < 0.999 * vehicle.rotor_thrust_max * told.battery**2:
            raise NotProved(f"a rotor may be asked for {1000 * greatest:.0f} mN, more than it has")
        if not max(2.0 * wanted[2], 2.0 * wanted[3], wanted[1]) < 0.999 * gains.moment_limit * count:
            raise NotProved("a moment may reach its limit")
        off = off + (told.thrust + told.sag) * wanted
        off[0] += told.sag
        return short, wanted, off

    @staticmethod
    def _squares(thrusts: Floats, asked: Floats, lagging: Floats) -> tuple[Floats, Floats]:
        """Bound what the lag of speeds is beside one of thrusts, and how far these lag at any time.

        With s the speeds and S those that are asked for, S^2 - s^2 is what lags, and (S - s)^2 is lost.

        Raises:
            NotProved: A rotor may stand still, or lag too far.
        """
        a, b = float(asked.sum()), float(thrusts.sum())
        if not max(a, b) < 0.999:
            raise NotProved("a rotor may stand still")
        low = 1.0 / (np.sqrt(1.0 + a) + np.sqrt(1.0 + b))
        high = 1.0 / (np.sqrt(1.0 - a) + np.sqrt(1.0 - b))

        def lost(apart: Floats) -> Floats:
            u, z, y, x = 0.5 * (low + high) * apart + 0.5 * (high - low) * np.linalg.norm(apart)
            return np.array([u * u + z * z + y * y + x * x, 2 * (u * z + x * y), 2 * (u * y + x * z), 2 * (u * x + y * z)]) * (
                1 + 1e-9
            )

        whole = 1.01 * lagging + lost(1.01 * lagging) + 1e-12
        found = lost(whole)
        if not np.all(np.maximum(lagging, found) < whole):
            raise NotProved("a rotor may lag too far")
        return found, whole

    def _filtered(self, e: Floats, whole: Floats) -> dict[str, Floats]:
        """Bound the inputs of the filter: cameras' errors, dropped corrections, and what it is beside a linear one."""
        loop, told, n, rest = self._loop, self._told, self._plan.most, self._plan.rest
        camera = np.full(3, told.position + self._apart * float(np.linalg.norm(self._rate[PLACE])))
        tipped = np.full(3, told.attitude + self._apart * float(np.linalg.norm(whole[RATES])))
        dropped, state = np.full(3, loop.filter.noise.least_turn), np.r_[AWAY, 26:32, GYRO, LIFT, TIPPED]
        sizes = np.concatenate([e[state], camera, tipped, dropped, e[WIDE] + loop.unsettled])
        around = np.concatenate([n[state], np.zeros(9), n[WIDE]])
        beside = loop.beside_filter(sizes, around) + _SLACK * (np.abs(loop.filtered) @ (sizes + around))
        places = np.concatenate([e[23:32] + n[23:32], np.zeros(COVARIANCES)]) + (e + n)[36:45].max()
        beside += _SLACK * places
        estimate, spread = beside[:9] + rest["estimate"], beside[9:] + rest["spread"]
        return {"estimate": estimate, "spread": spread, "position": camera, "attitude": tipped, "dropped": dropped}

    def _bound(self, after: Bounds) -> BoardBound:
        """Return what bounds that are kept say of the place, as a length, and what makes it."""
        responses, told = self._loop.responses, self._told
        names = {"motion": "coupling", "asked": "coupling", "turned": "coupling", "lift": "coupling", "within": "within steps",
                 "estimate": "filter", "dropped": "dead zone of the filter", "wind": "wind", "gyroscope": "gyroscope",
                 "position": "cameras and latency", "attitude": "cameras and latency", "setpoint": "within steps"}  # fmt: skip
        costs: dict[str, float] = {}
        for name, cause in names.items():
            size = self._inputs[name]
            made = float(responses.lengths[name] @ size)
            if name == "wind":  # whose direction is any, so that its components are not all at their largest
                made = min(made, responses.places[name] * told.wind)
            costs[cause] = costs.get(cause, 0.0) + made
        steady = responses.steady
        costs["mass and thrust"] = float(
            np.linalg.norm(steady["mass"][:3]) * self._lighter + np.linalg.norm(steady["thrust"][:3]) * told.thrust
        )
        costs["start"] = float(np.linalg.norm(responses.begun[:3])) * (told.start + self._offset)
        bound = min(sum(costs.values()), float(np.linalg.norm(after["states"][PLACE])))
        costs["plan"] = self._plan.away
        strays = 0.125 * H * H * float(np.linalg.norm(self._rate[SPEED]))  # from a line between the ends of a step
        return BoardBound((bound + self._plan.away + strays) * (1.0 + 1e-9), costs, self._plan.time)
