"""The page of a flight flown online: what it is not, the checker's verdict, flown paths, labels and sub-formulas.

Everything on it was seen in simulation, 100 times a second; nothing is a claim for all times.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flight.draw import scene
from ltlplan.report.charts import shown_chart, truth_chart
from ltlplan.report.figures_page import figures_page
from ltlplan.report.history import Spell, team_readings

if TYPE_CHECKING:
    import plotly.graph_objects as go

    from ltlplan.online.flight import OnlineFlight
    from verify.data import Letter

THIN = 5
"""Every so many entries of the log are drawn: 20 a second."""


def online_html(flown: OnlineFlight) -> str:
    """Return one self-contained page for a flight flown online."""
    log, mission = flown.log, flown.mission
    letters = {name: _spells(log.times.tolist(), [row[k] for row in log.letters]) for k, name in enumerate(log.robots)}
    readings = team_readings(letters, joint=mission.spec.team == "joint")
    end = float(log.times[-1])
    paths = {name: log.position[::THIN, k] for k, name in enumerate(log.robots)}
    figures: dict[str, go.Figure] = {
        "Flown paths": scene(mission, paths),
        "Labels over time": shown_chart(mission, letters, end),
        "Sub-formulas over time": truth_chart(mission.formula, readings, end, None),
    }
    notes = {
        "Flown paths": "Where the robots were in simulation, from their starts; hoops and regions as they were at the end.",
        "Labels over time": "The region that a robot was seen in, in the world as it then was. Grey: propositions of its internal state.",
        "Sub-formulas over time": (
            "A bar at a time: what was flown from then on satisfies the sub-formula. Robots that changed at once are read in the "
            "mission's order; the verdict above is over every order."
        ),
    }
    answer = flown.sentences()
    happened = [f"{e.time:.2f} s: {e.sentence}" for e in log.events if e.sentence not in (*log.notes, *answer)]
    sentences = [*answer, f"Asked: {mission.formula}", *happened]
    return figures_page(
        f"{mission.name}, flown online", sentences, figures, notes=notes, height=480, warning=" ".join(log.notes)
    )


def _spells(times: list[float], letters: list[Letter]) -> list[Spell]:
    """Return the letters of one robot's entries as spells; each lasts until another one is seen."""
    spells: list[Spell] = []
    for i, (time, letter) in enumerate(zip(times, letters, strict=True)):
        end = times[min(i + 1, len(times) - 1)]
        if spells and spells[-1].letter == letter:
            spells[-1] = Spell(spells[-1].start, end, letter)
        else:
            spells.append(Spell(time, end, letter))
    return spells
