"""Readings of a team as the search walks them: one protocol for all of them, and one search for each order on costs.

A reading numbers its states. It says where it begins, what follows a state, which plans hold and what is least left. `least_sum` finds the plan
whose costs have the least sum, `least_highest` the one whose highest cost is least (what each robot has paid is kept apart).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Literal

from ltlplan.logic.budget import EVERY, Budget
from ltlplan.search.label_setting import BestFirst, Costs, Label, ParetoSearch

UNREACHABLE = float("inf")
_COMPLETE = 1 << 62  # taken off the number of a state at which a plan is complete: of equal bounds these come first
_LOWEST = -(1 << 61)  # below it are numbers of complete plans

Step = tuple[int, float, object]
"""The next state, the cost, and who pays it, as the reading's `pay` understands that."""


def complete(state: int) -> int:
    """Return the number of the plan that is complete at a state: a step to it ends the plan."""
    return state - _COMPLETE


def is_complete(state: int) -> bool:
    """Tell whether a number is one of a complete plan."""
    return state < _LOWEST


class TeamReading(ABC):
    """Requirements of a mission on a team. States are integers of small absolute value.

    Attributes:
        ties: Of equal bounds, the least state comes first, or the one that is farthest from where plans begin.
    """

    ties: Literal["key", "farthest"] = "key"

    @abstractmethod
    def begin(self) -> int | None:
        """Return the state in which plans begin; None where the mission is lost at once."""

    @abstractmethod
    def steps(self, state: int, /) -> Iterable[Step]:
        """Yield what may follow a state; steps that end the plan there lead to `complete(state)`."""

    def left(self, _state: int, /) -> float:
        """Return a lower bound on the sum of the costs that are left; `UNREACHABLE` where there is no way on. By default nothing is known."""
        return 0.0

    def holds(self, _state: int, /) -> bool:
        """Tell whether a plan that is complete at a state satisfies the mission; that may be asked of few plans and take long."""
        return True


class PaidApart(TeamReading):
    """A reading that also keeps apart what each robot pays.

    Attributes:
        kept_apart: Number of costs that are kept apart; all are 0 where plans begin.
    """

    kept_apart: int

    @abstractmethod
    def pay(self, label: Label[int], cost: float, who: object, /) -> Iterable[tuple[Costs, object]]:
        """Yield what has been paid after a step, and what the step is called in the plan; nothing where it is too much for a robot.

        Args:
            label: Of the state before the step.
            cost: Of the step.
            who: Who pays it, as `steps` named that.
        """

    @abstractmethod
    def rank(self, state: int, paid: Costs, total: float, /) -> tuple[float, ...]:
        """Return a lower bound on the objective, first, and what is taken first of equal bounds.

        Args:
            state: Where the plan has come to; the number may be of a complete plan.
            paid: What has been paid.
            total: The sum of all costs, whoever pays.
        """


@dataclass(frozen=True, slots=True)
class Found:
    """Result of a search.

    Attributes:
        bound: No plan has a lower objective; infinite where there is none.
        tried: Complete plans that were looked at.
        explored: States, or labels of states, that were gone on with.
        reached: Those that were seen.
        stopped: What was used up before the search came to its end.
        states: The plan's states, from the first to the one at which it is complete; none where there is no plan, or none was found.
        steps: What `pay` called each step; none of a search for the least sum.
        cost: The objective; infinite without a plan.
        total: The sum of all costs, whoever pays.
    """

    bound: float = UNREACHABLE
    tried: int = 0
    explored: int = 0
    reached: int = 0
    stopped: Literal["states", "candidates"] | None = None
    states: tuple[int, ...] = ()
    steps: tuple[object, ...] = ()
    cost: float = UNREACHABLE
    total: float = UNREACHABLE


def least_sum(reading: TeamReading, budget: Budget, *, weight: float = 1.0, told: bool = False) -> Found:
    """Return the plan with the least sum of costs (A*).

    Args:
        reading: What is asked of the team.
        budget: States that may be gone on with, and complete plans that may be looked at.
        weight: How much what is left counts; with more than 1 any plan is found sooner, and nothing is known of the least sum.
        told: Whether its bound holds for the mission as a whole, so that it can be told.
    """
    begin, most = reading.begin(), budget.states
    if begin is None:
        return Found()
    steps, bound_of = reading.steps, reading.left

    def successors(state: int) -> Iterable[Step]:
        return () if state < _LOWEST else steps(state)

    def heuristic(state: int) -> float:
        return 0.0 if state < _LOWEST else bound_of(state)

    search = BestFirst([begin], successors, heuristic, weight=weight, ties=reading.ties)
    tried = explored = 0
    for state, cost, bound in search:
        known = bound if weight == 1.0 else 0.0
        if state >= _LOWEST:
            explored += 1
            if explored > most or (explored % EVERY == 0 and budget.ends(explored, known if told else None)):
                return Found(known, tried, explored, len(search.costs), "states")
            continue
        tried += 1
        if reading.holds(state + _COMPLETE):
            reached = sum(1 for other in search.costs if other >= _LOWEST)
            states = tuple(search.path(state)[:-1])
            return Found(cost if weight == 1.0 else known, tried, explored, reached, None, states, (), cost, cost)
        if tried >= budget.candidates:
            return Found(known, tried, explored, len(search.costs), "candidates")
    return Found(UNREACHABLE, tried, explored, len(search.costs))


def least_highest(
    reading: PaidApart,
    budget: Budget,
    *,
    below: float = UNREACHABLE,
    rounding: float = 0.0,
    told: bool = False,
) -> Found:
    """Return the plan with the least objective where what each robot pays is kept apart (Martins 1984).

    Args:
        reading: What is asked of the team.
        budget: Labels that may be gone on with, and complete plans that may be looked at.
        below: The objective is to be less.
        rounding: By how much costs may differ and count as equal.
        told: Whether its bound holds for the mission as a whole, so that it can be told.
    """
    begin = reading.begin()
    if begin is None:
        return Found()

    def successors(label: Label[int]) -> Iterator[Label[int]]:
        for after, cost, who in reading.steps(label.state) if label.state >= _LOWEST else ():
            total = label.total + cost
            for paid, step in reading.pay(label, cost, who):
                rank = reading.rank(after, paid, total)
                if rank[0] < below:
                    yield Label(after, paid, total, rank, label, step)

    nothing, most = (0.0,) * reading.kept_apart, budget.states
    search = ParetoSearch([Label(begin, nothing, 0.0, reading.rank(begin, nothing, 0.0))], successors, rounding=rounding)
    tried = explored = 0
    for label in search:
        bound = label.rank[0]
        if label.state < _LOWEST:
            *path, _ = label.path()
            states = tuple(each.state for each in path)
            tried += 1
            if reading.holds(states[-1]):
                steps = tuple(each.step for each in (*path[1:], label))
                return Found(bound, tried, explored, search.reached, None, states, steps, bound, label.total)
            continue
        explored += 1
        enough = explored > most or (explored % EVERY == 0 and budget.ends(explored, bound if told else None))
        if enough or tried > budget.candidates:
            return Found(bound, tried, explored, search.reached, "states" if enough else "candidates")
    return Found(UNREACHABLE, tried, explored, search.reached)
