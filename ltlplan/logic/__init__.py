"""Automata from formulas.

Read `automata` (the door: LTLf and LTL to automata, translated behind `spot_engine`), then `conjunction`, which keeps large
formulas as products that are made as they are walked, over letters as `decision_diagrams`, made deterministic by
`determinisation`. `decomposition` finds where the rest may be handed to another robot, `transition_monoid` what words do to a
task, and `budget` is how much a search may take.
"""
