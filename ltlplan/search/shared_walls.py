"""Letters that may be shown at a wall that two rooms share, and whether the formula holds for each.

Planned words show both rooms' names where a way leads straight from one into the other. Flown paths lie in a tube: where no ball of the
margin's radius fits into what the rooms have in common, no path in it is in both for sure while it crosses, nor in either of them; it may
be in both, in one, in none, and come and go. A plan is refused here where the formula breaks on one of these words.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import TooLarge
from ltlplan.logic.conjunction import conjunct_automata, conjuncts
from ltlplan.search.every_order import hold_in_every_order
from ltlplan.systems.shared_walls import Crossing, Walls, wall_sentence
from verify.data import Infeasible, Letter, Mission, Word
from verify.data.language.counting import written_out
from verify.data.language.formula import FREE
from verify.data.language.free import in_no_region


class OpenWall(Infeasible):
    """Between two rooms that share a wall a robot may show letters that break the formula.

    Attributes:
        robot: Its name.
        rooms: The room that it leaves, and the one that it enters.
    """

    def __init__(self, message: str, robot: str, rooms: tuple[str, str]) -> None:
        super().__init__(message)
        self.robot, self.rooms = robot, rooms


def open_wall(mission: Mission, words: Mapping[str, Word]) -> OpenWall | None:
    """Return why some planned words cannot be flown for sure: the wall at which they may break the formula; None where they do not.

    Args:
        mission: Whose rooms and formula.
        words: Each robot's, in the mission's order; they satisfy the formula as planned.
    """
    if mission.written.counts and len(mission.agents) > 1:
        return None  # their words hold in one order alone; the certificate will tell
    walls = Walls(mission)
    crossings = {name: walls.on(word.letters, (word.cycle or ())[:1]) for name, word in words.items()}
    if not any(crossings.values()):
        return None
    breaks = _breaks(mission)
    at_once = list(crossings.items())
    for name, found in [*((name, [crossing]) for name, several in at_once for crossing in several), *at_once]:
        for other in _others(words[name], found):
            part = breaks({**words, name: other})
            if part is not None:
                _, left, entered = found[0]
                return OpenWall(
                    f"`{part}` cannot be kept for sure: it does not hold where {name} shows, for instance, {other}. "
                    f"{wall_sentence(left, entered, mission.margin)}",
                    name,
                    (left, entered),
                )
    return None


_SHAPES = (
    ("none",),
    ("none", "left", "both"),
    ("both", "left", "none"),
    ("none", "entered", "both"),
    ("both", "entered", "none"),
)
"""What may be shown at a wall: in none of two rooms, in one again, in both again."""


def _others(word: Word, crossings: Sequence[Crossing]) -> Iterator[Word]:
    """Yield words that may be flown where one was planned."""
    hidden: dict[int, dict[str, set[str]]] = {
        index: {"both": set(), "none": {left, entered}, "left": {entered}, "entered": {left}}
        for index, left, entered in crossings
    }
    cut = len(word.prefix)
    for shape in _SHAPES if hidden else ():
        shown: list[list[Letter]] = [
            [letter - hidden[index][name] for name in shape] if index in hidden else [letter]
            for index, letter in enumerate(word.letters)
        ]
        prefix, cycle = (tuple(itertools.chain(*part)) for part in (shown[:cut], shown[cut:]))
        yield Word(prefix, cycle if word.cycle is not None else None)


def _breaks(mission: Mission) -> Callable[[Mapping[str, Word]], str | None]:
    """Return what tells which part of the formula some words break, as the user wrote it; None where they keep it."""
    free = {FREE: in_no_region(mission.all_regions)}
    robots = tuple(mission.agents)
    parts = {
        str(part): conjunct_automata(written_out(part.substitute(free), robots), mission.spec.trace)
        for part in conjuncts(mission.written)
    }

    def breaks(words: Mapping[str, Word]) -> str | None:
        try:
            return next((text for text, automata in parts.items() if not _keep(mission, automata, words)), None)
        except TooLarge:
            return None  # the certificate will tell

    return breaks


def _keep(mission: Mission, automata: Sequence[Automaton], words: Mapping[str, Word]) -> bool:
    """Tell whether words keep a part of the formula, in every order of the robots."""
    if mission.spec.trace == "infinite":
        return all(automaton.accepts(word) for automaton in automata for word in words.values())
    return hold_in_every_order(automata, [word.prefix for word in words.values()], joint=mission.spec.team == "joint")
