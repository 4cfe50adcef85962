"""The proof that a flight stays near its plan: bounds on all states that the loops, driven by what these bounds allow, stay strictly within.

At a supposed first exit all remainders are within what the bounds allow until then; the loops' kernels bound what they make of it. If that is strictly
less than the bounds, nothing leaves them. The thrust, of which only an interval is known, is cut into cells, each with loops of its own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from verify.arithmetic.balls import Floats
from verify.data.airframe import AirframeTable
from verify.data.disturbance import Disturbance
from verify.data.trajectory import Trajectory
from verify.data.vehicle import Vehicle
from verify.tracking.error_model import NEAR, Bounds, Cell, ErrorModel, Inputs, NotProved, fed_of, feeds_alone
from verify.tracking.flatness import FedForward, Jet
from verify.tracking.given import behind, delay_of
from verify.tracking.loops import LoopChoice, heading_loop, lag_share, lateral_loop, reaction_of, roll_drag_of, vertical_loop
from verify.tracking.nominal import Combined, known_response, turned_at_commands
from verify.tracking.plan_samples import fixed_heading, sample_plan
from verify.tracking.remainders import inputs_of
from verify.tracking.sampled_loop import REMEMBERED, TICK, Kernels, TickMaps, kernels_of
from verify.tracking.tilts import lateral_of

_H = 0.002
_ROUNDS = 60
_CELL = 0.02
"""Width of a cell of thrusts."""
_QUICKEST = 0.5
"""Share of what is asked of a rotor that is there after a step, at most."""
_LARGEST = 0.5
"""m; a bound above is no bound."""


@dataclass(frozen=True, eq=False, slots=True)
class TrackingBound:
    """Bound that is proved of one robot.

    Attributes:
        bound: Largest distance from the plan at any time, m, rounded up.
        time: s, where it is tight: between that command and the next.
        course: The bound between commands, m. Shape (ticks,).
        costs: m of the bound that each cause makes, there.
    """

    bound: float
    time: float
    course: Floats
    costs: Mapping[str, float]


def prove(model: ErrorModel) -> TrackingBound:
    """Bound a robot's distance from its plan, for all times of its flight and all its disturbances.

    Args:
        model: The robot.

    Raises:
        NotProved: No bounds were found that are kept; the message says what stands in the way.
    """
    found = [_prove_cell(model, cell) for cell in cells_of(model)]
    course = np.max([one.course for one in found], axis=0)
    worst = max(found, key=lambda one: one.bound)
    return TrackingBound(worst.bound, worst.time, course, worst.costs)


def model_of(
    path: Trajectory, duration: float, start: tuple[float, float, float], vehicle: Vehicle, disturbance: Disturbance
) -> ErrorModel:
    """Return the model of one robot.

    Args:
        path: Its finite flight.
        duration: Of the team's flight, s.
        start: m, from where it is to begin.
        vehicle: What flies.
        disturbance: What may disturb it.

    Raises:
        NotProved: Its heading turns, or its rotors are quickened too much.
    """
    if not lag_share(disturbance.airframe) < _QUICKEST:
        raise NotProved("the lead leaves the rotors no lag that a step on board could follow")
    heading = fixed_heading(path)
    if heading is None:
        raise NotProved("there is no proof for a heading that turns")
    delay = delay_of(disturbance.setpoints)
    plan = sample_plan(path, duration + delay, heading, _H * steps_late(disturbance), delay)
    offset = float(np.linalg.norm(path.coefficients[0, :3, 0] - np.array(start))) * (1.0 + 1e-12)
    return ErrorModel(vehicle, disturbance.airframe, disturbance, plan, offset)


def steps_late(disturbance: Disturbance) -> int:
    """Return the steps on board by which what is seen is late in the middle."""
    return round(0.5 * sum(disturbance.latency) / _H)


def cells_of(model: ErrorModel) -> list[Cell]:
    """Return cells of thrusts, which overlap so that a thrust that sags as it may stays in one."""
    told = model.disturbance
    least, most = (1.0 - told.thrust) / (1.0 + told.mass), (1.0 + told.thrust) / (1.0 - told.mass)
    overlap = told.sag * most
    width = max(_CELL, 3.0 * overlap)
    count = max(1, math.ceil((most - least - overlap) / (width - overlap)))
    width = (most - least + (count - 1) * overlap) / count
    cells: list[Cell] = []
    for k in range(count):
        low = least + k * (width - overlap) - 1e-12
        high = low + width + 2e-12
        torque = (
            max(1.0 - told.thrust, low * (1.0 - told.mass)) / (1.0 + told.inertia) - 1e-12,
            min(1.0 + told.thrust, high * (1.0 + told.mass)) / (1.0 - told.inertia) + 1e-12,
        )
        choice = LoopChoice(0.5 * (low + high), 0.5 * sum(torque), steps_late(told), 1.0)
        cells.append(Cell((low, high), torque, choice))
    return cells


def _prove_cell(model: ErrorModel, cell: Cell) -> TrackingBound:
    """Prove one cell; where errors are summed that are clipped, the loop takes the share that fits them."""
    loops = _Loops(model, cell)
    bounds, inputs = loops.kept()
    for _ in range(3):
        off = max(float(bounds.lateral["off"].max()), float(bounds.vertical["off"].max()))
        share = min(1.0, 2.0 * NEAR / (1.05 * off + NEAR))
        choice = cell.choice
        if share > choice.summed - 0.01:
            break
        cell = Cell(cell.thrust, cell.torque, LoopChoice(choice.thrust, choice.torque, choice.late, share))
        loops = _Loops(model, cell)
        bounds, inputs = loops.kept()
    return loops.bound(bounds, inputs)


@lru_cache(maxsize=32)
def loops_of(
    vehicle: Vehicle, airframe: AirframeTable, choice: LoopChoice, ticks: int
) -> tuple[dict[str, TickMaps], dict[str, Kernels]]:
    """Return maps and kernels of the three loops, which are the same for all robots of a team.

    Args:
        vehicle: What flies.
        airframe: Its lag, drag and gains.
        choice: What the loops are linear for.
        ticks: Commands of the flight; all numbers above `REMEMBERED` give the same.

    Raises:
        NotProved: They are not shown to settle.
    """
    made = {"lateral": lateral_loop, "vertical": vertical_loop, "heading": heading_loop}
    loops = {name: make(vehicle, airframe, choice) for name, make in made.items()}
    try:
        return {name: TickMaps(loop) for name, loop in loops.items()}, {
            name: kernels_of(loop, ticks) for name, loop in loops.items()
        }
    except ArithmeticError:
        raise NotProved("the controller's gains are not shown to stabilise the vehicle") from None


class _Loops:
    """The three loops of a cell, with their kernels and what is known of their inputs."""

    def __init__(self, model: ErrorModel, cell: Cell) -> None:
        self._model, self._cell, ticks = model, cell, len(model.plan)
        known_as = model.vehicle, model.airframe, cell.choice, min(ticks, REMEMBERED + 1)
        maps, self._kernels = loops_of(*known_as)  # pyright: ignore[reportArgumentType]  # frozen models are hashable
        self._force, self._jerk, self._snap = model.force()
        share = cell.choice.thrust
        self._alone = exact, _ = feeds_alone(model, share)
        moments = _sideways(exact.rates_change, exact.length)
        forcing = self._forcing(exact)
        self._known = {
            name: known_response(maps[name], name, known, self._further(known, moments)) for name, known in forcing.items()
        }
        off, _ = cell.spread
        thrust = {"acc": self._model.force("middle")[0][:, 2:]}
        constant = {name: thrust.get(name, 0.0 * known) for name, known in forcing["vertical"].items()}
        moved = known_response(maps["vertical"], "vertical", constant, self._further(constant, moments, 0.0))
        for output, known in moved.items():  # a thrust that is off, but constant
            self._known["vertical"][output] = self._known["vertical"][output] + off * known
        self._turned = np.linalg.norm(forcing["lateral"]["eacc"], axis=1)
        self._sloped = np.maximum(np.abs(exact.rate.value.low), np.abs(exact.rate.value.high))

    def _forcing(self, exact: FedForward) -> dict[str, dict[str, Floats]]:
        """Return the known inputs of the three loops."""
        plan, choice, model, moments = (
            self._model.plan,
            self._cell.choice,
            self._model,
            _sideways(exact.rates_change, exact.length),
        )
        middle = model.force("middle")[0]
        rates, scale = _sideways(exact.rates, exact.length), exact.length.middle[:, None]
        turned, (spin, spins) = (
            turned_at_commands(exact),
            (each[2].middle[:, None] for each in (exact.rates, exact.rates_change)),
        )
        turns = [np.stack([each[1].middle, -each[0].middle], axis=1) for each in (exact.rates, exact.rates_change)]

        def before(values: Floats) -> Floats:
            return np.concatenate([0.0 * values[:1], values[:-1]])

        lateral = {
            "acc": (choice.thrust - 1.0) * middle[:, :2],
            "eacc": (choice.torque - 1.0) * moments
            - roll_drag_of(model.vehicle, model.airframe) * (rates + 0.5 * TICK * moments),
            "place": plan.seen[:, 0, :2],
            "speed": plan.seen[:, 1, :2],
            "dj": scale * np.stack([turned[:, 1], -turned[:, 0]], axis=1)
            + (1.0 / choice.thrust - 1.0) * np.diff(self._force[:, :2], axis=0, prepend=0.0),
            "ej": -scale * (turns[0] - before(turns[0] + TICK * turns[1])),
            "muj": -scale * (turns[1] - before(turns[1])),
        }
        vertical = {
            "acc": (choice.thrust - 1.0) * middle[:, 2:],
            "rate": exact.rate.middle[:, None],
            "place": plan.seen[:, 0, 2:],
            "speed": plan.seen[:, 1, 2:],
        }
        heading = {
            "fj": turned[:, 2:],
            "oj": before(spin + TICK * spins) - spin,
            "muj": before(spins) - spins,
        }
        return {"lateral": lateral, "vertical": vertical, "heading": heading}

    def _further(self, known: Mapping[str, Floats], moments: Floats, aimed: float = 1.0) -> Combined:
        """Return outputs beside the loops': what thrust pushes beside the plan, and feedback and tilt beside what they tend to."""
        if "acc" not in known:
            return {}
        share, axes = self._cell.choice.thrust, known["acc"].shape[1]
        part = slice(0, 2) if axes == 2 else slice(2, 3)
        tends = -aimed * (1.0 / share - 1.0)
        middle = self._model.force("middle")[0]
        further = {
            "push": ("hauled" if axes == 2 else "pushed", share, known["acc"]),
            "aim": ("p", 1.0, tends * self._force[:, part]),
        }
        if axes == 2:
            further |= {"tilted": ("pushed", 1.0, tends * middle[:, part])}
            further |= {name: (of, 1.0, moments) for name, of in (("moved", "mu"), ("steering", "steered"), ("leading", "led"))}
        return further

    def kept(self) -> tuple[Bounds, Inputs]:
        """Return bounds that are kept strictly, and the inputs under them.

        Raises:
            NotProved: None were found.
        """
        bounds = self._closed({})
        for k in range(_ROUNDS):
            try:
                inputs = inputs_of(
                    self._model, self._cell, bounds, fed_of(self._model, bounds, self._alone, self._cell.choice.thrust)
                )
            except NotProved as reason:
                if k < 2:
                    raise
                raise NotProved(
                    f"the bounds do not close; they grow, as tilts, thrusts and lags act on each other, until {reason}"
                ) from None
            after = self._closed(inputs, near=True)
            if _within(after, bounds) and _within(after := self._closed(inputs), bounds):
                return after, inputs
            bounds = _widened(after, bounds)
            if not float(bounds.lateral["xi"].max()) < _LARGEST:
                break
        raise NotProved("the bounds do not close: what the error's nonlinear parts allow grows as fast as the bounds do")

    def _response(self, kind: str, inputs: Inputs, *, near: bool) -> dict[str, Floats]:
        """Return what a loop's outputs can be under inputs, or nearly so."""
        kernels, ticks = self._kernels[kind], len(self._model.plan)
        driven: dict[str, Floats] = {}
        for (loop, name, _), bound in inputs.items():
            if loop == kind:
                driven[name] = driven.get(name, 0.0) + bound
        found: dict[str, Floats] = {}
        base = {
            "push": ("hauled" if kind == "lateral" else "pushed", self._cell.choice.thrust),
            "aim": ("p", 1.0),
            "tilted": ("pushed", 1.0),
        }
        base |= {"moved": ("mu", 1.0), "steering": ("steered", 1.0), "leading": ("led", 1.0)}
        made = (kernels.near_response if near else kernels.response)(driven, ticks)
        for output, known in self._known[kind].items():
            of, factor = base.get(output, (output, 1.0))
            found[output] = (known + factor * made[of]) * (1.0 + 1e-9)
        return found

    def _closed(self, inputs: Inputs, *, near: bool = False) -> Bounds:
        """Return bounds of all states between steps too, from inputs; or what is nearly those, and proves nothing."""
        flat, up, turn = (self._response(kind, inputs, near=near) for kind in ("lateral", "vertical", "heading"))
        model, choice, plan = self._model, self._cell.choice, self._model.plan

        def total(kind: str, name: str) -> Floats:
            parts = [bound for (loop, other, _), bound in inputs.items() if (loop, other) == (kind, name)]
            return sum(parts, start=np.zeros(len(plan)))

        slow = 1.0 - _H * roll_drag_of(model.vehicle, model.airframe)
        flat["e"] = (flat["e"] + _H * (choice.torque * flat["mu"] + total("lateral", "eacc") + self._turned)) / slow
        for name, share in (("d", 1.0), ("pushed", 1.0), ("tilted", 1.0), ("tipped", 1.0), ("push", choice.thrust)):
            flat[name] = flat[name] + share * _H * (flat["e"] + total("lateral", "drate"))
        ramp = total("vertical", "rate") + self._sloped
        for name, share in (("b", 1.0), ("pushed", 1.0), ("push", choice.thrust)):
            up[name] = up[name] + share * _H * ramp
        for each, kind, drag in ((flat, "lateral", model.drags[0]), (up, "vertical", model.drags[1])):
            push = each["push"] + total(kind, "acc")
            each["change"] = (push + drag * each["nu"]) / (1.0 - _H * drag)
            each["nu"] = each["nu"] + _H * each["change"] + plan.jumps[:, 1]
            each["xi"] = each["xi"] + _H * each["nu"] + plan.jumps[:, 0]
        lead = 1.01 * lag_share(model.airframe) * reaction_of(model.vehicle, model.airframe) * math.sqrt(choice.torque)
        turn["o"] = turn["o"] + _H * (choice.torque * turn["mu"] + total("heading", "oacc"))
        turn["o"] = turn["o"] + lead * (turn["asked"] + total("heading", "u"))
        turn["f"] = turn["f"] + _H * (turn["o"] + total("heading", "frate"))
        return Bounds(*({name: value * (1.0 + 1e-9) + 1e-12 for name, value in each.items()} for each in (flat, up, turn)))

    def bound(self, bounds: Bounds, inputs: Inputs) -> TrackingBound:
        """Return what bounds that are kept say of positions, and what it is made of."""
        flat, up = bounds.lateral["xi"], bounds.vertical["xi"]
        delay = delay_of(self._model.disturbance.setpoints)
        around, late = np.hypot(flat, up), behind(self._model.plan, delay)
        course = (around + late) * (1.0 + 1e-9)
        tick = int(np.argmax(course))
        parts: dict[str, float] = {}
        for kind, share in (("lateral", flat[tick] / around[tick]), ("vertical", up[tick] / around[tick])):
            known = float(share * self._known[kind]["xi"][tick])
            parts["set-points and thrust that are known"] = parts.get("set-points and thrust that are known", 0.0) + known
            for (loop, name, cause), bound in inputs.items():
                if loop == kind:
                    moved = self._kernels[kind].moved("xi", name, bound)[tick]
                    parts[cause] = parts.get(cause, 0.0) + float(share * moved)
        parts["set-points"] = parts.get("set-points", 0.0) + float(late[tick])
        return TrackingBound(float(course[tick]), float(self._model.plan.times[tick]), course, parts)


def _sideways(turns: tuple[Jet, Jet, Jet], length: Jet) -> Floats:
    """Return rates, or their change, as they turn the thrust's axis, times the scale. Shape (ticks, 2)."""
    return np.stack([jet.middle for jet in lateral_of(turns, length)], axis=1)


def _within(after: Bounds, before: Bounds) -> bool:
    """Return whether all bounds are strictly less."""
    pairs = zip((after.lateral, after.vertical, after.heading), (before.lateral, before.vertical, before.heading), strict=True)
    return all(np.all(one[name] < other[name]) for one, other in pairs for name in other)


def _widened(after: Bounds, before: Bounds) -> Bounds:
    """Return bounds that are a little wider than both."""
    pairs = zip((after.lateral, after.vertical, after.heading), (before.lateral, before.vertical, before.heading), strict=True)
    return Bounds(*({name: 1.02 * one[name] + 1e-9 for name in one} for one, _ in pairs))
