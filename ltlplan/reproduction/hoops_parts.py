"""Definitions, equations and algorithms of the 2019 paper; the 2022 paper has most of them again."""

from __future__ import annotations

import itertools
import math

import numpy as np

from flight.control.flatness import feed_forward, lifted
from flight.control.paper import discrete_chain
from flight.model.attitude import euler, euler_rate, euler_rate_inverse, from_euler, from_matrix, matrix
from flight.model.paper import paper_derivative
from flight.model.timing import CONTROL_STEP, FRAME_STEPS, STEP
from ltlplan.logic.translation import translate
from ltlplan.missions import load_mission
from ltlplan.paths.cross_entropy.gaussian import Options, Search
from ltlplan.paths.hoops import avoid, choose, control_points
from ltlplan.paths.hoops.keep_out import room
from ltlplan.paths.hoops.primitives import DELTA, Kind, s_curve, straight, turn, u_turn
from ltlplan.reproduction.element import Chart, Element, Findings, Quantity, holds
from ltlplan.systems.region_labels import Layout
from verify import check_word
from verify.data import GRAVITY, Word
from verify.data.arrays import Floats

DRAWS = 200
"""Random cases of each check."""


def hoop_set() -> Findings:
    """Compare membership in hoops with the printed E_i(r) <= 1."""
    mission = load_mission("hoops-sequence")
    points = np.random.default_rng(0).uniform(mission.workspace.min, mission.workspace.max, (50 * DRAWS, 3))
    ours = Layout(mission).regions_at(points)

    def printed(point: Floats) -> frozenset[str]:
        level = {
            name: float(np.sum(((point - hoop.center) / np.array(hoop.radii)) ** 2)) for name, hoop in mission.hoops.items()
        }
        return frozenset(name for name, value in level.items() if value <= 1)

    inside = sum(bool(region) for region in ours)
    same = all(own == printed(point) for own, point in zip(ours, points, strict=True))
    radii = {hoop.radii for hoop in mission.hoops.values()}
    return Findings(
        (
            holds(f"the same hoops hold each of {len(points)} points", same),
            Quantity("points in some hoop", inside, digits=0),
            holds("one set of radii for all hoops", len(radii) == 1, "equivalent for all hoops"),
        )
    )


def five_points() -> Findings:
    """Check the five control points of each hoop of Scenario 4.1."""
    from ltlplan.report.hoop_figures import control_point_figure

    mission = load_mission("hoops-sequence")
    counts: set[int] = set()
    truths: dict[str, list[bool]] = {"front and rear on the normal": [], "avoid points beside it": [], "all at one height": []}
    for hoop in mission.hoops.values():
        own = control_points(hoop)
        normal, ahead, aside = np.array(hoop.normal), own.front - own.centre, own.avoid - own.centre
        truths["front and rear on the normal"].append(
            bool(np.allclose(np.cross(ahead, normal), 0.0) and np.allclose(own.rear, 2 * own.centre - own.front))
        )
        truths["avoid points beside it"].append(bool(np.allclose(aside @ normal, 0.0) and np.allclose(sum(aside), 0.0)))
        places = np.stack([own.centre, own.front, own.rear, *own.avoid])
        truths["all at one height"].append(bool(np.allclose(places[:, 2], places[0, 2])))
        counts.add(len(np.unique(places, axis=0)))
    checks = tuple(holds(name, all(found)) for name, found in truths.items())
    chart = Chart("Hoops of Scenario 4.1, each with its five control points.", control_point_figure(mission), scene=True)
    return Findings((Quantity("control points of a hoop", max(counts), paper="5", digits=0), *checks), (chart,))


def propositions() -> Findings:
    """Compare the labelling k(r) with the printed one at points of the published course."""
    mission = load_mission("hoops-published")
    layout = Layout(mission)
    centres = {name: layout.at(hoop.center).inside == (name,) for name, hoop in mission.hoops.items()}
    start = layout.at(mission.agents["quad0"].start).inside
    return Findings(
        (
            holds("k(r) = {hoop_i} in the centre of each hoop", all(centres.values()), "k(r) = {hoop_0} iff r is in H_0"),
            holds("k(r) = {} at the start", start == ()),
        )
    )


def buechi() -> Findings:
    """Check the published run against the automaton of the published formula."""
    formula = "G(F hoop0 -> !hoop1 U hoop2 & F hoop1)"
    automaton = translate(formula, trace="infinite")
    run = Word((frozenset(), frozenset({"hoop1"}), frozenset()), (frozenset({"hoop2"}), frozenset()))
    broken = Word((frozenset(),), (frozenset({"hoop0"}), frozenset(), frozenset({"hoop1"}), frozenset()))
    return Findings(
        (
            Quantity("states of the automaton", len(automaton.states), digits=0),
            holds("the published run (hoop1)(hoop2)^w is accepted", automaton.accepts(run), "(hoop1)(hoop2)^w"),
            holds("hoop0 and hoop1 for ever, without hoop2, is rejected", not automaton.accepts(broken)),
            holds("the checker agrees on both words", check_word(formula, run) and not check_word(formula, broken)),
            holds(
                "the published run never visits hoop0", not any("hoop0" in letter for letter in run.prefix + (run.cycle or ()))
            ),
        )
    )


def dynamics() -> Findings:
    """Compare rotation, dynamics and Euler rates with eqs. (1) to (3) as printed."""
    rng = np.random.default_rng(0)
    angles = rng.uniform(-1.2, 1.2, (3, DRAWS))
    rates, thrust, mass = rng.normal(size=(3, DRAWS)), rng.uniform(0.1, 0.6, DRAWS), 0.03
    turn_ours = matrix(from_euler(angles))
    turn_printed = printed_rotation(*angles)
    state = np.zeros((9, DRAWS))
    state[6:] = angles
    change = paper_derivative(state, thrust, rates, mass)
    force = thrust / mass * turn_printed[:, 2] - np.array([0.0, 0.0, GRAVITY])[:, None]
    gamma = printed_gamma(*angles)
    return Findings(
        (
            holds("eq. (1) at 200 attitudes, to 1e-12", np.max(np.abs(turn_ours - turn_printed)) < 1e-12),
            holds("eq. (2) at 200 states, to 1e-9 m/s^2", np.max(np.abs(change[3:6] - force)) < 1e-9),
            holds("eq. (3) at 200 states, to 1e-9 rad/s", np.max(np.abs(change[6:] - np.einsum("ijn,jn->in", gamma, rates))) < 1e-9),
        )
    )  # fmt: skip


def printed_rotation(roll: Floats, pitch: Floats, yaw: Floats) -> Floats:
    """Return eq. (1) as printed. Shape (3, 3, n).

    Args:
        roll: rad. Shape (n,).
        pitch: Likewise.
        yaw: Likewise.
    """
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    return np.array(
        [
            [cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy],
            [cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy],
            [-sp, sr * cp, cr * cp],
        ]
    )


def printed_gamma(roll: Floats, pitch: Floats, yaw: Floats) -> Floats:
    """Return the matrix of eq. (3). Shape (3, 3, n).

    Args:
        roll: rad. Shape (n,).
        pitch: Likewise.
        yaw: Likewise.
    """
    zero, one = np.zeros_like(yaw), np.ones_like(yaw)
    cr, sr, tp, sec = np.cos(roll), np.sin(roll), np.tan(pitch), 1 / np.cos(pitch)
    return np.array([[one, sr * tp, cr * tp], [zero, cr, -sr], [zero, sr * sec, cr * sec]])


def flatness() -> Findings:
    """Compare thrust, angles and body rates from flat outputs with the printed feed-forward."""
    rng = np.random.default_rng(0)
    acceleration, jerk = rng.uniform(-5, 5, (3, DRAWS)), rng.normal(0, 3, (3, DRAWS))
    yaw, yaw_rate, zero = rng.uniform(-3, 3, DRAWS), rng.normal(size=DRAWS), np.zeros((3, DRAWS))
    found = feed_forward(lifted(acceleration), jerk, zero, yaw, yaw_rate, zero[0])
    roll, pitch, heading = euler(from_matrix(found.turn))
    x, y, z = acceleration  # the printed beta_a, beta_b, beta_c, with z up: every sign of the thrust changes
    beta_a, beta_b, beta_c = x * np.cos(yaw) + y * np.sin(yaw), z + GRAVITY, x * np.sin(yaw) - y * np.cos(yaw)
    angles = np.stack([np.arctan2(beta_c, np.hypot(beta_a, beta_b)), np.arctan2(beta_a, beta_b), yaw])
    thrust = np.linalg.norm(acceleration + np.array([0.0, 0.0, GRAVITY])[:, None], axis=0)
    back = euler_rate_inverse(angles, euler_rate(angles, found.rates))
    own = np.stack([roll, pitch, heading])
    return Findings(
        (
            holds("thrust is m |r'' - g z|, to 1e-9 m/s^2", np.max(np.abs(found.thrust - thrust)) < 1e-9),
            holds("roll and pitch are atan2 of the betas, to 1e-9 rad", np.max(np.abs(np.sin(own - angles))) < 1e-9),
            holds("body rates are Gamma^-1 of the Euler rates, to 1e-9 rad/s", np.max(np.abs(back - found.rates)) < 1e-9),
        )
    )


def feedback() -> Findings:
    """Check the chain of integrators and its feedback, and the rates of control and motion capture."""
    step, push, gains = discrete_chain(8.0)
    dt = CONTROL_STEP
    printed = np.array([[dt ** (j - i) / math.factorial(j - i) if j >= i else 0.0 for j in range(4)] for i in range(4)])
    poles = np.abs(np.linalg.eigvals(step - np.outer(push, gains)))
    state = np.array([1.0, 0.0, 0.0, 0.0])
    for _ in range(round(3.0 / dt)):
        state = step @ state - push * float(gains @ state)
    return Findings(
        (
            holds("eq. (4) over one control step, exactly", np.allclose(step, printed, rtol=1e-12)),
            holds("eq. (5) makes it stable: all poles within the unit circle", np.all(poles < 1)),
            Quantity("1 m off after 3 s of eq. (5)", 1e3 * abs(float(state[0])), "mm"),
            Quantity("commands", 1 / CONTROL_STEP, "Hz", "50 Hz", 0),
            Quantity("positions by motion capture", 1 / (FRAME_STEPS * STEP), "Hz", "100 Hz", 0),
        )
    )


def printed_choice(past: float, ahead: float, dist_yz: float) -> Kind:
    """Return the primitive that Algorithm 1, lines 13 to 25, chooses, where STRAIGHT ends the choice.

    Args:
        past: m that the robot has come along the normal.
        ahead: m that it goes on along it.
        dist_yz: m across it.
    """
    if dist_yz == 0:
        return "STRAIGHT"
    if math.copysign(1, past) == math.copysign(1, ahead):
        return "U_TURN" if abs(ahead) <= dist_yz else "S_CURVE"
    return "TURN"


def choice() -> Findings:
    """Compare the choice of primitives with the printed lines of Algorithm 1."""
    rng = np.random.default_rng(0)
    counts: dict[Kind, int] = dict.fromkeys(("STRAIGHT", "S_CURVE", "U_TURN", "TURN"), 0)
    same = True
    for index in range(5 * DRAWS):
        past, following = float(rng.normal()), rng.normal(size=3)
        following[1:] *= index % 10 > 0
        found = choose(np.array([-past, 0.0, 0.0]), np.zeros(3), following, np.eye(3)).kind
        same &= found == printed_choice(past, float(following[0]), math.hypot(*following[1:]))
        counts[found] += 1
    rows = tuple(Quantity(f"{kind} chosen", count, digits=0) for kind, count in counts.items())
    return Findings((holds(f"the printed choice in each of {5 * DRAWS} cases", same), *rows))


def s_curve_as_printed(dist_x: float, dist_yz: float) -> float:
    """Return S_CURVE's length with the paper's minus under the root; defined for dist_x >= dist_yz."""
    theta = math.atan2(dist_yz, dist_x)
    return 4 * DELTA * math.sqrt(dist_x * dist_x - dist_yz * dist_yz) / math.sin(theta) * theta


def lengths_of_primitives() -> Findings:
    """Compare the lengths of the primitives with the printed formulas, S_CURVE's both ways."""
    x, yz = 1.0, 0.99
    theta, radius = math.atan2(yz, x), math.hypot(x, yz) / 4 / math.sin(math.atan2(yz, x))
    joins = math.isclose(2 * radius * math.sin(2 * theta), x) and math.isclose(2 * radius * (1 - math.cos(2 * theta)), yz)
    return Findings(
        (
            Quantity("STRAIGHT, 2 m ahead", straight(-2.0), "m", "|r_x^c - r_x^w|"),
            Quantity("U_TURN, 1 m ahead and 2 m aside", u_turn(1.0, 2.0), "m", "(dist_yz - dist_x) + dist_x pi/2"),
            Quantity("TURN, 1 m ahead and 2 m aside", turn(1.0, 2.0), "m", "dist_x + dist_y pi/2"),
            Quantity("S_CURVE, 1 m ahead and 0.99 m aside, with a plus", s_curve(x, yz), "m"),
            Quantity("S_CURVE there as printed, with a minus", s_curve_as_printed(x, yz), "m", "delta sqrt(dist_x^2 - dist_yz^2)"),
            Quantity("distance between the two points", math.hypot(x, yz), "m"),
            holds("the two tangent arcs join the two points with the plus", joins),
            holds("lengths meet at the primitives' borders with the plus", math.isclose(s_curve(1, 1), u_turn(1, 1)) and math.isclose(s_curve(1, 1e-9), 1)),
            holds("t = length / v", math.isclose(choose(None, np.zeros(3), np.array([0.9, 0.0, 0.0]), np.eye(3)).time(0.45), 2.0), "t_s = |eta_s| / v"),
        )
    )  # fmt: skip


def past_a_hoop() -> Findings:
    """Check that AVOID goes by the nearer avoid point of a hoop in the way, and by none where the way is free."""
    mission = load_mission("hoops-sequence")
    own = control_points(mission.hoops["hoop0"])
    where = room(mission)
    before, behind = own.centre - 0.6 * own.frame[:, 0], own.centre + 0.6 * own.frame[:, 0]
    nearer = [
        avoid(mission, where, before + aside * own.frame[:, 1], behind + aside * own.frame[:, 1]) for aside in (0.1, -0.1)
    ]
    taken = [[point.position for point in points if point.role == "avoid"] for points in nearer]
    free = avoid(mission, where, before, before + np.array([0.0, 0.6, 0.0]))
    return Findings(
        (
            holds("to the left of the axis: the left avoid point", len(taken[0]) == 1 and np.allclose(taken[0][0], own.avoid[0]), "the closest avoid point"),
            holds("to the right of it: the right one", len(taken[1]) == 1 and np.allclose(taken[1][0], own.avoid[1]), "the closest avoid point"),
            holds("no detour where no hoop is between", free == ()),
        )
    )  # fmt: skip


def cross_entropy() -> Findings:
    """Run cross-entropy on a valley whose lowest point is known."""
    rng, options = np.random.default_rng(0), Options(samples=100, elite=0.1, rounds=100, populations=1)
    lowest = np.linspace(-1, 1, 6)
    state = Search.start(np.zeros(6), np.eye(6), options)
    history: list[float] = []
    for _ in range(options.rounds):
        candidates = state.ask(rng)
        state = state.tell(candidates, np.sum((candidates - lowest) ** 2, axis=1))
        history.append(state.best_cost)
    spread = float(np.sqrt(np.linalg.eigvalsh(state.covariance)[-1]))
    planner = load_mission("firefighting").planner
    return Findings(
        (
            holds("the best cost never rises", all(b <= a for a, b in itertools.pairwise(history))),
            Quantity("distance from the optimum after 100 rounds of 100", float(np.linalg.norm(state.best - lowest)), digits=4),
            Quantity("greatest deviation left of 1", spread, paper="tends to a delta function", digits=4),
            Quantity("elite share of the shipped missions", planner.elite, paper="0.1 <= rho < 0.3"),
        )
    )


HOOPS_PARTS: tuple[Element, ...] = (
    Element(
        id="2019-def-1", publication="2019", kind="definition", title="Definition 1: hoop set", also=("2022-def-3.1", "2022-eq-6", "2022-eq-7"),
        says="A hoop is the ellipsoid E_i(r) <= 1 around its centre; all have the same radii.",
        differs="Hoops may also have radii of their own, be turned, and be boxes or cylinders.",
        by=("ltlplan.systems.region_labels.Layout.regions_at", "verify.data.shapes.region.Hoop"), compute=hoop_set,
    ),
    Element(
        id="2019-fig-2", publication="2019", kind="figure", title="Fig. 2: control points", also=("2022-fig-2",),
        says="Each hoop has five control points: front, rear, centre, and two to avoid it by.",
        differs="The paper gives no distances: front and rear lie `reach`, avoid points `clearance` from the centre.",
        by=("ltlplan.paths.hoops.hoop_frame.control_points",), compute=five_points,
    ),
    Element(
        id="2019-def-2", publication="2019", kind="definition", title="Definition 2: propositions and their labelling", also=("2022-def-2.1",),
        says="k(r) is the set of hoops that hold the position r.", differs="",
        by=("ltlplan.systems.region_labels.Layout.at",), compute=propositions,
    ),
    Element(
        id="2019-def-4", publication="2019", kind="definition", title="Definition 4: Büchi automaton and accepting runs",
        says="A run is accepted if it passes accepting states infinitely often; the word is found as a prefix and a suffix.",
        differs="The published run satisfies the formula only because it never visits hoop0, which is reported.",
        by=("ltlplan.logic.translation.translate", "ltlplan.logic.automaton.Automaton.accepts"), compute=buechi,
    ),
    Element(
        id="2019-fig-1", publication="2019", kind="equation", title="Fig. 1 and eqs. (1) to (3): frames and dynamics", also=("2019-eq-1", "2019-eq-2", "2019-eq-3", "2022-fig-1", "2022-eq-1", "2022-eq-2", "2022-eq-3", "2022-section-2.3"),
        says="r'' = g z + R z f / m, and the Euler angles' rates are Gamma times the body rates.",
        differs="The world's z axis points up, so that gravity is negative and thrust positive.",
        by=("flight.model.paper.paper_derivative", "flight.model.attitude.euler_rate"), compute=dynamics,
    ),
    Element(
        id="2019-flatness", publication="2019", kind="equation", title="Section II-A: feed-forward by differential flatness",
        says="Thrust is m |r'' - g z|; roll, pitch and body rates follow from acceleration and jerk.",
        differs="The world's z axis points up, so the signs of the printed betas change together.",
        by=("flight.control.flatness.feed_forward",), compute=flatness,
    ),
    Element(
        id="2019-control", publication="2019", kind="section", title="Section II-A and 2022's eqs. (4) and (5): feedback", also=("2022-eq-4", "2022-eq-5", "2022-rates"),
        says="A chain of integrators is driven by u = -<K, p - eta>; commands at 50 Hz, positions at 100 Hz.",
        differs="Each feedback term has a gain of its own, and the position error is turned into the heading's frame.",
        by=("flight.control.paper.discrete_chain", "flight.control.paper.PaperController"), compute=feedback,
    ),
    Element(
        id="2019-alg-1", publication="2019", kind="algorithm", title="Algorithm 1: choice of the primitive", also=("2022-alg-1",),
        says="STRAIGHT on the axis; U_TURN or S_CURVE without a change of direction; TURN with one.",
        differs="STRAIGHT ends the choice for its segment; the captions of Fig. 3 name U_TURN and TURN the other way round.",
        by=("ltlplan.paths.hoops.primitives.choose",), compute=choice,
    ),
    Element(
        id="2019-lengths", publication="2019", kind="equation", title="Section III-A: lengths and times of the primitives", also=("2022-lengths",),
        says="Each primitive has a length in dist_x and dist_yz; its time is length / v.",
        differs="S_CURVE's root has a plus: with the printed minus its length falls far below the distance.",
        by=("ltlplan.paths.hoops.primitives.s_curve", "ltlplan.paths.hoops.primitives.u_turn", "ltlplan.paths.hoops.primitives.turn"),
        compute=lengths_of_primitives,
    ),
    Element(
        id="2019-avoid", publication="2019", kind="algorithm", title="Algorithm 1, lines 8 to 12: AVOID", also=("2022-avoid",),
        says="A hoop in the way is passed by its closest avoid point.",
        differs="Where that leads nowhere, the other point or a shortest way through free space is taken.",
        by=("ltlplan.paths.hoops.avoidance.avoid",), compute=past_a_hoop,
    ),
    Element(
        id="2019-alg-2", publication="2019", kind="algorithm", title="Algorithm 2: cross-entropy", also=("2022-section-2.2", "2022-alg-cross-entropy"),
        says="The elite share rho of a round's cheapest samples updates the Gaussian, until it is a delta function at the optimum.",
        differs="The elite is weighted by rank and fitted about the old mean: about its own the search stops early.",
        by=("ltlplan.paths.cross_entropy.gaussian.Search",), compute=cross_entropy,
    ),
)  # fmt: skip
