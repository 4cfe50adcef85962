"""A certified flight with what comes before and after it, ready to be flown over a link."""

from __future__ import annotations

from collections.abc import Mapping

from flight.link.stages import FLIGHT, Stage
from ltlplan.transfers import Place, to_ground, to_starts
from verify.certificate import Certificate
from verify.data import Plan, Trajectory
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
        progress: Told a sentence and the share done, 0 to 1.

    Raises:
        BadInput: A robot has no place or stands where no flight can begin, or the flight does not end at rest.
        Infeasible: There is no way to the starts or home.
        NotCertified: One of these flights is not certified.
    """
    before = to_starts(plan.mission, team, places, progress=part_of(progress, 0.0, 0.5))
    after = to_ground(plan.mission, team, places, progress=part_of(progress, 0.5, 1.0))
    flown = Stage(FLIGHT, plan, team, cert)
    return (*(transfer.stage for transfer in before), flown, *(transfer.stage for transfer in after))
