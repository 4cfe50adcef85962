"""A team's flight in parts, each from rest to rest, where some vehicle cannot hold it at once.

The plan is cut in two at one moment for all robots: at a point near the middle of the longest flight, and for every other robot at the last
point that it has reached by then. Each half is refined by itself, the second from where the first came to rest, and cut again where it
is still too long. What one robot waits for in the plan is over in an earlier part, or waited for in the same one.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from refine.coordination.spacing import spacing_for
from refine.coordination.team_flights import Together
from refine.corridor.legs import HOVERING
from refine.corridor.relocation import moved_to_meet
from refine.feedback import Feedback, feedback_of
from refine.single.values import RefinementOptions
from refine.stretches import Part, Stretch, end_of, in_one
from verify.data import BadInput, DoesNotFit, Infeasible, Mission, Plan, RobotPlan, Trajectory, Visit, Witness
from verify.data.plan import Meeting, Precedence
from verify.data.progress import Progress, part_of
from verify.data.trajectory import MAX_PIECES, PIECES

_SPARE = 2
"""Pieces of a part that are left for waits, before departing and for the others."""
_FAILURES = 2
"""Parts that may fail after all was tried to keep their robots apart: each takes long, and others hardly fare better."""


def team_in_parts(
    plan: Plan,
    witnesses: tuple[Witness, ...],
    options: RefinementOptions,
    tell: Progress,
    part: Part,
    counts: Mapping[str, int],
) -> dict[str, Trajectory]:
    """Turn a finite plan whose flight is known not to fit into flights that are cut at common rests.

    Args:
        plan: Who visits what.
        witnesses: What the judge refused so far.
        options: What the caller asked for.
        tell: Told a sentence and a share of the work.
        part: Refines a finite plan.
        counts: Pieces of each robot's whole flight, as far as they are known.

    Raises:
        BadInput: The plan's numbers do not fit each other.
        Infeasible: A part cannot be flown as planned.
        DoesNotFit: A flight has no point at which it can be cut.
        SolverTimeout: An engine's seconds ran out.
    """
    if plan.mission.written.counts:  # parts are refined without the formula, which says that robots meet
        kept_apart = spacing_for(plan, feedback_of(plan, witnesses))
        plan = moved_to_meet(plan, kept_apart.distance + HOVERING, kept_apart.z_scale)
    plan = plan.model_copy(update={"precedences": _waits(plan, witnesses)})
    kept = tuple(witness for witness in witnesses if not witness.order)
    found = _in_two(plan, kept, options, tell, _Bounded(part), counts)
    return {
        name: Trajectory(pieces.durations, np.stack(pieces.coefficients), cuts=found.cuts[name])
        for name, pieces in found.pieces.items()
    }


def longer_than_held(mission: Mission, flights: Mapping[str, Trajectory], options: RefinementOptions) -> dict[str, int]:
    """Return how many pieces robots fly, all laps counted, of those that fly more than is held at once.

    Args:
        mission: Says what vehicles hold and how many laps are flown.
        flights: One a robot.
        options: May say otherwise.

    Raises:
        BadInput: There are more laps than files hold.
    """
    laps = mission.spec.repeat
    flown = {
        name: len(path) + (laps - 1) * (0 if path.cycle is None else len(path) - path.cycle) for name, path in flights.items()
    }
    for name, count in flown.items():
        if count > MAX_PIECES:
            most = 1 + (MAX_PIECES - len(flights[name])) * (laps - 1) // (count - len(flights[name]))
            raise BadInput(
                f"{name} flies {count} pieces in {laps} laps, and files hold {MAX_PIECES}: at most {most} laps are written (`repeat`); start "
                "them again for more."
            )
    return {name: count for name, count in flown.items() if count > (options.held(mission, name) or count)}


def in_parts(
    plan: Plan, witnesses: tuple[Witness, ...], options: RefinementOptions, tell: Progress, part: Part, least: float = 0.0
) -> Stretch:
    """Return a finite plan's flight from rest to rest, in as many parts as the vehicles' memories ask for; in one where it may not rest.

    Args:
        plan: Who visits what.
        witnesses: What the judge refused so far.
        options: What the caller asked for.
        tell: Told a sentence and a share of the work.
        part: Refines a finite plan.
        least: s that it lasts where nobody moves.

    Raises:
        BadInput: The plan's numbers do not fit each other.
        Infeasible: A part cannot be flown as planned.
        DoesNotFit: A flight has no point at which it can be cut.
        SolverTimeout: An engine's seconds ran out.
    """
    part = part if isinstance(part, _Bounded) else _Bounded(part)
    whole = in_one(plan, witnesses, options, tell, part, least)
    if options.too_long == "refuse" or whole.fits({name: options.held(plan.mission, name) for name in plan.robots}):
        return whole
    counts = {name: len(pieces.durations) for name, pieces in whole.pieces.items()}
    return _in_two(plan, witnesses, options, tell, part, counts)


class _Bounded:
    """Refines parts until too many have failed; those that come after fail at once, for the first one's reason."""

    def __init__(self, part: Part) -> None:
        self._part = part
        self._failures: list[Infeasible] = []

    def __call__(self, plan: Plan, feedback: Feedback, options: RefinementOptions, tell: Progress) -> Together:
        """Refine a part.

        Args:
            plan: The part.
            feedback: What witnesses asked for.
            options: What the caller asked for.
            tell: Told a sentence and a share of the work.

        Raises:
            Infeasible: It cannot be flown as planned, or too many before it could not.
        """
        if len(self._failures) >= _FAILURES:
            raise self._failures[0]
        try:
            return self._part(plan, feedback, options, tell)
        except Infeasible as error:
            at_rest = error.witness is not None and error.witness.time is None  # seen at a glance
            if not at_rest:
                self._failures.append(error)
            raise


def _in_two(
    plan: Plan,
    witnesses: tuple[Witness, ...],
    options: RefinementOptions,
    tell: Progress,
    part: Part,
    counts: Mapping[str, int],
) -> Stretch:
    """Return the flight of a plan that does not fit, cut at a common rest at least once."""
    failure: Infeasible | None = None
    fewer = replace(options, cuts=max(options.cuts // 2, 1))
    held = {name: options.held(plan.mission, name) for name in plan.robots}
    for number, cut in enumerate(itertools.islice(_cuts(plan, held, counts), options.cuts)):
        tell(f"cutting the flight where all robots rest{'' if not number else f', place {number + 1}'}", 0.0)
        try:
            head = in_parts(_head(plan, cut), witnesses, fewer, part_of(tell, 0.0, 0.5), part)
            if not head.length:
                continue
            tail = in_parts(_tail(plan, cut, head), witnesses, fewer, part_of(tell, 0.5, 1.0), part)
        except Infeasible as error:
            failure = failure or error
            continue
        if not tail.length:
            continue
        both = head.then(tail)
        begins = {name: len(pieces.durations) for name, pieces in head.pieces.items()}
        return Stretch(both.length, both.pieces, {n: tuple(sorted({*cuts, begins[n]})) for n, cuts in both.cuts.items()})
    if failure is not None:
        raise failure
    longest = _longest(held, counts)
    raise DoesNotFit(
        f"{longest} needs {counts[longest]} pieces, its vehicle holds {held[longest]}, and there is no point of its plan "
        "at which the team can rest, so that it is uploaded in parts. Stream it, or fly a vehicle that holds more (`pieces` of its profile)."
    )


@dataclass(frozen=True, slots=True)
class _Cut:
    """Where each robot's plan is cut.

    Attributes:
        waypoints: Index of the point at which it rests.
        visits: How many visits it has begun by then.
        staying: Whether it rests within the last of them.
    """

    waypoints: dict[str, int]
    visits: dict[str, int]
    staying: dict[str, bool]

    @classmethod
    def at(cls, plan: Plan, waypoints: dict[str, int]) -> _Cut:
        visits: dict[str, int] = {}
        staying: dict[str, bool] = {}
        for name, at in waypoints.items():
            robot = plan.robots[name]
            begun = [w.visit for w in robot.waypoints[: at + 1] if w.visit is not None]
            visits[name] = 1 + max(begun, default=-1)
            inside = _inside(plan.mission, robot.waypoints[at].position)
            staying[name] = visits[name] > 0 and robot.visits[visits[name] - 1].region in inside
        return cls(waypoints, visits, staying)

    def entered(self, event: tuple[str, int]) -> bool:
        return event[1] < self.visits[event[0]]

    def left(self, event: tuple[str, int]) -> bool:
        return event[1] < self.visits[event[0]] - self.staying[event[0]]


def _longest(held: Mapping[str, int | None], counts: Mapping[str, int]) -> str:
    """Return the robot whose flight is longest, in shares of what its vehicle holds."""
    return max(counts, key=lambda name: counts[name] / (held[name] or math.inf))


def _cuts(plan: Plan, held: Mapping[str, int | None], counts: Mapping[str, int]) -> Iterator[_Cut]:
    """Yield cuts of the plan in two, those first that leave the longest flight's parts full."""
    name = _longest(held, counts)
    robot = plan.robots[name]
    parts = max(2, math.ceil(counts[name] / max((held[name] or PIECES) - _SPARE, 1)))
    wanted = math.ceil(parts / 2) / parts * (len(robot.waypoints) - 1)
    seen: list[dict[str, int]] = []
    for at in sorted(range(1, len(robot.waypoints) - 1), key=lambda index: (abs(index - wanted), index)):
        if not _may_rest(robot, at):
            continue
        places = {other: _reached(each, robot.times[at]) for other, each in plan.robots.items()} | {name: at}
        cut = _in_order(plan, places)
        if cut is not None and cut.waypoints[name] > 0 and cut.waypoints not in seen:
            seen.append(cut.waypoints)
            yield cut


def _may_rest(robot: RobotPlan, at: int) -> bool:
    """Tell whether a robot may rest at a waypoint: at an end, or where no visit is under way whose points lie ahead."""
    here, last = robot.waypoints[at].visit, len(robot.waypoints) - 1
    return at in (0, last) or here is None or robot.waypoints[at + 1].visit != here


def _reached(robot: RobotPlan, time: float) -> int:
    """Return the last waypoint at which a robot may rest that it has nominally reached by a time, in s."""
    reached = [at for at, t in enumerate(robot.times) if robot.hold + t <= time and _may_rest(robot, at)]
    return max(reached, default=0)


def _in_order(plan: Plan, places: dict[str, int]) -> _Cut | None:
    """Return a cut before which nobody does what has to wait for something behind it; None where none is left."""
    while True:
        cut = _Cut.at(plan, places)
        early = next((then for then in _too_early(plan, cut)), None)
        if early is None:
            return cut
        if places[early] == 0:
            return None
        robot = plan.robots[early]
        places = {**places, early: max(at for at in range(places[early]) if _may_rest(robot, at))}


def _too_early(plan: Plan, cut: _Cut) -> Iterator[str]:
    """Yield robots that do something before the cut that is to wait for something that comes after it."""
    for wait in plan.precedences:
        done = cut.entered(wait.first) if wait.done == "entered" else cut.left(wait.first)
        due = cut.left(wait.then) if wait.due == "leaves" else cut.entered(wait.then)
        if due and not done:
            yield wait.then[0]
    for meeting in plan.meetings:
        if cut.entered(meeting.then) and not cut.entered(meeting.first):
            yield meeting.then[0]


def _head(plan: Plan, cut: _Cut) -> Plan:
    """Return the plan up to the cut."""
    agents = dict(plan.mission.agents)
    robots: dict[str, RobotPlan] = {}
    for name, robot in plan.robots.items():
        at = cut.waypoints[name]
        if at < len(robot.waypoints) - 1:
            agents[name] = agents[name].model_copy(update={"end": None})
        robots[name] = robot.model_copy(
            update={
                "visits": robot.visits[: cut.visits[name]],
                "waypoints": robot.waypoints[: at + 1],
                "times": robot.times[: at + 1],
                "hold": robot.hold if at else 0.0,
            }
        )
    waits = tuple(
        wait for wait in plan.precedences if (cut.left(wait.then) if wait.due == "leaves" else cut.entered(wait.then))
    )
    meetings = tuple(meeting for meeting in plan.meetings if cut.entered(meeting.then))
    mission = plan.mission.model_copy(update={"agents": agents}).asking(None)
    return plan.model_copy(update={"mission": mission, "robots": robots, "precedences": waits, "meetings": meetings})


def _tail(plan: Plan, cut: _Cut, head: Stretch) -> Plan:
    """Return the plan from the cut on, from where the robots have come to rest."""
    agents = dict(plan.mission.agents)
    robots: dict[str, RobotPlan] = {}
    shifts: dict[str, int] = {}
    for name, robot in plan.robots.items():
        at, begun, end = cut.waypoints[name], cut.visits[name], end_of(head.pieces[name])
        place = (float(end[0]), float(end[1]), float(end[2]))
        actions = [action for visit in robot.visits[:begun] for action in visit.actions]
        agents[name] = agents[name].model_copy(
            update={
                "start": place,
                "yaw_deg": math.degrees(float(end[3])),
                "internal": actions[-1].target if actions else agents[name].internal,
                "visited": robot.visits[begun - 1].region if begun else agents[name].visited,
            }
        )
        inside = _inside(plan.mission, place)
        shifts[name] = len(inside) - begun
        waypoints = [
            w if w.visit is None else w.model_copy(update={"visit": max(w.visit + shifts[name], 0)})
            for w in robot.waypoints[at:]
        ]
        waypoints[0] = waypoints[0].model_copy(update={"position": place, "role": "start", "visit": 0 if inside else None})
        robots[name] = robot.model_copy(
            update={
                "visits": (*(Visit(region=region) for region in inside), *robot.visits[begun:]),
                "waypoints": tuple(waypoints),
                "times": tuple(time - robot.times[at] for time in robot.times[at:]),
                "hold": 0.0 if at else robot.hold,
            }
        )

    def moved(event: tuple[str, int]) -> tuple[str, int]:
        return event[0], max(event[1] + shifts[event[0]], 0)

    waits = tuple(
        wait.model_copy(update={"first": moved(wait.first), "then": moved(wait.then)})
        for wait in plan.precedences
        if not (cut.entered(wait.first) if wait.done == "entered" else cut.left(wait.first))
    )
    meetings = tuple(
        Meeting(first=moved(meeting.first), then=moved(meeting.then))
        for meeting in plan.meetings
        if not cut.entered(meeting.first)
    )
    mission = plan.mission.model_copy(update={"agents": agents}).asking(None)
    return plan.model_copy(update={"mission": mission, "robots": robots, "precedences": waits, "meetings": meetings})


def _inside(mission: Mission, place: tuple[float, float, float]) -> list[str]:
    return [region for region, body in mission.all_regions.items() if float(body.level(np.array(place))) <= 1.0]


def _waits(plan: Plan, witnesses: tuple[Witness, ...]) -> tuple[Precedence, ...]:
    """Return the plan's precedences, and those that witnesses ask for."""
    return tuple(wait for wait in feedback_of(plan, witnesses).precedences if isinstance(wait, Precedence))
