"""Online flight: teams that share their tasks while they fly (2022 paper, Sections 6 and 7), with dynamics, and certified if asked.

| module | what it holds |
|---|---|
| `flight`, `online_flight` | a mission flown online in simulation, judged afterwards; what came of it |
| `certified`, `braking` | the same team flying certified pieces only, and how it comes to rest |
| `files` | what such a flight writes |

The method itself is in `ltlplan.sharing`. Names are loaded at first use, so that a part of the package can be used by what the
other parts stand on.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ltlplan.online.certified import CertifiedTeam
    from ltlplan.online.flight import fly_online
    from ltlplan.online.online_flight import OnlineFlight
    from ltlplan.sharing.team import OnlineTeam
    from ltlplan.sharing.team_in_flight import PERIOD, Desired
    from verify.data.events import HoopMoves, NewFormula, ObstacleAppears, RobotJoins, RobotLeaves, WorldEvent

_HOMES = {
    "PERIOD": "ltlplan.sharing.team_in_flight",
    "CertifiedTeam": "ltlplan.online.certified",
    "Desired": "ltlplan.sharing.team_in_flight",
    "HoopMoves": "verify.data.events",
    "NewFormula": "verify.data.events",
    "ObstacleAppears": "verify.data.events",
    "OnlineFlight": "ltlplan.online.online_flight",
    "OnlineTeam": "ltlplan.sharing.team",
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
    "ObstacleAppears",
    "OnlineFlight",
    "OnlineTeam",
    "RobotJoins",
    "RobotLeaves",
    "WorldEvent",
    "fly_online",
]


if not TYPE_CHECKING:  # which know all names from above, so that a misspelt one is an error to them

    def __getattr__(name: str) -> object:
        if name not in _HOMES:
            raise AttributeError(f"module 'ltlplan.online' has no attribute '{name}'")
        return getattr(importlib.import_module(_HOMES[name]), name)
