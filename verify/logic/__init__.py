"""Satisfaction of formulas by words: the checker's own semantics, with Spot's second opinion.

Read `semantics` (the definition, letter by letter), `normal_form` (negations at the names, equal parts once) and `progression` (the definition
again, as formulas that shrink while a word is read). `spot_opinion` queries an independent engine within what `tableau_size` allows. `verdict` is
the result, `explanation` puts it into words, and `vacuity` finds formulas that hold vacuously. `team_letters` reads the letters that all robots
hold at one time.
"""
