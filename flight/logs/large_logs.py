"""Logs of many robots, made light enough to be kept and read: files of a run stay below 20 MB.

A log has an entry of each robot every 10 ms. Up to 60 000 entries are written whole. Of more, a file keeps what is flown, to 0.1 mm,
1 mm/s and 1 mrad, and leaves out what rotors gave and motion capture saw; and where they are more than 200 000, every second time, every third
and so on, the first and the last always. A verdict on such a file stays one for all times: between two of its rows a robot can have been
wherever the bound on its speed lets it, be they 10 ms or 20 ms apart. Digits were spared before times: a tenth of a millimetre tells less of where a
robot was than 10 ms of flight.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from flight.logs.log import FlightLog

WHOLE = 60_000
"""Entries, samples times robots, up to which a log is kept whole: about 17 MB as CSV."""

MOST = 200_000
"""Entries that a lightened log has, at the most."""

MOST_BYTES = 20_000_000

_DECIMALS = {"position": 4, "velocity": 3, "attitude": 3, "thrust": 4, "rates": 2, "error": 4}


def run_csv(log: FlightLog) -> str:
    """Return the text of `flight.csv` as run folders keep it: `FlightLog.to_csv`, of `lightened` where there are many robots."""
    kept = lightened(log)
    text = kept.to_csv()
    while kept is not log and len(text) > MOST_BYTES:  # letters with long names
        kept = lightened(log, most=len(kept) * len(kept.robots) * 9 // 10)
        text = kept.to_csv()
    return text


def lightened(log: FlightLog, *, most: int = MOST) -> FlightLog:
    """Return a log with fewer times, columns and digits where it is large; the same log where it is not.

    Args:
        log: Any log.
        most: Entries, samples times robots, to which it is thinned; its first and last times are kept.
    """
    entries = len(log) * len(log.robots)
    if entries <= WHOLE:
        return log
    kept = np.unique([*range(0, len(log), math.ceil(entries / most)), len(log) - 1])
    rounded = {name: np.round(getattr(log, name)[kept], digits) + 0.0 for name, digits in _DECIMALS.items()}  # no -0
    letters = tuple(log.letters[i] for i in kept)
    return dataclasses.replace(
        log, times=log.times[kept], letters=letters, rotors=None, measured=None, estimated=None, **rounded
    )
