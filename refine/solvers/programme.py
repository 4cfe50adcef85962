"""Inputs and outputs of an engine for nonlinear programmes: plain values, without a type of the engine's own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from refine.spline.basis import SIZE

Floats = NDArray[np.float64]

Objective = Literal["time", "snap", "blend"]

UNIT = 0.3
"""m; with a node's own time it makes all unknowns of the order of one."""


@dataclass(frozen=True)
class Shape:
    """Shape that decides the compiled programme; all else is a parameter.

    The parameters in order: limits (greatest thrust, least thrust, cosine of the tilt, body rate, least and greatest rotor thrust by
    mass, torque's share), the total time in s, the weight of time, each piece's limits on speed and acceleration, how each node's
    time goes (3 numbers), bodies (root times centre, then the root) and planes (normal, offset, whether progress along it is monotone).

    Attributes:
        pieces: How many.
        objective: As in `nlp.Timing`.
        limited: Which limits there are, of `speed`, `acceleration`, `thrust_max`, `thrust_min`, `tilt`, `body_rate`, `rotors`.
        instants: A piece, at which limits are kept.
        balls: The node that each body holds.
        planes: The piece that each plane bounds.
        cycle: Node whose state the last node repeats, or None.
        warm: As in `nlp.Timing`.
    """

    pieces: int
    objective: Objective
    limited: tuple[str, ...]
    instants: int
    balls: tuple[int, ...]
    planes: tuple[int, ...]
    cycle: int | None
    warm: bool

    @property
    def nodes(self) -> int:
        """Number of nodes that have states of their own."""
        return self.pieces + (self.cycle is None)

    @property
    def inequalities(self) -> int:
        """Number of constraints that are written as value <= 0."""
        rows = sum(2 if name == "rotors" else 1 for name in self.limited)
        return rows * self.instants * self.pieces + SIZE * len(self.planes) + len(self.balls)

    @property
    def constraints(self) -> int:
        """Number of all constraints: the inequalities, and a fixed total time where snap alone is minimised."""
        return self.inequalities + (self.objective == "snap")


@dataclass(frozen=True, eq=False, slots=True)
class Unknowns:
    """A first guess with its bounds: nodes' states by their own units (x, y, z of each derivative in turn), then log durations.

    Attributes:
        guess: Shape (unknowns,).
        least: -inf for none. Shape (unknowns,).
        greatest: inf for none. Shape (unknowns,).
    """

    guess: Floats
    least: Floats
    greatest: Floats


@dataclass(frozen=True, eq=False, slots=True)
class Answer:
    """Result that IPOPT returned, with its status.

    Attributes:
        values: Of the unknowns. Shape (unknowns,).
        broken: Most that a constraint is off by, of its limit.
        status: In IPOPT's words.
        iterations: How many it took.
        converged: Whether it says so.
        out_of_time: Whether its clock ended it.
    """

    values: Floats
    broken: float
    status: str
    iterations: int
    converged: bool
    out_of_time: bool
