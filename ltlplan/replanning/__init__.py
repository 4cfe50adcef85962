"""Plans, and what is tried next where no flight keeps one.

`checked_plan` is a mission's plan as words; with soft parts `soft_parts` says which of them are kept, over `soft_searches`.
`candidates` has the values of the loop: a candidate is a plan and the cuts that led to it, and becomes a flight or a conflict. Where a flight is
refused `next_candidate` decides on the next candidate: the same words with waits (`repair_precedences`), other precedences, other words (`k_best_alternatives`, that keep the same
soft parts; `conflict_alternatives`, for which robots have room), fewer soft parts. `faster_flights` plans at a higher speed where a flight outlasts
a vehicle's endurance.
"""
