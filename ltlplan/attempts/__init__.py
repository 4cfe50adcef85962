"""Plans, and what is tried next where no flight keeps one.

`checked_plan` is a mission's plan as words; with soft parts `soft_parts` says which of them are kept, over `soft_searches`.
`drafts` has the values of the loop: a candidate is a plan and the cuts that led to it, and becomes a flight or a conflict. Where a flight is
refused `mending` decides on the next candidate: the same words with waits, other precedences, other words (`other_words`, that keep the same
soft parts; `flyable_words`, for which robots have room), fewer soft parts. `faster_flights` plans at a higher speed where a flight outlasts
a vehicle's endurance.
"""
