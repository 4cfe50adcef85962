"""Expectation of a quantity: an interval with the reason for its width, a text, or a check that holds."""

from __future__ import annotations

import math
from dataclasses import dataclass

EXACT = "no rounding changes it: the last digit shown"
DRAWN = "found by sampling: another libm may round the last bit of a cost otherwise, 3 %"
FLOWN = "a simulated flight, whose last bits grow over thousands of steps, 15 %"
TIMED = "a time of computing: any machine"
SLOWED = "slowed where the simulated flight strays, from the fastest flight at the least to the plan's own times at the most"
ROUNDS = "rounds until a search stops: one sample more or less below the limit, 25 %"


@dataclass(frozen=True, slots=True)
class Expectation:
    """Expectation of a quantity.

    Attributes:
        low, high: Ends of the interval of a number.
        text: What a text must be; None for a number or a check.
        why: Reason for the width.
    """

    low: float = math.nan
    high: float = math.nan
    text: str | None = None
    why: str = ""

    def admits(self, ours: float | bool | str) -> bool:
        """Return whether a quantity is as expected.

        Args:
            ours: As computed.
        """
        if isinstance(ours, bool):
            return ours and math.isnan(self.low) and self.text is None
        return ours == self.text if isinstance(ours, str) else self.low <= ours <= self.high

    def shown(self, digits: int) -> str:
        """Return the interval in words; nothing for a check.

        Args:
            digits: Digits behind the point.
        """
        if self.text is not None:
            return "this text"
        if math.isnan(self.low):
            return ""
        if self.why == EXACT:
            return f"{(self.low + self.high) / 2:.{digits}f}"
        if self.why == TIMED:
            return f"below {self.high:g}" if self.low <= 0.0 else f"{self.low:g} to {self.high:g}"
        return f"{self.low:.{digits}f} to {self.high:.{digits}f}"


def exact(value: float, digits: int = 2) -> Expectation:
    """Return what no rounding changes.

    Args:
        value: As it is shown.
        digits: Digits behind the point that are shown.
    """
    half = 0.5000001 * 10**-digits
    return Expectation(value - half, value + half, why=EXACT)


def drawn(value: float) -> Expectation:
    """Return what sampling finds.

    Args:
        value: As it is shown.
    """
    return _about(value, 0.03, DRAWN)


def flown(value: float) -> Expectation:
    """Return what a simulated flight shows.

    Args:
        value: As it is shown.
    """
    return _about(value, 0.15, FLOWN)


def rounds(value: float) -> Expectation:
    """Return a number of rounds.

    Args:
        value: How many.
    """
    return _about(value, 0.25, ROUNDS)


def timed(most: float, least: float = 0.0) -> Expectation:
    """Return a time of computing, or a ratio of two.

    Args:
        most: Upper end.
        least: Lower end.
    """
    return Expectation(least, most, why=TIMED)


def share(value: float, count: int = 20_000) -> Expectation:
    """Return a share of random draws that has a known probability.

    Args:
        value: The probability.
        count: How many draws.
    """
    four = 4 * math.sqrt(value * (1 - value) / count)
    return Expectation(value - four, value + four, why=f"four standard deviations of a share of {count} draws")


def slack(value: float) -> Expectation:
    """Return what a flight has to spare of its bounds in seconds.

    Args:
        value: s, as found.
    """
    return Expectation(
        0.0,
        1.5 * value,
        why="below 0 nothing is certified; how much is left follows engines' choices of times, half of it more",
    )


def text(value: str) -> Expectation:
    """Return a text.

    Args:
        value: The text.
    """
    return Expectation(text=value, why=EXACT)


def between(low: float, high: float, why: str) -> Expectation:
    """Return an interval of its own.

    Args:
        low: Its lower end.
        high: Its upper end.
        why: Reason for its width.
    """
    return Expectation(low, high, why=why)


def _about(value: float, share: float, why: str) -> Expectation:
    return Expectation(value * (1 - share), value * (1 + share), why=why)
