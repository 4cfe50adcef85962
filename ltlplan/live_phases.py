"""A certified flight with what comes before and after it, ready to be flown over a link.

A patrol's laps that end in full flight get a braking behind them, as exports write it: proved, and of no word that the laps do not begin with. It is looked for
such that it fits the vehicle's memory beside the laps, uncompressed or compressed; where neither fits, for vehicles that are streamed to.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from flight.exports.braking import AtMost, Join, brakings, ends_in_flight
from flight.exports.crazyflies.compressed import COMPRESSED
from flight.link.phases import FLIGHT, Stage
from ltlplan.transfers import Place, to_ground, to_starts
from verify.certificate import Certificate
from verify.data import BadInput, DoesNotFit, Infeasible, NotCertified, Plan, Trajectory
from verify.data.progress import Progress, part_of


def stages(
    plan: Plan,
    team: Mapping[str, Trajectory],
    cert: Certificate,
    places: Mapping[str, Place],
    *,
    progress: Progress | None = None,
) -> tuple[Stage, ...]:
    """Return climb, way, the flight itself, and landing (home first where they cannot land where they end), each certified.

    Args:
        plan: What the team flies.
        team: Its trajectories.
        cert: Their certificate.
        places: Where each robot stands, x, y and z in m.
        progress: Receives a sentence and the share done, 0 to 1.

    Raises:
        BadInput: A robot has no place or stands where no flight can begin.
        Infeasible: There is no way to the starts or home.
        NotCertified: One of these flights is not certified, or no braking behind laps that end in full flight.
    """
    before = to_starts(plan.mission, team, places, progress=part_of(progress, 0.0, 0.5))
    for braking in _brakings(plan, team, cert):
        flown = Stage(FLIGHT, plan, team, cert, braking)
        try:
            after = to_ground(plan.mission, flown.paths, places, progress=part_of(progress, 0.5, 1.0))
        except (BadInput, Infeasible, NotCertified):
            if not braking:
                raise
            continue
        return (*(transfer.stage for transfer in before), flown, *(transfer.stage for transfer in after))
    name, path = next((name, path) for name, path in team.items() if ends_in_flight(path))
    speed = float(np.linalg.norm(path.evaluate(path.duration, 1)[:3]))
    raise NotCertified(
        f"{name} ends its last lap at {speed:.2f} m/s, and no braking behind it was proved from which it can land: nothing can follow it."
    )


def _brakings(plan: Plan, team: Mapping[str, Trajectory], cert: Certificate) -> Iterator[dict[str, Trajectory]]:
    """Yield ways to brake behind the last lap: of the robot whose laps end in full flight all laps with a proved braking; nothing where all end at rest."""
    name = next((name for name, path in team.items() if ends_in_flight(path)), None)
    if name is None:
        yield {}
        return
    mission = plan.mission.model_copy(update={"margin": float(cert.margin)})
    held = mission.limits_of(name).pieces
    joins: tuple[Join, ...] = (AtMost(held), _compressed, AtMost(None)) if held is not None else (AtMost(None),)
    for join in joins:
        found = None
        for found in brakings(mission, name, team[name], join):
            yield {name: found.flown}
        if found is not None:
            return


def _compressed(name: str, flown: Trajectory, last: Trajectory) -> Trajectory | None:
    """Return laps that lie on board compressed with the braking behind them; None where they do not."""
    assert COMPRESSED.join is not None
    try:
        return COMPRESSED.join(name, flown, last)
    except DoesNotFit:
        return None
