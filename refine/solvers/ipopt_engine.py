"""IPOPT through CasADi, whose only importer this is: the programme of `nlp`, compiled with exact derivatives.

A programme is compiled for a shape (how many pieces, which limits, what is held where); all numbers are parameters. Compiled ones
are kept, so a second solve with other points, limits or corridors starts at once.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from refine.solvers.programme import UNIT, Answer, Shape, Unknowns
from refine.spline.basis import HERMITE, ORDER, SIZE, SNAP, bernstein_matrix, derivative_weights
from verify.data import GRAVITY

Floats = NDArray[np.float64]

ITERATIONS = 200
_INTERRUPTED = ("NonIpopt_Exception_Thrown", "User_Requested_Stop")
"""Statuses after Ctrl-C, which CasADi takes for itself: nothing else throws in a programme that calls no Python."""
_OUT_OF_TIME = ("Maximum_WallTime_Exceeded", "Maximum_CpuTime_Exceeded")
_WARM = {
    "ipopt.mu_strategy": "monotone",
    "ipopt.mu_init": 1e-3,
    "ipopt.bound_push": 1e-6,
    "ipopt.bound_frac": 1e-6,
    "ipopt.tol": 1e-3,
    "ipopt.constr_viol_tol": 1e-5,
    "ipopt.dual_inf_tol": 1e2,
    "ipopt.max_iter": 100,
    "ipopt.acceptable_iter": 6,
    "ipopt.acceptable_obj_change_tol": 1e-4,
    "ipopt.acceptable_constr_viol_tol": 1e-6,
    "ipopt.acceptable_compl_inf_tol": 1e-1,
    "ipopt.acceptable_tol": 1e3,  # together with the multipliers, which may be far off
}
"""From nearly an answer: six steps in a row that keep the constraints and change the objective by less than a ten-thousandth end it."""

_NODE = 3 * ORDER
_LOCAL = 2 * _NODE + 5
"""Unknowns of a piece: the states at its ends, log durations of itself and of the pieces before and after either end."""
_LIMITS, _OWN, _PLANE, _PACE = 8, 2, 5, 3


def solve(shape: Shape, unknowns: Unknowns, parameters: Floats, *, seconds: float) -> Answer:
    """Solve the programme of a shape.

    Args:
        shape: What is compiled.
        unknowns: A first guess, and bounds.
        parameters: What `Shape` says of them. Shape (parameters,).
        seconds: After which the clock ends it.

    Raises:
        KeyboardInterrupt: Ctrl-C came meanwhile.
    """
    solver = _compiled(shape, seconds)
    low, high = _constraint_bounds(shape)
    answer = solver(x0=unknowns.guess, lbx=unknowns.least, ubx=unknowns.greatest, lbg=low, ubg=high, p=parameters)
    stats = solver.stats()
    x, g = np.asarray(answer["x"]).ravel(), np.asarray(answer["g"]).ravel()
    status = str(stats["return_status"])
    if status in _INTERRUPTED:
        raise KeyboardInterrupt
    return Answer(
        values=x,
        broken=float(np.max(np.maximum(low - g, g - high), initial=0.0)),
        status=status.replace("_", " ").lower(),
        iterations=int(stats["iter_count"]),
        converged=bool(stats["success"]),
        out_of_time=status in _OUT_OF_TIME,
    )


def forget() -> None:
    """Drop all compiled programmes, so that the next solve pays for its own (for measurements)."""
    _compiled.cache_clear()
    _piece.cache_clear()
    _wall.cache_clear()


def _constraint_bounds(shape: Shape) -> tuple[Floats, Floats]:
    """Return bounds on the constraints, which are all written as value <= 0 except for a fixed total time."""
    low = np.zeros(shape.constraints)
    low[: shape.inequalities] = -np.inf
    return low, np.zeros(len(low))


@lru_cache(maxsize=32)
def _compiled(shape: Shape, seconds: float) -> Any:
    """Return the compiled programme of a shape.

    Derivatives are put together from those of one piece, which are written out once and mapped over the pieces: several
    times faster than to have them taken from the whole programme, to compile as well as to evaluate.
    """
    nodes, columns = shape.nodes, _columns(shape)
    unknowns = nodes * _NODE + shape.pieces
    x, numbers, weight = ca.MX.sym("x", unknowns), ca.MX.sym("limits", _LIMITS), ca.MX.sym("weight")
    own, paces = ca.MX.sym("own", _OWN, shape.pieces), ca.MX.sym("paces", _PACE, nodes)
    balls, planes = ca.MX.sym("balls", 12, len(shape.balls)), ca.MX.sym("planes", _PLANE, len(shape.planes))
    given = ca.veccat(numbers, weight, own, paces, balls, planes)
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", shape.constraints)
    share = {"time": 0.0, "snap": 1.0, "blend": 1.0 / weight}[shape.objective]
    constant = 0.0 if shape.objective == "snap" else 1.0

    value, cost_slope, limits_slope, bend = (f.map(shape.pieces) for f in _piece(shape.limited, shape.instants))
    local = ca.reshape(x[columns.ravel().tolist()], _LOCAL, shape.pieces)
    ends = [*range(1, nodes), *([] if shape.cycle is None else [shape.cycle])]
    pace = ca.vertcat(paces[:, : shape.pieces], paces[:, ends])
    data = (pace, ca.repmat(numbers, 1, shape.pieces), own)
    cost, limits = value(local, *data)
    times = ca.exp(x[nodes * _NODE :])
    total = ca.sum1(times)

    rows = _Rows(lam_g)
    multipliers = rows.add(limits, limits_slope(local, *data), columns)
    rows.bend(bend(local, *data, ca.repmat(lam_f * share, 1, shape.pieces), multipliers), columns)
    if shape.planes:
        there = list(shape.planes)
        _add_walls(rows, (local[:, there], pace[:, there], planes), columns[there])
    for index, node in enumerate(shape.balls):
        _add_ball(rows, x, balls[:, index], node)
    stretch = constant * lam_f
    clocks = nodes * _NODE + np.arange(shape.pieces)[None]
    if shape.objective == "snap":
        stretch += rows.add(total - numbers[_LIMITS - 1], times, clocks)
    rows.bend(stretch * times, clocks, diagonal=True)

    objective = share * ca.sum2(cost) + constant * total
    gradient = share * _gathered((unknowns, 1), [(columns, np.zeros(columns.size, int), cost_slope(local, pace))])
    gradient += ca.vertcat(ca.DM.zeros(nodes * _NODE), constant * times)
    constraints = ca.vertcat(*rows.constraints)
    jacobian = _gathered((shape.constraints, unknowns), rows.jacobian)
    hessian = _gathered((unknowns, unknowns), rows.hessian, upper=True)
    options = {
        "grad_f": ca.Function("grad_f", [x, given], [objective, gradient]),
        "jac_g": ca.Function("jac_g", [x, given], [constraints, jacobian]),
        "hess_lag": ca.Function("hess_lag", [x, given, lam_f, lam_g], [hessian]),
        **_options(shape, seconds),
    }
    return ca.nlpsol("timing", "ipopt", {"x": x, "f": objective, "g": constraints, "p": given}, options)


def _options(shape: Shape, seconds: float) -> dict[str, Any]:  # of any type: IPOPT's own
    options: dict[str, Any] = {
        "print_time": False,
        "error_on_fail": False,
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.max_iter": ITERATIONS,
        "ipopt.max_wall_time": seconds,
        "ipopt.tol": 1e-6,
        "ipopt.constr_viol_tol": 1e-7,
        "ipopt.mu_strategy": "monotone" if shape.objective == "time" else "adaptive",
    }
    return {**options, **_WARM} if shape.warm else options


class _Rows:
    """Constraints with their derivatives, put together from blocks of pieces and nodes. Values are of CasADi's own types.

    Attributes:
        constraints: Values, in order.
        jacobian: Blocks of the Jacobian: rows, columns, values.
        hessian: Blocks of the Lagrangian's Hessian, likewise.
    """

    def __init__(self, multipliers: Any) -> None:
        self.constraints: list[Any] = []
        self.jacobian: list[tuple[Any, Any, Any]] = []
        self.hessian: list[tuple[Any, Any, Any]] = []
        self._multipliers, self._row = multipliers, 0

    def add(self, values: Any, slopes: Any, columns: NDArray[np.int64]) -> Any:
        """Add constraints of pieces, each with a block of the Jacobian, and return their multipliers."""
        count = values.shape[0]
        first, self._row = self._row, self._row + len(columns) * count
        rows = np.arange(first, self._row).reshape(len(columns), 1, count)
        self.jacobian.append((np.repeat(rows, columns.shape[1], axis=1), np.repeat(columns, count), slopes))
        self.constraints.append(ca.vec(values))
        return ca.reshape(self._multipliers[first : self._row], count, len(columns))

    def bend(self, values: Any, columns: NDArray[np.int64], *, diagonal: bool = False) -> None:
        """Add second derivatives: a square block for each row of columns, or their diagonals alone."""
        if diagonal:
            self.hessian.append((columns, columns, values))
            return
        size = columns.shape[1]
        across, down = np.tile(columns[:, None, :], (1, size, 1)), np.tile(columns[:, :, None], (1, 1, size))
        self.hessian.append((across, down, values))


def _add_walls(rows: _Rows, at_walls: tuple[Any, Any, Any], columns: NDArray[np.int64]) -> None:
    """Keep pieces beyond planes, given their unknowns, how the times of their ends go, and the planes."""
    beyond, beyond_slope, beyond_bend = (f.map(len(columns)) for f in _wall())
    multipliers = rows.add(beyond(*at_walls), beyond_slope(*at_walls), columns)
    rows.bend(beyond_bend(*at_walls, multipliers), columns)


def _add_ball(rows: _Rows, x: Any, ball: Any, node: int) -> None:
    """Keep a node in a body."""
    root, place = ca.reshape(ball[3:], 3, 3).T, np.arange(3)[None] + node * _NODE
    offset = root @ x[place.ravel().tolist()] - ball[:3]
    multiplier = rows.add(ca.sumsqr(offset) - 1.0, 2.0 * (root.T @ offset), place)
    rows.bend(2.0 * multiplier * (root.T @ root), place)


def _columns(shape: Shape) -> NDArray[np.int64]:
    """Return where the unknowns of each piece are among all. Shape (pieces, _LOCAL)."""
    begins = np.arange(shape.pieces)
    ends = begins + 1
    if shape.cycle is not None:
        ends[-1] = shape.cycle
    states = [nodes_of[:, None] * _NODE + np.arange(_NODE) for nodes_of in (begins, ends)]
    clocks = np.clip(np.stack([begins, begins - 1, begins, ends - 1, ends], axis=1), 0, shape.pieces - 1)
    return np.concatenate([*states, shape.nodes * _NODE + clocks], axis=1)


def _gathered(shape: tuple[int, int], entries: list[tuple[Any, Any, Any]], *, upper: bool = False) -> Any:
    """Return the sparse matrix of all (rows, columns, values), added up where places repeat."""
    rows, columns = (np.concatenate([np.ravel(entry[side]) for entry in entries]) for side in (0, 1))
    kept = np.flatnonzero(rows <= columns) if upper else np.arange(len(rows))
    places, entry = np.unique(columns[kept] * shape[0] + rows[kept], return_inverse=True)
    pattern = ca.Sparsity.triplet(*shape, (places % shape[0]).tolist(), (places // shape[0]).tolist())
    adding = ca.Sparsity.triplet(len(places), len(rows), entry.tolist(), kept.tolist())
    return ca.MX(pattern, ca.DM(adding, 1.0) @ ca.vertcat(*(ca.vec(values) for _, _, values in entries)))


@lru_cache(maxsize=32)
def _piece(limited: tuple[str, ...], instants: int) -> tuple[Any, Any, Any, Any]:
    """Return the functions of one piece.

    They take its unknowns, how the times of its ends go, the limits, and its own limits on speed and acceleration.

    Returns:
        Its snap cost, and its limits as values that must be <= 0; the cost's gradient, which needs the unknowns only;
        the limits' Jacobian; and the Hessian of cost and limits, summed with multipliers.
    """
    local, pace, coefficients, unit, powers = _unknowns()
    numbers, own = ca.SX.sym("limits", _LIMITS), ca.SX.sym("own", _OWN)
    snap = ca.sum1(ca.sum2(unit * (ca.DM(SNAP) @ unit))) / powers[7]
    values: list[Any] = []
    for at in np.linspace(0.0, 1.0, instants):
        motion = tuple(_derivative(coefficients, powers, float(at), d) for d in (1, 2, 3, 4))
        values += _limit_rows(limited, motion, numbers, own)
    rows = ca.vertcat(*values) if values else ca.SX(0, 1)
    weight, multipliers = ca.SX.sym("weight"), ca.SX.sym("multipliers", rows.shape[0])
    hessian, _ = ca.hessian(weight * snap + ca.dot(multipliers, rows), local)
    given = [local, pace, numbers, own]
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
            unit[half * ORDER + derivative, :] = state[3 * derivative : 3 * derivative + 3].T * (UNIT * factors[derivative])
    return local, pace, ca.DM(HERMITE) @ unit, unit, powers


def _powers(base: Any, count: int) -> list[Any]:
    powers = [ca.SX(1)]
    for _ in range(count - 1):
        powers.append(powers[-1] * base)
    return powers


def _derivative(coefficients: Any, powers: list[Any], at: float, derivative: int) -> Any:
    weights = derivative_weights(derivative) * np.array([at ** max(k - derivative, 0) for k in range(SIZE)])
    return (ca.DM(weights).T @ coefficients).T / powers[derivative]


def _limit_rows(limited: tuple[str, ...], motion: tuple[Any, ...], numbers: Any, own: Any) -> list[Any]:
    """Return constraints at one instant, each divided by its limit so that all are of the order of one."""
    v, a, j, s = motion  # velocity to snap
    force = a + ca.DM([0.0, 0.0, GRAVITY])
    square = ca.sumsqr(force)
    rows: list[Any] = []
    if "speed" in limited:
        rows.append(ca.sumsqr(v) / own[0] ** 2 - 1)
    if "acceleration" in limited:
        rows.append(ca.sumsqr(a) / own[1] ** 2 - 1)
    if "thrust_max" in limited:
        rows.append(square / numbers[0] ** 2 - 1)
    if "thrust_min" in limited:
        rows.append((numbers[1] ** 2 - square) / GRAVITY**2)
    if "tilt" in limited:
        rows.append(numbers[2] - force[2] / ca.sqrt(square + 1e-12))
    if "body_rate" in limited:
        rows.append(ca.sumsqr(ca.cross(j, force)) / (numbers[3] ** 2 * square**2 + 1e-12) - 1)
    if "rotors" in limited:
        # Torque about x and y without spin about z: inertia times z x z''; its norm bounds both shares of each rotor.
        size = ca.sqrt(square + 1e-9)
        z = force / size
        size_1 = ca.dot(z, j)
        z_1 = (j - size_1 * z) / size
        turning = (ca.cross(z, s) - 2 * size_1 * ca.cross(z, z_1)) / size
        swing = numbers[6] * ca.sqrt(ca.sumsqr(turning) + 1.0)
        rows.append((size / 4 + swing) / numbers[5] - 1)
        rows.append((numbers[4] - size / 4 + swing) / numbers[5])
    return rows
