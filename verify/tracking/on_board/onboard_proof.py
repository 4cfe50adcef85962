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
from verify.data.vehicle import Vehicle
from verify.tracking.error_model import NotProved
from verify.tracking.on_board.onboard_course import Course
from verify.tracking.on_board.onboard_filter import FRAME
from verify.tracking.on_board.onboard_laws import BoardLoop
from verify.tracking.on_board.onboard_loop import (
    COVARIANCES,
    PLACE,
    SPEED,
    SUBSTEPS,
    H,
)
from verify.tracking.on_board.onboard_plan import follow
from verify.tracking.on_board.onboard_remainders import Remainders
from verify.tracking.on_board.onboard_sums import (
    COUNT,
    ENTERED,
    INPUT,
    LENGTH,
    MOVING,
    SINGLE,
    STEPPED,
    Sums,
    sums_of,
)

_ROUNDS = 60
_WIDER = 1.02
"""Factor from bounds that were found to those that are tried."""
_ROOM = 1.3
"""Factor from what slopes are asked for to the box for which they are found, so that they need not be found at each round."""
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
"""By frame: `driven`, of outputs, without what is always the same; `states`, of all of them; `between`, of body and rotors at all times; `spread`, of the covariance."""


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
    frames = int(np.ceil(flight[1] / FRAME))
    course, sums = summed_of(vehicle, disturbance.airframe, autopilot, late, flight[0], frames)
    return _Flight(course, sums, disturbance, offset).proved()


def summed_of(
    vehicle: Vehicle, airframe: AirframeTable, autopilot: Autopilot, late: int, path: Trajectory, frames: int
) -> tuple[Course, Sums]:
    """Return what is linear about the undisturbed flight, and the sums of responses; none of the disturbances changes them.

    Args:
        vehicle: What flies.
        airframe: Its lag and drag.
        autopilot: Its gains and filter.
        late: Steps by which cameras are late.
        path: The plan.
        frames: Of the flight.

    Raises:
        NotProved: The plan accelerates too much, or there is no proof with such gains.
    """
    loop = loop_of(vehicle, airframe, autopilot, late, frames)
    try:
        return _summed(loop, path, frames)
    except ArithmeticError as reason:
        raise NotProved(str(reason)) from None


@lru_cache(maxsize=4)
def _summed(loop: BoardLoop, path: Trajectory, frames: int) -> tuple[Course, Sums]:
    course = Course.of(loop, follow(loop, path, frames))
    return course, sums_of(course)


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
        kept: Bounds that were proved.
    """

    def __init__(self, course: Course, sums: Sums, told: Disturbance, offset: float) -> None:
        self._course, self._sums, self._told = course, sums, told
        self._steady = told.mass / (1.0 - told.mass) * sums.steady[:, 0] + told.thrust * sums.steady[:, 1]
        self._start = (told.start + offset) * sums.begun
        self._beside = Remainders(course, told)
        self._inputs = self._none()
        self.kept: Bounds = {}

    def proved(self) -> BoardBound:
        """Find bounds that are kept.

        Raises:
            NotProved: None were found.
        """
        bounds = self._first()
        reason = "what the error's nonlinear parts allow grows as fast as the bounds do"
        for _ in range(_ROUNDS):
            try:
                after = self._after(bounds)
            except (NotProved, ArithmeticError) as found:
                reason = f"they grow, as tilts, thrusts and the filter's gains act on each other, until {found}"
                break
            if all(bool(np.all(after[name] < bounds[name])) for name in after):
                self._beside.forget()  # what bounds that are kept allow is kept, too, however often that is asked
                self.kept = self._after(self._after(after))
                return self._bound(self.kept)
            bounds = {name: _WIDER * value + 1e-3 * value.max(0) + 1e-9 for name, value in after.items()}
            if not float(bounds["between"][:, PLACE].max()) < _LARGEST:
                break
        dropped = 1000.0 * float(self._alone("dropped").max()) * self._course.loop.filter.noise.least_turn
        raise NotProved(
            f"the bounds do not close: {reason}; corrections of the attitude that the filter drops, below "
            f"{self._course.loop.filter.noise.least_turn:g} rad, make {dropped:.0f} mm alone"
        )

    def _alone(self, name: str) -> Floats:
        """Return lengths by which an input within 1 moves the place, by frame."""
        inputs = self._none()
        inputs[..., INPUT[name]] = 1.0
        return self._driven(inputs)[:, LENGTH]

    def _none(self) -> Floats:
        """Return inputs that are 0. Shape (frames, SUBSTEPS, COUNT); those of jumps are the same in all steps."""
        return np.zeros((self._course.frames, SUBSTEPS, COUNT))

    def _driven(self, inputs: Floats) -> Floats:
        return self._sums.driven(inputs[..., :STEPPED], inputs[:, 0, STEPPED:])

    def _first(self) -> Bounds:
        """Return what disturbances make of the linear loop alone."""
        told = self._told
        inputs = self._none()
        sizes = {"wind": told.wind, "gyroscope": told.gyroscope, "position": told.position, "attitude": told.attitude,
                 "dropped": self._course.loop.filter.noise.least_turn}  # fmt: skip
        for name, size in sizes.items():
            inputs[..., INPUT[name]] = size
        driven = self._driven(inputs) + 1e-9
        states = driven + self._steady + self._start
        return {
            "driven": driven,
            "states": states,
            "between": states[:, MOVING],
            "spread": np.zeros((self._course.frames, COVARIANCES)),
        }

    def _after(self, bounds: Bounds) -> Bounds:
        """Return bounds of what the loop makes of all that bounds allow.

        Raises:
            NotProved: A clip may act, or a rotor saturate.
        """
        with np.errstate(all="ignore"):  # of numbers that are none nothing is proved
            return self._made(bounds)

    def _made(self, bounds: Bounds) -> Bounds:
        sums, inputs = self._sums, self._none()
        allowed, spread = self._beside.allowed(bounds["states"], bounds["between"], bounds["spread"])
        for name, size in allowed.items():
            inputs[..., INPUT[name]] = size
        self._inputs, driven = inputs, self._driven(inputs)
        older = np.nonzero(sums.older >= 0)[0]
        begun = bounds["driven"][:, ENTERED]
        driven[older] += (sums.left[older] @ begun[sums.older[older]][..., None])[..., 0] * (1.0 + 1e-6)
        most = float((bounds["states"][:, ENTERED] / sums.weights).max())
        driven += most * (1e-12 * sums.growth * sums.loose + 60.0 * SINGLE * sums.read)
        driven *= 1.0 + 1e-9
        states = driven + self._steady + self._start
        return {
            "driven": driven,
            "states": states,
            "between": states[:, MOVING] + 0.5 * H * self._beside.rate,
            "spread": spread,
        }

    def _bound(self, after: Bounds) -> BoardBound:
        """Return what bounds that are kept say of the place, as a length, and what makes it."""
        states = after["states"]
        around = np.minimum(states[:, LENGTH], np.linalg.norm(states[:, MOVING][:, PLACE], axis=1))
        strays = 0.125 * H * H * np.linalg.norm(self._beside.rate[:, SPEED], axis=1)  # from a line between the ends of a step
        course = (around + strays + self._course.flight.away) * (1.0 + 1e-9)
        frame = int(course.argmax())
        causes = {"body": "coupling", "asked": "coupling", "lift": "coupling", "turned": "coupling", "estimate": "filter",
                  "dropped": "dead zone of the filter", "wind": "wind", "gyroscope": "gyroscope", "position": "cameras and latency",
                  "attitude": "cameras and latency", "setpoint": "set-points"}  # fmt: skip
        costs: dict[str, float] = {}
        for name, cause in causes.items():
            inputs = self._none()
            inputs[..., INPUT[name]] = self._inputs[..., INPUT[name]]
            costs[cause] = costs.get(cause, 0.0) + float(self._driven(inputs)[frame, LENGTH])
        costs["mass and thrust"], costs["start"] = float(self._steady[frame, LENGTH]), float(self._start[frame, LENGTH])
        costs["plan"] = float(self._course.flight.away[frame])
        return BoardBound(float(course[frame]), costs, FRAME * frame)
