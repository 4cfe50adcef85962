"""Relaxation of formulas that are bounded in seconds: what follows from one for words, which measure no time."""

from __future__ import annotations

from dataclasses import dataclass, replace

from verify.data.language.counting import negated
from verify.data.language.formula import FALSE, TRUE, Formula


def without_idle_bounds(formula: Formula) -> Formula:
    """Return the formula without bounds that bound nothing: `F[0,inf] a` is `F a`."""

    def made(node: Formula, arguments: tuple[Formula, ...]) -> Formula:
        window = None if node.window == (0, None) else node.window
        return replace(node, arguments=arguments, window=window) if arguments else node

    return formula.rebuilt(made)


def relaxed(formula: Formula) -> Formula:
    """Return a formula without bounds that every flight satisfies which satisfies this one.

    In negation normal form `F[a,b]`, `U[a,b]` and `M[a,b]` lose their bounds, as do `G`, `R` and `W` with bounds [0,inf]. Of `G[0,b] p`, `p R[0,b] q`
    and `p W[0,b] q` it is left what they ask now: p, q, and one of both; other bounds leave `true`. Formulas without bounds come back as they are.
    """
    return _Unbounded(strict=False).of(formula, negative=False, reached=False) if formula.timed else formula


def tightened(formula: Formula) -> Formula:
    """Return a formula without bounds whose flights are likely to satisfy this one, once their times are chosen: what planning tries first.

    Bounds are left out, and what has to hold for a time at some time (`F[0,9] G[0,5] p`) has to hold at that time.
    """
    return _Unbounded(strict=True).of(formula, negative=False, reached=False) if formula.timed else formula


_MOST_CHOICES = 6
"""Operators `xor` and `<->` over bounds that are written out within each other; each doubles what is below it. Of more nothing is asked."""

_DUAL = {"F": "G", "G": "F", "U": "R", "R": "U", "W": "M", "M": "W"}


@dataclass(frozen=True)
class _Unbounded:
    """A way to leave bounds out: strictly, as `tightened` does, or so that nothing is asked that was not."""

    strict: bool

    def of(self, node: Formula, *, negative: bool, reached: bool) -> Formula:
        """Return a formula, or its negation, without bounds.

        Args:
            node: The formula.
            negative: Whether its negation is asked.
            reached: Whether it is asked at some time, which an `F` or a `U` may choose.
        """
        if not node.timed:
            return negated(node) if negative else node
        parts = node.arguments
        match node.operator:
            case "!":
                return self.of(parts[0], negative=not negative, reached=reached)
            case "->":
                one = self.of(parts[0], negative=not negative, reached=reached)
                return _joined("&" if negative else "|", one, self.of(parts[1], negative=negative, reached=reached))
            case "&" | "|":
                joint = "&" if (node.operator == "&") != negative else "|"
                return _joined(joint, *(self.of(part, negative=negative, reached=reached) for part in parts))
            case "xor" | "<->":
                if sum(part.operator in ("xor", "<->") and part.timed for part in node.nodes()) > _MOST_CHOICES:
                    return TRUE
                same = (node.operator == "<->") != negative
                pairs = [
                    _joined(
                        "&", *(self.of(part, negative=sign, reached=reached) for part, sign in zip(parts, signs, strict=True))
                    )
                    for signs in ((False, not same), (True, same))
                ]
                return _joined("|", *pairs)
            case _:
                return self._temporal(node, negative=negative, reached=reached)

    def _temporal(self, node: Formula, *, negative: bool, reached: bool) -> Formula:
        kind = _DUAL[node.operator] if negative else node.operator
        chooses, bounded = kind in ("F", "U", "M"), node.window not in (None, (0, None))
        reached = reached or chooses
        *first, last = (self.of(part, negative=negative, reached=reached) for part in node.arguments)
        if chooses or not bounded or (self.strict and not reached):
            if kind in ("F", "G") and last in (TRUE, FALSE):
                return last
            return Formula(kind, (*first, last), "", node.position)  # type: ignore[arg-type]  # one of the temporal ones
        assert node.window is not None
        if node.window[0] > 0 and not self.strict:
            return TRUE
        return _joined("|", first[0], last) if kind == "W" else last


def _joined(joint: str, one: Formula, other: Formula) -> Formula:
    absorbing, neutral = (FALSE, TRUE) if joint == "&" else (TRUE, FALSE)
    if absorbing in (one, other):
        return absorbing
    return other if one == neutral else one if other == neutral else Formula(joint, (one, other))  # type: ignore[arg-type]  # & or |
