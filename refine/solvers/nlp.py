"""Free times: a nonlinear programme over node states and durations, solved by IPOPT through CasADi (its only importer).

Pieces are given by the states at their ends, so they join up to the third derivative by construction, laps close by repeating
a node, and the programme has no equality constraints. Times are unknown by their logarithms, and a node's velocity to jerk by
what they amount to within the shorter piece beside it: flights that differ in pace alone then lie on a straight line. (In SI
units velocities and times would have to bend together, and steps would stay short for hundreds of iterations.) Limits are kept
at instants within each piece (the caller closes the gap between them by a small stretch), corridors at Bernstein points (which
hold for all times). Compiled programmes are kept by their shape, so a second solve with other points, limits or corridors
starts at once.
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

from refine.bodies import Ball, Plane
from refine.limits.values import Limits
from refine.solvers.timeout import SolverTimeout
from refine.spline.basis import HERMITE, ORDER, SIZE, SNAP, bernstein_matrix, derivative_weights
from refine.spline.values import Spline
from verify.data import GRAVITY, BadInput, Infeasible

Floats = NDArray[np.float64]

Objective = Literal["time", "snap", "blend"]
Steps = Literal["plain", "cautious"]

INSTANTS = 16
"""Instants a piece at which limits are kept."""
ITERATIONS = 200
SECONDS = 300.0
"""The clock only ends a solve with an error."""
_OUT_OF_TIME = ("Maximum_WallTime_Exceeded", "Maximum_CpuTime_Exceeded")
SHORTEST = 5e-2
"""Least duration of a piece, s: shorter ones lose their precision in float32."""
TOLERANCE = 1e-5
_SETTLED = {
    "ipopt.acceptable_iter": 10,
    "ipopt.acceptable_obj_change_tol": 1e-4,
    "ipopt.acceptable_constr_viol_tol": 1e-7,
    "ipopt.acceptable_compl_inf_tol": 1e-2,
    "ipopt.acceptable_tol": 1e3,  # together with the multipliers, which may be far off
}
"""Ten steps in a row that keep the constraints and change the objective by less than a ten-thousandth."""


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
        planes: (piece, plane): all of the piece is beyond the plane.
        speeds: Limit on speed of single pieces, m/s; inf for none. Shape (pieces,). None for none at all.
        cycle: Node whose state the last node repeats, or None.
        instants: A piece.
        steps: IPOPT's step in the multipliers: "plain" as long as the one in the unknowns, "cautious" as long as lowers the
            dual infeasibility, which converges on some programmes where the other does not, and the other way round.
        settled: Whether an answer that keeps all constraints and no longer gets better is enough, even if its multipliers do not
            come to rest: they may go back and forth for ever where points are free in bodies that they share with limits.
    """

    start: Spline
    fixed: Floats
    limits: Limits
    objective: Objective = "time"
    weight: float = 0.0
    within: Sequence[tuple[int, Ball]] = field(default=())
    planes: Sequence[tuple[int, Plane]] = field(default=())
    speeds: Floats | None = None
    cycle: int | None = None
    instants: int = INSTANTS
    steps: Steps = "plain"
    settled: bool = False


@dataclass(frozen=True)
class _Shape:
    """What decides the compiled programme; all else is a parameter."""

    pieces: int
    objective: Objective
    limited: tuple[str, ...]
    instants: int
    balls: tuple[int, ...]
    planes: tuple[int, ...]
    cycle: int | None
    steps: Steps
    settled: bool


def optimise(problem: Timing) -> Spline:
    """Return the best spline that keeps the limits at their instants and the corridors at all times.

    Raises:
        BadInput: Numbers are not finite or shapes do not fit.
        Infeasible: IPOPT did not converge within its iterations, or its answer breaks what was asked; says by how much.
        SolverTimeout: Its seconds ran out before its iterations.
    """
    shape = _shape(problem)
    solver = _solver(shape, SECONDS)
    guess, lower, upper = _pack(problem)
    low, high = _constraint_bounds(shape)
    answer = solver(x0=guess, lbx=lower, ubx=upper, lbg=low, ubg=high, p=_parameters(problem, shape))
    status = solver.stats()
    if status["return_status"] in _OUT_OF_TIME:
        raise SolverTimeout("IPOPT", SECONDS)
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
    planes = tuple(piece for piece, _ in problem.planes)
    balls = tuple(node for node, _ in _rooms(problem))
    return _Shape(
        pieces, problem.objective, limited, problem.instants, balls, planes, problem.cycle, problem.steps, problem.settled
    )


_UNIT = 0.3
"""m; with a node's own time it makes all unknowns of the order of one."""
_NODE = 3 * ORDER
_LOCAL = 2 * _NODE + 5
"""Unknowns of a piece: the states at its ends, log durations of itself and of the pieces before and after either end."""
_LIMITS, _PLANE, _PACE = 9, 5, 3


def _nodes(problem: Timing) -> Floats:
    """Return how each node's time goes: shares of the log durations before and after it, and a constant. Shape (nodes, 3).

    It is that of the shorter piece beside the node in the first guess, for that one bends first; where velocity, acceleration or
    jerk are given and are not 0, it stays as it is in the first guess.
    """
    log_durations = np.log(np.maximum(problem.start.durations, SHORTEST))
    before, after = np.append(np.inf, log_durations), np.append(log_durations, np.inf)
    if problem.cycle is not None:  # the last node is the cycle's
        before, after = before[:-1], after[:-1]
    moving = np.any(np.nan_to_num(_fixed(problem)[:, 1:]) != 0.0, axis=(1, 2))
    first = before < after
    return np.stack([first & ~moving, ~first & ~moving, np.where(moving, np.minimum(before, after), 0.0)], axis=1)


def _fixed(problem: Timing) -> Floats:
    """Return the fixed states of the programme's own nodes, without a last one that repeats another."""
    if problem.cycle is None:
        return problem.fixed
    fixed = problem.fixed[:-1].copy()
    fixed[problem.cycle] = np.where(np.isnan(fixed[problem.cycle]), problem.fixed[-1], fixed[problem.cycle])
    return fixed


def _units(nodes: Floats, log_durations: Floats) -> Floats:
    """Return the units of all nodes' states. Shape (nodes, 4)."""
    before, after = np.append(0.0, log_durations), np.append(log_durations, 0.0)
    log_times = nodes[:, 0] * before[: len(nodes)] + nodes[:, 1] * after[: len(nodes)] + nodes[:, 2]
    return _UNIT * np.exp(-log_times[:, None] * np.arange(ORDER))


def _pack(problem: Timing) -> tuple[Floats, Floats, Floats]:
    """Return the first guess, and the least and greatest values, of the unknowns."""
    nodes, log_durations = _nodes(problem), np.log(np.maximum(problem.start.durations, SHORTEST))
    units = _units(nodes, log_durations)[:, :, None]
    fixed = _fixed(problem) / units
    lower = np.append(np.where(np.isnan(fixed), -np.inf, fixed), np.full(len(log_durations), math.log(SHORTEST)))
    upper = np.append(np.where(np.isnan(fixed), np.inf, fixed), np.full(len(log_durations), np.inf))
    guess = np.append(problem.start.states[: len(nodes)] / units, log_durations)
    return np.clip(guess, lower, upper), lower, upper


def _unpack(x: Floats, problem: Timing) -> Spline:
    pieces = len(problem.start)
    log_durations = x[-pieces:]
    units = _units(_nodes(problem), log_durations)
    states = x[:-pieces].reshape(-1, ORDER, 3) * units[:, :, None]
    if problem.cycle is not None:
        states = np.concatenate([states, states[problem.cycle][None]])
    given = ~np.isnan(problem.fixed)
    states[given] = problem.fixed[given]
    return Spline(np.exp(log_durations), states)


def _rooms(problem: Timing) -> list[tuple[int, Ball]]:
    """Return the programme's own nodes that lie in bodies: a last one that repeats another counts where that one has none."""
    if problem.cycle is None:
        return list(problem.within)
    last = len(problem.start)
    known = {node for node, _ in problem.within}
    kept = [(node, body) for node, body in problem.within if node != last or problem.cycle not in known]
    return [(problem.cycle if node == last else node, body) for node, body in kept]


def _parameters(problem: Timing, shape: _Shape) -> Floats:
    limits = problem.limits
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
    speeds = np.full(shape.pieces, limits.speed) if problem.speeds is None else np.minimum(problem.speeds, limits.speed)
    planes = [[*plane.normal, plane.offset, float(plane.monotone)] for _, plane in problem.planes]
    balls = [np.concatenate([body.root @ body.centre, _UNIT * body.root.ravel()]) for _, body in _rooms(problem)]
    nodes = _nodes(problem).ravel()
    return np.concatenate([numbers, [problem.weight], np.where(np.isfinite(speeds), speeds, 1e3), nodes, *balls, *planes])


def _finite(value: float) -> float:
    return value if math.isfinite(value) else 1e3


def _constraint_bounds(shape: _Shape) -> tuple[Floats, Floats]:
    """Return bounds on the constraints, which are all written as value <= 0 except for a fixed total time."""
    low = np.zeros(_constraints(shape))
    low[: _inequalities(shape)] = -np.inf
    return low, np.zeros(len(low))


def _constraints(shape: _Shape) -> int:
    return _inequalities(shape) + (shape.objective == "snap")


def _inequalities(shape: _Shape) -> int:
    return _count(shape) * shape.pieces + SIZE * len(shape.planes) + len(shape.balls)


def _count(shape: _Shape) -> int:
    """Return the number of a piece's limits at its instants."""
    rows = sum({"tilt": 1, "rotors": 2}.get(name, 1) for name in shape.limited)
    return rows * shape.instants


@lru_cache(maxsize=32)
def _solver(shape: _Shape, seconds: float) -> Any:
    """Return the compiled programme of a shape.

    Derivatives are put together from those of one piece, which are written out once and mapped over the pieces: several
    times faster than to have them taken from the whole programme, to compile as well as to evaluate.
    """
    nodes = shape.pieces + (shape.cycle is None)
    unknowns = nodes * _NODE + shape.pieces
    x, numbers, weight = ca.MX.sym("x", unknowns), ca.MX.sym("limits", _LIMITS), ca.MX.sym("weight")
    speeds, paces = ca.MX.sym("speeds", 1, shape.pieces), ca.MX.sym("paces", _PACE, nodes)
    balls, planes = ca.MX.sym("balls", 12, len(shape.balls)), ca.MX.sym("planes", _PLANE, len(shape.planes))
    given = ca.veccat(numbers, weight, speeds, paces, balls, planes)
    columns = _columns(shape)
    value, cost_slope, limits_slope, bend = (f.map(shape.pieces) for f in _piece(shape.limited, shape.instants))
    local = ca.reshape(x[columns.ravel().tolist()], _LOCAL, shape.pieces)
    ends = [*range(1, nodes), *([] if shape.cycle is None else [shape.cycle])]
    pace = ca.vertcat(paces[:, : shape.pieces], paces[:, ends])
    data = (pace, ca.repmat(numbers, 1, shape.pieces), speeds)
    cost, limits = value(local, *data)
    times = ca.exp(x[nodes * _NODE :])
    total = ca.sum1(times)
    share = {"time": 0.0, "snap": 1.0, "blend": 1.0 / weight}[shape.objective]
    constant = 0.0 if shape.objective == "snap" else 1.0
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", _constraints(shape))
    constraints: list[Any] = []
    jacobian: list[tuple[Any, Any, Any]] = []
    hessian: list[tuple[Any, Any, Any]] = []
    row = 0

    def blocks(values: Any, slopes: Any, columns: NDArray[np.int64]) -> Any:
        """Note constraints of pieces, each with a block of the Jacobian, and return their multipliers."""
        nonlocal row
        count = values.shape[0]
        rows = row + np.arange(len(columns) * count).reshape(-1, 1, count)
        jacobian.append((np.repeat(rows, columns.shape[1], axis=1), np.repeat(columns, count), slopes))
        constraints.append(ca.vec(values))
        row += len(columns) * count
        return ca.reshape(lam_g[row - len(columns) * count : row], count, len(columns))

    def bends(values: Any, columns: NDArray[np.int64]) -> None:
        size = columns.shape[1]
        hessian.append((np.tile(columns[:, None, :], (1, size, 1)), np.tile(columns[:, :, None], (1, 1, size)), values))

    multipliers = blocks(limits, limits_slope(local, *data), columns)
    bends(bend(local, *data, ca.repmat(lam_f * share, 1, shape.pieces), multipliers), columns)
    if shape.planes:
        beyond, beyond_slope, beyond_bend = (f.map(len(shape.planes)) for f in _wall())
        there, walled = list(shape.planes), columns[list(shape.planes)]
        at_walls = (local[:, there], pace[:, there], planes)
        multipliers = blocks(beyond(*at_walls), beyond_slope(*at_walls), walled)
        bends(beyond_bend(*at_walls, multipliers), walled)
    for index, node in enumerate(shape.balls):
        root, place = ca.reshape(balls[3:, index], 3, 3).T, np.arange(3)[None] + node * _NODE
        offset = root @ x[place.ravel().tolist()] - balls[:3, index]
        multiplier = blocks(ca.sumsqr(offset) - 1.0, 2.0 * (root.T @ offset), place)
        bends(2.0 * multiplier * (root.T @ root), place)
    stretch = constant * lam_f
    clocks = nodes * _NODE + np.arange(shape.pieces)[None]
    if shape.objective == "snap":
        stretch += blocks(total - numbers[_LIMITS - 1], times, clocks)
    hessian.append((clocks, clocks, stretch * times))
    objective = share * ca.sum2(cost) + constant * total
    gradient = share * _gathered((unknowns, 1), [(columns, np.zeros(columns.size, int), cost_slope(local, pace))])
    gradient += ca.vertcat(ca.DM.zeros(nodes * _NODE), constant * times)
    every = ca.vertcat(*constraints)
    options = {
        "print_time": False,
        "error_on_fail": False,
        "grad_f": ca.Function("grad_f", [x, given], [objective, gradient]),
        "jac_g": ca.Function("jac_g", [x, given], [every, _gathered((_constraints(shape), unknowns), jacobian)]),
        "hess_lag": ca.Function("hess_lag", [x, given, lam_f, lam_g], [_gathered((unknowns, unknowns), hessian, upper=True)]),
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.max_iter": ITERATIONS,
        "ipopt.max_wall_time": seconds,
        "ipopt.tol": 1e-6,
        "ipopt.constr_viol_tol": 1e-7,
        "ipopt.mu_strategy": "monotone" if shape.objective == "time" or shape.settled else "adaptive",
        "ipopt.alpha_for_y": "primal" if shape.steps == "plain" else "safer-min-dual-infeas",
    }
    if shape.settled:
        options |= _SETTLED
    return ca.nlpsol("timing", "ipopt", {"x": x, "f": objective, "g": every, "p": given}, options)


def _columns(shape: _Shape) -> NDArray[np.int64]:
    """Return where the unknowns of each piece are among all. Shape (pieces, _LOCAL)."""
    nodes = shape.pieces + (shape.cycle is None)
    begins = np.arange(shape.pieces)
    ends = begins + 1
    if shape.cycle is not None:
        ends[-1] = shape.cycle
    states = [nodes_of[:, None] * _NODE + np.arange(_NODE) for nodes_of in (begins, ends)]
    clocks = np.clip(np.stack([begins, begins - 1, begins, ends - 1, ends], axis=1), 0, shape.pieces - 1)
    return np.concatenate([*states, nodes * _NODE + clocks], axis=1)


def _gathered(shape: tuple[int, int], entries: list[tuple[Any, Any, Any]], *, upper: bool = False) -> Any:
    """Return the sparse matrix of all (rows, columns, values), added up where places repeat."""
    rows, columns = (np.concatenate([np.ravel(entry[side]) for entry in entries]) for side in (0, 1))
    kept = np.flatnonzero(rows <= columns) if upper else np.arange(len(rows))
    places, entry = np.unique(columns[kept] * shape[0] + rows[kept], return_inverse=True)
    pattern = ca.Sparsity.triplet(*shape, (places % shape[0]).tolist(), (places // shape[0]).tolist())
    adding = ca.Sparsity.triplet(len(places), len(rows), entry.tolist(), kept.tolist())
    return ca.MX(pattern, ca.DM(adding, 1.0) @ ca.vertcat(*(ca.vec(values) for _, _, values in entries)))


def forget() -> None:
    """Drop all compiled programmes, so that the next solve pays for its own (for measurements)."""
    _solver.cache_clear()
    _piece.cache_clear()
    _wall.cache_clear()


@lru_cache(maxsize=32)
def _piece(limited: tuple[str, ...], instants: int) -> tuple[Any, Any, Any, Any]:
    """Return the functions of one piece.

    They take its unknowns, how the times of its ends go, the limits, and its own speed limit.

    Returns:
        Its snap cost, and its limits as values that must be <= 0; the cost's gradient, which needs the unknowns only;
        the limits' Jacobian; and the Hessian of cost and limits, summed with multipliers.
    """
    local, pace, coefficients, unit, powers = _unknowns()
    numbers, speed = ca.SX.sym("limits", _LIMITS), ca.SX.sym("speed")
    snap = ca.sum1(ca.sum2(unit * (ca.DM(SNAP) @ unit))) / powers[7]
    values: list[Any] = []
    for at in np.linspace(0.0, 1.0, instants):
        motion = tuple(_derivative(coefficients, powers, float(at), d) for d in (1, 2, 3, 4))
        values += _limit_rows(limited, motion, numbers, speed)
    rows = ca.vertcat(*values) if values else ca.SX(0, 1)
    weight, multipliers = ca.SX.sym("weight"), ca.SX.sym("multipliers", rows.shape[0])
    hessian, _ = ca.hessian(weight * snap + ca.dot(multipliers, rows), local)
    given = [local, pace, numbers, speed]
    return (
        ca.Function("value", given, [snap, rows]),
        ca.Function("cost_slope", [local, pace], [ca.densify(ca.gradient(snap, local))]),
        ca.Function("limits_slope", given, [ca.densify(ca.jacobian(rows, local))]),
        ca.Function("bend", [*given, weight, multipliers], [ca.densify(hessian)]),
    )


@lru_cache(maxsize=1)
def _wall() -> tuple[Any, Any, Any]:
    """Return the functions of a piece and a plane: values that must be <= 0, their Jacobian, and the Hessian of their sum."""
    local, pace, coefficients, _, _ = _unknowns()
    plane, multipliers = ca.SX.sym("plane", _PLANE), ca.SX.sym("multipliers", SIZE)
    normal, offset, monotone = ca.vertsplit(plane, [0, 3, 4, 5])
    points = ca.DM(bernstein_matrix()) @ coefficients
    before = ca.vertcat(points[0, :], points[:-1, :])  # the first point is no step: its row then reads offset <= 0
    rows = offset - (points - monotone * before) @ normal
    hessian, _ = ca.hessian(ca.dot(multipliers, rows), local)
    return (
        ca.Function("beyond", [local, pace, plane], [rows]),
        ca.Function("beyond_slope", [local, pace, plane], [ca.densify(ca.jacobian(rows, local))]),
        ca.Function("beyond_bend", [local, pace, plane, multipliers], [ca.densify(hessian)]),
    )


def _unknowns() -> tuple[Any, Any, Any, Any, list[Any]]:
    """Return a piece's unknowns, how its ends' times go, its coefficients and end states in unit time, and powers of its time."""
    local, pace = ca.SX.sym("local", _LOCAL), ca.SX.sym("pace", 2 * _PACE)
    *ends, clock, clocks = ca.vertsplit(local, [0, _NODE, 2 * _NODE, 2 * _NODE + 1, _LOCAL])
    powers = _powers(ca.exp(clock), SIZE)
    unit = ca.SX(SIZE, 3)
    for half, state in enumerate(ends):
        before, after, constant = ca.vertsplit(pace[half * _PACE : (half + 1) * _PACE])
        log_time = before * clocks[2 * half] + after * clocks[2 * half + 1] + constant
        factors = _powers(ca.exp(clock - log_time), ORDER)
        for derivative in range(ORDER):
            unit[half * ORDER + derivative, :] = state[3 * derivative : 3 * derivative + 3].T * (_UNIT * factors[derivative])
    return local, pace, ca.DM(HERMITE) @ unit, unit, powers


def _powers(base: Any, count: int) -> list[Any]:
    powers = [ca.SX(1)]
    for _ in range(count - 1):
        powers.append(powers[-1] * base)
    return powers


def _derivative(coefficients: Any, powers: list[Any], at: float, derivative: int) -> Any:
    weights = derivative_weights(derivative) * np.array([at ** max(k - derivative, 0) for k in range(SIZE)])
    return (ca.DM(weights).T @ coefficients).T / powers[derivative]


def _limit_rows(limited: tuple[str, ...], motion: tuple[Any, ...], numbers: Any, speed: Any) -> list[Any]:
    """Return constraints at one instant, each divided by its limit so that all are of the order of one."""
    v, a, j, s = motion  # velocity to snap
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
