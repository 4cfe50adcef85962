"""A certified flight made ready to be played: where each robot is, what it shows, and what is still to do, over time.

The page of a run and the service's page play the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flight.pictures import sample_paths
from flight.shapes import Floats
from ltlplan.report.history.letters import LetterInterval, ReadLetter, letter_intervals, team_readings
from ltlplan.report.history.to_do import still_to_do
from ltlplan.report.player import Playing, Todo
from ltlplan.report.summary import visits_text

if TYPE_CHECKING:
    from verify import Certificate
    from verify.data import Mission, Plan, Trajectory

STEP = 0.05
"""Time between samples of the drawn paths, s."""


@dataclass(frozen=True, eq=False)
class Replay:
    """A flight as it is drawn over time.

    Attributes:
        playing: What the player shows.
        readings: The team word, in order of time.
        end: s, when the drawn flight ends.
        cycle: s, when its cycle begins, where there is one.
    """

    playing: Playing
    readings: list[ReadLetter]
    end: float
    cycle: float | None


def replay_of(plan: Plan, team: Mapping[str, Trajectory], certificate: Certificate) -> Replay:
    """Return a flight made ready to be played.

    Args:
        plan: What was planned; carries the mission.
        team: One trajectory a robot.
        certificate: What was proved of them, or refused; gives the instants of the actions.
    """
    mission = plan.mission
    times, paths = sample_paths(team, STEP, mission.spec.repeat)
    letters = _letters(mission, certificate, times, paths)
    readings = team_readings(letters, joint=mission.spec.team == "joint", formula=mission.formula)
    tasks = {name: visits_text(robot) for name, robot in plan.robots.items()}
    playing = Playing(times, paths, letters, _todo(mission, letters, readings), tasks)
    (first, *_rest) = team.values()
    cycle = None if first.cycle is None else float(first.knots[first.cycle])
    return Replay(playing, readings, float(times[-1]), cycle)


def _letters(
    mission: Mission, certificate: Certificate, times: Floats, paths: Mapping[str, Floats]
) -> dict[str, list[LetterInterval]]:
    result: dict[str, list[LetterInterval]] = {}
    for name, path in paths.items():
        actions = sorted((action.time, action.target) for action in certificate.actions if action.robot == name)
        result[name] = letter_intervals(mission, name, times, path, actions)
    return result


def _todo(mission: Mission, letters: dict[str, list[LetterInterval]], readings: list[ReadLetter]) -> Todo:
    if mission.spec.formula is None:
        return [(0.0, [("", "the sequence's passages, in order")])]
    if mission.spec.trace == "infinite":
        return [(0.0, [("", "for ever: the formula is judged on the repeated cycle")])]
    return still_to_do(mission, letters, readings)
