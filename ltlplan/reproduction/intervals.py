"""The reviewed interval of each quantity, with the reason for its width.

A quantity that leaves its interval is a change of behaviour: find out which change made it, and whether it is meant, before
its interval is changed here. Checks need no entry: each must hold.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ltlplan.reproduction.element import Quantity
from ltlplan.reproduction.expectation import Expectation, between, drawn, exact, flown, rounds, text

_ROUNDING = "rounding of arithmetic in double precision"


def expectations_of(element: str) -> Callable[[Quantity], Expectation]:
    """Return what is expected of an element's quantities.

    Args:
        element: Its id.
    """
    known = INTERVALS.get(element, {})
    return lambda quantity: known.get(quantity.name, Expectation())


def _rounded(most: float) -> Expectation:
    return between(0.0, most, _ROUNDING)


INTERVALS: Mapping[str, Mapping[str, Expectation]] = {
    "2019-def-1": {"points in some hoop": exact(42, 0)},
    "2019-fig-2": {"control points of a hoop": exact(5, 0)},
    "2019-def-4": {"states of the automaton": exact(5, 0)},
    "2019-fig-1": {
        "greatest difference from eq. (1)": _rounded(1e-12),
        "greatest difference from eq. (2)": _rounded(1e-9),
        "greatest difference from eq. (3)": _rounded(1e-9),
    },
    "2019-flatness": {
        "thrust against m |r'' - g z|": _rounded(1e-9),
        "roll and pitch against atan2 of the betas": _rounded(1e-9),
        "body rates against Gamma^-1 of Euler rates": _rounded(1e-9),
    },
    "2019-control": {
        "1 m off after 3 s of eq. (5)": between(0.0, 0.1, "the slowest pole, exp(-24) of a metre times a polynomial of degree 3"),
        "commands": exact(50, 0),
        "positions by motion capture": exact(100, 0),
    },
    "2019-alg-1": {
        "STRAIGHT chosen": exact(100, 0), "S_CURVE chosen": exact(123, 0), "U_TURN chosen": exact(313, 0), "TURN chosen": exact(464, 0),
    },
    "2019-lengths": {
        "STRAIGHT, 2 m ahead": exact(2.0),
        "U_TURN, 1 m ahead and 2 m aside": exact(2.57),
        "TURN, 1 m ahead and 2 m aside": exact(4.14),
        "S_CURVE, 1 m ahead and 0.99 m aside, with a plus": exact(1.56),
        "S_CURVE there as printed, with a minus": exact(0.16),
        "distance between the two points": exact(1.41),
    },
    "2019-alg-2": {
        "distance from the optimum after 100 rounds of 100": between(0.0, 0.01, "a hundredth of the way that it began with"),
        "greatest deviation left of 1": between(0.0, 0.01, "a hundredth of the deviation that it began with"),
        "elite share of the shipped missions": between(0.1, 0.2999, "the paper's 0.1 <= rho < 0.3"),
    },
    "2019-fig-3": {
        "primitives along the path": text(
            "STRAIGHT STRAIGHT STRAIGHT S_CURVE STRAIGHT STRAIGHT TURN STRAIGHT STRAIGHT U_TURN STRAIGHT U_TURN STRAIGHT STRAIGHT STRAIGHT STRAIGHT"
        ),
        "sum of their lengths": exact(8.75),
        "sum of their times at the nominal speed": exact(19.45),
    },
    "2019-fig-4": {
        "passages": text("hoop0F hoop1F hoop2F hoop1R"),
        "distance from the final waypoint at the end": between(0.0, 0.01, "coefficients in float32"),
        "nominal length": exact(8.83),
        "length after 60 rounds of 200 samples": drawn(6.56),
        "nominal speed": exact(0.45),
    },
    "2019-def-3": {"k(eta) of the simulated flight": text("hoop0 hoop1 hoop2 hoop1")},
    "2019-fig-5": {
        "run as flown": text("{} {hoop1} {} ({hoop2} {})^w"),
        "prefix, nominal": exact(1.69),
        "lap, nominal": exact(2.53),
        "prefix after 60 rounds of 200 samples": drawn(1.74),
        "lap after 60 rounds of 200 samples": drawn(1.38),
    },
    "2019-prose": {
        "run as flown": text("{} ({hoop0} {} {hoop2} {} {hoop1} {})^w"),
        "lap, nominal": exact(6.40),
        "lap after 60 rounds of 200 samples": drawn(5.19),
    },
    "2019-fig-6": {
        "sampled paths of the round": exact(50, 0),
        "share that satisfies the specification": between(0.44, 0.60, "50 samples: two more or fewer on the border count"),
    },
    "2019-fig-7": {
        "prefix, nominal": exact(2.48),
        "suffix, nominal": exact(6.28),
        **{f"longer segment, seed {seed}": between(3.3, 5.01, "at most 5 m when it is judged; the first sample below the limit may be another") for seed in range(3)},
        **{f"rounds of 50 samples, seed {seed}": rounds(count) for seed, count in enumerate((10, 13, 10))},
    },
    "2019-fig-8": {"worst distance from the plan": flown(27.4), "flight time": drawn(11.60)},
}  # fmt: skip
"""By element and quantity."""
