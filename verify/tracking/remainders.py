"""Inputs that drive the loops of the tracking error: each remainder of the vehicle's motion, bounded from bounds on all states.

The vehicle's motion is exactly that of the linear loops with inputs; `inputs_of` bounds these, command by command, from the disturbances, the plan and
bounds on the states (docs/tracking.md has the equations). All bounds are sums, products and quotients of numbers that are not negative;
`GROW` in the proof covers their rounding.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from verify.arithmetic.balls import Floats
from verify.data.vehicle import GRAVITY
from verify.tracking.circumstances import Circumstances
from verify.tracking.error_model import (
    NEAR,
    ROUNDING,
    Bounds,
    Cell,
    ErrorModel,
    Fed,
    H,
    Inputs,
    NotProved,
    shifted,
)
from verify.tracking.loops import lag_share, roll_drag_of
from verify.tracking.sampled_loop import TICK
from verify.tracking.tilts import Attitudes


def inputs_of(model: ErrorModel, cell: Cell, bounds: Bounds, fed: Fed) -> Inputs:
    """Bound every input of the three loops.

    Args:
        model: The robot.
        cell: Thrusts and torques that are meant.
        bounds: Of all states, between steps too.
        fed: What is fed forward.

    Raises:
        NotProved: A rotor may saturate, or a limit of the controller may act.
    """
    found = _Remainders(model, cell, bounds, Attitudes.of(model, bounds, fed, cell.choice.thrust), fed)
    return {**found.lateral(), **found.vertical(), **found.heading()}


class _Remainders(Circumstances):
    """The inputs of the three loops."""

    def _seen(self, loop: str, pace: Floats, change: Floats) -> Inputs:
        """Bound the errors of what the controller is given: place and speed."""
        told, choice = self.model.disturbance, self.cell.choice
        middle = H * choice.late
        apart = max(told.latency[1] - middle, middle - told.latency[0], 0.0) * (1.0 + 1e-12)
        here = np.ones(len(pace))
        given, axis = self.model.given, 0 if loop == "lateral" else 1
        first = self._at_first(self.model.plan.jumps[0, 1])  # cameras see a hover where the path may begin at some speed
        return {
            **self._begun(loop),
            (loop, "place", "set-points"): given.place[:, axis],
            (loop, "speed", "set-points"): given.speed[:, axis],
            (loop, "given", "set-points"): given.force[:, axis],
            (loop, "place", "position"): told.position * here,
            (loop, "speed", "velocity"): told.velocity * here,
            (loop, "speed", "plan"): first,
            (loop, "place", "latency"): apart * np.maximum(pace, shifted(pace)) + 1e-9,
            (loop, "speed", "latency"): apart * np.maximum(change, shifted(change)) + 1e-9,
            (loop, "clip", "sum's clip"): self._clipped(self.bounds.lateral if loop == "lateral" else self.bounds.vertical),
        }

    def _at_first(self, value: float) -> Floats:
        return np.where(np.arange(len(self.model.plan)) == 0, value, 0.0)

    def _begun(self, loop: str) -> Inputs:
        """Bound how the place, the speed and the sum begin. What cameras saw before is of the same speed, and as old as it may be."""
        told, rest = self.model.disturbance, self.model.rest
        sizes = {"begin": told.start + self.model.offset, "moving": rest.speed, "summed": rest.summed}
        sizes |= {"place": told.latency[1] * rest.speed, "speed": rest.speed}
        return {(loop, name, "start"): self._at_first(size) for name, size in sizes.items()}

    def _clipped(self, bounds: Mapping[str, Floats]) -> Floats:
        """Bound what the clip takes from the sum's share of an error."""
        off, kept = bounds["off"], self.cell.choice.summed
        limit = self.model.airframe.gains.integral_limit
        if not np.all(bounds["I"] < 0.999 * limit):
            raise NotProved("the summed error may reach its limit")
        inside = (1.0 - kept) * off
        beyond = np.maximum(inside, kept * off - NEAR) * math.sqrt(2.0)
        return np.where((off <= NEAR) | ((2.0 * kept - 1.0) * off <= NEAR), inside, beyond)

    def _joined(self, loop: str, acceleration: Floats, drag: float) -> Inputs:
        """Bound what the path's joints jump by, and how far inputs of a step differ from their mean."""
        plan = self.model.plan
        return {
            (loop, "xi!", "plan"): plan.jumps[:, 0] + H * plan.jumps[:, 1],
            (loop, "nu!", "plan"): plan.jumps[:, 1],
            (loop, "xi!", "within steps"): 0.5 * H**2 * acceleration,
            (loop, "nu!", "within steps"): 0.5 * H**2 * drag * acceleration,
        }

    def lateral(self) -> Inputs:
        """Bound the inputs of the lateral loop."""
        model, cell, told, tilts = self.model, self.cell, self.model.disturbance, self.tilts
        flat, gains, most, strong = self.bounds.lateral, self.model.airframe.gains, self.cell.thrust[1], self.tilts.most
        force, jerk = model.reach(0)[0], model.reach(1)[0]
        thrust = cell.choice.thrust * self.bounds.vertical["b"] + (cell.spread[0] + self.sag) * (
            self.held.most + self.bounds.vertical["b"]
        )
        coupled = thrust * tilts.lean + cell.choice.thrust * tilts.pushed
        sampled = abs(cell.choice.thrust - 1.0) * (0.5 * TICK * jerk + self.model.plan.jumps[:, 2]) + ROUNDING
        roll, slid = roll_drag_of(model.vehicle, model.airframe), TICK * tilts.slide
        felt, unswung = self.unswung
        rolled = roll * (0.5 * TICK * strong * tilts.turns[0] + slid * tilts.rates[0])
        here = np.ones(len(force))
        n: Inputs = {
            ("lateral", "acc", "wind"): self.wind[0] * here,
            ("lateral", "acc", "air"): self.dragged,
            ("lateral", "acc", "mass and thrust"): sampled,
            ("lateral", "acc", "coupling"): coupled,
            ("lateral", "pullj", "coupling"): tilts.pulled,
            ("lateral", "u", "gyroscope"): gains.rate[0] * strong * told.gyroscope,
            ("lateral", "u", "attitude"): gains.attitude[0] * strong * told.attitude,
            ("lateral", "u", "plan"): gains.attitude[0] * strong * self.stale,
            ("lateral", "u", "set-points"): tilts.given,
            ("lateral", "u", "coupling"): np.maximum(tilts.law - tilts.given, 0.0) + strong * (felt + self.bent),
            ("lateral", "spun", "coupling"): strong * self.swung,
            ("lateral", "drate", "coupling"): tilts.turned,
            ("lateral", "eacc", "mass and thrust"): cell.spread[1] * strong * tilts.moved,
            ("lateral", "eacc", "coupling"): strong * (unswung + self.hub_turn)
            + tilts.slide * tilts.slip
            + rolled
            + abs(cell.choice.torque - 1.0) * slid * tilts.turns[0]
            + cell.torque[1] * tilts.carried,
            ("lateral", "eacc", "moment"): strong * self.moment[0],
            ("lateral", "mu!", "coupling"): tilts.carried + tilts.broken[2],
            ("lateral", "d!", "plan"): tilts.broken[0],
            ("lateral", "e!", "plan"): tilts.broken[1],
            ("lateral", "dj", "plan"): tilts.jumped[0],
            ("lateral", "dj", "coupling"): tilts.jumped[1],
            ("lateral", "dj", "set-points"): model.given.heading
            * (flat["grown"] + shifted(TICK * jerk + model.stepped(0)[:, 0])),
        }
        n |= {("lateral", name, "plan"): ROUNDING * here for name in ("ej", "muj")}
        n |= self._tilted()
        acceleration, torque = (total_of(n, "lateral", name) for name in ("acc", "eacc"))
        lag = lag_share(model.airframe)
        n |= self._joined("lateral", acceleration, model.drags[0])
        n["lateral", "e!", "within steps"] = strong * self.bent * cell.torque[1] * lag**2 * H * 1.01
        n["lateral", "d!", "within steps"] = 0.5 * H**2 * torque + n["lateral", "e!", "within steps"] * H
        moved = tilts.turned + H * torque
        n["lateral", "nu!", "within steps"] = n["lateral", "nu!", "within steps"] + most * 0.5 * H**2 * moved
        n["lateral", "xi!", "within steps"] = n["lateral", "xi!", "within steps"] + most * H**3 * moved
        pace = model.plan.across[:, 1] + flat["nu"]
        change = self.model.plan.across[:, 2] + self.accelerations[0]
        return n | self._seen("lateral", pace, change)

    def _tilted(self) -> Inputs:
        """Bound how tilt, rates and moments begin, beside those of a hover."""
        rest, tilts = self.model.rest, self.tilts
        sizes = {
            "dj": tilts.most[0] * rest.tilt,
            "ej": tilts.most[0] * rest.turn,
            "muj": tilts.most[0] * self.model.unbalanced[0],
        }
        return {("lateral", name, "start"): self._at_first(float(size)) for name, size in sizes.items()}

    @property
    def accelerations(self) -> tuple[Floats, Floats]:
        """Bounds of the error's acceleration, across and along, m/s^2."""
        return self.bounds.lateral["change"], self.bounds.vertical["change"]

    def vertical(self) -> Inputs:
        """Bound the inputs of the vertical loop."""
        model, cell, most = self.model, self.cell, self.cell.thrust[1]
        bounds, here = self.bounds.vertical, np.ones(len(self.model.plan))
        off_thrust, _ = cell.spread
        force, jerk = GRAVITY + model.reach(0)[1], model.reach(1)[1]
        sampled = max(abs(end - 1.0) for end in cell.thrust) * (0.5 * TICK * jerk + self.model.plan.jumps[:, 2]) + ROUNDING
        lean, step, strayed = self.lean_between, self.force_step, self.all.strayed(lambda fed: fed.rate)
        lag = lag_share(model.airframe)
        n: Inputs = {
            ("vertical", "acc", "wind"): self.wind[1] * here,
            ("vertical", "acc", "air"): self.dragged_up,
            ("vertical", "acc", "mass and thrust"): off_thrust * bounds["pushed"] + self.sag * force + sampled,
            ("vertical", "acc", "plan"): most * self.missed_up,
            ("vertical", "acc", "coupling"): most * self.coupled_up,
            ("vertical", "u", "coupling"): self.low_thrust + self.bent_thrust,
            ("vertical", "rate", "set-points"): strayed,
            ("vertical", "rate", "coupling"): self.all.moved(lambda fed: fed.rate, self.bounds) - strayed,
            ("vertical", "bj", "start"): self._at_first(model.rest.rotors * GRAVITY),
            ("vertical", "bj", "plan"): self.end,
            ("vertical", "bj", "coupling"): lean * step[0] + (1.0 - self.upright_between) * step[1],
        }
        n |= self._joined("vertical", total_of(n, "vertical", "acc"), model.drags[1])
        n["vertical", "nu!", "within steps"] = (
            n["vertical", "nu!", "within steps"] + most * self.bent_thrust * lag**2 * H * 1.01
        )
        pace = model.plan.along[:, 1] + bounds["nu"]
        change = model.plan.along[:, 2] + self.accelerations[1]
        return n | self._seen("vertical", pace, change)

    def heading(self) -> Inputs:
        """Bound the inputs of the loop of the heading."""
        model, cell, told, tilts = self.model, self.cell, self.model.disturbance, self.tilts
        gains, here, rest = model.airframe.gains, np.ones(len(model.plan)), model.rest
        _, off_torque = cell.spread
        torque = off_torque * self.bounds.heading["mu"] + (abs(cell.choice.torque - 1.0) + off_torque) * tilts.turns[1]
        n: Inputs = {
            ("heading", "u", "gyroscope"): gains.rate[1] * told.gyroscope * here,
            ("heading", "u", "attitude"): gains.attitude[1] * told.attitude * here,
            ("heading", "u", "coupling"): gains.attitude[1] * self.stale + tilts.law_spin + self.countered[1] + self.bent_spin,
            ("heading", "oacc", "coupling"): torque + self.gyration[1] + self.hub_spin + self.reaction,
            ("heading", "oacc", "moment"): self.moment[1] * here,
            ("heading", "frate", "coupling"): tilts.twisting,
            ("heading", "fj", "coupling"): tilts.restarted,
            ("heading", "fj", "start"): self._at_first(1.1 * rest.heading + 0.3 * rest.tilt**2 + model.given.heading),
            ("heading", "oj", "start"): self._at_first(rest.turn),
            ("heading", "muj", "start"): self._at_first(model.unbalanced[1]),
            ("heading", "oj", "plan"): ROUNDING * here,
            ("heading", "muj", "plan"): ROUNDING * here,
        }
        bent = self.bent_spin * cell.torque[1] * lag_share(model.airframe) ** 2 * H * 1.01
        n["heading", "f!", "within steps"] = 0.5 * H**2 * total_of(n, "heading", "oacc") + H * bent
        n["heading", "o!", "within steps"] = bent
        return n


def total_of(inputs: Inputs, loop: str, name: str) -> Floats:
    """Return the sum of all causes of an input.

    Args:
        inputs: Of all loops.
        loop: One of them.
        name: Of its input.
    """
    return sum((bound for (one, other, _), bound in inputs.items() if (one, other) == (loop, name)), start=np.zeros(1))
