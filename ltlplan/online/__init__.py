"""Online flight: teams that share their tasks while they fly (2022 paper, Sections 6 and 7), with dynamics, and certified if asked.

| module | what it holds |
|---|---|
| `flight`, `online_flight` | a mission flown online in simulation, judged afterwards; what came of it |
| `certified`, `team_in_pieces`, `braking`, `next_piece` | the same team flying certified pieces only, how it comes to rest, and what it flies next |
| `live`, `in_air` | that team over a link in real time: the course of its flight, and what is flown and asked meanwhile |
| `stopping`, `what_follows` | how it comes to rest when something happens, and its next piece |
| `standby`, `joining`, `leaving` | robots that wait on the ground, join it and leave it |
| `happenings`, `watching`, `asking` | what happens, its watch, and who computes answers |
| `told` | where events are told: lines of files, of a ROS 2 topic |
| `flown_live`, `seen`, `files` | what measurements show of such a flight, timelines of what was seen, and what is written |

The method itself is in `ltlplan.sharing`. Names are loaded at first use, so that a part of the package can be used by what the
other parts stand on.
"""

from __future__ import annotations

from verify.data.loading import loaded_at_first_use

TYPE_CHECKING = False  # type checkers take it for True
if TYPE_CHECKING:
    from ltlplan.online.certified import CertifiedTeam
    from ltlplan.online.flight import fly_online
    from ltlplan.online.online_flight import OnlineFlight
    from ltlplan.sharing.team import OnlineTeam
    from ltlplan.sharing.team_in_flight import PERIOD, Desired
    from verify.data.events import HoopMoves, NewFormula, ObstacleAppears, RobotJoins, RobotLeaves, WorldEvent

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
    __getattr__, __dir__ = loaded_at_first_use(
        __name__,
        {
            "ltlplan.online.certified": ("CertifiedTeam",),
            "ltlplan.online.flight": ("fly_online",),
            "ltlplan.online.online_flight": ("OnlineFlight",),
            "ltlplan.sharing.team": ("OnlineTeam",),
            "ltlplan.sharing.team_in_flight": ("PERIOD", "Desired"),
            "verify.data.events": ("HoopMoves", "NewFormula", "ObstacleAppears", "RobotJoins", "RobotLeaves", "WorldEvent"),
        },
    )
