"""Parts of a formula with their signs: whether it may gain as a part becomes true, or as it becomes false."""

from __future__ import annotations

from collections.abc import Iterator

from verify.data import Formula
from verify.data.language.formula import BOUNDED


def signed_parts(formula: Formula, *, counted: bool = True) -> Iterator[tuple[Formula, bool]]:
    """Yield each part of a formula, once with True where the formula may gain as it becomes true, once with False where as it becomes false.

    Args:
        formula: With temporal operators and counts, or written out.
        counted: Whether parts within counts are yielded, too.
    """
    waiting = [(formula, True)]
    seen = set[tuple[int, bool]]()
    for node, sign in waiting:  # grows while it is walked
        if (id(node), sign) not in seen:
            seen.add((id(node), sign))
            yield node, sign
            for place, argument in enumerate(node.arguments if counted or node.operator not in BOUNDED else ()):
                waiting += [(argument, sign == kept) for kept in _signs(node, place)]


def _signs(node: Formula, place: int) -> tuple[bool, ...]:
    """Return whether a node becomes true with one of its arguments, or without it, or both."""
    match node.operator:
        case "<->" | "xor":
            return True, False
        case operator if operator in BOUNDED:
            sign = "==" if node.bound is None else node.bound[0]
            return (True, False) if sign == "==" else (sign not in ("<", "<="),)
        case "!":
            return (False,)
        case "->":
            return (place == 1,)
        case _:  # all others gain only where an argument becomes true
            return (True,)
