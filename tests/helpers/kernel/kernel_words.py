"""What the judge of words is asked, put to the kernel: timelines and formulas in its own values."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace
from typing import Any, cast

from verify.data import Mission
from verify.kernel.statement import Refused, Statement
from verify.kernel.team import check_transitions
from verify.kernel.timelines import Span, Timeline
from verify.kernel.trees import Evidence
from verify.kernel.words import check_words, flown
from verify.model_checking import timeline as judge
from verify.proofs.formula_tree import formula_tree
from verify.proofs.words import find_formula


def opened(line: judge.Timeline) -> judge.Timeline:
    """Return a timeline that says as little as the kernel's: between *no* and *must* there is a spell of *may*."""
    status, found = dict[str, judge.Status](line.initial), list[judge.Change]()
    for change in line.changes:
        if {status[change.region], change.status} == {"no", "must"}:
            low = change.time.low
            found.append(judge.Change(judge.Enclosure(low, low), change.region, "may"))
        found.append(change)
        status[change.region] = change.status
    return replace(line, changes=tuple(sorted(found, key=lambda change: change.time.low)))


def kernel_timeline(line: judge.Timeline) -> Timeline:
    """Return the spans of a timeline, as it is where it is opened."""
    line = opened(line)
    rows = {region: _row(line, region) for region in line.initial}
    actions = tuple((action.time, action.propositions) for action in line.actions)
    return Timeline(line.robot, line.duration, rows, line.internal, actions, line.cycle)


def _row(line: judge.Timeline, region: str) -> tuple[Span, ...]:
    spans: list[Span] = []
    status, since = line.initial[region], Fraction(0)

    def fill(stop: Fraction, mark: str) -> None:
        nonlocal since
        spans.append(Span(since, max(since, stop), mark))
        since = max(since, stop)

    for change in line.changes:
        if change.region == region and change.status != status:
            fill(change.time.low if change.status == "may" else change.time.high, status)
            status = change.status
    fill(line.duration, status)
    return tuple(spans)


def kernel_statement(mission: Mission, clock_error: Fraction) -> Statement:
    """Return what the kernel is told of a mission, as far as words go."""
    return cast(
        "Statement",
        SimpleNamespace(
            lasso=mission.spec.trace == "infinite",
            joint=mission.spec.team == "joint",
            formula=json.loads(json.dumps(formula_tree(mission))),
            clock_error=clock_error,
            regions=dict.fromkeys(mission.all_regions),
            robots={name: _robot(mission, name) for name in mission.agents},
            words={},
            waits=(),
        ),
    )


def _robot(mission: Mission, name: str) -> SimpleNamespace:
    system, environment = mission.robot_of(name), mission.environment
    edges: dict[str, set[str]] = {}
    for source, target in () if environment is None else environment.open_to(mission.kind_of(name)):
        for a, b in ((source, target),) if environment and environment.directed else ((source, target), (target, source)):
            if environment and b != environment.start:
                edges.setdefault(a, set()).add(b)
    return SimpleNamespace(
        edges=None if environment is None else {a: frozenset(b) for a, b in edges.items()},
        vertex="" if environment is None else environment.start,
        closed=frozenset(r for r in mission.all_regions if not mission.may_enter(name, r)),
        states={state: frozenset(names) for state, names in system.states.items()},
    )


def proof_of(
    mission: Mission, lines: Mapping[str, judge.Timeline], error: Fraction | int = 0
) -> tuple[Statement, dict[str, Timeline], dict[str, Any]]:
    """Return what the kernel is asked of a team, and the evidence that the search finds, as it stands in a file."""
    statement = kernel_statement(mission, Fraction(error))
    own = {name: kernel_timeline(line) for name, line in lines.items()}
    return statement, own, json.loads(json.dumps(find_formula(statement, own)))


def kernel_proves_transitions(mission: Mission, line: judge.Timeline) -> bool:
    """Return whether the kernel accepts all words of a robot."""
    try:
        check_transitions(kernel_statement(mission, Fraction(0)), kernel_timeline(line))
    except Refused:
        return False
    return True


def kernel_says_yes(mission: Mission, lines: Mapping[str, judge.Timeline], error: Fraction | int = 0) -> bool:
    """Return whether the kernel accepts the proof that the search finds."""
    statement, own, evidence = proof_of(mission, lines, error)
    try:
        check_words(flown(statement, own), Evidence(evidence))
    except Refused:
        return False
    return True
