"""Online MTAC-E: tasks are shared and paths improved while the robots fly, on the papers' model (2022 paper, Sections 6 and 7).

| module | what it holds |
|---|---|
| `simulated` | the planning method: a team flown in simulated time until the formula is satisfied, and what came of it as a plan |
| `team_in_flight`, `team` | what is known of a team however it is led; Algorithm 5, one step at a time |
| `pilot`, `gliding_path` | one robot: what it still has to do, and the way that it flies while that changes |
| `belief`, `residual` | where the letters flown so far may have led, which may come next, and what is left of the formula |
| `sharing_out` | the run that the team begins with, and its tasks for each robot |
| `switch` | which task should change hands |
| `room_to_pass` | ways around robots that hover, and idle robots that step aside |
| `events` | what can change in the world (`verify.data.events`), checked before take-off |
| `cross_entropy` | Algorithm 4 |

All of it lies below the pipeline: nothing here knows of vehicles, refinement or the judge. Flights with dynamics, and flights in
certified pieces, are in `ltlplan.online`.
"""
