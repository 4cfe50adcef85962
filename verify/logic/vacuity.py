"""Parts of a formula that could hold only vacuously."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from verify.data.language.formula import Formula
from verify.data.language.word import Word
from verify.logic.explanation import show
from verify.logic.semantics import truth_table


def implications(formula: Formula) -> Iterator[tuple[Formula, Formula]]:
    """Yield (implication, left side) for each `l -> r`, and each `!l | r` under a G."""
    stack = [(formula, False)]
    seen: set[tuple[int, bool]] = set()
    while stack:
        node, always = stack.pop()
        if (id(node), always) in seen:
            continue
        seen.add((id(node), always))
        if node.operator == "->":
            yield node, node.arguments[0]
        elif node.operator == "|" and always:
            for argument in node.arguments:
                if argument.operator == "!":
                    yield node, argument.arguments[0]
        inside = always or node.operator == "G"
        stack.extend((argument, inside) for argument in reversed(node.arguments))


def vacuous_parts(formula: Formula, words: Iterable[Word]) -> tuple[str, ...]:
    """Say which implications' left sides are false at every position of every word."""
    asked = list(implications(formula))
    tested = [False] * len(asked)
    for word in words if asked else ():
        table = truth_table(formula, word)
        tested = [seen or any(table.row(left)) for seen, (_, left) in zip(tested, asked, strict=True)]
    found = [
        f"`{show(implication)}` holds only because `{show(left)}` never happens."
        for seen, (implication, left) in zip(tested, asked, strict=True)
        if not seen
    ]
    return tuple(dict.fromkeys(found))
