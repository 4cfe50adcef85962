"""The walk of MTAC-E over the team automaton, whatever a path costs and wherever the team begins (Algorithm 2).

`Walker` is the frame: neighbours of a walk, hand-over where the automaton's states may be divided, the best walks of a round.
What a path costs, and when a team's parts count as finished, is handed in: `offline` prices paths by cross-entropy and starts on
the ground, `sharing.team` prices them by straight lines and starts from wherever a flying team has come to.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from ltlplan.mtac.allocation import Accepting, Metric, Outlook, Part, States, Whereabouts, World
from verify.data import BadInput, Mission
from verify.data.mission import Hoop
from verify.data.progress import Progress

Parts = Mapping[str, Part]

MAX_ROUNDS = 400
"""Visits that one walk may make in all; far beyond any plan that a beam finds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """How to walk.

    Attributes:
        width: Walks that go side by side; 1 is the printed algorithm.
        every_robot: Optimise all robots again at each state, as the paper does.
        optimality_gap: Also ask the exact search for the best assignment by straight lines, and report the gap.
    """

    width: int = 3
    every_robot: bool = False
    optimality_gap: bool = True

    def __post_init__(self) -> None:
        if self.width < 1:
            raise BadInput(f"width must be at least 1, not {self.width}.")


@dataclass(frozen=True, slots=True)
class Walk:
    """A walk so far: one robot is under way, others have finished or have not begun.

    Attributes:
        states: The automaton's states inside the last visited region.
        order: Robots that have flown, in order; the last one is under way.
        parts: Their itineraries.
        costs: Every robot's cost so far.
        score: Cost of the team plus a lower bound on what is left.
        passed: States of the team automaton that the robot under way has passed; it never comes back to one.
    """

    states: States
    order: tuple[str, ...] = ()
    parts: Mapping[str, Part] = field(default_factory=dict)
    costs: Mapping[str, float] = field(default_factory=dict)
    score: float = 0.0
    passed: frozenset[tuple[States, str, str]] = frozenset()

    @property
    def key(self) -> tuple:
        """Walks with the same key differ only in the order in which robots flew."""
        return (self.states, self.order[-1:], tuple(sorted((name, part.moves) for name, part in self.parts.items())))


class Walker:
    """A team, what it may do, and how good that is.

    Attributes:
        consulted: The costs that were compared, round by round: (robot, region) and the robot's cost up to it.
        outlook: The guide.
    """

    def __init__(
        self,
        mission: Mission,
        world: World,
        automaton: Accepting,
        starts: Mapping[str, Whereabouts],
        *,
        begun: States,
        takes_off: bool,
        divides: Callable[[States], bool],
        metric: Metric,
        price: Callable[[str, Part], float],
        holds: Callable[[Parts], bool],
        options: Options,
    ) -> None:
        """Prepare a walk.

        Args:
            mission: Gives the objective.
            world: Moves.
            automaton: Deterministic.
            starts: Where each robot that may fly begins.
            begun: The automaton's states now.
            takes_off: Whether robots' first letters are still to be read.
            divides: Whether another robot may go on from these states.
            metric: Lower bound on the cost of one leg.
            price: Cost of a robot's whole path; infinite where there is no way.
            holds: Whether the team may stop with these parts done (robots that are not named do nothing).
            options: How to walk.
        """
        self.mission, self.world, self.starts, self.options = mission, world, starts, options
        self.begun, self.takes_off, self.decomposition, self.cost, self.holds = begun, takes_off, divides, price, holds
        self.outlook = Outlook(world, automaton, divides, starts, metric, takes_off=takes_off)
        self.everybody = frozenset(starts)
        self.consulted: list[dict[tuple[str, str], float]] = []

    def search(self, say: Progress) -> Walk | None:
        """Walk until no walk that is left can be better than the best finished one; None where none was finished."""
        idle = {robot: self.cost(robot, Part(where)) for robot, where in self.starts.items()}
        first = Walk(self.begun, costs=idle)
        beam = [replace(first, score=self.score(idle, self.outlook.bound_at_start(self.begun, self.everybody)))]
        best: Walk | None = None
        for step in range(MAX_ROUNDS):
            for one in beam:
                best = self.better(best, self.finished(one))
            bound = math.inf if best is None else best.score
            beam = self.next_beam([one for one in beam if one.score < bound], bound)
            say(f"MTAC-E: {step + 1} visits shared", min(0.9, 0.1 + 0.1 * step))
            if not beam:
                break
        return best

    def score(self, costs: Mapping[str, float], rest: float) -> float:
        """The objective so far, with a lower bound on the rest in it."""
        total = sum(costs.values()) + rest
        if self.mission.planner.objective == "sum":
            return total
        return max(max(costs.values()), total / len(costs))

    def better(self, best: Walk | None, others: Iterable[Walk]) -> Walk | None:
        """Return the cheaper of finished walks; the first stays where they are equal."""
        for other in others:
            if best is None or other.score < best.score:
                best = other
        return best

    def finished(self, one: Walk) -> Iterator[Walk]:
        """Yield the walk as a finished one, if all robots' words hold in every order when it stops here."""
        for leaves in self.endings(one):
            parts = dict(one.parts)
            if one.order:
                parts[one.order[-1]] = replace(parts[one.order[-1]], leaves=leaves)
            if self.holds(parts):
                costs = {**one.costs}
                if one.order:
                    costs[one.order[-1]] = self.cost(one.order[-1], parts[one.order[-1]])
                score = self.score(costs, 0.0)
                if math.isfinite(score):
                    yield replace(one, parts=parts, costs=costs, score=score)
                return

    def endings(self, one: Walk) -> Iterator[bool]:
        """Yield whether the last robot leaves its region at the end; the usual choice for that region first."""
        if not one.order:
            if self.outlook.accepts(one.states):
                yield True
            return
        part = one.parts[one.order[-1]]
        usual = isinstance(self.mission.all_regions[part.moves[-1].visit.region], Hoop)
        for leaves in (usual, not usual):
            if self.outlook.accepts(self.over(one.states, part, leaves)):
                yield leaves

    def over(self, states: States, part: Part, leaves: bool) -> States:
        """Return the states after a robot's last visit."""
        return self.outlook.read(states, [self.world.free_letter(part.end(self.world).internal)]) if leaves else states

    def next_beam(self, beam: Sequence[Walk], bound: float) -> list[Walk]:
        """Return the best neighbours of some walks, their paths optimised (lines 6 to 19)."""
        choices: dict[tuple, tuple[float, Walk]] = {}
        for one in beam:
            for guess, choice in self.neighbours(one):
                if choice.key not in choices or guess < choices[choice.key][0]:
                    choices[choice.key] = (guess, choice)
        chosen: list[Walk] = []
        consulted: dict[tuple[str, str], float] = {}
        for guess, choice in sorted(choices.values(), key=lambda pair: pair[0]):
            full = len(chosen) >= self.options.width
            if not self.options.every_robot and (guess >= bound or (full and guess >= chosen[-1].score)):
                break  # neither this nor any later one can be among the best
            robot = choice.order[-1]
            part = choice.parts[robot]
            cost = self.cost(robot, part)
            consulted[robot, part.moves[-1].visit.region] = cost
            if not math.isfinite(cost):
                continue
            costs = {**choice.costs, robot: cost}
            rest = self.outlook.bound(choice.states, part.end(self.world), self.everybody - set(choice.order))
            chosen.append(replace(choice, costs=costs, score=self.score(costs, rest)))
            chosen = sorted(chosen, key=lambda walk: walk.score)[: self.options.width]
        self.consulted.append(consulted)
        return [one for one in chosen if one.score < bound]

    def neighbours(self, one: Walk) -> Iterator[tuple[float, Walk]]:
        """Yield (lower bound, walk) for one more visit by the robot under way, or by another where D allows it."""
        if one.order:
            robot = one.order[-1]
            yield from self.continued(one, one.states, robot, one.parts[robot], first=False)
        states, parts = one.states, one.parts
        if one.order:
            robot = one.order[-1]
            usual = parts[robot].leaves
            # the last region is left, or not, as is usual for it, unless only the other choice divides the task
            choices = [leaves for leaves in (usual, not usual) if self.decomposition(self.over(states, parts[robot], leaves))]
            if not choices:
                return
            states = self.over(states, parts[robot], choices[0])
            parts = {**parts, robot: replace(parts[robot], leaves=choices[0])}
        for other in sorted(self.everybody - set(one.order)):
            where = self.starts[other]
            begun = self.outlook.read(states, [self.world.letter(where)] if self.takes_off else [])
            handed = replace(one, order=(*one.order, other), parts={**parts, other: Part(where)}, passed=frozenset())
            yield from self.continued(handed, begun, other, Part(where), first=True)

    def continued(self, one: Walk, states: States, robot: str, part: Part, *, first: bool) -> Iterator[tuple[float, Walk]]:
        """Yield the walks in which a robot makes one more visit."""
        where = part.end(self.world)
        free = self.everybody - set(one.order)
        for move in self.world.moves(where, first=first):
            after = self.outlook.read(states, self.world.shown(where, move))
            node = (after, move.visit.region, move.internal)
            if self.outlook.is_dead(after) or node in one.passed:
                continue
            longer = part.then(move, leaves=move.visit.region in self.mission.hoops)
            rest = self.outlook.bound(after, longer.end(self.world), free)
            if not math.isfinite(rest):
                continue
            known = one.costs[robot] + self.outlook.leg(robot, where.position, move.visit.region)
            guess = self.score({**one.costs, robot: known}, rest)
            passed = frozenset({node}) if first else one.passed | {node}
            yield guess, replace(one, states=after, parts={**one.parts, robot: longer}, passed=passed)
