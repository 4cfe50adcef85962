"""The judge's own tests put to the test: small faults are planted in `verify`, one at a time, and a test has to notice.

`sites` finds where a fault can be planted and draws some at random; `trial` plants them and runs the tests that reach them;
`equivalent` lists the faults that change nothing, each with its reason. Run `python -m tests.mutation --help`.
"""
