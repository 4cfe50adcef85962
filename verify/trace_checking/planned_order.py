"""A plan's words under the plan's own precedences and meetings: which letters its visits begin and end with."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from verify.data.language.word import Letter
from verify.data.plan import Meeting, Plan, Precedence, RobotPlan
from verify.logic.verdict import Verdict
from verify.model_checking.inclusion import DEFAULT_BUDGET
from verify.trace_checking.ordered_verdict import LetterEvent, check_ordered


def check_planned_order(plan: Plan, *, budget: int = DEFAULT_BUDGET) -> Verdict:
    """Decide whether every team word that keeps a plan's precedences and meetings satisfies its formula.

    Args:
        plan: Of a finite trace.
        budget: Configurations that each conjunct may take before the answer is `undecided`.

    Returns:
        A verdict on the claim `ordered`. It fails where a robot waits for what never happens.

    Raises:
        BadInput: A word does not show the visits that are planned for its robot.
        MissingEngine: Spot, which gives the second opinion, is absent.
    """
    visits: dict[str, tuple[_Visit, ...]] = {}
    for name, robot in plan.robots.items():
        found = _visits(plan, name, robot)
        if found is None:
            sentence = f"{name}'s word does not show its planned visits, so nothing is said of precedences between them."
            return Verdict("undecided", sentence, claim="ordered", robot=name)
        visits[name] = found
    pairs: list[tuple[LetterEvent, LetterEvent]] = []
    for wait in (*plan.precedences, *plan.meetings):
        (first, i), (then, _) = wait.first, wait.then
        done, due = _done(visits[first][i], wait), _due(plan, visits[then], wait)
        if due is None:
            continue  # it never does what would have to wait
        if done is None:
            sentence = f"{then} waits until {first} has left {plan.robots[first].visits[i].region}, where it stays to the end."
            return Verdict("fails", sentence, claim="ordered", robot=first, visit=i)
        if done > 0:  # 0: from the beginning
            pairs.append(((first, done), (then, due)))
    return check_ordered(plan.mission.formula, plan.words, pairs, plan.mission.spec.team, budget=budget)


@dataclass(frozen=True, slots=True)
class _Visit:
    """Indices of a word's letters: the first of a visit, the first after it (None where it lasts), and those that its actions make."""

    first: int
    after: int | None
    acts: tuple[int, ...]


def _done(visit: _Visit, wait: Precedence | Meeting) -> int | None:
    if isinstance(wait, Meeting) or wait.done == "entered":
        return visit.first
    return visit.after if wait.done == "left" else max(visit.acts, default=visit.first)


def _due(plan: Plan, visits: tuple[_Visit, ...], wait: Precedence | Meeting) -> int | None:
    name, number = wait.then
    visit = visits[number]
    if isinstance(wait, Meeting):  # whatever it comes to or leaves first after it has set out
        before = visits[number - 1].after if number else _first_change(plan, name)
        return (visit.first if before is None else min(visit.first, before)) or None
    if wait.due == "leaves":
        return visit.after
    return (visit.first if wait.due == "enters" else min(visit.acts, default=0)) or None


def _first_change(plan: Plan, name: str) -> int | None:
    """Return the first letter of a robot's word that shows other regions than where it starts."""
    regions = frozenset(plan.mission.all_regions)
    shown = [letter & regions for letter in plan.robots[name].word.letters]
    return next((index for index, seen in enumerate(shown) if seen != shown[0]), None)


def _visits(plan: Plan, name: str, robot: RobotPlan) -> tuple[_Visit, ...] | None:
    """Return where in its word a robot's visits are; None where the word shows others."""
    letters, regions = robot.word.letters, frozenset(plan.mission.all_regions)
    stays = sorted(_stays([letter & regions for letter in letters]), key=lambda stay: _rank(*stay))
    planned = [visit.region for visit in robot.visits]
    if len(stays) == len(planned) + 1 and stays[0][1] == 0:
        stays = stays[1:]  # it starts there, and the plan counts no visit for that
    if [region for region, _, _ in stays] != planned:
        return None
    acts = _actions(plan, name, robot, [letter - regions for letter in letters])
    if acts is None:
        return None
    return tuple(_Visit(first, after, made) for (_, first, after), made in zip(stays, acts, strict=True))


def _rank(region: str, first: int, after: int | None) -> tuple[int, float, str]:
    """Visits come as they begin; of those that begin with the flight the one that is left first, of others the first name."""
    left = float("inf") if after is None else float(after)
    return first, left if first == 0 else 0.0, region


def _stays(shown: list[Letter]) -> Iterator[tuple[str, int, int | None]]:
    begun: dict[str, int] = {}
    for index, letter in enumerate(shown):
        for region in begun.keys() - letter:
            yield region, begun.pop(region), index
        for region in letter - begun.keys():
            begun[region] = index
    for region, first in begun.items():
        yield region, first, None


def _actions(plan: Plan, name: str, robot: RobotPlan, internal: list[Letter]) -> list[tuple[int, ...]] | None:
    """Return for each visit the letters that its actions make; one that changes no proposition makes none."""
    changes = [index for index in range(1, len(internal)) if internal[index] != internal[index - 1]]
    states = plan.mission.robot_of(name).states
    if any(state not in states for visit in robot.visits for act in visit.actions for state in (act.source, act.target)):
        return None  # the claim `visits` says which action is none of its robot's
    found: list[tuple[int, ...]] = []
    for visit in robot.visits:
        seen = sum(set(states[action.source]) != set(states[action.target]) for action in visit.actions)
        found.append(tuple(changes[:seen]))
        del changes[:seen]
    return None if changes else found
