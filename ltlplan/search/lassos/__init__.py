"""The cheapest way to satisfy a formula for ever: a prefix and a cycle, of one robot or of a team whose laps begin together.

For one robot read `laps` (the door) and `lasso`; `accepting_cycles` finds the cheapest cycle that shows every mark, with bounds by `order_bounds`, and `word_lasso`
is for automata that choose. For teams `team_laps` is the door. `conjunct_assignment` needs no product where the formula's parts can be given to one robot each; else
`product_search` searches the product of all robots (`team_system`), and how it is read (`team_readers`), and proves that no laps are cheaper; what a lap does to an
automaton is its effect (`lap_effects`). What may be done at the same time is found by `concurrent_cycle_steps`. Where that search does not come to its end, `team_lassos`
finds good laps, with few robots flying first (`incremental_teams`).
`strong_components` finds where a graph has cycles, `memoryless_automata` forgets all but the last letter, `resting_actions` refuses cycles without
a flight, and `team_itineraries` turns a team's cycles into visits.
"""
