"""Formulas as text, and words as letters.

`formula_reader` makes a `formula` of linear temporal logic of its `formula_tokens` (`free`: what the name of that stands for) and
`sequence` reads passages through hoops, each with our own grammar; `word` is what a flight says.
`counting` writes out formulas that count robots, `relaxation` leaves out bounds in seconds, `lasting` tells regions that may never be left or entered; `formula_error` says what is wrong with a formula's text.
"""
