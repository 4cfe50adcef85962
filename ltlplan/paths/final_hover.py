"""A lasso that ends in a hover, taken apart: the flight up to the hover, which is searched and timed like any other, and the hover."""

from __future__ import annotations

from verify.data import RobotPlan, Word
from verify.data.trajectory import HOVER


def until_hover(plan: RobotPlan) -> RobotPlan:
    """Return the flight up to the hover in which a lasso ends, as a finite flight that comes to rest there."""
    return plan.model_copy(
        update={
            "word": Word(plan.word.letters).compressed(),
            "waypoints": plan.waypoints[:-1],
            "times": plan.times[:-1],
            "cycle_visit": None,
            "cycle_waypoint": None,
        }
    )


def then_hovering(flight: RobotPlan) -> RobotPlan:
    """Return the lasso of a finite flight and a hover at its end, in which the flight's last letter is held for ever."""
    *before, last = flight.word.letters
    return flight.model_copy(
        update={
            "word": Word(tuple(before), (last,)),
            "waypoints": (*flight.waypoints, flight.waypoints[-1]),
            "times": (*flight.times, flight.times[-1] + HOVER),
            "cycle_visit": len(flight.visits),
            "cycle_waypoint": len(flight.waypoints) - 1,
        }
    )
