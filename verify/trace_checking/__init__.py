"""Trace checking: whether a word, or the words of a team, given as text or sets, satisfy a formula.

`word_verdict` is `check_word` and `team_verdict` is `check_team`. `orders` looks for an order of robots that violates a formula, over the graph that
`word_graph` makes of their words. `ordered_verdict` is `check_ordered`, of words with precedences between their events, over `ordered_graph`.
`conjunct_by_conjunct` is common to all claims. `planned_order` checks a plan's words under its own waits; `counterexamples` writes violating
words as verdicts.
"""
