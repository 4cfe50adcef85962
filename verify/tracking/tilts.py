"""Tilts against the force that is asked: bounds on them, and on what their equations have beside the linear ones.

The tilt is the horizontal part of the thrust's axis z times a scale s(t), which the plan alone makes: the length of its force over the cell's thrust. Its
error is d = s z - F_h - p, where F_h follows the plan's force from each command by its first two derivatives, and p is the feedback. So d jumps at a command
as p does, exactly. Then come e, its rate, and mu, the angular acceleration that is there times s, less the one that the plan needs; neither jumps but as the
plan does. The law's errors of attitude and rates are those of z against the commanded axis h, as C(e_y, -e_x) = (z - h) + (Q - 1)(z - h) / 2, where C has the
body's x and y as columns and Q turns the commanded attitude to the true one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Floats
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
    size_of,
)
from verify.tracking.flatness import FedForward, Jet
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
    def of(cls, model: ErrorModel, bounds: Bounds, own: Fed, share: float) -> Attitudes:
        """Bound them.

        Args:
            model: The robot.
            bounds: Of all states.
            own: What is fed forward.
            share: Acceleration over the acceleration that is commanded.

        Raises:
            NotProved: The vehicle may tilt too far, or the force fall to the least.
        """
        fed = own.here
        slope = most_of(fed.rate)
        turning, spinning = np.hypot(most_of(fed.rates_change[0]), most_of(fed.rates_change[1])), most_of(fed.rates_change[2])
        rates = np.hypot(most_of(fed.rates[0]), most_of(fed.rates[1])) + TICK * turning
        spin = most_of(fed.rates[2]) + TICK * spinning
        flat = np.linalg.norm(model.force()[0][:, :2], axis=1) / share + bounds.lateral["aim"]
        lean = np.minimum(flat / fed.length.value.low, np.hypot(most_of(fed.axis[0]), most_of(fed.axis[1]))) + TICK * rates
        if not np.all(lean < 0.7):
            raise NotProved("the vehicle may tilt by more than 44 degrees")
        least, most = fed.length.value.low - TICK * slope, fed.length.value.high + TICK * slope
        upright = model.force()[0][:, 2] - bounds.vertical["p"]
        vehicle = model.vehicle
        if not np.all(upright > 1.001 * vehicle.thrust_min / vehicle.mass) or not np.all(least > 1.0):
            raise NotProved("the commanded force may fall to the least thrust")
        return cls(least, most, slope, lean, rates, spin, turning, spinning)


class Tilts:
    """Bounds on tilts, their rates and moments, until the next command. Each is shape (ticks,).

    Attributes:
        least, most: Of the scale, m/s^2.
        lean: Sine of the tilt.
        upright: Cosine of it, and of the commanded one.
        tip: Distance of the thrust's axis from the commanded one.
        slip: Distance of the body rates about x and y from the commanded ones, rad/s.
        moved: Angular acceleration by rotors about x and y, rad/s^2.
        law: Moments that the law asks for beside the linear ones, times the scale.
        given: Those of them that set-points cost.
        turned: Accelerations of the tilt beside the linear ones.
        carried: What a step changes a moment's direction and scale by, times the scale.
        away: Distance of the axis from the plan's, horizontally.
        across: Distance of the axis from the commanded one, horizontally.
        longer: Distance of the scale from the length of the force that is asked, m/s^2.
        pulled: What that makes of the force at a command, horizontally.
        shifts: By how much that changes until the next one.
        twist: The attitude's error about the axis, rad.
        askew: How far it is from the twist beside the plan's attitude.
        restarted: What the twist jumps by at a command beside what is known of the plan's attitude, rad.
        curved: Distance of the plan's force from what its derivatives at the command make of it.
        slide: Rate of the scale, m/s^3.
        broken: Jumps of tilt, rate and moment where the plan's pieces join.
    """

    def __init__(self, model: ErrorModel, cell: Cell, bounds: Bounds, held: Attitudes, fed: Fed) -> None:
        """Bound them.

        Raises:
            NotProved: The vehicle may tilt too far.
        """
        self._model, self._cell, self._bounds, self._held, self._fed = model, cell, bounds, held, fed
        self._plan()
        flat = bounds.lateral
        self.lean = (self._side + flat["pushed"] + self.curved) / self.least
        over = np.maximum(self.lean, held.lean)
        if not np.all(over < 0.8):
            raise NotProved("the vehicle may tilt by more than 53 degrees")
        self.upright = np.sqrt(1.0 - over * over)
        self._lengths()
        across = flat["d"] + self._third + self.longer * held.lean
        self.across = across / self.least
        self.tip = self.across / self.upright
        self.away = (flat["tilted"] + abs(self._rho) * 0.5 * TICK * self._fast_side + self.curved) / self.least
        self._beside()
        self.twist = bounds.heading["f"] + self.askew
        self.askew = self.askew + (self.tip**2 + self.twist**2) / 7.0 * self.twist
        self.twist = bounds.heading["f"] + self.askew
        whole = np.hypot(self.tip, self.twist)
        if not np.all(whole < 0.8):
            raise NotProved("the attitude's error may be more than 53 degrees")
        straight = whole * whole / (1.0 + np.sqrt(1.0 - whole * whole))
        self._swung = self.twist + self.tip * self.tip + self.lean * self.tip + straight
        self._away_middle = self.away + 0.5 * TICK * self._first / (self.least * cell.choice.thrust)
        self._asked()
        self._turning()

    def _plan(self) -> None:
        """Bound the plan's force, its derivatives, and the scale."""
        model, share = self._model, self._cell.choice.thrust
        self._rho = 1.0 / share - 1.0
        reach = [model.reach(order) for order in range(4)]
        self._side, self._fast_side, self._second_side = reach[0][0], reach[1][0], reach[2][0]
        first, third = np.hypot(*reach[1]), np.hypot(*reach[3])
        steps = [model.stepped(order)[:, 0] for order in range(3)]
        self.curved = TICK**3 / 6.0 * third + steps[0] + TICK * steps[1] + 0.5 * TICK**2 * steps[2] + ROUNDING
        length = self._fed.alone.length.value
        self.least, self.most = length.low - TICK * first / share, length.high + TICK * first / share
        long = self.least * share
        level = np.minimum(self._side / long, 1.0)
        along = [level * side + up for side, up in reach]  # of derivatives, along the force
        self.slide = along[1] / share  # of the scale
        self._slide_change = (along[2] + first * first / long) / share
        bent = 3.0 * first * np.hypot(*reach[2]) / long + 3.0 * along[1] * first * first / long**2
        self._slide_third = (along[3] + bent) / share
        self._first, self._jumped = first, steps
        jumps = [level * steps[order] + model.stepped(order, up=True)[:, 0] for order in range(3)]
        self._bends = (
            steps[0] / share,
            (jumps[1] + first / long * steps[0]) / share,
            (jumps[2] + 3.0 * first / long * steps[1] + (np.hypot(*reach[2]) + first**2 / long) / long * steps[0]) / share,
        )  # of the scale

    def _lengths(self) -> None:
        """Bound how far the force that is asked, and its derivatives, are from the scale in length; and what its axis leaves of it."""
        held, fed, alone = self._held, self._fed.here, self._fed.alone
        share, long = self._cell.choice.thrust, self.least * self._cell.choice.thrust
        off = abs(1.0 - 1.0 / share)
        change = most_of(fed.change)
        own = off * most_of(alone.change) + self._first**2 / long * abs(share - 1.0 / share)
        drift = TICK * self._slide_third + self._bends[2]
        self._changed = self._moved(lambda fed: fed.change) + own + drift
        self._faster = self._moved(lambda fed: fed.rate) + off * most_of(alone.rate) + TICK * self._changed + self._bends[1]
        tall = self._lengthened()
        self.longer = tall + TICK * self._faster + self._bends[0]
        self._ratio = self.longer / (held.least - 0.5 * TICK * TICK * change)
        whole = held.rates + held.spin
        third = 3.0 * held.lean * (held.rates * held.turning + held.spin * held.spinning)
        third = third + 4.0 * (held.spin * held.turning + whole * held.spinning)
        third = (held.most + TICK * TICK * change) * (third + whole**3)
        third = third + 3.0 * (held.slope + TICK * change) * (held.turning + held.spinning + whole**2) + 3.0 * change * whole
        strayed, faster = self._model.given.strayed
        self._third = TICK**3 / 6.0 * third + strayed + ROUNDING
        self._third_rate = 0.5 * TICK**2 * third + faster + ROUNDING
        self._slope = held.slope + TICK * change
        self.pulled = tall * held.lean  # at commands
        self.shifts = TICK * (self._faster * held.lean + self.longer * held.rates)

    def _lengthened(self) -> Floats:
        """Bound how far the force that is asked at a command is from the scale in length."""
        side, up = self._bounds.lateral["aim"], self._bounds.vertical["aim"]
        level = np.linalg.norm(self._model.force()[0][:, :2], axis=1) / (
            self._cell.choice.thrust * self._fed.alone.length.value.low
        )
        along, beside = level * side + up, side + level * up
        least = self._fed.alone.length.value.low - along
        if not np.all(least > 1.0):
            raise NotProved("the commanded force may vanish")
        return np.minimum(self._moved(lambda fed: fed.length), along + 0.5 * beside * beside / least) + ROUNDING

    def _beside(self) -> None:
        """Bound how far attitudes are from that which is fed forward of the plan alone, and turns as it says until the next command.

        The twist t beside it is twice the third component of the quaternion of the rotation r from it. By the rates w of the body and v of what is
        fed forward of the plan, t' = cos(|r| / 2) (w - v)_3 + (q x v)_3 + (q x (w - v))_3 / 2, where q is twice the vector of that quaternion.
        """
        held, fed, bounds, heading = self._held, self._fed.here, self._bounds, self._model.given.heading
        twist, (tilting, spinning) = bounds.heading["f"], self._parting()
        tilted = heading * self._side / self._cell.choice.thrust
        angle = (bounds.lateral["aim"] + tilted + held.lean * bounds.vertical["aim"]) / fed.length.value.low + ROUNDING
        cosine, planned = np.sqrt(1.0 - held.lean**2), self._fed.alone
        leans = np.hypot(*(most_of(jet) for jet in planned.axis[:2]))
        about = angle * np.minimum(held.lean, leans + 0.5 * angle) / cosine  # of what is asked at a command
        parted = angle + about + TICK * (tilting + spinning)
        about = about + TICK * (spinning + parted * held.rates + 0.5 * parted * tilting)
        rates, turning, plain = self._planned()
        ahead = np.maximum(self._side / (self.least * self._cell.choice.thrust), leans + TICK * rates[0])
        if not np.all(ahead < 0.8):
            raise NotProved("the vehicle may tilt by more than 53 degrees")
        upright = np.minimum(self.upright, np.sqrt(1.0 - ahead * ahead))
        self._swayed = self.away / upright + plain + heading * ahead
        if not np.all(np.hypot(parted, np.hypot(self._swayed, twist)) < 0.8):
            raise NotProved("the attitude's error may be more than 53 degrees")
        self.askew = about + parted**2 / 7.0 * twist + 0.5 * parted * np.minimum(self._swayed, self.tip)
        self._rates = rates[0]
        whole, first, stepped = sum(rates), self._model.force()[0][0], 1.1 * plain
        lean = float(np.linalg.norm(first[:2]) / first[2])
        drift = 4.0 * TICK**3 * (turning * whole + whole**3) / upright**3
        about, stepped = shifted(drift + stepped * ahead / upright, lean * lean), shifted(stepped, lean)
        swayed = np.maximum(self._swayed + stepped, shifted(self._swayed))
        twist = np.maximum(twist + about, shifted(twist))
        spread = (about * (swayed**2 + twist**2) + (stepped**2 + about**2) * twist) / 7.0
        fifth = TICK**5 / 100.0 * whole * turning * (turning + whole**2)
        self.restarted = shifted(fifth) + ROUNDING + 0.5 * stepped * swayed + spread

    def _parting(self) -> tuple[Floats, Floats]:
        """Bound how fast the attitude that is asked turns beside the plan's: about x and y together, and about z, rad/s."""
        x, y, z = (
            self._moved(lambda fed, k=k: fed.rates[k]) + TICK * self._moved(lambda fed, k=k: fed.rates_change[k])
            for k in range(3)
        )
        return np.hypot(x, y), z

    def _planned(self) -> tuple[tuple[Floats, Floats], Floats, Floats]:
        """Bound rates of the plan's attitude, across and about its axis, how they change, and how far the axis is from the plan's force by the next command."""
        alone, least = self._fed.alone, self._fed.alone.length.value.low
        changes = np.hypot(*(most_of(jet) for jet in alone.rates_change[:2])), most_of(alone.rates_change[2])
        rates = (
            np.hypot(*(most_of(jet) for jet in alone.rates[:2])) + TICK * changes[0],
            most_of(alone.rates[2]) + TICK * changes[1],
        )
        whole, turning, change = rates[0] + rates[1], changes[0] + changes[1], most_of(alone.change)
        slope = most_of(alone.rate) + TICK * change
        longest = alone.length.value.high + TICK * slope
        third = longest * (3.0 * whole * turning + whole**3) + 3.0 * slope * (turning + whole**2) + 3.0 * change * whole
        strayed = TICK**3 / 6.0 * third + self.curved + abs(self._rho) * (TICK * self._first + self._jumped[0]) + ROUNDING
        return rates, turning, strayed / np.minimum(least - TICK * slope, self.least)

    @property
    def twisting(self) -> Floats:
        """Bound of the twist's rate beside the body's about its axis, rad/s."""
        tilting, spinning = self._parting()
        straight = (self._swayed**2 + self._bounds.heading["f"] ** 2) / 7.0
        across = self._swayed * (self._rates + 0.5 * (self.slip + tilting))
        return spinning + across + straight * (self._bounds.heading["o"] + spinning)

    def _asked(self) -> None:
        """Bound what the law asks for beside the linear terms."""
        model, held, flat = self._model, self._held, self._bounds.lateral
        gains = model.airframe.gains
        length = self._faster + self._slope * self._ratio
        force_rate = self._fast_side + 0.5 * TICK**2 * np.hypot(*model.reach(3)) + self._third_rate
        rate = (
            self._third_rate + self._ratio * force_rate + length * self.lean + self._slope * (1.0 + self._ratio) * self.across
        )
        rate = rate + self.most * self._swung * held.rates
        self.slip = (flat["e"] + rate) / (self.least * self.upright)
        angle = self._third + self.shifts + 0.5 * self.most * self.tip * self._swung
        given = self._strayed_moments()
        turned = given + self._moments()
        frame = self.most * held.turning * (self._swung + TICK * (held.spin + held.lean * held.rates))
        strayed, faster = model.given.strayed
        self.given = gains.attitude[0] * strayed + gains.rate[0] * faster + given
        self.law = gains.attitude[0] * angle + gains.rate[0] * rate + turned + frame
        self.moved = (flat["moved"] + ROUNDING) / (self.least * self.upright)

    def _moments(self) -> Floats:
        """Bound how far feedback moves the angular acceleration that is fed forward, times the force's length, from what the plan makes of it."""
        held, fed, bounds = self._held, self._fed, self._bounds
        here = lateral_moments(fed.here)
        side, up = bounds.lateral["aim"], bounds.vertical["aim"]
        moved = np.hypot(*(along_slopes(jet.slope, side, up) + ROUNDING for jet in here))
        size = np.hypot(*(most_of(jet) for jet in here))
        at = self._lengthened() + TICK * self.slide
        return moved + at / held.least * size + ROUNDING

    def _strayed_moments(self) -> Floats:
        """Bound how far set-points move these, and what their heading turns them by."""
        planned, given = (lateral_moments(fed) for fed in (self._fed.alone, self._fed.given))
        off = np.hypot(*(size_of(one.value - other.value) for one, other in zip(given, planned, strict=True)))
        return off + self._model.given.heading * np.hypot(*(most_of(jet) for jet in planned))

    def _turning(self) -> None:
        """Bound accelerations of the tilt beside the linear ones, with the plan's at the command taken out."""
        held, alone, flat = self._held, self._fed.middle, self._bounds.lateral
        heading, model = self._bounds.heading, self._model
        rates = held.rates + self.slip
        change, rate = most_of(alone.change), most_of(alone.rate)
        share, long = self._cell.choice.thrust, self.least * self._cell.choice.thrust
        off = abs(1.0 - 1.0 / share)
        own = off * change + self._first**2 / long * abs(share - 1.0 / share) + 0.5 * TICK * self._slide_third
        own = own + self._bends[2]
        slower = off * rate + 0.5 * TICK * self._slide_change + self._bends[1]
        planned = np.hypot(*(most_of(jet) for jet in alone.rates[:2]))
        gone = self._away_middle
        rates_off = (
            flat["e"]
            + 0.5 * TICK * (self._second_side + self.slide * planned)
            + TICK**2 / 8.0 * model.reach(3)[0]
            + self._jumped[1]
            + TICK * self._jumped[2]
            + slower * self.lean
            + rate * gone
        )
        rates_off = rates_off / (self.least * self.upright) + gone * planned / self.upright**3
        spin_alone = most_of(alone.rates[2])
        spin_off = (
            heading["o"]
            + self._moved(lambda fed: fed.rates[2])
            + TICK * held.spinning
            + size_of(self._fed.alone.rates[2].value - alone.rates[2].value)
        )
        spun = self.most * (spin_off * rates + spin_alone * (rates_off + gone / self.upright * planned))
        wide = self.most * (self.lean * (2.0 * planned * rates_off + rates_off**2) + planned**2 * gone)
        stretch = 0.5 * TICK * self.slide * (spin_alone * planned + planned**2 * self.lean)
        self.turned = own * self.lean + change * gone + 2.0 * slower * rates + 2.0 * rate * rates_off + spun + wide + stretch
        self.broken = (
            self._jumped[0] / share * self.lean,
            (self._jumped[1] * self.lean + self._jumped[0] * (rates + self._first / long)) / share,
            self._jumped[0] / share * self.moved,
        )
        self.carried = H * (held.spin + heading["o"] + self.lean * rates + self.slide / self.least) * self.moved * self.most

    def _moved(self, of: Callable[[FedForward], Jet]) -> Floats:
        return self._fed.moved(of, self._bounds)


def lateral_moments(fed: FedForward) -> tuple[Jet, Jet]:
    """Return the angular acceleration that is fed forward as it moves the thrust's axis horizontally, times the force's length."""
    zx, zy, zz = fed.axis
    level = (zx * zx + zz * zz).root()
    ax, ay, _ = fed.rates_change
    x = ay * (zz / level) + ax * (zx * zy / level)
    y = -(ax * level)
    return fed.length * x, fed.length * y
