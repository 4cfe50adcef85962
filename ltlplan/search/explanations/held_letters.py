"""Why no precedences help where single interleavings would do: a letter that a robot holds may be read at any time."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import TooLarge
from ltlplan.logic.conjunction import conjunct_automata, conjuncts
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.orders.linearisations import Linearisations
from ltlplan.search.orders.planning import words_and_order
from ltlplan.search.orders.reading import Course
from ltlplan.search.orders.single_words import SingleWord, single_word
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Mission
from verify.data.language.word import show_letter

_STATES = 4_000
"""States of the search for a single interleaving."""


def held_letter(
    mission: Mission, systems: Sequence[TransitionSystem], asked: Formula, possible: Callable[[Mission], bool]
) -> list[str]:
    """Return what breaks a formula of `own` that a single interleaving satisfies, but no words under any precedences.

    Args:
        mission: Whose formula it is.
        systems: One for each robot.
        asked: The formula that was planned.
        possible: Whether another mission can be planned.

    Returns:
        Sentences; none where no interleaving was found, within a budget of states.
    """
    parts = list(dict.fromkeys(conjuncts(asked)))
    automata: list[Automaton] = []
    owner: list[int] = []
    for index, part in enumerate(parts):
        own = conjunct_automata(part, "finite")
        automata += own
        owner += [index] * len(own)
    marks = Marks(automata, {})
    try:
        word = single_word(systems, marks, _STATES)
        if word is None:
            return []
        words, order = words_and_order(marks, systems, word.course)
        chain = [(first, then) for i, first in enumerate(order) for then in order[i + 1 :] if first[0] != then[0]]
        broken = Linearisations(marks, words, joint=False).broken(chain)
    except TooLarge:
        return []
    if broken is None:
        return []
    robot, at = broken.reader, broken.way[-1]
    letter = show_letter(_letters(systems, word.course)[robot][at[robot]])
    reasons = [
        f"A single interleaving satisfies it ({_shown(systems, word)}), but no precedences make every one do so: a letter that is held "
        f"may be read at any time, again and again. {systems[robot].robot}'s letter {letter} breaks `{parts[owner[broken.part]]}` there."
    ]
    spec = mission.spec.model_copy(update={"team": "joint"})
    if possible(mission.model_copy(update={"spec": spec})):
        reasons.append("Under `team: joint`, where the letters of all robots are read together, a plan exists.")
    return reasons


def _letters(systems: Sequence[TransitionSystem], course: Course) -> list[list[frozenset[str]]]:
    found = [[system.labels[system.initial]] for system in systems]
    for robot, node in course.steps:
        label = systems[robot].labels[node]
        if label != found[robot][-1]:
            found[robot].append(label)
    return found


def _shown(systems: Sequence[TransitionSystem], word: SingleWord) -> str:
    said: list[str] = []
    for robot, node in word.readings:
        text = f"{systems[robot].robot} {show_letter(systems[robot].labels[node])}"
        if not said or said[-1] != text:
            said.append(text)
    return ", ".join(said)
