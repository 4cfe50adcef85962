"""Cycles of one robot and of teams: plans that go on for ever.

Read `planning` first, the entry. `conjunct_assignment` needs no product of robots where the formula's parts can be given to one robot each, as to a
single robot all: it flies its cheapest `lasso`, of the parts that `strong_components` tells apart. All else goes
through `cheapest_cycles`: `reading` searches the product of all robots (`team_system`) among `cycle_places`; `team_readers` and `cycle_effects` say
how formulas read it, `bounds` what is least left. `team_cycles` puts moves into stages and holds the result.
`resting_actions` refuses cycles without a flight.
"""
