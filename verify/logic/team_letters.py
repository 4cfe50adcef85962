"""Observations of a formula of `team: joint` on the letters that all robots hold at one time.

Without counts and robots' names that is their union. Of a count only the sum matters: each robot's letter is first cut down to
what the formula sees of it, a *mark* for each counted combination that it satisfies, and marks are added up. So robots that show
the same are alike whatever their names, and what never changes is added up once. A robot's own name (`quad0.dock`) is a mark
that this robot alone can make.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial

from verify.data.errors import InternalError
from verify.data.language.counting import Atom, atoms
from verify.data.language.formula import Formula
from verify.data.language.word import Letter
from verify.logic.normal_form import Normal


def is_shown(counted: Formula, letter: Letter, *, team: bool = False) -> bool:
    """Return whether a letter satisfies a Boolean combination of its propositions.

    Args:
        counted: The combination.
        letter: What one robot shows, or the team.
        team: Whether it is the team's letter, whose propositions are counts and robots' names, too.

    Raises:
        InternalError: It is no Boolean combination of such propositions.
    """
    shown = partial(is_shown, letter=letter, team=team)
    match counted.operator:
        case "name" | "count" if team or (counted.operator == "name" and not counted.robot):
            return counted.atom in letter
        case "true" | "false":
            return counted.operator == "true"
        case "!":
            return not shown(counted.arguments[0])
        case "&":
            return all(shown(part) for part in counted.arguments)
        case "|":
            return any(shown(part) for part in counted.arguments)
        case "->":
            return not shown(counted.arguments[0]) or shown(counted.arguments[1])
        case "<->" | "xor":
            return (shown(counted.arguments[0]) == shown(counted.arguments[1])) == (counted.operator == "<->")
        case _:
            raise InternalError(f"`{counted}` is asked of one letter, which does not tell of it. This is a bug of ltlplan's.")


@dataclass(frozen=True, slots=True)
class Together:
    """Puts robots' marked letters together.

    Attributes:
        sums: For each mark that is added up: pairs (least sum, the proposition that then holds).
        base: What robots show all the time that are not followed.
        added: How many of these make each mark.
    """

    sums: tuple[tuple[str, tuple[tuple[int, str], ...]], ...]
    base: Letter = frozenset()
    added: tuple[int, ...] = ()

    def __call__(self, held: Iterable[tuple[Letter, int]]) -> Letter:
        """Return the team's letter.

        Args:
            held: Marked letters, and how many robots hold each.
        """
        pairs = [(letter, count) for letter, count in held if count]
        found = set(self.base.union(*(letter for letter, _ in pairs)))
        for index, (mark, levels) in enumerate(self.sums):
            found.discard(mark)
            total = sum(count for letter, count in pairs if mark in letter) + (self.added[index] if self.added else 0)
            found.update(text for least, text in levels if total >= least)
        return frozenset(found)

    def beside(self, letters: Iterable[Letter]) -> Together:
        """Return the same with robots that hold one marked letter all the time added up once."""
        kept = list(letters)
        marks = {mark for mark, _ in self.sums}
        added = tuple(
            sum(mark in letter for letter in kept) + (self.added[i] if self.added else 0)
            for i, (mark, _) in enumerate(self.sums)
        )
        return Together(self.sums, self.base.union(*kept) - marks, added)


@dataclass(frozen=True)
class TeamLetters:
    """Reading of a team's letters by one formula, or by one conjunct.

    Attributes:
        plain: The plain names that it asks for: true where some robot shows them.
        named: For each robot whose name it has: pairs (proposition of the team, what the robot must show).
        counted: For each mark: what a letter must satisfy to make it.
        together: Puts marked letters together.
    """

    plain: frozenset[str]
    named: Mapping[str, tuple[tuple[str, str], ...]]
    counted: Mapping[str, Formula]
    together: Together
    _known: dict[tuple[str, Letter], Letter] = field(default_factory=dict, repr=False, compare=False)

    @classmethod
    def of(cls, asked: Formula | Normal, known: Mapping[str, Atom]) -> TeamLetters:
        """Return how propositions are read.

        Args:
            asked: A formula that is written out for the team, or a conjunct of one.
            known: The formula's `atoms`.
        """
        wanted = asked.propositions if isinstance(asked, Normal) else {*atoms(asked), *plain_names(asked)}
        found = [known[text] for text in sorted(wanted & known.keys())]
        named: dict[str, list[tuple[str, str]]] = {}
        sums: dict[str, list[tuple[int, str]]] = {}
        counted: dict[str, Formula] = {}
        for atom in found:
            if atom.robot:
                named.setdefault(atom.robot, []).append((atom.text, atom.counted.name))
            else:
                mark = f"count({atom.counted})"
                counted[mark] = atom.counted
                sums.setdefault(mark, []).append((atom.least, atom.text))
        together = Together(tuple((mark, tuple(sorted(levels))) for mark, levels in sums.items()))
        return cls(frozenset(wanted - known.keys()), {r: tuple(pairs) for r, pairs in named.items()}, counted, together)

    def names_of(self, robot: str) -> frozenset[str]:
        """Return the names of which this robot's letter is asked."""
        own = {name for _, name in self.named.get(robot, ())}
        return self.plain.union(own, *(counted.names() for counted in self.counted.values()))

    def own(self, robot: str, letter: Letter) -> Letter:
        """Return what is seen of one robot's letter.

        Args:
            robot: Its name.
            letter: What it shows.
        """
        key = (robot if robot in self.named else "", letter)
        found = self._known.get(key)
        if found is None:
            marks = {mark for mark, counted in self.counted.items() if is_shown(counted, letter)}
            marks |= {text for text, name in self.named.get(robot, ()) if name in letter}
            found = self._known[key] = (letter & self.plain) | marks
        return found

    def letter(self, held: Mapping[str, Letter]) -> Letter:
        """Return the team's letter, given what each robot shows."""
        return self.together((self.own(robot, letter), 1) for robot, letter in held.items())


def plain_names(formula: Formula) -> frozenset[str]:
    """Return the names of a written-out formula that are no single robot's and are not counted."""
    found, stack, seen = set[str](), [formula], set[int]()
    while stack:
        node = stack.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        if node.operator == "name" and not node.robot:
            found.add(node.name)
        elif node.operator != "count":
            stack.extend(node.arguments)
    return frozenset(found)
