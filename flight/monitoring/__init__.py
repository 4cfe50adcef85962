"""Monitoring of a flight while it is flown.

`monitor` combines three checks: robots in their tubes (`tube`), their letters (`letters`) and the formula's state (`formula_state`;
of what it bounds in seconds `timed_state`, and of sampled flights `sampled_bounds`).
`alarm_response` is the team's response to an alarm. `thresholds` holds the numbers that live flights and exported scripts are checked by.
"""
