"""Stays in regions, the planned visits that they are, and the instants of planned actions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction

from verify.data.plan import RobotPlan
from verify.data.sections import Robot
from verify.model_checking.timeline import InternalChange
from verify.motion.membership.bodies import Span

_GRID = 2**20
"""Instants of actions are rounded to 1 / _GRID s, so that they are floats and read well."""


@dataclass(frozen=True, slots=True)
class Stay:
    """A maximal time during which a region is not "no" for a robot.

    Attributes:
        region: Name.
        start: Exact, in s; before it the robot is out of the region for sure.
        stop: Exact, in s; after it likewise.
        must: Times in it during which the robot is in the region for sure, in order.
    """

    region: str
    start: Fraction
    stop: Fraction
    must: tuple[tuple[Fraction, Fraction], ...]

    @property
    def longest(self) -> tuple[Fraction, Fraction] | None:
        """The longest time in the region for sure; the first of equals; None where there is none."""
        return max(self.must, key=lambda span: (span[1] - span[0], -span[0]), default=None)


@dataclass(frozen=True, slots=True)
class Matching:
    """Planned visits compared with stays.

    Attributes:
        stays: Stay of each planned visit; shorter than the visits where they do not match.
        flown: For a lasso: stays of the prefix and of two laps, times going on, so that what spans the seam is one stay.
            The same as `stays` for a finite flight, and where visits do not match.
        lap: For a lasso: index of the first visit that begins in the lap, as it is flown (the number of visits where none
            does); None for a finite flight, and where the visits do not match.
        extra: Stay at time 0 that no visit stands for: the robot starts there.
        fault: Why they do not match; empty where they do.
        visit: Index of the visit concerned, for a fault.
        region: Region concerned, for a fault.
        time: When, for a fault.
    """

    stays: tuple[Stay, ...]
    flown: tuple[Stay, ...]
    lap: int | None = None
    extra: Stay | None = None
    fault: str = ""
    visit: int | None = None
    region: str | None = None
    time: Fraction | None = None


@dataclass(frozen=True, slots=True)
class ActionFault:
    """Reason why a planned action cannot be placed.

    Attributes:
        sentence: For a person.
        visit: Index of the planned visit, where one is to blame.
        region: Where it is.
        time: When the action would have been, or when the visit begins, in s.
    """

    sentence: str
    visit: int | None = None
    region: str | None = None
    time: Fraction | None = None


def stays(spans: Mapping[str, tuple[Span, ...]]) -> tuple[Stay, ...]:
    """Return one robot's stays in order of their starts.

    Args:
        spans: For each region the robot's spans.
    """
    found: list[Stay] = []
    for region, row in spans.items():
        run: list[Span] = []
        for span in (*row, None):
            if span is not None and span.mark != "no":
                run.append(span)
                continue
            if run:
                must = tuple((s.start, s.stop) for s in run if s.mark == "must")
                found.append(Stay(region, run[0].start, run[-1].stop, must))
            run = []
    return tuple(sorted(found, key=lambda stay: (stay.start, stay.stop, stay.region)))


def two_laps(row: tuple[Span, ...], knot: Fraction) -> tuple[Span, ...]:
    """Return the spans of a lasso's prefix and of two laps, the second one's times going on from the first one's.

    Args:
        row: One region's spans, over the prefix and one lap.
        knot: When the lap begins, in s.
    """
    result = list(row)
    later = row[-1].stop - knot
    for span in row:
        if span.stop <= knot:
            continue
        start, stop = max(span.start, knot) + later, span.stop + later
        if result[-1].mark == span.mark != "switch":
            result[-1] = Span(result[-1].start, stop, span.mark)
        else:
            result.append(Span(start, stop, span.mark))
    return tuple(result)


def match(robot: RobotPlan, spans: Mapping[str, tuple[Span, ...]], knot: Fraction | None = None) -> Matching:
    """Hold the k-th planned visit against the k-th stay, and where the plan's cycle begins against where the lap does.

    A stay at time 0 counts as no visit where the plan has none for it: the robot starts there.

    Args:
        robot: The robot's plan.
        spans: For each region the robot's spans.
        knot: For a lasso, when its lap begins, in s.
    """
    wanted = [visit.region for visit in robot.visits]
    found = stays(spans)
    rest, extra = found, None
    if found and found[0].start == 0 and len(found) == len(wanted) + 1:
        rest, extra = found[1:], found[0]

    def fault(count: int, sentence: str, visit: int | None, region: str, time: Fraction | None = None) -> Matching:
        made = rest[:count]
        return Matching(made, made, extra=extra, fault=sentence, visit=visit, region=region, time=time)

    for index, (region, stay) in enumerate(zip(wanted, rest, strict=False)):
        if stay.region != region:
            sentence = f"visit {index} is planned in '{region}', but the path comes to '{stay.region}'"
            return fault(index, sentence, index, stay.region, stay.start)
        if stay.longest is None:
            sentence = f"visit {index} of '{region}' may miss the region: nowhere is it inside for sure"
            return fault(index, sentence, index, region, stay.start)
    if len(rest) > len(wanted):
        stay = rest[len(wanted)]
        sentence = f"the path may come to '{stay.region}', which is not planned"
        return fault(len(wanted), sentence, None, stay.region, stay.start)
    if len(rest) < len(wanted):
        index = len(rest)
        return fault(index, f"visit {index} of '{wanted[index]}' does not happen", index, wanted[index])
    if knot is None:
        return Matching(rest, rest, extra=extra)
    return _with_lap(robot, Matching(rest, rest, extra=extra), spans, knot)


def _with_lap(robot: RobotPlan, matching: Matching, spans: Mapping[str, tuple[Span, ...]], knot: Fraction) -> Matching:
    """Add what two laps show: a second lap's stays that are new are the visits of the cycle."""
    every = stays({region: two_laps(row, knot) for region, row in spans.items()})
    flown = every[(matching.extra is not None) :]
    visits = len(robot.visits)
    lap = 2 * visits - len(flown)
    regions = [visit.region for visit in robot.visits]
    if not 0 <= lap <= visits or [stay.region for stay in flown] != regions + regions[lap:]:
        return replace(matching, fault="it cannot be told which visits begin in a lap")
    if lap == robot.cycle_visit:
        return replace(matching, flown=flown, lap=lap)
    flies = f"a lap begins with visit {lap}" if lap < visits else "no visit begins in a lap"
    planned = "none" if robot.cycle_visit == visits else f"visit {robot.cycle_visit}"
    where = min(lap, visits - 1)
    return replace(
        matching, flown=flown, lap=lap, fault=f"{flies}, planned is {planned}",
        visit=where, region=regions[where], time=matching.stays[where].start,
    )  # fmt: skip


def internal_changes(
    system: Robot, robot: RobotPlan, matching: Matching, knot: Fraction | None = None, *, initial: str | None = None
) -> tuple[tuple[InternalChange, ...], ActionFault | None]:
    """Place the planned actions in time.

    Actions of a visit are spread evenly over the longest time that the robot is in the region for sure (of a visit that is
    under way when a lap begins: before it does), so that no two share an instant; a single one is at its middle. Every instant
    is a float, the one that is written and flown.

    Args:
        system: Says which actions are permitted.
        robot: The robot's plan.
        matching: Its visits as stays.
        knot: For a lasso, when its cycle begins, in s: actions of the cycle's visits come after it, others before.
        initial: Internal state at time 0; None takes the system's.

    Returns:
        The changes in order, and why the next one is not permitted (None where all are).
    """
    changes: list[InternalChange] = []
    lap = robot.cycle_visit if matching.lap is None else matching.lap

    def fault(sentence: str, index: int, time: Fraction | None = None) -> tuple[tuple[InternalChange, ...], ActionFault]:
        begins = matching.stays[index].start if index < len(matching.stays) else None
        return tuple(changes), ActionFault(sentence, index, robot.visits[index].region, begins if time is None else time)

    state = system.initial if initial is None else initial
    at_cycle: str | None = None
    for index, visit in enumerate(robot.visits):
        if index == lap:
            at_cycle = state
        if index >= len(matching.stays):
            if visit.actions:
                return fault(f"visit {index} of '{visit.region}', with its actions, does not happen", index)
            return tuple(changes), None
        in_lap = lap is not None and index >= lap
        span = (
            matching.stays[index].longest if knot is None else _on_one_side(matching.stays[index], knot, later=in_lap).longest
        )
        for number, action in enumerate(visit.actions):
            if action.source != state:
                return fault(
                    f"visit {index} of '{visit.region}' changes '{action.source}' to '{action.target}', "
                    f"but the state is '{state}'",
                    index,
                )
            if action not in system.actions or action.at != visit.region:
                return fault(f"visit {index}: '{action.source}' may not become '{action.target}' in '{visit.region}'", index)
            if span is None:
                return fault(f"the action of visit {index} of '{visit.region}' has no time before the cycle begins", index)
            step = (span[1] - span[0]) / (len(visit.actions) + 1)
            instant = _rounded(span[0] + step * (number + 1), step)
            if changes and changes[-1].time >= instant:
                return fault(f"the actions of visit {index} of '{visit.region}' have no time between them", index, instant)
            if knot is not None and not (instant > knot if in_lap else instant < knot):
                return fault(
                    f"the action of visit {index} of '{visit.region}' is on the wrong side of the start of the cycle",
                    index,
                    instant,
                )
            state = action.target
            propositions = frozenset(system.states[state])
            changes.append(InternalChange(instant, action.source, state, visit.region, index, propositions))
    if at_cycle is not None and at_cycle != state:
        last = max(index for index, visit in enumerate(robot.visits) if visit.actions)
        return fault(f"a lap begins in state '{at_cycle}' and ends in '{state}', by the action of visit {last}", last)
    return tuple(changes), None


def _on_one_side(stay: Stay, knot: Fraction, *, later: bool) -> Stay:
    """Return a stay with the times only in which it is in the region before, or after, the lap begins."""
    must = [(max(low, knot), high) if later else (low, min(high, knot)) for low, high in stay.must]
    return replace(stay, must=tuple((low, high) for low, high in must if low < high))


def _rounded(time: Fraction, step: Fraction) -> Fraction:
    """Round an instant that lies more than `step` inside a visit, and off the next one, by less than half of that."""
    if step > Fraction(1, _GRID):
        return Fraction(round(time * _GRID), _GRID)
    near = Fraction(float(time))  # a visit of microseconds
    return near if 2 * abs(near - time) < step else time
