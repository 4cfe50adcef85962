"""The doors for words as text or sets: whether a word, or the words of a team, satisfy the formula.

`word_verdict` is `check_word` and `team_verdict` is `check_team`. `orders` looks for an order of robots that breaks a
formula, over the graph that `word_graph` makes of their words. `ordered_verdict` is `check_ordered`, of words with precedences
between their events, over `ordered_graph`. What claims have in common is in `conjunct_by_conjunct`.
`planned_order` judges a plan's words under its own waits; `counterexamples` writes broken words as verdicts.
"""
