"""The claims of a certificate about paths: each a sentence, its exact bound, and where it is tight or broken.

Read `claim` (the value) and `evidence` (what is known of a team's paths at every margin, computed once). The others hold the
evidence against what is asked: `limit_claims` (limits and continuity, whatever the margin), `distance_claims` (workspace,
separation and rims), `obstacle_claims`, `visit_claims` (visits and passages) and `order_claims` (precedences
and meetings, and the words under them).
"""
