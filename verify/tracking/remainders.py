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
from verify.arithmetic.intervals import Interval
from verify.data.vehicle import GRAVITY
from verify.tracking.circumstances import Attitudes, Circumstances
from verify.tracking.error_model import (
    NEAR,
    ROUNDING,
    Before,
    Bounds,
    Cell,
    ErrorModel,
    Fed,
    H,
    Inputs,
    NotProved,
    along_slopes,
    shifted,
    size_of,
)
from verify.tracking.loops import lag_share, roll_drag_of
from verify.tracking.sampled_loop import TICK


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
    found = _Remainders(model, cell, bounds, Attitudes.of(model, bounds, fed), fed)
    return {**found.lateral(), **found.vertical(), **found.heading()}


class _Remainders(Circumstances):
    """The inputs of the three loops."""

    def _seen(self, loop: str, pace: Floats, change: Floats) -> Inputs:
        """Bound the errors of what the controller is given: place and speed."""
        told, choice = self.model.disturbance, self.cell.choice
        middle = H * choice.late
        apart = max(told.latency[1] - middle, middle - told.latency[0], 0.0) * (1.0 + 1e-12)
        here = np.ones(len(pace))
        begun = np.zeros(len(pace))
        begun[0] = told.start + self.model.offset
        first = np.zeros(len(pace))
        first[0] = self.model.plan.jumps[0, 1]  # cameras see a hover where the path may begin at some speed
        return {
            (loop, "place", "position"): told.position * here,
            (loop, "speed", "velocity"): told.velocity * here,
            (loop, "speed", "plan"): first,
            (loop, "place", "latency"): apart * np.maximum(pace, shifted(pace)) + 1e-9,
            (loop, "speed", "latency"): apart * np.maximum(change, shifted(change)) + 1e-9,
            (loop, "begin", "start"): begun,
            (loop, "clip", "sum's clip"): self._clipped(self.bounds.lateral if loop == "lateral" else self.bounds.vertical),
        }

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
        model, cell, held, told, strong = self.model, self.cell, self.held, self.model.disturbance, self.strong
        flat, gains, most = self.bounds.lateral, self.model.airframe.gains, self.cell.thrust[1]
        off_thrust, off_torque = cell.spread
        force, jerk = model.reach(0)[0], model.reach(1)[0]
        coupled = (
            self.bounds.vertical["b"] * self.leaning
            + TICK * held.slope * self.tip
            + held.most * (self.short + self.skew) * self.tip
        )
        coupled = coupled + 0.5 * held.most * (self.tip * self.twist + held.lean * self.tip**2)
        sampled = max(abs(end - 1.0) for end in cell.thrust) * (0.5 * TICK * jerk + self.model.plan.jumps[:, 2]) + ROUNDING
        off, torque = self.unscaled, abs(cell.choice.torque - 1.0)
        n: Inputs = {
            ("lateral", "acc", "wind"): self.wind[0] * np.ones(len(force)),
            ("lateral", "acc", "air"): self.dragged,
            ("lateral", "acc", "mass and thrust"): off_thrust * flat["pushed"] + self.sag * force + sampled,
            ("lateral", "acc", "plan"): most * self.missed,
            ("lateral", "acc", "coupling"): most * coupled,
            ("lateral", "u", "gyroscope"): gains.rate[0] * strong * told.gyroscope,
            ("lateral", "u", "attitude"): gains.attitude[0] * strong * told.attitude,
            ("lateral", "u", "plan"): gains.attitude[0] * strong * self.stale,
            ("lateral", "u", "coupling"): strong * (self.countered[0] + self.bent),
            ("lateral", "eacc", "mass and thrust"): off_torque * (flat["mu"] + strong * held.turning)
            + torque * (strong * self.changed_turning + off * held.turning),
            ("lateral", "eacc", "coupling"): strong * (self.gyration[0] + self.hub_turn)
            + roll_drag_of(model.vehicle, model.airframe) * off * held.rates,
            ("lateral", "eacc", "moment"): strong * told.moment / min(model.vehicle.inertia[:2]),
            ("lateral", "drate", "coupling"): strong * self.turned,
            ("lateral", "dj", "coupling"): self.jumped,
            ("lateral", "ej", "coupling"): strong * self.changed_rates[0]
            + off * self.known_jumps[0]
            + self.rescaled * shifted(flat["e"]),
            ("lateral", "muj", "coupling"): strong * self.changed_turn[0]
            + off * self.known_jumps[1]
            + self.rescaled * shifted(flat["mu"]),
        }
        acceleration, torque, rate = (total_of(n, "lateral", name) for name in ("acc", "eacc", "drate"))
        lag = lag_share(model.airframe)
        n |= self._joined("lateral", acceleration, model.drags[0])
        n["lateral", "d!", "within steps"] = 0.5 * H**2 * torque
        n["lateral", "nu!", "within steps"] = n["lateral", "nu!", "within steps"] + most * (
            0.5 * H**3 * torque + 0.5 * H**2 * rate
        )
        n["lateral", "xi!", "within steps"] = n["lateral", "xi!", "within steps"] + most * H**3 * (H * torque + rate)
        n["lateral", "e!", "within steps"] = strong * self.bent * cell.torque[1] * lag**2 * H * 1.01
        n["lateral", "d!", "within steps"] = n["lateral", "d!", "within steps"] + n["lateral", "e!", "within steps"] * H
        pace = model.plan.across[:, 1] + flat["nu"]
        change = self.model.plan.across[:, 2] + self.accelerations[0]
        return n | self._seen("lateral", pace, change)

    @property
    def turned(self) -> Floats:
        """Rate of the attitude's error beside that of the rates' error, about x and y, rad/s."""
        held = self.held
        first = self.short * self.slip + self.twist * held.rates + self.tip * held.spin
        return first + 0.5 * (self.tip * self.swing + self.twist * self.slip)

    @property
    def jumped(self) -> Floats:
        """Jump of the direction's error at a command beside that of the feedback, times g."""
        side, up = self.force_step
        turned = self.skew_between * side + self.lean_between * up
        first = turned + self.end + self.grown_length / shifted(self.held.least, GRAVITY) * (side + turned)
        tip, twist, short = self.tip_before, self.twist_before, self.short_before
        composed = self.turn_short * (tip + self.turn) + short * self.turn
        composed = composed + 0.5 * (self.turn_spin * (tip + self.turn) + self.turn * twist)
        return first + self.strong * composed + (self.grown_length + TICK * shifted(self.held.slope)) * tip

    @property
    def grown_length(self) -> Floats:
        """Bound of what a command adds to the length of the force, m/s^2."""
        side, up = self.force_step
        return up + self.lean_between * side + 2.0 * np.hypot(side, up) * self.turn

    @property
    def rescaled(self) -> Floats:
        """Share by which the scale of the lateral loop's states changes at a command."""
        return (self.grown_length + TICK * shifted(self.held.slope)) / shifted(self.weak, GRAVITY)

    @property
    def unscaled(self) -> Floats:
        """Greatest distance of that scale from the one without feedback, m/s^2."""
        alone = np.linalg.norm(self.model.force()[0], axis=1)
        return np.maximum(self.strong - alone, alone - self.weak) + ROUNDING

    @property
    def known_jumps(self) -> tuple[Floats, Floats]:
        """Bounds of the jumps of rates and their change that are fed forward without feedback, about x and y."""
        alone, before = self.all.alone, Before()
        rates = [
            size_of(now.value - before(now.value) - before(turn.value).times(TICK))
            for now, turn in zip(alone.rates[:2], alone.rates_change[:2], strict=True)
        ]
        turns = [size_of(now.value - before(now.value)) for now in alone.rates_change[:2]]
        return np.hypot(*rates) + ROUNDING, np.hypot(*turns) + ROUNDING

    @property
    def changed_rates(self) -> tuple[Floats, Floats]:
        """Jump of the rates that are fed forward beside the one without feedback: about x and y together, about z. rad/s."""
        before, half = Before(), 0.5 * TICK * TICK
        thirds = [tuple(before(part).times(half) for part in jet.slope) for jet in self.all.third]
        side, spin = self._changes([(jet.slope, third) for jet, third in zip(self.fed.rates, thirds, strict=True)])
        fed = np.hypot(self.bounds.lateral["p"], self.bounds.vertical["p"]) / self.weak**2
        joints = 6.0 * shifted((self.model.stepped(1) + TICK * self.model.stepped(2))[:, 0] * fed)
        return side + joints, spin + joints

    @property
    def changed_turn(self) -> tuple[Floats, Floats]:
        """Jump of the angular acceleration that is fed forward beside the one without feedback. rad/s^2."""
        before = Before()
        return self._changes([(jet.slope, tuple(now - before(now) for now in jet.slope)) for jet in self.fed.rates_change])

    def _changes(self, jets: list[tuple[tuple[Interval, ...], tuple[Interval, ...]]]) -> tuple[Floats, Floats]:
        grown = self.bounds.lateral["grown"], self.bounds.vertical["grown"]
        held = shifted(self.bounds.lateral["p"]), shifted(self.bounds.vertical["p"])
        x, y, z = (along_slopes(now, *grown) + along_slopes(drifted, *held) + ROUNDING for now, drifted in jets)
        return np.hypot(x, y), z

    @property
    def accelerations(self) -> tuple[Floats, Floats]:
        """Bounds of the error's acceleration, across and along, m/s^2."""
        return self.bounds.lateral["change"], self.bounds.vertical["change"]

    def vertical(self) -> Inputs:
        """Bound the inputs of the vertical loop."""
        model, cell, held, most = self.model, self.cell, self.held, self.cell.thrust[1]
        bounds, here = self.bounds.vertical, np.ones(len(self.model.plan))
        off_thrust, _ = cell.spread
        force, jerk = GRAVITY + model.reach(0)[1], model.reach(1)[1]
        slanted = 1.0 - np.sqrt(1.0 - self.leaning**2)
        coupled = bounds["b"] * slanted + held.most * (held.lean * (self.tip + 0.5 * self.tip * self.twist) + 0.5 * self.tip**2)
        sampled = max(abs(end - 1.0) for end in cell.thrust) * (0.5 * TICK * jerk + self.model.plan.jumps[:, 2]) + ROUNDING
        lean, step = self.lean_between, self.force_step
        lag = lag_share(model.airframe)
        n: Inputs = {
            ("vertical", "acc", "wind"): self.wind[1] * here,
            ("vertical", "acc", "air"): self.dragged_up,
            ("vertical", "acc", "mass and thrust"): off_thrust * bounds["pushed"] + self.sag * force + sampled,
            ("vertical", "acc", "plan"): most * self.missed_up,
            ("vertical", "acc", "coupling"): most * coupled,
            ("vertical", "u", "coupling"): self.low_thrust + self.bent_thrust,
            ("vertical", "rate", "coupling"): self._moved(self.fed.rate.slope),
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
        model, cell, held, told = self.model, self.cell, self.held, self.model.disturbance
        gains, here = model.airframe.gains, np.ones(len(model.plan))
        _, off_torque = cell.spread
        before = Before()
        alone = self.all.alone
        rates, turns = alone.rates[2].value, alone.rates_change[2].value
        jump = size_of(rates - before(rates) - before(turns).times(TICK)) + self.changed_rates[1]
        turn = size_of(turns - before(turns)) + self.changed_turn[1]
        tip, twist, short = self.tip_before, self.twist_before, self.short_before
        composed = self.turn_short * twist + short * self.turn_spin + 0.5 * self.turn * tip
        torque = off_torque * self.bounds.heading["mu"] + (abs(cell.choice.torque - 1.0) + off_torque) * held.spinning
        n: Inputs = {
            ("heading", "u", "gyroscope"): gains.rate[1] * told.gyroscope * here,
            ("heading", "u", "attitude"): gains.attitude[1] * told.attitude * here,
            ("heading", "u", "coupling"): gains.attitude[1] * self.stale + self.countered[1] + self.bent_spin,
            ("heading", "oacc", "coupling"): torque + self.gyration[1] + self.hub_spin + self.reaction,
            ("heading", "oacc", "moment"): told.moment / model.vehicle.inertia[2] * here,
            ("heading", "frate", "coupling"): self.short * self.swing + self.tip * held.rates + 0.5 * self.tip * self.slip,
            ("heading", "fj", "coupling"): self.turn_spin + composed,
            ("heading", "oj", "coupling"): jump + ROUNDING,
            ("heading", "muj", "coupling"): turn + ROUNDING,
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
