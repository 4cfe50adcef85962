"""Numbers in intervals that carry their slopes from the middle of a box of variables, for arrays of any shape, every operation rounded outwards.

For all variables in the box a number is its value at the middle, and slopes that are within theirs times
the variables' distance from there. The middle may itself be anywhere in a box (Krawczyk and Neumaier's slopes, which for products are half as wide as derivatives): they bound how far a law is from a
linear one. Arrays of plain numbers stand for the first axes of those that they act on; further axes are instants.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Floats
from verify.arithmetic.intervals import Interval, interval


@dataclass(frozen=True, eq=False, slots=True)
class Slopes:
    """An array of numbers.

    Attributes:
        value: For all variables in the box; of some shape.
        centre: At its middle, wherever that is; of that shape.
        slope: Of that shape and one axis more, over the variables.
        size: Half the sides of the box. Shape (n,).
    """

    value: Interval
    centre: Interval
    slope: Interval
    size: Floats

    __array_ufunc__ = None

    @property
    def T(self) -> Slopes:  # noqa: N802  # as of arrays
        """Transpose of a matrix."""
        value, centre, slope = (
            Interval(v.low.swapaxes(0, 1), v.high.swapaxes(0, 1)) for v in (self.value, self.centre, self.slope)
        )
        return Slopes(value, centre, slope, self.size)

    @classmethod
    def variables(cls, size: Floats, around: Floats | float = 0.0) -> Slopes:
        """Take variables within plus and minus their sizes of a middle, which is within plus and minus `around`. Shape (n,)."""
        most, middle = size + around, around + 0.0 * size
        return cls(Interval(-most, most), Interval(-middle, middle), interval(np.eye(len(size))), size)

    @classmethod
    def known(cls, values: Floats) -> Slopes:
        """Take numbers, such as of many instants; there are no variables."""
        return cls(interval(values), interval(values), interval(np.zeros((*values.shape, 0))), np.zeros(0))

    def _with(self, value: Interval, centre: Interval, slope: Interval) -> Slopes:
        """Return a number, its value no wider than its slopes say."""
        reach = self._reach(slope)
        other = centre + Interval(-reach, reach)
        with np.errstate(invalid="ignore"):
            value = Interval(np.fmax(value.low, other.low), np.fmin(value.high, other.high))
        return Slopes(value, centre, slope, self.size)

    def _first(self, other: Floats | float) -> Floats | float:
        """Return plain numbers along the first axes."""
        missing = self.value.low.ndim - np.ndim(other)
        return np.reshape(other, (*np.shape(other), *(1,) * missing)) if np.ndim(other) and missing > 0 else other

    def _reach(self, slope: Interval) -> Floats:
        """Return how far slopes reach from the middle."""
        return np.maximum(np.abs(slope.low), np.abs(slope.high)) @ self.size * (1.0 + 1e-12) + 1e-300

    def __getitem__(self, key: object) -> Slopes:
        return Slopes(_at(self.value, key), _at(self.centre, key), _at(self.slope, key), self.size)

    def __neg__(self) -> Slopes:
        return Slopes(-self.value, -self.centre, -self.slope, self.size)

    def __add__(self, other: Slopes | Floats | float) -> Slopes:
        if not isinstance(other, Slopes):
            other = self._first(other)
            value = self.value + interval(other)
            return Slopes(value, self.centre + interval(other), _like(self.slope, value), self.size)
        return self._with(self.value + other.value, self.centre + other.centre, self.slope + other.slope)

    __radd__ = __add__

    def __sub__(self, other: Slopes | Floats | float) -> Slopes:
        return self + -other

    def __rsub__(self, other: Floats | float) -> Slopes:
        return -self + other

    def __mul__(self, other: Slopes | Floats | float) -> Slopes:
        if not isinstance(other, Slopes):
            factor = interval(self._first(other))
            return Slopes(self.value * factor, self.centre * factor, self.slope * _last(factor), self.size)
        one = self.slope * _last(other.value) + other.slope * _last(self.centre)
        two = other.slope * _last(self.value) + self.slope * _last(other.centre)
        better = (self._reach(one) <= self._reach(two))[..., None]
        slope = Interval(np.where(better, one.low, two.low), np.where(better, one.high, two.high))
        return self._with(self.value * other.value, self.centre * other.centre, slope)

    __rmul__ = __mul__

    def __truediv__(self, other: Slopes | float) -> Slopes:
        if not isinstance(other, Slopes):
            divisor = interval(other)
            return Slopes(self.value / divisor, self.centre / divisor, self.slope / _last(divisor), self.size)
        centre = self.centre / other.centre
        slope = (self.slope - other.slope * _last(centre)) / _last(other.value)
        return self._with(self.value / other.value, centre, slope)

    def __rtruediv__(self, other: float) -> Slopes:
        centre = interval(other) / self.centre
        return self._with(interval(other) / self.value, centre, (-self.slope * _last(centre)) / _last(self.value))

    def root(self) -> Slopes:
        """Square root."""
        root, centre = self.value.root(), self.centre.root()
        return self._with(root, centre, self.slope / _last(root + centre))

    def at_least(self, least: Floats) -> Slopes:
        """Greater of this and a number."""
        low, high, least = self.value.low, self.value.high, np.asarray(self._first(least))
        value, centre = (Interval(np.maximum(v.low, least), np.maximum(v.high, least)) for v in (self.value, self.centre))
        some, every = (~(high < least)).astype(np.float64), (low > least).astype(np.float64)
        return self._with(value, centre, self.slope * _last(Interval(every, some)))

    def within(self, most: Floats) -> Slopes:
        """Take into account that magnitudes are at most so much, which is known otherwise."""
        value = Interval(np.maximum(self.value.low, -most), np.minimum(self.value.high, most))
        return Slopes(value, self.centre, self.slope, self.size)


def root(value: Slopes) -> Slopes:
    """Return the square root."""
    return value.root()


def magnitude(value: Slopes) -> Floats:
    """Return upper bounds of magnitudes."""
    return np.maximum(-value.value.low, value.value.high)


def stacked(parts: Sequence[Slopes]) -> Slopes:
    """Put numbers of one shape along a new first axis."""
    return _together(np.stack, parts)


def joined(parts: Sequence[Slopes]) -> Slopes:
    """Put arrays one behind the other along the first axis."""
    return _together(np.concatenate, parts)


def _together(join: Callable[[list[Floats]], Floats], parts: Sequence[Slopes]) -> Slopes:
    value, centre, slope = (
        Interval(join([v.low for v in each]), join([v.high for v in each]))
        for each in ([p.value for p in parts], [p.centre for p in parts], [p.slope for p in parts])
    )
    return Slopes(value, centre, slope, parts[0].size)


def _at(values: Interval, key: object) -> Interval:
    return Interval(values.low[key], values.high[key])  # pyright: ignore[reportArgumentType, reportCallIssue]  # numpy's own index types


def _last(values: Interval) -> Interval:
    return Interval(values.low[..., None], values.high[..., None])


def _like(slope: Interval, value: Interval) -> Interval:
    shape = (*value.low.shape, slope.low.shape[-1])
    return Interval(np.broadcast_to(slope.low, shape), np.broadcast_to(slope.high, shape))
