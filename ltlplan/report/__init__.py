"""Reports of plans and flights: the text that closes a run, and pages that open from their file alone.

Begin with `summary`, the words, and `brief`, those that fit a screen; then `run_page`, the page of a run, from its answer down to its notes.
`campaign`, `online` and `pictures` (with `hoop_figures`, the 2019 paper's) are the other pages, `audit_report` that of flights that others planned.
All are put together by `page`, which carries everything inside itself (`inline`). `player` is for the scene that plays, `charts`, `over_time` and
`bars` for what lasts, and `history` for what a sampled flight says over time. `audit_report`, `rehearsal` and `recorded_page` are pages of audits,
rehearsals and recorded flights. `replay` makes a flight ready to be played, `views` draws it from above and from two sides, and `crowds` lightens
scenes of many robots.
"""
