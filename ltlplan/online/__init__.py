"""Online MTAC-E: tasks are shared and paths improved while the robots fly (2022 paper, Sections 6 and 7).

| module | what it holds |
|---|---|
| `flight` | a mission flown online in simulation, judged afterwards |
| `team` | Algorithm 5, one step at a time |
| `certified`, `residual`, `braking` | the same team flying certified pieces only: what is left, and how to come to rest |
| `pilot`, `course` | one robot: what it still has to do, and the way that it flies while that changes |
| `progress` | where the letters flown so far may have led, and which may come next |
| `switch` | which part should change hands |
| `events` | what can change in the world (`verify.data.events`), checked before take-off |
| `cross_entropy` | Algorithm 4 |

Names are loaded at first use, so that a part of the package can be used by what the other parts stand on.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ltlplan.online.certified import CertifiedTeam
    from ltlplan.online.flight import OnlineFlight, fly_online
    from ltlplan.online.team import PERIOD, Desired, OnlineTeam
    from verify.data.events import HoopMoves, NewFormula, RobotJoins, RobotLeaves, WorldEvent

_HOMES = {
    "PERIOD": "ltlplan.online.team",
    "CertifiedTeam": "ltlplan.online.certified",
    "Desired": "ltlplan.online.team",
    "HoopMoves": "verify.data.events",
    "NewFormula": "verify.data.events",
    "OnlineFlight": "ltlplan.online.flight",
    "OnlineTeam": "ltlplan.online.team",
    "RobotJoins": "verify.data.events",
    "RobotLeaves": "verify.data.events",
    "WorldEvent": "verify.data.events",
    "fly_online": "ltlplan.online.flight",
}

__all__ = [
    "PERIOD",
    "CertifiedTeam",
    "Desired",
    "HoopMoves",
    "NewFormula",
    "OnlineFlight",
    "OnlineTeam",
    "RobotJoins",
    "RobotLeaves",
    "WorldEvent",
    "fly_online",
]


def __getattr__(name: str) -> Any:  # the values have as many types as there are names
    if name not in _HOMES:
        raise AttributeError(f"module 'ltlplan.online' has no attribute '{name}'")
    return getattr(importlib.import_module(_HOMES[name]), name)
