"""What robots can do, step by step: the transition systems and products of the 2022 paper.

Read `transition_systems` (R, E and A = E x R) and `products` (P and T). `region_labels` says which letters a straight flight
shows; `drawings` shows automata and systems.
"""
