"""Satisfaction of formulas by words: the checker's own semantics, with Spot's second opinion.

Read `semantics` (the definition, letter by letter), `normal_form` (negations at the names, equal parts once) and `progression`
(the definition again, as formulas that shrink while a word is read); `spot_opinion` asks an independent engine the same question
within what `tableau_size` allows. `verdict` is the value that answers, `explanation` puts it into words, and `vacuity` says when a
formula holds for no good reason.
`team_letters` reads the letters that all robots hold at one time.
"""
