"""Robots on which it can depend whether a word is broken; the others are left out before they are followed.

Where all of a robot's letters are free in every state and never move, its set never empties and it is never picked. Where they are
one letter (as the formula sees it), free in every state, picking the robot takes nothing from its set, however often: any other
robot of that kind does as well, so one stands for all.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

from verify.data.language.word import Letter
from verify.model_checking.compositional.violation_automaton import BreakingWords
from verify.model_checking.robot_letters import RobotBehaviour, merged


def that_matter(robots: Sequence[RobotBehaviour], words: BreakingWords) -> list[RobotBehaviour]:
    """Return the robots that can affect the verdict, one representative for each set of interchangeable robots.

    Letters are cut down to what the formula sees; where it matters that a robot is read before its letter changes in what the
    formula does not see, a number tells its whole letters apart.

    Args:
        robots: The team, with whole letters, or with letters cut down to the formula's propositions.
        words: What breaks the formula.

    Returns:
        At least one robot: where none matters any of them does.
    """
    number = {letter: i for i, letter in enumerate(words.letters)}
    seen = words.normal.propositions
    kept: list[RobotBehaviour] = []
    constant: set[Letter] = set()
    for robot in robots:
        letters = {letter & seen for letter in robot.letters}
        if all(words.dead >> number[letter] & 1 for letter in letters):
            continue
        if len(letters) == 1 and words.idle >> number[letter := next(iter(letters))] & 1:
            if letter not in constant:
                constant.add(letter)
                kept.append(_holding(robot, letter))
            continue
        kept.append(_cut(robot, words, number))
    return kept or [_holding(robots[0], robots[0].letters[0] & seen)]


def _holding(robot: RobotBehaviour, letter: Letter) -> RobotBehaviour:
    span = min(low for low, _ in robot.spans), max(high for _, high in robot.spans)
    return RobotBehaviour(robot.robot, (letter,), (span,), ((),), (0,), frozenset({0}), actions=(0,))


def _cut(robot: RobotBehaviour, words: BreakingWords, number: dict[Letter, int]) -> RobotBehaviour:
    seen = words.normal.propositions
    others: dict[Letter, int] = {}
    letters: list[Letter] = []
    for letter in robot.letters:
        cut = letter & seen
        if not words.idle >> number[cut] & 1:  # it may be in the way to read it: tell apart what must be read by itself
            rest = letter - seen
            cut |= {f"\n{others.setdefault(rest, len(others))}"} if rest else frozenset()  # a name that no proposition has
        letters.append(cut)
    return merged(replace(robot, letters=tuple(letters), actions=(0,) * len(robot)))


def letters_of(robots: Sequence[RobotBehaviour], names: frozenset[str]) -> list[Letter]:
    """Return all that robots show of some names, in a fixed order."""
    shown = {letter & names for letter in itertools.chain.from_iterable(robot.letters for robot in robots)}
    return sorted(shown, key=sorted)
