"""The cheapest laps of a team: a lasso of the product of all robots, and which of its moves may be made at the same time.

The lasso is cheapest among those in which one robot flies at a time (the least sum of costs). Its lap is turned so that it begins
where all robots rest, apart from each other where that can be; nobody rests in a hoop then.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.lassos.concurrent_cycle_steps import Course, Move, Stage, staged
from ltlplan.search.lassos.incremental_teams import cheapest_team_lasso
from ltlplan.search.lassos.lasso import LassoRun, begun_soonest, cheapest_lasso, lasso_exists
from ltlplan.search.lassos.team_readers import reads_letters, team_readers
from ltlplan.search.lassos.team_system import Nodes, TeamSystem
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Infeasible, Mission
from verify.data.shapes.inequalities import Point
from verify.data.validation.spacing import spacing_of

MOST_TOGETHER = 20_000
"""Places of the product of robots that fly at the same time, which only a bound needs."""


@dataclass(frozen=True, slots=True)
class TeamLasso:
    """What a team does for ever.

    Attributes:
        prefixes: Each robot's nodes up to where its lap begins, that one included.
        laps: Each robot's nodes in a lap, from where it begins back to there; one node where it rests.
        course: The same in stages; None where no robot waits for another.
        least: No laps cost less in sum; None where that is not known.
        exact: Whether no laps of robots that fly one at a time cost less.
        reached: Places of the product that were walked over, or lassos of single robots.
    """

    prefixes: tuple[tuple[int, ...], ...]
    laps: tuple[tuple[int, ...], ...]
    course: Course | None
    least: float | None
    exact: bool
    reached: int


def plan_team_lasso(mission: Mission, each: Sequence[TransitionSystem], asked: Formula, budget: Budget) -> TeamLasso | None:
    """Return the cheapest laps of a team, or None where robots that fly one at a time have none.

    Args:
        mission: Gives the reading, where regions are, how far robots keep apart, and how many laps count.
        each: What each robot can do.
        asked: The formula over what they can show, written out.
        budget: Bounds on the product's states, and on those expanded in search of rounds.

    Raises:
        BadInput: A conjunct is of a form that is not planned.
        Infeasible: The laps have no moment at which all robots rest in regions without rings or at their starts.
        TooLarge: The product has more states than the budget allows.
    """
    try:
        found = cheapest_team_lasso(mission, each, asked, budget)
    except TooLarge as error:
        raise _too_large(len(each), error) from None
    if found is None:
        return None
    run, system, readers = found.run, found.system, found.readers
    prefix, cycle = _turned(mission, system, run)
    least = _least(mission, each, asked, budget)
    course = staged(system, readers, course_of(system, prefix, cycle), joint=mission.spec.team == "joint")
    cost = run.prefix_cost + mission.spec.repeat * run.cycle_cost
    # where robots are read one at a time the product tells apart who moved last, and may have the first step of a lap twice
    exact = found.whole and reads_letters(mission, asked) and run.bound >= cost - 1e-6
    return TeamLasso(ways_of(len(each), prefix), ways_of(len(each), cycle), course, least, exact, len(system.places))


def course_of(system: TeamSystem, prefix: Sequence[Nodes], cycle: Sequence[Nodes]) -> Course:
    """Return laps of robots that fly one at a time, one move a stage.

    Args:
        system: The team's.
        prefix: What all robots are at, one move after another, up to where the lap begins.
        cycle: From where it begins back to there.
    """
    return Course(system.nodes(system.initial), _moves(system, prefix), _moves(system, cycle))


def _least(mission: Mission, each: Sequence[TransitionSystem], asked: Formula, budget: Budget) -> float | None:
    """Return what laps cost at the least in which several robots may be on their way; None where that takes too many states, or is not known.

    Counted are conjuncts that are back in their states after every lap, whose laps are rounds of the product; the others may ask for more.
    """
    system = TeamSystem(each, together=True, movers=False)  # who moved last is nothing to those readers
    readers = [reader for reader in team_readers(mission, asked, system.letters, budget) if reader.closes]
    if not readers:
        return None
    budget = replace(budget, lasso=min(budget.lasso, MOST_TOGETHER))
    try:
        run = cheapest_lasso(system, readers, weight=mission.spec.repeat, budget=budget)
    except TooLarge:
        return None
    return None if run is None else max(0.0, run.bound - 1e-6)


def team_lasso_exists(
    mission: Mission, each: Sequence[TransitionSystem], asked: Formula, budget: Budget, *, together: bool
) -> bool:
    """Tell whether there are any laps of a team.

    Args:
        mission: Gives the reading.
        each: What each robot can do.
        asked: The formula, written out.
        budget: Bounds on the product's states.
        together: Whether several robots may be on their way at the same time.

    Raises:
        BadInput: A conjunct is of a form that is not planned.
        TooLarge: The product has more states than the budget allows.
    """
    system = TeamSystem(each, together=together)
    readers = team_readers(mission, asked, system.letters, budget)
    return lasso_exists(system, readers, budget=budget)


def _too_large(robots: int, error: TooLarge) -> TooLarge:
    hint = (
        f"Laps are planned over the product of all {robots} robots, which is for small teams: ask for fewer robots or regions, for "
        "fewer parts that happen once (`F a` doubles the states, `G F a` does not), for a finite trace, or one mission a robot."
    )
    return TooLarge("The infinite trace's product of robots and automata has", error.used, "states", error.limit, hint)


def _turned(mission: Mission, system: TeamSystem, run: LassoRun) -> tuple[list[Nodes], list[Nodes]]:
    """Return what the team goes through before and in a lap, which begins and ends where all robots rest."""
    prefix, cycle = begun_soonest([system.nodes(place) for place in run.prefix], [system.nodes(place) for place in run.cycle])
    turns = [turn for turn, nodes in enumerate(cycle) if can_begin(mission, system, nodes)]
    if not turns:
        raise Infeasible(
            "There is no moment in the team's laps at which all robots rest, in regions without rings or at their starts, so that a lap "
            "could begin: give the robots such a region to come to."
        )
    turns = [turn for turn in turns if _all_set_out(system, cycle, turn)] or turns
    turn = next((turn for turn in turns if are_apart(mission, system, cycle[turn])), turns[0])
    return [*prefix, *cycle[: turn + 1]], [*cycle[turn:], *cycle[: turn + 1]]


def can_begin(mission: Mission, system: TeamSystem, nodes: Nodes) -> bool:
    """Tell whether all robots rest where a lap may begin.

    Args:
        mission: Says which regions have rings.
        system: The team's.
        nodes: What the robots are at.
    """
    if not system.all_rest(nodes):
        return False
    return not any(s.nodes and s.nodes[n].regions & mission.hoops.keys() for s, n in zip(system.systems, nodes, strict=True))


def _all_set_out(system: TeamSystem, cycle: Sequence[Nodes], turn: int) -> bool:
    """Tell whether robots begin a lap that begins here by flying: what is done where a lap begins is done at its end."""
    later = [*cycle[turn:], *cycle[:turn]]
    for robot, own in enumerate(system.systems):
        here = later[0][robot]
        after = next((nodes[robot] for nodes in later if nodes[robot] != here), here)
        if own.nodes and after != here and own.nodes[after].regions == own.nodes[here].regions:
            return False
    return True


def are_apart(mission: Mission, system: TeamSystem, nodes: Nodes) -> bool:
    """Tell whether robots are as far from each other as they have to be at rest.

    Args:
        mission: Says where regions are, and how far robots keep apart.
        system: The team's.
        nodes: What the robots are at.
    """
    places = [_place(mission, s, n) for s, n in zip(system.systems, nodes, strict=True)]
    kept = spacing_of(mission)
    return all(a is None or b is None or kept.between(a, b) >= kept.at_rest for a, b in itertools.combinations(places, 2))


def _place(mission: Mission, system: TransitionSystem, index: int) -> Point | None:
    if not system.nodes:
        return None
    node = system.nodes[index]
    return node.position if node.position is not None else mission.all_regions[node.place].center


def ways_of(robots: int, nodes: Sequence[Nodes]) -> tuple[tuple[int, ...], ...]:
    """Return each robot's own nodes, without those in which it stayed.

    Args:
        robots: How many there are.
        nodes: What all are at, one move after another.
    """
    found: list[tuple[int, ...]] = []
    for robot in range(robots):
        own = [each[robot] for each in nodes]
        found.append(tuple(node for i, node in enumerate(own) if i == 0 or own[i - 1] != node))
    return tuple(found)


def _moves(system: TeamSystem, nodes: Sequence[Nodes]) -> tuple[Stage, ...]:
    """Return the moves between places at which all robots rest, each a stage; what a robot does where it is belongs to its last move."""
    found: list[Move] = []
    for robot, way in _single_moves(system, nodes):
        where = [system.systems[robot].nodes[n] for n in way] if system.systems[robot].nodes else []
        stays = bool(where) and len({(node.place, node.flying, node.position) for node in where}) == 1
        if found and found[-1].robot == robot and stays:
            found[-1] = Move(robot, (*found[-1].way, *way[1:]))
        else:
            found.append(Move(robot, way))
    return tuple((move,) for move in found)


def _single_moves(system: TeamSystem, nodes: Sequence[Nodes]) -> Iterator[tuple[int, tuple[int, ...]]]:
    begun: list[int] = []
    for before, after in itertools.pairwise(nodes):
        movers = [robot for robot, (a, b) in enumerate(zip(before, after, strict=True)) if a != b]
        if not movers:
            continue
        (robot,) = movers
        begun = [*(begun or [before[robot]]), after[robot]]
        if system.rests(robot, after[robot]):
            yield robot, tuple(begun)
            begun = []
