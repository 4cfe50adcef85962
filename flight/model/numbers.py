"""Numbers that callers of the library give: a text, a truth value, NaN and infinity are none."""

from __future__ import annotations

import math
from numbers import Real


def is_number(value: object) -> bool:
    """Return whether something is a finite number.

    Args:
        value: As a caller gave it.
    """
    return not isinstance(value, bool) and isinstance(value, Real) and math.isfinite(value)
