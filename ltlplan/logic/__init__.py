"""Automata from formulas.

Read `translation` (the door: from LTLf and LTL to an `automaton`), then `conjunction`, which keeps large formulas as products
that are made as they are walked; `small_automata` asks Spot, behind its door in `spot_engine`, and `determinisation` makes
deterministic and smallest. Conditions on letters are `decision_diagrams`. `product_automaton` is the same product for searches, by
number (`conjunct_automata`), `transition_monoid` what words do to it, and `budget` how much a search may take. `decomposition` finds where the rest may be
handed to another robot.
"""
