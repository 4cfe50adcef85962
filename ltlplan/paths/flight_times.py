"""Durations of planned paths, held against the endurance of the team's vehicles."""

from __future__ import annotations

from ltlplan.systems.objective import flown_speed
from verify.data import Infeasible, Mission, RobotPlan, Witness
from verify.data.vehicle import CLIMB_AND_LANDING


def flight_time(mission: Mission, robot: str, path: RobotPlan) -> float:
    """Return how long a robot's path lasts, all laps flown, s: at its nominal times, or where its pace is another at the speed it may come to.

    Args:
        mission: Says how many laps, and each robot's pace.
        robot: Name.
        path: The robot's.
    """
    end = float(path.times[-1])
    if path.cycle_waypoint is not None:
        end += (mission.spec.repeat - 1) * float(path.times[-1] - path.times[path.cycle_waypoint])
    return path.hold + end * mission.seen_by(robot).planner.speed / flown_speed(mission, robot)


def lasts_too_long(mission: Mission, robot: str, path: RobotPlan) -> bool:
    """Tell whether a path lasts longer than the vehicle with the least endurance can stay in the air.

    Args:
        mission: Gives endurances.
        robot: Name.
        path: The robot's.
    """
    return mission.longest_flight is not None and flight_time(mission, robot, path) > mission.longest_flight


def require_endurance(mission: Mission, robot: str, path: RobotPlan) -> None:
    """Refuse a path that lasts longer than the vehicle with the least endurance can stay in the air.

    Args:
        mission: Gives endurances.
        robot: Name.
        path: The robot's.

    Raises:
        Infeasible: It does.
    """
    allowed = mission.longest_flight
    if allowed is not None and lasts_too_long(mission, robot, path):
        lasts = flight_time(mission, robot, path)
        sentence = (
            f"{robot}'s path lasts {lasts:.4g} s at {flown_speed(mission, robot):g} m/s, speeding up and slowing down "
            f"included; the least endurance in the team leaves {allowed:g} s beside {CLIMB_AND_LANDING:g} s for climb, the way to the start "
            "and landing. Plan more robots, or vehicles of longer endurance."
        )
        raise Infeasible(
            sentence, Witness(claim="limits.endurance", sentence=sentence, robot=robot, bound=lasts, limit=allowed)
        )
