"""The reviewed interval of each quantity, with the reason for its width.

A quantity that leaves its interval is a change of behaviour: find out which change made it, and whether it is meant, before
its interval is changed here. Checks need no entry: each must hold.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from ltlplan.reproduction.element import Quantity
from ltlplan.reproduction.expectation import (
    SLOWED,
    Expectation,
    between,
    drawn,
    exact,
    flown,
    rounds,
    share,
    slack,
    text,
    timed,
)


def expectations_of(element: str) -> Callable[[Quantity], Expectation]:
    """Return what is expected of an element's quantities.

    Args:
        element: Its id.
    """
    known = INTERVALS.get(element, {})
    return lambda quantity: known.get(quantity.name, Expectation())


def _case(cost: float, flight: float | None = None) -> dict[str, Expectation]:
    """Return what is expected of a case study: the cost of its words and the length of its flight, s."""
    found = {"cost of the words": exact(cost, 1), "computing the words": timed(120)}
    if flight is not None:
        found |= {"flight": drawn(flight), "computing from the mission to the certificate": timed(120)}
    return found


def _problem(flight: float, spare: float | None = None) -> dict[str, Expectation]:
    """Return what is expected of a shipped problem: the length of its flight and its least slack, s."""
    found = {"flight": drawn(flight), "computing from the mission to the flight": timed(120)}
    return found if spare is None else {**found, "least slack of its bounds in seconds": slack(spare)}


def _raced(title: str, online: Sequence[float], offline: Sequence[float]) -> dict[str, Expectation]:
    """Return what is expected of summed costs for 1 to 5 robots."""
    own = {f"N = {count}, {title}, online": drawn(value) for count, value in enumerate(online, 1)}
    return own | {f"N = {count}, {title}, offline": drawn(value) for count, value in enumerate(offline, 1)}


INTERVALS: Mapping[str, Mapping[str, Expectation]] = {
    "2019-def-1": {"points in some hoop": exact(42, 0)},
    "2019-fig-2": {"control points of a hoop": exact(5, 0)},
    "2019-def-4": {"states of the automaton": exact(5, 0)},
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
    "2019-introduction": {
        "!hoop2 U (hoop0 | hoop1) & F hoop2: visits": text("hoop0 hoop2"),
        "F hoop0 & F hoop2 & G !hoop1: visits": text("hoop0 hoop2"),
    },
    "2019-directions": {
        "directions by the nearest control point": text("hoop0F hoop2F hoop1F"),
        "directions by the shortest whole sequence": text("hoop0F hoop2F hoop1F"),
    },
    "2019-feedback": {"worst distance from the plan": flown(3.7)},
    "2019-fig-3": {
        "primitives along the path": text(
            "3 STRAIGHT, 1 S_CURVE, 2 STRAIGHT, 1 TURN, 2 STRAIGHT, 1 U_TURN, 1 STRAIGHT, 1 U_TURN, 4 STRAIGHT"
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
    "2022-def-2.2": {
        "states of the deterministic automaton": exact(4, 0),
        "states of the small nondeterministic one": exact(5, 0),
        "satisfying words among them": exact(98, 0),
    },
    "2022-section-2.1": {"satisfying words of a co-safe formula among them": exact(32, 0)},
    "2022-def-4.1": {
        "states and their propositions": text("no_water {}, carrying {carrying}"),
        "actions": text("no_water to carrying at water"),
        "initial state": text("no_water"),
    },
    "2022-def-4.2": {
        "vertices": text("loc1, loc2, robot, smoke, water"),
        "edges, both ways where robots may return": exact(11, 0),
        "loc2 is entered from": text("smoke"),
    },
    "2022-def-4.3": {
        "hovers in a region, in each internal state": exact(8, 0),
        "nodes with free flight": exact(18, 0),
    },
    "2022-def-4.4": {
        "states reached": exact(31, 0),
        "accepting states": exact(8, 0),
    },
    "2022-def-4.5": {
        "F loc1 & F loc2 & G(smoke -> carrying): states in D": text("4 of 4"),
        "F(a & F b): states in D": text("2 of 3"),
        "F a & F b & (!c U a): states in D": text("2 of 4"),
        "G(a -> F b): states in D": text("2 of 3"),
    },
    "2022-section-5.2": {
        "states of the automaton, |F|": exact(4, 0),
        "states of a robot, |S_A|": exact(10, 0),
        "nodes of T for three robots, N |F| |S_A|": exact(120, 0),
        "nodes of the full product, |F| |S_A|^N": exact(4000, 0),
        "nodes of the full product for ten robots over T's": exact(100_000_000, 0),
        "letters that one robot can show": exact(10, 0),
    },
    "2022-example-2": {
        "formula": text("F loc1 & F loc2 & G(smoke -> carrying)"),
        "a region counts within": exact(0.2),
    },
    "2022-section-5.4": {
        "length of eta": drawn(3.26),
        "integral of |u|, u the acceleration": drawn(2.07),
        "both, as the search counts them": drawn(5.33),
        "integral of the distance from the origin, as |eta| reads by itself": drawn(12.51),
        "cost that would end the search early": exact(0, 0),
    },
    "2022-alg-2": {
        "cost by straight lines over the cheapest": between(0.9999, 1.05, "never cheaper than the proved optimum, at most 5 % dearer"),
        "paths optimised": between(15, 35, "which walks go on follows sampled costs"),
        "computing, three robots": timed(300),  # the paper: about 300 s
    },
    "2022-def-4.7": {
        "order of the robots": text("quad0 then quad2"),
    },
    "2022-fig-10": {
        "quad0: visits": text("water smoke loc2"),
        "quad0: cost": drawn(5.33),
        "quad0: length": drawn(3.26),
        "quad1: visits": text("stays"),
        "quad2: visits": text("loc1"),
        "quad2: cost": drawn(2.25),
        "quad2: length": drawn(1.21),
        "the paper's words, in every order": text("fails"),
    },
    "2022-fig-11": {
        "quad0: printed cost after the first round": drawn(6.85),
        "quad0: printed cost after round 12": drawn(5.78),
        "quad1: printed cost after the first round": drawn(8.09),
        "quad1: printed cost after round 12": drawn(6.56),
        "quad2: printed cost after the first round": drawn(9.05),
        "quad2: printed cost after round 12": drawn(7.41),
        "quad0: length after the first round": drawn(3.40),
        "quad0: length after round 12": drawn(3.11),
        "quad1: length after the first round": drawn(3.78),
        "quad1: length after round 12": drawn(3.49),
        "quad2: length after the first round": drawn(4.31),
        "quad2: length after round 12": drawn(4.01),
        "robot selected for loc2": text("quad0"),
    },
    "2022-alg-5": {
        "cost at the end over that at take-off": drawn(0.89),
        "computing of a step, median": timed(20),  # 50 Hz
    },
    "2022-fig-16": {
        "quad0: word as flown": text("{} {water} {carrying, water} {carrying} {carrying, smoke} {carrying} {carrying, loc2} {carrying}"),
        "quad1: word as flown": text("{}"),
        "quad2: word as flown": text("{} {loc1} {}"),
        "flight": drawn(10.48),
        "formula satisfied after": drawn(8.58),
        "worst tracking error": flown(5.4),
    },
    "2022-online-plan": {
        "length": drawn(4.22),
        "rounds of refinement until certified": exact(1, 0),
    },
    "2022-threshold": {
        "share of N(0, 1) below where it rests": between(0.04, 0.06, "it is moved by steps of Delta for ever, a fifth of rho"),
    },
    "2022-eq-9": {
        "Phi(Phi^-1(0.05)), three dimensions": share(0.05),
        "Phi(Phi^-1(0.5)), three dimensions": share(0.5),
        "Phi(Phi^-1(0.95)), three dimensions": share(0.95),
    },
    "2022-eq-10": {
        "share inside F^-1(0.05), with the root of Sigma": share(0.05),
        "share inside it with Sigma as printed": between(0.0, 0.002, "a thousandth: far from rho"),
    },
    "2022-eq-12": {
        "mean distance of two samples over sigma": between(1.104, 1.152, "2/sqrt(pi) and four standard deviations of 20 000 draws"),
        "F^-1(1 - rho + 1/N) - F^-1(1 - rho) for unit deviations": exact(0.196, 3),
    },
    "2022-alg-3": {
        "share of the distribution inside the surface": share(0.05),
        "mean of the directions drawn": between(0.0, 0.02, "0 and four standard deviations of 20 000 draws"),
    },
    "2022-alg-4": {
        "elites of 25 falling costs": exact(25, 0),
    },
    "2022-fig-12": {
        "mean distance of samples from their means at first": drawn(0.133),
        "mean 1 of five after 10 s": drawn(0.078),
        "mean 2 of five after 10 s": drawn(0.088),
        "mean 3 of five after 10 s": drawn(0.080),
        "mean 4 of five after 10 s": drawn(0.077),
        "mean 5 of five after 10 s": drawn(0.077),
    },
    "2022-fig-13": {
        "Delta at first, a = 0.1": exact(0.0039, 4),
        "Delta after 2 s, a = 0.1": drawn(0.675),
        "Delta after 5 s, a = 0.1": drawn(0.582),
        "Delta after 10 s, a = 0.1": drawn(0.480),
        "Delta at first, a = 0.01": exact(0.0039, 4),
        "Delta after 2 s, a = 0.01": drawn(0.379),
        "Delta after 5 s, a = 0.01": drawn(0.498),
        "Delta after 10 s, a = 0.01": drawn(0.326),
        "Delta at first, a = 0.001": exact(0.0039, 4),
        "Delta after 2 s, a = 0.001": drawn(0.056),
        "Delta after 5 s, a = 0.001": drawn(0.098),
        "Delta after 10 s, a = 0.001": drawn(0.111),
    },
    "2022-fig-14": {
        **_raced("printed cost", (9.56, 6.69, 6.30, 6.30, 6.30), (14.62, 8.37, 7.84, 7.84, 7.84)),
        **_raced("length", (6.29, 4.46, 4.22, 4.22, 4.22), (6.76, 4.60, 4.33, 4.33, 4.33)),
    },
    "2022-fig-15": {
        **{f"N = {count}, {title}: offline's time over online's": timed(100, least=1.0) for title in ("printed cost", "length") for count in range(1, 6)},
        **{f"N = {count}, printed cost: computing of the online flight": timed(120) for count in range(1, 6)},
    },
    "published-door-puzzle": {**_problem(126.5), "flight": between(50.0, 130.0, SLOWED)},
    "published-wall-swap": {**_problem(9.92), "flight": between(5.4, 15.0, SLOWED)},
    "published-wall-2": _problem(6.20, 0.23),
    "published-doorpuzzle-1": _problem(30.12, 0.23),
    "published-rover-2": _problem(10.24, 0.18),
    "published-stlcg-1": _problem(17.18, 0.82),
    "published-stlcg-2": {
        **_problem(12.08, 0.92),
        "flight": between(10.7, 12.5, "found by sampling: the last bit of a cost may choose another dwell, 11.03 or 12.08 s"),
    },
    "published-bai-first": _case(12.2, 21.5),
    "published-bai-second": _case(19.4, 35.4),
    "published-schillinger-second": _case(84.0, 125.8),
    "published-schillinger-second-joint": _case(84.0, 126.1),
    "published-schillinger-third": _case(38.0, 73.9),
    "published-schillinger-third-joint": _case(43.1, 84.5),
    "published-bosch": {
        **_case(28.6, 85.8),
        "flight": between(40.0, 110.0, "which words are flown where the first are refused hangs on choices of the refinement"),
    },
    "published-lomap-fifth": _case(10.2, 23.2),
    "published-meeting": _case(11.6, 14.0),
    "published-meeting-longest": _case(5.8, 14.0),
    "published-five-gather": _case(30.8, 15.1),
    "published-ten-meet": _case(73.5, 16.9),
    "published-thirty-meet": _case(241.0),
    "published-kth-soft": {
        "loads at r2 or r3, with the soft part": text("r1 r2 r1"),
        "length there, with the soft part": exact(4.84),
        "loads at r2 or r3, without it": text("r1 r3 r1"),
        "length there, without it": exact(2.88),
    },
}  # fmt: skip
"""By element and quantity."""
