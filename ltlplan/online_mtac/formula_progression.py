"""Progression of a formula by flown letters: the formula that is left (Bacchus and Kabanza 1998).

In the air several robots move at once, so what was flown can be read in several ways (`possible_states`). Each way may
leave another formula; what is left is their conjunction, so that whichever way it is read, the rest satisfies the whole.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial, reduce
from typing import Literal

from ltlplan.logic.automaton import DEAD
from ltlplan.mtac.decomposable_task import Reader
from ltlplan.online_mtac.possible_states import at_start
from verify.data import BadInput, Formula, Letter, Mission, NotCertified, Unsatisfiable
from verify.data.events import changed
from verify.data.language.counting import negated
from verify.data.language.formula import FALSE, TRUE
from verify.data.sections import Agent, TeamReading

_PROPOSITIONAL = frozenset({"true", "false", "name", "!", "&", "|", "->", "<->", "xor"})


@dataclass(frozen=True, slots=True)
class _Told:
    """A state of the automaton with a formula for it; which of its formulas does not matter."""

    state: Hashable
    formula: Formula = field(compare=False)


class _Telling:
    """A mission's automaton whose states also tell what is left of the formula."""

    def __init__(self, reader: Reader, formula: Formula) -> None:
        self.reader = reader
        self.initial = _Told(reader.initial, formula)
        self.accepting: frozenset[Hashable] = frozenset()

    def successor(self, told: _Told, letter: Letter, /) -> _Told:
        reached = self.reader.successor(told.state, letter)
        if reached == told.state:
            return told
        return _Told(reached, FALSE if reached == DEAD else progressed(told.formula, letter))

    def team_letter(self, held: Mapping[str, Letter]) -> Letter:
        return self.reader.team_letter(held)

    def commutes(self, letter: Letter) -> bool:
        return self.reader.commutes(letter)


def mission_left(
    mission: Mission,
    agents: Mapping[str, Agent],
    reader: Reader,
    first: Mapping[str, Letter],
    shown: Sequence[tuple[float, Mapping[str, Letter]]],
) -> Mission:
    """Return what is left of a mission after letters were flown, as a mission of its own; conjuncts that are bounded in seconds are left out.

    Args:
        mission: What is asked of the whole.
        agents: The robots as they are now.
        reader: The formula's automaton.
        first: What each robot showed first.
        shown: Every change of a letter: (s, {robot: letter}).

    Raises:
        Unsatisfiable: Nothing that comes can make the formula true.
    """
    untimed = [part for part in mission.bounded.conjuncts() if not part.timed]
    asked = _and(*untimed) if mission.timed_parts else mission.formula
    left = formula_left(asked, reader, first, shown, reading=mission.spec.team)
    if left == FALSE:
        raise Unsatisfiable("what was flown cannot be completed to satisfy the formula.")
    return changed(mission, agents=dict(agents), spec=mission.spec.model_copy(update={"formula": str(left)}))


def formula_left(
    formula: Formula,
    reader: Reader,
    first: Mapping[str, Letter],
    shown: Sequence[tuple[float, Mapping[str, Letter]]],
    *,
    reading: TeamReading,
) -> Formula:
    """Return what must hold of the rest of a team's word, however the letters so far are read.

    Args:
        formula: What is asked of the whole.
        reader: Its automaton.
        first: What each robot showed first.
        shown: Every change of a letter: (s, {robot: letter}).
        reading: The mission's team reading.
    """
    belief = at_start(_Telling(reader, formula), first, (events for _, events in shown), reading=reading)
    held = frozenset(belief.held.values())
    found: dict[str, Formula] = {}
    for told, unread in belief.pairs:
        if isinstance(told, _Told):
            read = held - unread if reading == "own" else ()
            again = [letter for letter in read if reader.successor(told.state, letter) != told.state]
            rest = _anew(told.formula, again) if again else told.formula
            found[str(rest)] = rest
    return _and(*(found[text] for text in sorted(found)))


def progressed(node: Formula, letter: Letter) -> Formula:
    """Return what must hold of the rest of a trace, which is never empty, after a letter was read.

    Args:
        node: The formula.
        letter: Of the team.

    Raises:
        NotCertified: There is an X in it.
        BadInput: It depends on how many robots there are.
    """
    parts = node.arguments
    match node.operator:
        case "true" | "false":
            return node
        case "name" | "count":  # of a written-out formula: propositions of the team's letter
            return TRUE if node.atom in letter else FALSE
        case "!":
            return negated(progressed(parts[0], letter))
        case "&" | "|" as operator:
            return _joined(operator, *(progressed(part, letter) for part in parts))
        case "->":
            return _or(negated(progressed(parts[0], letter)), progressed(parts[1], letter))
        case "<->" | "xor":
            left, right = progressed(parts[0], letter), progressed(parts[1], letter)
            same = _or(_and(left, right), _and(negated(left), negated(right)))
            return same if node.operator == "<->" else negated(same)
        case "F":
            return _or(progressed(parts[0], letter), node)
        case "G":
            return _and(progressed(parts[0], letter), node)
        case "U" | "W":
            return _or(progressed(parts[1], letter), _and(progressed(parts[0], letter), node))
        case "R" | "M":
            return _and(progressed(parts[1], letter), _or(progressed(parts[0], letter), node))
        case "X" | "X[!]":
            raise NotCertified("a mission's formula has no X, so none can be left.")
        case _:
            raise BadInput(
                f"`{node}` depends on how many robots there are; what is left of a formula is asked of one that is written out."
            )


def _anew(node: Formula, letters: Sequence[Letter]) -> Formula:
    """Return a stronger formula: what letters that are held and were read show is to be shown anew, as nobody need read them again.

    A guide for planning: it is exact for goals that are propositional, and whole flights are judged by their own word.
    """
    parts = node.arguments
    match node.operator:
        case "&" | "|" as operator:
            return _joined(operator, *(_anew(part, letters) for part in parts))
        case "F" | "U":
            now = _now(parts[-1])
            if now == TRUE or all(progressed(now, letter) == FALSE for letter in letters):
                return node
            return Formula(node.operator, (*parts[:-1], _and(negated(now), node)))
        case _:
            return node


def _now(node: Formula) -> Formula:
    """Return what a formula asks of the first letter at least, a propositional formula."""
    if node.operator in ("&", "|"):
        return _joined(node.operator, *map(_now, node.arguments))
    return node if all(part.operator in _PROPOSITIONAL for part in node.walk()) else TRUE


def _joined(operator: Literal["&", "|"], *formulas: Formula) -> Formula:
    """Join formulas; what stands in several is written once, so that reading letters again makes nothing longer."""
    neutral, ruling = (TRUE, FALSE) if operator == "&" else (FALSE, TRUE)
    parts = dict.fromkeys(part for formula in formulas for part in _parts(operator, formula))
    parts.pop(neutral, None)
    if ruling in parts:
        return ruling
    return reduce(lambda left, right: Formula(operator, (left, right)), parts) if parts else neutral


_and, _or = partial(_joined, "&"), partial(_joined, "|")


def _parts(operator: str, formula: Formula) -> tuple[Formula, ...]:
    if formula.operator != operator:
        return (formula,)
    return tuple(part for argument in formula.arguments for part in _parts(operator, argument))
