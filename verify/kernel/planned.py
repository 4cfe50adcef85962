"""Planned words: every team word that keeps the plan's waits satisfies the formula, whatever the times.

Robots come to the letters of their words one after another, at any times and at one instant as well. Of a wait the second event comes after
the first one, not with it. So places are letters, and all of them are possible in one span (`team`); the invariant is as in `words`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction

from .evidence import Evidence
from .formulas import Tree, conjuncts
from .labels import Relations, Timeline
from .places import Places, Slot
from .refused import Refused
from .statement import Robot, Statement
from .team import At, Claim, Step, Team
from .words import check_invariant, read_invariant

_Event = tuple[str, int]
"""A robot, and the number of the letter that it comes to."""


def check_ordered(statement: Statement, evidence: Evidence) -> None:
    """Check that planned words satisfy the formula in every order that keeps the waits.

    Raises:
        Refused: That is not proved.
    """
    for number, tree in enumerate(conjuncts(statement.formula)):
        check_invariant(*read_invariant(PlannedClaim(statement, tree), evidence.get(f"ordered/{number}")))


class PlannedClaim(Claim):
    """One conjunct, and the team with its planned words.

    Args:
        statement: Has words and waits.
        tree: The conjunct.
    """

    def __init__(self, statement: Statement, tree: Tree) -> None:
        untimed = {name: Timeline(name, Fraction(0), {}, frozenset(), (), None) for name in statement.robots}
        super().__init__(statement, untimed, Relations(frozenset(), frozenset()), tree)
        if set(statement.words) != set(self.robots) or not all(statement.words.values()):
            raise Refused("a robot has no planned word")
        self.waits = tuple(_waits(statement))
        self._require_an_end()

    def _require_an_end(self) -> None:
        """Refuse waits that go round in a circle: no flight keeps them."""
        at = dict.fromkeys(self.robots, 0)
        goes = True
        while goes:
            goes = False
            for name, letter in at.items():
                free = all(at[first] >= number for (first, number), then in self.waits if then == (name, letter + 1))
                if free and letter + 1 < len(self.statement.words[name]):
                    at[name], goes = letter + 1, True
        if any(letter + 1 < len(self.statement.words[name]) for name, letter in at.items()):
            raise Refused("robots wait for each other in a circle")

    def places(self, robot: str, names: frozenset[str]) -> Places:
        """Return one robot's letters, cut down to some names."""
        letters = tuple(letter & names for letter in self.statement.words[robot])
        slot, size = Slot(Fraction(0), Fraction(0), (), frozenset(), 0, 0), len(letters)
        return Places(
            robot, (slot,) * size, letters, letters, ((slot.start, slot.stop),) * size,
            (*((place + 1,) for place in range(size - 1)), ()), (0,), frozenset({size - 1}),
        )  # fmt: skip

    def made(self, followed: Sequence[Places], others: Sequence[Places], error: Fraction) -> Team:
        """Return the team's moves, which keep the waits.

        Args:
            followed: Words of robots that are followed.
            others: Words of all others.
            error: None counts here: there are no times.
        """
        return _PlannedTeam(self, followed, others, error)


class _PlannedTeam(Team):
    def __init__(self, claim: PlannedClaim, followed: Sequence[Places], others: Sequence[Places], error: Fraction) -> None:
        super().__init__(claim, followed, others, error)
        index = {places.robot: number for number, places in enumerate(followed)}
        self._waits = [
            (index[first], i, index[then], j) for (first, i), (then, j) in claim.waits if first in index and then in index
        ]

    def moves(self, span: int, at: At, read: int) -> Iterator[Step]:
        """Yield what may happen: a robot that waits comes to its letter when what it waits for was over before."""
        for step in super().moves(span, at, read):
            if not any(at[then] < j == step[1][then] and at[first] < i for first, i, then, j in self._waits):
                yield step


def _waits(statement: Statement) -> Iterator[tuple[_Event, _Event]]:
    """Yield the events that waits are between; not those that are over from the beginning, or never wait."""
    regions = frozenset(statement.regions)
    for wait in statement.waits:
        (first, visit), (then, other) = wait.first, wait.then
        entered, left, acts = _visits(statement, first)[visit]
        done = {"entered": entered, "left": left, "acted": max(acts, default=entered)}[wait.done]
        visits = _visits(statement, then)
        enters, leaves, acts = visits[other]
        if wait.due == "sets out":  # whatever it comes to or leaves first after it has set out
            shown = [letter & regions for letter in statement.words[then]]
            changes = (number for number, inside in enumerate(shown) if inside != shown[0])
            sets_out = visits[other - 1][1] if other else next(changes, None)
            due: int | None = enters if sets_out is None else min(enters, sets_out)
        else:
            due = {"enters": enters, "leaves": leaves, "acts": min(acts, default=None)}[wait.due]
        if due and done is None:
            raise Refused(f"{then} waits until {first} has left where it stays")
        if due and done:
            yield (first, done), (then, due)


def _visits(statement: Statement, name: str) -> list[tuple[int, int | None, list[int]]]:
    """Return for each planned visit the first letter in its region, the first one after it, and those that its actions make.

    Raises:
        Refused: The word shows other visits.
    """
    robot, word, regions = statement.robots[name], statement.words[name], frozenset(statement.regions)
    stays: list[tuple[int, int | None, str]] = []
    for region in sorted(regions):
        inside = [region in letter for letter in word]
        for number, here in enumerate(inside):
            if here and (number == 0 or not inside[number - 1]):
                after = next((k for k in range(number, len(word)) if not inside[k]), None)
                stays.append((number, after, region))
    stays.sort(key=lambda stay: (stay[0], 0 if stay[0] else len(word) if stay[1] is None else stay[1], stay[2]))
    if len(stays) == len(robot.visits) + 1 and stays[0][0] == 0:
        stays.pop(0)  # it starts there, and no visit is counted for that
    changes = [k for k in range(1, len(word)) if word[k] - regions != word[k - 1] - regions]
    made = [_seen(robot, number) for number in range(len(robot.visits))]
    if [region for _, _, region in stays] != [visit.region for visit in robot.visits] or sum(made) != len(changes):
        raise Refused(f"the planned word of {name} does not show its visits and actions")
    acts = [[changes.pop(0) for _ in range(count)] for count in made]
    return [(first, after, own) for (first, after, _), own in zip(stays, acts, strict=True)]


def _seen(robot: Robot, visit: int) -> int:
    """Return how many of a visit's actions change what the robot shows."""
    return sum(deed.visit == visit and robot.states.get(deed.before) != robot.states.get(deed.after) for deed in robot.changes)
