"""Formulas with bounds in whole seconds on signals that change at whole seconds, decided by brute force on cells of time.

Cell 2k is the instant k, cell 2k + 1 the open second after it. All truth is constant on cells: signals and bounds are whole.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from fractions import Fraction

from verify.data.language.formula import TRUE, Formula

Cells = list[bool]


def truth(formula: Formula, signals: Mapping[str, Sequence[bool]], cells: int) -> Cells:
    """Return in which cells a formula holds; signals go on after their last cell as they end."""
    longest = 2 * sum(int(n.window[1] or n.window[0]) for n in formula.walk() if n.window is not None)
    count = max(len(signal) for signal in signals.values()) + longest + 4
    held = {name: [*signal, *[signal[-1]] * (count - len(signal))] for name, signal in signals.items()}
    return _truth(formula, held, count)[:cells]


def truth_for_ever(formula: Formula, signals: Mapping[str, Sequence[bool]], loop: int) -> Cells:
    """Return in which cells a formula holds of signals whose last `loop` cells are repeated for ever.

    Args:
        formula: With bounds in whole seconds.
        signals: All of one length, over whole seconds: an even number of cells, the last one an open second.
        loop: An even number of cells.
    """
    count = len(next(iter(signals.values())))
    return _truth(formula, {name: [*signal] for name, signal in signals.items()}, count, loop)


def _truth(node: Formula, signals: Mapping[str, Cells], count: int, loop: int = 0) -> Cells:
    parts = [_truth(part, signals, count, loop) for part in node.arguments]
    low, high = (0, None) if node.window is None else node.window
    after, limit = int(low), None if high is None else int(high)
    match node.operator:
        case "true" | "false":
            return [node.operator == "true"] * count
        case "name":
            return list(signals[node.name])
        case "!":
            return _not(parts[0])
        case "&":
            return [a and b for a, b in zip(*parts, strict=True)]
        case "|":
            return [a or b for a, b in zip(*parts, strict=True)]
        case "->":
            return [not a or b for a, b in zip(*parts, strict=True)]
        case "F":
            return until_of_cells([True] * count, parts[0], after, limit, loop)
        case "G":
            return _not(until_of_cells([True] * count, _not(parts[0]), after, limit, loop))
        case "U":
            return until_of_cells(parts[0], parts[1], after, limit, loop)
        case "R":
            return _not(until_of_cells(_not(parts[0]), _not(parts[1]), after, limit, loop))
        case "M":
            return until_of_cells(parts[1], [a and b for a, b in zip(*parts, strict=True)], after, limit, loop)
        case _:  # W
            neither = [not a and not b for a, b in zip(*parts, strict=True)]
            return _not(until_of_cells(_not(parts[1]), neither, after, limit, loop))


def _not(cells: Cells) -> Cells:
    return [not cell for cell in cells]


def until_of_cells(held: Cells, reached: Cells, low: int, high: int | None, loop: int) -> Cells:
    """Return in which cells one thing is held until another is reached; `loop` of the last cells are repeated for ever."""
    if loop:
        return [_reaches_for_ever((held, reached, loop), now, low, high) for now in range(len(held))]
    return [_reaches(held, reached, now, low, high) for now in range(len(held))]


def _reaches_for_ever(lasso: tuple[Cells, Cells, int], now: int, low: int, high: int | None) -> bool:
    """Say the same of cells of which the last ones are repeated for ever, cell after cell."""
    held, reached, loop = lasso
    count = len(held)
    for then in range(now, now + 2 * low + 2 * count + 3 if high is None else now + 2 * high + 1):
        here, after = (each if each < count else count - loop + (each - count) % loop for each in (then, then + 1))
        if then >= now + 2 * low:
            if reached[here] and (then == now or then % 2 == 0 or held[here]):
                return True
            if then % 2 == 0 and (high is None or then < now + 2 * high) and held[here] and reached[after]:
                return True
        if not held[here]:
            return False
    return False


def _reaches(held: Cells, reached: Cells, now: int, low: int, high: int | None) -> bool:
    """Say whether, from a cell on, one thing is held until the other is there, or is there just after."""
    last = len(held) - 1
    stop = last if high is None else min(now + 2 * high, last)
    for then in range(now, stop + 1):
        before = all(held[now:then]) and (then == now or then % 2 == 0 or held[then])
        if then >= now + 2 * low and reached[then] and before:
            return True
        just_after = then % 2 == 0 and then < (stop if high is None else now + 2 * high) and then < last
        if then >= now + 2 * low and just_after and all(held[now : then + 1]) and reached[then + 1]:
            return True
    begin = now + 2 * low  # all later cells are as the last
    return begin > last and (high is None or high >= low) and reached[last] and all(held[now:])


def drawn_formula(rng: random.Random, names: Sequence[str], depth: int) -> Formula:
    """Return a random formula with and without bounds."""
    if depth == 0 or rng.random() < 0.15:
        return TRUE if rng.random() < 0.05 else Formula("name", (), rng.choice(names))
    operator = rng.choice(["!", "&", "|", "->", "F", "G", "U", "R", "W", "M", "F", "G", "U"])
    count = 1 if operator in ("!", "F", "G") else 2
    parts = tuple(drawn_formula(rng, names, depth - 1) for _ in range(count))
    window = None
    if operator in ("F", "G", "U", "R", "W", "M") and rng.random() < 0.75:
        low = rng.choice([0, 0, 0, 1, 2, 3])
        high = rng.choice([None, low, low + 1, low + 2, low + 4])
        window = (Fraction(low), None if high is None else Fraction(high))
    return Formula(operator, parts, window=window)  # type: ignore[arg-type]  # one of the operators


def drawn_signal(rng: random.Random, seconds: int, *, closed: bool) -> Cells:
    """Return a random signal over so many seconds; a closed one is true wherever it is true beside.

    Args:
        rng: Draws it.
        seconds: Its length.
        closed: Whether it is true at a whole second wherever it is true just before or after.
    """
    cells, value = list[bool](), rng.random() < 0.5
    for _ in range(2 * seconds + 1):
        if rng.random() < 0.3:
            value = rng.random() < 0.5
        cells.append(value)
    if closed:
        for k in range(0, len(cells), 2):
            cells[k] = cells[k] or any(cells[max(k - 1, 0) : k + 2])
    return cells
