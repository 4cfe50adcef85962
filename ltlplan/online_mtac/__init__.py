"""Online MTAC-E: tasks are shared and paths improved while the robots fly, on the papers' model (2022 paper, Sections 6 and 7).

| module | what it holds |
|---|---|
| `planning_method` | the planning method: a team flown in simulated time until the formula is satisfied, and what came of it as a plan |
| `team_in_flight`, `online_team` | what is known of a team however it is led; Algorithm 5, step by step |
| `pilot`, `path_in_flight`, `path_blending` | one robot: what it still has to do, the way that it flies while that changes, and how it is improved |
| `possible_states`, `formula_progression` | where the letters flown so far may have led, which may come next, and what is left of the formula |
| `initial_allocation` | the run that the team begins with, and its tasks for each robot |
| `task_switching` | which task should change hands |
| `deadlock_resolution` | robots that are led around others or step aside; the ways that they fly then |
| `cross_entropy` | Algorithm 4 |

All of it lies below the pipeline: nothing here knows of vehicles, refinement or the judge. Flights with dynamics, and flights in
certified pieces, are in `ltlplan.online`.
"""
