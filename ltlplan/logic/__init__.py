"""Automata from formulas.

Read `translation` (the entry point: from LTLf and LTL to an `automaton`), then `conjunction`, which keeps large formulas as products that are made
as they are walked. `small_automata` calls Spot through its adapter `spot_engine`, and `determinisation` makes automata deterministic and
smallest. Conditions on letters are `decision_diagrams`. `product_automaton` is the same product for searches, by number
(`conjunct_automata`); `transition_monoid` holds the effects of words on it, and `budget` limits searches. `decomposition` finds where the rest of a
task may be reassigned to another robot. `signed_parts` says whether a formula may gain as a part becomes true, or false.
"""
