"""What several commands share: options, how progress and errors are shown, and spellings of earlier versions.

Read `options` and `flight_options` (what may be said of a mission and of a flight), then `terminal` and `progress` (what is shown).
"""
