"""Laws of counts: requirements on how many robots show what that every team keeps, whatever its robots do."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterator, Sequence

from ltlplan.logic.automaton import representative_letters
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.logic.signed_parts import signed_parts
from ltlplan.logic.small_automata import small_automaton
from ltlplan.search.counting.counting_propositions import shows
from ltlplan.search.explanations.inquiry import all_of, as_written, satisfiable
from verify.data import Formula, Letter, Mission
from verify.data.language.counting import Atom, atoms

_SETS = 100
"""Sets of robots by name of which laws are made for one count."""
_NAMES = 6
"""Names up to which it is found out of two Boolean combinations whether one follows from the other."""


def no_word(mission: Mission, parts: Sequence[Formula]) -> str:
    """Return the sentence that no word of a team satisfies some requirements; empty where some word does, or where that is not known.

    Args:
        mission: Gives the team's size, and which words are asked for.
        parts: The requirements, written out.
    """
    robots = len(mission.agents)
    if not _depends_on_size(mission) and not some_word(mission, [*parts, *laws_of_counts(parts)]):
        every = "No team of any size can do this: whatever" if mission.written.counts else "Whatever"
        return f"{every} robots do, no word satisfies this."
    if not mission.written.counts or some_word(mission, [*parts, *laws_of_counts(parts, robots)]):
        return ""
    written = as_written(mission)
    more = _too_many(robots, [written.get(part, part) for part in parts])
    who = "the robot does" if robots == 1 else f"the {robots} robots do"
    return " ".join(more) or f"Whatever {who}, no word satisfies this."


def laws_of_counts(
    parts: Sequence[Formula], robots: int | None = None, letters: Collection[Letter] | None = None
) -> list[Formula]:
    """Return requirements on the propositions of others that every team keeps.

    Args:
        parts: Requirements, written out.
        robots: Of how many robots teams are; None for teams of any size.
        letters: What one robot may show at a time; None where it may show everything.
    """
    known = propositions_of(parts)
    laws = [law for one, other in itertools.combinations(known, 2) for law in _laws(one, other, robots, letters)]
    return [Formula("G", (law,)) for law in (*laws, *_laws_of_several(known))]


def propositions_of(parts: Sequence[Formula]) -> list[Atom]:
    """Return all propositions of requirements, plain names as well: these are counts of at least one robot.

    Args:
        parts: Requirements, written out.
    """
    formula = all_of(parts)
    plain = {node.name: Atom(node, "", node, 1) for node in _plain_names(formula)}
    return sorted((*plain.values(), *atoms(formula).values()), key=lambda atom: atom.text)


def laws_of_turns(parts: Sequence[Formula]) -> list[tuple[tuple[Atom, Atom], Formula]]:
    """Return pairs of propositions that only two robots at once can change together, and for each that they do not.

    Args:
        parts: Requirements, written out.
    """
    known = propositions_of(parts)
    pairs = [(a, b) for a, b in itertools.combinations(known, 2) if _of_several(a, b)]
    return [((a, b), Formula("G", (Formula("!", (Formula("&", (_changes(a), _changes(b))),)),))) for a, b in pairs]


def _of_several(one: Atom, other: Atom) -> bool:
    """Tell whether only two robots at once can change both propositions: each names a robot, or both count the same."""
    return bool(one.robot and other.robot and one.robot != other.robot) or (
        not one.robot and not other.robot and str(one.counted) == str(other.counted)
    )


def _changes(atom: Atom) -> Formula:
    """Return that a proposition is another one at the next instant."""
    shown, hidden = atom.formula, Formula("!", (atom.formula,))
    both = [Formula("&", (now, Formula("X[!]", (then,)))) for now, then in ((shown, hidden), (hidden, shown))]
    return Formula("|", tuple(both))


def some_word(mission: Mission, parts: Sequence[Formula]) -> bool:
    """Tell whether some word satisfies all parts, whoever may show its letters.

    Args:
        mission: Says whether words are finite.
        parts: Requirements, written out.
    """
    if mission.spec.trace == "infinite":
        return bool(small_automaton(all_of(parts), "infinite").accepting)
    return satisfiable(parts, representative_letters(conjunct_automata(all_of(parts), "finite")))


def _depends_on_size(mission: Mission) -> bool:
    """Tell whether a formula asks something else of a larger team, or of one whose counts may be greater."""
    robots = len(mission.agents)
    alone = robots == 1 and mission.written.counts  # what all do, and what some do, is the same
    return alone or any(
        node.operator in ("each", "ever")
        or (node.bound is not None and node.bound[1] + (node.bound[0] not in (">=", "<")) > robots)
        for node in mission.written.nodes()
    )


def _plain_names(formula: Formula) -> Iterator[Formula]:
    if formula.operator == "name" and not formula.robot:
        yield formula
    elif formula.operator != "count":
        for argument in formula.arguments:
            yield from _plain_names(argument)


def _laws(one: Atom, other: Atom, robots: int | None, letters: Collection[Letter] | None) -> Iterator[Formula]:
    """Yield what always holds between two propositions."""
    for a, b in ((one, other), (other, one)):
        enough = b.least == 1 if a.robot else a.least >= b.least
        if enough and not b.robot and _always(a, b, lambda shown, also: also or not shown, letters):
            yield Formula("|", (Formula("!", (a.formula,)), b.formula))
    least, named = one.least + other.least, bool(one.robot or other.robot)  # a robot that shows no one thing shows the other
    both_named = bool(one.robot and other.robot)
    most = 2 if robots is None or named else robots + 1
    if not both_named and least <= most and _always(one, other, lambda a, b: a or b, letters):
        yield Formula("|", (one.formula, other.formula))
    too_many = bool(one.robot and one.robot == other.robot) or (robots is not None and least > robots)
    if too_many and _always(one, other, lambda a, b: not (a and b), letters):
        yield Formula("!", (Formula("&", (one.formula, other.formula)),))


def _laws_of_several(known: Sequence[Atom]) -> Iterator[Formula]:
    """Yield that where several robots by name show what is counted, so many do."""
    for count in (atom for atom in known if not atom.robot and atom.least > 1):
        named = [atom for atom in known if atom.robot and _always(atom, count, lambda shown, also: also or not shown)]
        some = itertools.islice(itertools.combinations(named, count.least), _SETS)
        for those in (each for each in some if len({atom.robot for atom in each}) == count.least):
            yield Formula("|", (Formula("!", (all_of([atom.formula for atom in those]),)), count.formula))


def _too_many(robots: int, parts: Sequence[Formula]) -> list[str]:
    """Name counts that ask for more robots than there are."""
    found = dict[str, None]()
    for node, gains in (signed for part in parts for signed in signed_parts(part)):
        if node.bound is not None:
            sign, number = node.bound
            asked = (">=", ">", "==") if gains else ("<", "<=")
            if sign in asked and number + (sign in (">", "<=")) > robots:
                found[f"`{node}` asks for more robots than the mission has: {robots}."] = None
    return list(found)


def _always(one: Atom, other: Atom, holds: Callable[[bool, bool], bool], letters: Collection[Letter] | None = None) -> bool:
    """Tell whether two Boolean combinations of names are related so in each letter of a robot."""
    names = sorted(one.counted.names() | other.counted.names())
    if len(names) > _NAMES:
        return False
    if letters is None:
        kept = itertools.product((False, True), repeat=len(names))
        letters = [frozenset(itertools.compress(names, each)) for each in kept]
    return all(holds(shows(one.counted, letter), shows(other.counted, letter)) for letter in letters)
