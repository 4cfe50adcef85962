"""Numbers that are known: exact fractions, intervals, and float polynomials that carry their own error bounds.

Nothing here knows of flights or formulas; every operation is rounded to the safe side or not at all. Read `exact` and
`intervals` first, then `balls` (many polynomials at a time), then `bounds` and `centred`, which find greatest values by
branch and bound.
"""
