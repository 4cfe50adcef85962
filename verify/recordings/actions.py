"""Actions of a recorded flight: each counts only where the samples allow it at its place.

Positions do not show internal states. A log does, between which samples they changed; for other recordings they are those of the
planned actions, at the instants that were proved, for every start of the flight that the recording leaves open.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from verify.claims.claim import Claim, Outcome
from verify.data.mission import Mission
from verify.model_checking.timeline import InternalChange
from verify.recordings.alignment import Alignment
from verify.recordings.flight_reference import FlightReference, lap_times
from verify.recordings.geometric_claims import recorded_claim
from verify.recordings.reachable_sets import Floats
from verify.recordings.temporal_claims import Row, statuses_within


@dataclass(frozen=True, slots=True)
class Action:
    """A change of one robot's internal state, which happened at some time from `low` to `high`.

    Attributes:
        robot: Name.
        low: s of the recording, exact.
        high: s of the recording, exact.
        source: Internal state before.
        target: Internal state after.
        at: Region in which it is permitted.
        visit: Index of the planned visit; -1 where it is of none.
        outcome: Whether the samples show the robot in that region all the time.
        sentence: Why, for a person.
    """

    robot: str
    low: Fraction
    high: Fraction
    source: str
    target: str
    at: str
    visit: int = -1
    outcome: Outcome = "undecided"
    sentence: str = ""


def planned_actions(asked: FlightReference, robot: str, rows: Mapping[str, Row], alignment: Alignment) -> list[Action]:
    """Return a robot's planned actions at every instant that the alignment allows, all laps of a cycle included.

    Args:
        asked: What was planned, with its proved actions.
        robot: Name.
        rows: The robot's regions.
        alignment: When the flight began, on the recording's clock.
    """
    found: list[Action] = []
    for action in _instants(asked, robot):
        shifted = replace(action, low=action.low + Fraction(alignment.low), high=action.high + Fraction(alignment.high))
        if alignment.trusted:
            found.append(placed(shifted, rows))
        else:
            sentence = f"when {robot} made its action {action.source} -> {action.target} cannot be told"
            found.append(replace(shifted, sentence=sentence))
    return found


def _instants(asked: FlightReference, robot: str) -> Iterable[Action]:
    """Return planned actions on the plan's clock."""
    path = None if asked.team is None else asked.team[robot]
    for entry in asked.actions:
        if entry.robot != robot:
            continue
        fitting = [a.at for a in asked.mission.robot_of(robot).actions if (a.source, a.target) == (entry.source, entry.target)]
        at = fitting[0] if asked.plan is None else asked.plan.robots[robot].visits[entry.visit].region
        for time in (Fraction(entry.time),) if path is None else lap_times(entry.time, path, asked.mission.spec.repeat):
            yield Action(robot, time, time, entry.source, entry.target, at, int(entry.visit))


def placed(action: Action, rows: Mapping[str, Row]) -> Action:
    """Return an action with what the samples say of its place: surely there, possibly, or surely not."""
    found = statuses_within(rows[action.at], action.low, action.high)
    when = (
        f"{float(action.low):.4f} s" if action.low == action.high else f"{float(action.low):.4f} to {float(action.high):.4f} s"
    )
    what = f"{action.robot}'s action {action.source} -> {action.target} ({when})"
    if found == {"must"}:
        return replace(action, outcome="holds", sentence=f"{what} was made in '{action.at}'")
    if found == {"no"}:
        return replace(
            action,
            outcome="fails",
            sentence=f"{what} was not made in '{action.at}', where it is permitted: the robot was not there",
        )
    return replace(action, outcome="undecided", sentence=f"{what}: whether the robot was in '{action.at}' cannot be told")


def logged_actions(
    robot: str, times: Floats, internal: Sequence[frozenset[str]], mission: Mission, rows: Mapping[str, Row]
) -> list[Action]:
    """Return the actions that a log's internal propositions show, each permitted by the mission or broken.

    Args:
        robot: Name.
        times: Of the samples in the checked time, s. Shape (n,).
        internal: Propositions at each.
        mission: Which actions there are.
        rows: The robot's regions.
    """
    system = mission.robot_of(robot)
    states = {state for state, names in system.states.items() if frozenset(names) == internal[0]}
    states = states & {mission.initial_internal(robot)} or states
    found: list[Action] = []
    rank: dict[Outcome, int] = {"holds": 0, "undecided": 1, "fails": 2}
    for i in range(1, len(times)):
        if internal[i] == internal[i - 1]:
            continue
        low, high = Fraction(float(times[i - 1])), Fraction(float(times[i]))
        fitting = [a for a in system.actions if a.source in states and frozenset(system.states[a.target]) == internal[i]]
        if not fitting:
            shown = "{" + ", ".join(sorted(internal[i])) + "}"
            sentence = (
                f"{robot}'s internal state changes to {shown} at {float(high):.4f} s, which no action of the mission does"
            )
            found.append(Action(robot, low, high, "", "", "", -1, "fails", sentence))
            return found
        if len({(a.source, a.target) for a in fitting}) > 1:
            sentence = (
                f"{robot}'s internal state at {float(high):.4f} s cannot be told from the propositions that the log shows"
            )
            found.append(
                Action(robot, low, high, fitting[0].source, fitting[0].target, fitting[0].at, -1, "undecided", sentence)
            )
            return found
        tried = [placed(Action(robot, low, high, a.source, a.target, a.at), rows) for a in fitting]
        found.append(min(tried, key=lambda action: rank[action.outcome]))
        states = {a.target for a in fitting}
    return found


def action_claim(robot: str, actions: Sequence[Action]) -> Claim | None:
    """Every action was made where it is permitted; None where there is none."""
    if not actions:
        return None
    for outcome in ("fails", "undecided"):
        for action in actions:
            if action.outcome == outcome:
                return recorded_claim(
                    "actions", outcome, f"{action.sentence}.", robot=robot, time=float(action.low), region=action.at or None,
                    visit=action.visit if action.visit >= 0 else None,
                )  # fmt: skip
    return recorded_claim("actions", "holds", f"{robot} made every action where it is permitted.", robot=robot)


def internal_changes(actions: Sequence[Action], mission: Mission, zero: Fraction, end: Fraction) -> tuple[InternalChange, ...]:
    """Return the changes of the internal state that count, on a clock that is 0 at `zero`, within [0, `end`].

    Actions that were surely made elsewhere do not count, nor do those that need the state that these would have led to.

    Args:
        actions: One robot's, in order of time.
        mission: Propositions of the internal states.
        zero: s of the recording, exact.
        end: s on the new clock, exact.
    """
    made: list[InternalChange] = []
    state = actions[0].source if actions else ""
    for action in actions:
        if action.outcome == "fails" or action.source != state:
            continue
        low, high = (min(max(time - zero, Fraction(0)), end) for time in (action.low, action.high))
        state = action.target
        names, until = frozenset(mission.robot_of(action.robot).states[state]), None if low == high else high
        made.append(InternalChange(low, action.source, state, action.at, action.visit, names, until))
    return tuple(made)


def unplanned(
    robot: str, made: Sequence[Action], planned: Sequence[Action], mission: Mission, *, until: Fraction
) -> list[Action]:
    """Return a broken action where a log's actions are not the planned ones, in their order; none where they are.

    What is due after `until`, the log's last row, may have been made.

    Args:
        robot: Name.
        made: Actions that the log shows, in order of time.
        planned: Actions that are planned, in order of time.
        mission: Propositions of the internal states.
        until: s of the recording, exact.
    """
    states = mission.robot_of(robot).states
    due = [a for a in planned if frozenset(states[a.source]) != frozenset(states[a.target])]
    for index, action in enumerate(made):
        if action.target and (index >= len(due) or states[due[index].target] != states[action.target]):
            sentence = f"{robot}'s action {action.source} -> {action.target} at {float(action.high):.4f} s is not planned"
            return [replace(action, outcome="fails", sentence=sentence)]
    if len(made) < len(due) and all(action.target for action in made):
        missed = due[len(made)]
        what = f"{robot}'s planned action {missed.source} -> {missed.target} of visit {missed.visit}"
        if missed.high > until:
            return [replace(missed, outcome="undecided", sentence=f"{what} may come after the log's last row")]
        return [replace(missed, outcome="fails", sentence=f"{what} is not made")]
    return []
