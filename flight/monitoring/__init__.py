"""Monitoring of a flight while it is flown.

`monitor` puts together whether robots are in their tubes (`tube`), which letters they show (`letters`) and what has become of
the formula (`formula_state`); `alarm_response` is what a team does then.
`thresholds` holds the numbers that live flights and exported scripts are checked by.
"""
