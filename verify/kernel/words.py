"""Formulas of flights: an inductive invariant of all words that a team may give.

Each conjunct is proved by itself. Suppose a word of the team breaks it: it satisfies the conjunct's negation (`formulas`). A *configuration* is a
place of each robot that is followed (`team`), who of them was read since its letter changed, and one alternative that is owed. For each span of time the proof
lists configurations; the kernel checks that they cover all that may come up:

1. how the flight may begin;
2. what each move in a span makes of a configuration of that span;
3. each configuration in the next span, where its places are possible there;
4. and that the empty word keeps no alternative with which the flight may end. So no word satisfied the negation.

A configuration is covered by one with the same places, in which as many robots or more were read, and which owes no more. (Coq:
`check_invariant_sound`.)

*Laps.* Configurations have a level, which never rises. Each level names an until, which every reading within the level puts off, or the lap, which is then
not gone round within the level. A flight goes round for ever, and so stays within a level that names an until in the end; that is put off for ever, and
was not satisfied. (Coq: `check_laps_sound`.)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .evidence import Evidence
from .formulas import Letter, Owed, conjuncts
from .labels import Relations, Timeline
from .refused import Refused
from .statement import Statement
from .team import At, Claim, Step, Team

LAP = -1


@dataclass(frozen=True, slots=True)
class Configuration:
    """Places of the robots that are followed, who was read (bits), what is owed, and of laps the level."""

    at: At
    read: int
    owed: Owed
    level: int = 0


def check_formula(statement: Statement, timelines: Mapping[str, Timeline], relations: Relations, evidence: Evidence) -> None:
    """Check that every word that the timelines leave possible satisfies the formula.

    Args:
        statement: Has the formula, and how words are read.
        timelines: One for each robot.
        relations: Letters that they exclude are left out.
        evidence: Has under `formula/0` and so on for each conjunct what `read_invariant` reads.

    Raises:
        Refused: That is not proved.
    """
    for number, tree in enumerate(conjuncts(statement.formula)):
        claim = Claim(statement, timelines, relations, tree)
        check_invariant(*read_invariant(claim, evidence.get(f"formula/{number}")))


def read_invariant(claim: Claim, data: Any) -> tuple[Team, list[int], list[list[Configuration]]]:  # of any type: JSON nests
    """Read a team, levels and configurations.

    Args:
        claim: What is proved.
        data: A list: names of robots that are followed; names to which letters are cut down besides; alternatives, each a list of nodes;
            levels; sets of configurations; pairs (set, for how many spans). A configuration is a list: its alternative's number; under `own` its
            bits; of laps its level; the places.

    Raises:
        Refused: It is none.
    """
    if not isinstance(data, list) or len(data) != 6 or not all(isinstance(part, list) for part in data):
        raise Refused("an invariant is no list of six lists")
    followed, more, owed, levels, sets, runs = data
    if not all(isinstance(name, str) for name in (*followed, *more)) or len({*followed} & {*claim.robots}) != len(followed):
        raise Refused("an invariant follows robots that there are not")
    nodes = len(claim.table)
    alternatives = [frozenset(_whole(node, nodes) for node in _listed(one)) for one in owed]
    named = [LAP if one == LAP else _whole(one, nodes) for one in levels]
    if not named or any(one != LAP and not claim.table.is_until(one) for one in named):
        raise Refused("an invariant's levels name no untils")
    team = claim.team(followed, frozenset(more))
    own, laps, places = not claim.joint, team.back is not None, [len(one.letters) for one in team.followed]
    found: list[list[Configuration]] = []
    for one in sets:
        here: list[Configuration] = []
        for entry in _listed(one):
            numbers = [_whole(number, 1 << 64) for number in _listed(entry)]
            head = 1 + own + laps
            if len(numbers) != head + len(places) or any(a >= b for a, b in zip(numbers[head:], places, strict=True)):
                raise Refused("a configuration has other places than the robots")
            if numbers[0] >= len(alternatives) or (laps and numbers[head - 1] >= len(named)):
                raise Refused("a configuration names what the proof does not have")
            level = numbers[head - 1] if laps else 0
            here.append(Configuration(tuple(numbers[head:]), numbers[1] if own else 0, alternatives[numbers[0]], level))
        found.append(here)
    spans: list[list[Configuration]] = []
    for run in runs:
        which, times = (_whole(number, 1 << 64) for number in _listed(run, 2))
        if which >= len(found) or times > team.size - len(spans):
            raise Refused("the proof has another number of spans than the flight")
        spans += [found[which]] * times
    return team, named, spans


def _listed(value: object, size: int | None = None) -> list[Any]:
    if not isinstance(value, list) or (size is not None and len(value) != size):
        raise Refused("a part of an invariant is no list")
    return value


def _whole(value: object, below: int) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < below:
        raise Refused("a part of an invariant is no number, or too large")
    return value


def check_invariant(team: Team, levels: Sequence[int], sets: Sequence[Sequence[Configuration]]) -> None:
    """Check that configurations cover all that may come up, and that none ends well for the negation.

    Args:
        team: The team.
        levels: What each level names: an until of the table, or `LAP`; of finite flights there is one, the lap.
        sets: Configurations of each span.

    Raises:
        Refused: They do not.
    """
    table = team.claim.table
    if len(sets) != team.size:
        raise Refused("the proof has another number of spans than the flight")
    known: list[dict[At, list[Configuration]]] = []
    for here in sets:
        places: dict[At, list[Configuration]] = {}
        for one in here:
            places.setdefault(one.at, []).append(one)
        known.append(places)

    def stays(level: int, letter: Letter | None, off: Owed, *, lap: bool) -> bool:
        """Return whether a step may stay within a level."""
        return not lap if levels[level] == LAP else letter is None or levels[level] in off

    def require(span: int, level: int, owed: Owed, step: Step, *, lap: bool = False) -> None:
        """Refuse what a step makes of a configuration unless it is covered."""
        letter, at, read = step
        for then, off in table.after(letter, owed) if letter is not None else ((owed, owed),):
            if not any(
                one.read & read == read
                and one.owed <= then
                and (one.level < level or (one.level == level and stays(level, letter, off, lap=lap)))
                for one in known[span].get(at, ())
            ):
                raise Refused("the proof leaves out what may come up")

    for step in team.begin():
        require(0, len(levels), frozenset({table.root}), step)
    for span, here in enumerate(sets):
        for one in here:
            for step in team.moves(span, one.at, one.read):
                require(span, one.level, one.owed, step)
            if span + 1 < team.size or team.back is not None:
                then, steps = team.handed(span, one.at, one.read)
                for step in steps:
                    require(then, one.level, one.owed, step, lap=then <= span)
            elif team.may_end(one.at, one.read) and table.empty_word_keeps(one.owed):
                raise Refused("the flight may end with the formula broken")
