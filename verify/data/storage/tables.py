"""Tables of numbers as CSV, read exactly: every row whole, every column named once, numbers as the decimals they are.

A decimal is a whole number and a power of ten. Times stay decimals until they are counted from the first one, so that stamps of
nineteen digits lose nothing; positions are rounded once, to the nearest float.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

from verify.data.errors import BadInput

MAX_BYTES = 200_000_000
MAX_ROWS = 4_000_000
MAX_COLUMNS = 20_000
MAX_LINE = 1_000_000
"""Characters of a line; a thousand robots with thirty columns each need half as many."""

FINE = Fraction(1, 10_000)
"""In m: lengths written to this or finer are taken as rounded by half a unit of their last place."""

_DECIMAL = re.compile(r"([+-]?)(\d{0,40})(?:\.(\d{0,40}))?(?:[eE]([+-]?\d{1,3}))?", re.ASCII)
_MOST_EXPONENT = 60


@dataclass(frozen=True, slots=True)
class Decimal:
    """A number as it was written: whole * 10**exponent."""

    whole: int
    exponent: int

    def float(self, unit: int = 0) -> float:
        """Return the nearest float of the number times 10**unit."""
        power = self.exponent + unit
        return float(self.whole * 10**power) if power >= 0 else self.whole / 10**-power

    def exact(self, unit: int = 0) -> Fraction:
        """Return the number times 10**unit."""
        power = self.exponent + unit
        return Fraction(self.whole * 10**power) if power >= 0 else Fraction(self.whole, 10**-power)


@dataclass(frozen=True, slots=True)
class Table:
    """A table as text.

    Attributes:
        source: Names it in messages.
        header: Names of the columns, without white space around them.
        rows: Cells; every row has as many as the header.
        lines: Line of the file on which each row ends.
        whole: Whether the last line ends; where it does not, its last number may have been cut.
    """

    source: str
    header: tuple[str, ...]
    rows: list[list[str]]
    lines: list[int]
    whole: bool

    def column(self, name: str) -> int:
        """Return the index of a column that stands exactly once.

        Raises:
            BadInput: It is missing or stands twice.
        """
        found = [index for index, own in enumerate(self.header) if own == name]
        if len(found) != 1:
            how = "has no column" if not found else f"has {len(found)} columns"
            raise BadInput(f"{self.source} {how} '{name}'; one is needed.")
        return found[0]

    def numbers(self, column: int, *, blank: bool = False) -> list[Decimal | None]:
        """Return a column's numbers as they were written; None where a cell may be blank and is.

        Raises:
            BadInput: A cell is no number, or the file was cut within the last one.
        """
        self.require_whole(column)
        name = self.header[column]
        return [self._number(row[column], line, name, blank) for row, line in zip(self.rows, self.lines, strict=True)]

    def require_whole(self, column: int) -> None:
        """Reject a file that ends within a column's last number.

        Raises:
            BadInput: It is the last column, and the last line does not end.
        """
        if self.rows and not self.whole and column == len(self.header) - 1:
            raise BadInput(
                f"{self.source}:{self.lines[-1]}: the last line does not end, so its last number may have been cut; "
                "end the file with a new line."
            )

    def _number(self, cell: str, line: int, name: str, blank: bool) -> Decimal | None:
        text = cell.strip()
        if blank and text.lower() in ("", "nan"):
            return None
        number = decimal(text)
        if number is None:
            raise BadInput(f"{self.source}:{line}: {name[:40]} is {cell[:40]!r}; it must be a finite number.")
        return number


def decimal(text: str) -> Decimal | None:
    """Read a decimal number; None where it is none, or has more digits or a larger exponent than any measurement."""
    match = _DECIMAL.fullmatch(text)
    if match is None:
        return None
    sign, before, after, power = match.groups()
    after = after or ""
    if not before and not after:
        return None
    exponent = int(power or 0)
    if abs(exponent) > _MOST_EXPONENT:
        return None
    return Decimal(int(f"{sign}{before}{after}"), exponent - len(after))


def read_table(
    text: str, source: str, *, comments: bool = False, check: Callable[[tuple[str, ...]], None] | None = None
) -> Table:
    """Read CSV text.

    Args:
        text: The file's text.
        source: Names it in messages.
        comments: Whether lines that begin with `#` are left out.
        check: Looks at the header before the rows are held against it.

    Raises:
        BadInput: It is no CSV, a row has more or fewer cells than the header, or there are too many.
    """
    reader = csv.reader(_lines(text, source), strict=True)
    header: tuple[str, ...] | None = None
    rows: list[list[str]] = []
    lines: list[int] = []
    try:
        for row in reader:
            if not row or (comments and row[0].startswith("#")):
                continue
            if header is None:
                header = tuple(name.strip() for name in row)
                if len(header) > MAX_COLUMNS:
                    raise BadInput(f"{source} has {len(header)} columns; at most {MAX_COLUMNS} are read.")
                if check is not None:
                    check(header)
                continue
            if len(row) != len(header):
                raise BadInput(f"{source}:{reader.line_num}: {len(row)} cells under {len(header)} columns.")
            if len(rows) == MAX_ROWS:
                raise BadInput(f"{source} has more than {MAX_ROWS} rows; cut the recording.")
            rows.append(row)
            lines.append(reader.line_num)
    except csv.Error as error:
        raise BadInput(f"{source} is no CSV: {error}.") from None
    return Table(source, header or (), rows, lines, text.endswith(("\n", "\r")))


def counted(numbers: Sequence[Decimal], unit: int = 0) -> tuple[list[int], int]:
    """Return numbers times 10**unit as whole multiples of one power of ten, and that power (0 or less), exactly."""
    least = min(min(number.exponent for number in numbers) + unit, 0)
    return [number.whole * 10 ** (number.exponent + unit - least) for number in numbers], least


def since(counts: Sequence[int], power: int, zero: Fraction) -> list[float]:
    """Return times in s from `zero` (in s), each rounded once, of what `counted` gave.

    Args:
        counts: Times as whole multiples of 10**power s.
        power: 0 or less.
        zero: s, exact.
    """
    scale = 10**-power
    begin = zero * scale  # whole where `zero` is one of the times
    return [(count * begin.denominator - begin.numerator) / (scale * begin.denominator) for count in counts]


def rounding(numbers: Sequence[Decimal | None], unit: int = 0) -> float:
    """Return half a unit of the last place that a column's lengths are written to, times 10**unit.

    Places are those after the point or significant digits, whichever is coarser for the largest number. Lengths that
    are coarser than 0.1 mm are taken as meant: 0.
    """
    return half_place(numbers, unit) if _last_place(numbers, unit) <= FINE else 0.0


def half_place(numbers: Sequence[Decimal | None], unit: int = 0, *, digits: int | None = None) -> float:
    """Return half a unit of the last place that a column's numbers are written to, times 10**unit, however coarse that is.

    Args:
        numbers: The column.
        unit: Power of ten.
        digits: How many significant digits the numbers were written with, where that is known and zeros at their ends were left out.
    """
    last = _last_place(numbers, unit, digits)
    return math.nextafter(float(last / 2), math.inf) if last else 0.0


def coarse_place(numbers: Sequence[Decimal | None], unit: int = 0) -> Fraction:
    """Return a unit of the last place that a column's numbers are written to, times 10**unit, where `rounding` takes them as meant; else 0."""
    last = _last_place(numbers, unit)
    return last if last > FINE else Fraction(0)


def _last_place(numbers: Sequence[Decimal | None], unit: int, digits: int | None = None) -> Fraction:
    """Return a unit of the last place of a column's numbers, times 10**unit; 0 where it has none."""
    found = [number for number in numbers if number is not None]
    if not found:
        return Fraction(0)
    places = min(number.exponent for number in found)
    size = max((number.exponent + len(str(abs(number.whole))) for number in found if number.whole), default=places)
    if digits is not None:
        return Fraction(10) ** (size - digits + unit)
    digits = max(len(str(abs(number.whole))) for number in found)
    return Fraction(10) ** (max(places, size - digits) + unit)


def _lines(text: str, source: str) -> Iterator[str]:
    for line in io.StringIO(text, newline=""):
        if len(line) > MAX_LINE:
            raise BadInput(f"{source} has a line of {len(line)} characters; that is no table.")
        yield line
