"""Waits between visits under which a team's words satisfy the formula whatever the times.

A plan whose formula fails in flight keeps its assignment and gets waits. They are read off counterexamples: each is ruled
out by a pair of visits of two robots, the first to be over before the second begins, and among such pairs the one
that the present times nearly keep is taken. Nothing is claimed here: the flight with its waits is checked anew.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from ltlplan.precedences import circle
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
_Nodes = list[dict[int, int]]
"""For each reading of a counterexample where each robot is; robots that cannot matter are left out."""


@dataclass(frozen=True, slots=True)
class _Visit:
    start: Fraction
    stop: Fraction
    first: int  # index of the first letter of the visit
    after: int | None  # index of the first letter after it; None where it lasts to the end


@dataclass(frozen=True, slots=True)
class _Robot:
    name: str
    letters: tuple[Letter, ...]
    visits: tuple[_Visit, ...]  # the planned ones


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
    robots, known = [_nominal(timeline) for timeline in timelines.values()], atoms(formula)
    robots = robots if known else _busy(robots)
    search = _Search(robots, reading, budget // LESS if len(robots) > FEW else budget)
    try:
        parts = [_Part.of(normal, robots, reading, known) for normal in conjuncts(normal_form(formula))]
        found = _needed(search.waits(parts))
    except OutOfBudget:
        return ()
    return tuple(((robots[a].name, i), (robots[b].name, j)) for (a, i), (b, j) in found)


def _busy(robots: list[_Robot]) -> list[_Robot]:
    """Keep one of the robots that hold one and the same letter all the time."""
    kept: dict[object, _Robot] = {}
    for robot in robots:
        kept.setdefault(robot.letters if len(robot.letters) == 1 else robot.name, robot)
    return list(kept.values())


@dataclass(frozen=True, slots=True)
class _Part:
    """A conjunct, the robots whose letters can matter to it, and how it counts them, where it does."""

    normal: Normal
    robots: frozenset[int]
    letters: TeamLetters | None = None

    @classmethod
    def of(cls, normal: Normal, robots: Sequence[_Robot], reading: TeamReading, known: Mapping[str, Atom]) -> _Part:
        everyone = frozenset(range(len(robots)))
        if not known.keys().isdisjoint(normal.propositions):
            return cls(normal, everyone, TeamLetters.of(normal, known))
        if len(robots) <= FEW:
            return cls(normal, everyone)
        seen = [{letter & normal.propositions for letter in robot.letters} for robot in robots]
        idle = {frozenset[str]()}
        if reading == "own":
            letters = sorted(set[Letter]().union(*seen), key=sorted)
            words = BreakingWords(normal, letters)
            idle = {letter for i, letter in enumerate(letters) if words.dead >> i & 1}
        return cls(normal, frozenset(r for r in everyone if not seen[r] <= idle) or frozenset({0}))


class _Search:
    """The search for waits: configurations are bounded each time that some waits are tried, and steps in all."""

    def __init__(self, robots: Sequence[_Robot], reading: TeamReading, budget: int) -> None:
        self.robots, self.reading, self.budget = robots, reading, budget
        self.left = ALLOWED

    def waits(self, parts: Sequence[_Part]) -> list[_Pair]:
        """Add waits that rule a counterexample out until there are no more; empty where these are not to be had."""
        waits: list[_Pair] = []
        while len(waits) <= MAX_WAITS:
            observations = next((found for part in parts if (found := self.broken(part, waits))), None)
            if observations is None:
                return waits
            pair = self.best_pair(observations, waits)
            if pair is None:
                break
            waits.append(pair)
        return []

    def broken(self, part: _Part, waits: Sequence[_Pair]) -> _Nodes | None:
        """Return a shortest team word that breaks one conjunct while the waits are kept.

        Robots that neither matter nor wait nor are waited for fly as they like, beside any flights of the others.
        """
        robots = self.robots
        kept = sorted(part.robots.union(*((a, b) for (a, _), (b, _) in waits)))
        place = {robot: i for i, robot in enumerate(kept)}
        limits = [(place[a], robots[a].visits[i].after or 0, place[b], robots[b].visits[j].first) for (a, i), (b, j) in waits]

        def permitted(nodes: tuple[int, ...]) -> bool:
            self.left -= 1
            if self.left < 0:
                raise OutOfBudget("more steps than all waits together may take")
            return all(nodes[b] < begins or nodes[a] >= over for a, over, b, begins in limits)

        behaviours, counts = [_behaviour(robots[r]) for r in kept], part.letters
        if counts is not None:
            marked = [replace(b, letters=tuple(counts.own(b.robot, letter) for letter in b.letters)) for b in behaviours]
            graph = JointGraph(marked, timed=False, permitted=permitted, together=counts.together)
        else:
            graph = (JointGraph if self.reading == "joint" else OwnGraph)(behaviours, timed=False, permitted=permitted)
        broken = find_broken(graph, part.normal, self.budget)
        return None if broken is None else [dict(zip(kept, found.nodes, strict=True)) for found in broken.observations]

    def best_pair(self, observations: _Nodes, waits: Sequence[_Pair]) -> _Pair | None:
        """Return the pair that rules the counterexample out and delays the present flight least, without a circle."""
        visits = [(r, i, visit) for r in observations[0] for i, visit in enumerate(self.robots[r].visits)]
        candidates: list[tuple[Fraction, _Pair]] = []
        for (a, i, visit), (b, j, other) in itertools.permutations(visits, 2):
            if a == b or visit.after is None or other.first == 0:
                continue
            pair = ((a, i), (b, j))
            ruled_out = any(nodes[b] >= other.first and nodes[a] < visit.after for nodes in observations)
            if ruled_out and not self.go_round([*waits, pair]):
                candidates.append((max(visit.stop - other.start, Fraction(0)), pair))
        return min(candidates, default=(None, None))[1]

    def go_round(self, waits: Sequence[_Pair]) -> bool:
        """Tell whether the waits and each robot's own order go round in a circle."""
        return bool(circle({r: len(robot.visits) for r, robot in enumerate(self.robots)}, waits))


def _behaviour(robot: _Robot) -> RobotBehaviour:
    n = len(robot.letters)
    following = tuple((i + 1,) if i + 1 < n else () for i in range(n))
    return RobotBehaviour(robot.name, robot.letters, (ALWAYS,) * n, following, (0,), frozenset({n - 1}))


def _needed(waits: Sequence[_Pair]) -> list[_Pair]:
    """Drop waits that another one implies: a later visit of the first robot, an earlier one of the second."""

    def implied(pair: _Pair, by: _Pair) -> bool:
        (a, i), (b, j) = pair
        (c, k), (d, m) = by
        return by != pair and (a, b) == (c, d) and k >= i and m <= j

    return sorted(pair for pair in set(waits) if not any(implied(pair, other) for other in waits))


def _nominal(timeline: Timeline) -> _Robot:
    """Return the word that a robot gives where nothing stays open, with its visits."""
    stays = sorted(_stays(timeline))
    events = [(action.time, 1, "", number) for number, action in enumerate(timeline.actions)]
    events += [(start, 1, region, number) for number, (start, _, region) in enumerate(stays) if start > 0]
    events += [(stop, 2, region, number) for number, (_, stop, region) in enumerate(stays) if stop < timeline.duration]
    inside, internal = {region for start, _, region in stays if start <= 0}, timeline.internal
    letters: list[Letter] = [frozenset(inside) | internal]
    first, after = dict.fromkeys(range(len(stays)), 0), dict[int, int]()
    for _, kind, region, number in sorted(events):
        if not region:
            internal = timeline.actions[number].propositions
        elif kind == 1:
            inside.add(region)
            first[number] = len(letters)
        else:
            inside.discard(region)
            after[number] = len(letters)
        letters.append(frozenset(inside) | internal)
    visits = [_Visit(start, stop, first[number], after.get(number)) for number, (start, stop, _) in enumerate(stays)]
    return _Robot(timeline.robot, tuple(letters), tuple(visits[1 if timeline.unplanned else 0 :]))


def _stays(timeline: Timeline) -> Iterator[tuple[Fraction, Fraction, str]]:
    """Yield (start, stop, region) of each maximal time with a status other than "no"."""
    begun = {region: Fraction(0) for region, status in timeline.initial.items() if status != "no"}
    for change in timeline.changes:
        if change.status != "no":
            begun.setdefault(change.region, change.time.low)
        elif change.region in begun:
            yield begun.pop(change.region), change.time.high, change.region
    yield from ((start, timeline.duration, region) for region, start in begun.items())
