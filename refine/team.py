"""`refine`: from a plan to polynomials for the whole team.

Reads downwards: each robot gets a corridor and a smooth path that keeps it, is slowed until its limits hold, turns its
heading; then the team's departures are chosen so that robots keep their distance, and everything is rounded to float32.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from numbers import Integral, Real
from typing import get_args

import numpy as np

from refine.coordination.team_flights import together
from refine.feedback import feedback_of
from refine.laps import team_laps
from refine.parts import in_parts, longer_than_held, say_how_found
from refine.refusals import with_reasons
from refine.rest_to_rest import TICK, as_flown
from refine.single_robot.task import Effort, Pace, RefinementOptions, RobotFlight, TooLong, unheard
from refine.spline.rounding import quantise
from refine.spline.spline import Spline
from verify.data import BadInput, DoesNotFit, Infeasible, Plan, RobotPlan, Trajectory, Witness, check_plan
from verify.data.progress import Progress, silent
from verify.data.shapes.inequalities import Point
from verify.data.trajectory import HOVER

_PACES = ("nominal", "time", "blend")
_LONGEST = 86400.0
"""s, a day: the longest flight that a plan may ask for."""


# nine parameters: what a caller may ask for, each by its keyword
def refine(
    plan: Plan,
    *,
    witnesses: Iterable[Witness] = (),
    progress: Progress | None = None,
    pace: Pace | None = None,
    weight: float = 1000.0,
    max_pieces: int | None = None,
    too_long: TooLong = "refuse",
    note: Callable[[str], None] | None = None,
    effort: Effort = "full",
) -> dict[str, Trajectory]:
    """Turn a plan into polynomials that keep its labels, its limits and the team's separation.

    Args:
        plan: Who visits what, with waypoints and nominal times.
        witnesses: What the checker refused so far; each is repaired (limits tightened, clearances widened, waits added), starting
            from the plan again. Hand in those of all earlier attempts together.
        progress: Receives a sentence and a share of the work.
        pace: Instead of `planner.pace` of the mission and its agents: a share of the fastest flight that was found, above 0 up to 1 ("time"
            is 1); "nominal": the plan's times, longer where limits ask for it; "blend": least of the integral of |snap|^2 plus
            `weight` times the duration. But for "nominal" the points of visits may move within their regions and openings, less
            margin and radius.
        weight: For "blend", m^2/s^8.
        max_pieces: Pieces that the target holds for one robot; None for what each robot's vehicle holds. Points that only lead the
            way are left out, where straight legs allow it, until a flight fits.
        too_long: What becomes of a flight that still does not fit: "refuse" it, or let it "rest" and cut it there into parts that fit
            (`Trajectory.cuts`): all robots slow down on their ways and rest at the same instants. Laps rest where they begin and are
            uploaded once.
        note: Receives a sentence on each flight that was found otherwise than asked, such as one of a programme that failed.
        effort: "soon" for a team that waits in the air: flights are found in a third of the time, and last a few per cent longer.

    Returns:
        One flight for each robot, in the mission's order, in exact float32 values. For the compressed format, `flight.quantised`
        fits flights to that format's grid whose joints stay smooth; those are the ones to certify then. `on_grid` only rounds.

    Raises:
        BadInput: Something asked is no plan, no pace or no positive number, or the plan's numbers do not fit each other.
        Infeasible: A limit or a label cannot be kept; carries a witness.
        SolverTimeout: An engine's seconds ran out before its iterations.
        DoesNotFit: A flight needs more than `max_pieces` pieces and is not to rest, or has nowhere to.
    """
    plan = _checked(plan, pace, weight, max_pieces, too_long, effort)
    most = None if max_pieces is None else int(max_pieces)
    flights = _flights(
        plan,
        tuple(witnesses),
        RefinementOptions(pace, weight, most, too_long, note or unheard, effort=effort),
        progress or silent,
    )
    (progress or silent)("refined", 1.0)
    return {name: flights[name] for name in plan.robots}


def _flights(plan: Plan, witnesses: tuple[Witness, ...], options: RefinementOptions, tell: Progress) -> dict[str, Trajectory]:
    """Return one flight a robot; of robots that wait, the one that flies longest is refined first where no flights were found otherwise."""
    waits = plan.meetings or plan.precedences
    orders = [_in_order(plan, 1), *([_in_order(plan, -1)] if waits else [])]
    for ordered in orders[:-1]:
        try:
            return _in_parts(ordered, witnesses, options, tell)
        except Infeasible:
            continue
    return _in_parts(orders[-1], witnesses, options, tell)


def _in_parts(plan: Plan, witnesses: tuple[Witness, ...], options: RefinementOptions, tell: Progress) -> dict[str, Trajectory]:
    """Return one flight a robot, cut into parts where it is too long and may rest."""
    laps = plan.mission.spec.trace == "infinite"
    if laps and len(plan.robots) > 1:
        flights = with_reasons(plan, lambda telling: team_laps(plan, witnesses, options, telling), tell)
        long = longer_than_held(plan.mission, flights, options)
        if long and options.too_long == "refuse":
            raise _too_long(plan, long, options)
        return flights
    team = with_reasons(plan, lambda telling: together(plan, feedback_of(plan, witnesses), options, telling), tell)
    tell("rounding to the vehicle's numbers", 0.95)
    robots, starts = team
    say_how_found(robots.values(), options)
    flights = {name: _assemble(robot, plan.mission.agents[name].yaw, starts[name]) for name, robot in robots.items()}
    long = longer_than_held(plan.mission, flights, options)
    if not long:
        return flights
    if options.too_long == "refuse":
        raise _too_long(plan, long, options)
    if not laps:
        return in_parts(plan, witnesses, team, options, tell).flights()
    try:
        return team_laps(plan, witnesses, options, tell)
    except Infeasible as error:
        raise DoesNotFit(f"{_too_long(plan, long, options)} From rest to rest there is none: {error}") from error


def _in_order(plan: Plan, sign: int) -> Plan:
    """Return the plan with robots in an order that owes nothing to how they are listed: by how long they fly, times a sign, then round the middle of their starts.

    Round it, robots that are alike come after those beside them; along an axis they come from opposite sides in turn, and give way for longer.
    """
    starts = np.array([robot.waypoints[0].position for robot in plan.robots.values()])
    middle = starts.mean(axis=0)

    def key(item: tuple[str, RobotPlan]) -> tuple[float, float, Point]:
        _, robot = item
        start = robot.waypoints[0].position
        x, y, _ = (
            np.round(start - middle, 6) + 0.0
        )  # no negative zeros, on whose sign the angle of what is to the left would hang
        return sign * round(float(robot.hold + robot.times[-1]), 6), math.atan2(y, x), start

    return plan.model_copy(update={"robots": dict(sorted(plan.robots.items(), key=key))})


def _too_long(plan: Plan, long: Mapping[str, int], options: RefinementOptions) -> DoesNotFit:
    name, flown = next(iter(long.items()))
    laps = plan.mission.spec.repeat
    of = f" for {laps} laps" if plan.mission.spec.trace == "infinite" and laps > 1 else ""
    return DoesNotFit(
        f"{name} needs {flown} pieces{of}; the target holds {options.held(plan.mission, name)}. Let it rest (too_long='rest'), so that "
        "it is uploaded in parts, or stream it."
    )


def _checked(plan: object, pace: object, weight: object, max_pieces: object, too_long: object, effort: object) -> Plan:
    """Return a sound plan; refuse what is no question: whoever has no type checker gets a sentence as well."""
    if not isinstance(plan, Plan):
        raise BadInput(f"refine takes a Plan, not {type(plan).__name__} (points without a mission: refine.minimum_snap).")
    if not (pace is None or pace in _PACES or (isinstance(pace, Real) and pace is not True and 0.0 < float(pace) <= 1.0)):
        raise BadInput(f"pace is {pace!r}; it must be a number above 0 up to 1, or one of {', '.join(map(repr, _PACES))}.")
    for what, value, allowed in (("too_long", too_long, get_args(TooLong)), ("effort", effort, get_args(Effort))):
        if value not in allowed:
            raise BadInput(f"{what} is {value!r}; it must be one of {', '.join(map(repr, allowed))}.")
    if not isinstance(weight, Real) or not 0.0 < float(weight) < np.inf:
        raise BadInput(f"weight is {weight!r}; it must be a positive number, in m^2/s^8.")
    if max_pieces is not None and (not isinstance(max_pieces, Integral) or int(max_pieces) < 2):
        raise BadInput(
            f"max_pieces is {max_pieces!r}; it must be a whole number of at least 2, as every flight has two pieces."
        )
    plan = check_plan(plan)
    for name, robot in plan.robots.items():
        if robot.hold + robot.times[-1] > _LONGEST:
            raise BadInput(
                f"{name} would fly for {robot.hold + robot.times[-1]:.3g} s; plans of up to {_LONGEST:.0f} s are refined."
            )
        last, visits = len(robot.waypoints) - 1, len(robot.visits)
        if robot.cycle_waypoint is not None and not 0 <= robot.cycle_waypoint <= last:
            raise BadInput(f"{name}: cycle_waypoint is {robot.cycle_waypoint}; it must lie from 0 to {last}.")
        for number, waypoint in enumerate(robot.waypoints):
            if waypoint.visit is not None and not 0 <= waypoint.visit < visits:
                raise BadInput(f"{name}: waypoint {number} serves visit {waypoint.visit} of {visits} (counted from 0).")
    return plan


def _assemble(robot: RobotFlight, start_yaw: float, departure: float) -> Trajectory:
    """Join hold, path and yaw, and round.

    Never fewer than two pieces, because crazyswarm2's loader fails on files with one: a hover is flown in two halves, any
    other single piece is followed by a hover.
    """
    path, cycle = as_flown(robot, start_yaw, departure), robot.cycle
    states, durations = path.states, path.durations
    if departure >= TICK:
        cycle = None if cycle is None else cycle + 1
    if len(durations) == 1:
        if cycle is not None or np.array_equal(states[0], states[1]):
            halves = Spline(durations, states).split(2)
            durations, states = halves.durations, halves.states
        else:
            durations, states = np.append(durations, HOVER), np.concatenate([states, states[-1:]])
    return quantise(Spline(durations, states), cycle=cycle)
