"""What counts as a number where a caller of the library gives one: a text, a truth value, NaN and infinity do not."""

from __future__ import annotations

import math
from numbers import Real


def is_number(value: object) -> bool:
    """Return whether something is a finite number.

    Args:
        value: As a caller gave it.
    """
    return not isinstance(value, bool) and isinstance(value, Real) and math.isfinite(value)
