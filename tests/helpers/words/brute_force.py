"""An evaluator that shares nothing with judge or planner: whether *some* word of a team breaks a formula, decided backwards.

What a formula and its parts are worth at a position follows from the letter there and from what they are worth at the next one. So all that
the words from a configuration on can make of a formula is a set of truth vectors, and those sets are the least that are closed under
stepping backwards. No automaton, no normal form and no progression is made; words are as long as they like.

`Together` are the words of robots whose letters are given, in any interleaving; `Timed` those of robots whose timelines are given, on a
grid of half the unit of the timelines' whole times (half a unit stands for the gap between two).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from random import Random
from typing import Protocol

from tests.helpers.words.plain_team_words import holds
from verify.data import Formula, Letter
from verify.model_checking.timeline import Change, Timeline

Held = Mapping[str, Letter]
Edge = tuple[Held | None, Hashable]
"""What is read on the way (None: nothing), and the configuration that follows."""

_ATOMS = frozenset({"true", "false", "name", "count", "all", "some"})


class Words(Protocol):
    """Words as paths of a graph."""

    def initial(self) -> Iterable[Hashable]: ...
    def edges(self, at: Hashable) -> Iterable[Edge]: ...
    def is_final(self, at: Hashable) -> bool: ...


class Vectors:
    """A formula's parts, children before parents, and what they are worth from one position to the one before."""

    def __init__(self, formula: Formula, robots: Sequence[str]) -> None:
        self.robots = robots
        self.nodes: list[tuple[str, tuple[int, ...], Callable[[Held], bool] | None]] = []
        self._index: dict[tuple[Formula, str | None], int] = {}
        self._stepped: dict[tuple[tuple[Letter, ...], int | None], int] = {}
        self.root = self._added(formula, None)

    def _added(self, formula: Formula, me: str | None) -> int:
        key = (formula, me)
        if key not in self._index:
            if formula.operator in _ATOMS:
                node = ("atom", (), lambda held: holds(formula, [held], 0, me))
            elif formula.operator == "each":
                node = ("each", tuple(self._added(formula.arguments[0], robot) for robot in self.robots), None)
            else:
                node = (formula.operator, tuple(self._added(part, me) for part in formula.arguments), None)
            self._index[key] = len(self.nodes)
            self.nodes.append(node)
        return self._index[key]

    def before(self, held: Held, after: int | None) -> int:
        """Return the vector at a position; `after`: that of the next one, None at the last."""
        key = (tuple(held.values()), after)
        if key not in self._stepped:
            self._stepped[key] = self._before(held, after)
        return self._stepped[key]

    def _before(self, held: Held, after: int | None) -> int:
        worth: list[bool] = []
        for i, (kind, parts, atom) in enumerate(self.nodes):
            own = [worth[part] for part in parts]
            later = None if after is None else bool(after >> i & 1)
            worth.append(atom(held) if atom is not None else _worth(kind, own, later))
        return sum(1 << i for i, value in enumerate(worth) if value)

    def is_true(self, vector: int) -> bool:
        return bool(vector >> self.root & 1)


def for_ever(formula: Formula, robots: Sequence[str], prefix: Sequence[Held], cycle: Sequence[Held]) -> bool:
    """Tell what a formula is worth on an infinite word: each part by itself, as the least or greatest solution over all positions."""
    vectors, word = Vectors(formula, robots), [*prefix, *cycle]
    after = [*range(1, len(word)), len(prefix)]
    worth: list[list[bool]] = []
    for kind, parts, atom in vectors.nodes:
        own = [worth[part] for part in parts]
        if atom is not None:
            worth.append([atom(held) for held in word])
            continue
        values = [kind in "GWR"] * len(word)
        while True:
            new = [_worth(kind, [part[i] for part in own], values[after[i]]) for i in range(len(word))]
            if new == values:
                break
            values = new
        worth.append(values)
    return worth[vectors.root][0]


def _worth(kind: str, own: Sequence[bool], later: bool | None) -> bool:
    match kind:
        case "!":
            return not own[0]
        case "&" | "each":
            return all(own)
        case "|":
            return any(own)
        case "->":
            return not own[0] or own[1]
        case "xor" | "<->":
            return (own[0] == own[1]) == (kind == "<->")
        case "F":
            return own[0] or bool(later)
        case "G":
            return own[0] and later is not False
        case "U" | "W":
            return own[1] or (own[0] and (kind == "W" if later is None else later))
        case "R" | "M":
            return own[1] and (own[0] or (kind == "R" if later is None else later))
        case _:
            raise AssertionError(kind)


def outcomes(formula: Formula, robots: Sequence[str], words: Words) -> set[bool]:
    """Return what a formula is worth on the words of a graph: {True}, {False}, or both."""
    vectors = Vectors(formula, robots)
    order, into = _explored(words)
    found: dict[Hashable, set[int | None]] = {at: set() for at in order}
    work: list[tuple[Hashable, int | None]] = [(at, None) for at in order if words.is_final(at)]
    for at, _ in work:
        found[at].add(None)
    while work:
        at, vector = work.pop()
        for held, source in into[at]:
            new = vector if held is None else vectors.before(held, vector)
            if new not in found[source]:
                found[source].add(new)
                work.append((source, new))
    return {vectors.is_true(v) for at in words.initial() for v in found[at] if v is not None}


def _explored(words: Words) -> tuple[list[Hashable], dict[Hashable, list[tuple[Held | None, Hashable]]]]:
    order = list(dict.fromkeys(words.initial()))
    into: dict[Hashable, list[tuple[Held | None, Hashable]]] = {at: [] for at in order}
    for at in order:  # grows while it is walked
        for held, target in words.edges(at):
            if target not in into:
                into[target] = []
                order.append(target)
            into[target].append((held, at))
    return order, into


def is_word(letters: Sequence[Letter], words: Words, shown: Callable[[Held], Letter]) -> bool:
    """Tell whether letters are one of the words of a graph; `shown`: what a reading looks like there."""
    now = _silently(words, words.initial())
    for letter in letters:
        read = (to for at in now for held, to in words.edges(at) if held is not None and shown(held) == letter)
        now = _silently(words, read)
    return any(words.is_final(at) for at in now)


def _silently(words: Words, begin: Iterable[Hashable]) -> set[Hashable]:
    seen = set(begin)
    stack = list(seen)
    while stack:
        for held, target in words.edges(stack.pop()):
            if held is None and target not in seen:
                seen.add(target)
                stack.append(target)
    return seen


Event = tuple[str, int]
"""A robot, and the index of the letter of its word that it comes to."""


class Together:
    """Robots with one word each, under `own` (one robot is read at a time) or `joint` (all are), in any interleaving.

    Of a pair of events in `before` the first is over before the second happens.
    """

    def __init__(self, words: Mapping[str, Sequence[Letter]], reading: str, before: Iterable[tuple[Event, Event]] = ()) -> None:
        self.names, self.words, self.reading = list(words), list(words.values()), reading
        self.before = [((self.names.index(a), i), (self.names.index(b), j)) for (a, i), (b, j) in before]
        self._known: dict[Hashable, list[Edge]] = {}

    def initial(self) -> Iterator[Hashable]:
        begin = (0,) * len(self.names)
        if self.reading == "own":
            yield begin, (False,) * len(self.names)
        else:
            yield begin, False

    def edges(self, at: Hashable) -> list[Edge]:
        if at not in self._known:
            self._known[at] = list(self._own(*at) if self.reading == "own" else self._joint(*at))  # type: ignore[misc]
        return self._known[at]

    def _own(self, places: tuple[int, ...], read: tuple[bool, ...]) -> Iterator[Edge]:
        for r, name in enumerate(self.names):
            word, place = self.words[r], places[r]
            yield {name: word[place]}, (places, _set(read, r, True))
            if read[r] and self._may_go_on(places, r):
                yield None, (_set(places, r, place + 1), _set(read, r, False))

    def _joint(self, places: tuple[int, ...], read: bool) -> Iterator[Edge]:
        held = {name: word[place] for name, word, place in zip(self.names, self.words, places, strict=True)}
        yield held, (places, True)
        if read:
            choices = [(p, p + 1) if self._may_go_on(places, r) else (p,) for r, p in enumerate(places)]
            for after in itertools.product(*choices):
                yield None, (after, False)

    def _may_go_on(self, places: tuple[int, ...], r: int) -> bool:
        coming = r, places[r] + 1
        return coming[1] < len(self.words[r]) and all(
            places[other] >= letter for (other, letter), then in self.before if then == coming
        )

    def is_final(self, at: Hashable) -> bool:
        places, read = at  # type: ignore[misc]
        seen = all(read) if self.reading == "own" else read
        return bool(seen) and all(place + 1 == len(word) for place, word in zip(places, self.words, strict=True))


def _set(values: tuple, index: int, value: object) -> tuple:
    return (*values[:index], value, *values[index + 1 :])


_State = tuple[int, tuple[tuple[int, bool], ...], int]
"""A robot's time on the grid; of each region how many changes are over and whether the robot is in it; actions that are done."""


class OneTimeline:
    """All that one robot may do, its states numbered.

    A region changes at any instant of its enclosure, and while it *may* be, as often as it likes; what a robot shows grows or
    shrinks from one letter to the next.

    Attributes:
        letters: What the robot shows in each state.
        times: Its time there, in half units.
        moves: The states in which it may be at the same instant after one change.
        later: The state half a unit later, where it may wait.
        final: Whether it may end there.
        begin: Where it may begin.
    """

    def __init__(self, line: Timeline) -> None:
        self.line, self.regions, self.end = line, sorted(line.initial), 2 * int(line.duration)
        self.changes = [[c for c in line.changes if c.region == region] for region in self.regions]
        self.letters: list[Letter] = []
        self.times: list[int] = []
        self.moves: list[list[int]] = []
        self.later: list[int | None] = []
        self.final: list[bool] = []
        insides = [{"no": (False,), "must": (True,), "may": (False, True)}[line.initial[region]] for region in self.regions]
        index: dict[_State, int] = {}
        order: list[_State] = []

        def number(state: _State) -> int:
            if state not in index:
                index[state] = len(order)
                order.append(state)
            return index[state]

        at_once = [[(0, inside) for inside in each] for each in insides]
        for each, changes in zip(at_once, self.changes, strict=True):
            if changes and changes[0].time.low == 0:  # regions are closed: in one that is entered at time 0 a robot begins
                each += {"must": [(1, True)], "may": [(1, False), (1, True)], "no": []}[changes[0].status]
        self.begin = [number((0, chosen, 0)) for chosen in itertools.product(*at_once)]
        self.index, self.states = index, order
        for state in order:  # grows while it is walked
            time, regions, done = state
            internal = line.actions[done - 1].propositions if done else line.internal
            inside = {region for region, (_, held) in zip(self.regions, regions, strict=True) if held}
            self.letters.append(internal | inside)
            self.times.append(time)
            self.moves.append([number(after) for after in dict.fromkeys(self._moved(state))])
            self.later.append(number((time + 1, regions, done)) if self._may_wait(state) else None)
            self.final.append(time == self.end and self._is_over(state))

    def _moved(self, state: _State) -> Iterator[_State]:
        time, regions, done = state
        actions = self.line.actions
        acts = done < len(actions) and 2 * actions[done].time == time
        if acts:
            yield time, regions, done + 1
        rises, falls = [], []
        for index, (over, inside) in enumerate(regions):
            changes = self.changes[index]
            status = changes[over - 1].status if over else self.line.initial[self.regions[index]]
            if status == "may":
                (falls if inside else rises).append((index, (over, not inside)))
            if over < len(changes) and 2 * changes[over].time.low <= time <= 2 * changes[over].time.high:
                new = changes[over].status
                if new == "may" or (new == "must") == inside:
                    yield time, _set(regions, index, (over + 1, inside)), done
                elif status != "may":
                    (falls if inside else rises).append((index, (over + 1, not inside)))
        for flips in (rises, falls):
            for size in range(1, len(flips) + 1):
                for chosen in itertools.combinations(flips, size):
                    after = regions
                    for index, value in chosen:
                        after = _set(after, index, value)
                    yield time, after, done
                    if acts and flips is rises:  # regions are closed: one may be entered at the very instant of an action
                        yield time, after, done + 1

    def _may_wait(self, state: _State) -> bool:
        time, _, done = state
        if time >= self.end or (done < len(self.line.actions) and 2 * self.line.actions[done].time <= time):
            return False
        return all(change.time.high * 2 > time for change in self._due(state))

    def _is_over(self, state: _State) -> bool:
        """Tell whether nothing is still to come; a closed region that is left at the very end is not shown to be left."""
        left = [change for change in self._due(state) if change.time.high != self.line.duration or change.status != "no"]
        return state[2] == len(self.line.actions) and not left

    def _due(self, state: _State) -> Iterator[Change]:
        for (over, _), changes in zip(state[1], self.changes, strict=True):
            if over < len(changes):
                yield changes[over]


class Timed:
    """Robots with timelines of whole times. Each has its own time, at most twice the clocks' error from any other's."""

    def __init__(self, lines: Mapping[str, Timeline], reading: str, clock_error: int = 0) -> None:
        self.names, self.reading, self.apart = list(lines), reading, 4 * clock_error
        self.robots = [OneTimeline(line) for line in lines.values()]
        self._known: dict[Hashable, list[Edge]] = {}

    def initial(self) -> Iterator[Hashable]:
        yield None

    def edges(self, at: Hashable) -> list[Edge]:
        if at not in self._known:
            self._known[at] = list(self._edges(at))
        return self._known[at]

    def _edges(self, at: Hashable) -> Iterator[Edge]:
        if at is None:
            for states in itertools.product(*(robot.begin for robot in self.robots)):
                yield (None, (states, 0)) if self.reading == "own" else (self._held(states), (states, 0))
            return
        states, read = at  # type: ignore[misc]
        yield from ((None, (after, read)) for after in self._later(states))
        yield from self._own(states, read) if self.reading == "own" else self._joint(states)

    def _held(self, states: tuple[int, ...]) -> Held:
        return {name: robot.letters[at] for name, robot, at in zip(self.names, self.robots, states, strict=True)}

    def _own(self, states: tuple[int, ...], read: int) -> Iterator[Edge]:
        for r, (name, robot) in enumerate(zip(self.names, self.robots, strict=True)):
            letter = robot.letters[states[r]]
            yield {name: letter}, (states, read | 1 << r)
            for after in robot.moves[states[r]]:
                if robot.letters[after] == letter:
                    yield None, (_set(states, r, after), read)
                elif read >> r & 1:
                    yield None, (_set(states, r, after), read & ~(1 << r))

    def _joint(self, states: tuple[int, ...]) -> Iterator[Edge]:
        """Without X it is enough to read at each change."""
        changing = []
        for r, (robot, at) in enumerate(zip(self.robots, states, strict=True)):
            same = [after for after in robot.moves[at] if robot.letters[after] == robot.letters[at]]
            yield from ((None, (_set(states, r, after), 0)) for after in same)
            changing.append([at, *(after for after in robot.moves[at] if after not in same)])
        for after in itertools.product(*changing):
            if after != states:
                yield self._held(after), (after, 0)

    def _later(self, states: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
        following = [robot.later[at] for robot, at in zip(self.robots, states, strict=True)]
        if None not in following:
            yield tuple(following)  # type: ignore[arg-type]
        if self.apart:
            times = [robot.times[at] for robot, at in zip(self.robots, states, strict=True)]
            for r, after in enumerate(following):
                if after is not None and times[r] + 1 - min(times) <= self.apart:
                    yield _set(states, r, after)

    def is_final(self, at: Hashable) -> bool:
        if at is None:
            return False
        states, read = at  # type: ignore[misc]
        if self.reading == "own" and read != (1 << len(self.names)) - 1:
            return False
        return all(robot.final[state] for robot, state in zip(self.robots, states, strict=True))


class Laps:
    """Robots that fly laps which begin together: words are drawn, not all of them written down.

    At the end of a lap a robot goes on as it stands at the lap's beginning; no change is under way at either. Under `own` each is
    read at least once in each of its letters and in each lap.
    """

    def __init__(self, lines: Mapping[str, Timeline], reading: str, clock_error: int = 0) -> None:
        self.names, self.reading, self.apart = list(lines), reading, 4 * clock_error
        self.robots = [OneTimeline(line) for line in lines.values()]
        self.length = self.robots[0].end - 2 * int(self.robots[0].line.cycle or 0)
        self.again = [self._again(robot) for robot in self.robots]

    @staticmethod
    def _again(robot: OneTimeline) -> dict[int, int]:
        """Return for states at the lap's end those at its beginning."""
        begin = 2 * int(robot.line.cycle or 0)
        over = [sum(2 * change.time.high < begin for change in changes) for changes in robot.changes]
        found = {}
        for at, (time, regions, done) in enumerate(robot.states):
            if time == robot.end and robot.final[at]:
                there = begin, tuple((k, inside) for k, (_, inside) in zip(over, regions, strict=True)), done
                if there in robot.index:
                    found[at] = robot.index[there]
        return found

    def word(self, rng: Random, laps: int = 4) -> tuple[list[Held], list[Held]] | None:
        """Return a word that some flight gives, as prefix and cycle; None where the dice gave none."""
        states, ahead, read = tuple(rng.choice(robot.begin) for robot in self.robots), 0, 0
        letters: list[Held] = [] if self.reading == "own" else [self._held(states)]
        seen: dict[tuple[tuple[int, ...], int, int], tuple[int, int]] = {}
        rounds = 0
        for _ in range(3_000):
            options = list(self._options(states, ahead, read))
            if not options:
                return None
            states, ahead, read, said, lapped = rng.choice(options)
            letters += [] if said is None else [said]
            if lapped:
                rounds += 1
                key = states, ahead, read
                if key in seen and seen[key][1] < len(letters):
                    return letters[: seen[key][1]], letters[seen[key][1] :]
                seen.setdefault(key, (rounds, len(letters)))
                if rounds > 8 * laps:
                    return None
        return None

    def _held(self, states: tuple[int, ...]) -> Held:
        return {name: robot.letters[at] for name, robot, at in zip(self.names, self.robots, states, strict=True)}

    def _options(self, states: tuple[int, ...], ahead: int, read: int) -> Iterator[tuple]:
        """Yield (states, who is a lap ahead, who was read, what is read now, whether all have begun a lap)."""
        own, everyone = self.reading == "own", (1 << len(states)) - 1
        for r, robot in enumerate(self.robots):
            at, bit = states[r], 1 << r
            letter = robot.letters[at]
            if own:
                yield states, ahead, read | bit, {self.names[r]: letter}, False
            for after in robot.moves[at]:
                moved, changed = _set(states, r, after), robot.letters[after] != letter
                if own and (read & bit or not changed):
                    yield moved, ahead, read & ~bit if changed else read, None, False
                elif not own:
                    yield moved, ahead, read, self._held(moved) if changed else None, False
        if not own:  # several at one instant
            for after in itertools.product(*([at, *robot.moves[at]] for robot, at in zip(self.robots, states, strict=True))):
                if sum(a != b for a, b in zip(after, states, strict=True)) > 1:
                    yield after, ahead, read, self._held(after), False
        times = [
            robot.times[at] + (self.length if ahead >> r & 1 else 0)
            for r, (robot, at) in enumerate(zip(self.robots, states, strict=True))
        ]
        later = [robot.later[at] for robot, at in zip(self.robots, states, strict=True)]
        may_lap = [
            at in again and not ahead >> r & 1 and bool(not own or read >> r & 1)
            for r, (at, again) in enumerate(zip(states, self.again, strict=True))
        ]
        if None not in later:
            yield tuple(later), ahead, read, None, False
        if all(may_lap):
            held = None if own else self._held(states)
            yield tuple(again[at] for at, again in zip(states, self.again, strict=True)), 0, 0, held, True
        for r, after in enumerate(later) if self.apart else ():
            if after is not None and times[r] + 1 - min(times) <= self.apart:
                yield _set(states, r, after), ahead, read, None, False
            if may_lap[r] and len(states) > 1:
                now, rest = ahead | 1 << r, _set(states, r, self.again[r][states[r]])
                done = now == everyone
                yield rest, 0 if done else now, read & ~(1 << r), self._held(rest) if done and not own else None, done
