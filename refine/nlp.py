"""Free times: a nonlinear programme over node states and durations, solved by IPOPT through CasADi (its only importer).

Pieces are given by the states at their ends, so they join up to the third derivative by construction and the programme
has no equality constraints. Limits are kept at instants within each piece (the caller closes the gap between them by a
small stretch), corridors at Bernstein points (which hold for all times). Compiled programmes are kept by their shape, so a
second solve with other points, limits or corridors starts at once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Literal

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from refine.basis import HERMITE, ORDER, SIZE, SNAP, bernstein_matrix, derivative_weights
from refine.clock import ClockRanOut
from refine.limits import Limits
from refine.obstacles import Ball, Plane
from refine.spline import Spline
from verify.data import GRAVITY, BadInput, Infeasible

Floats = NDArray[np.float64]

Objective = Literal["time", "snap", "blend"]

INSTANTS = 16
"""Instants a piece at which limits are kept."""
ITERATIONS = 200
SECONDS = 300.0
"""The clock only ends a solve with an error."""
_OUT_OF_TIME = ("Maximum_WallTime_Exceeded", "Maximum_CpuTime_Exceeded")
SHORTEST = 5e-2
"""Least duration of a piece, s: shorter ones lose their precision in float32."""
TOLERANCE = 1e-5


@dataclass(frozen=True, eq=False)
class Timing:
    """A problem with free times.

    Attributes:
        start: A first guess, whose shape decides the number of pieces.
        fixed: States that are given, NaN where free. Shape (pieces + 1, 4, 3).
        limits: Kept at instants.
        objective: "time": shortest; "snap": least snap with the total time of `start`; "blend": snap + weight * time
            (with a great weight: nearly the shortest, and far easier to solve where nodes are free).
        weight: For "blend", in m^2/s^8.
        within: For nodes that may lie anywhere in a body: (node, body).
        corridors: (piece, plane): all of the piece is beyond the plane.
        speeds: Limit on speed of single pieces, m/s; inf for none. Shape (pieces,). None for none at all.
        cycle: Node whose state the last node repeats, or None.
        instants: A piece.
    """

    start: Spline
    fixed: Floats
    limits: Limits
    objective: Objective = "time"
    weight: float = 0.0
    within: Sequence[tuple[int, Ball]] = field(default=())
    corridors: Sequence[tuple[int, Plane]] = field(default=())
    speeds: Floats | None = None
    cycle: int | None = None
    instants: int = INSTANTS


@dataclass(frozen=True)
class _Shape:
    """What decides the compiled programme; all else is a parameter."""

    pieces: int
    objective: Objective
    limited: tuple[str, ...]
    instants: int
    balls: tuple[int, ...]
    planes: int
    cycle: int | None


def optimise(problem: Timing) -> Spline:
    """Return the best spline that keeps the limits at their instants and the corridors at all times.

    Raises:
        BadInput: Numbers are not finite or shapes do not fit.
        Infeasible: IPOPT did not converge within its iterations, or its answer breaks what was asked; says by how much.
        ClockRanOut: Its seconds ran out before its iterations.
    """
    shape = _shape(problem)
    solver = _solver(shape, SECONDS)
    lower, upper = _bounds(problem)
    guess = np.clip(_pack(problem.start), lower, upper)
    low, high = _constraint_bounds(shape)
    answer = solver(x0=guess, lbx=lower, ubx=upper, lbg=low, ubg=high, p=_parameters(problem, shape))
    status = solver.stats()
    if status["return_status"] in _OUT_OF_TIME:
        raise ClockRanOut("IPOPT", SECONDS)
    x, g = np.asarray(answer["x"]).ravel(), np.asarray(answer["g"]).ravel()
    broken = float(np.max(np.maximum(low - g, g - high), initial=0.0))
    if not np.all(np.isfinite(x)) or broken > TOLERANCE or not status["success"]:
        raise Infeasible(
            f"The times could not be optimised: {status['return_status'].replace('_', ' ').lower()} after "
            f"{status['iter_count']} iterations, constraints off by {broken:.2g} of their limits."
        )
    return _unpack(x, problem)


def _shape(problem: Timing) -> _Shape:
    pieces = len(problem.start)
    if problem.fixed.shape != (pieces + 1, ORDER, 3):
        raise BadInput(f"fixed states have shape {problem.fixed.shape}; for {pieces} pieces it must be ({pieces + 1}, 4, 3).")
    if not (np.all(np.isfinite(problem.start.durations)) and np.all(np.isfinite(problem.start.states))):
        raise BadInput("the first guess must be finite.")
    limits = problem.limits
    present = {
        "speed": math.isfinite(limits.speed) or problem.speeds is not None,
        "acceleration": math.isfinite(limits.acceleration),
        "thrust_max": math.isfinite(limits.thrust_max),
        "thrust_min": limits.thrust_min > 0,
        "tilt": math.isfinite(limits.tilt),
        "body_rate": math.isfinite(limits.body_rate),
        "rotors": limits.rotors is not None,
    }
    limited = tuple(name for name, there in present.items() if there)
    count = np.bincount([piece for piece, _ in problem.corridors], minlength=pieces) if problem.corridors else np.zeros(1, int)
    planes = int(count.max())
    balls = tuple(node for node, _ in problem.within)
    return _Shape(pieces, problem.objective, limited, problem.instants, balls, planes, problem.cycle)


# The unknowns of a node are scaled so that all are of the order of one: m, m/s, and tenths and hundredths of the rest.
_SCALE = np.array([1.0, 1.0, 10.0, 100.0])
_NODE = 3 * ORDER
_SPEED, _LIMITS = 1, 9


def _pack(path: Spline) -> Floats:
    return np.concatenate([(path.states / _SCALE[:, None]).ravel(), path.durations])


def _unpack(x: Floats, problem: Timing) -> Spline:
    nodes = len(problem.start) + 1
    states = x[: nodes * _NODE].reshape(nodes, ORDER, 3) * _SCALE[:, None]
    given = ~np.isnan(problem.fixed)
    states[given] = problem.fixed[given]
    if problem.cycle is not None:
        states[-1] = states[problem.cycle]
    return Spline(x[nodes * _NODE :], states)


def _bounds(problem: Timing) -> tuple[Floats, Floats]:
    fixed = problem.fixed / _SCALE[:, None]
    lower = np.where(np.isnan(fixed), -np.inf, fixed).ravel()
    upper = np.where(np.isnan(fixed), np.inf, fixed).ravel()
    pieces = len(problem.start)
    return np.append(lower, np.full(pieces, SHORTEST)), np.append(upper, np.full(pieces, np.inf))


def _parameters(problem: Timing, shape: _Shape) -> Floats:
    limits, pieces = problem.limits, shape.pieces
    rotors = limits.rotors
    numbers = [
        _finite(limits.acceleration),
        _finite(limits.thrust_max),
        limits.thrust_min,
        math.cos(limits.tilt) if math.isfinite(limits.tilt) else 0.0,
        _finite(limits.body_rate),
        0.0 if rotors is None else rotors.least / rotors.mass,
        1.0 if rotors is None else rotors.most / rotors.mass,
        0.0 if rotors is None else rotors.inertia[0] / (2 * rotors.arm * rotors.mass),
        problem.start.duration,
    ]
    speeds = np.full(pieces, limits.speed) if problem.speeds is None else np.minimum(problem.speeds, limits.speed)
    planes = np.zeros((pieces, shape.planes, 5))
    planes[:, :, 3] = -1.0
    used = np.zeros(pieces, dtype=int)
    for piece, plane in problem.corridors:
        planes[piece, used[piece]] = [*plane.normal, plane.offset, float(plane.onward)]
        used[piece] += 1
    balls = [np.concatenate([(body.root @ body.centre), body.root.ravel()]) for _, body in problem.within]
    per_piece = np.concatenate([np.where(np.isfinite(speeds), speeds, 1e3)[:, None], planes.reshape(pieces, -1)], axis=1)
    return np.concatenate([numbers, [problem.weight], per_piece.ravel(), *balls])


def _finite(value: float) -> float:
    return value if math.isfinite(value) else 1e3


def _constraint_bounds(shape: _Shape) -> tuple[Floats, Floats]:
    """Return bounds on the constraints, which are all written as value <= 0 except for a fixed total time or a closed cycle."""
    low = np.zeros(_constraints(shape))
    low[: _count(shape) * shape.pieces + len(shape.balls)] = -np.inf
    return low, np.zeros(len(low))


def _constraints(shape: _Shape) -> int:
    inequalities = _count(shape) * shape.pieces + len(shape.balls)
    return inequalities + (shape.objective == "snap") + (_NODE if shape.cycle is not None else 0)


def _count(shape: _Shape) -> int:
    """Return the number of a piece's constraints."""
    rows = sum({"tilt": 1, "rotors": 2}.get(name, 1) for name in shape.limited)
    return rows * shape.instants + shape.planes * SIZE


@lru_cache(maxsize=32)
def _solver(shape: _Shape, seconds: float) -> Any:
    """Return the compiled programme of a shape.

    Derivatives are put together from those of one piece, which are written out once and mapped over the pieces: several
    times faster than to have them taken from the whole programme, to compile as well as to evaluate.
    """
    nodes, unknowns = shape.pieces + 1, (shape.pieces + 1) * _NODE + shape.pieces
    x, numbers, weight = ca.MX.sym("x", unknowns), ca.MX.sym("limits", _LIMITS), ca.MX.sym("weight")
    own, balls = ca.MX.sym("own", _SPEED + 5 * shape.planes, shape.pieces), ca.MX.sym("balls", 12, len(shape.balls))
    given = ca.veccat(numbers, weight, own, balls)
    states, times = ca.reshape(x[: nodes * _NODE], _NODE, nodes), x[nodes * _NODE :]
    functions = (function.map(shape.pieces) for function in _piece(shape.limited, shape.instants, shape.planes))
    value, cost_slope, rows_slope, bend = functions
    local = ca.vertcat(states[:, :-1], states[:, 1:], times.T)
    data = (ca.repmat(numbers, 1, shape.pieces), own)
    cost, rows = value(local, *data)
    total = ca.sum1(times)
    share = {"time": 0.0, "snap": 1.0, "blend": 1.0 / weight}[shape.objective]
    constant = 0.0 if shape.objective == "snap" else 1.0
    columns = np.array([[*range(_NODE * k, _NODE * (k + 2)), nodes * _NODE + k] for k in range(shape.pieces)])
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", _constraints(shape))

    size, count = len(columns[0]), _count(shape)
    constraints, jacobian = [ca.vec(rows)], [ca.vec(rows_slope(local, *data))]
    at: list[Any] = [np.repeat(np.arange(shape.pieces * count).reshape(-1, 1, count), size, axis=1), np.repeat(columns, count)]
    multipliers = ca.reshape(lam_g[: shape.pieces * count], count, shape.pieces)
    hessian = [ca.vec(bend(local, *data, ca.repmat(lam_f * share, 1, shape.pieces), multipliers))]
    where: list[Any] = [np.tile(columns[:, None, :], (1, size, 1)), np.tile(columns[:, :, None], (1, 1, size))]
    row = shape.pieces * count

    def entries(rows_: Any, columns_: Any, values: Any) -> None:
        at[0], at[1] = np.append(at[0], rows_), np.append(at[1], columns_)
        jacobian.append(ca.vec(values))

    for index, node in enumerate(shape.balls):
        root, place = ca.reshape(balls[3:, index], 3, 3).T, np.arange(3) + node * _NODE
        offset = root @ states[:3, node] - balls[:3, index]
        constraints.append(ca.sumsqr(offset) - 1.0)
        entries(np.full(3, row), place, 2.0 * (root.T @ offset))
        where[0], where[1] = np.append(where[0], np.tile(place, 3)), np.append(where[1], np.repeat(place, 3))
        hessian.append(ca.vec(2.0 * lam_g[row] * (root.T @ root)))
        row += 1
    if shape.objective == "snap":
        constraints.append(total - numbers[_LIMITS - 1])
        entries(np.full(shape.pieces, row), nodes * _NODE + np.arange(shape.pieces), ca.DM.ones(shape.pieces))
        row += 1
    if shape.cycle is not None:
        constraints.append(states[:, -1] - states[:, shape.cycle])
        for node, sign in ((nodes - 1, 1.0), (shape.cycle, -1.0)):
            entries(row + np.arange(_NODE), node * _NODE + np.arange(_NODE), sign * ca.DM.ones(_NODE))
    objective = share * ca.sum2(cost) + constant * total
    gradient = share * _gathered((unknowns, 1), columns.ravel(), np.zeros(columns.size, int), ca.vec(cost_slope(local)))
    gradient += ca.vertcat(ca.DM.zeros(nodes * _NODE), constant * ca.DM.ones(shape.pieces))
    every = ca.vertcat(*constraints)
    slopes = _gathered((_constraints(shape), unknowns), at[0].ravel(), at[1].ravel(), ca.vertcat(*jacobian))
    bends = _gathered((unknowns, unknowns), where[0].ravel(), where[1].ravel(), ca.vertcat(*hessian), upper=True)
    options = {
        "print_time": False,
        "error_on_fail": False,
        "grad_f": ca.Function("grad_f", [x, given], [objective, gradient]),
        "jac_g": ca.Function("jac_g", [x, given], [every, slopes]),
        "hess_lag": ca.Function("hess_lag", [x, given, lam_f, lam_g], [bends]),
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.max_iter": ITERATIONS,
        "ipopt.max_wall_time": seconds,
        "ipopt.tol": 1e-6,
        "ipopt.constr_viol_tol": 1e-7,
        "ipopt.mu_strategy": "monotone" if shape.objective == "time" else "adaptive",
    }
    return ca.nlpsol("timing", "ipopt", {"x": x, "f": objective, "g": every, "p": given}, options)


def _gathered(
    shape: tuple[int, int], rows: NDArray[np.int64], columns: NDArray[np.int64], values: Any, *, upper: bool = False
) -> Any:
    """Return the sparse matrix whose entries are the values at these places, added up where places repeat."""
    kept = np.flatnonzero(rows <= columns) if upper else np.arange(len(rows))
    places, entry = np.unique(columns[kept] * shape[0] + rows[kept], return_inverse=True)
    pattern = ca.Sparsity.triplet(*shape, (places % shape[0]).tolist(), (places // shape[0]).tolist())
    adding = ca.Sparsity.triplet(len(places), len(rows), entry.tolist(), kept.tolist())
    return ca.MX(pattern, ca.DM(adding, 1.0) @ values)


def forget() -> None:
    """Drop all compiled programmes, so that the next solve pays for its own (for measurements)."""
    _solver.cache_clear()
    _piece.cache_clear()


@lru_cache(maxsize=32)
def _piece(limited: tuple[str, ...], instants: int, planes: int) -> tuple[Any, Any, Any, Any]:
    """Return the functions of one piece.

    They take its unknowns (the states at its ends and its duration), the limits, and its own speed limit and planes.

    Returns:
        Its snap cost, and its constraints as values that must be <= 0; the cost's gradient, which needs the unknowns only;
        the constraints' Jacobian; and the Hessian of cost and constraints, summed with multipliers.
    """
    local = ca.SX.sym("local", 2 * _NODE + 1)
    begin, end, time = ca.vertsplit(local, [0, _NODE, 2 * _NODE, 2 * _NODE + 1])
    numbers, own = ca.SX.sym("limits", _LIMITS), ca.SX.sym("own", _SPEED + 5 * planes)
    powers = [ca.SX(1)]
    for _ in range(SIZE - 1):
        powers.append(powers[-1] * time)
    unit = ca.SX(SIZE, 3)
    for half, state in enumerate((begin, end)):
        for derivative in range(ORDER):
            unit[half * ORDER + derivative, :] = state[3 * derivative : 3 * derivative + 3].T * (
                _SCALE[derivative] * powers[derivative]
            )
    coefficients = ca.DM(HERMITE) @ unit
    snap = ca.sum1(ca.sum2(unit * (ca.DM(SNAP) @ unit))) / powers[7]
    values: list[Any] = []
    for at in np.linspace(0.0, 1.0, instants):
        v, a, j, s = (_derivative(coefficients, powers, float(at), d) for d in (1, 2, 3, 4))
        values += _limit_rows(limited, v, a, j, s, numbers, own[0])
    points = ca.DM(bernstein_matrix()) @ coefficients
    for index in range(planes):
        normal, offset, onward = ca.vertsplit(own[_SPEED + 5 * index : _SPEED + 5 * index + 5], [0, 3, 4, 5])
        before = ca.vertcat(points[0, :], points[:-1, :])  # the first point is no step: its row then reads offset <= 0
        values.append(offset - (points - onward * before) @ normal)
    rows = ca.vertcat(*values) if values else ca.SX(0, 1)
    weight, multipliers = ca.SX.sym("weight"), ca.SX.sym("multipliers", rows.shape[0])
    hessian, _ = ca.hessian(weight * snap + ca.dot(multipliers, rows), local)
    given = [local, numbers, own]
    return (
        ca.Function("value", given, [snap, rows]),
        ca.Function("cost_slope", [local], [ca.densify(ca.gradient(snap, local))]),
        ca.Function("rows_slope", given, [ca.densify(ca.jacobian(rows, local))]),
        ca.Function("bend", [*given, weight, multipliers], [ca.densify(hessian)]),
    )


def _derivative(coefficients: Any, powers: list[Any], at: float, derivative: int) -> Any:
    weights = derivative_weights(derivative) * np.array([at ** max(k - derivative, 0) for k in range(SIZE)])
    return (ca.DM(weights).T @ coefficients).T / powers[derivative]


def _limit_rows(limited: tuple[str, ...], v: Any, a: Any, j: Any, s: Any, numbers: Any, speed: Any) -> list[Any]:
    """Return constraints at one instant, each divided by its limit so that all are of the order of one."""
    force = a + ca.DM([0.0, 0.0, GRAVITY])
    square = ca.sumsqr(force)
    rows: list[Any] = []
    if "speed" in limited:
        rows.append(ca.sumsqr(v) / speed**2 - 1)
    if "acceleration" in limited:
        rows.append(ca.sumsqr(a) / numbers[0] ** 2 - 1)
    if "thrust_max" in limited:
        rows.append(square / numbers[1] ** 2 - 1)
    if "thrust_min" in limited:
        rows.append((numbers[2] ** 2 - square) / GRAVITY**2)
    if "tilt" in limited:
        rows.append(numbers[3] - force[2] / ca.sqrt(square + 1e-12))
    if "body_rate" in limited:
        rows.append(ca.sumsqr(ca.cross(j, force)) / (numbers[4] ** 2 * square**2 + 1e-12) - 1)
    if "rotors" in limited:
        # Torque about x and y without spin about z: inertia times z x z''; its norm bounds both shares of each rotor.
        size = ca.sqrt(square + 1e-9)
        z = force / size
        size_1 = ca.dot(z, j)
        z_1 = (j - size_1 * z) / size
        turning = (ca.cross(z, s) - 2 * size_1 * ca.cross(z, z_1)) / size
        swing = numbers[7] * ca.sqrt(ca.sumsqr(turning) + 1.0)
        rows.append((size / 4 + swing) / numbers[6] - 1)
        rows.append((numbers[5] - size / 4 + swing) / numbers[6])
    return rows
