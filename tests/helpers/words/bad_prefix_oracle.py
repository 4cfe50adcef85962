"""Whether a prefix of a flight is bad, by Spot's automata: from which of their states an infinite word can still be accepted."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping, Sequence
from random import Random

import spot

from verify.data import Formula, Letter, Word
from verify.model_checking.timeline import Timeline

buddy = importlib.import_module("buddy")  # Spot brings it, so it comes second

DEAD = frozenset[int]()

Events = Sequence[tuple[int, Letter]]
"""(robot, its new letter), in order of time; first every robot's first letter."""


class Monitor:
    """Which prefixes some infinite word goes on from to satisfy a formula: the sets of states of Spot's automaton that can still accept.

    What Spot itself calls a monitor lets more prefixes pass than that: `{a}` for `(G c xor F !(a | c)) & G (c M a)`.
    """

    def __init__(self, formula: Formula) -> None:
        self.names = sorted(formula.names())
        renamed = formula.substitute({name: Formula("name", (), f"p{i}") for i, name in enumerate(self.names)})
        self.graph = spot.translate(spot.formula(renamed.quoted()), "generic")
        self.variables = [buddy.bdd_ithvar(self.graph.register_ap(f"p{i}")) for i in range(len(self.names))]
        self.known: dict[tuple[frozenset[int], Letter], frozenset[int]] = {}
        self.initial = frozenset({self.graph.get_init_state_number()})
        self.alive = {state for state in range(self.graph.num_states()) if self._accepts_from(state)}

    def step(self, states: frozenset[int], letter: Letter) -> frozenset[int]:
        key = states, letter & frozenset(self.names)
        if key not in self.known:
            read = buddy.bddtrue
            for name, variable in zip(self.names, self.variables, strict=True):
                read &= variable if name in letter else buddy.bdd_not(variable)
            ways = {edge.dst for s in states for edge in self.graph.out(s) if (edge.cond & read) != buddy.bddfalse}
            self.known[key] = frozenset(ways & self.alive)
        return self.known[key]

    def _accepts_from(self, state: int) -> bool:
        begun = spot.automaton(self.graph.to_str("hoa"))
        begun.set_init_state(state)
        return not begun.is_empty()


def is_lost(formula: Formula, robots: int, events: Events, *, own: bool) -> bool:
    """Tell whether a flight's readings (one of them, of robots that are read one at a time) can be led on to satisfy a formula no more."""
    monitor = Monitor(formula)
    held = [letter for _, letter in events[:robots]]
    if not own:
        state = monitor.step(monitor.initial, frozenset().union(*held))
        for robot, letter in events[robots:]:
            held[robot] = letter
            state = monitor.step(state, frozenset().union(*held))
        return state == DEAD

    def closed(readings: set[tuple[frozenset[int], int]]) -> set[tuple[frozenset[int], int]]:
        stack = list(readings)
        while stack:
            state, read = stack.pop()
            for robot, letter in enumerate(held):
                after = monitor.step(state, letter), read | 1 << robot
                if after not in readings:
                    readings.add(after)
                    stack.append(after)
        return readings

    readings = closed({(monitor.initial, 0)})
    for robot, letter in events[robots:]:
        held[robot] = letter
        readings = closed({(state, read & ~(1 << robot)) for state, read in readings if read >> robot & 1})
    return any(state == DEAD for state, _ in readings)


def some_events(timelines: Mapping[str, Timeline], rng: Random) -> Events:
    """Return one flight that agrees with timelines: what they leave open happens at random, no two things at once."""
    return [(robot, letter) for _, robot, letter in timed_events(timelines, rng)]


def timed_events(timelines: Mapping[str, Timeline], rng: Random) -> list[tuple[float, int, Letter]]:
    """Return the same with the time of each event, s."""
    happening: list[tuple[float, int, str]] = []
    held: list[set[str]] = []
    for robot, timeline in enumerate(timelines.values()):
        held.append(set())
        for region in timeline.initial:
            inside, found = _switches(timeline, region, rng)
            if inside:
                held[robot].add(region)
            happening += [(time, robot, region) for time in found]
    events = [(0.0, robot, frozenset(letter)) for robot, letter in enumerate(held)]
    for time, robot, region in sorted(happening):
        held[robot] ^= {region}
        events.append((time, robot, frozenset(held[robot])))
    return events


def some_lasso(timelines: Mapping[str, Timeline], lap: float, rng: Random, *, own: bool) -> Word:
    """Return a team word of one flight that agrees with timelines, the last `lap` s of it repeated for ever."""
    begin = min(float(timeline.duration) for timeline in timelines.values()) - lap
    events = timed_events(timelines, rng)
    held = [letter for _, _, letter in events[: len(timelines)]]
    words: tuple[list[Letter], list[Letter]] = ([], [])
    unread = set(range(len(held)))

    def read(where: list[Letter], wanted: set[int]) -> None:
        if not own:
            where.append(frozenset().union(*held))
            return
        extra = rng.choices(range(len(held)), k=rng.randint(0, 2))
        for robot in rng.sample(wanted_too := [*sorted(wanted), *extra], len(wanted_too)):
            where.append(held[robot])
            unread.discard(robot)

    for _, robot, letter in [event for event in events[len(held) :] if event[0] < begin]:
        read(words[0], {robot} & unread)
        held[robot] = letter
        unread.add(robot)
    read(words[0], set(unread))
    unread |= set(range(len(held)))
    for _, robot, letter in [event for event in events[len(held) :] if event[0] >= begin]:
        read(words[1], {robot} & unread)
        held[robot] = letter
        unread.add(robot)
    read(words[1], set(unread))
    return Word(tuple(words[0]), tuple(words[1]))


def _switches(timeline: Timeline, region: str, rng: Random) -> tuple[bool, list[float]]:
    """Return whether a robot begins in a region, and when it then goes out and in."""
    spells = list(_spells(timeline, region, rng))
    inside = now = spells[0][2] == "must" or (spells[0][2] == "may" and rng.random() < 0.5)
    found: list[float] = []
    for since, until, status in spells:
        if (status == "must") != now and status != "may":
            found.append(since)
            now = not now
        if status == "may":
            for time in sorted(rng.uniform(since, until) for _ in range(rng.randint(0, 3))):
                found.append(time)
                now = not now
    return inside, found


def _spells(timeline: Timeline, region: str, rng: Random) -> Iterator[tuple[float, float, str]]:
    since, status = 0.0, timeline.initial[region]
    for change in timeline.changes:
        if change.region == region:
            time = max(since, rng.uniform(float(change.time.low), float(change.time.high)))
            yield since, time, status
            since, status = time, change.status
    yield since, float(timeline.duration), status
