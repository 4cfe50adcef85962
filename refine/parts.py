"""A team's flight from rest to rest, in as many parts as its vehicles' memories ask for.

A flight that some vehicle cannot hold at once is refined as if all could, and slowed down to rests of the whole team where memories end
(`refine.team_pauses`). Nobody flies another way or in another order for that.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from refine.coordination.team_flights import Together, planned_arrival, together
from refine.feedback import feedback_of
from refine.rest_to_rest import LONGEST, SHORTEST, TICK, Pieces, Stretch, as_flown, from_rest, waiting
from refine.single_robot.task import RefinementOptions, RobotFlight
from refine.spline.rounding import quantise
from refine.spline.spline import Spline
from refine.team_pauses import resting
from verify.data import BadInput, DoesNotFit, Infeasible, Mission, Plan, Trajectory, Witness
from verify.data.progress import Progress
from verify.data.trajectory import MAX_PIECES

_PLANNED = "A faster flight has no parts that its vehicles hold, or takes longer in parts than at the plan's own times: these are flown."


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


def from_rest_to_rest(
    plan: Plan, witnesses: tuple[Witness, ...], options: RefinementOptions, tell: Progress, least: float = 0.0
) -> Stretch:
    """Return a finite plan's flight from rest to rest, in parts where it is too long and may rest on its way.

    Args:
        plan: Who visits what.
        witnesses: What the checker refused so far.
        options: What the caller asked for.
        tell: Receives a sentence and a share of the work.
        least: s that it lasts where nobody moves.

    Raises:
        BadInput: The plan's numbers do not fit each other.
        Infeasible: It cannot be flown as planned.
        DoesNotFit: It is too long, and does not keep its limits where it is slowed down to rest.
        SolverTimeout: An engine's seconds ran out.
    """
    if all(robot.still for robot in plan.robots.values()):
        return waiting(plan, least)
    team = together(plan, feedback_of(plan, witnesses), options, tell)
    say_how_found(team[0].values(), options)
    whole = from_rest(plan, team, least)
    if options.too_long == "refuse" or whole.fits({name: options.held(plan.mission, name) for name in plan.robots}):
        return whole
    return in_parts(plan, witnesses, team, options, tell)


def say_how_found(robots: Iterable[RobotFlight], options: RefinementOptions) -> None:
    """Tell the caller what flights have to say of how they were found, each sentence once.

    Args:
        robots: The flights.
        options: Say who listens.
    """
    for sentence in dict.fromkeys(robot.note for robot in robots if robot.note):
        options.note(sentence)


def in_parts(plan: Plan, witnesses: tuple[Witness, ...], team: Together, options: RefinementOptions, tell: Progress) -> Stretch:
    """Return a team's flight with common rests at which it is cut into parts that its vehicles hold.

    Where a flight as fast as its pace has no such parts, or longer ones than the plan's own times, these are flown.

    Args:
        plan: Whose mission says what vehicles hold, and in whose hoops nobody rests.
        witnesses: What the checker refused so far.
        team: Its robots with their paths, and their departures, s.
        options: May say otherwise what is held.
        tell: Receives a sentence and a share of the work.

    Raises:
        DoesNotFit: Vehicles hold too few pieces, or limits are not kept where robots slow down.
    """
    tell("slowing down to rest where vehicles' memories end", 0.97)
    shares = [share for name in plan.robots if (share := options.share(plan.mission, name)) is not None]
    try:
        found = _cut(plan.mission, team, options)
    except DoesNotFit:
        if not shares:
            raise
        found = None
    if found is not None and (not shares or min(shares) * found.length <= planned_arrival(team)):
        return found
    nominal = replace(options, pace="nominal")
    try:
        planned = _cut(plan.mission, together(plan, feedback_of(plan, witnesses), nominal, tell), nominal)
    except (Infeasible, DoesNotFit):
        if found is None:
            raise
        return found
    if found is not None and min(shares) * found.length <= planned.length:
        return found
    options.note(_PLANNED)
    return planned


def _cut(mission: Mission, team: Together, options: RefinementOptions) -> Stretch:
    """Return a team's flight with common rests at which it is cut."""
    robots, starts = team
    alone = {name: as_flown(robot, mission.agents[name].yaw, starts[name]) for name, robot in robots.items()}
    held = {name: options.held(mission, name) for name in robots}
    limits = {name: robot.limits for name, robot in robots.items()}
    found = resting(_until_all_arrived(alone), mission, limits, held)
    pieces: dict[str, Pieces] = {}
    for name, path in found.paths.items():
        flown = quantise(path)
        pieces[name] = Pieces(tuple(flown.durations.tolist()), tuple(flown.coefficients))
    return Stretch(next(iter(pieces.values())).length, pieces, found.cuts)


def _until_all_arrived(paths: Mapping[str, Spline]) -> dict[str, Spline]:
    """Return flights that all end when the last one does: whoever has arrived hovers."""
    end = np.ceil(max(path.duration for path in paths.values()) / TICK) * TICK
    left = {name: end - path.duration for name, path in paths.items()}
    if any(TICK < gap < SHORTEST for gap in left.values()):
        end += SHORTEST
    found: dict[str, Spline] = {}
    for name, path in paths.items():
        gap = end - path.duration
        if gap <= TICK:  # the last one, whose end is moved to the next tick
            found[name] = Spline(np.append(path.durations[:-1], path.durations[-1] + gap), path.states)
            continue
        count = int(np.ceil(gap / LONGEST))
        durations = np.append(path.durations, np.full(count, gap / count))
        found[name] = Spline(durations, np.concatenate([path.states, np.repeat(path.states[-1:], count, axis=0)]))
    return found
