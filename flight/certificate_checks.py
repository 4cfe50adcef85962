"""Certificates at the doors of `flight`: of this mission and these trajectories, of sound values, and with a tube to fly in."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from verify.certificate import Certificate
from verify.data import BadInput, Mission, NotCertified, Plan, Trajectory, check_mission


def certified_mission(cert: Any) -> Mission:  # of any type: whether it is a certificate is found out here
    """Return the mission that a certificate is of, after every check that a mission's file undergoes.

    Raises:
        BadInput: It is no certificate, or one whose values make no sense.
    """
    try:
        numbers = {"margin": cert.margin, "duration": cert.duration}
        mission, claims, covers = cert.mission, [claim.outcome for claim in cert.claims], cert.covers
    except (AttributeError, TypeError):
        raise BadInput(f"A certificate is what `verify.certify` returns, not {type(cert).__name__}.") from None
    for name, value in numbers.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < math.inf:
            raise BadInput(f"The certificate's {name} must be a number of at least 0, not {value!r:.40}.")
    if not claims or not callable(covers):
        raise BadInput("The certificate has no claims, so nothing is certified.")
    return check_mission(mission, to_plan=False)


def require_certificate(cert: Certificate, plan: Plan, team: Mapping[str, Trajectory]) -> None:
    """Reject a certificate that is not of this plan's mission and these trajectories, or leaves no tube to fly in.

    Args:
        cert: What `verify.certify` returned.
        plan: The plan that is flown.
        team: One trajectory a robot.

    Raises:
        BadInput: It is no certificate, or its margin is 0.
        NotCertified: It is of something else, or a claim of it does not hold.
    """
    mission = certified_mission(cert)
    if not cert.covers(team):
        raise NotCertified("the certificate does not cover these trajectories; fly what was certified, or without it.")
    if mission.digest() != plan.mission.digest():
        raise NotCertified("the certificate is of another mission than the plan's; fly what was certified, or without it.")
    require_tube(cert.margin)


def require_tube(margin: float) -> None:
    """Reject to fly in closed loop with a margin of 0, whose tube every flight leaves.

    Raises:
        BadInput: The margin is 0.
    """
    if margin == 0:
        raise BadInput(
            "A margin of 0 m leaves no tube to fly in: no vehicle, simulated or not, stays exactly on its polynomials. Ask for a "
            "margin above 0, such as 0.05 (`margin:` in the mission, or --margin); planning and certifying go without one."
        )
