"""Recorded flights, checked from their samples: what must, may or must not have happened between them.

Read `flight_reference` (what a recording is compared with), `flight_log` (tables, read exactly or rejected) and `reachable_sets` (possible positions
between samples). Then `flight_verdict` and `recorded_flight`, which calls one module a claim: `tube`, `temporal_claims`, `recorded_visits`,
`actions`, `geometric_claims`. `planned_paths` gives the plan's position at any instant, `alignment` the start of the flight, and `measurement`
bounds the samples' errors. `samples` checks formulas without a plan, by `sampled_timelines`. `uncertain_start` checks claims for every possible
start, `recorded_laps` the first of endless cycles.
"""
