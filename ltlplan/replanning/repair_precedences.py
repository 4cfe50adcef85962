"""Waits between visits under which a team's words satisfy the formula whatever the times.

A plan whose formula fails in flight keeps its assignment and gets waits. They are read off counterexamples: each is ruled
out by a pair of visits of two robots, the first to be over before the second begins, and among such pairs the one
that the present times nearly keep is taken. Nothing is claimed here: the flight with its waits is checked anew.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from graphlib import CycleError, TopologicalSorter
from itertools import islice, pairwise, permutations

from verify.certificate import Certificate
from verify.data import Mission, Witness
from verify.data.language.counting import Atom, atoms
from verify.data.language.formula import Formula
from verify.data.language.word import Letter
from verify.data.sections import TeamReading
from verify.logic.normal_form import Normal, conjuncts, normal_form
from verify.logic.progression import OutOfBudget
from verify.logic.team_letters import TeamLetters
from verify.model_checking.compositional.violation_automaton import BreakingWords
from verify.model_checking.inclusion import find_broken
from verify.model_checking.robot_letters import ALWAYS, RobotBehaviour
from verify.model_checking.team_graph import JointGraph, OwnGraph
from verify.model_checking.timeline import Timeline

BUDGET = 30_000
MAX_WAITS = 60
MAX_ORDERS = 24

ALLOWED = 3_000_000
"""Steps of all tries together; beyond them no waits are found, and the flight is rejected as it stands."""

FEW = 4
"""Robots that change their letters up to which all are followed; of more, those that matter to a conjunct or are in waits."""

LESS = 10
"""By this the budget is divided where there are more robots, as waits are tried one after another."""

Wait = tuple[tuple[str, int], tuple[str, int]]
"""((robot, visit), (robot, visit)): the first must be over before the second begins."""
_Pair = tuple[tuple[int, int], tuple[int, int]]
"""((robot, visit), (robot, visit)), robots by number."""


class _Allowance:
    """What the search for waits may take: configurations each time that some are tried, and steps in all."""

    def __init__(self, budget: int, steps: int) -> None:
        self.budget, self._left = budget, steps

    def step(self) -> None:
        self._left -= 1
        if self._left < 0:
            raise OutOfBudget("more steps than all waits together may take")


@dataclass(frozen=True, slots=True)
class _Visit:
    start: Fraction
    stop: Fraction
    first: int  # index of the first letter of the visit
    after: int | None  # index of the first letter after it; None where it lasts to the end
    number: int  # index among the planned visits


@dataclass(frozen=True, slots=True)
class _Robot:
    name: str
    letters: tuple[Letter, ...]
    visits: tuple[_Visit, ...]


def with_proposed_waits(certificate: Certificate) -> Certificate:
    """Return a certificate whose witnesses of a broken formula name waits that would rule it out, where some are found.

    Args:
        certificate: As the judge made it, of finite flights or laps; no waits are known that would help in laps.
    """
    mission, timelines = certificate.mission, certificate.timelines
    if len(timelines) < 2 or mission.spec.trace == "infinite":
        return certificate

    def proposed(witness: Witness | None, asked: Mission) -> Witness | None:
        if witness is None or witness.claim != "formula" or not witness.word:
            return witness
        return replace(witness, order=repairing_waits(asked.formula, asked.spec.team, timelines))

    claims = tuple(replace(claim, witness=proposed(claim.witness, mission)) for claim in certificate.claims)
    soft = tuple(replace(part, witness=proposed(part.witness, mission.asking(part.formula))) for part in certificate.soft)
    return replace(certificate, claims=claims, soft=soft)


def repairing_waits(
    formula: Formula, reading: TeamReading, timelines: Mapping[str, Timeline], budget: int = BUDGET
) -> tuple[Wait, ...]:
    """Return waits under which every team word of the nominal words satisfies the formula; empty where none are found.

    Args:
        formula: What every team word is to satisfy.
        reading: Whether letters are the robots' own or joint.
        timelines: One for each robot, by name.
        budget: Configurations that may be met each time that some waits are tried.
    """
    robots = [_nominal(timeline) for timeline in timelines.values()]
    known = atoms(formula)
    if not known:
        robots = _busy(robots)
    if len(robots) > FEW:
        budget //= LESS
    allowance = _Allowance(budget, ALLOWED)
    try:
        parts = [_Part.of(normal, robots, reading, known) for normal in conjuncts(normal_form(formula))]
        found = _from_counterexamples(robots, reading, parts, allowance)
        if found is None:
            found = _one_after_another(robots, reading, parts, allowance)
    except OutOfBudget:
        return ()
    if not found:
        return ()
    return tuple(
        ((robots[a].name, robots[a].visits[i].number), (robots[b].name, robots[b].visits[j].number))
        for (a, i), (b, j) in _needed(found)
    )


def _busy(robots: list[_Robot]) -> list[_Robot]:
    """Keep one of the robots that hold one and the same letter all the time."""
    kept: dict[object, _Robot] = {}
    for robot in robots:
        kept.setdefault(robot.letters if len(robot.letters) == 1 else robot.name, robot)
    return list(kept.values())


def _from_counterexamples(
    robots: Sequence[_Robot], reading: TeamReading, parts: Sequence[_Part], allowance: _Allowance
) -> list[_Pair] | None:
    waits: list[_Pair] = []
    while len(waits) <= MAX_WAITS:
        observations = next((found for part in parts if (found := _broken(robots, reading, part, waits, allowance))), None)
        if observations is None:
            return waits
        pair = _best_pair(robots, observations, waits)
        if pair is None:
            return None
        waits.append(pair)
    return None


def _one_after_another(
    robots: Sequence[_Robot], reading: TeamReading, parts: Sequence[_Part], allowance: _Allowance
) -> list[_Pair] | None:
    """Try whole robots one after another, in the order of their present flights first."""
    flying = [r for r, robot in enumerate(robots) if robot.visits]
    flying.sort(key=lambda r: robots[r].visits[0].start)
    for order in islice(permutations(flying), MAX_ORDERS):
        waits: list[_Pair] = [((a, len(robots[a].visits) - 1), (b, 0)) for a, b in pairwise(order)]
        if any(robots[a].visits[i].after is None or robots[b].visits[0].first == 0 for (a, i), (b, _) in waits):
            continue
        if not any(_broken(robots, reading, part, waits, allowance) for part in parts):
            return waits
    return None


@dataclass(frozen=True, slots=True)
class _Part:
    """A conjunct, the robots whose letters can matter to it, and how it counts them, where it does."""

    normal: Normal
    robots: frozenset[int]
    letters: TeamLetters | None = None

    @classmethod
    def of(cls, normal: Normal, robots: Sequence[_Robot], reading: TeamReading, known: Mapping[str, Atom]) -> _Part:
        everyone = range(len(robots))
        if not known.keys().isdisjoint(normal.propositions):
            return cls(normal, frozenset(everyone), TeamLetters.of(normal, known))
        if len(robots) <= FEW:
            return cls(normal, frozenset(everyone))
        seen = [{letter & normal.propositions for letter in robot.letters} for robot in robots]
        if reading == "joint":
            return cls(normal, frozenset(r for r in everyone if any(seen[r])) or frozenset({0}))
        letters = sorted(set[Letter]().union(*seen), key=sorted)
        words = BreakingWords(normal, letters)
        dead = {letter for i, letter in enumerate(letters) if words.dead >> i & 1}
        return cls(normal, frozenset(r for r in everyone if not seen[r] <= dead) or frozenset({0}))


_Nodes = list[dict[int, int]]
"""For each reading of a counterexample where each robot is; robots that cannot matter are left out."""


def _broken(
    robots: Sequence[_Robot], reading: TeamReading, part: _Part, waits: Sequence[_Pair], allowance: _Allowance
) -> _Nodes | None:
    """Return a shortest team word that breaks one conjunct while the waits are kept.

    Robots that neither matter nor wait nor are waited for fly as they like, beside any flights of the others.
    """
    kept = sorted(part.robots.union(*((a, b) for (a, _), (b, _) in waits)))
    place = {robot: i for i, robot in enumerate(kept)}
    behaviours = [_behaviour(robots[r]) for r in kept]
    limits = [(place[a], robots[a].visits[i].after or 0, place[b], robots[b].visits[j].first) for (a, i), (b, j) in waits]

    def permitted(nodes: tuple[int, ...]) -> bool:
        allowance.step()
        return all(nodes[b] < begins or nodes[a] >= over for a, over, b, begins in limits)

    if part.letters is not None:
        own = part.letters.own
        marked = [replace(b, letters=tuple(own(b.robot, letter) for letter in b.letters)) for b in behaviours]
        graph = JointGraph(marked, timed=False, permitted=permitted, together=part.letters.together)
    else:
        graph = (JointGraph if reading == "joint" else OwnGraph)(behaviours, timed=False, permitted=permitted)
    broken = find_broken(graph, part.normal, allowance.budget)
    return None if broken is None else [dict(zip(kept, found.nodes, strict=True)) for found in broken.observations]


def _behaviour(robot: _Robot) -> RobotBehaviour:
    n = len(robot.letters)
    following = tuple((i + 1,) if i + 1 < n else () for i in range(n))
    return RobotBehaviour(robot.name, robot.letters, (ALWAYS,) * n, following, (0,), frozenset({n - 1}))


def _best_pair(robots: Sequence[_Robot], observations: _Nodes, waits: Sequence[_Pair]) -> _Pair | None:
    """Return the pair that rules the counterexample out and delays the present flight least, without a circle."""
    candidates: list[tuple[Fraction, _Pair]] = []
    for a, first in enumerate(robots):
        for b, then in enumerate(robots):
            if a == b or a not in observations[0] or b not in observations[0]:
                continue
            for i, visit in enumerate(first.visits):
                if visit.after is None:
                    continue
                for j, other in enumerate(then.visits):
                    if other.first == 0:
                        continue
                    pair = ((a, i), (b, j))
                    ruled_out = any(nodes[b] >= other.first and nodes[a] < visit.after for nodes in observations)
                    if ruled_out and not _circle(robots, [*waits, pair]):
                        candidates.append((max(visit.stop - other.start, Fraction(0)), pair))
    return min(candidates, default=(None, None))[1]


def _circle(robots: Sequence[_Robot], waits: Sequence[_Pair]) -> bool:
    """Return whether the waits and each robot's own order go round in a circle."""
    after = TopologicalSorter[tuple[int, int, str]]()
    for r, robot in enumerate(robots):
        for i, visit in enumerate(robot.visits):
            after.add((r, i, "over"), (r, i, "begin"))
            if i:
                after.add((r, i, "begin"), (r, i - 1, "begin"))
                after.add((r, i, "over"), (r, i - 1, "over"))
                if robot.visits[i - 1].stop <= visit.start:
                    after.add((r, i, "begin"), (r, i - 1, "over"))
    for (a, i), (b, j) in waits:
        after.add((b, j, "begin"), (a, i, "over"))
    try:
        after.prepare()
    except CycleError:
        return True
    return False


def _needed(waits: Sequence[_Pair]) -> list[_Pair]:
    """Drop waits that another one implies: a later visit of the first robot, an earlier one of the second."""
    kept = [
        pair
        for pair in dict.fromkeys(waits)
        if not any(
            other != pair
            and other[0][0] == pair[0][0]
            and other[1][0] == pair[1][0]
            and other[0][1] >= pair[0][1]
            and other[1][1] <= pair[1][1]
            for other in waits
        )
    ]
    return sorted(kept)


def _nominal(timeline: Timeline) -> _Robot:
    """Return the word that a robot gives where nothing stays open, with its stays."""
    stays = sorted(_stays(timeline))
    events: list[tuple[Fraction, int, str, frozenset[str] | None]] = []
    for start, stop, region in stays:
        if start > 0:
            events.append((start, 1, region, None))
        if stop < timeline.duration:
            events.append((stop, 2, region, None))
    events += [(action.time, 1, "", action.propositions) for action in timeline.actions]
    inside = {region for start, _, region in stays if start <= 0}
    internal = timeline.internal
    letters: list[Letter] = [frozenset(inside) | internal]
    opened: dict[str, list[int]] = {region: [0] for region in inside}
    closed: dict[str, list[int]] = {}
    for _, kind, region, propositions in sorted(events, key=lambda event: event[:3]):
        if propositions is not None:
            internal = propositions
        elif kind == 1:
            inside.add(region)
            opened.setdefault(region, []).append(len(letters))
        else:
            inside.discard(region)
            closed.setdefault(region, []).append(len(letters))
        letters.append(frozenset(inside) | internal)
    offset = 1 if timeline.unplanned else 0
    visits: list[_Visit] = []
    for number, (start, stop, region) in enumerate(stays):
        first = opened[region].pop(0)
        after = closed[region].pop(0) if stop < timeline.duration else None
        if number >= offset:
            visits.append(_Visit(start, stop, first, after, number - offset))
    return _Robot(timeline.robot, tuple(letters), tuple(visits))


def _stays(timeline: Timeline) -> list[tuple[Fraction, Fraction, str]]:
    """Return (start, stop, region) of each maximal time with a status other than "no"."""
    found: list[tuple[Fraction, Fraction, str]] = []
    for region, status in timeline.initial.items():
        begun = Fraction(0) if status != "no" else None
        for change in timeline.changes:
            if change.region != region:
                continue
            if change.status != "no" and begun is None:
                begun = change.time.low
            elif change.status == "no" and begun is not None:
                found.append((begun, change.time.high, region))
                begun = None
        if begun is not None:
            found.append((begun, timeline.duration, region))
    return found
