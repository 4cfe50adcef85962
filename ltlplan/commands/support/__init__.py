"""Common parts of commands: options, how progress and errors are shown, and spellings of earlier versions.

Read `options` and `flight_options` (what may be said of a mission and of a flight; `choices` lists names, `events` reads changes of
the world), `simulation` (what the commands that simulate do alike), then `terminal`, `progress` (what is shown) and `stopped_search` (ended by a key). `old_spellings`
are those of earlier versions.
`links`, `live_flight`, `live_online` and `live_view` belong to live flights, `followed` to their event sources and `onlookers` to services that see them; `machines` and `processors`
say where work is done. `installation` is what `doctor` finds.
"""
