"""Endurance as a limit on who does what: nobody may fly longer than the robot that has to land first can stay in the air.

All robots are in the air until the last one has finished, so the least endurance binds them all. Times are the lengths of ways over
the speed that each robot may come to; what rests, waits and turns add is known when paths are laid, and proved in the certificate.
"""

from __future__ import annotations

from collections.abc import Mapping

from ltlplan.allocation import Itinerary
from ltlplan.systems.robot_systems import Systems
from verify.data import Infeasible, Mission, Witness
from verify.data.vehicle import CLIMB_AND_LANDING

_SLACK = 1e-6


def require_endurance(mission: Mission, systems: Systems, robots: Mapping[str, Itinerary]) -> None:
    """Refuse what takes a robot longer than the flight may last.

    Args:
        mission: Gives endurances and speeds.
        systems: Give what a metre costs each robot.
        robots: What each does, with its cost.

    Raises:
        Infeasible: Somebody flies too long; the message says who.
    """
    most = systems.most_costs()
    if most is not None and any(does.cost > limit + _SLACK for does, limit in zip(robots.values(), most, strict=True)):
        raise over_endurance(mission, systems, robots)


def over_endurance(mission: Mission, systems: Systems, robots: Mapping[str, Itinerary]) -> Infeasible:
    """Return the error that says that an allocation, the cheapest one, takes longer than some vehicle can fly.

    Args:
        mission: Gives endurances and speeds.
        systems: Give what a metre costs each robot.
        robots: What each does, with its cost.
    """
    limits = {name: mission.limits_of(name).endurance for name in mission.agents}
    first = min((name for name in limits if limits[name] is not None), key=lambda name: limits[name] or 0.0)
    allowed = mission.longest_flight or 0.0
    times = {name: systems.metres(name, does.cost) / systems.flown_speed(name) for name, does in robots.items()}
    slowest = max(times, key=lambda name: times[name])
    visits = ", ".join(visit.region for visit in robots[slowest].visits)
    sentence = (
        f"{first}'s endurance of {limits[first]:g} s leaves {allowed:g} s for the flight ({CLIMB_AND_LANDING:g} s are for climb, the way to "
        f"the start and landing), and all are in the air until the last one has finished. No way to share the mission was found that lasts "
        f"no longer: the cheapest lets {slowest} fly {times[slowest]:.4g} s at {systems.flown_speed(slowest):g} m/s ({visits}). Plan more "
        "robots, or vehicles of longer endurance."
    )
    witness = Witness(claim="limits.endurance", sentence=sentence, robot=slowest, bound=times[slowest], limit=allowed)
    return Infeasible(sentence, witness)
