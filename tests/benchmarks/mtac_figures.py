"""The 2022 paper's Figures 10 to 16 and Section 5.2, as numbers.

    python -m tests.benchmarks.mtac_figures fig10      # or fig11 fig12 fig13 fig14 fig15 fig16 sizes; all without a name

Figures 14 and 15 are the two halves of one table, `tests.benchmarks.mtac race`. Run it from the repository's root.
"""

from __future__ import annotations

import sys

import numpy as np

import ltlplan
from ltlplan.mtac.agent_moves import World
from ltlplan.mtac.beam_search import Options
from ltlplan.mtac.decomposable_task import Reader
from ltlplan.mtac.offline import share_tasks
from ltlplan.online_mtac import cross_entropy as online
from ltlplan.paths.hoops import route
from ltlplan.paths.improvement import improved_path
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from tests.benchmarks.mtac import LENGTH, PRINTED, firefighting, race
from tests.helpers.benchmarks import run_benchmark
from tests.helpers.quantiles import quantile_samples
from verify import check_team
from verify.data import RobotPlan, Visit
from verify.data.language.word import show_letter

PAPER = Options(optimality_gap=False, every_robot=True)


def length(plan: RobotPlan) -> float:
    """Return the length of a planned path, m."""
    if len(plan.waypoints) < 2:
        return 0.0
    points = np.array([w.position for w in plan.waypoints])
    path = LeastSnapSpline(plan.times, plan.cycle_waypoint).sampling(np.linspace(plan.times[0], plan.times[-1], 4000)) @ points
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def fig10() -> None:
    """Words and paths that satisfy the fire-fighting formula, and what the checker says of the paper's own words."""
    mission = firefighting(PRINTED)
    found = share_tasks(mission, rng=np.random.default_rng(0), options=PAPER)
    for name, path in found.paths.items():
        visits = " ".join(v.region for v in path.plan.visits) or "(nothing)"
        print(f"  {name}: {visits:22} cost {path.plan.cost:.3f}  length {length(path.plan):.3f} m  {path.plan.word}")
    words = {name: path.plan.word for name, path in found.paths.items()}
    print(f"  ours, in every order: {check_team(mission.formula, words).sequential.outcome}")
    paper = {
        "quad0": [
            set(),
            {"water"},
            {"water", "carrying"},
            {"carrying"},
            {"smoke", "carrying"},
            {"carrying"},
            {"loc2", "carrying"},
        ],
        "quad1": [set(), {"smoke"}, set()],
        "quad2": [set(), {"water"}, {"water", "carrying"}, {"carrying"}, {"loc1", "carrying"}],
    }
    verdict = check_team(mission.formula, paper).sequential
    print(f"  the paper's (quad1 = {{SMOKE}} without water): {verdict.outcome}: {verdict.sentence}")


def fig11() -> None:
    """Best cost of each robot for one proposition (loc2) over 12 rounds of 50 paths: the printed cost, and length alone."""
    for title, weights in (("the printed cost", PRINTED), ("length alone", LENGTH)):
        mission = firefighting(weights)
        water = next(a for a in mission.robot.actions)
        visits = (Visit(region="water", actions=(water,)), Visit(region="smoke"), Visit(region="loc2"))
        for name in mission.agents:
            path = improved_path(mission, name, route(mission, name, visits), lambda: np.random.default_rng(0))
            rounds = " ".join(f"{cost:.3f}" for cost in path.history)
            print(f"  {title}, {name}: {rounds}   flown: {path.plan.cost:.3f}, length {length(path.plan):.3f} m")


def fig12() -> None:
    """Samples at the 0.05 quantile of N(mu, 0.05 I) around five means on the line to a hoop, at t = 0, 2, .., 10."""
    rng = np.random.default_rng(0)
    start, hoop = np.array([1.0, -0.5, 0.8]), np.array([0.35, -0.85, 0.9])
    means = start + np.linspace(0, 1, 7)[1:-1, None] * (hoop - start)
    chosen = online.OnlineSettings(elite=0.05, trajectories=50, floor=0.01)
    state = online.start(means[None], 0.05, rng, settings=chosen)
    for step in range(501):
        if step % 100 == 0:
            spread = []
            for mean, root in zip(state.mean[0], state.root[0], strict=True):
                drawn = quantile_samples(mean, root @ root.T, 0.05, 100, rng)
                spread.append(float(np.linalg.norm(drawn - mean, axis=1).mean()))
            length = float(np.linalg.norm(np.diff(np.vstack([start, state.mean[0], hoop]), axis=0), axis=1).sum())
            print(
                f"  t = {step / 50:4.1f} s: mean distance of samples from their means "
                + " ".join(f"{s:.3f}" for s in spread)
                + f" m, path {length:.3f} m"
            )
        paths = online.ask(state, rng)
        whole = np.concatenate([np.broadcast_to(start, (1, 1, 3)), paths, np.broadcast_to(hoop, (1, 1, 3))], axis=1)
        cost = np.linalg.norm(np.diff(whole, axis=1), axis=2).sum(axis=1)
        state = online.tell(state, paths, cost, np.ones(1, dtype=bool), settings=chosen)


def fig13() -> None:
    """Delta over 10 s at 50 Hz on the way to a hoop, for three pairs a, b."""
    for a, b in ((0.1, 0.01), (0.01, 0.001), (0.001, 0.0001)):
        rng = np.random.default_rng(1)
        chosen = online.OnlineSettings(weight=a, decay=b)
        start, hoop = np.array([1.0, -0.5, 0.8]), np.array([0.35, -0.85, 0.9])
        means = start + np.linspace(0, 1, 7)[1:-1, None] * (hoop - start)
        state = online.start(means[None], 0.05, rng, settings=chosen)
        values = []
        for step in range(501):
            if step % 50 == 0:
                values.append(float(state.step[0]))
            paths = online.ask(state, rng)
            cost = np.linalg.norm(
                np.diff(np.concatenate([np.broadcast_to(start, (1, 1, 3)), paths], axis=1), axis=1), axis=2
            ).sum(axis=1)
            state = online.tell(state, paths, cost, np.ones(1, dtype=bool), settings=chosen)
        print(f"  a = {a:<6} b = {b:<7} Delta at 0, 1, .., 10 s: " + " ".join(f"{v:.4f}" for v in values))


def fig14() -> None:
    """Summed cost, online against offline, 1 to 5 robots (the columns `cost`)."""
    print(next(line for line in race() if "Fig. 14" in line))


def fig15() -> None:
    """Run time, online against offline, 1 to 5 robots (the columns in s)."""
    print(next(line for line in race() if "Fig. 15" in line))


def fig16() -> None:
    """The experiment of Section 7 in simulation: words, time, tracking."""
    from ltlplan.online.simulated_online_flight import fly_online

    flight = fly_online(ltlplan.load_mission("firefighting"), seed=0, noise=0.001)
    for name, word in flight.words.items():
        print(f"  {name}: {' '.join(show_letter(letter) for letter in word)}")
    print(f"  {flight.summary()}")
    print(f"  worst distance from where the robots should have been: {1e3 * flight.log.worst_error():.1f} mm")


def online_plan() -> None:
    """Online MTAC-E as a planning method: simulated time, and the plan's cost."""
    mission = ltlplan.load_mission("firefighting")
    plan = ltlplan.plan(mission.changed(planner=mission.planner.model_copy(update={"method": "online-mtac-e"})), seed=0)
    print(f"  cost {plan.cost:.2f} m. {plan.notes[0]}")


def sizes() -> None:
    """Section 5.2: nodes of the team automaton T against those of the full product of all robots, from this mission."""
    mission = ltlplan.load_mission("firefighting")
    world = World(mission)
    reader = Reader(world)
    automaton = ltlplan.translate(mission.formula)
    vertices = (len(mission.all_regions) + 1) * len(mission.robot.states)
    states = len(automaton.states)
    for count in (1, 2, 3, 4, 5, 10, 100):
        print(
            f"  {count:3d} robots: T {count * states * vertices:6d} = N x {states} x {vertices} nodes, full product {states * vertices**count:.3g}"
        )
    print(f"  letters that one robot can show: {len(reader.shown)}")


FIGURES = {f.__name__: f for f in (fig10, fig11, fig12, fig13, fig14, fig15, fig16, online_plan, sizes)}


def main() -> None:
    """Print the figures that are asked for."""
    for chosen in sys.argv[1:] or [name for name in FIGURES if name != "fig15"]:
        print(f"{chosen}: {(FIGURES[chosen].__doc__ or '').strip()}")
        FIGURES[chosen]()


if __name__ == "__main__":
    run_benchmark(main)
