"""Accuracy of samples: bounds on speed and error, digits that were lost, and what is rejected as no flight at all."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from verify.data.errors import BadInput

Floats = NDArray[np.float64]

_MOST = 1e9
"""Greatest speed (m/s) and error (m) that are taken for meant; beyond them, floats would overflow and prove nothing."""

_BLIND = 0.25
"""s; who was not seen for longer is named."""

LARGEST = 1e12
"""Greatest coordinate (m) and time (s), likewise."""


def with_rounding(
    error: float, speed: float, rounding: tuple[float, float], times: Floats, positions: Iterable[Floats]
) -> float:
    """Return the error with what times and positions lost in digits and floats: a time off by s is a position off by speed s.

    Args:
        error: Bound on the distance between measured and true position, m.
        speed: Bound on the speed, m/s.
        rounding: How far times (s) and positions (m) may be off.
        times: s. Shape (n,).
        positions: m, of at least one robot; NaN where it was not seen. Shape (n, 3) each.

    Returns:
        m.

    Raises:
        BadInput: The rounding is no time and length.
    """
    late, off = rounding
    if not (0 <= late <= _MOST and 0 <= off <= _MOST):
        raise BadInput(f"rounding must be a time in s and a length in m, from 0 to {_MOST:g}, not {rounding!s:.40}.")
    late += float(np.spacing(np.max(np.abs(times))))
    off += 2 * float(np.spacing(max(np.nanmax(np.abs(places), initial=0.0) for places in positions)))
    return error + (off + speed * late) * (1 + 1e-9)


def require_error(error: float) -> None:
    """Reject what is no bound on a measured position's error, m.

    Raises:
        BadInput: It is no number, negative, or too large.
    """
    if isinstance(error, bool) or not isinstance(error, int | float) or not 0 <= error <= _MOST:  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
        raise BadInput(f"error must be a length in m, from 0 to {_MOST:g}, not {str(error)[:40]}.")


def require_speed(max_speed: float | None) -> float:
    """Return a bound on the speed, m/s, or refuse what is none.

    Raises:
        BadInput: There is none, or it is no number, not above 0, or too large.
    """
    if max_speed is None:
        raise BadInput("A sampled path proves nothing without a speed bound: give max_speed (--max-speed) in m/s.")
    if isinstance(max_speed, bool) or not isinstance(max_speed, int | float) or not 1 / _MOST <= max_speed <= _MOST:  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
        raise BadInput(
            f"max_speed must be a speed in m/s, from {1 / _MOST:g} (so above 0) to {_MOST:g}, not {str(max_speed)[:40]}."
        )
    return float(max_speed)


def unseen_sentence(robot: str, times: Floats, start: float, stop: float) -> str:
    """Say for how long a robot was not seen at the most; nothing where that is too short to be told.

    Args:
        robot: Name.
        times: When it was seen, s. Shape (n,).
        start: From when on it is checked, s.
        stop: Until when, s.
    """
    seen = times[(times > start) & (times < stop)]
    ends = np.concatenate([[start], seen, [stop]])
    longest = int(np.argmax(np.diff(ends)))
    gap = float(ends[longest + 1] - ends[longest])
    return f"{robot} was not seen for {gap:.2f} s, from {ends[longest]:.2f} s on." if gap > _BLIND else ""


def longest_gaps(times: Floats) -> Floats:
    """Return upper bounds on the times between samples, whose clock was set to 0 with one rounding each."""
    return np.nextafter(np.diff(times), np.inf) + np.spacing(times[1:])
