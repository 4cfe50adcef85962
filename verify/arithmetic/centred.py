"""Functions of time on short parts, enclosed by the mean value theorem: the error falls with the square of the length.

Plain interval arithmetic forgets that two quantities move together, so what it says of a part is too wide by about the
part's length. Here each quantity carries its value in the middle of the part and an enclosure of its derivative beside
its plain enclosure: f(u) lies in f(1/2) + f'([0, 1]) (u - 1/2). What is near a limit is told from it by that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Balls, halves
from verify.arithmetic.intervals import Interval

_HALF = Interval(np.array(-0.5), np.array(0.5))


@dataclass(frozen=True, slots=True)
class Centred:
    """A quantity on parts of pieces, each part run through by u from 0 to 1.

    Attributes:
        middle: Its value at u = 1/2.
        over: All its values on the part.
        rate: All values of its derivative in u on the part.
    """

    middle: Interval
    over: Interval
    rate: Interval

    @classmethod
    def of(cls, part: Balls) -> Centred:
        """Enclose polynomials. Shape (k, ..., n + 1) to (k, ...)."""
        left = halves(part)[: len(part.mid)]
        slopes = (part[..., 1:] - part[..., :-1]).scaled(float(part.degree))
        return cls(
            Interval(left.low[..., -1], left.high[..., -1]),
            Interval(part.low.min(-1), part.high.max(-1)),
            Interval(slopes.low.min(-1), slopes.high.max(-1)),
        )

    def component(self, index: int) -> Centred:
        """Return one coordinate of vectors. Shape (k, 3) to (k,)."""
        return Centred(self.middle.component(index), self.over.component(index), self.rate.component(index))

    def tightened(self) -> Centred:
        """Return the same with `over` cut down to what the mean value theorem leaves of it."""
        bound = self.middle + self.rate * _HALF
        low = np.where(bound.low > self.over.low, bound.low, self.over.low)
        high = np.where(bound.high < self.over.high, bound.high, self.over.high)
        return Centred(self.middle, Interval(low, high), self.rate)

    def __neg__(self) -> Centred:
        return Centred(-self.middle, -self.over, -self.rate)

    def __add__(self, other: Centred) -> Centred:
        return Centred(self.middle + other.middle, self.over + other.over, self.rate + other.rate).tightened()

    def __sub__(self, other: Centred) -> Centred:
        return Centred(self.middle - other.middle, self.over - other.over, self.rate - other.rate).tightened()

    def __mul__(self, other: Centred | Interval) -> Centred:
        """Product with a quantity or with a constant."""
        if isinstance(other, Interval):
            return Centred(self.middle * other, self.over * other, self.rate * other)
        rate = self.rate * other.over + self.over * other.rate
        return Centred(self.middle * other.middle, self.over * other.over, rate).tightened()

    def __truediv__(self, other: Centred | Interval) -> Centred:
        """Quotient by a quantity or by a constant; all of the numbers where the divisor may be zero."""
        if isinstance(other, Interval):
            return Centred(self.middle / other, self.over / other, self.rate / other)
        over = self.over / other.over
        rate = (self.rate - over * other.rate) / other.over
        return Centred(self.middle / other.middle, over, rate).tightened()

    def times(self, factor: float) -> Centred:
        """Product with an exact float."""
        return Centred(self.middle.times(factor), self.over.times(factor), self.rate.times(factor))

    def squared(self) -> Centred:
        """Square, not below zero."""
        rate = (self.over * self.rate).times(2.0)
        return Centred(self.middle.squared(), self.over.squared(), rate).tightened()

    def root(self) -> Centred:
        """Square root of what is at least zero."""
        over = self.over.root()
        return Centred(self.middle.root(), over, self.rate / over.times(2.0)).tightened()

    def at_least_zero(self) -> Centred:
        """Return the same quantity, which is known to be at least zero, with that put to use."""
        return Centred(self.middle.at_least_zero(), self.over.at_least_zero(), self.rate)
