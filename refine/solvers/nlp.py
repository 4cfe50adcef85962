"""Free times: a nonlinear programme over node states and durations, solved by IPOPT (`ipopt_engine`).

Pieces are given by the states at their ends, so they join up to the third derivative by construction, laps close by repeating
a node, and the programme has no equality constraints. Times are unknown by their logarithms, and a node's velocity to jerk by
what they amount to within the shorter piece beside it: flights that differ in pace alone then lie on a straight line. (In SI
units velocities and times would have to bend together, and steps would stay short for hundreds of iterations.) Limits are kept
at instants within each piece (the caller closes the gap between them by a small stretch), corridors at Bernstein points (which
hold for all times).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from refine.limits.limits import Limits
from refine.obstacles.keep_out_bodies import Ball
from refine.planes import Plane
from refine.solvers.ipopt_engine import solve
from refine.solvers.programme import UNIT, Objective, Shape, Unknowns
from refine.solvers.timeout import SolverTimeout
from refine.spline.basis import ORDER
from refine.spline.spline import Spline
from verify.data import BadInput, Infeasible

Floats = NDArray[np.float64]

INSTANTS = 16
"""Instants a piece at which limits are kept."""
SECONDS = 300.0
"""The clock only ends a solve with an error."""
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
        planes: (piece, plane): all of the piece is beyond the plane.
        speeds: Limit on speed of single pieces, m/s; inf for none. Shape (pieces,). None for none at all.
        accelerations: Limit on acceleration of single pieces, m/s^2, likewise.
        cycle: Node whose state the last node repeats, or None.
        instants: A piece.
        shortest: Least durations of the pieces, s; None for `SHORTEST`. Shape (pieces,).
        warm: Whether `start` is nearly the answer: the barrier then begins small, and an answer that keeps all constraints and no
            longer gets better is enough, even if its multipliers do not come to rest.
    """

    start: Spline
    fixed: Floats
    limits: Limits
    objective: Objective = "time"
    weight: float = 0.0
    within: Sequence[tuple[int, Ball]] = field(default=())
    planes: Sequence[tuple[int, Plane]] = field(default=())
    speeds: Floats | None = None
    accelerations: Floats | None = None
    cycle: int | None = None
    instants: int = INSTANTS
    shortest: Floats | None = None
    warm: bool = False


def optimise(problem: Timing) -> Spline:
    """Return the best spline that keeps the limits at their instants and the corridors at all times.

    Raises:
        BadInput: Numbers are not finite or shapes do not fit.
        Infeasible: IPOPT did not converge within its iterations, or its answer breaks what was asked; says by how much.
        SolverTimeout: Its seconds ran out before its iterations.
    """
    shape = _shape(problem)
    answer = solve(shape, _unknowns(problem), _parameters(problem, shape), seconds=SECONDS)
    if answer.out_of_time:
        raise SolverTimeout("IPOPT", SECONDS)
    if not np.all(np.isfinite(answer.values)) or answer.broken > TOLERANCE or not answer.converged:
        raise Infeasible(
            f"The times could not be optimised: {answer.status} after {answer.iterations} iterations, constraints off by "
            f"{answer.broken:.2g} of their limits."
        )
    return _spline(answer.values, problem)


def _shape(problem: Timing) -> Shape:
    pieces = len(problem.start)
    if problem.fixed.shape != (pieces + 1, ORDER, 3):
        raise BadInput(f"fixed states have shape {problem.fixed.shape}; for {pieces} pieces it must be ({pieces + 1}, 4, 3).")
    if not (np.all(np.isfinite(problem.start.durations)) and np.all(np.isfinite(problem.start.states))):
        raise BadInput("the first guess must be finite.")
    limits = problem.limits
    present = {
        "speed": math.isfinite(limits.speed) or problem.speeds is not None,
        "acceleration": math.isfinite(limits.acceleration) or problem.accelerations is not None,
        "thrust_max": math.isfinite(limits.thrust_max),
        "thrust_min": limits.thrust_min > 0,
        "tilt": math.isfinite(limits.tilt),
        "body_rate": math.isfinite(limits.body_rate),
        "rotors": limits.rotors is not None,
    }
    limited = tuple(name for name, there in present.items() if there)
    planes = tuple(piece for piece, _ in problem.planes)
    balls = tuple(node for node, _ in _rooms(problem))
    return Shape(pieces, problem.objective, limited, problem.instants, balls, planes, problem.cycle, problem.warm)


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
    return UNIT * np.exp(-log_times[:, None] * np.arange(ORDER))


def _unknowns(problem: Timing) -> Unknowns:
    """Return the first guess, and the least and greatest values, of the unknowns."""
    nodes, log_durations = _nodes(problem), np.log(np.maximum(problem.start.durations, SHORTEST))
    units = _units(nodes, log_durations)[:, :, None]
    fixed = _fixed(problem) / units
    shortest = np.full(len(log_durations), SHORTEST) if problem.shortest is None else np.maximum(problem.shortest, SHORTEST)
    lower = np.append(np.where(np.isnan(fixed), -np.inf, fixed), np.log(shortest))
    upper = np.append(np.where(np.isnan(fixed), np.inf, fixed), np.full(len(log_durations), np.inf))
    guess = np.append(problem.start.states[: len(nodes)] / units, log_durations)
    return Unknowns(np.clip(guess, lower, upper), lower, upper)


def _spline(x: Floats, problem: Timing) -> Spline:
    """Return the flight that the unknowns are, with the states that were given as they were given."""
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


def _parameters(problem: Timing, shape: Shape) -> Floats:
    limits = problem.limits
    rotors = limits.rotors
    numbers = [
        _finite(limits.thrust_max),
        limits.thrust_min,
        math.cos(limits.tilt) if math.isfinite(limits.tilt) else 0.0,
        _finite(limits.body_rate),
        0.0 if rotors is None else rotors.least / rotors.mass,
        1.0 if rotors is None else rotors.most / rotors.mass,
        0.0 if rotors is None else rotors.inertia[0] / (2 * rotors.arm * rotors.mass),
        problem.start.duration,
    ]
    own = [
        np.full(shape.pieces, most) if each is None else np.minimum(each, most)
        for each, most in ((problem.speeds, limits.speed), (problem.accelerations, limits.acceleration))
    ]
    pieces = np.stack([np.where(np.isfinite(each), each, 1e3) for each in own], axis=1)
    planes = [[*plane.normal, plane.offset, float(plane.monotone)] for _, plane in problem.planes]
    balls = [np.concatenate([body.root @ body.centre, UNIT * body.root.ravel()]) for _, body in _rooms(problem)]
    nodes = _nodes(problem).ravel()
    return np.concatenate([numbers, [problem.weight], pieces.ravel(), nodes, *balls, *planes])


def _finite(value: float) -> float:
    return value if math.isfinite(value) else 1e3
