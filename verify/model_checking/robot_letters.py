"""Letters of one robot, the times at which it can hold them, and their possible successors.

A timeline leaves things open: when exactly a boundary is crossed, and whether a region that only *may* hold the
robot does. A behaviour is the finite graph of all that it leaves open. Its nodes are letters within a span of time;
a path from an initial to a final node is one word that the robot can give.

Two facts about paths through closed regions keep the graph exact. A path is continuous, so when it leaves one region and enters another at one
instant it is in both at that instant. So letters only grow or only shrink from one to the next. And a crossing that is known to be one crossing
happens once. Where its instant is known exactly, too, so is the letter there. The robot is in all regions that it enters or leaves at that instant.
It is in none of those that it enters just before, and in none of those that it leaves just after.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Literal

from verify.data.errors import InternalError
from verify.data.language.word import Letter
from verify.logic.progression import OutOfBudget
from verify.model_checking.timeline import InternalChange, Relations, Status, Timeline

MAX_OPEN = 10
"""Regions that may be switched at one instant; 2 to this power letters are followed."""

MAX_NODES = 50_000

ALWAYS = (Fraction(0), Fraction(0))
"""The span of nodes without times: each overlaps each."""


@dataclass(frozen=True, slots=True)
class RobotBehaviour:
    """All words of one robot, as a graph; one node is one letter held within one span of time.

    Attributes:
        robot: Name.
        letters: Letter of each node.
        spans: First and last instant, in s, at which the robot can be at each node.
        following: Nodes that can come after each node.
        initial: Where it can begin.
        final: Where it can end (for a lasso: where a lap can end).
        laps: Edges that begin the next lap of a lasso.
        actions: For each node, how many planned actions are done.
    """

    robot: str
    letters: tuple[Letter, ...]
    spans: tuple[tuple[Fraction, Fraction], ...]
    following: tuple[tuple[int, ...], ...]
    initial: tuple[int, ...]
    final: frozenset[int]
    laps: frozenset[tuple[int, int]] = frozenset()
    actions: tuple[int, ...] = ()

    def __len__(self) -> int:
        return len(self.letters)

    @property
    def constant(self) -> bool:
        """Return whether the robot holds one letter all the time."""
        return len(self.letters) == 1 and not self.laps


def cut_timeline(timeline: Timeline, names: frozenset[str]) -> Timeline:
    """Return the timeline without the regions and internal propositions that are not in `names`."""
    actions: list[InternalChange] = []
    before = timeline.internal & names
    for action in timeline.actions:
        after = action.propositions & names
        if after != before or timeline.cycle is not None:
            actions.append(replace(action, propositions=after))
        before = after
    return replace(
        timeline,
        initial={region: status for region, status in timeline.initial.items() if region in names},
        changes=tuple(change for change in timeline.changes if change.region in names),
        internal=timeline.internal & names,
        actions=tuple(actions),
    )


def from_timeline(timeline: Timeline, relations: Relations) -> RobotBehaviour:
    """Return everything that a timeline leaves open.

    Relations with regions that the timeline does not mention are left aside.

    Raises:
        OutOfBudget: Too many regions are open at one time.
        InternalError: The timeline contradicts itself or the relations, so that no behaviour is left.
    """
    return merged(_Unfolding(timeline, relations).graph())


# A region within one slot of time: "no" and "must" fix it, "may" leaves it free. "rise" and "fall" switch it once; "enters" and "leaves" do so at one
# exact instant, at which the robot is in it.
_Mode = Literal["no", "may", "must", "rise", "fall", "enters", "leaves"]
_ONCE: dict[Status, _Mode] = {"must": "rise", "no": "fall"}
_EXACTLY: dict[Status, _Mode] = {"must": "enters", "no": "leaves"}
_Key = tuple[int, frozenset[str], int, frozenset[str]]  # slot, regions, actions done in this lap, internal propositions


@dataclass(frozen=True, slots=True)
class _Slot:
    """A span of time in which no region changes its mode.

    Attributes:
        span: Its closed ends, in s.
        modes: Every region's mode.
        actions: How many changes of the internal state can be over when the slot ends.
        due: How many of them must be.
    """

    span: tuple[Fraction, Fraction]
    modes: dict[str, _Mode]
    actions: int
    due: int


class _Unfolding:
    """The graph of a timeline, over slots of time."""

    def __init__(self, timeline: Timeline, relations: Relations) -> None:
        self.timeline = timeline
        # a timeline that was cut down to what a formula sees says nothing of regions that hold those it has
        self.relations = relations.among({*timeline.initial, *(change.region for change in timeline.changes)})
        times = {Fraction(0), timeline.duration}
        for change in timeline.changes:
            times |= {change.time.low, change.time.high}
        times |= {time for action in timeline.actions for time in _window(action)}
        if timeline.cycle is not None:
            times.add(timeline.cycle)
        self.times = sorted(times)
        if self.times[0] < 0 or self.times[-1] > timeline.duration:
            raise InternalError(f"{timeline.robot}'s timeline has changes outside [0, T].")
        # fine slots alternate: an endpoint of some enclosure, then the gap to the next
        self.fine_slot = {time: 2 * i for i, time in enumerate(self.times)}
        self.fine_last = 2 * len(self.times) - 2
        regions = sorted(set(timeline.initial) | {change.region for change in timeline.changes})
        modes = {region: self._modes(region) for region in regions}
        lap = None if timeline.cycle is None else self.fine_slot[timeline.cycle]
        if lap is not None:
            for row in modes.values():  # where a lap's ends differ, the joint leaves the region open
                if row[lap] != row[self.fine_last] or row[self.fine_last] not in ("no", "may", "must"):
                    row[lap] = row[self.fine_last] = "may"
        self.slots, self.start_of_lap = self._joined(modes, lap)
        self.last = len(self.slots) - 1
        self.first_action = 0 if timeline.cycle is None else sum(a.time < timeline.cycle for a in timeline.actions)

    def _joined(self, modes: dict[str, list[_Mode]], lap: int | None) -> tuple[list[_Slot], int]:
        """Join fine slots in which nothing differs; return the slots and the one at which a lap begins (or -1)."""
        windows = [tuple(self.fine_slot[time] for time in _window(action)) for action in self.timeline.actions]
        acting = {fine for first, last in windows for fine in range(first, last + 1)}
        slots: list[_Slot] = []
        start_of_lap = -1
        for fine in range(self.fine_last + 1):
            here: dict[str, _Mode] = {region: row[fine] for region, row in modes.items()}
            start, end = self.times[fine // 2], self.times[(fine + 1) // 2]
            actions, due = sum(first <= fine for first, _ in windows), sum(last <= fine for _, last in windows)
            if fine == lap:
                start_of_lap = len(slots)
            if slots and fine != lap and not {fine, fine - 1} & acting and slots[-1].modes == here:
                slots[-1] = _Slot((slots[-1].span[0], end), here, actions, due)
            else:
                slots.append(_Slot((start, end), here, actions, due))
        return slots, start_of_lap

    def _modes(self, region: str) -> list[_Mode]:
        """Return the region's mode in every fine slot.

        Before a first crossing into *may* the region might as well be *may* and not used: so an interval of *may* lasts
        from the earliest start to the latest end. Where two changes share an endpoint it is *may* there.
        """
        modes: list[_Mode] = []
        status: Status = self.timeline.initial.get(region, "no")

        def fill(mode: _Mode, until: int) -> None:
            modes.extend(itertools.repeat(mode, until - len(modes)))

        for change in self.timeline.changes:
            if change.region != region or change.status == status:
                continue
            low, high = self.fine_slot[change.time.low], self.fine_slot[change.time.high]
            if low > high:
                raise InternalError(f"{self.timeline.robot}'s timeline has an enclosure that ends before it begins.")
            for slot in range(low, len(modes)):
                modes[slot] = "may"
            if change.status == "may":
                fill(status, low)
            elif status == "may":
                fill("may", high + 1)
            else:
                fill(status, low)
                fill((_EXACTLY if low == high else _ONCE)[change.status], high + 1)
            status = change.status
        fill(status, self.fine_last + 1)
        return modes

    def graph(self) -> RobotBehaviour:
        """Follow every move from time 0 on."""
        initial = list(self._initial())
        index: dict[_Key, int] = {key: i for i, key in enumerate(initial)}
        order = list(initial)
        following: list[tuple[int, ...]] = []
        laps = set[tuple[int, int]]()
        for number, key in enumerate(order):
            targets: list[int] = []
            for target, is_lap in self._moves(key):
                if target not in index:
                    if len(order) >= MAX_NODES:
                        raise OutOfBudget(f"{self.timeline.robot}'s labels leave more than {MAX_NODES} possibilities open")
                    index[target] = len(order)
                    order.append(target)
                targets.append(index[target])
                if is_lap:
                    laps.add((number, index[target]))
            following.append(tuple(targets))
        final = frozenset(i for i, key in enumerate(order) if self._is_final(key))
        graph = RobotBehaviour(
            self.timeline.robot,
            tuple(regions | internal for _, regions, _, internal in order),
            tuple(self.slots[slot].span for slot, _, _, _ in order),
            tuple(following),
            tuple(range(len(initial))),
            final,
            frozenset(laps),
            tuple(done for _, _, done, _ in order),
        )
        return _useful(graph)

    def _initial(self) -> Iterator[_Key]:
        modes = self.slots[0].modes
        fixed = frozenset(region for region, mode in modes.items() if mode in ("must", "fall", "enters", "leaves"))
        # regions are closed: one that is entered at time 0 may hold the robot there from the beginning
        for extra in _subsets([region for region, mode in modes.items() if mode in ("may", "rise")], empty=True):
            if self.relations.allows(fixed | extra):
                yield 0, fixed | extra, 0, self.timeline.internal

    def _moves(self, key: _Key) -> Iterator[tuple[_Key, bool]]:
        slot, inside, done, internal = key
        modes = self.slots[slot].modes
        advances = [(done, internal)]
        while advances[-1][0] < self.slots[slot].actions:
            advances.append((advances[-1][0] + 1, self.timeline.actions[advances[-1][0]].propositions))
        grow = [region for region, mode in modes.items() if mode in ("may", "rise") and region not in inside]
        shrink = [region for region, mode in modes.items() if mode in ("may", "fall") and region in inside]
        entered = frozenset(region for region, mode in modes.items() if mode == "enters")
        left = frozenset(region for region, mode in modes.items() if mode == "leaves" and slot < self.last)
        letters = [inside]
        if not entered <= inside:  # at the instant all at once, and nothing else before
            letters += [inside | entered | more for more in _subsets(grow, empty=True)]
        elif left <= inside:
            letters += [inside | more for more in _subsets(grow)]
            letters += [
                inside - left - less for less in _subsets(shrink, empty=bool(left))
            ]  # just after it all at once, and no more
        for letter in letters:
            for after, propositions in advances:
                if (letter != inside or after != done) and self.relations.allows(letter):
                    yield (slot, letter, after, propositions), False
        if done < self.slots[slot].due:
            return  # an action of this instant is still to come
        if slot < self.last and self._fits(slot + 1, inside):
            yield (slot + 1, inside, done, internal), False
        if slot == self.last and self.start_of_lap >= 0 and self._is_final(key) and self._fits(self.start_of_lap, inside):
            yield (self.start_of_lap, inside, self.first_action, internal), True

    def _fits(self, slot: int, inside: frozenset[str]) -> bool:
        return all(
            not (mode == "no" and region in inside) and not (mode == "must" and region not in inside)
            for region, mode in self.slots[slot].modes.items()
        )

    def _is_final(self, key: _Key) -> bool:
        slot, inside, done, _ = key
        if slot != self.last or done != len(self.timeline.actions):
            return False
        # regions are closed: one that is left at the very end may hold the robot until then, or holds it where that is the exact instant
        return all(region in inside for region, mode in self.slots[slot].modes.items() if mode in ("rise", "enters", "leaves"))


def _window(action: InternalChange) -> tuple[Fraction, Fraction]:
    return action.time, action.time if action.until is None else action.until


def _subsets(items: list[str], *, empty: bool = False) -> Iterator[frozenset[str]]:
    if len(items) > MAX_OPEN:
        raise OutOfBudget(f"{len(items)} regions are open at one time ({', '.join(items[:4])}, ...); {MAX_OPEN} is the most")
    for size in range(0 if empty else 1, len(items) + 1):
        for chosen in itertools.combinations(items, size):
            yield frozenset(chosen)


def _useful(graph: RobotBehaviour) -> RobotBehaviour:
    """Keep the nodes from which the flight can be completed. There must be one at the start."""
    backwards: list[list[int]] = [[] for _ in graph.letters]
    for node, targets in enumerate(graph.following):
        for target in targets:
            backwards[target].append(node)
    alive, stack = set(graph.final), list(graph.final)
    while stack:
        for node in backwards[stack.pop()]:
            if node not in alive:
                alive.add(node)
                stack.append(node)
    if not alive.intersection(graph.initial):
        raise InternalError(f"{graph.robot}'s timeline contradicts itself: no behaviour agrees with it.")
    return _kept(graph, sorted(alive), {})


def _kept(graph: RobotBehaviour, nodes: Iterable[int], spans: dict[int, tuple[Fraction, Fraction]]) -> RobotBehaviour:
    kept = list(nodes)
    new = {node: i for i, node in enumerate(kept)}
    return RobotBehaviour(
        graph.robot,
        tuple(graph.letters[i] for i in kept),
        tuple(spans.get(i, graph.spans[i]) for i in kept),
        tuple(tuple(new[t] for t in graph.following[i] if t in new) for i in kept),
        tuple(new[i] for i in graph.initial if i in new),
        frozenset(new[i] for i in graph.final if i in new),
        frozenset((new[a], new[b]) for a, b in graph.laps if a in new and b in new),
        tuple(graph.actions[i] for i in kept),
    )


def merged(graph: RobotBehaviour) -> RobotBehaviour:
    """Join nodes that follow one another without a choice or a change, so that a long wait is one node."""
    entering = [0] * len(graph)
    for node in graph.initial:
        entering[node] += 1
    for targets in graph.following:
        for target in targets:
            entering[target] += 1
    lap_starts = {b for _, b in graph.laps}
    head: dict[int, int] = {}
    following = list(graph.following)
    spans = list(graph.spans)
    final = set(graph.final)
    order = sorted(range(len(graph)), key=lambda node: (graph.spans[node], node))
    for node in order:
        start = head.get(node, node)
        if len(graph.following[node]) != 1 or node in graph.final:
            continue
        target = graph.following[node][0]
        same = graph.letters[target] == graph.letters[node] and graph.actions[target] == graph.actions[node]
        if entering[target] != 1 or not same or target in lap_starts or target in head or target == start:
            continue
        head[target] = start
        following[start] = following[target]
        spans[start] = (spans[start][0], max(spans[start][1], graph.spans[target][1]))
        if target in final:
            final.add(start)
    laps = frozenset((head.get(a, a), b) for a, b in graph.laps)
    joined = replace(graph, following=tuple(following), final=frozenset(final), laps=laps)
    return _kept(joined, [n for n in range(len(graph)) if n not in head], dict(enumerate(spans)))
