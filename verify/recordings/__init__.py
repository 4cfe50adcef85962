"""Flights that were flown, judged from their samples: what must, may or cannot have happened between them.

Read `flight_reference` (what a recording is held against), `flight_log` (tables, read exactly or refused) and `reachable_sets` (where a robot can
have been between samples), then `flight_verdict` and `recorded_flight`, which calls one module a claim: `tube`, `temporal_claims`, `recorded_visits`, `actions`,
`geometric_claims`. `planned_paths` says where the plan was at any instant, `alignment` when the flight began, and `measurement` how well samples
are known; `samples` judges formulas without a plan, by `sampled_timelines`.
`uncertain_start` judges claims for every start that is left open; `recorded_laps` judges the first of endless cycles.
"""
