"""The cheapest way to satisfy a formula for ever: a prefix and a cycle.

Read `lasso`; `rounds` finds the cheapest cycle that shows every mark, and `word_lasso` is for automata that choose.
"""
