"""What the compiled firmware gave on the shipped sequence of hoops, and the same flights here."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import flight
import ltlplan
from flight.control.controller import Controller
from flight.control.lee import Lee
from flight.control.mellinger import Mellinger
from flight.control.pid import Pid
from flight.control.profiles import autopilot_of
from flight.model.sensing import MotionCapture
from ltlplan.pipeline import certified_team

LATE = MotionCapture(noise=0.0, attitude_noise=0.0, rate_noise=0.0, dropout=0.0, delay=0.015)
UNSET = {"position_noise": 0.01, "attitude_noise": 0.0045}


@dataclass(frozen=True, slots=True)
class Flown:
    """One flight of the firmware.

    Attributes:
        name: Who flew, knowing what.
        controller: The same here.
        rms: Of the firmware's distance from the plan, mm.
        worst: Its largest, mm.
        noise: Motion capture; None for the true state.
        unset: The filter's noise, where it is not the profile's.
    """

    name: str
    controller: Controller
    rms: float
    worst: float
    noise: MotionCapture | None = None
    unset: dict[str, float] = field(default_factory=dict[str, float])


FIRMWARE = (
    Flown("mellinger told 33 g, true state", Mellinger(settled=False), 12, 22),
    Flown("mellinger told 33 g, ekf, 15 ms late, 0.001 and 0.05", Mellinger(settled=False), 14, 24, LATE),
    Flown("lee told 33 g, true state", Lee(), 15, 31),
    Flown("mellinger told 29 g, true state", Mellinger(mass=0.029, settled=False), 28, 40),
    Flown("mellinger told 29 g, ekf, 15 ms late, 0.01 and 0.0045", Mellinger(mass=0.029, settled=False), 39, 64, LATE, UNSET),
    Flown("lee told 29 g, true state", Lee(mass=0.029), 194, 202),
    Flown("pid, true state", Pid(settled=False), 234, 491),
)
"""In the order of their errors. All sums began at zero."""


def flown_here() -> Iterator[tuple[Flown, float, float]]:
    """Fly the shipped sequence of hoops as the firmware did, and yield each of its flights with RMS and worst error here, mm."""
    done = certified_team(ltlplan.plan("hoops-sequence"))
    airframe = flight.airframe_of(done.plan.mission.vehicle)
    autopilot = autopilot_of(airframe)
    for one in FIRMWARE:
        vehicle = airframe.vehicle.changed(autopilot=autopilot.changed(ekf=autopilot.ekf.changed(**one.unset)))
        log = flight.fly(
            done.plan, done.team, controller=one.controller, noise=one.noise, airframe=airframe.changed(vehicle=vehicle)
        )
        yield one, 1000 * log.rms_error("quad0"), 1000 * log.worst_error()
