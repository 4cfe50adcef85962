"""Laps of a team whose formula falls into parts that one robot keeps and parts that every robot keeps, under `own`.

`F p` and `G F p` ask that some robot shows p, `G p` and `F G p` that all do, in whatever order robots are read. So each part of the first
kind is given to one robot, which flies its own cheapest lasso for what it was given and for what all keep; no product of robots
is needed. All ways to share the parts out are compared: the sum of costs, or the dearest robot's.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from ltlplan.logic.budget import Budget
from ltlplan.logic.conjunction import conjuncts
from ltlplan.logic.small_automata import small_automaton
from ltlplan.search.lassos.lasso import LassoRun, begun_soonest, cheapest_lasso
from ltlplan.search.lassos.memoryless_automata import closes_at_once
from ltlplan.search.lassos.team_readers import temporal_operators
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Infeasible, Mission
from verify.data.shapes.inequalities import Point
from verify.data.validation.spacing import spacing_of

MOST_SHARES = 512
"""Robots times sets of parts, for each of which a lasso is looked for."""

_TURNS = 4_096
"""Combinations of places where laps may begin that are looked at."""

TIES = 1e-6


@dataclass(frozen=True, slots=True)
class Parts:
    """What a formula asks of a team.

    Attributes:
        of_one: Parts that some robot keeps.
        of_all: Parts that every robot keeps.
    """

    of_one: tuple[Formula, ...]
    of_all: tuple[Formula, ...]


@dataclass(frozen=True, slots=True)
class SharedLasso:
    """Each robot's own lasso.

    Attributes:
        prefixes: Each robot's nodes up to where its lap begins, that one included.
        laps: Each robot's nodes in a lap, from where it begins back to there; one node where it rests.
        least: No laps cost less, in sum or for the dearest robot, as was asked; None where that is not known.
        lassos: How many lassos were looked for.
    """

    prefixes: tuple[tuple[int, ...], ...]
    laps: tuple[tuple[int, ...], ...]
    least: float | None
    lassos: int


def parts_of(mission: Mission, asked: Formula) -> Parts | None:
    """Return a formula in parts, or None where it has others, or too many, or is not read one robot at a time.

    Args:
        mission: Gives the reading and the robots.
        asked: The formula, written out.
    """
    if mission.spec.team != "own":
        return None
    one: list[Formula] = []
    every: list[Formula] = []
    for part in dict.fromkeys(conjuncts(asked)):
        operators = temporal_operators(part)
        if operators is None:
            return None
        (one if operators.endswith("F") else every).append(part)
    return Parts(tuple(one), tuple(every)) if len(mission.agents) << len(one) <= MOST_SHARES else None


def share_out(
    mission: Mission, each: Sequence[TransitionSystem], parts: Parts, budget: Budget, *, longest: bool
) -> SharedLasso | None:
    """Return the cheapest laps, or None where there are none.

    Args:
        mission: Says where regions are, how far robots keep apart, and how many laps count.
        each: What each robot can do.
        parts: The formula's.
        budget: Bounds on the product of one robot and its automata.
        longest: Whether the dearest robot's cost counts instead of the sum.

    Raises:
        Infeasible: A robot's lap has no moment at which it rests in a region without a ring, or at its start.
        TooLarge: A product has more states than the budget allows.
    """
    own = [_lassos(system, parts, mission.spec.repeat, budget) for system in each]
    everything = (1 << len(parts.of_one)) - 1
    best: dict[int, tuple[float, tuple[int, ...]]] = {0: (0.0, ())}  # parts done so far: cost, and the share of each robot
    for runs in own:
        after: dict[int, tuple[float, tuple[int, ...]]] = {}
        for done, (cost, shares) in best.items():
            left = everything & ~done
            share = left
            while True:
                if (run := runs[share]) is not None:
                    own_cost = _cost(run, mission.spec.repeat)
                    total = max(cost, own_cost) if longest else cost + own_cost
                    known = after.get(done | share)
                    if known is None or total < known[0] - 1e-9:
                        after[done | share] = (total, (*shares, share))
                if not share:
                    break
                share = (share - 1) & left
        best = after
    if everything not in best:
        return None
    cost, shares = best[everything]
    chosen = [begun_soonest(run.prefix, run.cycle) for runs, share in zip(own, shares, strict=True) if (run := runs[share])]
    prefixes, laps = _turned(mission, each, chosen)
    automata = [small_automaton(part, "infinite", budget=budget) for part in (*parts.of_one, *parts.of_all)]
    found = [run for runs in own for run in runs if run is not None]
    exact = all(map(closes_at_once, automata)) and all(run.bound >= _cost(run, mission.spec.repeat) - TIES for run in found)
    return SharedLasso(prefixes, laps, max(0.0, cost - TIES) if exact else None, len(own) << len(parts.of_one))


def _cost(run: LassoRun, laps: int) -> float:
    return run.prefix_cost + laps * run.cycle_cost


def _lassos(system: TransitionSystem, parts: Parts, laps: int, budget: Budget) -> list[LassoRun | None]:
    """Return one robot's cheapest lasso for each set of parts, by bits."""
    one = [small_automaton(part, "infinite", budget=budget) for part in parts.of_one]
    every = [small_automaton(part, "infinite", budget=budget) for part in parts.of_all]
    found: list[LassoRun | None] = []
    for share in range(1 << len(one)):
        if any(found[share & ~(1 << bit)] is None for bit in range(len(one)) if share >> bit & 1):
            found.append(None)  # less cannot be done either
            continue
        automata = [*every, *(automaton for bit, automaton in enumerate(one) if share >> bit & 1)]
        found.append(cheapest_lasso(system, automata, weight=laps, budget=budget))
    return found


def _turned(
    mission: Mission, each: Sequence[TransitionSystem], runs: Sequence[tuple[list[int], list[int]]]
) -> tuple[tuple[tuple[int, ...], ...], tuple[tuple[int, ...], ...]]:
    """Return prefixes and laps that begin where robots rest, apart from each other where that can be."""
    turns = [_turns(mission, system, cycle) for system, (_, cycle) in zip(each, runs, strict=True)]
    kept = spacing_of(mission)

    def apart(chosen: Sequence[int]) -> bool:
        places = [_place(mission, s, cycle[turn]) for s, (_, cycle), turn in zip(each, runs, chosen, strict=True)]
        return all(a is None or b is None or kept.between(a, b) >= kept.at_rest for a, b in itertools.combinations(places, 2))

    some = sorted(itertools.islice(itertools.product(*turns), _TURNS), key=sum)
    chosen = next(filter(apart, some), some[0])
    ways = [(prefix, cycle, turn) for (prefix, cycle), turn in zip(runs, chosen, strict=True)]
    prefixes = tuple(_once((*prefix, *cycle[: turn + 1])) for prefix, cycle, turn in ways)
    return prefixes, tuple(_once((*cycle[turn:], *cycle[: turn + 1])) for _, cycle, turn in ways)


def _once(way: Sequence[int]) -> tuple[int, ...]:
    return tuple(node for i, node in enumerate(way) if i == 0 or way[i - 1] != node)


def _turns(mission: Mission, system: TransitionSystem, cycle: Sequence[int]) -> list[int]:
    """Return where a lap may begin: at rest, not in a hoop, and if it can be not with an action."""
    if not system.nodes:
        return list(range(len(cycle)))
    if len(set(cycle)) == 1:
        return [0]
    nodes = [system.nodes[number] for number in cycle]
    rests = [
        turn
        for turn, node in enumerate(nodes)
        if (not node.flying or cycle[turn] == system.initial) and not node.regions & mission.hoops.keys()
    ]
    if not rests:
        raise Infeasible(
            f"There is no moment in {system.robot}'s lap at which it rests, in a region without a ring or at its start, so that a lap could "
            "begin: give it such a region to come to."
        )

    def sets_out(turn: int) -> bool:
        later = (nodes[(turn + more) % len(nodes)] for more in range(1, len(nodes)))
        after = next((node for node in later if node != nodes[turn]), None)
        return after is None or after.regions != nodes[turn].regions

    return [turn for turn in rests if sets_out(turn)] or rests


def _place(mission: Mission, system: TransitionSystem, index: int) -> Point | None:
    if not system.nodes:
        return None
    node = system.nodes[index]
    return node.position if node.position is not None else mission.all_regions[node.place].center
