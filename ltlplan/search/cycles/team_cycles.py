"""A team's cycles as a value: what each robot does, one move a stage, where cycles may begin, what each robot visits, and who waits for whom.

Moves that may be made at the same time are put into stages, between which robots wait for each other. A lasso of the product is a list of moves one after another. Neighbouring moves are put into one stage for as long as every order in
which their letters can come, in every cycle anew, does what is asked. Between two stages robots wait where they are, as in plans that count.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from ltlplan.allocation import Itinerary
from ltlplan.search.cycles.strong_components import components, graph_of
from ltlplan.search.cycles.team_readers import LetterReader, Reader
from ltlplan.search.cycles.team_system import NOBODY, SEAM, Nodes, TeamLetter, TeamSystem, resting
from ltlplan.search.itineraries import itinerary, path_cost
from ltlplan.search.numbering import Numbers
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Infeasible, Mission, Word
from verify.data.language.word import stutter_free
from verify.data.plan import Meeting
from verify.data.shapes.inequalities import Point
from verify.data.validation.spacing import spacing_of

MOST_PLACES = 20_000
"""Places that are looked at to tell whether every order will do."""


@dataclass(frozen=True, slots=True)
class Move:
    """One robot's way from where it rests to where it rests next, or what it does there.

    Attributes:
        robot: Which robot.
        way: Its nodes, the one where it begins first.
    """

    robot: int
    way: tuple[int, ...]


Stage = tuple[Move, ...]


@dataclass(frozen=True, slots=True)
class Course:
    """Course of a team: stages once, then stages cycle by cycle.

    Attributes:
        begin: Each robot's node at the start.
        prefix: Stages before the first cycle.
        cycle: Stages of each cycle.
    """

    begin: Nodes
    prefix: tuple[Stage, ...]
    cycle: tuple[Stage, ...]


def staged(system: TeamSystem, readers: Sequence[Reader], course: Course, *, joint: bool) -> Course:
    """Return the course with as many moves at the same time as were found to do what is asked.

    Args:
        system: The team's.
        readers: The formula's conjuncts.
        course: One move a stage.
        joint: Whether changes at one instant show as one.
    """
    if any(reader.guesses for reader in readers):
        return course

    def will_do(prefix: Sequence[Stage], cycle: Sequence[Stage]) -> bool:
        return _every_order(system, readers, Course(course.begin, tuple(prefix), tuple(cycle)), joint=joint)

    if will_do(_all_at_once(course.prefix), _all_at_once(course.cycle)):
        return Course(course.begin, _all_at_once(course.prefix), _all_at_once(course.cycle))
    prefix, cycle = course.prefix, course.cycle
    cycle = _merged(cycle, lambda stages: will_do(prefix, stages))
    return Course(course.begin, _merged(prefix, lambda stages: will_do(stages, cycle)), cycle)


def _all_at_once(stages: tuple[Stage, ...]) -> tuple[Stage, ...]:
    return (tuple(itertools.chain(*stages)),) if stages else ()


def _merged(stages: tuple[Stage, ...], will_do: Callable[[tuple[Stage, ...]], bool]) -> tuple[Stage, ...]:
    at = 0
    while at + 1 < len(stages):
        more = (*stages[:at], (*stages[at], *stages[at + 1]), *stages[at + 2 :])
        if will_do(more):
            stages = more
        else:
            at += 1
    return stages


_Place = tuple[int, tuple[int, ...], Nodes, int, tuple[int, ...]]
"""Stage, how far each robot is in it, the robots' nodes, who moved last, and the conjuncts' states."""


def _every_order(system: TeamSystem, readers: Sequence[Reader], course: Course, *, joint: bool) -> bool:
    """Tell whether every order of a stage's letters, cycle by cycle, does what is asked."""
    stages = [_ways(stage, len(course.begin)) for stage in (*course.prefix, *course.cycle)]
    first = len(course.prefix)

    def read(states: tuple[int, ...], letter: TeamLetter) -> tuple[int, ...] | None:
        after: list[int] = []
        for reader, state in zip(readers, states, strict=True):
            if isinstance(reader, LetterReader) and reader.stays:
                after.append(int("held" in reader.seen(letter)))
                continue
            targets = tuple(reader.successors(state, letter))
            if not targets:
                return None
            after.append(targets[0])
        return tuple(after)

    begun = read(tuple(reader.initial for reader in readers), system.letter(course.begin, NOBODY))
    if begun is None:
        return False
    places: Numbers[_Place] = Numbers([(0, (0,) * len(course.begin), course.begin, NOBODY, begun)])
    edges: list[list[int]] = []
    for place in places.known:  # grows while it is walked
        found: list[int] = []
        stage, _, nodes, mover, states = place
        for to, far, now, who in _following(stages, first, place, joint=joint):
            if (now, who) != (nodes, mover):
                further = read(states, system.letter(now, who))
            else:  # nobody moves: the next stage begins, or the next cycle, in each of which all are read, those that rest, too
                further = states if to > stage else read(states, system.letter(now, SEAM))
            if further is None:
                return False
            found.append(places[to, far, now, who, further])
        if len(places) > MOST_PLACES:
            return False
        edges.append(found)
    return all(_comes_again(reader, k, places.known, edges) for k, reader in enumerate(readers))


def _comes_again(reader: Reader, k: int, order: Sequence[_Place], edges: Sequence[Sequence[int]]) -> bool:
    """Tell whether one conjunct accepts on every way that goes on for ever."""
    if isinstance(reader, LetterReader) and reader.stays:
        return all(order[place][4][k] for part in components(graph_of(edges)) for place in part)
    kept = [order[place][4][k] not in reader.accepting for place in range(len(order))]
    without = [[t for t in targets if kept[t]] if kept[place] else [] for place, targets in enumerate(edges)]
    return not components(graph_of(without))


def _ways(stage: Stage, robots: int) -> tuple[tuple[int, ...], ...]:
    """Return for each robot the nodes that it goes through in a stage, one after another."""
    return tuple(tuple(node for move in stage if move.robot == robot for node in move.way[1:]) for robot in range(robots))


def _following(
    stages: Sequence[tuple[tuple[int, ...], ...]], first: int, place: _Place, *, joint: bool
) -> Iterator[tuple[int, tuple[int, ...], Nodes, int]]:
    """Yield what can come next: a robot goes on, several at one instant, or the next stage begins."""
    stage, done, nodes, mover, _ = place
    if stage == len(stages):  # a cycle in which nobody moves
        yield stage, done, nodes, mover
        return
    ways = stages[stage]
    able = [robot for robot, way in enumerate(ways) if done[robot] < len(way)]
    if not able:
        after = stage + 1
        yield (first if after == len(stages) else after), (0,) * len(nodes), nodes, mover
        return
    for size in range(1, (len(able) if joint else 1) + 1):
        for movers in itertools.combinations(able, size):
            far, now = list(done), list(nodes)
            for robot in movers:
                now[robot] = ways[robot][done[robot]]
                far[robot] += 1
            yield stage, tuple(far), tuple(now), movers[0]


@dataclass(frozen=True, slots=True)
class TeamCycles:
    """Infinite plan of a team: prefixes and cycles.

    Attributes:
        prefixes: Each robot's nodes up to where its cycle begins, that one included.
        cycles: Each robot's nodes in a cycle, from where it begins back to there; one node where it rests.
        course: The same in stages; None where no robot waits for another.
        least: No cycles cost less, in sum or for the robot with the highest cost, as was asked; None where that is not known.
        exact: Whether no cycles of robots that fly one at a time cost less.
        reached: States that the search went on with, or lassos of single robots.
    """

    prefixes: tuple[tuple[int, ...], ...]
    cycles: tuple[tuple[int, ...], ...]
    course: Course | None
    least: float | None
    exact: bool
    reached: int


def may_begin(mission: Mission, system: TransitionSystem) -> list[bool]:
    """Tell of each node whether a robot's cycle may begin there: at rest, and not in a hoop where others begin theirs at the same time.

    Args:
        mission: Says which regions have rings, and how many robots there are.
        system: The robot's.
    """
    alone = len(mission.agents) == 1
    rests = resting(system, alone=alone)
    if alone or not system.nodes:
        return rests
    return [rest and not node.regions & mission.hoops.keys() for rest, node in zip(rests, system.nodes, strict=True)]


def are_apart(mission: Mission, systems: Sequence[TransitionSystem], nodes: Sequence[int]) -> bool:
    """Tell whether robots are as far from each other as they have to be at rest.

    Args:
        mission: Says where regions are, and how far robots keep apart.
        systems: Each robot's.
        nodes: What the robots are at.
    """
    places = [_place(mission, s, n) for s, n in zip(systems, nodes, strict=True)]
    kept = spacing_of(mission)
    return all(a is None or b is None or kept.between(a, b) >= kept.at_rest for a, b in itertools.combinations(places, 2))


def _place(mission: Mission, system: TransitionSystem, index: int) -> Point | None:
    if not system.nodes:
        return None
    node = system.nodes[index]
    return node.position if node.position is not None else mission.all_regions[node.place].center


def moves_along(system: TeamSystem, nodes: Sequence[Nodes]) -> tuple[Stage, ...]:
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
        if system.rests[robot][after[robot]]:
            yield robot, tuple(begun)
            begun = []


def team_itineraries(each: Sequence[TransitionSystem], team: TeamCycles, repeat: int) -> dict[str, Itinerary]:
    """Return what each robot does: visits of the prefix, then those of one cycle.

    Args:
        each: The robots' systems.
        team: Their paths.
        repeat: How many cycles count in costs.

    Raises:
        Infeasible: A cycle would begin with an action where the robot rests.
    """
    found: dict[str, Itinerary] = {}
    for system, prefix, cycle in zip(each, team.prefixes, team.cycles, strict=True):
        before, after = itinerary(system, prefix).visits, itinerary(system, cycle).visits
        begun = len(system.nodes[cycle[0]].regions)
        if any(visit.actions for visit in after[:begun]):
            raise Infeasible(
                f"{system.robot}'s lap would begin with an action in '{after[0].region}', where it rests: laps begin and end in the same "
                "internal state, and what is done in a region where a lap begins is done at its end. Give the robot another region to rest in."
            )
        once, again = (stutter_free(system.labels[node] for node in way) for way in (prefix, cycle))
        word = Word(once, again[1:]) if len(again) > 1 else Word(once[:-1], once[-1:])
        cost = path_cost(system, prefix) + repeat * path_cost(system, cycle)
        found[system.robot] = Itinerary((*before, *after[begun:]), word, len(before), cost)
    return found


def team_meetings(each: Sequence[TransitionSystem], team: TeamCycles) -> list[Meeting]:
    """Return the waits between stages: each robot of a stage sets out when all others of the one before have arrived.

    Args:
        each: The robots' systems.
        team: Their paths, in stages.

    Raises:
        Infeasible: A robot would have to wait where it visits nothing, or with an action.
    """
    if team.course is None:
        return []
    prefixes = [len(itinerary(system, prefix).visits) for system, prefix in zip(each, team.prefixes, strict=True)]
    begun = [len(system.nodes[cycle[0]].regions) for system, cycle in zip(each, team.cycles, strict=True)]
    found = [
        *_meetings(each, team.course.prefix, [prefix[0] for prefix in team.prefixes], [0] * len(each)),
        *_meetings(
            each, team.course.cycle, [cycle[0] for cycle in team.cycles], [n - b for n, b in zip(prefixes, begun, strict=True)]
        ),
    ]
    return list(dict.fromkeys(found))


def _meetings(
    each: Sequence[TransitionSystem], stages: Sequence[Stage], begin: Sequence[int], offsets: Sequence[int]
) -> Iterator[Meeting]:
    ways = [[node] for node in begin]
    spans: list[Mapping[int, tuple[int, int]]] = []  # of each stage: robot, how many visits it has made before and after
    for stage in stages:
        before = [len(itinerary(system, tuple(way)).visits) for system, way in zip(each, ways, strict=True)]
        for move in stage:
            ways[move.robot].extend(move.way[1:])
        after = [len(itinerary(system, tuple(way)).visits) for system, way in zip(each, ways, strict=True)]
        spans.append({move.robot: (before[move.robot], after[move.robot]) for move in stage})
    for earlier, later in itertools.pairwise(spans):
        for robot, (setting_out, _) in sorted(later.items()):
            for other, (_, arrived) in sorted(earlier.items()):
                if other == robot:
                    continue
                for who, stage in ((robot, later), (other, earlier)):
                    if stage[who][0] == stage[who][1]:
                        raise Infeasible(_NOTHING.format(name=each[who].robot))
                yield Meeting(
                    first=(each[other].robot, arrived - 1 + offsets[other]),
                    then=(each[robot].robot, setting_out + offsets[robot]),
                )


_NOTHING = (
    "The formula asks that {name} does something before or after another robot sets out without coming to a region: such waits are not "
    "planned. Give the place or the action a region of its own."
)
