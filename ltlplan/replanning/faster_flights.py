"""Plans at a higher nominal speed, for missions that last longer than a vehicle can stay in the air at their own."""

from __future__ import annotations

from collections.abc import Callable

from verify.data import Infeasible, Mission, Plan

_STEP = 1.15
"""By which each speed that is tried is higher than the one before."""


def planned_faster(mission: Mission, make: Callable[[Mission], Plan], refused: Infeasible) -> Plan:
    """Return the plan at the least of some higher nominal speeds that keeps all endurances; it carries the mission as it is.

    Refinement and the certificate keep all limits of the flight as ever, also where it is planned to be faster.

    Args:
        mission: What is asked.
        make: Plans a mission.
        refused: What planning said of the mission's own speed.

    Raises:
        Infeasible: The endurance is too short at all speeds up to the limits on speed; says what the least time was.
    """
    witness, least = refused.witness, refused
    if witness is None or witness.claim != "limits.endurance":
        raise refused
    for speed in _speeds(mission):
        try:
            made = make(mission.changed(planner=mission.planner.model_copy(update={"speed": speed})))
        except Infeasible as error:
            if error.witness is None or error.witness.claim != "limits.endurance":
                raise refused from error
            least = min(least, error, key=_lasts)
            continue
        note = (
            f"Planned at {speed:.3g} m/s instead of {mission.planner.speed:g} m/s (`planner.speed`), at which the flight would outlast "
            "a vehicle's endurance."
        )
        return made.model_copy(update={"mission": mission, "notes": (*made.notes, note)})
    raise Infeasible(f"{refused} {_least_time(least)}", witness) from refused


def _speeds(mission: Mission) -> list[float]:
    """Return nominal speeds above the mission's own, up to the greatest limit on speed of a robot, m/s."""
    own = mission.planner.speed
    most = max(mission.limits_of(name).speed for name in mission.agents)
    speeds: list[float] = []
    while (speed := own * _STEP ** (len(speeds) + 1)) < most:
        speeds.append(speed)
    return [speed for speed in [*speeds, most] if speed > own]


def _lasts(error: Infeasible) -> float:
    """Return how long the robot flies that flies too long, s."""
    assert error.witness is not None
    assert error.witness.bound is not None
    return error.witness.bound


def _least_time(least: Infeasible) -> str:
    assert least.witness is not None
    return (
        f"Faster flights, up to the limits on speed, were tried: the least time of the robot that flies longest is {_lasts(least):.4g} s, "
        f"against {least.witness.limit:.4g} s."
    )
