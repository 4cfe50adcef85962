"""The formula's state while a team flies: satisfied, violated, or still open, whatever comes.

For each part of the formula's topmost conjunction the states are kept that any team word over the letters so far may have led
to. Under `team: own` a team word reads robots one by one: each robot at least once in each of its letters, at
any time while it holds it, and any number of times more. Under `team: joint` it is the sequence of unions, changes that
fall on one sample taken in either order or together.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Literal

from verify.data import Formula, Letter, Mission
from verify.data.language.counting import atoms
from verify.data.sections import TeamReading
from verify.logic.explanation import show
from verify.logic.normal_form import conjuncts, normal_form, to_formula
from verify.logic.progression import REFUTED, SETTLED, Automaton, OutOfBudget
from verify.logic.team_letters import TeamLetters

FormulaVerdict = Literal["open", "satisfied", "violated", "undecided"]

PartState = Literal["done", "kept", "to do", "broken"]
"""State of a part of a formula: it holds whatever comes; it holds if the flight ended now; it does not yet; it cannot any more."""

MAX_TOGETHER = 8
"""Most robots whose letters may change on one sample; with more the state is undecided."""

MAX_CONFIGURATIONS = 20_000


def has_formula(mission: Mission) -> bool:
    """Return whether a flown path can break or satisfy a mission's formula: it may fly a sequence alone, or ask for `true`."""
    return mission.spec.formula not in (None, "true")


class FormulaState:
    """Follows the letters of a team.

    Attributes:
        verdict: Of the formula so far.
        broken: The part that cannot hold any more, or None.
    """

    def __init__(
        self, formula: Formula, reading: TeamReading, letters: Iterable[Letter], robots: Iterable[str] | None = None
    ) -> None:
        """Begin with the letters that the robots show first.

        Args:
            formula: What is to hold; written out for the team.
            reading: Whether letters are the robots' own or joint.
            letters: One for each robot.
            robots: Their names, where the formula names any.
        """
        held = list(letters)
        self.verdict: FormulaVerdict = "open"
        self.broken: str | None = None
        self._letters = held
        self._to_do: tuple[str, ...] | None = None
        try:
            normals = conjuncts(normal_form(formula))
            known = atoms(formula)
            names = list(robots) if robots is not None else [""] * len(held)
            self._parts = [
                _Own(show(to_formula(normal)), Automaton(normal), held)
                if reading == "own"
                else _Joint(show(to_formula(normal)), Automaton(normal), held, names, TeamLetters.of(normal, known))
                for normal in normals
            ]
        except OutOfBudget:
            self._parts = []
            self.verdict = "undecided"
        self._judge()

    def change(self, letters: Mapping[int, Letter]) -> FormulaVerdict:
        """Take the new letters of those robots (by index) that changed at one time; return the verdict."""
        changed = {robot: letter for robot, letter in letters.items() if letter != self._letters[robot]}
        self._to_do = None
        if len(changed) > MAX_TOGETHER and self.verdict == "open":
            self.verdict = "undecided"
        if changed and self.verdict == "open":
            try:
                for part in self._parts:
                    part.change(changed)
            except OutOfBudget:
                self.verdict = "undecided"
        for robot, letter in changed.items():
            self._letters[robot] = letter
        self._judge()
        return self.verdict

    @property
    def to_do(self) -> tuple[str, ...]:
        """The parts that would not hold if the flight ended now: what is still to be done."""
        if self._to_do is None:
            left = (part.text for part in self._parts if not part.settled and not part.ends_well())
            self._to_do = tuple(left) if self.verdict == "open" else ()
        return self._to_do

    @property
    def parts(self) -> tuple[tuple[str, PartState], ...]:
        """Each part of the topmost conjunction with its state."""
        return tuple((part.text, _state(part)) for part in self._parts)

    def end(self, *, finite: bool) -> FormulaVerdict:
        """Return the verdict when the flight is over; over infinite traces what is open stays open."""
        if self.verdict == "open" and finite:
            failing = [part.text for part in self._parts if not part.ends_well()]
            self.verdict, self.broken = ("violated", failing[0]) if failing else ("satisfied", None)
        return self.verdict

    def _judge(self) -> None:
        if self.verdict != "open":
            return
        refuted = [part.text for part in self._parts if part.refuted]
        if refuted:
            self.verdict, self.broken = "violated", refuted[0]
        elif all(part.settled for part in self._parts):
            self.verdict = "satisfied"


def _state(part: _Own | _Joint) -> PartState:
    if part.refuted:
        return "broken"
    return "done" if part.settled else "kept" if part.ends_well() else "to do"


class _Own:
    """One part under `own`: pairs of what remains, and a mask of the robots whose present letter is unread."""

    def __init__(self, text: str, automaton: Automaton, letters: list[Letter]) -> None:
        self.text, self._automaton = text, automaton
        self._letters = [automaton.cut(letter) for letter in letters]
        self._now = self._closed({(automaton.initial, (1 << len(letters)) - 1)}, self._letters)

    @property
    def refuted(self) -> bool:
        return any(rest == REFUTED for rest, _ in self._now)

    @property
    def settled(self) -> bool:
        return all(rest == SETTLED for rest, _ in self._now)

    def change(self, changed: Mapping[int, Letter]) -> None:
        new = {robot: self._automaton.cut(letter) for robot, letter in changed.items()}
        new = {robot: letter for robot, letter in new.items() if letter != self._letters[robot]}
        after: dict[frozenset[int], set[tuple[int, int]]] = {frozenset(): self._now}
        for _ in new:  # every order of the changes, by the set of those that have happened
            grown: dict[frozenset[int], set[tuple[int, int]]] = {}
            for done, configurations in after.items():
                for robot in new.keys() - done:
                    letters = [new[i] if i in done or i == robot else old for i, old in enumerate(self._letters)]
                    bit = 1 << robot
                    begun = {(rest, unread | bit) for rest, unread in configurations if not unread & bit}
                    grown.setdefault(done | {robot}, set()).update(self._closed(begun, letters))
            after = grown
        (self._now,) = after.values()
        self._letters = [new.get(i, old) for i, old in enumerate(self._letters)]

    def ends_well(self) -> bool:
        return all(self._automaton.accepts(rest) for rest, unread in self._now if not unread)

    def _closed(self, configurations: set[tuple[int, int]], letters: list[Letter]) -> set[tuple[int, int]]:
        found, stack = set(configurations), list(configurations)
        while stack:
            rest, unread = stack.pop()
            for robot, letter in enumerate(letters):
                reached = (self._automaton.step(rest, letter), unread & ~(1 << robot))
                if reached not in found:
                    found.add(reached)
                    stack.append(reached)
            if len(found) > MAX_CONFIGURATIONS:
                raise OutOfBudget(f"more than {MAX_CONFIGURATIONS} readings of the flight so far")
        # Before its first reading a team word is empty, which is no trace.
        return found


class _Joint:
    """One part under `joint`: what may remain after the unions so far."""

    def __init__(self, text: str, automaton: Automaton, letters: list[Letter], names: list[str], reader: TeamLetters) -> None:
        self.text, self._automaton = text, automaton
        self._names, self._reader = names, reader
        self._letters = [reader.own(name, letter) for name, letter in zip(names, letters, strict=True)]
        self._now = {automaton.step(automaton.initial, reader.together((letter, 1) for letter in self._letters))}

    @property
    def refuted(self) -> bool:
        return REFUTED in self._now

    @property
    def settled(self) -> bool:
        return self._now == {SETTLED}

    def change(self, changed: Mapping[int, Letter]) -> None:
        robots = sorted(changed)
        full = (1 << len(robots)) - 1
        reached: list[set[int]] = [set() for _ in range(full + 1)]
        reached[0] = self._now
        for done in range(full + 1):
            rest = full & ~done
            more = rest
            while more:  # every non-empty set of further changes that happen together
                together = done | more
                union = self._reader.together(
                    (self._reader.own(self._names[i], changed[i]), 1)
                    if i in changed and together >> robots.index(i) & 1
                    else (letter, 1)
                    for i, letter in enumerate(self._letters)
                )
                reached[together].update(self._automaton.step(state, union) for state in reached[done])
                more = (more - 1) & rest
        self._now = reached[full]
        for robot, letter in changed.items():
            self._letters[robot] = self._reader.own(self._names[robot], letter)

    def ends_well(self) -> bool:
        return all(self._automaton.accepts(rest) for rest in self._now)
