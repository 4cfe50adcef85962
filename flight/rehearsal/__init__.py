"""Rehearsals: a flight by several controllers, with masses, latencies and winds that may be, before it is flown for real.

Read `combinations`; `table` is what it finds, `batches` the flights, side by side. `corners` flies the ends of what is not known, `hunt` winds that are aimed.
"""
