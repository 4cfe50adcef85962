"""What several commands share: options, how progress and errors are shown, and spellings of earlier versions.

Read `options` and `flight_options` (what may be said of a mission and of a flight; `choices` lists names, `events` reads changes of
the world), `simulation` (what the commands that simulate do alike), then `terminal` and `progress` (what is shown). `old_spellings`
are those of earlier versions.
"""
