"""History of a sampled flight: letters, observations of the team, and sub-formulas.

For pictures only. Claims come from the certificate, which does not sample.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from verify.data import Formula, Letter, Mission, Word
from verify.data.language.counting import atoms
from verify.logic.semantics import truth_table
from verify.logic.team_letters import TeamLetters

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LetterInterval:
    """A letter or a value that lasts from `start` to `end`, in s."""

    start: float
    end: float
    letter: Letter


@dataclass(frozen=True, slots=True)
class ReadLetter:
    """One position of the team word: a robot's new letter, and when it appeared, in s."""

    time: float
    robot: str
    letter: Letter


def letter_intervals(
    mission: Mission, robot: str, times: Floats, path: Floats, actions: Sequence[tuple[float, str]]
) -> list[LetterInterval]:
    """Return a robot's letters over time.

    Args:
        mission: Gives the regions and the internal states' propositions.
        robot: Whose letters.
        times: s. Shape (samples,).
        path: Positions in m in the first three columns. Shape (samples, 3 or more).
        actions: (time in s, new internal state), sorted by time.
    """
    inside = {name: region.level(path[:, :3]) <= 1.0 for name, region in mission.all_regions.items()}
    intervals: list[LetterInterval] = []
    for index, time in enumerate(times):
        internal = mission.initial_letter(robot)
        for instant, state in actions:
            if instant <= time:
                internal = frozenset(mission.robot_of(robot).states[state])
        letter = internal | {name for name, level in inside.items() if level[index]}
        end = float(times[min(index + 1, len(times) - 1)])
        if intervals and intervals[-1].letter == letter:
            intervals[-1] = LetterInterval(intervals[-1].start, end, letter)
        else:
            intervals.append(LetterInterval(float(time), end, letter))
    return intervals


def team_readings(
    intervals: Mapping[str, Sequence[LetterInterval]], *, joint: bool, formula: Formula | None = None
) -> list[ReadLetter]:
    """Return the readings of the team in order of time; under `joint`, what all robots hold together.

    Args:
        intervals: Each robot's letters.
        joint: Whether letters are put together.
        formula: The mission's, written out: counts and robots' names in it are propositions of the team's letters.
    """
    known = {} if formula is None else atoms(formula)
    reader = TeamLetters.of(formula, known) if formula is not None and known else None
    if not joint:
        readings = [
            ReadLetter(interval.start, robot, interval.letter) for robot, mine in intervals.items() for interval in mine
        ]
        return sorted(readings, key=lambda reading: reading.time)
    readings = []
    for time in sorted({interval.start for mine in intervals.values() for interval in mine}):
        held = {robot: next(s.letter for s in reversed(mine) if s.start <= time) for robot, mine in intervals.items()}
        union: Letter = frozenset().union(*held.values())
        readings.append(ReadLetter(time, "team", union if reader is None else union | reader.letter(held)))
    return readings


def truth_intervals(
    formula: Formula, readings: Sequence[ReadLetter], end: float, cycle: float | None
) -> dict[str, list[LetterInterval]]:
    """Return, for each sub-formula that is more than a name, when it is true: intervals with a letter {"true"}.

    Args:
        formula: The mission's formula.
        readings: The team word.
        end: End of the mission, s.
        cycle: Time at which the cycle begins, s, for a lasso of one robot.
    """
    letters = [reading.letter for reading in readings]
    if cycle is None:
        word = Word(tuple(letters))
    else:
        split = next((i for i, reading in enumerate(readings) if reading.time >= cycle), len(letters) - 1)
        word = Word(tuple(letters[:split]), tuple(letters[split:]))
    table = truth_table(formula, word)
    result: dict[str, list[LetterInterval]] = {}
    seen: list[Formula] = []
    nodes = [formula]
    while nodes:
        node = nodes.pop()
        if node.operator in ("name", "true", "false") or node in seen:
            continue
        seen.append(node)
        if node.operator != "count":  # what is counted is each robot's own
            nodes.extend(reversed(node.arguments))
        row, intervals = table.row(node), list[LetterInterval]()
        for index, reading in enumerate(readings):
            until = readings[index + 1].time if index + 1 < len(readings) else end
            if row[index] and until > reading.time:
                intervals.append(LetterInterval(reading.time, until, frozenset({"true"})))
        result[str(node)] = intervals
    return result
