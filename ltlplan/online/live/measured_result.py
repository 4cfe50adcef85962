"""Result of a live online flight from measurements: the same value, and the same files, as of one in simulation.

Poses of several robots seldom come at the same instant. Rows of the log are at the instants of one robot's poses, the others' places between their
own are on straight lines; a robot that left stays where it was measured last. What no pose tells (speeds, attitudes, thrusts) is left empty.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from math import inf

import numpy as np
from numpy.typing import NDArray

from flight.link.live_executive import LiveFlight
from flight.link.phases import FLIGHT
from flight.logs.log import Event, FlightLog
from ltlplan.online.live.live_online_flight import OnlineCourse
from ltlplan.online.observed_timelines import judged_words, seen_timeline
from ltlplan.online.online_flight import LIVE, LIVE_NOT_ALL_CERTIFIED, OnlineFlight
from verify.data import BadInput, Letter, Mission
from verify.data.events import RobotJoins, RobotLeaves
from verify.data.language.word import stutter_free
from verify.model_checking.timeline import InternalChange

Floats = NDArray[np.float64]

_BEFORE = 1.0
"""s before a flight from which on poses of robots that wait are used: where they stand is known from its beginning on."""


def flown_live(course: OnlineCourse, live: LiveFlight, *, planned_cost: float) -> OnlineFlight:
    """Return what was flown, checked by what was seen.

    Args:
        course: The flight as it was led.
        live: How it ended, with all that was measured.
        planned_cost: Summed cost at take-off.

    Raises:
        BadInput: It never began, or ended before all were measured.
    """
    if FLIGHT not in live.record.starts:
        raise BadInput(f"The online flight never began: {live.reason}")
    mission = course.team.mission
    robots = tuple(mission.agents)
    gone = {event.robot: event.time for event in course.happened if isinstance(event, RobotLeaves)}
    joined = {event.robot: event.time for event in course.happened if isinstance(event, RobotJoins)}
    times, position = _places(course, live, robots, gone)
    if not len(times):
        raise BadInput("The online flight ended before all robots were measured at once.")
    actions = {name: _actions(course, name, Fraction(times[-1])) for name in robots}
    letters = {
        name: _letters(course, name, times, position[:, j], actions[name], (joined.get(name, -inf), gone.get(name, inf)))
        for j, name in enumerate(robots)
    }
    timelines = {name: seen_timeline(mission, name, times, letters[name], actions[name]) for name in robots}
    verdict = judged_words(mission, timelines)
    lost = course.team.lost or (None if live.flown else live.reason)
    note = LIVE if lost is None else f"{LIVE_NOT_ALL_CERTIFIED} {lost}"
    unknown = np.full((len(times), len(robots)), np.nan)
    rows = tuple(zip(*(letters[name] for name in robots), strict=True))
    said = [
        Event(max(event.time - course.began, 0.0), event.robot, event.kind, event.sentence)
        for event in live.record.events
        if course.began <= event.time
    ]
    end = float(times[-1])
    said.append(Event(end, None, "formula", f"Verdict on the flown words: {verdict.outcome}. {verdict.sentence}"))
    log = FlightLog(
        mission=mission.name,
        robots=robots,
        times=times,
        position=position,
        velocity=np.full((*unknown.shape, 3), np.nan),
        attitude=np.full((*unknown.shape, 3), np.nan),
        thrust=unknown,
        rates=np.full((*unknown.shape, 3), np.nan),
        error=unknown,
        letters=rows,
        events=(Event(0.0, None, "note", note), *said),
        satisfied=None if verdict.outcome == "undecided" else bool(verdict),
        notes=(note,),
    )
    return OnlineFlight(
        mission=mission,
        log=log,
        verdict=verdict,
        duration=end,
        satisfied_at=course.satisfied_at,
        planned_cost=planned_cost,
        final_cost=course.team.cost,
        step_seconds=np.zeros(0),
        words={name: stutter_free(letters[name]) for name in robots},
        certified=lost is None,
        certificates=course.team.certificates,
        pieces=course.team.all_pieces,
        earlier=tuple(course.earlier),
        events=tuple(course.happened),
        measured=True,
    )


def _places(
    course: OnlineCourse, live: LiveFlight, robots: tuple[str, ...], gone: Mapping[str, float]
) -> tuple[Floats, Floats]:
    """Return common times, s, and places of all robots at them, m. Shapes (n,) and (n, robots, 3)."""
    seen: dict[str, list[tuple[float, ...]]] = {name: [] for name in robots}
    for time, robot, *place in live.record.poses:
        at = time - course.began
        begins = -_BEFORE if robot in course.standby.agents else 0.0
        if robot in seen and begins <= at <= course.ended - course.began and at <= gone.get(robot, inf):
            seen[robot].append((at, *place))
    tables = {name: np.array(rows) for name, rows in seen.items()}
    if missing := [name for name, table in tables.items() if not len(table)]:
        raise BadInput(f"{missing[0]} was never measured in the online flight.")
    stay = [name for name in robots if name not in gone]
    clock = max(
        [name for name in stay if name not in course.standby.agents] or stay or robots[:1], key=lambda name: len(tables[name])
    )
    times = tables[clock][:, 0]
    first = max(float(table[0, 0]) for table in tables.values())
    last = min(float(table[-1, 0]) for name, table in tables.items() if name not in gone or name == clock)
    times = times[(times >= first) & (times <= last)]
    columns = [
        np.stack([np.interp(times, tables[name][:, 0], tables[name][:, axis]) for axis in (1, 2, 3)], axis=1) for name in robots
    ]
    return times, np.stack(columns, axis=1)


def _actions(course: OnlineCourse, robot: str, end: Fraction) -> tuple[InternalChange, ...]:
    """Return the internal changes that a robot made until an end, exact, in s, on the flight's clock."""
    found: list[InternalChange] = []
    pieces = course.team.all_pieces
    ends = [*(min(piece.since, end) for piece in pieces[1:]), end]
    for piece, until in zip(pieces, ends, strict=True):
        for action in piece.actions.get(robot, ()):
            if piece.since <= piece.start + action.time <= until:
                found.append(replace(action, time=piece.start + action.time))
    return tuple(found)


def _letters(
    course: OnlineCourse,
    robot: str,
    times: Floats,
    places: Floats,
    actions: tuple[InternalChange, ...],
    part: tuple[float, float],
) -> list[Letter]:
    """Return what a robot showed at each time: regions of the world as it then was, and its internal propositions.

    `part` says from when until when it was part of the team, s: before, it shows no region; afterwards, what it showed last.
    """
    worlds = _worlds(course)
    inside: list[frozenset[str]] = [frozenset()] * len(times)
    for (since, mission), (until, _) in pairwise([*worlds, (inf, worlds[-1][1])]):
        rows = np.flatnonzero((times >= max(since, part[0])) & (times < until))
        for name, region in mission.all_regions.items():
            for row in rows[np.asarray(region.level(places[rows])) <= 1.0] if len(rows) else ():
                inside[row] |= {name}
    held, found = course.team.mission.initial_letter(robot), list[Letter]()
    made = 0
    for row, time in enumerate(times.tolist()):
        if time > part[1] and found:
            found.append(found[-1])
            continue
        while made < len(actions) and actions[made].time <= time:
            held, made = actions[made].propositions, made + 1
        found.append(held | inside[row])
    return found


def _worlds(course: OnlineCourse) -> list[tuple[float, Mission]]:
    """Return the mission as it was from each time on, s."""
    begins = [-inf, *(time for time, _ in course.earlier)]
    missions = [*(mission for _, mission in course.earlier), course.team.mission]
    return list(zip(begins, missions, strict=True))
