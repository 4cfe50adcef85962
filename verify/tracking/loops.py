"""The linear loops of the geometric controller about a hover: one horizontal axis, the vertical one, and the heading.

Horizontally the state is the position's and the velocity's error, the error d of the tilt times the strength of thrust, beside the plan's attitude and the
feedback, that of its rate e, the angular acceleration mu that the rotors lag behind (both times that strength), the sum of errors, the feedback p that is
held, how much less it turns attitudes than is linear, and what the cameras saw. Vertically the error b of the thrust takes the place of d, e and mu. All
matrices are exponentials in balls of 200 bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from flint import arb, arb_mat, ctx, fmpq

from verify.arithmetic.balls import Floats
from verify.data.airframe import AirframeTable
from verify.data.vehicle import GRAVITY, Vehicle
from verify.tracking.sampled_loop import STEP, SUBSTEPS, Matrix, SampledLoop

_BITS = 200
_TICK = fmpq(1, 50)


@dataclass(frozen=True, slots=True)
class LoopChoice:
    """Choices for which loops are linear: the middles of what is not known.

    Attributes:
        thrust: Acceleration over the acceleration that is commanded.
        torque: Angular acceleration over the one that is commanded.
        late: Steps on board by which what the cameras see is late.
        summed: Share of a position's error that the sum takes.
    """

    thrust: float
    torque: float
    late: int
    summed: float


def lateral_loop(vehicle: Vehicle, airframe: AirframeTable, choice: LoopChoice) -> SampledLoop:
    """Return the loop of a horizontal axis.

    Args:
        vehicle: Its mass.
        airframe: Lag, drag and gains.
        choice: What it is linear for.
    """
    gains, names = airframe.gains, ("xi", "nu", "d", "e", "mu", "I", "p", "pull", "xi_seen", "nu_seen")
    at = {name: row for row, name in enumerate(names)}
    with _precise():
        stiff, damping = arb(gains.attitude[0]), arb(gains.rate[0])
        pull, torque = arb(choice.thrust), arb(choice.torque)
        flow = _Flow(("xi", "nu", "d", "e", "p", "mu", "ahead", "fading", "acc", "drate", "eacc"))
        flow.set("xi", nu=1)
        flow.set("nu", p=pull, d=pull, nu=-drag_of(vehicle, airframe)[0], acc=1)
        flow.set("d", e=1, drate=1)
        flow.set("e", **_lagged(airframe, torque), eacc=1, e=-roll_drag_of(vehicle, airframe))
        flow.set("fading", fading=-1 / arb(airframe.rotor_lag))
        over = flow.over_a_step()
        aim = {"d": -stiff, "e": -damping, "mu": arb(-1)}
        taken = {name: {name: arb(1)} for name in ("xi", "nu", "d", "e", "p", "mu")} | {"ahead": aim, "fading": aim}
        step = _step(over, at, taken, moved=("xi", "nu", "d", "e"))
        share = _share(airframe)
        for name, value in aim.items():
            step[at["mu"], at[name]] += share * value
        order = ("xi", "nu", "d", "e", "mu")
        inputs = {
            name: _column(names, {row: over[row, name] for row in order if row != "mu"}) for name in ("acc", "drate", "eacc")
        }
        aimed = {row: over[row, "ahead"] + over[row, "fading"] for row in order if row != "mu"} | {"mu": share}
        inputs["u"] = _column(names, aimed)
        inputs["spun"] = inputs["u"] - inputs["eacc"]
        inputs |= {f"{name}!": _column(names, {name: arb(1)}) for name in ("xi", "nu", "d", "e", "mu")}
        step[at["pull"], at["pull"]] = arb(1)
        for row in range(len(names)):
            step[row, at["pull"]] += pull * inputs["acc"][row, 0] - stiff * inputs["u"][row, 0]
        jump, held, commanded = _commands(names, gains.position[0], gains.velocity[0], gains.integral[0], choice)
        jump[at["pull"], at["pull"]] = arb(0)
        for name, value in held.items():
            jump[at["d"], at[name]] -= value
        for effect in commanded.values():
            effect["d"] = -effect["p"]
        commanded |= {f"{name}j": {name: arb(1)} for name in ("d", "e", "mu", "pull")} | _begun(names, jump)
    aims = {"d": -gains.attitude[0], "e": -gains.rate[0], "pull": -gains.attitude[0]}
    led = airframe.rotor_lag / gains.quickened_lag
    outputs = {name: _row(names, {name: 1.0}) for name in ("xi", "nu", "d", "e", "mu", "I", "p")}
    outputs |= {
        "pushed": _row(names, {"p": 1.0, "d": 1.0}),
        "hauled": _row(names, {"p": 1.0, "d": 1.0, "pull": 1.0}),
        "tipped": _row(names, {"d": 1.0, "pull": 1.0}),
        "asked": _row(names, {"mu": -1.0, **aims}),
        "steered": _row(names, aims),
        "led": _row(names, {"mu": 1.0 - led, **{name: led * aim for name, aim in aims.items()}}),
    }
    return _loop(names, (step, jump), choice, inputs, commanded, outputs, held)


def vertical_loop(vehicle: Vehicle, airframe: AirframeTable, choice: LoopChoice) -> SampledLoop:
    """Return the loop of the vertical axis.

    Args:
        vehicle: Its mass and inertia.
        airframe: Lag, drag and gains.
        choice: Of what it is linear for.
    """
    gains, names = airframe.gains, ("xi", "nu", "b", "I", "p", "xi_seen", "nu_seen")
    at = {name: row for row, name in enumerate(names)}
    with _precise():
        pull, lead = arb(choice.thrust), _lead(airframe)
        flow = _Flow(("xi", "nu", "p", "b", "ahead", "fading", "slope", "acc", "rate"))
        flow.set("xi", nu=1)
        flow.set("nu", p=pull, b=pull, ahead=pull * lead, fading=-pull * lead, slope=pull)
        flow.set("nu", nu=-drag_of(vehicle, airframe)[1], acc=1)
        flow.set("fading", fading=-1 / arb(airframe.rotor_lag))
        flow.set("slope", rate=-1)
        over, share = flow.over_a_step(), _share(airframe)
        aim = {"b": arb(-1)}
        taken = {name: {name: arb(1)} for name in ("xi", "nu", "p", "b")} | {"ahead": aim, "fading": aim}
        step = _step(over, at, taken, moved=("xi", "nu"))
        step[at["b"], at["b"]] = 1 - share
        inputs = {"acc": _column(names, {row: over[row, "acc"] for row in ("xi", "nu")})}
        inputs["rate"] = _column(names, {row: over[row, "rate"] for row in ("xi", "nu")} | {"b": -arb(STEP)})
        inputs["u"] = _column(names, {row: over[row, "ahead"] + over[row, "fading"] for row in ("xi", "nu")} | {"b": share})
        inputs |= {f"{name}!": _column(names, {name: arb(1)}) for name in ("xi", "nu")}
        jump, held, commanded = _commands(names, gains.position[1], gains.velocity[1], gains.integral[1], choice)
        for name, value in held.items():
            jump[at["b"], at[name]] -= value
        for effect in commanded.values():
            effect["b"] = -effect["p"]
        commanded |= {"bj": {"b": arb(1)}} | _begun(names, jump)
    outputs = {name: _row(names, {name: 1.0}) for name in ("xi", "nu", "b", "I", "p")}
    outputs["pushed"] = _row(names, {"p": 1.0, "b": 1.0})
    return _loop(names, (step, jump), choice, inputs, commanded, outputs, held)


def heading_loop(vehicle: Vehicle, airframe: AirframeTable, choice: LoopChoice) -> SampledLoop:
    """Return the loop of the heading, in rad: rotors that speed up push back.

    Args:
        vehicle: Its mass and inertia.
        airframe: Lag, drag and gains.
        choice: Of what it is linear for.
    """
    gains, names = airframe.gains, ("f", "o", "mu")
    with _precise():
        stiff, damping, torque = arb(gains.attitude[1]), arb(gains.rate[1]), arb(choice.torque)
        flow = _Flow(("f", "o", "mu", "ahead", "fading", "oacc", "frate"))
        flow.set("f", o=1, frate=1)
        flow.set("o", **_lagged(airframe, torque), oacc=1)
        quick = reaction_of(vehicle, airframe) * torque.sqrt() * _lead(airframe) / arb(airframe.rotor_lag)
        flow.set("o", fading=flow.get("o", "fading") + quick)
        flow.set("fading", fading=-1 / arb(airframe.rotor_lag))
        over, share = flow.over_a_step(), _share(airframe)
        at = {name: row for row, name in enumerate(names)}
        aim = {"f": -stiff, "o": -damping, "mu": arb(-1)}
        taken = {name: {name: arb(1)} for name in names} | {"ahead": aim, "fading": aim}
        step = _step(over, at, taken, moved=("f", "o"))
        for name, value in aim.items():
            step[at["mu"], at[name]] += share * value
        inputs = {name: _column(names, {row: over[row, name] for row in ("f", "o")}) for name in ("oacc", "frate")}
        inputs["u"] = _column(names, {row: over[row, "ahead"] + over[row, "fading"] for row in ("f", "o")} | {"mu": share})
        inputs |= {f"{name}!": _column(names, {name: arb(1)}) for name in ("f", "o")}
        commanded = {f"{name}j": {name: arb(1)} for name in names}
        jump = _identity(len(names))
    outputs = {name: _row(names, {name: 1.0}) for name in names}
    outputs["asked"] = _row(names, {"mu": -1.0, "f": -gains.attitude[1], "o": -gains.rate[1]})
    return SampledLoop(
        names, Matrix.of(step), Matrix.of(jump), (), SUBSTEPS, {k: Matrix.of(v) for k, v in inputs.items()},
        {k: Matrix.of(_column(names, v)) for k, v in commanded.items()}, outputs,
    )  # fmt: skip


def drag_of(vehicle: Vehicle, airframe: AirframeTable) -> tuple[float, float]:
    """Return the damping that the controller counts on, 1/s: across the rotors' axes, along them."""
    weight = vehicle.mass * GRAVITY
    speeds = 4.0 * float(np.sqrt(weight / 4.0 / airframe.thrust_coefficient)) / vehicle.mass
    return speeds * airframe.rotor_drag, speeds * airframe.inflow_drag


def roll_drag_of(vehicle: Vehicle, airframe: AirframeTable) -> float:
    """Return the damping of roll and pitch by the air that flows along the rotors' axes, 1/s."""
    speeds = 4.0 * float(np.sqrt(vehicle.mass * GRAVITY / 4.0 / airframe.thrust_coefficient))
    return airframe.inflow_drag * 0.5 * vehicle.arm**2 * speeds / (0.5 * (vehicle.inertia[0] + vehicle.inertia[1]))


def reaction_of(vehicle: Vehicle, airframe: AirframeTable) -> float:
    """Return by how much rotors that speed up turn the body, per rate of the moment that they are to give, s."""
    each = vehicle.mass * GRAVITY / 4.0
    return airframe.rotor_inertia / (2.0 * vehicle.torque_to_thrust * float(np.sqrt(each * airframe.thrust_coefficient)))


def lag_share(airframe: AirframeTable) -> float:
    """Return which share of what is asked of a rotor's thrust is there after a step (not rounded to a side)."""
    return airframe.rotor_lag / airframe.gains.quickened_lag * -float(np.expm1(-0.002 / airframe.rotor_lag))


class _Flow:
    """A linear differential equation, by names of its variables."""

    def __init__(self, names: Sequence[str]) -> None:
        self._at = {name: row for row, name in enumerate(names)}
        self._matrix = arb_mat(len(names), len(names))

    def set(self, variable: str, **terms: arb | float) -> None:
        """Say what a variable's derivative is made of."""
        for name, factor in terms.items():
            self._matrix[self._at[variable], self._at[name]] = arb(factor)

    def get(self, variable: str, term: str) -> arb:
        return self._matrix[self._at[variable], self._at[term]]

    def over_a_step(self) -> _Over:
        """Return what becomes of the variables in a step."""
        return _Over(self._at, (self._matrix * arb(STEP)).exp())


@dataclass(frozen=True, slots=True)
class _Over:
    at: dict[str, int]
    matrix: arb_mat

    def __getitem__(self, pair: tuple[str, str]) -> arb:
        return self.matrix[self.at[pair[0]], self.at[pair[1]]]


class _precise:  # noqa: N801  # a context, as `flint.ctx.workprec` in later versions
    def __enter__(self) -> None:
        self._before, ctx.prec = ctx.prec, _BITS

    def __exit__(self, *_: object) -> None:
        ctx.prec = self._before


def _lead(airframe: AirframeTable) -> arb:
    return arb(airframe.rotor_lag) / arb(airframe.gains.quickened_lag)


def _share(airframe: AirframeTable) -> arb:
    return _lead(airframe) * (1 - (-arb(STEP) / arb(airframe.rotor_lag)).exp())


def _lagged(airframe: AirframeTable, torque: arb) -> dict[str, arb]:
    """Return the terms of what lags: mu at the start of a step, what is ahead of it, and what of that has not come yet."""
    return {"mu": torque, "ahead": torque * _lead(airframe), "fading": -torque * _lead(airframe)}


def _step(over: _Over, at: dict[str, int], taken: dict[str, dict[str, arb]], *, moved: Sequence[str]) -> arb_mat:
    """Return the map of a step: `taken` gives the flow's variables at its start, by states; `moved` are those that it moves."""
    step = _identity(len(at))
    for row in moved:
        for column in at:
            step[at[row], at[column]] = arb(0)
        for variable, made in taken.items():
            for name, factor in made.items():
                step[at[row], at[name]] += over[row, variable] * factor
    return step


def _commands(
    names: Sequence[str], stiffness: float, damping: float, summing: float, choice: LoopChoice
) -> tuple[arb_mat, dict[str, arb], dict[str, dict[str, arb]]]:
    """Return the jump at a command, what the feedback grows by (by states), and what errors of what is seen do."""
    at = {name: row for row, name in enumerate(names)}
    gain = arb(_TICK) * arb(summing)
    near, speed = arb(stiffness) + gain * arb(choice.summed), arb(damping)
    fresh = {"xi_seen": -near, "nu_seen": -speed, "I": arb(1)}
    jump = _identity(len(names))
    jump[at["I"], at["xi_seen"]] = -gain * arb(choice.summed)
    jump[at["p"], at["p"]] = arb(0)
    for name, value in fresh.items():
        jump[at["p"], at[name]] = value
    seen = {
        "place": {"p": -near, "I": -gain * arb(choice.summed)},
        "speed": {"p": -speed},
        "clip": {"p": gain, "I": gain},
        "given": {"p": arb(1)},
    }
    return jump, {**fresh, "p": arb(-1)}, seen


def _loop(
    names: tuple[str, ...],
    maps: tuple[arb_mat, arb_mat],
    choice: LoopChoice,
    inputs: dict[str, arb_mat],
    commanded: dict[str, dict[str, arb]],
    outputs: dict[str, Floats],
    held: dict[str, arb],
) -> SampledLoop:
    step, jump = (Matrix.of(each) for each in maps)
    at = {name: row for row, name in enumerate(names)}
    taken = {name: Matrix.of(_column(names, effect)) for name, effect in commanded.items()}
    fed = {name: float(effect.size[at["p"], 0]) for name, effect in taken.items()}
    grown = Matrix.of(_column(names, held))
    return SampledLoop(
        states=names,
        step=step,
        jump=jump,
        recorded=((at["xi"], at["xi_seen"]), (at["nu"], at["nu_seen"])),
        seen=SUBSTEPS - choice.late,
        stepped={name: Matrix.of(column) for name, column in inputs.items()},
        commanded=taken,
        outputs=outputs,
        before={"off": _row(names, {"xi_seen": 1.0}), "grown": grown.mid[:, 0]},
        direct={("off", "place"): 1.0, ("off", "begin"): 1.0, **{("grown", name): value for name, value in fed.items()}},
    )


def _begun(names: Sequence[str], jump: arb_mat) -> dict[str, dict[str, arb]]:
    """Return the states after the first command of a vehicle that hovered 1 m off, that moved at 1 m/s, and whose sum was 1 m/s^2."""
    at = list(names)
    begun = {"begin": ("xi", "xi_seen"), "moving": ("nu",), "summed": ("I",)}
    return {
        start: {name: sum((jump[row, at.index(of)] for of in states), start=arb(0)) for row, name in enumerate(names)}
        for start, states in begun.items()
    }


def _identity(size: int) -> arb_mat:
    matrix = arb_mat(size, size)
    for row in range(size):
        matrix[row, row] = arb(1)
    return matrix


def _column(names: Sequence[str], values: dict[str, arb]) -> arb_mat:
    column = arb_mat(len(names), 1)
    for name, value in values.items():
        column[list(names).index(name), 0] = value
    return column


def _row(names: Sequence[str], values: dict[str, float]) -> Floats:
    row = np.zeros(len(names))
    for name, value in values.items():
        row[list(names).index(name)] = value
    return row
