"""Online flight: teams whose tasks are reassigned while they fly (2022 paper, Sections 6 and 7), with dynamics, and certified if required.

| module | contents |
|---|---|
| `simulated_online_flight`, `online_flight` | a mission flown online in simulation, checked afterwards; its result |
| `segments` | the same team flying certified segments only, its stops, and what is left of bounds in seconds |
| `live` | that team over a link in real time: stops, handovers, robots that join and leave, the measured result |
| `standby` | robots that wait on the ground until they join |
| `checked_events`, `event_queue` | what can change in the world, checked before take-off; pending events |
| `event_sources` | sources of events: lines of files, of a ROS 2 topic |
| `observed_timelines`, `files` | timelines of observations, and the files that are written |

The method itself is in `ltlplan.online_mtac`. Names are loaded at first use, so that modules below this package can use parts of it.
"""

from __future__ import annotations

from verify.data.names.loading import loaded_at_first_use

TYPE_CHECKING = False  # type checkers take it for True
if TYPE_CHECKING:
    from ltlplan.online.online_flight import OnlineFlight
    from ltlplan.online.segments.certified_team import CertifiedTeam
    from ltlplan.online.simulated_online_flight import fly_online
    from ltlplan.online_mtac.online_team import OnlineTeam
    from ltlplan.online_mtac.team_in_flight import PERIOD, Desired
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
            "ltlplan.online.segments.certified_team": ("CertifiedTeam",),
            "ltlplan.online.simulated_online_flight": ("fly_online",),
            "ltlplan.online.online_flight": ("OnlineFlight",),
            "ltlplan.online_mtac.online_team": ("OnlineTeam",),
            "ltlplan.online_mtac.team_in_flight": ("PERIOD", "Desired"),
            "verify.data.events": ("HoopMoves", "NewFormula", "ObstacleAppears", "RobotJoins", "RobotLeaves", "WorldEvent"),
        },
    )
