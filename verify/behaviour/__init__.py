"""From what robots must, may or cannot show over time to what a team's words can be, in every order.

Read `timeline` first (the value that `verify.motion` makes of a path), then `robot_letters` and `team_graph` (all words of one
robot, of a team), then `inclusion` and `lassos`, which hold them against the formula, and `word_claims`, which puts them into
claims. `transitions` judges edges; `refutation` and `mending_waits` say why not, and what
would help.
"""
