"""The claims of a certificate about paths: each a sentence, its exact bound, and where it is tight or broken.

Read `claim` (the value) and `evidence` (what is known of a team's paths at every margin, computed once). The others hold the
evidence against what is asked: `limit_claims` (limits and continuity, whatever the margin), `distance_claims` (workspace,
separation and rims), `obstacle_claims`, `visit_claims` (visits and passages) and `order_claims` (precedences
and meetings, and the words under them).
`braking_claims`, `part_claims` and `soft_claims` say what is claimed of braking, of parts of a flight, and of soft parts. `flown_visits` encloses times of events, and `judged_plan`
lists what of a plan is proved.
"""
