"""Plans, and what is tried next where no flight keeps one.

`checked_plan` is a mission's plan as words, at a higher speed where a flight outlasts a vehicle's endurance; with soft parts `soft_parts` says which
of them are kept. `cuts` has the values of the loop: a candidate is a plan and the cuts that led to it. It becomes a flight or a conflict, of which
`refusal` tells the reason (`narrow_rooms`: where a room leaves hardly any way). `alternatives` is the stream of candidates. What is refused of one decides on the next, by a list of alternatives. These
are precedences (`ltlplan.search.orders.planned_words`), other words where robots have room (`conflict_alternatives`), places in free flight to step aside to (`stepping_aside`), other words for soft parts, or
fewer of these (`soft_alternatives`). The room `timing` chooses times for what is bounded in seconds.
"""
