"""The kernel: a small checker of proofs about flights, in whole numbers, that uses nothing but Python's standard library.

Read `statement` (what is to be proved), `trees` (the rule that most rests on), `flights`, and `checking`. It calls the rest for each claim: `zones`,
`timelines`, `limits`, and for words `formulas` (`timing`: bounds in seconds), `team` (robots' moves), `words` (the invariant). `__main__` prints.
"""

VERSION = 6  # raised whenever what is checked, or how it is written down, changes its meaning
