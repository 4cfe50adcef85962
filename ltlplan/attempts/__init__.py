"""Plans, and what is tried next where no flight keeps one.

`checked_plan` is a mission's plan as words; with soft parts `soft_parts` says which of them are kept, over `soft_searches`. A plan becomes a
draft, a refused team, a certified one (`drafts`). Where a flight is refused read `mending`: the same words with waits, other precedences,
other words (`other_words`, that keep the same soft parts; `flyable_words`, for which robots have room), or fewer soft parts.
"""
