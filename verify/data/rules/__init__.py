"""What a mission's values must keep beyond their types, each fault in words and at its place.

`faults` finds what is wrong within single sections, `missions` holds what spans several keys, `agents` what starts and ends must
keep; `spacing` and `passage_room` are the rules of distance that planner, refinement and judge share.
"""
