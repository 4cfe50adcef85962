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

*Planned words.* Every team word that keeps the plan's waits satisfies the formula, whatever the times. Robots come to the letters of their words one after
another, at any times and at one instant as well. Of a wait the second event comes after the first one, not with it. So places are letters, and all of
them are possible in one span.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from .formulas import Owed, Tree, conjuncts, show
from .places import Places, places_of
from .statement import ZERO, Statement, read, require
from .team import At, Claim, Event, Step, Team
from .timelines import Span, Timeline, planned_stays, stays
from .trees import Evidence

_WRITTEN = tuple[
    tuple[str, ...], tuple[str, ...], tuple[frozenset[int], ...], tuple[int | None, ...], tuple[tuple[tuple[int, ...], ...], ...],
    tuple[tuple[int, int], ...],
]  # fmt: skip
"""Robots that are followed; names to which letters are cut down besides; alternatives; levels, of which None is the lap; sets of configurations;
pairs (set, for how many spans). A configuration is a list: its alternative's number, its level, its robots that were read, and its places."""


class Configuration(NamedTuple):
    """Places of the robots that are followed, who was read (bits), what is owed, and the level."""

    at: At
    read: int
    owed: Owed
    level: int = 0


def check_formula(statement: Statement, timelines: Mapping[str, Timeline], evidence: Evidence) -> str:
    """Check that every word that the timelines leave possible satisfies the formula.

    Args:
        statement: Has the formula, and how words are read.
        timelines: One for each robot.
        evidence: Has under `formula/0` and so on for each conjunct an invariant.
    """
    for number, tree in enumerate(conjuncts(statement.formula)):
        claim = flown(statement, timelines, tree)
        check_invariant(*read_invariant(claim, evidence.get(f"formula/{number}", Any)))
    return f"Every word of the team satisfies {show(statement.formula)}."


def check_ordered(statement: Statement, evidence: Evidence) -> str:
    """Check that planned words satisfy the formula in every order that keeps the waits."""
    for number, tree in enumerate(conjuncts(statement.formula)):
        check_invariant(*read_invariant(planned(statement, tree), evidence.get(f"ordered/{number}", Any)))
    return "The planned words satisfy the formula in every order that keeps the waits."


def read_invariant(
    claim: Claim, data: Any
) -> tuple[Team, list[int | None], list[list[Configuration]]]:  # of any type: JSON nests
    """Read a team, what each level names, and the configurations of each span."""
    followed, more, owed, levels, sets, runs = read(_WRITTEN, data, "an invariant")
    require(len({*followed} & {*claim.robots}) == len(followed), "an invariant follows robots that there are not")
    untils = {*levels} <= {None, *claim.table.untils()}
    known = all(part < 2 * len(claim.table.nodes) for one in owed for part in one)
    require(levels and untils and known, "an invariant names no untils, or parts that there are not")
    team = Team(claim, followed, frozenset(more))
    limits = [len(owed), len(levels), 1 << len(followed), *(len(one.letters) for one in team.followed)]
    every = [one for here in sets for one in here]
    fits = all(len(one) == len(limits) and all(a < b for a, b in zip(one, limits, strict=True)) for one in every)
    require(fits, "a configuration names what the proof or the flight does not have")
    found = [[Configuration(tuple(at), seen, owed[which], level) for which, level, seen, *at in here] for here in sets]
    spans: list[list[Configuration]] = []
    for which, times in runs:
        require(which < len(found) and times <= team.size - len(spans), "the proof has another number of spans than the flight")
        spans += [found[which]] * times
    return team, list(levels), spans


def check_invariant(team: Team, levels: Sequence[int | None], sets: Sequence[Sequence[Configuration]]) -> None:
    """Check that configurations cover all that may come up, and that none ends well for the negation.

    Args:
        team: The team.
        levels: What each level names: an until of the table, or None, the lap; of finite flights there is one, the lap.
        sets: Configurations of each span.
    """
    table, known = team.claim.table, list[dict[At, list[Configuration]]]()
    require(len(sets) == team.size, "the proof has another number of spans than the flight")
    for here in sets:
        known.append({})
        for one in here:
            known[-1].setdefault(one.at, []).append(one)

    def cover(span: int, level: int, owed: Owed, step: Step, *, lap: bool = False) -> None:
        """Refuse what a step makes of a configuration unless it is covered, on its own level only if the step may stay there."""
        letter, (at, seen) = step
        name = levels[min(level, len(levels) - 1)]
        for then, off in [(owed, owed)] if letter is None else table.after(letter, owed):
            above = level if (not lap if name is None else letter is None or name in off) else level - 1
            near = known[span].get(at, ())
            covered = any(one.read & seen == seen and one.owed <= then and one.level <= above for one in near)
            require(covered, "the proof leaves out what may come up")

    for step in team.begin():
        cover(0, len(levels), frozenset({table.root}), step)
    for span, here in enumerate(sets):
        for at, seen, owed, level in here:
            for step in team.moves(span, (at, seen)):
                cover(span, level, owed, step)
            if span + 1 < team.size or team.back is not None:
                then, steps = team.handed(span, (at, seen))
                for step in steps:
                    cover(then, level, owed, step, lap=then <= span)
            else:
                ends = team.may_end((at, seen)) and table.empty_word_keeps(owed)
                require(not ends, "the flight may end with the formula broken")


def flown(statement: Statement, timelines: Mapping[str, Timeline], tree: Tree) -> Claim:
    """Return a conjunct, and the team as it flies.

    Args:
        statement: Has the regions, and how words are read.
        timelines: One for each robot; all flights, or first laps, end together.
        tree: The conjunct.
    """
    line = next(iter(timelines.values()))
    claim = Claim(statement, tree, lambda robot, names: places_of(timelines[robot], names))
    claim.lap = None if line.cycle is None else (line.cycle, line.duration)
    return claim


def planned(statement: Statement, tree: Tree) -> Claim:
    """Return a conjunct, and the team with its planned words; some flight has to keep their waits."""
    words, at, goes = statement.words, dict.fromkeys(statement.words, 0), True
    require(set(words) == set(statement.robots) and all(words.values()), "a robot has no planned word")
    require(not statement.lasso, "planned words have laps")
    waits = list(waits_between(statement))
    while goes:
        goes = False
        for name, letter in at.items():
            free = all(at[first] >= number for (first, number), then in waits if then == (name, letter + 1))
            if free and letter + 1 < len(words[name]):
                at[name], goes = letter + 1, True
    require(all(at[name] + 1 == len(word) for name, word in words.items()), "robots wait for each other in a circle")

    def find(robot: str, names: frozenset[str]) -> Places:
        letters = [letter & names for letter in words[robot]]
        size, following = len(letters), [[place + 1] for place in range(len(letters) - 1)]
        return Places(robot, [0] * size, letters, letters, [(ZERO, ZERO)] * size, [*following, []], [0], frozenset({size - 1}))

    claim = Claim(statement, tree, find)
    claim.waits = waits
    return claim


def waits_between(statement: Statement) -> Iterator[tuple[Event, Event]]:
    """Yield the events that waits are between; not those that are over from the beginning, or never wait."""
    regions = frozenset(statement.regions)
    for (first, visit), (then, other), what_is_done, what_is_due in statement.waits:
        enters, left, acts = _visits(statement, first)[visit]
        done = {"entered": enters, "left": left, "acted": max(acts, default=enters)}[what_is_done]
        its = _visits(statement, then)
        enters, leaves, acts = its[other]
        if what_is_due == "sets out":  # whatever it comes to or leaves first after it has set out
            shown = [letter & regions for letter in statement.words[then]]
            changes = (number for number, inside in enumerate(shown) if inside != shown[0])
            sets_out = its[other - 1][1] if other else next(changes, None)
            due: int | None = enters if sets_out is None else min(enters, sets_out)
        else:
            due = {"enters": enters, "leaves": leaves, "acts": min(acts, default=None)}[what_is_due]
        if due:
            require(done is not None, f"{then} waits until {first} has left where it stays")
        if due and done:
            yield (first, done), (then, due)


def _visits(statement: Statement, name: str) -> list[tuple[int, int | None, list[int]]]:
    """Return of each planned visit, which the word has to show, the first letter in its region, the first one after it, and those of its actions."""
    robot, word, regions = statement.robots[name], statement.words[name], frozenset(statement.regions)
    times = [Fraction(k) for k in range(len(word) + 1)]
    marks = {region: ["must" if region in letter else "no" for letter in word] for region in regions}
    rows = {region: tuple(map(Span, times, times[1:], row)) for region, row in marks.items()}
    shown = sorted(stays(rows), key=lambda stay: (stay.start, 0 if stay.start else stay.stop, stay.region))
    _, made = planned_stays(robot.visits, shown)
    changes = [k for k in range(1, len(word)) if word[k] - regions != word[k - 1] - regions]
    seen = [deed.visit for deed in robot.changes if robot.states.get(deed.before) != robot.states.get(deed.after)]
    require(len(seen) == len(changes), f"the planned word of {name} does not show its actions")
    acts = [[changes.pop(0) for _ in range(seen.count(number))] for number in range(len(made))]
    ends = [None if stay.stop == len(word) else int(stay.stop) for stay in made]
    return [(int(stay.start), left, own) for stay, left, own in zip(made, ends, acts, strict=True)]
