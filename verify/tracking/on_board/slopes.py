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

_U = 2.0**-53
_GROW = 1.0 + 2.0**-40
_TINY = 1e-290


@dataclass(frozen=True, eq=False, slots=True)
class Slopes:
    """An array of numbers.

    Attributes:
        value: For all variables in the box; of some shape.
        centre: At its middle, wherever that is; of that shape.
        slope: Middles of slopes; of that shape and one axis more, over the variables.
        wide: How far slopes may be from those; of the same shape.
        size: Half the sides of the box. Shape (n,), or (instants, n).
    """

    value: Interval
    centre: Interval
    slope: Floats
    wide: Floats
    size: Floats

    __array_ufunc__ = None

    @property
    def T(self) -> Slopes:  # noqa: N802  # as of arrays
        """Transpose of a matrix."""
        value, centre = (Interval(v.low.swapaxes(0, 1), v.high.swapaxes(0, 1)) for v in (self.value, self.centre))
        return Slopes(value, centre, self.slope.swapaxes(0, 1), self.wide.swapaxes(0, 1), self.size)

    @classmethod
    def variables(cls, size: Floats, around: Floats | float = 0.0) -> Slopes:
        """Take variables within plus and minus their sizes of a middle, which is within plus and minus `around`. Shape (n,)."""
        most, middle, one = size + around, around + 0.0 * size, np.eye(len(size))
        return cls(Interval(-most, most), Interval(-middle, middle), one, 0.0 * one, size)

    @classmethod
    def about(cls, middle: Floats, size: Floats, around: Floats | float = 0.0) -> Slopes:
        """Take variables within plus and minus their sizes of middles, which are within plus and minus `around` of those told, at many instants.

        Args:
            middle: Shape (n, instants).
            size: Of that shape.
            around: Of that shape.
        """
        near = np.nextafter(np.abs(around) + 0.0 * middle, np.inf)
        most, one = np.nextafter(size + near, np.inf), np.zeros((*middle.shape, len(middle)))
        one[range(len(middle)), :, range(len(middle))] = 1.0
        at = interval(middle)
        return cls(at + Interval(-most, most), at + Interval(-near, near), one, 0.0 * one, np.moveaxis(size, 0, -1))

    @classmethod
    def known(cls, values: Floats) -> Slopes:
        """Take numbers, such as of many instants; there are no variables."""
        none = np.zeros((*values.shape, 0))
        return cls(interval(values), interval(values), none, none, np.zeros(0))

    def _with(self, value: Interval, centre: Interval, slope: Floats, wide: Floats) -> Slopes:
        """Return a number, its value no wider than its slopes say."""
        reach = ((np.abs(slope) + wide) * self.size).sum(-1) * (1.0 + 1e-12) + 1e-300
        other = centre + Interval(-reach, reach)
        with np.errstate(invalid="ignore"):
            value = Interval(np.fmax(value.low, other.low), np.fmin(value.high, other.high))
        return Slopes(value, centre, slope, wide, self.size)

    def _first(self, other: Floats | float) -> Floats | float:
        """Return plain numbers along the first axes."""
        missing = self.value.low.ndim - np.ndim(other)
        return np.reshape(other, (*np.shape(other), *(1,) * missing)) if np.ndim(other) and missing > 0 else other

    def __getitem__(self, key: object) -> Slopes:
        slope, wide = self.slope[key], self.wide[key]  # pyright: ignore[reportArgumentType, reportCallIssue]  # numpy's own index types
        return Slopes(_at(self.value, key), _at(self.centre, key), slope, wide, self.size)

    def __neg__(self) -> Slopes:
        return Slopes(-self.value, -self.centre, -self.slope, self.wide, self.size)

    def __add__(self, other: Slopes | Floats | float) -> Slopes:
        if not isinstance(other, Slopes):
            other = self._first(other)
            value = self.value + interval(other)
            shape = (*value.low.shape, self.slope.shape[-1])
            slope, wide = np.broadcast_to(self.slope, shape), np.broadcast_to(self.wide, shape)
            return Slopes(value, self.centre + interval(other), slope, wide, self.size)
        slope = self.slope + other.slope
        wide = (self.wide + other.wide + _U * np.abs(slope)) * _GROW
        return self._with(self.value + other.value, self.centre + other.centre, slope, wide)

    __radd__ = __add__

    def __sub__(self, other: Slopes | Floats | float) -> Slopes:
        return self + -other

    def __rsub__(self, other: Floats | float) -> Slopes:
        return -self + other

    def _times(self, *pairs: tuple[Slopes, Interval]) -> tuple[Floats, Floats]:
        """Return slopes of some numbers times others, summed."""
        slope, wide = 0.0, 0.0
        for number, factor in pairs:
            most = np.maximum(np.abs(factor.low), np.abs(factor.high))[..., None]
            middle = (0.5 * (factor.low + factor.high))[..., None]
            spread = (0.5 * (factor.high - factor.low))[..., None] * _GROW + 4.0 * _U * most
            slope = slope + number.slope * middle
            wide = wide + np.abs(number.slope) * spread + number.wide * (most * _GROW)
        return np.asarray(slope), (wide + 2.0 * _U * np.abs(slope)) * _GROW + _TINY

    def __mul__(self, other: Slopes | Floats | float) -> Slopes:
        if not isinstance(other, Slopes):
            factor = interval(self._first(other))
            return Slopes(self.value * factor, self.centre * factor, *self._times((self, factor)), self.size)
        # ab - AB = (a - A)(b + B) / 2 + (b - B)(a + A) / 2
        halves = ((other.value + other.centre).times(0.5), (self.value + self.centre).times(0.5))
        slope, wide = self._times((self, halves[0]), (other, halves[1]))
        return self._with(self.value * other.value, self.centre * other.centre, slope, wide)

    __rmul__ = __mul__

    def __truediv__(self, other: Slopes | float) -> Slopes:
        if not isinstance(other, Slopes):
            divisor = interval(other)
            return Slopes(self.value / divisor, self.centre / divisor, *self._times((self, interval(1.0) / divisor)), self.size)
        return self * (1.0 / other)

    def __rtruediv__(self, other: float) -> Slopes:
        value, centre = interval(other) / self.value, interval(other) / self.centre
        return self._with(value, centre, *self._times((self, -(centre / self.value))))

    def root(self) -> Slopes:
        """Square root."""
        root, centre = self.value.root(), self.centre.root()
        return self._with(root, centre, *self._times((self, interval(1.0) / (root + centre))))

    def at_least(self, least: Floats) -> Slopes:
        """Greater of this and a number."""
        low, high, least = self.value.low, self.value.high, np.asarray(self._first(least))
        value, centre = (Interval(np.maximum(v.low, least), np.maximum(v.high, least)) for v in (self.value, self.centre))
        some, every = (~(high < least)).astype(np.float64), (low > least).astype(np.float64)
        return self._with(value, centre, *self._times((self, Interval(every, some))))

    def within(self, most: Floats) -> Slopes:
        """Take into account that magnitudes are at most so much, which is known otherwise."""
        value = Interval(np.maximum(self.value.low, -most), np.minimum(self.value.high, most))
        return Slopes(value, self.centre, self.slope, self.wide, self.size)


def root(value: Slopes) -> Slopes:
    """Return the square root."""
    return value.root()


def magnitude(value: Slopes) -> Floats:
    """Return upper bounds of magnitudes."""
    return np.maximum(-value.value.low, value.value.high)


def narrower(one: Slopes, other: Slopes) -> Slopes:
    """Return that of two forms of one number whose slopes reach less far."""
    reaches = [(number.wide * number.size).sum(-1) for number in (one, other)]
    first = reaches[0] <= reaches[1]
    value = Interval(np.fmax(one.value.low, other.value.low), np.fmin(one.value.high, other.value.high))
    centre = Interval(np.fmax(one.centre.low, other.centre.low), np.fmin(one.centre.high, other.centre.high))
    slope, wide = np.where(first[..., None], one.slope, other.slope), np.where(first[..., None], one.wide, other.wide)
    return Slopes(value, centre, slope, wide, one.size)


def stacked(parts: Sequence[Slopes]) -> Slopes:
    """Put numbers of one shape along a new first axis."""
    return _together(np.stack, parts)


def joined(parts: Sequence[Slopes]) -> Slopes:
    """Put arrays one behind the other along the first axis."""
    return _together(np.concatenate, parts)


def _together(join: Callable[[list[Floats]], Floats], parts: Sequence[Slopes]) -> Slopes:
    value, centre = (
        Interval(join([v.low for v in each]), join([v.high for v in each]))
        for each in ([p.value for p in parts], [p.centre for p in parts])
    )
    return Slopes(value, centre, join([p.slope for p in parts]), join([p.wide for p in parts]), parts[0].size)


def _at(values: Interval, key: object) -> Interval:
    return Interval(values.low[key], values.high[key])  # pyright: ignore[reportArgumentType, reportCallIssue]  # numpy's own index types
