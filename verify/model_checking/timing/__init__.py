"""Formulas with bounds in seconds, checked on label timelines for every flight in the tube.

`instants` computes with sets of times, `team_instants` says at which times a Boolean combination surely holds, `timed_formula` at which
times a formula does (Maler and Nickovic 2004, on three values), and `timed_verdict` makes a verdict with its slack of it; `timed_reasons` says
why there is none. `laps` repeats sets of times for ever.
"""
