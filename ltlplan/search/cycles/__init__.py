"""The cheapest way to satisfy a formula for ever: a prefix and a cycle, of one robot or of a team whose cycles begin together.

Read `planning`, the entry. For one robot `lasso` walks over the product of its system and automata; `accepting_cycles` finds its cheapest cycle that shows every mark,
and `word_lasso` serves automata that choose. For a team `conjunct_assignment` needs no product where the formula's parts can be given to one robot each; else
`cheapest_cycles` searches the product of all robots (`team_system`) and proves that no cycles are cheaper: `reading` says what follows what, over the places that cycles
may pass (`cycle_places`), and what a cycle does to the automata (`cycle_effects`), which read the team as `team_readers` say.
`concurrent_cycle_steps` finds what may be done at the same time, `team_cycles` holds the answer, and `team_itineraries` turns it into visits.
`strong_components` finds where a graph has cycles, `memoryless_automata` forgets all but the last letter, and `resting_actions` refuses cycles without a flight.
"""
