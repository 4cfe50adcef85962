"""Plans of faster flights, for missions that last longer than a vehicle can stay in the air: at a greater pace, then at higher nominal speeds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from ltlplan.paths.costs import for_mission
from verify.data import Infeasible, Mission, Plan
from verify.data.sections import Pace

_STEP = 1.15
"""By which each speed that is tried is higher than the one before."""


def planned_faster(mission: Mission, make: Callable[[Mission], Plan], refused: Infeasible) -> Plan:
    """Return the plan of the first of some faster flights that keeps all endurances; it carries the mission as it is.

    Refinement and the certificate keep all limits of the flight as ever, also where it is planned to be faster.

    Args:
        mission: What is asked.
        make: Plans a mission.
        refused: What planning said of the mission itself.

    Raises:
        Infeasible: The endurance is too short at all paces and speeds up to the limits; says what the least time was.
    """
    witness, least = refused.witness, refused
    if witness is None or witness.claim != "limits.endurance":
        raise refused
    for faster, how in _faster(mission):
        try:
            made = make(faster)
        except Infeasible as error:
            if error.witness is None or error.witness.claim != "limits.endurance":
                raise refused from error
            least = min(least, error, key=_lasts)
            continue
        note = f"Planned at {how}, at which the flight would outlast a vehicle's endurance."
        return for_mission(made.model_copy(update={"notes": (*made.notes, note)}), mission)
    raise Infeasible(f"{refused} {_least_time(least)}", witness) from refused


def at_nominal_times(mission: Mission) -> Mission:
    """Return the mission with all robots at nominal times.

    Args:
        mission: What is asked.
    """
    return _paced(mission, "nominal", mission.agents)


def _paced(mission: Mission, pace: Pace, names: Iterable[str]) -> Mission:
    """Return the mission with some robots at another pace."""
    changed = {name: mission.agents[name].model_copy(update={"pace": pace}) for name in names}
    return mission.changed(agents={**mission.agents, **changed})


def _faster(mission: Mission) -> Iterator[tuple[Mission, str]]:
    """Yield the mission at pace 1, and for nominal robots at speeds up to the greatest of their limits, with what that replaces."""
    paces = {name: pace for name in mission.agents if not isinstance(pace := mission.pace_of(name), str)}
    least, greatest = min(paces.values(), default=1.0), _paced(mission, 1.0, paces)
    if least < 1.0:
        yield greatest, f"pace 1 instead of {least:g} (`planner.pace`)"
    own = mission.planner.speed
    for speed in _speeds(mission):
        faster = greatest.changed(planner=mission.planner.model_copy(update={"speed": speed}))
        yield faster, f"{speed:.3g} m/s instead of {own:g} m/s (`planner.speed`)"


def _speeds(mission: Mission) -> list[float]:
    """Return nominal speeds above the mission's own, up to the greatest limit on speed of a robot that flies by them, m/s."""
    own = mission.planner.speed
    limits = (mission.limits_of(name).speed for name in mission.agents if mission.pace_of(name) == "nominal")
    most = max(limits, default=own)
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
