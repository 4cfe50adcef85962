"""Algorithms 2 and 5 of the 2022 paper, and its Figs. 10, 11 and 16: tasks shared offline and online, and flown.

The paper minimises the integral of |eta| + |u| (Section 5.4): path length, and the acceleration u. That is used here, with length
beside it; the shipped mission minimises length alone.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from functools import cache

import numpy as np

from flight.pictures import scene
from ltlplan.missions import load_mission
from ltlplan.mtac.beam_search import Options
from ltlplan.mtac.offline import Shared, share_tasks
from ltlplan.mtac.optimality_gap import straight_cost
from ltlplan.online.online_flight import OnlineFlight
from ltlplan.online.simulated_online_flight import fly_online
from ltlplan.paths.hoops import route
from ltlplan.paths.improvement import improved_path
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from ltlplan.pipeline import certified_team
from ltlplan.replanning.checked_plan import plan
from ltlplan.report.hoop_figures import path_points
from ltlplan.reproduction.charts import lines
from ltlplan.reproduction.element import Chart, Element, Findings, Quantity, holds
from ltlplan.reproduction.hoops_flights import lengths
from ltlplan.search.exact import assign
from verify import check_team
from verify.data import Mission, Visit
from verify.data.language.word import show_letter

PRINTED = {"length": 1.0, "effort": 1.0}
"""Cost of the 2022 paper's Section 5.4 as printed: the integral of |eta| (path length, m) and of |u|, u the acceleration (m/s)."""
LENGTH = {"length": 1.0}
"""Cost of the shipped mission, m."""
PAPER = Options(optimality_gap=False, every_robot=True)
"""Algorithm 2 as printed optimises all robots again at each state."""
UNIT = "m + m/s"
"""Of the printed cost."""


def firefighting(cost: Mapping[str, float]) -> Mission:
    """Return the shipped mission with cost terms weighted as given.

    Args:
        cost: Weight of each term.
    """
    mission = load_mission("firefighting")
    return mission.changed(planner=mission.planner.model_copy(update={"cost": dict(cost)}))


@cache
def shared_offline() -> tuple[Shared, float]:
    """Return the fire-fighting team's tasks by Algorithm 2 under the printed cost, and the processor time, s."""
    begun = time.process_time()
    found = share_tasks(firefighting(PRINTED), rng=np.random.default_rng(0), options=PAPER)
    assert found is not None
    return found, time.process_time() - begun


def shared_words() -> Findings:
    """Share the fire-fighting tasks offline, and judge the paper's own words."""
    mission, (found, _) = firefighting(PRINTED), shared_offline()
    rows: list[Quantity] = []
    paper = {"quad0": "WATER SMOKE LOC2", "quad1": "SMOKE", "quad2": "WATER LOC1"}
    for name, path in found.paths.items():
        visits = " ".join(visit.region for visit in path.plan.visits) or "stays"
        rows.append(Quantity(f"{name}: visits", visits, paper=paper[name]))
        if path.plan.visits:
            rows.append(Quantity(f"{name}: cost", path.plan.cost, UNIT))
            rows.append(Quantity(f"{name}: length", lengths(path.plan)[0], "m"))
    words = {name: path.plan.word for name, path in found.paths.items()}
    visited = {
        "quad0": ["", "water", "water carrying", "carrying", "smoke carrying", "carrying", "loc2 carrying"],
        "quad1": ["", "smoke", ""],
        "quad2": ["", "water", "water carrying", "carrying", "loc1 carrying"],
    }
    printed = {name: [set(letter.split()) for letter in letters] for name, letters in visited.items()}
    rows.append(holds("our words satisfy the formula in every order", check_team(mission.formula, words).sequential))
    refused = check_team(mission.formula, printed).sequential.outcome
    rows.append(Quantity("the paper's words, in every order", refused, paper="a satisfying sequence"))
    paths = {name: path_points(path.plan) for name, path in found.paths.items() if len(path.plan.waypoints) > 1}
    chart = Chart("Paths of the three robots under the printed cost.", scene(mission, paths), scene=True)
    return Findings(tuple(rows), (chart,))


def printed_cost() -> Findings:
    """Integrate the printed cost of quad0's path at 20 000 instants, and compare it with what the search minimised."""
    found, _ = shared_offline()
    path = found.paths["quad0"].plan
    spline, points = LeastSnapSpline(path.times), np.array([waypoint.position for waypoint in path.waypoints])
    instants = np.linspace(path.times[0], path.times[-1], 20_000)
    place, speed, push = (np.linalg.norm(spline.evaluate(points, instants, order), axis=1) for order in range(3))
    length, effort = (float(np.trapezoid(values, instants)) for values in (speed, push))
    return Findings(
        (
            Quantity("length of eta", length, "m"),
            Quantity("integral of |u|, u the acceleration", effort, "m/s"),
            Quantity("both, as the search counts them", path.cost, UNIT),
            holds("to 1 % the same", abs(path.cost / (length + effort) - 1.0) < 0.01),
            Quantity("integral of the distance from the origin, as |eta| reads by itself", float(np.trapezoid(place, instants)), "m s"),
            Quantity("cost that would end the search early", firefighting(PRINTED).planner.target, UNIT, "lambda = 0", 0),
        )
    )  # fmt: skip


def offline_algorithm() -> Findings:
    """Check Algorithm 2's result against the exact search, and its time against the paper's."""
    found, seconds = shared_offline()
    mission = firefighting(LENGTH)
    ours, exact = straight_cost(mission, found.robots), assign(mission)
    return Findings(
        (
            Quantity("cost by straight lines over the cheapest", ours / exact.cost, digits=3),
            holds("the exact search proves its own cheapest", exact.complete),
            Quantity("paths optimised", found.tried, digits=0),
            Quantity("computing, three robots", seconds, "s", "about 300 s"),
        )
    )


def switches() -> Findings:
    """Check the switch transitions of the team that Algorithm 2 found."""
    mission, (found, _) = firefighting(PRINTED), shared_offline()
    starts = {name: agent.start for name, agent in mission.agents.items()}
    begins = {name: path.plan.waypoints[0].position for name, path in found.paths.items()}
    return Findings(
        (
            Quantity("order of the robots", " then ".join(found.order)),
            holds("no robot takes over from itself", len(set(found.order)) == len(found.order), "r_s != r_t"),
            holds("each begins at its own start", begins == starts, "s_t is the initial state of the new agent"),
            holds("tasks may be handed over there: the words hold in every order", check_team(mission.formula, {n: p.plan.word for n, p in found.paths.items()}).sequential, "q_s in D"),
        )
    )  # fmt: skip


def cost_over_rounds() -> Findings:
    """Optimise each robot's path to loc2 for 12 rounds, by the printed cost and by length."""
    rows: list[Quantity] = []
    curves: dict[str, tuple[float, ...]] = {}
    last: dict[str, float] = {}
    for title, weights, unit in (("printed cost", PRINTED, UNIT), ("length", LENGTH, "m")):
        mission = firefighting(weights)
        water = next(action for action in mission.robot.actions)
        visits = (Visit(region="water", actions=(water,)), Visit(region="smoke"), Visit(region="loc2"))
        for name in mission.agents:
            path = improved_path(mission, name, route(mission, name, visits), lambda: np.random.default_rng(0))
            history = path.history
            rows.append(Quantity(f"{name}: {title} after the first round", history[0], unit))
            rows.append(Quantity(f"{name}: {title} after round {len(history)}", history[-1], unit))
            if weights is PRINTED:
                last[name] = history[-1]
                curves[name] = history
    chart = lines(
        "Best cost of each robot for loc2 over 12 rounds, by the printed cost.",
        range(1, 13),
        curves,
        ("round", f"best cost ({UNIT})"),
    )
    cheapest = min(last, key=lambda name: last[name])
    return Findings(
        (*rows, Quantity("robot selected for loc2", cheapest, paper="quad2")),
        (chart,),
    )  # fmt: skip


@cache
def flown_online() -> OnlineFlight:
    """Return the fire-fighting mission flown online in simulation."""
    return fly_online(load_mission("firefighting"), seed=0, noise=0.001)


def experiment() -> Findings:
    """Fly Section 7's experiment in simulation."""
    flight = flown_online()
    rows = [
        Quantity(f"{name}: word as flown", " ".join(show_letter(letter) for letter in word))
        for name, word in flight.words.items()
    ]
    rows += [
        Quantity("flight", flight.duration, "s", "127 s"),
        Quantity("formula satisfied after", flight.satisfied_at or float("nan"), "s"),
        Quantity("worst tracking error", 1e3 * flight.log.worst_error(), "mm", digits=1),
        holds("the checker's verdict on the flown words", flight.verdict, "satisfied"),
    ]
    paths = {name: flight.log.position[::5, index] for index, name in enumerate(flight.log.robots)}
    chart = Chart("Flown paths of the three robots.", scene(flight.mission, paths), scene=True)
    return Findings(tuple(rows), (chart,))


def online_algorithm() -> Findings:
    """Check Algorithm 5's flag, its assignments and its rate on the same flight."""
    flight = flown_online()
    satisfied = flight.satisfied_at or float("inf")
    return Findings(
        (
            holds("satisfied_ltl becomes True, and the flight ends after it", satisfied <= flight.duration),
            Quantity("cost at the end over that at take-off", flight.final_cost / flight.planned_cost, digits=3),
            Quantity("computing of a step, median", 1e3 * float(np.median(flight.step_seconds)), "ms", "50 Hz: below 20 ms"),
        )
    )


def planned_online() -> Findings:
    """Plan the mission by online MTAC-E in simulated time, and certify what came of it."""
    mission = load_mission("firefighting")
    made = plan(mission.changed(planner=mission.planner.model_copy(update={"method": "online-mtac-e"})), seed=0)
    done = certified_team(made)
    return Findings(
        (
            Quantity("length", made.cost, "m"),
            Quantity("rounds of refinement until certified", done.rounds, digits=0),
            holds("certified for all times", done.certificate.holds),
        )
    )


TEAM_FLIGHTS: tuple[Element, ...] = (
    Element(
        id="2022-section-5.4", publication="2022", kind="equation", title="Section 5.4: the cost", also=("2022-cost",), shares="2022-fig-10",
        says="J is the integral of |eta| + |u| over the flight, path length and input.",
        differs="|eta| is read as the text has it, path length: by itself it is the distance from the origin, which no path could make short.",
        by=("ltlplan.paths.cost_terms.length", "ltlplan.paths.cost_terms.effort"), compute=printed_cost,
    ),
    Element(
        id="2022-alg-2", publication="2022", kind="algorithm", title="Algorithm 2: MTAC-E", also=("2022-solution-5.1",), shares="2022-fig-10",
        says="Walk the team automaton; where a state decomposes, the robot with the lowest optimised cost goes on.",
        differs="A lower bound on what is left guides three walks side by side; from six tasks on, tasks are shared in tours.",
        by=("ltlplan.mtac.offline.share_tasks", "ltlplan.mtac.beam_search.BeamSearch"), compute=offline_algorithm,
    ),
    Element(
        id="2022-def-4.7", publication="2022", kind="definition", title="Definition 4.7: switch transitions", shares="2022-fig-10",
        says="A switch hands the state of the automaton to the next robot, which begins at its initial state, in the decomposition set.",
        differs="Any robot that has not flown may take over, not the next one only; a walk counts if its words hold in every order.",
        by=("ltlplan.mtac.beam_search.BeamSearch", "ltlplan.mtac.decomposable_task.Reader.in_decomposition_set"), compute=switches,
    ),
    Element(
        id="2022-fig-10", publication="2022", kind="figure", title="Fig. 10 and Problem 4.1: words and paths of three robots", also=("2022-problem-4.1",), shares="2022-fig-10",
        says="quad0 flies WATER SMOKE LOC2, quad1 SMOKE, quad2 WATER LOC1, which satisfies the formula.",
        differs="The paper's quad1 carries no water into smoke: the checker rejects it in the order quad1, quad0, quad2.",
        by=("ltlplan.mtac.offline.share_tasks", "verify.trace_checking.team_verdict.check_team"), compute=shared_words,
    ),
    Element(
        id="2022-fig-11", publication="2022", kind="figure", title="Fig. 11: cost over 12 rounds",
        says="The cost of each robot's path to LOC2 falls over 12 rounds, and quad2 is selected.",
        differs="quad0 is the cheapest here, as hoops stood elsewhere there.",
        by=("ltlplan.paths.improvement.improved_path",), compute=cost_over_rounds,
    ),
    Element(
        id="2022-alg-5", publication="2022", kind="algorithm", title="Algorithm 5: online MTAC-E", shares="2022-fig-16",
        says="At 50 Hz, tasks are assigned and switched, paths sampled and poses returned, until the formula is satisfied.",
        differs="A robot enters a region only if the team can still finish in some order, and glides to cheaper paths.",
        by=("ltlplan.online_mtac.online_team.OnlineTeam",), compute=online_algorithm,
    ),
    Element(
        id="2022-fig-16", publication="2022", kind="figure", title="Section 7 and Fig. 16: the experiment", also=("2022-section-7",), shares="2022-fig-16",
        says="Three Crazyflies satisfy the formula online in 127 s.",
        differs="Flown in simulation at 0.45 m/s nominal, on paths of a few metres; the paper says neither its speed nor its waits.",
        by=("ltlplan.online.simulated_online_flight.fly_online",), compute=experiment,
    ),
    Element(
        id="2022-online-plan", publication="2022", kind="section", title="Online MTAC-E as a planning method",
        says="Trajectories are generated online; nothing is proved of them.",
        differs="`planner.method: online-mtac-e` makes a plan of what was flown in simulated time, which is refined and certified.",
        by=("ltlplan.online_mtac.planning_method", "ltlplan.pipeline.certified_team"), compute=planned_online,
    ),
)  # fmt: skip
