"""The page of a flight flown online: what it is not, the checker's verdict, flown paths, labels and sub-formulas.

Everything on it was seen, in simulation 100 times a second or as a link measured it; nothing is a claim for all times.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flight.pictures import MANY, scene
from ltlplan.report.charts import shown_chart, truth_chart
from ltlplan.report.crowds import CROWD, lightened
from ltlplan.report.history.letters import LetterInterval, team_readings
from ltlplan.report.history.to_do import still_to_do
from ltlplan.report.page import listed, page_html, section, warning
from ltlplan.report.player import Playing, player_data, player_section

if TYPE_CHECKING:
    from ltlplan.online.online_flight import OnlineFlight
    from verify.data import Letter

THIN = 5
"""Every so many entries of the log are drawn: 20 a second."""

_SCENE = (
    "Where the robots {were}, from their starts; hoops and regions as they were at the time. Drag to turn, scroll to "
    "zoom; a click on a name hides that robot."
)
_LABELS = "The region that a robot was seen in, in the world as it then was. Grey: propositions of its internal state."
_TRUTH = (
    "A bar at a time: what was flown from then on satisfies the sub-formula. Robots that changed at once are read in the "
    "mission's order; the verdict above is over every order."
)


def online_html(flown: OnlineFlight) -> str:
    """Return one self-contained page for a flight flown online."""
    log, mission = flown.log, flown.mission
    letters = {name: _intervals(log.times.tolist(), [row[k] for row in log.letters]) for k, name in enumerate(log.robots)}
    readings = team_readings(letters, joint=mission.spec.team == "joint", formula=mission.formula)
    end = float(log.times[-1])
    answer = flown.sentences()
    happened = [(event.time, event.sentence) for event in log.events if event.sentence not in (*log.notes, *answer)]
    playing = Playing(
        log.times[::THIN],
        {name: log.position[::THIN, log.robots.index(name)] for name in mission.agents},
        letters,
        still_to_do(mission, letters, readings),
        {},
        happened,
    )
    label = (
        f"Moving 3-D picture of the hoops and of where {', '.join(mission.agents)} were; the bars below say what they showed."
    )
    drawn = scene(mission, playing.paths, earlier=flown.earlier)
    note = _SCENE.format(were="were measured" if flown.measured else "were in simulation")
    if len(mission.agents) > MANY:
        drawn, note = lightened(drawn), CROWD
    return page_html(
        f"{mission.name}, flown online",
        header="".join(warning(note) for note in log.notes)
        + listed([*answer, f"Asked: {mission.bounded}", *(f"{time:.2f} s: {sentence}" for time, sentence in happened)]),
        sections=[
            player_section(playing, label, note),
            section("Labels over time", shown_chart(mission, letters, end), note=_LABELS),
            section("Sub-formulas over time", truth_chart(mission, letters, readings, end, None), note=_TRUTH),
        ],
        figures={"scene": drawn},
        player=player_data(playing),
    )


def _intervals(times: list[float], letters: list[Letter]) -> list[LetterInterval]:
    """Return the letters of one robot's entries as intervals; each lasts until another one is seen."""
    intervals: list[LetterInterval] = []
    for i, (time, letter) in enumerate(zip(times, letters, strict=True)):
        end = times[min(i + 1, len(times) - 1)]
        if intervals and intervals[-1].letter == letter:
            intervals[-1] = LetterInterval(intervals[-1].start, end, letter)
        else:
            intervals.append(LetterInterval(time, end, letter))
    return intervals
