"""Attitudes beside the plan's: bounds on them, and on what their equations have beside the linear ones.

The plan alone, over the cell's thrust, makes an attitude P at each command, and it turns on by the rates and their change that are fed forward of it. The error
is q, twice the vector of the quaternion of P'R; so it moves at commands by what P alone jumps, which is known. Its horizontal part (q_y, -q_x), times a scale
s(t) that the plan alone makes, is the feedback and an error d; so d jumps as the feedback does, exactly. Then come e and mu, rates and moments beside those of P,
alike. The law asks for moments in body axes, where it is linear however the plan turns. What is left are products of q with rates, and what the feedback makes
of attitudes, rates and moments that are commanded beside what is linear: they are held from command to command.
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
    most_of,
    shifted,
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
    """Bounds on attitudes, their rates and moments, until the next command. Each is shape (ticks,).

    Attributes:
        least, most: Of the scale, m/s^2.
        slide: Rate of the scale, m/s^3.
        rates, turns: Of the plan's attitude: rates, and their change, about x and y together and about z.
        swayed: Its distance from the true one about x and y, rad.
        slip: Distance of the rates about x and y from the plan's, rad/s.
        tilt, twist: The attitude's error against the commanded one, about x and y together and about z.
        tip: Distance of the thrust's axis from the commanded one.
        lean: Sine of the tilt.
        upright: Cosine of it, and of the commanded one.
        cubic: Distance of the held force from the plan's and the feedback until then, m/s^2, but for `bend` along itself.
        pulled: What the feedback turns the attitude by beside what is linear, at commands, times the scale.
        pushed: Force beside the linear one and that, horizontally, m/s^2.
        law: Moments that the law asks for beside the linear ones, times the scale.
        given: Those of them that set-points cost.
        law_spin: As `law`, about z, rad/s^2.
        moved: Angular acceleration by rotors about x and y, rad/s^2.
        turned: Rates of the attitude beside the linear ones, times the scale.
        twisting: The same about z, rad/s.
        carried: What a step changes a moment's scale by, times the scale.
        jumped: Distance from what is known to what the plan's attitude turns by at a command, times the scale: alone, and by errors.
        restarted: What it turns by about z, rad.
        broken: Jumps of tilt, rate and moment where the plan's pieces join.
    """

    def __init__(self, model: ErrorModel, cell: Cell, bounds: Bounds, held: Attitudes, fed: Fed) -> None:
        """Bound them.

        Raises:
            NotProved: The vehicle may tilt too far.
        """
        self._model, self._cell, self._bounds, self._held, self._fed = model, cell, bounds, held, fed
        self._plan()
        self._planned()
        self._lengths()
        self._held_force()
        self._commanded()
        self._errors()
        self._axes()
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

    def _planned(self) -> None:
        """Bound the plan's attitude, alone: its rates and their change, its tilt, and how far its axis and it are from the plan's force by the next command."""
        alone, rho = self._fed.alone, abs(1.0 / self._cell.choice.thrust - 1.0)
        across, about = (np.hypot(*(most_of(jet) for jet in turns[:2])) for turns in (alone.rates, alone.rates_change))
        self.turns = about, most_of(alone.rates_change[2])
        self.rates = across + TICK * about, most_of(alone.rates[2]) + TICK * self.turns[1]
        whole, turning, change = self.rates[0] + self.rates[1], self.turns[0] + self.turns[1], most_of(alone.change)
        slope = most_of(alone.rate) + TICK * change
        third = (alone.length.value.high + TICK * slope) * (3.0 * whole * turning + whole**3)
        third = third + 3.0 * slope * (turning + whole**2) + 3.0 * change * whole
        least = np.minimum(alone.length.value.low - TICK * slope, self.least)
        self._third = TICK**3 / 6.0 * third + ROUNDING
        slid = self.curved + rho * (TICK * self._first + self._jumped[0])
        self._leans = np.hypot(*(most_of(jet) for jet in alone.axis[:2]))
        self._ahead = np.maximum(self._side / (self.least * self._cell.choice.thrust), self._leans + TICK * self.rates[0])
        if not np.all(self._ahead < 0.8):
            raise NotProved("the vehicle may tilt by more than 53 degrees")
        self._strayed = self.curved + 1.1 * self._third + slid * self._ahead
        self._stepped = 1.1 * (self._third + slid) / least
        upright = np.sqrt(1.0 - self._ahead**2)
        self._fifth = shifted(TICK**5 / 100.0 * whole * turning * (turning + whole**2)) + ROUNDING
        self._drift = 4.0 * TICK**3 * (turning * whole + whole**3) / upright**3
        self._about = self._stepped * self._ahead / upright

    def _lengths(self) -> None:
        """Bound how far the force that is asked, and its rate, are from the scale in length."""
        alone = self._fed.alone
        share, long = self._cell.choice.thrust, self.least * self._cell.choice.thrust
        off = abs(1.0 - 1.0 / share)
        own = off * most_of(alone.change) + self._first**2 / long * abs(share - 1.0 / share)
        changed = self._moved(lambda fed: fed.change) + own + TICK * self._slide_third + self._bends[2]
        self._faster = self._moved(lambda fed: fed.rate) + off * most_of(alone.rate) + TICK * changed + self._bends[1]
        self.tall = self._lengthened()
        self.longer = self.tall + TICK * self._faster + self._bends[0]

    def _held_force(self) -> None:
        """Bound how far the held attitude and thrust leave the plan's force and the feedback until the next command."""
        held, model, heading = self._held, self._model, self._model.given.heading
        whole, turn = held.rates + held.spin, held.turning + held.spinning
        third = held.most * (3.0 * whole * turn + whole**3) + 3.0 * held.slope * (turn + whole**2)
        strayed, self.bend = model.given.strayed[0], 0.5 * TICK**2 * most_of(self._fed.here.change)
        self.strayed = strayed + heading * (TICK * self._fast_side + self._jumped[0])
        third = TICK**3 / 6.0 * third
        self.cubic = third + self.curved + strayed + ROUNDING
        self._held_third = third + self._third + self.bend * TICK * held.rates

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

    def _commanded(self) -> None:
        """Bound how far attitudes, rates and moments that are commanded are from the plan's alone, until the next command.

        The feedback a turns the axis, in the axes x, y of the plan's attitude, to (x . a, y . a) over the length A of the force that is asked. That is a / s but for
        the difference of A and s, for how x and y are tilted, and for what is vertical of a.
        """
        held, fed, heading, flat = self._held, self._fed.here, self._model.given.heading, self._bounds.lateral
        (across, about), (turns, spins) = self._parted("rates"), self._parted("rates_change")
        self._tilting, self._spinning, self._turned, self._spun = across + TICK * turns, about + TICK * spins, turns, spins
        side, up = flat["aim"] + heading * (self._side + flat["p"]), self._bounds.vertical["aim"]
        angle = (side + self._leans * up) / fed.length.value.low + ROUNDING
        angle = angle * (1.0 + 0.2 * angle * angle)
        near = angle * np.minimum(held.lean, self._leans + 0.5 * angle) / np.sqrt(1.0 - held.lean**2)
        self._angle = angle + near + TICK * (self._tilting + self._spinning)
        self._near = near + TICK * (self._spinning + self._angle * (self.rates[0] + 0.5 * self._tilting))
        ratio = self.longer / held.least
        self.pulled = (uneven(self._leans) + self.tall / fed.length.value.low) * side
        self.pulled = self.pulled + (1.0 + self.tall / fed.length.value.low) * self._leans * up
        stretched = (self._faster + held.slope * ratio) / held.least
        shifts = (1.0 + ratio) * (self.rates[0] * (up + self._ahead * side) + self.rates[1] * (side + self._ahead * up))
        self._shifts = TICK * (shifts + stretched * (side + self._ahead * up)) + ratio * ROUNDING

    def _errors(self) -> None:
        """Bound the true attitude's distance from the plan's, and from the commanded one.

        Of q and the commanded attitude's c the latter is, as a quaternion's vector, cos(|c| / 2) q - cos(|q| / 2) c - c x q / 2. A cosine is off 1 by at most |c|^2 / 7.
        """
        flat, heading, rho = self._bounds.lateral, self._model.given.heading, abs(1.0 / self._cell.choice.thrust - 1.0)
        beside = rho * (0.5 * TICK * self._fast_side + self._jumped[0]) + heading * (self._side + flat["p"])
        self.swayed, f = (flat["tilted"] + beside) / self.least, self._bounds.heading["f"]
        self.slip, angle, near = flat["e"] / self.least, self._angle, self._near
        if not np.all(np.hypot(angle, np.hypot(self.swayed, f)) < 0.8):
            raise NotProved("the attitude's error may be more than 53 degrees")
        self._straight = (self.swayed**2 + f**2) / 7.0
        mixed = (
            angle**2 / 7.0 * (self.swayed + angle) + self._straight * angle + 0.5 * (angle * (f + near) + near * self.swayed)
        )
        self._off = self._shifts + self._held_third + self.strayed + self.most * mixed
        self.tilt = (flat["tipped"] + self._off) / self.least
        self.twist = (
            f
            + near
            + angle**2 / 7.0 * f
            + self._straight * near
            + 0.5 * angle * np.minimum(self.swayed, self.tilt * (1.0 + angle))
        )
        whole = self.tilt**2 + self.twist**2
        if not np.all(whole < 0.64):
            raise NotProved("the attitude's error may be more than 53 degrees")
        self._bent = whole / 7.0
        self.tip = np.hypot(self.tilt * (1.0 + 0.5 * self.twist), 0.5 * self.tilt**2)

    def _axes(self) -> None:
        """Bound where the thrust's axis is, and the force that it makes beside the linear one.

        Of an attitude beside the plan's, the axis is P (cos(|q| / 2) (q_y, -q_x) + q_z (q_x, q_y) / 2, 1 - (q_x^2 + q_y^2) / 2).
        """
        held, flat, f, ahead = self._held, self._bounds.lateral, self._bounds.heading["f"], self._ahead
        whole = TICK * sum(self.rates)
        wide = uneven(ahead) + TICK * (self.rates[1] + ahead * self.rates[0]) + 0.5 * whole**2 + self._model.given.heading
        second = self.most * self.swayed * (self._straight + 0.5 * f + 0.5 * ahead * self.swayed) + self._strayed
        turned = self._model.given.heading * flat["d"]
        self.lean = (self._side + flat["pushed"] + turned + self.most * wide * self.swayed + second) / self.least
        over = np.maximum(self.lean, held.lean)
        if not np.all(over < 0.8):
            raise NotProved("the vehicle may tilt by more than 53 degrees")
        self.upright = np.sqrt(1.0 - over * over)
        self.pushed = self.most * (wide * self.tilt + 0.6 * ahead * self._angle**2) + self.longer * self.tip
        self.pushed = self.pushed + second + self._shifts + self._held_third + self.strayed + self.bend * held.lean

    def _asked(self) -> None:
        """Bound what the law asks for beside the linear terms, and the moments that are there."""
        gains, given, flat = self._model.airframe.gains, self._fed.strayed, self._bounds.lateral
        self.law = gains.attitude[0] * (self._off + self.most * self._bent * self.tilt)
        self.law = self.law + self.most * (gains.rate[0] * self._tilting + self._turned)
        rates, turns = (
            np.hypot(*(given(lambda fed, k=k, of=of: getattr(fed, of)[k]) for k in (0, 1))) for of in ("rates", "rates_change")
        )
        self.given = gains.attitude[0] * self.strayed + self.most * (gains.rate[0] * (rates + TICK * turns) + turns)
        askew = self.twist - self._bounds.heading["f"] + self._bent * self.twist
        self.law_spin = gains.attitude[1] * askew + gains.rate[1] * self._spinning + self._spun
        self.moved = (flat["moved"] + TICK * self.slide * self.turns[0] + ROUNDING) / self.least

    def _turning(self) -> None:
        """Bound what moves the attitude, and carries moments, beside the linear terms.

        By the rates w of the body and v of the plan's attitude, q' = cos(|q| / 2) (w - v) + q x v + q x (w - v) / 2.
        """
        f, spin, share = self._bounds.heading["f"], self._bounds.heading["o"], self._cell.choice.thrust
        turned = self._straight * self.slip + f * (self.rates[0] + 0.5 * self.slip) + self.swayed * (self.rates[1] + 0.5 * spin)
        self.turned = self.most * turned + self.slide * self.swayed
        self.twisting = self._straight * spin + self.swayed * (self.rates[0] + 0.5 * self.slip)
        self.carried = H * self.slide * self._bounds.lateral["mu"] / self.least
        jumped, steps = self._jumped[0] / share, self._stepped
        self.broken = jumped * self.swayed, jumped * self.slip, jumped * self.moved
        first = self._model.force()[0][0]
        lean = float(np.linalg.norm(first[:2]) / first[2])
        about = shifted(self._drift + self._about, lean * lean)
        steps = shifted(steps, lean)
        swayed, twist = np.maximum(self.swayed + steps, shifted(self.swayed)), np.maximum(f + about, shifted(f))
        straight = (swayed**2 + twist**2) / 7.0
        even = (steps**2 + about**2) / 7.0
        self.jumped = (
            self.most * self._fifth + ROUNDING,
            self.most * (even * swayed + straight * steps + 0.5 * (steps * twist + about * swayed)),
        )
        self.restarted = self._fifth + even * twist + straight * about + 0.5 * steps * swayed

    def _parted(self, of: str) -> tuple[Floats, Floats]:
        """Bound how far rates, or their change, are from the plan's: about x and y together, and about z."""
        x, y, z = (self._moved(lambda fed, k=k: getattr(fed, of)[k]) for k in range(3))
        return np.hypot(x, y), z

    def _moved(self, of: Callable[[FedForward], Jet]) -> Floats:
        return self._fed.moved(of, self._bounds)


def lateral_of(turns: tuple[Jet, Jet, Jet], length: Jet) -> tuple[Jet, Jet]:
    """Return body rates, or their change, as they turn the thrust's axis in body axes, times the force's length."""
    return length * turns[1], -(length * turns[0])


def uneven(lean: Floats) -> Floats:
    """Bound the distance of an attitude's horizontal part, at heading 0, from that of none: 0.612 tan^2 of its tilt.

    With z its axis and l^2 = 1 - z_y^2, the part is (z_z / l, -z_x z_y / l; 0, l): less 1 at most z_x^2 / 2, |z_x z_y| and z_y^2 / 2, each over z_z^2.
    """
    return 0.6124 * lean**2 / (1.0 - lean**2)
