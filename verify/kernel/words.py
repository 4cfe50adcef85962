"""Formulas of flights: an inductive invariant of all words that a team may give.

Each conjunct is proved by itself. Suppose a word of the team breaks it: it satisfies the conjunct's negation (`formulas`). A *configuration* is a
place of each robot that is followed (`team`), who of them was read since its letter changed, and one alternative that is owed. For each span of time
the proof lists configurations; the kernel checks that they cover all that may come up:

1. how the flight may begin;
2. what each move in a span makes of a configuration of that span;
3. each configuration in the next span, where its places are possible there;
4. and that the empty word keeps no alternative with which the flight may end. So no word satisfied the negation.

A configuration is covered by one with the same places, as many robots read or more, and no more owed (Coq: `check_invariant_sound`).

*Laps.* Configurations have a level, which never rises. Each level names an until, which every reading within the level puts off, or the lap, which is
then not gone round within it. A flight goes round for ever, and so ends within an until's level, which is put off for ever (Coq: `check_laps_sound`).

*Planned words.* Every team word that keeps the plan's waits satisfies the formula, whatever the times. Robots come to the letters of their words one
after another, at any times and at one instant as well. Of a wait the second event comes after the first, not with it. Places are letters, in one span.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from .formulas import Owed, conjuncts
from .statement import ZERO, Statement, read, require
from .team import At, Claim, Places, Step, Team, Wait, places_of
from .timelines import Span, Stay, Timeline, event, joined, planned_stays, stays
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


def check_words(claims: Iterable[tuple[str, Claim]], evidence: Evidence) -> bool:
    """Check that every word that is possible satisfies each conjunct, by the invariant that the evidence has for it."""
    for key, claim in claims:
        _check_invariant(*read_invariant(claim, evidence.get(key, Any)))
    return True


def read_invariant(claim: Claim, data: object) -> tuple[Team, list[int | None], list[list[Configuration]]]:
    """Read a team, what each level names, and the configurations of each span."""
    followed, more, owed, levels, sets, runs = read(_WRITTEN, data, "an invariant")
    require(len({*followed} & {*claim.robots}) == len(followed), "an invariant follows robots that there are not")
    untils = {*levels} <= {None, *(2 * number for number, (sign, _) in enumerate(claim.table.nodes) if sign == "until")}
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


def _check_invariant(team: Team, levels: Sequence[int | None], sets: Sequence[Sequence[Configuration]]) -> None:
    """Check that configurations of each span cover all that may come up, and that none ends well for the negation; levels name an until, or the lap."""
    table, known = team.claim.table, [defaultdict[At, list[Configuration]](list) for _ in sets]
    require(len(sets) == team.size, "the proof has another number of spans than the flight")
    for span, here in enumerate(sets):
        for one in here:
            known[span][one.at].append(one)

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
                breaks = team.may_end((at, seen)) and table.empty_word_keeps(owed)
                require(not breaks, "the flight may end with the formula broken")


def flown(statement: Statement, timelines: Mapping[str, Timeline]) -> Iterator[tuple[str, Claim]]:
    """Yield each conjunct, by the key of its evidence, with the team as it flies; all timelines end together."""
    line = next(iter(timelines.values()))
    lap = None if line.cycle is None else (line.cycle, line.duration)
    for number, tree in enumerate(conjuncts(statement.formula)):
        yield f"formula/{number}", Claim(statement, tree, lambda robot, names: places_of(timelines[robot], names), lap)


def planned(statement: Statement) -> Iterator[tuple[str, Claim]]:
    """Yield each conjunct, as above, with the team and its planned words; some flight has to keep their waits."""
    words = statement.words
    fits = set(words) == set(statement.robots) and all(words.values()) and not statement.lasso
    require(fits, "a robot has no planned word, or laps")
    at, needed, waits = (
        dict.fromkeys(words, 0),
        defaultdict[tuple[str, int], list[tuple[str, int]]](list),
        list(waits_between(statement)),
    )
    for first, then in waits:
        needed[then].append(first)
    while free := [name for name, k in at.items() if words[name][k + 1 :] and all(at[a] >= i for a, i in needed[name, k + 1])]:
        at.update((name, at[name] + 1) for name in free)
    require(all(words[name][k:] == words[name][-1:] for name, k in at.items()), "robots wait for each other in a circle")

    def find(robot: str, names: frozenset[str]) -> Places:
        letters = [letter & names for letter in words[robot]]
        size, following = len(letters), [[place + 1] for place in range(len(letters) - 1)]
        return Places(robot, [0] * size, letters, letters, [(ZERO, ZERO)] * size, [*following, []], [0], frozenset({size - 1}))

    for number, tree in enumerate(conjuncts(statement.formula)):
        yield f"ordered/{number}", Claim(statement, tree, find, waits=waits)


def waits_between(statement: Statement) -> Iterator[Wait]:
    """Yield the events that waits are between; not those that are over from the beginning, or never wait."""
    regions = frozenset(statement.regions)
    for (first, visit), (then, other), what_is_done, what_is_due in statement.waits:
        stay, acts = _visits(statement, first)[visit]
        done = event(what_is_done, (stay, acts or [stay.start], Fraction(len(statement.words[first]))))
        its, word, end = _visits(statement, then), statement.words[then], Fraction(len(statement.words[then]))
        if what_is_due == "sets out":  # whatever it comes to or leaves first after it has set out
            changes = (Fraction(k) for k, letter in enumerate(word) if letter & regions != word[0] & regions)
            sets_out = event("leaves", (*its[other - 1], end)) if other else next(changes, None)
            due = its[other][0].start if sets_out is None else min(its[other][0].start, sets_out)
        else:
            due = event(what_is_due, (*its[other], end))
        if due:
            require(done is not None, f"{then} waits until {first} has left where it stays")
        if due and done:
            yield (first, int(done)), (then, int(due))


def _visits(statement: Statement, name: str) -> list[tuple[Stay, list[Fraction]]]:
    """Return of each planned visit, which the word has to show, its letters as a stay, and those that its actions make."""
    robot, word, regions = statement.robots[name], statement.words[name], frozenset(statement.regions)
    times = [Fraction(k) for k in range(len(word) + 1)]
    marks = {region: ["must" if region in letter else "no" for letter in word] for region in regions}
    rows = {region: joined(map(Span, times, times[1:], row)) for region, row in marks.items()}
    shown = sorted(stays(rows), key=lambda stay: (stay.start, 0 if stay.start else stay.stop, stay.region))
    _, made = planned_stays(robot.visits, shown)
    changes = [times[k] for k in range(1, len(word)) if word[k] - regions != word[k - 1] - regions]
    seen = [deed.visit for deed in robot.changes if robot.states.get(deed.before) != robot.states.get(deed.after)]
    require(len(seen) == len(changes), f"the planned word of {name} does not show its actions")
    return [(stay, [changes.pop(0) for _ in range(seen.count(number))]) for number, stay in enumerate(made)]
