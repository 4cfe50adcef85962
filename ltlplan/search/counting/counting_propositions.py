"""Counting propositions: sums over the team of marks that each robot's letter makes (cLTL+: Sahin, Nilsson and Ozay 2020)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from ltlplan.logic.automaton import DEAD, Automaton
from ltlplan.search.joint.conjuncts import JointConjunct
from ltlplan.search.memoization import memoized
from ltlplan.search.numbering import Numbers
from verify.data import Formula, InternalError, Letter
from verify.data.language.counting import Atom

Sums = tuple[int, ...]
"""How many robots make each mark."""
States = tuple[int, ...]
"""The states of all conjuncts' automata."""


NEVER = 1 << 30
"""More robots than any team has."""


class Marks:
    """The marks of a formula's propositions, and its conjuncts' automata over the propositions that sums make true.

    Attributes:
        parts: One automaton for each conjunct.
        conjuncts: The same, each reading the sums of the marks that it sees, and no others.
        levels: For each proposition, by bit, its mark and the least sum that makes it true.
        initial: The states of all conjuncts before the first letter.
        named: The robots that the formula names.
        atoms: The formula's propositions that are no plain names.
    """

    def __init__(
        self, automata: Sequence[Automaton], atoms: dict[str, Atom], between: Mapping[str, tuple[int, int]] | None = None
    ) -> None:
        """Number the marks that automata ask for.

        Args:
            automata: One for each conjunct.
            atoms: The formula's propositions that are no plain names.
            between: For texts of what is counted, how few and how many robots there is room for to show it: other counts are never true.
        """
        self._automata, self.atoms = automata, atoms
        asked = sorted({name for automaton in automata for name in automaton.propositions})
        numbers = Numbers[tuple[str, Formula]]()  # of whose alone, and what its letter must satisfy
        self.levels: list[tuple[int, int]] = []
        for text in asked:
            plain = Formula("name", (), text)
            atom = atoms.get(text) or Atom(plain, "", plain, 1)
            few, many = (
                (between or {}).get(str(atom.counted), (0, atom.least)) if text in atoms and not atom.robot else (0, atom.least)
            )
            level = NEVER if atom.least > many else 0 if atom.least <= few else atom.least
            self.levels.append((numbers[atom.robot, atom.counted], level))
        bit = {name: 1 << i for i, name in enumerate(asked)}
        self._marks, self.parts = numbers.known, tuple(JointConjunct(automaton, bit) for automaton in automata)
        self.conjuncts = tuple(ConjunctMarks(part, self.levels, [robot for robot, _ in self._marks]) for part in self.parts)
        self.initial = tuple(part.initial for part in self.parts)
        self.named = frozenset(robot for robot, _ in self._marks if robot)

    def where(self, between: Mapping[str, tuple[int, int]], laws: Sequence[Automaton] = ()) -> Marks:
        """Return the same propositions where counts that there is no room for are never true.

        Args:
            between: For texts of what is counted, how few and how many robots there is room for to show it.
            laws: Automata of what is kept besides.
        """
        return Marks((*self._automata, *laws), self.atoms, between)

    def of(self, robot: str, letter: Letter) -> Sums:
        """Return the marks that one robot's letter makes, each 0 or 1."""
        return self._made(robot if robot in self.named else "", letter)

    @memoized
    def _made(self, robot: str, letter: Letter) -> Sums:
        return tuple(int((not who or who == robot) and shows(counted, letter)) for who, counted in self._marks)

    @memoized
    def letter(self, sums: Sums) -> int:
        """Return the team's letter, as bits over the propositions."""
        return sum(1 << i for i, (mark, least) in enumerate(self.levels) if sums[mark] >= least)

    def read(self, states: States, sums: Sums) -> States | None:
        """Return the states after one more letter; None where the task is lost."""
        return self._after(states, self.letter(sums))

    @memoized
    def _after(self, states: States, letter: int) -> States | None:
        found = tuple(part.step(state, letter) for part, state in zip(self.parts, states, strict=True))
        return None if DEAD in found else found

    def accepting(self, states: States) -> bool:
        """Tell whether everything is done."""
        return all(part.accepting(state) for part, state in zip(self.parts, states, strict=True))


class ConjunctMarks:
    """One conjunct of a formula, as it reads a team: only the sums of the marks that it sees.

    Attributes:
        part: Its automaton.
        seen: The marks, by number, that it depends on.
        robot: The robot that all of these are of; empty where there is none, or several.

    Args:
        part: Its automaton.
        levels: For each proposition, by bit, its mark and the least sum that makes it true.
        robots: For each mark the robot that it is of; empty for those of any robot.
    """

    def __init__(self, part: JointConjunct, levels: Sequence[tuple[int, int]], robots: Sequence[str]) -> None:
        asked = [(bit, *level) for bit, level in enumerate(levels) if part.mask >> bit & 1]
        self.part, self.seen = part, tuple(sorted({mark for _, mark, _ in asked}))
        self._asked = [(1 << bit, self.seen.index(mark), least) for bit, mark, least in asked]
        of = {robots[mark] for mark in self.seen}
        self.robot = of.pop() if len(of) == 1 else ""

    def cut(self, marks: Sums) -> Sums:
        """Return what the conjunct sees of marks or of their sums."""
        return tuple([marks[mark] for mark in self.seen])

    @memoized
    def read(self, state: int, sums: Sums) -> int:
        """Return the state after a letter, or `DEAD`.

        Args:
            state: Before it.
            sums: Cut to what the conjunct sees.
        """
        return self.part.step(state, sum(bit for bit, place, least in self._asked if sums[place] >= least))


def true_atoms(known: Mapping[str, Atom], held: Iterable[tuple[str, Letter]]) -> frozenset[str]:
    """Return which propositions of single robots, and of how many they are, hold of a team.

    Args:
        known: The propositions, by their text.
        held: Robots, with the letter that each shows.
    """
    team = tuple(held)
    return frozenset(
        text
        for text, atom in known.items()
        if sum(shows(atom.counted, letter) for robot, letter in team if atom.robot in ("", robot)) >= atom.least
    )


def shows(counted: Formula, letter: Letter) -> bool:
    """Tell whether one robot's letter satisfies a Boolean combination of names.

    Args:
        counted: The combination.
        letter: What the robot shows.

    Raises:
        InternalError: It is no Boolean combination.
    """
    if counted.operator == "name":
        return counted.name in letter
    parts = [shows(argument, letter) for argument in counted.arguments]
    match counted.operator:
        case "true" | "false":
            return counted.operator == "true"
        case "!":
            return not parts[0]
        case "&" | "|":
            return all(parts) if counted.operator == "&" else any(parts)
        case "->":
            return not parts[0] or parts[1]
        case "xor" | "<->":
            return (parts[0] == parts[1]) == (counted.operator == "<->")
        case _:
            raise InternalError(f"`{counted}` stands in a count. This is a bug of ltlplan's.")
