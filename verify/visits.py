"""Stays in regions, the planned visits that they are, and the instants of planned actions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from verify.data.mission import Mission
from verify.data.plan import RobotPlan
from verify.labels import Span
from verify.timeline import InternalChange

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
    """Planned visits held against stays.

    Attributes:
        stays: Stay of each planned visit; shorter than the visits where they do not match.
        extra: Stay at time 0 that no visit stands for: the robot starts there.
        fault: Why they do not match; empty where they do.
        visit: Index of the visit concerned, for a fault.
        region: Region concerned, for a fault.
        time: When, for a fault.
    """

    stays: tuple[Stay, ...]
    extra: Stay | None = None
    fault: str = ""
    visit: int | None = None
    region: str | None = None
    time: Fraction | None = None


@dataclass(frozen=True, slots=True)
class ActionFault:
    """Why a planned action cannot be placed.

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
    return tuple(sorted(found, key=lambda stay: (stay.start, stay.stop)))


def match(robot: RobotPlan, found: tuple[Stay, ...]) -> Matching:
    """Hold the k-th planned visit against the k-th stay.

    A stay at time 0 counts as no visit where the plan has none for it: the robot starts there.
    """
    wanted = [visit.region for visit in robot.visits]
    rest, extra = found, None
    if found and found[0].start == 0 and len(found) == len(wanted) + 1:
        rest, extra = found[1:], found[0]
    for index, (region, stay) in enumerate(zip(wanted, rest, strict=False)):
        if stay.region != region:
            return Matching(
                rest[:index], extra, f"visit {index} is planned in '{region}', but the path comes to '{stay.region}'",
                index, stay.region, stay.start,
            )  # fmt: skip
        if stay.longest is None:
            return Matching(
                rest[:index], extra, f"visit {index} of '{region}' may miss the region: nowhere is it inside for sure",
                index, region, stay.start,
            )  # fmt: skip
    if len(rest) > len(wanted):
        stay = rest[len(wanted)]
        return Matching(
            rest[: len(wanted)],
            extra,
            f"the path may come to '{stay.region}', which is not planned",
            None,
            stay.region,
            stay.start,
        )
    if len(rest) < len(wanted):
        index = len(rest)
        return Matching(rest, extra, f"visit {index} of '{wanted[index]}' does not happen", index, wanted[index])
    return Matching(rest, extra)


def internal_changes(
    mission: Mission, robot: RobotPlan, matching: Matching, knot: Fraction | None = None, *, initial: str | None = None
) -> tuple[tuple[InternalChange, ...], ActionFault | None]:
    """Place the planned actions in time.

    Actions of a visit are spread evenly over the longest time that the robot is in the region for sure, so that no two
    share an instant; a single one is at its middle. Every instant is a float, the one that is written and flown.

    Args:
        mission: Says which actions are permitted.
        robot: The robot's plan.
        matching: Its visits as stays.
        knot: For a lasso, when its cycle begins, in s: actions of the cycle's visits come after it, others before.
        initial: Internal state at time 0; None takes the mission's.

    Returns:
        The changes in order, and why the next one is not permitted (None where all are).
    """
    changes: list[InternalChange] = []

    def fault(sentence: str, index: int, time: Fraction | None = None) -> tuple[tuple[InternalChange, ...], ActionFault]:
        begins = matching.stays[index].start if index < len(matching.stays) else None
        return tuple(changes), ActionFault(sentence, index, robot.visits[index].region, begins if time is None else time)

    state = mission.robot.initial if initial is None else initial
    at_cycle: str | None = None
    for index, visit in enumerate(robot.visits):
        if index == robot.cycle_visit:
            at_cycle = state
        if index >= len(matching.stays):
            if visit.actions:
                return fault(f"visit {index} of '{visit.region}', with its actions, does not happen", index)
            return tuple(changes), None
        span = matching.stays[index].longest
        for number, action in enumerate(visit.actions):
            if action.source != state:
                return fault(
                    f"visit {index} of '{visit.region}' changes '{action.source}' to '{action.target}', "
                    f"but the state is '{state}'",
                    index,
                )
            if action not in mission.robot.actions or action.at != visit.region:
                return fault(f"visit {index}: '{action.source}' may not become '{action.target}' in '{visit.region}'", index)
            assert span is not None
            step = (span[1] - span[0]) / (len(visit.actions) + 1)
            instant = _rounded(span[0] + step * (number + 1), step)
            if changes and changes[-1].time >= instant:
                return fault(f"the actions of visit {index} of '{visit.region}' have no time between them", index, instant)
            if knot is not None and (instant > knot) != (robot.cycle_visit is not None and index >= robot.cycle_visit):
                return fault(
                    f"the action of visit {index} of '{visit.region}' is on the wrong side of the start of the cycle",
                    index,
                    instant,
                )
            state = action.target
            propositions = frozenset(mission.robot.states[state])
            changes.append(InternalChange(instant, action.source, state, visit.region, index, propositions))
    if robot.cycle_visit is not None and at_cycle is not None and at_cycle != state:
        last = max(index for index, visit in enumerate(robot.visits) if visit.actions)
        return fault(f"a lap begins in state '{at_cycle}' and ends in '{state}', by the action of visit {last}", last)
    return tuple(changes), None


def _rounded(time: Fraction, step: Fraction) -> Fraction:
    """Round an instant that lies more than `step` inside a visit, and off the next one, by less than half of that."""
    if step > Fraction(1, _GRID):
        return Fraction(round(time * _GRID), _GRID)
    near = Fraction(float(time))  # a visit of microseconds
    return near if 2 * abs(near - time) < step else time
