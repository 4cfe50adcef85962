"""Scenarios and figures of the 2019 paper: sequences, lengths of prefix and cycle before and after cross-entropy, flights.

The paper gives no hoop positions; those of the shipped missions are ours, so lengths compare with the paper's bounds only.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import groupby

import numpy as np

from ltlplan.missions import load_mission
from ltlplan.paths.costs import Cost, SampledPaths, WeightedCost
from ltlplan.paths.cross_entropy.cross_entropy import Improvement, Options, improve
from ltlplan.paths.hoops import route, route_sequence, segments
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from ltlplan.paths.sampling.path_problem import PathProblem
from ltlplan.pipeline import run
from ltlplan.reproduction.element import Chart, Element, Findings, Quantity, holds
from ltlplan.result import Result
from ltlplan.search.exact import assign
from verify import check_word
from verify.data import Mission, RobotPlan
from verify.data.arrays import Floats
from verify.data.mission import check_mission
from verify.data.shapes.region import Hoop

LIMIT = 5.0
"""m for prefix and suffix each (2019 paper, Scenario 4.3)."""
SEARCH = Options(samples=200, rounds=60)
"""Cross-entropy of the scenarios without a limit."""
SEEDS = 3
"""Searches under the limit."""


def lengths(plan: RobotPlan) -> tuple[float, float | None]:
    """Return the length of the prefix and of one lap, in m; no lap for a finite flight."""
    spline = LeastSnapSpline(plan.times, plan.cycle_waypoint)
    points = np.array([w.position for w in plan.waypoints])

    def along(begin: float, end: float) -> float:
        return float(np.linalg.norm(np.diff(spline.sampling(np.linspace(begin, end, 4000)) @ points, axis=0), axis=1).sum())

    if plan.cycle_waypoint is None:
        return along(plan.times[0], plan.times[-1]), None
    split = plan.times[plan.cycle_waypoint]
    return along(plan.times[0], split), along(split, plan.times[-1])


@cache
def nominal_path(name: str) -> RobotPlan:
    """Return the path of a shipped mission of one robot before it is optimised.

    Args:
        name: The mission's.
    """
    mission = load_mission(name)
    if mission.passages is not None:
        return route_sequence(mission)
    itinerary = assign(mission).robots["quad0"]
    return route(mission, "quad0", itinerary.visits, itinerary.cycle_visit, word=itinerary.word)


@cache
def shortest_path(name: str) -> RobotPlan:
    """Return the same path after cross-entropy has made it short.

    Args:
        name: The mission's.
    """
    rng, cost = np.random.default_rng(0), WeightedCost.of({"length": 1.0})
    return improve(load_mission(name), "quad0", nominal_path(name), rng=rng, options=SEARCH, cost=cost).plan


@cache
def flown(name: str) -> Result:
    """Return a shipped mission as `ltlplan run` plans, certifies and flies it.

    Args:
        name: The mission's.
    """
    return run(load_mission(name))


def wide_course() -> Mission:
    """Return the published run of Scenario 4.2 on a course whose control points lie far out, so that the nominal lap is above 5 m."""
    mission = load_mission("hoops-published")
    places = {
        "hoop0": {"center": (1.0, 0.8, 1.0)},
        "hoop1": {"center": (0.9, -0.8, 1.0)},
        "hoop2": {"center": (-0.2, 0.0, 1.0), "yaw_deg": 180.0, "reach": 1.1, "clearance": 1.1},
    }
    hoops = {
        name: Hoop.model_validate({**hoop.model_dump(exclude={"matrix", "normal"}), **places[name]})
        for name, hoop in mission.hoops.items()
    }
    return check_mission(mission.model_copy(update={"name": "hoops-wide", "hoops": hoops}))


def longer_segment(plan: RobotPlan) -> Cost:
    """Return the cost J of Scenario 4.3 for each segment by itself: the length of the longer one of prefix and suffix, m."""
    assert plan.cycle_waypoint is not None
    share = (plan.times[plan.cycle_waypoint] - plan.times[0]) / (plan.times[-1] - plan.times[0])

    def cost(paths: SampledPaths) -> Floats:
        steps = np.linalg.norm(np.diff(paths.position, axis=1), axis=2)
        begun = np.clip(share * steps.shape[1] - np.arange(steps.shape[1]), 0.0, 1.0)  # share of each step before the cycle
        return np.maximum((steps * begun).sum(axis=1), (steps * (1.0 - begun)).sum(axis=1))

    return cost


@dataclass(eq=False)
class FirstRound:
    """Sampled paths of a search's first round.

    Attributes:
        positions: m. Shape (paths, instants, 3).
        counts: Which of them satisfy the specification. Shape (paths,).
    """

    positions: Floats | None = None
    counts: Floats | None = None

    def watch(self, index: int, problem: PathProblem, candidates: Floats, costs: Floats) -> None:
        """Take note of the round.

        Args:
            index: Its number, from 0.
            problem: Of the search.
            candidates: That were drawn.
            costs: Theirs; infinite where one does not count.
        """
        if index == 0:
            self.positions, self.counts = problem.paths(candidates).position, np.isfinite(costs)


@cache
def under_the_limit(seed: int, rounds: int = 60, samples: int = 50) -> tuple[RobotPlan, Improvement, FirstRound]:
    """Search for a path on the wide course whose prefix and suffix are at most 5 m each; return the nominal path and what was found.

    Args:
        seed: Of the draws.
        rounds: At most this many.
        samples: Of each round.
    """
    mission, seen = wide_course(), FirstRound()
    nominal = route_sequence(mission)
    options = Options(samples=samples, rounds=rounds, target=LIMIT)
    rng, cost = np.random.default_rng(seed), longer_segment(nominal)
    return nominal, improve(mission, "quad0", nominal, rng=rng, options=options, cost=cost, watch=seen.watch), seen


def given_sequence() -> Findings:
    """Fly the sequence of Scenario 4.1."""
    from ltlplan.report.hoop_figures import path_figure

    result, short = flown("hoops-sequence"), shortest_path("hoops-sequence")
    nominal = nominal_path("hoops-sequence")
    passages = " ".join(f"{visit.region}{visit.direction or ''}" for visit in result.plan.robots["quad0"].visits)
    end = result.team["quad0"].evaluate([result.certificate.duration])[0, :3]
    chart = path_figure(result.mission, short, nominal=nominal)
    return Findings(
        (
            Quantity("passages", passages, paper="hoop0F hoop1F hoop2F hoop1R"),
            Quantity("distance from the final waypoint at the end", 1e3 * float(np.linalg.norm(end - np.array(result.mission.agents["quad0"].end))), "mm"),
            Quantity("nominal length", lengths(nominal)[0], "m"),
            Quantity("length after 60 rounds of 200 samples", lengths(short)[0], "m"),
            Quantity("nominal speed", result.mission.planner.speed, "m/s", "0.45 m/s"),
            holds("certified for all times", result.certificate.holds),
        ),
        (Chart("Scenario 4.1: the nominal path (dashed) and the optimised one.", chart, scene=True),),
    )  # fmt: skip


def primitives_drawn() -> Findings:
    """Name the primitive of each segment of Scenario 4.1's nominal path."""
    from ltlplan.report.hoop_figures import primitives_figure

    mission, nominal = load_mission("hoops-sequence"), nominal_path("hoops-sequence")
    found = segments(mission, nominal)
    kinds = [(kind, len(list(own))) for kind, own in groupby(found, key=lambda each: each.kind)]
    timed = sum(each.time(mission.planner.speed) for each in found)
    chart = primitives_figure(mission, nominal)
    return Findings(
        (
            Quantity("primitives along the path", ", ".join(f"{count} {kind}" for kind, count in kinds), paper="S_CURVE, STRAIGHT, U_TURN, TURN"),
            Quantity("sum of their lengths", sum(each.length for each in found), "m"),
            Quantity("sum of their times at the nominal speed", timed, "s"),
            holds("the path's times are these, and at most 2 s more at its ends", -1e-6 <= nominal.times[-1] - timed <= 2.0),
        ),
        (Chart("Scenario 4.1's nominal path, each segment in the colour of its primitive.", chart, scene=True),),
    )  # fmt: skip


def trajectory_labels() -> Findings:
    """Read the sequence of hoops off the simulated flight of Scenario 4.1."""
    result = flown("hoops-sequence")
    seen = [letter for (letter,) in result.log.letters]
    changes = [letter for before, letter in zip([frozenset[str](), *seen], seen, strict=False) if letter != before]
    visited = [" and ".join(sorted(letter)) for letter in changes if letter]
    planned = [visit.region for visit in result.plan.robots["quad0"].visits]
    return Findings(
        (
            Quantity("k(eta) of the simulated flight", " ".join(visited), paper="hoop0 hoop1 hoop2 hoop1"),
            holds("the planned visits in their order", visited == planned),
            holds("the certificate proves each visit for all times", result.certificate.holds),
        )
    )


def from_a_formula() -> Findings:
    """Fly the published run of Scenario 4.2 and judge it by the published formula."""
    from ltlplan.report.hoop_figures import path_figure

    result, nominal, short = flown("hoops-published"), nominal_path("hoops-published"), shortest_path("hoops-published")
    word = result.plan.words["quad0"]
    verdict = check_word(result.mission.formula, word)
    before, after = lengths(nominal), lengths(short)
    chart = path_figure(result.mission, short, nominal=nominal)
    return Findings(
        (
            Quantity("run as flown", str(word), paper="(hoop1)(hoop2)^w"),
            holds("it satisfies the formula", verdict),
            holds("the checker says that it does so vacuously", bool(verdict.vacuous)),
            Quantity("prefix, nominal", before[0], "m"),
            Quantity("lap, nominal", before[1] or 0.0, "m"),
            Quantity("prefix after 60 rounds of 200 samples", after[0], "m"),
            Quantity("lap after 60 rounds of 200 samples", after[1] or 0.0, "m"),
            holds("certified for ever", result.certificate.holds),
        ),
        (
            Chart(
                "The published run: prefix and cycle of the optimised path, over the nominal one (dashed).", chart, scene=True
            ),
        ),
    )


def patrolled() -> Findings:
    """Fly Scenario 4.2 as its prose has it."""
    from ltlplan.report.hoop_figures import path_figure

    result, nominal, short = flown("hoops-ltl"), nominal_path("hoops-ltl"), shortest_path("hoops-ltl")
    chart = path_figure(result.mission, short, nominal=nominal)
    return Findings(
        (
            Quantity("run as flown", str(result.plan.words["quad0"])),
            Quantity("lap, nominal", lengths(nominal)[1] or 0.0, "m"),
            Quantity("lap after 60 rounds of 200 samples", lengths(short)[1] or 0.0, "m"),
            holds("certified for ever", result.certificate.holds),
        ),
        (Chart("The patrol: hoop2 before hoop1 after each visit of hoop0.", chart, scene=True),),
    )


def short_segments() -> Findings:
    """Search for paths whose prefix and suffix are at most 5 m each, from several seeds."""
    from ltlplan.report.hoop_figures import path_figure

    rows: list[Quantity] = []
    found = [under_the_limit(seed) for seed in range(SEEDS)]
    nominal = lengths(found[0][0])
    rows += [Quantity("prefix, nominal", nominal[0], "m", "below 5 m at once")]
    rows += [Quantity("suffix, nominal", nominal[1] or 0.0, "m", "above 5 m at first")]
    for seed, (_, improvement, _) in enumerate(found):
        longer = max(length or 0.0 for length in lengths(improvement.plan))
        rows.append(Quantity(f"longer segment, seed {seed}", longer, "m", "at most 5 m"))
        rows.append(Quantity(f"rounds of 50 samples, seed {seed}", len(improvement.history), paper="several samples", digits=0))
    chart = path_figure(wide_course(), found[0][1].plan, nominal=found[0][0])
    return Findings(
        (*rows, holds("at most 5 m each from every seed", all(max(length or 0.0 for length in lengths(each[1].plan)) <= LIMIT + 0.01 for each in found))),
        (Chart("A path whose prefix and suffix are at most 5 m each, over the nominal one (dashed).", chart, scene=True),),
    )  # fmt: skip


def sampled_round() -> Findings:
    """Look at the sampled paths of the first round of the same search."""
    from ltlplan.report.hoop_figures import round_figure

    _, improvement, seen = under_the_limit(0)
    assert seen.positions is not None
    assert seen.counts is not None
    counts = seen.counts.astype(bool)
    chart = round_figure(wide_course(), seen.positions, counts, best=improvement.plan)
    return Findings(
        (
            Quantity("sampled paths of the round", len(counts), digits=0),
            Quantity("share that satisfies the specification", float(np.mean(counts))),
            holds(
                "all sampled suffixes are above 5 m in this round",
                improvement.history[0] > LIMIT,
                "several samples of the suffix",
            ),
        ),
        (Chart("Sampled paths of the first round: those that satisfy the specification in colour.", chart, scene=True),),
    )


def experiment() -> Findings:
    """Fly Scenario 4.1 in simulation, by what a Crazyflie has on board."""
    log = flown("hoops-sequence").log
    return Findings(
        (
            holds("the flight stays in its tube", log.tube == "inside"),
            Quantity("worst distance from the plan", 1e3 * log.worst_error(), "mm", digits=1),
            Quantity("flight time", float(log.times[-1] - log.times[0]), "s"),
        )
    )


HOOPS_FLIGHTS: tuple[Element, ...] = (
    Element(
        id="2019-fig-3", publication="2019", kind="figure", title="Fig. 3: trajectory segments", also=("2022-fig-3",), shares="2019-fig-4",
        says="Each leg between two control points is one of four curves.",
        differs="First and last segment get up to 1 s more, so that the robot does not turn back inside the first hoop.",
        by=("ltlplan.paths.hoops.sequencer.segments",), compute=primitives_drawn,
    ),
    Element(
        id="2019-fig-4", publication="2019", kind="scenario", title="Scenario 4.1 and Fig. 4: a given sequence", also=("2019-scenario-4.1",),
        says="The quadcopter flies hoop0F hoop1F hoop2F hoop1R and ends at a final waypoint, at 0.45 m/s.",
        differs="Hoop positions are ours; the caption of Fig. 4 begins with hoop1F, the text with hoop0F, which is flown here.",
        by=("ltlplan.paths.hoops.sequencer.route_sequence", "ltlplan.pipeline.run"), compute=given_sequence,
    ),
    Element(
        id="2019-def-3", publication="2019", kind="definition", title="Definition 3: labelling of a trajectory", also=("2022-def-3.2",), shares="2019-fig-4",
        says="k(eta) is the sequence of hoops that a trajectory visits.",
        differs="Letters of free flight are read, too, so that words say when no hoop is visited.",
        by=("verify.certification.certify", "ltlplan.pipeline.run"), compute=trajectory_labels,
    ),
    Element(
        id="2019-fig-5", publication="2019", kind="scenario", title="Scenario 4.2 and Fig. 5: a formula's run", shares="2019-fig-5",
        also=("2019-scenario-4.2", "2022-fig-4", "2022-problem-3.1"),
        says="G(F hoop0 -> !hoop1 U hoop2 & F hoop1) gives the run (hoop1)(hoop2)^w.",
        differs="The run holds vacuously: hoop0 is never visited, which the checker says.",
        by=("ltlplan.pipeline.run", "verify.trace_checking.word_verdict.check_word"), compute=from_a_formula,
    ),
    Element(
        id="2019-prose", publication="2019", kind="scenario", title="Scenario 4.2 as its prose has it", also=("2019-scenario-4.2-prose",),
        says="Flying through hoop0 implies that hoop2 is flown through before hoop1, and that hoop1 is reached in the end.",
        differs="Not flown in the paper: the obligation is grouped as the prose has it, and hoop0 is visited again and again.",
        by=("ltlplan.search.exact.assign", "ltlplan.pipeline.run"), compute=patrolled,
    ),
    Element(
        id="2019-fig-6", publication="2019", kind="figure", title="Fig. 6: sampled paths of a round", also=("2022-fig-5",), shares="2019-fig-7",
        says="The prefix was short enough at once; several samples of the suffix were needed.",
        differs="A sample counts only if its word holds with every region shrunk and grown by the margin.",
        by=("ltlplan.paths.cross_entropy.cross_entropy.improve",), compute=sampled_round,
    ),
    Element(
        id="2019-fig-7", publication="2019", kind="scenario", title="Scenario 4.3 and Fig. 7: prefix and suffix of at most 5 m",
        also=("2019-scenario-4.3", "2022-fig-6", "2022-example-1", "2022-problem-3.2", "2022-solution-3.2"),
        says="After optimisation prefix and suffix are at most 5 m long each.",
        differs="The shipped course is short at once, so that control points of this one lie 1.1 m from hoop2; the path found is judged for all times.",
        by=("ltlplan.paths.cross_entropy.cross_entropy.improve",), compute=short_segments,
    ),
    Element(
        id="2019-fig-8", publication="2019", kind="figure", title="Fig. 8: the experiment", shares="2019-fig-4",
        says="Crazyflies fly the sequence in the Robotarium.",
        differs="Flown in simulation here, by the model of what a Crazyflie has on board; the paper gives no errors.",
        by=("flight.flights.fly",), compute=experiment,
    ),
)  # fmt: skip
