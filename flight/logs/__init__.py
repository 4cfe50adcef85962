"""Flights on disk: logs that we write and read back, and recordings that others made.

`log` is the value and `tables` its files (`mcap_file` for viewers; `large_logs` keeps those of many robots small);
`recordings` reads motion-capture tables of real flights.
"""
