"""Claims of a certificate about paths: each a sentence, its exact bound, and where it is tight or violated.

Read `claim` (the value) and `evidence` (properties of a team's paths at every margin, computed once). The others check the evidence against the
mission: `limit_claims` (limits and continuity, whatever the margin), `distance_claims` (workspace, separation and rims), `obstacle_claims`,
`visit_claims` (visits and passages) and `order_claims` (precedences and meetings, and the words under them). `braking_claims`, `part_claims` and
`soft_claims` are about braking, parts of a flight, and soft specifications; `tracking_claims` about the margin that robots keep. `flown_visits` encloses times of events, and `judged_plan` lists the
proved fields of a plan.
"""
