"""Places of a team before its cycles and in them, for a search that goes on with what costs least.

A place before the cycles is the nodes of all robots and what the formula remembers: the states of those of its conjuncts that ask for more than what
is to be shown in every cycle (a *mark*, `G F p`), never, or always from some time on. What a cycle does to these states is its *effect* (`cycle_effects`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from operator import or_

from ltlplan.logic.budget import TooLarge
from ltlplan.search.bounds.set_orders import needed
from ltlplan.search.cycles.cycle_effects import Followers, Masks
from ltlplan.search.cycles.strong_components import components, graph_of
from ltlplan.search.cycles.team_readers import LetterReader, Reader
from ltlplan.search.cycles.team_system import NOBODY, SEAM, Nodes, TeamLetter, TeamSystem
from ltlplan.search.label_setting import distances
from ltlplan.search.memoization import memoized
from ltlplan.search.numbering import Numbers

Place = tuple[int, Masks]
"""The number of the nodes of all robots, and what the conjuncts remember."""

Step = tuple[int, float, int]
"""Who moves, what it pays, and the number of the nodes or the place that it leads to."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits on the places that are looked at.

    Attributes:
        most: How many nodes of all robots, and places, there may be.
        below: Where robots are is not looked at, if some account has paid as much for their ways from their starts.
        accounts: From which account each robot pays, by number: an own one, or one for all.
    """

    most: int
    below: float
    accounts: Sequence[int]


class CyclePlaces:
    """Places of a team before its cycles and in them.

    Attributes:
        limits: What was given.
        nodes: What all robots are at, by number.
        steps: For each of these the steps to others.
        marks: The marks that each shows, as bits.
        everything: All marks.
        recurring: Whether cycles may pass each: it shows all that is to stay, and again and again all else that is asked can follow.
        homes: Whether a cycle may begin at each.
        followers: The conjuncts that remember.
        places: Pairs of the number of nodes and the conjuncts' states: where the team can be before its cycles.
        ways: For each place the steps to others.

    Args:
        system: The team's.
        readers: How the conjuncts read it.
        begins: For each robot and node whether its cycle may begin there; all of them begin together.
        limits: Which places are looked at.

    Raises:
        TooLarge: There are more than these.
    """

    def __init__(self, system: TeamSystem, readers: Sequence[Reader], begins: Sequence[Sequence[bool]], limits: Limits) -> None:
        self._system, self.limits = system, limits
        self._away = [distances([own.initial], lambda node, edges=own.edges: edges[node]) for own in system.systems]
        self._plain = [reader for reader in readers if reader.closes]
        self._staying = [reader for reader in readers if isinstance(reader, LetterReader) and reader.stays]
        self.followers = Followers([reader for reader in readers if reader not in (*self._plain, *self._staying)])
        self.steps: list[list[Step]] = []
        self._walk_nodes()
        self.marks, self.everything = self._marks()
        lasting = [
            all("held" in reader.seen(self.letter(at, NOBODY)) for reader in self._staying) for at in range(len(self.nodes))
        ]
        self.homes = [
            stays and all(own[node] for own, node in zip(begins, nodes, strict=True))
            for stays, nodes in zip(lasting, self.nodes, strict=True)
        ]
        begun = self.followers.after(self.followers.initial, self.letter(0, NOBODY)) if self.nodes else None
        self.places, self.ways = self._walk([] if begun is None else [(0, begun)], over_seams=False)
        self.remembered: dict[int, list[Masks]] = {}
        places, ways = self._walk(self.places, over_seams=True)
        for at, masks in places:
            self.remembered.setdefault(at, []).append(masks)
        self.recurring = self._recurring(places, ways, lasting)
        self.homes = [home and again for home, again in zip(self.homes, self.recurring, strict=True)]

    @memoized
    def letter(self, at: int, mover: int) -> TeamLetter:
        """Return the team's letter where robots are, of which one has moved last.

        Args:
            at: The number of their nodes.
            mover: Who has moved.
        """
        return self._system.letter(self.nodes[at], mover)

    def _walk_nodes(self) -> None:
        numbers = Numbers([self._system.initial] if self._is_allowed(self._system.initial) else [])
        self.nodes = numbers.known
        for nodes in self.nodes:  # grows while it is walked
            least: dict[int, tuple[int, float]] = {}
            for robot, cost, after in self._system.moves(nodes):
                if after != nodes and self._is_allowed(after):
                    target = numbers[after]
                    if target not in least or cost < least[target][1]:
                        least[target] = robot, cost
            self._check(len(numbers))
            self.steps.append([(robot, cost, target) for target, (robot, cost) in least.items()])

    @memoized
    def _is_allowed(self, nodes: Nodes) -> bool:
        """Tell whether no conjunct is lost where robots are, and all accounts can pay for the way there."""
        letter = self._system.letter(nodes, NOBODY)
        if not all(any(True for _ in reader.successors(reader.initial, letter)) for reader in self._plain):
            return False
        paid = [0.0] * (max(self.limits.accounts) + 1)
        for account, away, node in zip(self.limits.accounts, self._away, nodes, strict=True):
            paid[account] += away.get(node, math.inf)
        return max(paid) < self.limits.below

    def _marks(self) -> tuple[list[int], int]:
        """Return the marks of all nodes, and all marks; of those that come with others by themselves only the others."""
        where: list[frozenset[int]] = []
        for reader in self._plain:
            after = [set(reader.successors(reader.initial, self.letter(at, NOBODY))) for at in range(len(self.nodes))]
            where.append(frozenset(at for at, states in enumerate(after) if any(s in reader.accepting for s in states)))
        sets = sorted(needed(where), key=lambda each: (len(each), sorted(each)))
        return [sum(1 << k for k, own in enumerate(sets) if at in own) for at in range(len(self.nodes))], (1 << len(sets)) - 1

    def _walk(self, begin: Sequence[Place], *, over_seams: bool) -> tuple[list[Place], list[list[Step]]]:
        """Return all places that can be come to, and the steps from each; over seams from cycles to cycles, too, as nobody's step."""
        places = Numbers(begin)
        ways: list[list[Step]] = []
        for at, masks in places.known:  # grows while it is walked
            found: list[Step] = []
            seam = [(SEAM, 0.0, at)] if over_seams and self.homes[at] else []
            for robot, cost, target in (*self.steps[at], *seam):
                after = self.followers.after(masks, self.letter(target, robot))
                if after is not None:
                    found.append((robot, cost, places[target, after]))
            self._check(len(places))
            ways.append(found)
        return places.known, ways

    def _recurring(self, places: Sequence[Place], ways: Sequence[Sequence[Step]], lasting: Sequence[bool]) -> list[bool]:
        """Return whether cycles may pass each node: repeated for ever they stay in a part of all places that can be gone round."""
        kept = [lasting[at] for at, _ in places]
        edges = [[to for _, _, to in own if kept[to]] if stays else [] for own, stays in zip(ways, kept, strict=True)]
        found = [False] * len(self.nodes)
        for part in components(graph_of(edges)):
            there = {places[place][0] for place in part}
            shown = reduce(or_, (self.marks[at] for at in there))
            if shown == self.everything and any(self.homes[at] for at in there) and self._accepts([places[p][1] for p in part]):
                for at in there:
                    found[at] = True
        return found

    def _accepts(self, some: Sequence[Masks]) -> bool:
        """Tell whether each conjunct that remembers may accept again and again; one that may be in several states is taken to."""
        return all(
            any(masks[k] & (masks[k] - 1) or masks[k].bit_length() - 1 in reader.accepting for masks in some)
            for k, reader in enumerate(self.followers.readers)
        )

    def _check(self, count: int) -> None:
        if count > self.limits.most:
            raise TooLarge("The cycles of all robots go through", count, "places", self.limits.most)
