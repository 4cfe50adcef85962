"""Formulas of the 2019 paper's introduction, directions of hoops, and the controller that flies the sequence."""

from __future__ import annotations

import numpy as np

from flight import fly
from ltlplan.missions import load_mission
from ltlplan.paths.hoops import control_points, route
from ltlplan.paths.hoops.passage_directions import Directions
from ltlplan.pipeline import certified_team
from ltlplan.replanning.checked_plan import plan
from ltlplan.reproduction.element import Element, Findings, Quantity, holds
from ltlplan.reproduction.hoops_flights import flown
from ltlplan.search.exact import assign
from verify import check_word
from verify.data import Mission, Visit, Word

BEFORE = "!hoop2 U (hoop0 | hoop1) & F hoop2"
"""Visit hoop0 or hoop1 before hoop2."""
NEVER = "G !hoop1"
"""Avoid hoop1 at all times."""


def on_the_patrol_course(formula: str) -> Mission:
    """Return the shipped patrol's hoops with a formula on finite words.

    Args:
        formula: What is asked.
    """
    mission = load_mission("hoops-ltl")
    return mission.changed(spec=mission.spec.model_copy(update={"formula": formula, "trace": "finite", "repeat": 1}))


def introduced() -> Findings:
    """Plan and certify the two formulas of Section I."""
    rows: list[Quantity] = []
    for formula in (BEFORE, f"F hoop0 & F hoop2 & {NEVER}"):
        made = plan(on_the_patrol_course(formula))
        visits = " ".join(visit.region for visit in made.robots["quad0"].visits)
        rows.append(Quantity(f"{formula}: visits", visits))
        rows.append(holds(f"{formula}: certified for all times", certified_team(made).certificate.holds))
    first, second = (Word((frozenset(), frozenset({name}), frozenset())) for name in ("hoop2", "hoop1"))
    rows.append(holds("hoop2 without hoop0 or hoop1 before it is rejected", not check_word(BEFORE, first)))
    rows.append(holds("a visit of hoop1 is rejected", not check_word(NEVER, second)))
    return Findings(tuple(rows))


def nearest_sides(mission: Mission, visits: tuple[Visit, ...]) -> str:
    """Return hoops with the directions in which their nearest control points lead, as Section III-B has it.

    Args:
        mission: Whose hoops are visited, from the start of `quad0` on.
        visits: The hoops in their order.
    """
    position, sides = np.array(mission.agents["quad0"].start), ""
    for visit in visits:
        points = control_points(mission.hoops[visit.region])
        ends = {"F": (points.rear, points.front), "R": (points.front, points.rear)}
        side = min(ends, key=lambda name: float(np.linalg.norm(ends[name][0] - position)))
        position, sides = ends[side][1], f"{sides} {visit.region}{side}"
    return sides.strip()


def directions() -> Findings:
    """Compare the directions in which the patrol's hoops are flown with those of their nearest control points."""
    mission = load_mission("hoops-ltl")
    itinerary = assign(mission).robots["quad0"]
    visits = tuple(Visit(region=visit.region) for visit in itinerary.visits)
    rows: list[Quantity] = []
    choices: dict[str, Directions] = {"nearest control point": "nearest", "shortest whole sequence": "cheapest"}
    for title, choice in choices.items():
        path = route(mission, "quad0", visits, itinerary.cycle_visit, directions=choice, word=itinerary.word)
        rows.append(
            Quantity(f"directions by the {title}", " ".join(f"{visit.region}{visit.direction}" for visit in path.visits))
        )
    same = rows[0].ours == nearest_sides(mission, visits)
    return Findings((*rows, holds("the first are those of a loop over control points", same, "the closest control point")))


def followed() -> Findings:
    """Fly Scenario 4.1 with the printed controller, on the printed model."""
    result = flown("hoops-sequence")
    joints = [claim for claim in result.certificate.claims if claim.name == "continuity"]
    log = fly(result.plan, result.team, result.certificate, controller="paper", model="paper")
    return Findings(
        (
            holds("the trajectory is three times continuously differentiable", bool(joints) and all(claim.outcome == "holds" for claim in joints), "eta in C^3"),
            holds("the flight with the printed controller stays in its tube", log.tube == "inside"),
            Quantity("worst distance from the plan", 1e3 * log.worst_error(), "mm", digits=1),
        )
    )  # fmt: skip


HOOPS_SEQUENCES: tuple[Element, ...] = (
    Element(
        id="2019-introduction", publication="2019", kind="section", title="Section I: two formulas",
        says='"Visit hoop0 or hoop1 before hoop2" and "avoid hoop1 at all times", as formulas.',
        differs="Not flown in the paper; the second is asked beside two visits, as staying satisfies it alone.",
        by=("ltlplan.replanning.checked_plan.plan", "ltlplan.pipeline.certified_team"), compute=introduced,
    ),
    Element(
        id="2019-directions", publication="2019", kind="algorithm", title="Section III-B: LTL_TO_SEQUENCE, directions of hoops", also=("2022-directions", "2022-solution-3.1"),
        says="Each hoop is flown from the side whose control point is closest to the one before.",
        differs="`planner.directions: cheapest` takes the shortest whole sequence of sides; `nearest`, the paper's, is what missions have if they say nothing.",
        by=("ltlplan.paths.hoops.passage_directions.choose_sides",), compute=directions,
    ),
    Element(
        id="2019-feedback", publication="2019", kind="section", title="Section II-A: a trajectory in C^3, followed by feed-forward and feedback", shares="2019-fig-4",
        says="Thrust and body rates are the feed-forward of flatness plus proportional and derivative terms.",
        differs="Each term has a gain of its own and an integral part; errors in position are turned into the heading's frame.",
        by=("flight.control.paper.PaperController", "flight.flights.fly"), compute=followed,
    ),
)  # fmt: skip
