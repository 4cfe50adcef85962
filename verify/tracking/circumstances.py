"""The circumstances of a disturbed flight, bounded from bounds on the states: tilts, rotors, air, and jumps at commands.

All bounds are sums, products and quotients of numbers that are not negative; a factor in the proof covers their rounding.
"""

from __future__ import annotations

import math

import numpy as np

from verify.arithmetic.balls import Floats
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
    shifted,
)
from verify.tracking.loops import lag_share, reaction_of, roll_drag_of
from verify.tracking.sampled_loop import TICK
from verify.tracking.tilts import Attitudes, Tilts


class Circumstances:
    """Tilts, rotors, air and commands, bounded from bounds on the states."""

    def __init__(self, model: ErrorModel, cell: Cell, bounds: Bounds, held: Attitudes, fed: Fed) -> None:
        self.model, self.cell, self.bounds, self.held, self.fed, self.all = model, cell, bounds, held, fed.here, fed
        vehicle, air, told = model.vehicle, model.airframe, model.disturbance
        self.tilts = Tilts(model, cell, bounds, held, fed)
        self.tip = self.tilts.tip
        self.weak = fed.here.length.value.low  # m/s^2, of the force that is asked
        self.upright = np.sqrt(1.0 - held.lean * held.lean)
        self.leaning = self.tilts.lean
        self.low_thrust = held.most * 0.5 * self.tip**2 + held.most * (1.1 * self.tip * told.attitude + 0.5 * told.attitude**2)
        turn = held.turning + held.spinning
        fast = held.rates + held.spin
        self.stale = 10.0 * (0.5 * H**2 * turn + H**3 * (fast**3 / 12.0 + fast * turn / 6.0))  # rad: attitude held in steps
        self.body = self.tilts.rates[0] + self.tilts.slip, self.tilts.rates[1] + self.bounds.heading["o"]
        jx, jy, jz = vehicle.inertia
        sensed = self.body[0] + told.gyroscope, self.body[1] + told.gyroscope
        cross, spin = max(abs(jz - jy) / jx, abs(jx - jz) / jy), 0.5 * abs(jy - jx) / jz
        self.countered = cross * sensed[0] * sensed[1], spin * sensed[0] ** 2
        self.swung, self._cross = cross * self.body[0] * self.body[1], cross
        more, less = told.inertia, 1.0 - told.inertia
        cross, spin = (cross + more * (jz + max(jx, jy)) / min(jx, jy)) / less, (spin + 0.5 * more * (jx + jy) / jz) / less
        self.gyration = cross * self.body[0] * self.body[1], spin * self.body[0] ** 2
        self.sag = told.sag * cell.thrust[1]
        self._steps()
        self._rotors()
        self._air(vehicle, air)

    def _rotors(self) -> None:
        """Bound rotors' thrusts, what they still have to change by, and what the square in their lag leaves; none may saturate."""
        model, cell, held, told = self.model, self.cell, self.held, self.model.disturbance
        vehicle, air, gains = model.vehicle, model.airframe, model.airframe.gains
        flat, heading, tilts = self.bounds.lateral, self.bounds.heading, self.tilts
        jx, jy, jz = vehicle.inertia
        arm, reach, small = vehicle.arm / math.sqrt(2.0), max(jx, jy), min(jx, jy)
        scale = tilts.least
        unknown = gains.rate[0] * told.gyroscope + gains.attitude[0] * (told.attitude + self.stale) + self.countered[0]
        unknown = unknown + (tilts.law + ROUNDING) / scale
        ahead, own = flat["asked"] / scale + unknown, TICK * tilts.slide * tilts.turns[0] / scale
        ahead_spin = heading["asked"] + gains.rate[1] * told.gyroscope + gains.attitude[1] * (told.attitude + self.stale)
        ahead_spin = ahead_spin + self.countered[1] + tilts.law_spin
        self.ahead = ahead, ahead_spin  # rad/s^2 that rotors have still to change by
        k, lead = air.thrust_coefficient, air.rotor_lag / gains.quickened_lag
        share, pull, yaw = 0.25 * vehicle.mass, reach / (4.0 * arm), jz / (4.0 * vehicle.torque_to_thrust)
        c = share * (self.bounds.vertical["b"] + self.low_thrust)
        tilt, spin = pull * ahead, yaw * ahead_spin
        turns = tilts.turns[1] + heading["mu"]
        root2 = math.sqrt(2.0)
        moments = root2 * pull * tilts.moved + yaw * turns
        wanted = root2 * pull * (flat["steering"] / scale + own + unknown) + yaw * (turns + ahead_spin)
        weakest, strongest = self._thrusts()
        self.mean = share * weakest, share * strongest
        asked = held.least - self.low_thrust, held.most
        self.least = np.minimum(share * weakest - moments, share * asked[0] - wanted)
        self.most = np.maximum(share * strongest + moments, share * asked[1] + wanted)
        room = np.all(self.least > 1.001 * vehicle.rotor_thrust_min) and np.all(self.most < 0.999 * vehicle.rotor_thrust_max)
        if not room or not np.all(self.least > 0.0):
            raise NotProved(f"a rotor may need {1000 * self.least.min():.0f} to {1000 * self.most.max():.0f} mN and saturate")
        led = share * (held.most + lead * self.bounds.vertical["b"]) + root2 * pull * (
            flat["leading"] / scale + own + lead * unknown
        )
        led = led + yaw * (turns + lead * ahead_spin)
        fastest = math.sqrt(vehicle.rotor_thrust_max / k) * told.battery
        slowest = math.sqrt(vehicle.rotor_thrust_min / k)
        sooner = c + root2 * tilt + spin
        slow = np.sqrt(self.least / k) - lead * sooner / (2.0 * np.sqrt(self.least * k))
        speeds = slow, np.maximum(led_root(self.least, self.most, led, lead * sooner), np.sqrt(self.most)) / math.sqrt(k)
        if not np.all(speeds[0] > 1.001 * slowest) or not np.all(speeds[1] < 0.999 * fastest):
            raise NotProved(
                f"the lead may ask {100.0 * speeds[1].max() / fastest:.0f} % of a rotor's greatest speed, and saturate"
            )
        least, most = vehicle.thrust_min / vehicle.mass, vehicle.thrust_max / vehicle.mass
        if not np.all(held.least - self.low_thrust > 1.001 * least) or not np.all(held.most < 0.999 * most):
            raise NotProved("the collective thrust may reach its least or most")
        between = within_a_step(self.least, lag_share(air) * sooner)
        turned, spun = pull * tilts.moved + between, yaw * turns + between
        root = np.sqrt(self.least)
        self.apart = np.minimum((math.sqrt(2.0) * turned + spun) / self.least, 1.0)
        self.uneven_speeds = (
            2.0 * turned / root / math.sqrt(k),
            (2.0 * spun / root + turned * turned / root**3) / math.sqrt(k),
        )  # of speeds by sign along x and y together, and by spin
        inverse = 0.125 * (1.0 / self.least + 1.0 / self.most)
        apart = 0.125 * (1.0 / self.least - 1.0 / self.most)
        squares = 4.0 * (c * c + tilt * tilt + spin * spin)
        self.bent = arm / small * (8.0 * (c + spin) * tilt * inverse + math.sqrt(2.0) * apart * squares)
        self.bent_spin = vehicle.torque_to_thrust / jz * (8.0 * (c * spin + 0.5 * tilt * tilt) * inverse + apart * squares)
        self.bent_thrust = squares / (4.0 * self.least) / vehicle.mass
        hover = 0.25 * vehicle.mass * GRAVITY
        uneven = np.maximum(
            0.5 / np.sqrt(share * weakest) - 0.5 / math.sqrt(hover), 0.5 / math.sqrt(hover) - 0.5 / np.sqrt(share * strongest)
        )  # of half the inverse of the root, at the mean of the rotors
        bend, bow = 0.25 / root**3, 0.375 / root**5  # derivatives of half the inverse of the root
        light, heavy = math.sqrt(1.0 / (1.0 - told.inertia)), math.sqrt(1.0 / (1.0 + told.inertia))
        quick = air.rotor_inertia / jz * math.sqrt(cell.torque[1]) * light * lead / air.rotor_lag
        sums = (
            c * (4.0 * bend * spun + 2.0 * bow * (turned * turned + spun * spun))
            + 4.0 * tilt * turned * bend
            + spin * (4.0 * np.maximum(uneven, 0.0) + 2.0 * bow * (turned * turned + spun * spun))
        )
        self.reaction = quick * sums / math.sqrt(k)
        ends = math.sqrt(cell.torque[0]) * heavy, math.sqrt(cell.torque[1]) * light
        roots = max(abs(end - math.sqrt(cell.choice.torque)) for end in ends)
        linear = reaction_of(vehicle, air) * lead / air.rotor_lag
        self.reaction = self.reaction + linear * (roots * ahead_spin + 1.5 * self.bent_spin)

    @property
    def unswung(self) -> tuple[Floats, Floats]:
        """Bound what the law asks against gyroscopic moments, and these, beside those of a vehicle as meant at the beginning of a step, rad/s^2."""
        told, (wide, about), most = self.model.disturbance, self.body, self.cell.torque[1]
        turning = most * self.tilts.moved + self.gyration[0] + self.hub_turn + self.moment[0]
        spinning = most * (self.tilts.turns[1] + self.bounds.heading["mu"]) + self.gyration[1] + self.hub_spin
        spinning = spinning + self.reaction + self.moment[1]
        changed = H * self._cross * (turning * (about + H * spinning) + wide * spinning)
        changed = changed + H * self.swung * (wide + about + self.tilts.slide / self.tilts.least)
        felt = self._cross * told.gyroscope * (wide + about + told.gyroscope)
        return felt, self.gyration[0] - self.swung + changed

    def _thrusts(self) -> tuple[Floats, Floats]:
        """Bound the thrust by the model of the rotors, m/s^2: by what is asked and its error, and by what it pushes beside the plan."""
        held, cell, force = self.held, self.cell, self.model.reach(0)[1]
        error = self.bounds.vertical["b"]
        least = np.maximum(held.least - error, (GRAVITY - force - self.lifted) / (cell.thrust[1] * (1.0 + 1e-9)))
        most = np.minimum(held.most + error, (GRAVITY + force + self.lifted) / (cell.thrust[0] * self.tilts.upright))
        return least, most

    def _air(self, vehicle: Vehicle, air: AirframeTable) -> None:
        """Bound what the air does beside the drag that the controller counts on."""
        told, plan, cell = self.model.disturbance, self.model.plan, self.cell
        across, along = self.model.drags
        light, heavy = 1.0 / (1.0 - told.mass), 1.0 / (1.0 + told.mass)
        quick, slow = math.sqrt(cell.torque[1]), math.sqrt(cell.torque[0])
        k, arm = air.thrust_coefficient, vehicle.arm / math.sqrt(2.0)
        uneven = 1.0 - 0.5 * self.apart * self.apart  # of the rotors: their mean speed over that of their mean thrust
        force, upright = GRAVITY + self.model.reach(0)[1], self.tilts.upright
        high = np.sqrt((force + self.lifted) / upright / GRAVITY * light / min(1.0, cell.torque[0])) * (1.0 + told.drag)
        low = GRAVITY - self.model.reach(0)[1] - self.lifted
        if not np.all(low > 0.0):
            raise NotProved("the thrust may vanish")
        low = np.sqrt(low / GRAVITY * heavy / max(1.0, cell.torque[1])) * (1.0 - told.drag) * uneven
        off = np.maximum(np.maximum(high - 1.0, 1.0 - low), 0.0)
        off_centre = told.centre * (self.body[0] + self.body[1])  # m/s, of the rotors
        side = plan.across[:, 1] + self.bounds.lateral["nu"] + told.wind + off_centre
        up = off_centre + plan.along[:, 1] + self.bounds.vertical["nu"] + told.wind
        tilted = high * abs(across - along)
        axial, level = up + self.leaning * side, side + self.leaning * up
        whole = np.hypot(side, up)
        square = max(air.body_drag) * whole**2 * light / vehicle.mass
        spread, spun = self.uneven_speeds[0] * quick, self.uneven_speeds[1] * quick
        total = 4.0 * np.sqrt(self.mean[1] / k) * quick
        drag, flow = max(air.rotor_drag, air.inflow_drag) * (1.0 + told.drag), air.inflow_drag * (1.0 + told.drag)
        rates, spin = self.body
        hubs = drag * (rates + spin) * arm * spread * light / vehicle.mass + square
        self.dragged = across * off * side + tilted * (self.leaning**2 * side + self.leaning * up) + hubs
        self.dragged_up = along * off * up + tilted * (self.leaning * side + self.leaning**2 * up) + hubs
        small, large = min(vehicle.inertia[:2]) * (1.0 - told.inertia), max(vehicle.inertia[:2]) * (1.0 + told.inertia)
        turning = (air.rotor_inertia + flow * arm**2) * spun * rates + flow * arm * spread * axial
        counted = roll_drag_of(vehicle, air)
        least = air.inflow_drag * (1.0 - told.drag) * arm**2 * 4.0 * np.sqrt(self.mean[0] / k) * uneven * slow
        apart = np.maximum(flow * arm**2 * total / small - counted, counted - least / large)
        self.hub_turn = turning / small + np.maximum(apart, 0.0) * rates
        upon = vehicle.inertia[2] * (1.0 - told.inertia)
        sideways = air.rotor_drag * (1.0 + told.drag)
        self.hub_spin = sideways * (arm * spread * level + 2.0 * arm**2 * total * spin) / upon
        dragged = max(across, along) * high
        pulled = (force + self.lifted) / upright + dragged * whole
        heavy = vehicle.mass * (1.0 + told.mass) * told.centre
        self.moment = (told.moment + heavy * pulled) / small, (told.moment + heavy * dragged * level) / upon
        self.wind = across * told.wind, along * told.wind

    @property
    def lifted(self) -> Floats:
        """Vertical thrust less the plan's, m/s^2."""
        bounds, cell, model = self.bounds.vertical, self.cell, self.model
        own = bounds["push"] + cell.spread[0] * bounds["pushed"] + cell.thrust[1] * (self.missed_up + self.coupled_up)
        sampled = (
            max(abs(end - 1.0) for end in cell.thrust) * (0.5 * TICK * model.reach(1)[1] + model.plan.jumps[:, 2]) + ROUNDING
        )
        return own + self.sag * (GRAVITY + model.reach(0)[1]) + sampled

    @property
    def coupled_up(self) -> Floats:
        """Share of a thrust that tilts, and its error's, that is not vertical as commanded, m/s^2."""
        held, tilts = self.held, self.tilts
        low = np.minimum(tilts.tip * (2.0 * held.lean + tilts.tip), np.maximum(tilts.lean, held.lean) ** 2)
        low = low / (2.0 * tilts.upright)
        return self.bounds.vertical["b"] * (1.0 - np.sqrt(1.0 - tilts.lean**2)) + held.most * low

    def _steps(self) -> None:
        """Bound by how much the force that is asked jumps at commands, from what was held to."""
        held, tilts, lateral = self.held, self.tilts, self.bounds.lateral
        self.missed_up = tilts.cubic + tilts.bend
        first = float(np.linalg.norm(self.model.force()[0][0] - np.array([0.0, 0.0, GRAVITY])))
        self.end = shifted(np.hypot(tilts.cubic + tilts.bend * held.lean, self.missed_up), first)
        self.lean_between = np.maximum(held.lean, shifted(held.lean))
        self.upright_between = np.minimum(self.upright, shifted(self.upright, 1.0))
        self.force_step = lateral["grown"] + self.end, self.bounds.vertical["grown"] + self.end


def led_root(least: Floats, most: Floats, led: Floats, sooner: Floats) -> Floats:
    """Bound what the lead on the rotors' lag asks, as the root of a thrust.

    A thrust f that is to be w asks r + n (w / r - r) / 2 at most, with r the root of f and n the lead, as the root of w is below its tangent. With l = f + n (w - f)
    that is (r + l / r) / 2, and r + n (w - f) / (2 r) as well. Both are convex in r, and the same where l - n (w - f) is f.

    Args:
        least: Of f, N.
        most: Of f.
        led: Most of l, N.
        sooner: Most of n |w - f|, N.
    """
    tied = np.clip(led - sooner, least, most)
    ends = [0.5 * (np.sqrt(end) + led / np.sqrt(end)) for end in (tied, most)]
    return np.maximum(np.maximum(*ends), np.sqrt(least) + 0.5 * sooner / np.sqrt(least))


def within_a_step(least: Floats, sooner: Floats) -> Floats:
    """Bound how far a thrust is in a step from where it would be on a straight way between its ends, N.

    All rotors' speeds approach what is asked by one law, so that with a share x of that way a thrust is the square of a + x b, off the straight one by b^2 / 4 at most.
    The roots of two thrusts differ by no more than the thrusts over the root of one of them.

    Args:
        least: Thrust of a rotor, N.
        sooner: Share of a step, times how far what is asked of a rotor may be from what it gives, N.
    """
    return sooner * sooner / least
