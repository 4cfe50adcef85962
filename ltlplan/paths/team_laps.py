"""Nominal paths of a team's laps: the way to where each robot rests, and the way of one lap from there back to there."""

from __future__ import annotations

from ltlplan.allocation import Itinerary
from ltlplan.paths.costs import cost_of, plan_cost
from ltlplan.paths.final_hover import then_hovering
from ltlplan.paths.improvement import without_swings
from ltlplan.paths.nominal import lay_path
from ltlplan.paths.unnamed_regions import finished
from refine.lap_missions import before_laps, one_lap, rest_after
from verify.data import Mission, RobotPlan, Visit, Word


def lay_laps(mission: Mission, name: str, does: Itinerary) -> tuple[RobotPlan, tuple[str, ...]]:
    """Lay one robot's prefix and its lap, each from rest to rest; both are flown as they are laid, so neither swings.

    Args:
        mission: Hoops, regions, workspace and margin.
        name: Of the robot.
        does: Its visits and word, with where the cycle begins.

    Raises:
        Infeasible: There is no way.
    """
    begins, word = does.cycle_visit or 0, does.word
    cycle = word.cycle or ()
    stays = begins == len(does.visits)
    reached = Word((*word.prefix, *cycle) if stays else word.prefix)
    before = before_laps(mission)
    once, notes = _steady(before, name, Itinerary(does.visits[:begins], reached))
    if stays:
        return then_hovering(once).model_copy(update={"word": word}), notes
    rest = rest_after(mission, name, then_hovering(once))
    here = sorted(reached.letters[-1] & mission.all_regions.keys())
    visits = (*(Visit(region=region) for region in here), *does.visits[begins:])
    again = one_lap(mission, {name: rest})
    lap, more = _steady(again, name, Itinerary(visits, Word((reached.letters[-1], *cycle))))
    return _joined(once, lap, len(here), word), (*notes, *more)


def cost_of_all_laps(mission: Mission, name: str, path: RobotPlan) -> float:
    """Return what a robot's path costs with all its laps, of which its own cost counts the first.

    Args:
        mission: Says how many are flown.
        name: Of the robot.
        path: As it was laid.
    """
    if path.cycle_waypoint is None or path.hovers:
        return path.cost
    begins = path.cycle_waypoint
    times = tuple(time - path.times[begins] for time in path.times[begins:])
    lap = path.model_copy(update={"waypoints": path.waypoints[begins:], "times": times, "cycle_waypoint": None})
    return path.cost + (mission.spec.repeat - 1) * plan_cost(lap, cost_of(mission, name))


def _steady(mission: Mission, name: str, does: Itinerary) -> tuple[RobotPlan, tuple[str, ...]]:
    """Lay a path that does not swing."""
    path, notes = lay_path(mission, name, does)
    return finished(mission, name, does, path, lambda few, laid: without_swings(few, name, laid)), notes


def _joined(once: RobotPlan, lap: RobotPlan, begun: int, word: Word) -> RobotPlan:
    """Return prefix and lap as one plan; of the lap's visits the first `begun` are under way when it begins."""
    shift = len(once.visits) - begun
    waypoints = [
        waypoint if waypoint.visit is None else waypoint.model_copy(update={"visit": waypoint.visit + shift})
        for waypoint in lap.waypoints[1:]
    ]
    return once.model_copy(
        update={
            "word": word,
            "visits": (*once.visits, *lap.visits[begun:]),
            "waypoints": (*once.waypoints, *waypoints),
            "times": (*once.times, *(once.times[-1] + time for time in lap.times[1:])),
            "cycle_visit": len(once.visits),
            "cycle_waypoint": len(once.waypoints) - 1,
            "cost": once.cost + lap.cost,
        }
    )
