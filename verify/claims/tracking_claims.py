"""The claim `tracking`: under the mission's disturbances each robot's controller keeps it within the margin of its plan."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from verify.claims.claim import Claim, claim_of, figures, told_apart
from verify.claims.evidence import Evidence
from verify.data.airframe import load_airframe, shipped_airframe_names
from verify.data.disturbance import Disturbance, StreamedSetpoints, Unrest
from verify.data.mission import Mission
from verify.data.trajectory import Trajectory
from verify.data.vehicle import Vehicle
from verify.tracking.error_model import NotProved
from verify.tracking.on_board.onboard_proof import BoardBound, prove_on_board
from verify.tracking.plan_samples import fixed_heading
from verify.tracking.proof import TrackingBound, model_of, prove

PROVED_CONTROLLER = "geometric"
"""The controller that there is a proof for at any heading."""
ON_BOARD = "mellinger"
"""The controller that there is a proof for at heading 0."""
LONGEST = {PROVED_CONTROLLER: 600.0, ON_BOARD: 60.0}
"""s of a flight that is proved, by controller."""
_FLOWN_ON_BOARD = "with set-points of polynomials on board at 100 Hz, by `mellinger` on its filter"
_ASSUMED_ON_BOARD = (
    "a start at rest in hover, summed errors and the filter's covariance settled, a pose from the cameras every 10 ms, "
    "an accelerometer without error"
)
_STEPS = 6
"""Halvings by which the largest share of the disturbances is looked for that would hold."""
_TRIED = 3
"""The dearest disturbances of which it is looked whether one alone is too much."""
_HOVER = 2.0
"""s of a hover that is proved where a plan is not."""
_UNITS = {
    "wind": "m/s",
    "position": "m",
    "velocity": "m/s",
    "attitude": "rad",
    "gyroscope": "rad/s",
    "moment": "N m",
    "start": "m",
}
_SHARES = ("mass", "thrust", "drag", "inertia")


def tracking_claims(evidence: Evidence, margin: float) -> Iterable[Claim]:
    """Each robot stays within the margin under the mission's disturbances; none where the mission names none.

    Args:
        evidence: Of the flights.
        margin: m.
    """
    mission, paths = evidence.plan.mission, evidence.paths
    if mission.disturbance is None:
        return
    flown = [path.flattened(mission.spec.repeat) for path in paths.trajectories]
    duration = max(path.duration for path in flown)
    proofs: dict[str, _Asked] = {}
    for robot, path, planned in zip(paths.robots, flown, paths.trajectories, strict=True):
        if lacks := _lacking(mission, robot, planned, duration):
            yield _lacked(robot, lacks, margin)
        else:
            proofs[robot] = _Asked(path, duration, mission.agents[robot].start, mission.vehicle, mission.disturbance)
    team = tuple(proofs.values())
    for robot, asked in proofs.items():
        yield _claim(robot, asked, margin, team)


def _lacking(mission: Mission, robot: str, path: Trajectory, duration: float) -> str:
    """Return why there is no proof for a robot; empty where there may be one."""
    assert mission.disturbance is not None, "it states some"
    vehicle, airframe = mission.vehicle_of(robot), mission.disturbance.airframe
    follows = vehicle.controller or PROVED_CONTROLLER
    if follows not in LONGEST:
        return f"{robot}: no proof for this controller, '{follows}'; there is one for '{PROVED_CONTROLLER}' and '{ON_BOARD}'."
    if follows == ON_BOARD and np.any(path.coefficients[:, 3]):
        return f"{robot}: no proof for this controller, '{ON_BOARD}', at other headings than 0; there is one for '{PROVED_CONTROLLER}'."
    if fixed_heading(path) is None:
        return f"{robot}: no proof for a heading that turns; write `heading: fixed` for its agent."
    if follows == ON_BOARD and vehicle.autopilot is None:
        return f"{robot}: no proof for this controller, '{ON_BOARD}', as the profile of '{vehicle.name}' names no `autopilot` with its gains."
    if vehicle != mission.vehicle:
        return (
            f"{robot}: no proof for its own vehicle '{vehicle.name}'; `disturbance.airframe` is that of the mission's vehicle."
        )
    own = load_airframe(vehicle.name) if vehicle.name in shipped_airframe_names() else airframe
    if airframe != own:
        return (
            f"{robot}: no proof with another airframe than that of '{vehicle.name}'; `disturbance.airframe` has other numbers."
        )
    if path.cuts:
        return f"{robot}: no proof for flights in parts."
    if duration > LONGEST[follows]:
        return f"{robot}: no proof for a flight of {duration:.0f} s; at most {LONGEST[follows]:g} s are proved."
    return ""


@dataclass(frozen=True, slots=True)
class _Asked:
    """One robot's flight and what may disturb it."""

    path: Trajectory
    duration: float
    start: tuple[float, float, float]
    vehicle: Vehicle
    disturbance: Disturbance


@lru_cache(maxsize=64)
def _proved(asked: _Asked) -> TrackingBound | BoardBound | str:
    """Return what is proved of a flight, or what stands in the way."""
    vehicle, told = asked.vehicle, asked.disturbance
    try:
        if vehicle.controller != ON_BOARD:
            return prove(model_of(asked.path, asked.duration, asked.start, vehicle, told))
        assert vehicle.autopilot is not None, "else it is lacking"
        offset = float(np.linalg.norm(asked.path.coefficients[0, :3, 0] - np.array(asked.start))) * (1.0 + 1e-12)
        return prove_on_board(vehicle, vehicle.autopilot, told, (asked.path, asked.duration), offset)
    except NotProved as reason:
        return str(reason)


def _within(asked: _Asked, margin: float) -> bool:
    """Return whether a flight is proved to stay within the margin."""
    found = _proved(asked)
    return not isinstance(found, str) and found.bound <= margin


@lru_cache(maxsize=16)
def _advice(team: tuple[_Asked, ...], margin: float) -> str:
    """Return which disturbance is too much, and a share of all that is proved of all robots, near the largest; of a plan that is too fast that it is."""
    ordered = sorted(team, key=lambda asked: _within(asked, margin))  # those that lack it come first
    told = ordered[0].disturbance

    def holds(share: float, only: str | None = None) -> bool:
        return all(_within(_share(asked, share, only), margin) for asked in ordered)

    if not holds(0.0):
        if isinstance(_proved(_hovering(ordered[0])), str):
            return "not even a hover without disturbances is proved"
        return "not even the plan alone is proved within the margin: slow it by `limits`"
    on_board = ordered[0].vehicle.controller == ON_BOARD  # where each trial takes long
    share = _largest(holds, 3 if on_board else _STEPS)
    said = f"{figures(100.0 * share, 3, up=False)} % of these disturbances would hold, for all robots"
    least = _proved(_share(ordered[0], share))
    costs = {} if isinstance(least, str) else least.costs
    dearest = sorted(told.stated, key=lambda name: -max([cost for cause, cost in costs.items() if name in cause], default=0.0))
    tried = dearest[: 0 if on_board else _TRIED]
    one = next((name for name in tried if holds(0.0, name)), None)
    if one is None:
        return said
    part = _largest(lambda some: holds(some, one), _STEPS)
    return f"`{one}` is too much: {_size(one, told.scaled(part, one), part)} would hold beside the others; {said}"


def _largest(holds: Callable[[float], bool], halvings: int) -> float:
    """Return a share that holds, near the largest, where a share of 0 does and 1 does not."""
    low, high = 0.0, 1.0
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def _size(name: str, held: Disturbance, part: float) -> str:
    """Return how much of one disturbance is held, in words."""
    value = getattr(held, name)
    if name == "latency":
        return f"{value[0]:g} to {figures(value[1], 3, up=False)} s"
    if name in _UNITS or name == "centre":
        return f"{figures(value, 3, up=False)} {_UNITS.get(name, 'm')}"
    return (
        f"{figures(100.0 * value, 3, up=False)} %"
        if isinstance(value, float)
        else f"{figures(100.0 * part, 3, up=False)} % of it"
    )


def _share(asked: _Asked, share: float, only: str | None = None) -> _Asked:
    return replace(asked, disturbance=asked.disturbance.scaled(share, only))


def _hovering(asked: _Asked) -> _Asked:
    """Return a short hover at the start in place of a flight, without disturbances."""
    still = np.zeros((1, 4, 8))
    still[0, :3, 0] = asked.start
    return replace(_share(asked, 0.0), path=Trajectory([_HOVER], still), duration=_HOVER)


def _claim(robot: str, asked: _Asked, margin: float, team: tuple[_Asked, ...]) -> Claim:
    found = _proved(asked)
    if isinstance(found, str):
        why = f"{robot}: not proved to stay near its plan under `disturbance`: {found}; {_advice(team, margin)}."
        return _lacked(robot, why, margin)
    within = found.bound <= margin
    bound = figures(found.bound, 4, up=True)
    dearest = sorted(found.costs.items(), key=lambda cost: -cost[1])[:4]
    costs = ", ".join(f"{name} {1000.0 * cost:.1f} mm" for name, cost in dearest if cost > 5e-5)
    on_board = asked.vehicle.controller == ON_BOARD
    set_points = _FLOWN_ON_BOARD if on_board else _set_points(asked.disturbance.setpoints)
    start = _ASSUMED_ON_BOARD if on_board else _start(asked.disturbance.rest)
    assumed = f"Assumed: {start}; {_stated(asked.disturbance)}"
    tight = f"it is tight at {found.time:.2f} s"
    said = " ".join(f"{part}." for part in (costs, assumed) if part)
    if within:
        sentence = f"{robot} stays within {bound} m of its plan under the stated disturbances, {set_points} (margin {margin:.5g} m); {tight}. {said}"
    else:
        advice = "" if asked.disturbance.fitted else f"; {_advice(team, margin)}"  # a margin that is fitted becomes larger
        sentence = (
            f"{robot} is proved to stay within {told_apart(found.bound, margin)} m of its plan, {set_points}; that is more than the margin, "
            f"{margin:.5g} m{advice}. {said}"
        )
    return claim_of(
        "tracking", "holds" if within else "undecided", sentence, robot=robot, unit="m", bound=found.bound, limit=margin,
        margin=margin - found.bound, time=found.time, what="distance from the plan",
    )  # fmt: skip


def _lacked(robot: str, sentence: str, margin: float) -> Claim:
    return claim_of("tracking", "undecided", sentence, robot=robot, unit="m", limit=margin, what="distance from the plan")


def _set_points(told: StreamedSetpoints | None) -> str:
    """Return from which set-points a controller on the ground flies, in words."""
    if told is None:
        return "with set-points, by `geometric` at 50 Hz, that are not rounded"
    units = ("m", "m/s", "m/s^2", "m/s^3", "m/s^4")
    rounded = [f"{size:g} {unit}" for size, unit in zip(told.rounding, units, strict=True) if size]
    rounded += [f"{told.heading:g} rad of heading"] if told.heading else []
    found = f"with set-points, by `geometric`, that are streamed at 50 Hz, {told.age[0]:g} to {told.age[1]:g} s old, "
    found += "with the path's derivatives" if told.orders == 4 else f"without derivatives above the order {told.orders}"
    return f"{found}, {'rounded by at most ' + ', '.join(rounded) if rounded else 'and not rounded'}"


def _start(rest: Unrest | None) -> str:
    """Return which start is assumed, in words."""
    rest = rest or Unrest()
    units = {"speed": "m/s", "tilt": "rad of tilt", "turn": "rad/s", "heading": "rad of heading"}
    found = [f"{size:g} {unit}" for name, unit in units.items() if (size := getattr(rest, name))]
    found += [f"{100.0 * rest.rotors:g} % of each rotor's thrust"] if rest.rotors else []
    start = f"a start within {', '.join(found)} of a hover at rest" if found else "a start at rest in hover"
    return f"{start}, summed errors {f'within {rest.summed:g} m/s^2' if rest.summed else 'zero'}"


def _stated(disturbance: Disturbance) -> str:
    """Return what may disturb a flight, in words; what is zero is left out, but for what was not said."""
    found = [f"{name} {value:g} {unit}" for name, unit in _UNITS.items() if (value := getattr(disturbance, name))]
    found += [f"{name} {100 * value:g} %" for name in _SHARES if (value := getattr(disturbance, name))]
    if disturbance.centre:
        found.append(f"a centre of mass that is {disturbance.centre:g} m off")
    if any(disturbance.latency):
        found.append("latency {:g} to {:g} s".format(*disturbance.latency))
    found.append(f"thrust that changes by at most {100 * disturbance.sag:g} % in the flight")
    found.append(f"rotors that reach {100 * disturbance.battery:g} % of their greatest speed")
    return ", ".join(found)
