"""The pictures of a mission's planning, in the spirit of the 2019 paper's Figs. 2 to 7, robot by robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flight.figures import Figure
from ltlplan.paths.hoops import route
from ltlplan.paths.improvement import improved_path
from ltlplan.planner import generators, make_plan
from ltlplan.report.hoop_figures import control_point_figure, path_figure, path_points, primitives_figure, round_figure
from ltlplan.report.page import figure_place, listed, page_html, section, warning
from ltlplan.report.views import VIEWS, clearance_sentences, views_html
from verify.data import BadInput
from verify.data.progress import Progress

if TYPE_CHECKING:
    from ltlplan.paths.sampling.path_problem import PathProblem
    from verify.data import Mission

Floats = NDArray[np.float64]

MOST_SAMPLED_POINTS = 8_500
"""Points of all sampled paths of a page together: where robots are many or paths long fewer paths are drawn, so that it can be sent."""

_NOTES = {
    "control points": "Each hoop has five: in front of it, in its centre, behind it, and two beside it to fly around it.",
    "motion primitives": "The path before it is optimised: each leg between two control points in the colour of its primitive.",
    "sampled paths": "Paths drawn at random around the current best; the cheapest of those that satisfy the mission lead the next round. Some of them are drawn.",
    "optimised path": "The cheapest path that was found, with the nominal one (dashed) that it started from.",
}
"""What is seen, by a part of the figure's heading."""


def pictures_html(
    mission: Mission, *, seed: int | None = None, shown_round: int | None = None, progress: Progress | None = None
) -> str:
    """Return one page: control points, primitives, the sampled paths of a round, the optimised path.

    The paths are those of the plan that `ltlplan plan` makes with the same seed.

    Args:
        mission: What is asked.
        seed: Source of every draw, instead of the mission's own.
        shown_round: Which round of cross-entropy to draw, from 1 as they are counted everywhere; the first one by default.
        progress: Receives a sentence and the share done, 0 to 1.

    Raises:
        BadInput: There is no such round.
    """
    _check_round(mission, shown_round)
    paths: dict[str, Floats] = {}
    figures: dict[str, Figure] = {"Hoops and their control points": control_point_figure(mission)}
    say = progress or (lambda _sentence, _share: None)
    used_seed = mission.planner.seed if seed is None else seed
    plan = make_plan(mission, seed=used_seed, progress=lambda sentence, share: say(sentence, 0.5 * share))
    sentences: list[str] = []
    flown_rounds: dict[str, int] = {}
    for index, (name, rng) in enumerate(generators(mission, np.random.default_rng(used_seed)).items()):
        flown = plan.robots[name]
        if len(flown.waypoints) < 2:
            sentences.append(f"{name} stays at its start.")
            continue
        nominal = route(mission, name, flown.visits, flown.cycle_visit, word=flown.word)
        seen = _Rounds(shown_round or 1)
        say(f"drawing the rounds of {name}", 0.5 + 0.4 * index / len(mission.agents))
        improved_path(mission, name, nominal, lambda own=rng: own, seen.watch)
        flown_rounds[name] = seen.count
        figures[f"{name}: motion primitives along the nominal path"] = primitives_figure(mission, nominal)
        if seen.positions is not None:
            heading = f"{name}: sampled paths of round {seen.drawn}"
            figures[heading] = round_figure(
                mission, seen.positions, seen.counts, best=flown, most_points=MOST_SAMPLED_POINTS // len(mission.agents)
            )
            if shown_round is not None and seen.drawn < shown_round:
                sentences.append(f"{name}: its search ended after {seen.count} rounds, the last of which is drawn.")
        paths[name] = path_points(flown)
        figures[f"{name}: optimised path"] = path_figure(mission, flown, nominal=nominal)
        sentences.append(f"{name}: nominal cost {nominal.cost:.3f}, after cross-entropy {flown.cost:.3f}.")
    if shown_round is not None and max(flown_rounds.values(), default=0) < shown_round:
        counts = ", ".join(f"{name} {count}" for name, count in flown_rounds.items()) or "no robot flies"
        raise BadInput(f"There is no round {shown_round} to draw; the rounds that were needed: {counts}.")
    return _page(mission, [*_asked(mission), *sentences], figures, paths)


def mission_html(mission: Mission, sentence: str) -> str:
    """Return the page of a mission that has no plan: from above, from two sides, its control points, and why.

    Args:
        mission: What is asked.
        sentence: Why there is no plan.
    """
    return _page(mission, _asked(mission), {"Hoops and their control points": control_point_figure(mission)}, {}, why=sentence)


def _asked(mission: Mission) -> list[str]:
    asked = [f"Asks: {text}" for text in (mission.spec.formula, mission.sequence) if text is not None]
    return asked + [f"Wishes for: {part.formula} (weight {part.weight:g})" for part in mission.soft_parts]


class _Rounds:
    """Keeps one round of a search, or its last one where there are fewer."""

    def __init__(self, wanted: int) -> None:
        self.wanted, self.count, self.drawn = wanted, 0, 0
        self.positions: Floats | None = None
        self.counts: NDArray[np.bool_] = np.zeros(0, dtype=np.bool_)

    def watch(self, index: int, problem: PathProblem, candidates: Floats, costs: Floats) -> None:
        """Take note of a round; a search that begins anew counts from its own first round."""
        self.count = index + 1
        if index < self.wanted:
            self.drawn = index + 1
            self.positions, self.counts = problem.paths(candidates).position, np.isfinite(costs)


def _check_round(mission: Mission, shown_round: int | None) -> None:
    """Reject a round that no search of this mission can reach, before minutes of work."""
    most = mission.planner.iterations
    if shown_round is not None and not 1 <= shown_round <= most:
        right = f"choose 1 to {most}" if most else "there is none to draw"
        raise BadInput(
            f"round {shown_round}: cross-entropy has {most} rounds here (planner.iterations), counted from 1; {right}."
        )


def _page(
    mission: Mission, sentences: list[str], figures: Mapping[str, Figure], paths: Mapping[str, Floats], why: str = ""
) -> str:
    sections: list[str] = []
    for index, heading in enumerate(figures):
        note = next(sentence for end, sentence in _NOTES.items() if end in heading)
        sections.append(section(heading, figure_place(f"figure{index}", f"{heading}. {note}", scene=True), note=note))
    seen = views_html(mission, paths) + listed(clearance_sentences(mission))
    sections.insert(1, section("From above and from two sides", seen, note=VIEWS))
    for figure in figures.values():
        figure.layout.pop("title", None)  # the section has it
    return page_html(
        f"{mission.name}: planning",
        header=(warning(why) if why else "") + listed(sentences),
        sections=sections,
        figures={f"figure{index}": figure for index, figure in enumerate(figures.values())},
    )
