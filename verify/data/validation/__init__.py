"""Rules for a mission's values beyond their types, each validation error in words and at its place.

`faults` finds what is wrong within single sections, `missions` holds what spans several keys, `agents` what starts and ends must
keep; `spacing` is a rule of distance that mission files and refinement share; the judge has its own.
`clocks`, `kinds` and `obstacles` check clock errors, robot types and obstacles.
"""
