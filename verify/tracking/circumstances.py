"""The circumstances of a disturbed flight, bounded from bounds on the states: tilts, rotors, air, and jumps at commands.

All bounds are sums, products and quotients of numbers that are not negative; a factor in the proof covers their rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Floats
from verify.arithmetic.intervals import Interval
from verify.data.airframe import AirframeTable
from verify.data.vehicle import GRAVITY, Vehicle
from verify.tracking.error_model import (
    ROUNDING,
    Bounds,
    Cell,
    ErrorModel,
    Fed,
    H,
    NotProved,
    along_slopes,
    most_of,
    shifted,
)
from verify.tracking.loops import reaction_of, roll_drag_of
from verify.tracking.sampled_loop import TICK


@dataclass(frozen=True, eq=False, slots=True)
class Attitudes:
    """Bounds on attitudes, rates and thrusts until the next command. Each is shape (ticks,).

    Attributes:
        least: Of the thrust that is asked, m/s^2.
        most: Of it.
        slope: Of its derivative.
        lean: Sine of the tilt that is held.
        rates: rad/s, about x and y together.
        spin: rad/s, about z.
        turning: rad/s^2, about x and y together.
        spinning: rad/s^2, about z.
    """

    least: Floats
    most: Floats
    slope: Floats
    lean: Floats
    rates: Floats
    spin: Floats
    turning: Floats
    spinning: Floats

    @classmethod
    def of(cls, model: ErrorModel, bounds: Bounds, own: Fed) -> Attitudes:
        """Bound them.

        Args:
            model: The robot.
            bounds: Of all states.
            own: What is fed forward.

        Raises:
            NotProved: The vehicle may tilt too far, or the force fall to the least.
        """
        fed = own.here
        slope = most_of(fed.rate)
        turning, spinning = np.hypot(most_of(fed.rates_change[0]), most_of(fed.rates_change[1])), most_of(fed.rates_change[2])
        rates = np.hypot(most_of(fed.rates[0]), most_of(fed.rates[1])) + TICK * turning
        spin = most_of(fed.rates[2]) + TICK * spinning
        lean = np.hypot(most_of(fed.axis[0]), most_of(fed.axis[1])) + TICK * rates
        if not np.all(lean < 0.7):
            raise NotProved("the vehicle may tilt by more than 44 degrees")
        least, most = fed.length.value.low - TICK * slope, fed.length.value.high + TICK * slope
        upright = model.force()[0][:, 2] - bounds.vertical["p"]
        vehicle = model.vehicle
        if not np.all(upright > 1.001 * vehicle.thrust_min / vehicle.mass) or not np.all(least > 1.0):
            raise NotProved("the commanded force may fall to the least thrust")
        return cls(least, most, slope, lean, rates, spin, turning, spinning)


class Circumstances:
    """Tilts, rotors, air and commands, bounded from bounds on the states."""

    def __init__(self, model: ErrorModel, cell: Cell, bounds: Bounds, held: Attitudes, fed: Fed) -> None:
        self.model, self.cell, self.bounds, self.held, self.fed, self.all = model, cell, bounds, held, fed.here, fed
        vehicle, air, told = model.vehicle, model.airframe, model.disturbance
        flat, heading = bounds.lateral, bounds.heading
        self.weak, self.strong = fed.here.length.value.low, fed.here.length.value.high  # m/s^2, by which d, e and mu are scaled
        self.tip, self.twist = flat["d"] / self.weak, heading["f"]  # of the attitude's error, rad
        self.slip, self.swing = flat["e"] / self.weak, heading["o"]  # of the rates' error, rad/s
        whole = np.hypot(self.tip, self.twist)
        if not np.all(whole < 1.0):
            raise NotProved("the attitude's error may be more than 57 degrees")
        quarter = 0.25 * whole * whole
        self.short = quarter / (1.0 + np.sqrt(1.0 - quarter))  # 1 - cos of half the error
        self.upright = np.sqrt(1.0 - held.lean * held.lean)
        self.skew = (1.0 - self.upright) + 0.5 * held.lean**2 / self.upright
        self.leaning = held.lean + self.tip
        if not np.all(self.leaning < 0.8):
            raise NotProved("the vehicle may tilt by more than 53 degrees")
        self.low_thrust = held.most * 0.5 * self.tip**2 + held.most * (1.1 * self.tip * told.attitude + 0.5 * told.attitude**2)
        turn = held.turning + held.spinning
        fast = held.rates + held.spin
        self.stale = 10.0 * (0.5 * H**2 * turn + H**3 * (fast**3 / 12.0 + fast * turn / 6.0))  # rad: attitude held in steps
        self.body = held.rates + self.slip, held.spin + self.swing
        jx, jy, jz = vehicle.inertia
        sensed = self.body[0] + told.gyroscope, self.body[1] + told.gyroscope
        cross = max(abs(jz - jy) / jx, abs(jx - jz) / jy)
        self.gyration = cross * self.body[0] * self.body[1], abs(jy - jx) / jz * 0.5 * self.body[0] ** 2
        self.countered = cross * sensed[0] * sensed[1], abs(jy - jx) / jz * 0.5 * sensed[0] ** 2
        self.sag = told.sag * cell.thrust[1]
        self._rotors()
        self._air(vehicle, air)
        self._cubic()

    def _rotors(self) -> None:
        """Bound rotors' thrusts, what they still have to change by, and what the square in their lag leaves; none may saturate."""
        model, cell, held, told = self.model, self.cell, self.held, self.model.disturbance
        vehicle, air, gains = model.vehicle, model.airframe, model.airframe.gains
        flat, heading, weak = self.bounds.lateral, self.bounds.heading, self.weak
        jx, jy, jz = vehicle.inertia
        arm, reach, small = vehicle.arm / math.sqrt(2.0), max(jx, jy), min(jx, jy)
        ahead = flat["asked"] / weak + gains.rate[0] * told.gyroscope + gains.attitude[0] * (told.attitude + self.stale)
        ahead = ahead + self.countered[0]
        ahead_spin = heading["asked"] + gains.rate[1] * told.gyroscope + gains.attitude[1] * (told.attitude + self.stale)
        ahead_spin = ahead_spin + self.countered[1]
        c = 0.25 * vehicle.mass * (self.bounds.vertical["b"] + self.low_thrust)
        tilt, spin = reach / (4.0 * arm) * ahead, jz / (4.0 * vehicle.torque_to_thrust) * ahead_spin
        moments = math.sqrt(2.0) * reach / (4.0 * arm) * (held.turning + flat["mu"] / weak + ahead)
        moments = moments + jz / (4.0 * vehicle.torque_to_thrust) * (held.spinning + heading["mu"] + ahead_spin)
        share = 0.25 * vehicle.mass
        self.least = share * (held.least - self.low_thrust - self.bounds.vertical["b"]) - moments
        self.most = share * (held.most + self.bounds.vertical["b"]) + moments
        changes = c + math.sqrt(2.0) * tilt + spin
        room = np.all(self.least > 1.001 * vehicle.rotor_thrust_min) and np.all(self.most < 0.999 * vehicle.rotor_thrust_max)
        if not room or not np.all(self.least > 0.0):
            raise NotProved(f"a rotor may need {1000 * self.least.min():.0f} to {1000 * self.most.max():.0f} mN and saturate")
        k, lead = air.thrust_coefficient, air.rotor_lag / gains.quickened_lag
        push = lead * changes / (2.0 * np.sqrt(self.least * k))
        fastest = math.sqrt(vehicle.rotor_thrust_max / k) * told.battery
        slowest = math.sqrt(vehicle.rotor_thrust_min / k)
        speeds = np.sqrt(self.least / k) - push, np.sqrt(self.most / k) + push
        if not np.all(speeds[0] > 1.001 * slowest) or not np.all(speeds[1] < 0.999 * fastest):
            raise NotProved("the lead on a rotor's speed may saturate it")
        least, most = vehicle.thrust_min / vehicle.mass, vehicle.thrust_max / vehicle.mass
        if not np.all(held.least - self.low_thrust > 1.001 * least) or not np.all(held.most < 0.999 * most):
            raise NotProved("the collective thrust may reach its least or most")
        turned = reach / (4.0 * arm) * (held.turning + flat["mu"] / weak + ahead)
        spun = jz / (4.0 * vehicle.torque_to_thrust) * (held.spinning + heading["mu"] + ahead_spin)
        middle = 0.5 * (self.least + self.most)
        ends = [1.0 / (np.sqrt(end) + np.sqrt(middle)) for end in (self.least, self.most)]
        mean, vary = 0.5 * (ends[0] + ends[1]), 0.5 * (ends[0] - ends[1])
        other = 4.0 * vary * 0.5 * (self.most - self.least)
        self.uneven_speeds = (
            (4.0 * mean * turned + math.sqrt(2.0) * other) / math.sqrt(k),
            (4.0 * mean * spun + other) / math.sqrt(k),
        )  # of speeds by sign along x and y together, and by spin
        inverse = 0.125 * (1.0 / self.least + 1.0 / self.most)
        apart = 0.125 * (1.0 / self.least - 1.0 / self.most)
        squares = 4.0 * (c * c + tilt * tilt + spin * spin)
        self.bent = arm / small * (8.0 * (c + spin) * tilt * inverse + math.sqrt(2.0) * apart * squares)
        self.bent_spin = vehicle.torque_to_thrust / jz * (8.0 * (c * spin + 0.5 * tilt * tilt) * inverse + apart * squares)
        self.bent_thrust = squares / (4.0 * self.least) / vehicle.mass
        hover = 0.25 * vehicle.mass * GRAVITY
        uneven = np.maximum(
            0.5 / np.sqrt(self.least) - 0.5 / math.sqrt(hover), 0.5 / math.sqrt(hover) - 0.5 / np.sqrt(self.most)
        )
        quick = air.rotor_inertia / jz * math.sqrt(cell.torque[1]) * lead / air.rotor_lag
        self.reaction = quick * np.maximum(uneven, 0.0) * 2.0 * np.sqrt(squares) / math.sqrt(k)
        roots = max(abs(math.sqrt(end) - math.sqrt(cell.choice.torque)) for end in cell.torque)
        linear = reaction_of(vehicle, air) * lead / air.rotor_lag
        self.reaction = self.reaction + linear * (roots * ahead_spin + 1.5 * self.bent_spin)

    def _air(self, vehicle: Vehicle, air: AirframeTable) -> None:
        """Bound what the air does beside the drag that the controller counts on."""
        told, plan, cell = self.model.disturbance, self.model.plan, self.cell
        across, along = self.model.drags
        light, heavy = 1.0 / (1.0 - told.mass), 1.0 / (1.0 + told.mass)
        quick, slow = math.sqrt(cell.torque[1]), math.sqrt(cell.torque[0])
        k, arm = air.thrust_coefficient, vehicle.arm / math.sqrt(2.0)
        thrust = self.held.most + self.bounds.vertical["b"]
        high = np.sqrt(thrust / GRAVITY) * quick * (1.0 + told.drag) * light
        low = np.sqrt(4.0 * self.least / (vehicle.mass * GRAVITY)) * slow * (1.0 - told.drag) * heavy
        off = np.maximum(np.maximum(high - 1.0, 1.0 - low), 0.0)
        side = plan.across[:, 1] + self.bounds.lateral["nu"] + told.wind
        up = plan.along[:, 1] + self.bounds.vertical["nu"] + told.wind
        tilted = high * abs(across - along)
        whole = np.hypot(side, up)
        square = max(air.body_drag) * whole**2 * light / vehicle.mass
        spread, spun = self.uneven_speeds[0] * quick, self.uneven_speeds[1] * quick
        total = 4.0 * np.sqrt(self.most / k) * quick
        drag, flow = max(air.rotor_drag, air.inflow_drag) * (1.0 + told.drag), air.inflow_drag * (1.0 + told.drag)
        rates, spin = self.body
        hubs = drag * (rates + spin) * arm * spread * light / vehicle.mass + square
        self.dragged = across * off * side + tilted * (self.leaning**2 * side + self.leaning * up) + hubs
        self.dragged_up = along * off * up + tilted * (self.leaning * side + self.leaning**2 * up) + hubs
        small = min(vehicle.inertia[0], vehicle.inertia[1])
        turning = (air.rotor_inertia + flow * arm**2) * spun * rates + flow * arm * spread * whole
        counted = roll_drag_of(vehicle, air)
        least = air.inflow_drag * (1.0 - told.drag) * arm**2 * 4.0 * np.sqrt(self.least / k) * slow
        apart = np.maximum(flow * arm**2 * total / small - counted, counted - least / max(vehicle.inertia[:2]))
        led = np.hypot(*(self._moved(jet.slope) for jet in self.fed.rates[:2]))
        led = led + 0.5 * TICK * (self.held.turning + self.changed_turning)
        self.hub_turn = turning / small + np.maximum(apart, 0.0) * rates + counted * led
        sideways = air.rotor_drag * (1.0 + told.drag)
        self.hub_spin = sideways * (arm * spread * whole + 2.0 * arm**2 * total * spin) / vehicle.inertia[2]
        self.wind = across * told.wind, along * told.wind

    def _cubic(self) -> None:
        """Bound how far the held attitude and thrust leave the plan's force until the next command."""
        held, t = self.held, TICK
        fifth = np.hypot(*self.model.reach(3))
        whole, turn = held.rates + held.spin, held.turning + held.spinning
        third = held.most * (3.0 * whole * turn + whole**3) + 3.0 * held.slope * (turn + whole**2)
        steps = (self.model.stepped(0) + t * self.model.stepped(1) + 0.5 * t * t * self.model.stepped(2))[:, 0]
        cubic = t**3 / 6.0 * (fifth + third) + steps + ROUNDING
        bend = 0.5 * t * t * most_of(self.fed.change)
        self.missed, self.missed_up = cubic + bend * held.lean, cubic + bend
        twist = 8.0 * t**3 / 6.0 * (turn * whole + whole**3) / self.upright**3
        first = float(np.linalg.norm(self.model.force()[0][0] - np.array([0.0, 0.0, GRAVITY])))
        self.end = shifted(np.hypot(self.missed, self.missed_up), first)
        self.twisted = shifted(twist)
        self.lean_between = np.maximum(held.lean, shifted(held.lean))
        self.skew_between = np.maximum(self.skew, shifted(self.skew))
        self.upright_between = np.minimum(self.upright, shifted(self.upright, 1.0))
        grown = self.bounds.lateral["grown"], self.bounds.vertical["grown"]
        self.force_step = grown[0] + self.end, grown[1] + self.end
        step = np.hypot(*self.force_step)
        self.length = np.minimum(held.least, shifted(held.least, GRAVITY)) - step
        if not np.all(self.length > 1.0):
            raise NotProved("the commanded force may jump by as much as it is")
        self.turn = 1.01 * step / self.length  # an arc sine of at most 0.2
        if not np.all(self.turn < 0.2):
            raise NotProved("the commanded attitude may jump by more than 11 degrees")
        steep = self.lean_between / self.upright_between
        self.turn_spin = self.turn * steep + (self.turn * (1.0 + steep)) ** 2 + self.twisted
        half = 0.25 * (self.turn**2 + self.turn_spin**2)
        self.turn_short = half / (1.0 + np.sqrt(np.maximum(1.0 - half, 0.0)))
        before = [np.maximum(own, shifted(own)) for own in (self.tip, self.twist, self.short)]
        self.tip_before, self.twist_before, self.short_before = before

    @property
    def changed_turning(self) -> Floats:
        """Distance of the angular acceleration that is fed forward from that without feedback, about x and y, rad/s^2."""
        return np.hypot(*(self._moved(jet.slope) for jet in self.fed.rates_change[:2]))

    def _moved(self, slope: tuple[Interval, ...]) -> Floats:
        return along_slopes(slope, self.bounds.lateral["p"], self.bounds.vertical["p"]) + ROUNDING
