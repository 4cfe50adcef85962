"""What a mission's values must keep beyond their types, each fault in words and at its place.

`faults` finds what is wrong within single sections, `missions` holds what spans several keys, `agents` what starts and ends must
keep, `notes` what is allowed and may yet not be meant; `spacing` (mission files, refinement) and
`passage_room` (planner, refinement) are rules of distance that several share; the judge has its own.
`clocks`, `kinds` and `obstacles` check clock errors, robot types and obstacles.
"""
