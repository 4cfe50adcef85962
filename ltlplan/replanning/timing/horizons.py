"""Horizons and windows of formulas that are bounded in seconds, where they leave no flight: known before anything is planned."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction

from flight.model.reference import MAX_DURATION
from ltlplan.systems.due_visits import due_visits
from verify.data import Formula, Mission
from verify.logic.explanation import show

DUAL = {"F": "G", "G": "F", "U": "R", "R": "U", "W": "M", "M": "W"}
"""Operators by what their negations are."""


def too_long(mission: Mission) -> str:
    """Return which conjuncts ask for a longer flight than any, as sentences; empty where none does.

    Nobody wins by landing: a flight lasts until its windows are over.

    Args:
        mission: Its formula is bounded in seconds.
    """
    if mission.spec.trace == "infinite":
        return ""  # laps go on for ever
    endurance = mission.longest_flight
    most = MAX_DURATION if endurance is None else min(endurance, MAX_DURATION)
    weakest = min(mission.agents, key=lambda name: mission.limits_of(name).endurance or math.inf)
    why = "no longer flight is planned" if most == MAX_DURATION else f"{weakest}'s `endurance` allows no longer one"
    found = [(part, seconds) for part in mission.timed_parts if (seconds := least_duration(part)) > most]
    return " ".join(
        f"`{show(part)}` cannot hold: it asks for a flight of at least {float(seconds):.10g} s, and {why} than {most:g} s."
        for part, seconds in found
    )


def kept_out(mission: Mission) -> str:
    """Return which visits are due while nobody may be there, as sentences; empty where none is.

    Args:
        mission: Its formula is bounded in seconds.
    """
    absences = [absence for part in mission.timed_parts for absence in _absences(part)]
    found: list[str] = []
    for visit in due_visits(mission):
        regions = {region for _, region in visit.places}
        over = [each for each in absences if each[1] <= visit.begin and visit.end <= each[2] and regions <= each[3]]
        found += [
            f"`{show(visit.asked)}` and `{show(part)}` cannot both hold: until {end:.10g} s nobody may be there."
            for part, _, end, _ in over[:1]
        ]
    return " ".join(dict.fromkeys(found))


def _absences(part: Formula) -> Iterator[tuple[Formula, float, float, frozenset[str]]]:
    """Yield in which regions no robot may be, from when until when, s; of one conjunct."""
    if part.operator != "G" or part.arguments[0].operator != "!":
        return
    low, high = (Fraction(0), None) if part.window is None else part.window
    names = part.arguments[0].arguments[0]
    if all(node.operator == "|" or (node.operator == "name" and not node.robot) for node in names.walk()):
        regions = frozenset(node.name for node in names.walk() if node.operator == "name")
        yield part, float(low), math.inf if high is None else float(high), regions


def least_duration(node: Formula, *, negative: bool = False) -> Fraction:
    """Return a lower bound on how long any flight lasts that satisfies a formula, or its negation, by itself, s.

    Args:
        node: The formula.
        negative: Whether its negation is asked.
    """
    parts = node.arguments
    if not node.timed:
        return Fraction(0)
    match node.operator:
        case "!":
            return least_duration(parts[0], negative=not negative)
        case "&" | "|" | "->":
            each = [
                least_duration(part, negative=negative != (node.operator == "->" and index == 0))
                for index, part in enumerate(parts)
            ]
            return max(each) if (node.operator == "&") != negative else min(each)
        case "F" | "U" | "M" | "G" | "R" | "W":
            kind = DUAL[node.operator] if negative else node.operator
            low, high = (Fraction(0), None) if node.window is None else node.window
            if kind in ("F", "U", "M"):
                reached = parts if kind == "M" else parts[-1:]
                return low + max(least_duration(part, negative=negative) for part in reached)
            if kind == "G" and high is not None:
                return high + least_duration(parts[0], negative=negative)
            return Fraction(0)
        case _:
            return Fraction(0)
