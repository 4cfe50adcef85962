"""Conditions of a simulated flight: one value for single flights, campaigns and flights online."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypedDict, Unpack, get_args

from flight.control.controller import CONTROLLERS, Controller
from flight.control.onboard_controller import OnBoardController
from flight.control.profiles import PROFILES, controller_name, controller_of
from flight.control.streamed import StreamedController
from flight.model.airframe import Airframe
from flight.model.disturbances import Wind
from flight.model.full import FullModel
from flight.model.plant import AIRFRAME_MODELS, AirframeModel
from flight.model.sensing import CLIP, MotionCapture
from verify.data import BadInput, Mission, Vehicle
from verify.data.disturbance import Disturbance
from verify.data.errors import did_you_mean

Estimator = Literal["ekf", "kalman"]
"""Who makes a state of what motion capture sees: common firmware's filter on board, or one on the ground, driven by the thrusts."""
ESTIMATORS: tuple[Estimator, ...] = get_args(Estimator)


class ConditionKeywords(TypedDict, total=False):
    """The fields of `Conditions` as keywords, in every form that is read."""

    wind: Wind | str | float | None
    noise: MotionCapture | str | float | None
    model: AirframeModel | str
    controller: Controller | str
    airframe: Airframe | None
    estimator: Estimator | None


@dataclass(frozen=True, init=False)
class Conditions:
    """Wind, sensors, dynamics, controller and airframe of a simulation.

    Attributes:
        wind: None for still air.
        noise: Motion capture with its filter and the sensors on board; None for perfect knowledge of the state.
        model: How the airframe flies.
        controller: Who follows the plan.
        airframe: Lag, drag and gains; None for the vehicle's own.
        estimator: Who makes a state of what motion capture sees; None where all know the truth.
    """

    wind: Wind | None
    noise: MotionCapture | None
    model: AirframeModel
    controller: Controller
    airframe: Airframe | None
    estimator: Estimator | None

    def __init__(
        self,
        wind: Wind | str | float | None = None,
        noise: MotionCapture | str | float | None = None,
        model: AirframeModel | str = "full",
        controller: Controller | str = "geometric",
        airframe: Airframe | None = None,
        estimator: Estimator | None = None,
    ) -> None:
        """Read conditions.

        Args:
            wind: A Wind, or text or a number for `Wind.parse` (m/s): "1.5+0.4"; None for still air.
            noise: A MotionCapture, or a position's standard deviation in m; None for perfect knowledge.
            model: A model, or a name of one: `full` (rotors, drag, battery), `paper` (eqs. (1) to (3)), or another package's.
            controller: A controller, or a name of one: `geometric`, `paper` (the papers'), those of common firmware (`mellinger`, `pid`,
                `lee`), or another package's.
            airframe: Lag, drag and gains; None for the vehicle's own.
            estimator: `ekf` (the filter of common firmware, on board) or `kalman` (one on the ground); None for the controller's usual one.

        Raises:
            BadInput: One of them is not what it should be.
        """
        if airframe is not None and not isinstance(airframe, Airframe):  # pyright: ignore[reportUnnecessaryIsInstance]  # a caller may err
            raise BadInput(f"airframe must be a flight.Airframe or None, not {airframe!r:.60}.")
        air = wind if wind is None or isinstance(wind, Wind) else Wind.parse(wind)
        object.__setattr__(self, "wind", None if air is None or air.still else air)
        sensor = noise if noise is None or isinstance(noise, MotionCapture) else MotionCapture.parse(noise)
        object.__setattr__(self, "noise", sensor)
        object.__setattr__(self, "model", AIRFRAME_MODELS.resolve(model))
        object.__setattr__(self, "controller", CONTROLLERS.resolve(controller))
        object.__setattr__(self, "airframe", airframe)
        object.__setattr__(self, "estimator", self._usual(estimator))
        if self.on_board and not isinstance(self.model, FullModel):
            raise BadInput("a controller or an estimator on board moves rotors; it flies the airframe model `full` only.")

    def _usual(self, asked: Estimator | None) -> Estimator | None:
        """Return the estimator that is asked for, or the controller's usual one."""
        if asked is not None and asked not in ESTIMATORS:
            raise BadInput(f"'{asked}' is not an estimator.{did_you_mean(asked, ESTIMATORS)} Names: {', '.join(ESTIMATORS)}.")
        if self.noise is None:
            if asked is not None:
                raise BadInput(
                    f"the estimator '{asked}' needs something to estimate from: give `noise` (--noise 0.001) as well."
                )
            return None
        inside = isinstance(self.controller, OnBoardController)
        if inside and asked == "kalman":
            raise BadInput("a controller on board flies with the estimator on board: 'ekf', not 'kalman'.")
        return asked or ("ekf" if inside else "kalman")

    @property
    def on_board(self) -> bool:
        """True if controller or estimator run on board, at the rates of common firmware."""
        return self.estimator == "ekf" or isinstance(self.controller, OnBoardController)

    def follower(self, vehicle: Vehicle) -> str:
        """Return the name of the controller that flies a vehicle.

        Args:
            vehicle: One of those that fly.
        """
        return controller_name(vehicle) if self._controller == "profile" else self._controller

    @property
    def _controller(self) -> str:
        """The controller's name; of one that has other gains than the named one, its class and them."""
        names = {CONTROLLERS.find(name): name for name in CONTROLLERS.built_in}
        return names.get(self.controller, repr(self.controller))

    @property
    def sentence(self) -> str:
        """The conditions as a sentence, for a person."""
        who = self._controller
        who = "the controllers of the vehicles' profiles" if who == "profile" else f"the controller {who}"
        air = "still air" if self.wind is None else f"wind of {self.wind.speed:g} m/s with gusts of {self.wind.gust:g} m/s"
        if self.noise is None:
            return f"flown by {who} in {air}, which knew the true state."
        late = f"{1000 * self.noise.delay:g} ms late and {1000 * self.noise.noise:g} mm off"
        return f"flown by {who} in {air}, with motion capture {late} and the estimator {self.estimator}."

    @property
    def varies(self) -> bool:
        """True if seeds make a difference: still or steady air and perfect sensors leave nothing to chance."""
        return (self.wind is not None and self.wind.gust > 0.0) or (self.noise is not None and self.noise.varies)

    def changed(self, **changes: Unpack[ConditionKeywords]) -> Conditions:
        """Return these conditions with some of them replaced.

        Raises:
            BadInput: As when they are read.
        """
        kept: ConditionKeywords = {
            "wind": self.wind,
            "noise": self.noise,
            "model": self.model,
            "controller": self.controller,
            "airframe": self.airframe,
            "estimator": None if changes.keys() & {"noise", "controller"} else self.estimator,
        }
        kept.update(changes)
        return Conditions(**kept)


CALM = Conditions()
"""Still air, perfect knowledge, the full model and the geometric controller."""

LABORATORY = Wind((0.2, 0.0, 0.0), 0.1)
"""m/s: air that is moved by what flies in a room, and by who walks in it."""
CAMERAS = MotionCapture(delay=0.015)
"""Motion capture as laboratories have it: 1 mm of noise, 15 ms from a frame to its use."""


def conditions_of(mission: Mission) -> Conditions:
    """Return what a mission's margin is meant for: its vehicles' own controllers and estimators, in a laboratory's air and view.

    A mission that states disturbances is flown within these: in their wind, seen as late and as far off as they let cameras and sensors be. A controller
    on the ground then knows the true state, as no estimator is in the model of the proof, and follows set-points as old and as coarse as they are stated.

    Args:
        mission: Says what flies.

    Raises:
        BadInput: A vehicle's profile names a controller that there is not.
    """
    vehicles = [mission.vehicle_of(robot) for robot in mission.agents]
    followers = {controller_name(vehicle): controller_of(vehicle) for vehicle in vehicles}
    alone = next(iter(followers.values()))
    together = len(followers) > 1 or isinstance(alone, OnBoardController)
    controller = PROFILES if together else alone
    if (told := mission.disturbance) is None:
        return Conditions(LABORATORY, CAMERAS, controller=controller)
    if told.setpoints is not None and not together:
        controller = StreamedController(alone, next(iter(followers)), told.setpoints)
    return Conditions(Wind((told.wind, 0.0, 0.0)), _cameras(told) if together else None, controller=controller)


def _cameras(told: Disturbance) -> MotionCapture:
    """Return motion capture and sensors whose errors stay within stated ones."""
    most = CLIP * math.sqrt(3.0)
    return MotionCapture(
        noise=told.position / most,
        delay=told.latency[1],
        dropout=0.0,
        attitude_noise=told.attitude / most,
        rate_noise=told.gyroscope / most,
    )
