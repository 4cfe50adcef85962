"""The pictures of a mission's planning, in the spirit of the 2019 paper's Figs. 2 to 7, robot by robot."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import plotly.graph_objects as go

from ltlplan.hoops import route
from ltlplan.hoops.draw import control_point_figure, path_figure, primitives_figure, round_figure
from ltlplan.mtac import improved
from ltlplan.planner import generators, make_plan
from ltlplan.report.figures_page import figures_page

if TYPE_CHECKING:
    from verify.data import Mission

_NOTES = {
    "control points": "Each hoop has five: in front of it, in its centre, behind it, and two beside it to fly around it.",
    "motion primitives": "The path before it is optimised: each leg between two control points in the colour of its primitive.",
    "sampled paths": "Paths drawn at random around the current best; the cheapest of those that satisfy the mission lead the next round.",
    "optimised path": "The cheapest path that was found, with the nominal one (dashed) that it started from.",
}
"""What is seen, by a part of the figure's heading."""


def pictures_html(
    mission: Mission, *, seed: int | None = None, shown_round: int = 0, progress: Callable[[str, float], None] | None = None
) -> str:
    """Return one page: control points, primitives, the sampled paths of a round, the optimised path.

    The paths are those of the plan that `ltlplan plan` makes with the same seed.

    Args:
        mission: What is asked.
        seed: Source of every draw, instead of the mission's own.
        shown_round: Which round of cross-entropy to draw, from 0; the last one where there are fewer.
        progress: Told a sentence and the share done, 0 to 1.
    """
    figures: dict[str, go.Figure] = {"Hoops and their control points": control_point_figure(mission)}
    say = progress or (lambda _sentence, _share: None)
    used_seed = mission.planner.seed if seed is None else seed
    plan = make_plan(mission, seed=used_seed, progress=lambda sentence, share: say(sentence, 0.5 * share))
    sentences: list[str] = []
    for index, (name, rng) in enumerate(generators(mission, np.random.default_rng(used_seed)).items()):
        flown = plan.robots[name]
        if len(flown.waypoints) < 2:
            sentences.append(f"{name} stays at its start.")
            continue
        nominal = route(mission, name, flown.visits, flown.cycle_visit, word=flown.word)
        rounds: list[tuple[Any, Any]] = []

        def watch(_index: int, problem: Any, candidates: Any, costs: Any, rounds: list[tuple[Any, Any]] = rounds) -> None:
            if len(rounds) <= shown_round:
                rounds.append((problem.paths(candidates).position, np.isfinite(costs)))

        say(f"drawing the rounds of {name}", 0.5 + 0.4 * index / len(mission.agents))
        improved(mission, name, nominal, lambda own=rng: own, watch)
        figures[f"{name}: motion primitives along the nominal path"] = primitives_figure(mission, nominal)
        if rounds:
            positions, counts = rounds[-1]
            figures[f"{name}: sampled paths of round {len(rounds)}"] = round_figure(mission, positions, counts, best=flown)
        figures[f"{name}: optimised path"] = path_figure(mission, flown, nominal=nominal)
        sentences.append(f"{name}: nominal cost {nominal.cost:.3f}, after cross-entropy {flown.cost:.3f}.")
    asked = [f"Asks: {text}" for text in (mission.spec.formula, mission.sequence) if text is not None]
    notes = {heading: sentence for heading in figures for end, sentence in _NOTES.items() if end in heading}
    return figures_page(f"{mission.name}: planning", [*asked, *sentences], figures, notes=notes)
