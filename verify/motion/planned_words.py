"""A plan's words, checked against its visits and against what the flight shows.

The checker proves visits. A word holds no letter twice in succession and is one that the certified tube can show. Where all regions are
disjoint, it is also what the visits come to: it enters their regions in order and changes internal propositions as their actions do.
A single empty letter states no word. A letter that lasts over the beginning of a cycle may stand on both sides of it. Waypoints (but
the start), nominal times, costs and notes say how a plan came about and are not checked.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction

from verify.data.language.word import Letter, Word, stutter_free
from verify.data.mission import Mission
from verify.data.plan import Plan, RobotPlan
from verify.data.sections import Robot
from verify.model_checking.timeline import Status, Timeline
from verify.motion.regions import relations


def false_statement(plan: Plan, timelines: Mapping[str, Timeline]) -> str:
    """Return what a plan says that is not so, as a sentence; empty where all that can be checked is true.

    Args:
        plan: Its visits must have been proved of the flight.
        timelines: What the flight shows within its margin, by robot.
    """
    for name, robot in plan.robots.items():
        fault = _waypoint_fault(plan.mission, name, robot) or _word_fault(plan.mission, name, robot, timelines[name])
        if fault:
            return f"{name}'s {fault}."
    return ""


def _waypoint_fault(mission: Mission, name: str, robot: RobotPlan) -> str:
    if robot.waypoints[0].position != mission.agents[name].start:
        return "first waypoint is not its start"
    for index, waypoint in enumerate(robot.waypoints):
        known = waypoint.visit is None or 0 <= waypoint.visit < len(robot.visits)
        if not known or (
            waypoint.visit is not None
            and waypoint.role in ("front", "rear", "centre")
            and waypoint.region != robot.visits[waypoint.visit].region
        ):
            return f"waypoint {index} serves visit {waypoint.visit}, which is not of its region"
    return ""


def _word_fault(mission: Mission, name: str, robot: RobotPlan, timeline: Timeline) -> str:
    word = robot.word
    if word == Word((frozenset(),)):
        return ""
    known = {*mission.all_regions, *mission.internal_propositions}
    for letter in word.letters:
        if not letter <= known:
            return f"word holds {min(letter - known)!r}, which is no region or proposition of the mission"
    if (word.cycle is None) != (robot.cycle_visit is None):
        return "word and visits do not agree on whether they go on for ever"
    if any(stutter_free(part) != part for part in (word.prefix, word.cycle or ())):
        return f"word {word!s:.200} holds a letter twice in succession"
    names = sorted(mission.all_regions)
    apart = len(relations(mission).disjoint) == len(names) * (len(names) - 1) // 2
    if apart and not any(_comes_to(word, events) for events in _told(mission, name, robot, word)):
        return f"word {word!s:.200} is not what its visits and their actions come to"
    if not _can_show(mission, word, timeline):
        return f"word {word!s:.200} is not one that its certified flight can show"
    return ""


@dataclass(frozen=True, slots=True)
class _Event:
    """A region is entered, or an action changes the internal propositions."""

    region: str | None = None
    propositions: Letter = frozenset()


@dataclass(frozen=True, slots=True)
class _Events:
    """Events of a robot's visits: once, then lap by lap.

    Attributes:
        mission: Whose regions the letters are of.
        internal: Internal propositions at time 0.
        once: Events of a finite plan, or before the cycle.
        lap: Events of one lap; None for a finite plan.
    """

    mission: Mission
    internal: Letter
    once: tuple[_Event, ...]
    lap: tuple[_Event, ...] | None


def _told(mission: Mission, name: str, robot: RobotPlan, word: Word) -> Iterator[_Events]:
    """Yield the events that visits stand for; stays in which the robot starts may be planned as visits or not."""
    internal = mission.initial_letter(name)
    begun = word.letters[0] & frozenset(mission.all_regions)
    split = len(robot.visits) if robot.cycle_visit is None else robot.cycle_visit
    events = [_of_visit(mission.robot_of(name), robot, index) for index in range(len(robot.visits))]
    lap = None if robot.cycle_visit is None else tuple(e for found in events[split:] for e in found)
    yield _Events(mission, internal, tuple(e for found in events[:split] for e in found), lap)
    first = [visit.region for visit in robot.visits[: len(begun)]]
    if begun and frozenset(first) == begun and len(begun) <= split:
        shortened = [found[1:] if index < len(begun) else found for index, found in enumerate(events[:split])]
        yield _Events(mission, internal, tuple(e for found in shortened for e in found), lap)


def _of_visit(system: Robot, robot: RobotPlan, index: int) -> list[_Event]:
    visit = robot.visits[index]
    states = system.states
    return [_Event(region=visit.region), *(_Event(propositions=frozenset(states[a.target])) for a in visit.actions)]


def _comes_to(word: Word, events: _Events) -> bool:
    """Return whether a word enters regions and changes propositions just as the events do."""
    regions = frozenset(events.mission.all_regions)
    inside, internal = word.letters[0] & regions, events.internal
    if word.letters[0] - regions != internal:
        return False
    lap = events.lap or ()
    laps = 0 if word.cycle is None else 3
    told = (*events.once, *lap * (laps + 1))
    at, ends = 0, []
    letters = word.letters if word.cycle is None else (*word.prefix, *word.cycle * laps)
    for index, letter in enumerate(letters):
        if index:
            entered, inside = (letter & regions) - inside, letter & regions
            while entered or internal != letter - regions:
                if at == len(told):
                    return False
                event, at = told[at], at + 1
                if event.region is None:
                    internal = event.propositions
                elif event.region in entered:
                    entered -= {event.region}
                else:
                    return False
        if word.cycle is not None and index >= len(word.prefix) and (index - len(word.prefix) + 1) % len(word.cycle) == 0:
            ends.append(at)
    if word.cycle is None:
        return all(event.region is None and event.propositions == internal for event in told[at:])
    return all(later - earlier == len(lap) or not _visible(lap) for earlier, later in itertools.pairwise(ends))


def _visible(events: Iterable[_Event]) -> bool:
    return any(event.region is not None for event in events)


def _can_show(mission: Mission, word: Word, timeline: Timeline) -> bool:
    """Return whether a flight of the tube can have the word; of a lasso the prefix and two laps are looked at."""
    regions = frozenset(mission.all_regions)
    letters, back = word.letters, None if word.cycle is None else len(word.prefix)
    stretches = list(_stretches(timeline))
    if timeline.cycle is not None:
        stretches += [s for s in stretches if s.end > timeline.cycle]
    places = {0}
    for stretch in stretches:
        fits = [stretch.allows(letter & regions, letter - regions) for letter in letters]
        open_ = [place for place in places if fits[place]]
        places = set(open_)
        while open_:
            place = open_.pop() + 1
            if place == len(letters):
                if back is None:
                    continue
                place = back
            if fits[place] and place not in places:
                places.add(place)
                open_.append(place)
    return len(letters) - 1 in places if back is None else bool(places)


@dataclass(frozen=True, slots=True)
class _Stretch:
    """A time (an instant or an open interval that ends at `end`), and what the robot can show in it."""

    end: Fraction
    must: frozenset[str]
    may: frozenset[str]
    internal: tuple[Letter, ...]

    def allows(self, inside: Letter, internal: Letter) -> bool:
        return self.must <= inside <= self.must | self.may and internal in self.internal


def _stretches(timeline: Timeline) -> Iterator[_Stretch]:
    """Yield instants and the times between them, in order; while a change may happen, both sides of it are possible."""
    times = {Fraction(0), timeline.duration}
    events = sorted(_events(timeline), key=lambda event: event.low)
    for event in events:
        times |= {event.low, event.high}
    ordered = sorted(times)
    status: dict[str, Status] = dict(timeline.initial)
    internal = timeline.internal
    first = 0
    for index, time in enumerate(ordered):
        for low, high in ((ordered[index - 1], time), (time, time)) if index else ((time, time),):
            while first < len(events) and (events[first].high < low or events[first].high == low < high):
                change = events[first]
                first += 1
                if change.region is None:
                    internal = change.propositions
                else:
                    status[change.region] = change.status
            may: set[str] = {name for name, found in status.items() if found == "may"}
            letters = [internal]
            for change in events[first:]:
                if change.low > high or change.low == high > low:
                    break
                if change.region is None:
                    letters.append(change.propositions)
                elif change.status != status[change.region]:
                    may.add(change.region)
            must = frozenset(name for name, found in status.items() if found == "must")
            yield _Stretch(high, must - may, frozenset(may), tuple(letters))


@dataclass(frozen=True, slots=True)
class _Change:
    """Once between `low` and `high` a region gets a status, or (region None) the robot other internal propositions."""

    low: Fraction
    high: Fraction
    region: str | None
    status: Status = "may"
    propositions: Letter = frozenset()


def _events(timeline: Timeline) -> Iterator[_Change]:
    for change in timeline.changes:
        yield _Change(change.time.low, change.time.high, change.region, change.status)
    for action in timeline.actions:
        until = action.time if action.until is None else action.until
        yield _Change(action.time, until, None, propositions=action.propositions)
