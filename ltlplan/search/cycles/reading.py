"""The cycles of a team as a search for plans walks them: a prefix of single steps, then one cycle back to where it began.

Robots pay from one account, or each from its own; the account with the highest cost counts (`least_highest`, with bounds on each account: Mandow and
Perez de la Cruz 2010). A cycle is judged by its effect on the automata, so that no word is missed whose cycles bring them round only several at a time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ltlplan.search.bounds.cycle_shares import CycleShares, bounds_before
from ltlplan.search.bounds.set_orders import Floats
from ltlplan.search.cycles.cycle_effects import CycleEffects, Masks
from ltlplan.search.cycles.cycle_places import CyclePlaces
from ltlplan.search.cycles.team_system import SEAM, Nodes, TeamSystem
from ltlplan.search.label_setting import Costs, Label
from ltlplan.search.memoization import memoized
from ltlplan.search.numbering import Numbers
from ltlplan.search.team_reading import Found, PaidApart, Step, complete, is_complete

_GRAIN = 1e-7
"""m; bounds that differ by less are ties: then robots that begin a cycle apart come first, and smaller sums."""

_BEFORE = -1
"""Instead of where a cycle began: none has; the robots' place follows."""
_ANYBODY = -1
"""Instead of who may act."""
_NOBODY = -2


class _Key(NamedTuple):
    """A state: home, where robots are, what the conjuncts remember by number, marks shown, the effect, who has set out, who may act."""

    home: int
    at: int
    masks: int = 0
    shown: int = 0
    effect: int = 0
    out: int = 0
    able: int = _ANYBODY


@dataclass(frozen=True, slots=True)
class Terms:
    """Terms on which cycles are judged.

    Attributes:
        weight: How many cycles count.
        apart: For each home by the number of its nodes: whether robots are there apart from each other.
        at_once: Whether robots act where they come to only before others go on, not when they have waited there.
        haste: How much bounds on what is left count; with more than 1 some cycles are found sooner, and no bound.
    """

    weight: float
    apart: Sequence[bool]
    at_once: bool = False
    haste: float = 1.0


class CycleReading(PaidApart):
    """Reading of a team's cycles. A state is, before the cycle, a place; in it also where it began, and what it has done so far.

    Args:
        system: The team's.
        places: Where it can be.
        terms: How cycles are judged.
    """

    def __init__(self, system: TeamSystem, places: CyclePlaces, terms: Terms) -> None:
        self._systems, self._places, self._terms, self._accounts = system.systems, places, terms, places.limits.accounts
        self.kept_apart = max(self._accounts) + 1
        several = len(system.systems) > 1  # a robot alone may begin its cycle with any visit, and act there
        self._acting = [several and bool(own.actions) for own in system.systems]
        self._shares = CycleShares(system, places, terms.weight)
        self._before = bounds_before(places, terms.weight).tolist()
        self._masks: Numbers[Masks] = Numbers()
        self._states: Numbers[_Key] = Numbers()

    def begin(self) -> int | None:
        """Return where the team starts; None where the formula is lost there."""
        return self._states[_Key(_BEFORE, 0)] if self._places.places else None

    def steps(self, state: int) -> Iterator[Step]:
        """Yield what follows: a robot's step, the begin of a cycle, or its end at home."""
        key = self._states.known[state]
        yield from self._in_cycle(key) if key.home != _BEFORE else self._before_cycle(state, key)

    def _before_cycle(self, state: int, key: _Key) -> Iterator[Step]:
        places = self._places.places
        begun, masks = places[key.at]
        for robot, cost, target in self._places.ways[key.at]:
            able = self._able(key.able, robot, begun, places[target][0])
            if able is not None:
                yield self._states[_Key(_BEFORE, target, able=able)], cost, robot
        if self._places.homes[begun]:  # what is shown at home is shown at a cycle's end; all may rest there for ever
            shown = self._places.marks[begun]
            able = _NOBODY if self._terms.at_once else _ANYBODY
            yield self._states[_Key(begun, begun, self._masks[masks], shown, able=able)], 0.0, None
            if self._is_closed(begun, masks, shown, 0):
                yield complete(state), 0.0, None

    def _in_cycle(self, key: _Key) -> Iterator[Step]:
        home, at = key.home, key.at
        effects, masks = self._effects_at(home), self._masks.known[key.masks]
        for robot, cost, target in self._places.steps[at]:
            letter = self._places.letter(target, robot)
            after = self._places.followers.after(masks, letter) if self._places.recurring[target] else None
            able = self._able(key.able, robot, at, target)
            if after is None or able is None:
                continue
            out = key.out
            if self._acting[robot] and not out >> robot & 1:
                if self._acts(robot, at, target):
                    continue  # what is done where a cycle begins is done at its end
                out |= 1 << robot
            effect, shown = effects.after(key.effect, letter), key.shown | self._places.marks[target]
            state = self._states[_Key(home, target, self._masks[after], shown, effect, out, able)]
            closed = target == home and self._is_closed(home, after, shown, effect)
            yield complete(state) if closed else state, self._terms.weight * cost, robot

    def _able(self, able: int, robot: int, at: int, target: int) -> int | None:
        """Return who may act after a step; None where a robot may not make it."""
        if not self._terms.at_once:
            return able
        if not self._acting[robot]:
            return _NOBODY
        if not self._acts(robot, at, target):
            return robot
        return able if able in (robot, _ANYBODY) else None

    def _acts(self, robot: int, at: int, target: int) -> bool:
        """Tell whether a step is an action."""
        nodes = self._systems[robot].nodes
        here, there = (self._places.nodes[number][robot] for number in (at, target))
        return nodes[here].internal != nodes[there].internal

    def _is_closed(self, home: int, masks: Masks, shown: int, effect: int) -> bool:
        """Tell whether the formula is kept when a cycle that has come home is repeated for ever."""
        if shown != self._places.everything:
            return False
        effects, letter = self._effects_at(home), self._places.letter(home, SEAM)
        begun = self._places.followers.after(masks, letter)
        return begun is not None and effects.accepts(begun, effects.after(effect, letter))

    @memoized
    def _effects_at(self, home: int) -> CycleEffects:
        return CycleEffects(self._places.followers, self._places.remembered[home])

    @memoized
    def _costs_left(self, home: int, at: int, shown: int) -> tuple[Floats, float]:
        """Return what is left for each account, for some ways to share it out of which one is taken, and the least sum. Shape (shares, accounts)."""
        nodes = self._places.nodes
        costs = self._shares.before(nodes[at]) if home == _BEFORE else self._shares.of_cycle(nodes[home], nodes[at], shown)
        return costs, float(costs.sum(axis=1).min())

    def pay(self, label: Label[int], cost: float, who: object) -> Iterator[tuple[Costs, object]]:
        """Yield what each account has paid after a step.

        Args:
            label: Of the state before the step.
            cost: Of the step.
            who: The robot, by number; None where the cycle begins or ends.
        """
        if not isinstance(who, int):
            yield label.paid, who
            return
        account, paid = self._accounts[who], label.paid
        yield (*paid[:account], paid[account] + cost, *paid[account + 1 :]), who

    def rank(self, state: int, paid: Costs, _: float) -> tuple[float, ...]:
        """Return a bound on the highest account, whether robots are not apart where the cycle begins, and a bound on the sum.

        Args:
            state: Where the plan has come to; the number may be of a closed cycle.
            paid: What each account has paid.
        """
        closed = is_complete(state)
        key = self._states.known[state - complete(0) if closed else state]
        begun = self._places.places[key.at][0] if key.home == _BEFORE else key.home
        bound, total, haste = max(paid), sum(paid), self._terms.haste
        if not closed:
            costs, least = self._costs_left(key.home, begun if key.home == _BEFORE else key.at, key.shown)
            bound, total = float((haste * costs + paid).max(axis=1).min()), total + least
            if key.home == _BEFORE:
                bound = max(bound, (sum(paid) + haste * self._before[key.at]) / len(paid))
        if bound == math.inf:
            return (bound,)
        together = (closed or key.home != _BEFORE) and not self._terms.apart[begun]
        return math.floor(bound / _GRAIN) * _GRAIN, together, total

    def cycle(self, found: Found) -> tuple[list[Nodes], list[Nodes]]:
        """Return what all robots are at before a closed cycle, where it begins included, and in it, back to there.

        Args:
            found: By a search that found one.
        """
        keys, nodes = [self._states.known[state] for state in found.states], self._places.nodes
        prefix = [nodes[self._places.places[key.at][0]] for key in keys if key.home == _BEFORE]
        cycle = [nodes[key.at] for key in keys if key.home != _BEFORE]
        return prefix, [*(cycle or prefix[-1:]), prefix[-1]]
