"""From what robots must, may or must not show over time to what a team's words can be, in every order.

Read `timeline` first (the value that `verify.motion` makes of a path), then `robot_letters` and `team_graph` (all words of one
robot, of a team). Then what holds them against the formula: the room `compositional` for robots that are read one at a time; `inclusion` for
all of them together, and for counterexamples; `lassos` for laps, `team_laps` for those of teams; and `word_claims`, which puts the
answers into claims, a formula's by `formula_judge` (what it sees of robots: `letter_projection`). `transitions` judges edges; `refutation` says why not.
The room `timing` decides what a formula bounds in seconds. `bad_prefixes` refutes infinite formulas early, `summed_timelines` counts over time, and `counterexamples`, `reading_times` and `vacuous_parts`
write the words for people.
"""
