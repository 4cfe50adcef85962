"""Random formulas of `team: joint` that count robots and name them."""

from __future__ import annotations

from random import Random

from verify.data import Formula

NAMES = ("a", "b")


def random_counting_formula(rng: Random, size: int, robots: tuple[str, ...], *, me: bool = False) -> Formula:
    """A formula without X, of about `size` operators; `me`: within an `each`."""
    if size <= 1:
        return _atom(rng, robots)
    if not me and rng.random() < 0.1:
        return Formula("each", (random_counting_formula(rng, size - 1, robots, me=True),))
    if rng.random() < 0.5:
        return Formula(rng.choice("!FGFG"), (random_counting_formula(rng, size - 1, robots, me=me),))
    left = rng.randint(1, size - 1)
    operator = rng.choice(["&", "|", "->", "U", "W", "R", "M", "xor", "<->"])
    parts = (random_counting_formula(rng, left, robots, me=me), random_counting_formula(rng, size - left, robots, me=me))
    return Formula(operator, parts)


def _atom(rng: Random, robots: tuple[str, ...]) -> Formula:
    kind = rng.random()
    if kind < 0.25:
        return Formula("name", (), rng.choice(NAMES), robot=rng.choice(robots) if rng.random() < 0.6 else "")
    counted = _counted(rng, rng.randint(1, 3))
    if kind < 0.8:
        return Formula(
            "count", (counted,), bound=(rng.choice([">=", ">=", "<=", "==", "<", ">"]), rng.randint(0, len(robots) + 1))
        )
    return Formula(rng.choice(["all", "some"]), (counted,))


def _counted(rng: Random, size: int) -> Formula:
    if size <= 1:
        return Formula("name", (), rng.choice(NAMES))
    if rng.random() < 0.4:
        return Formula("!", (_counted(rng, size - 1),))
    return Formula(rng.choice(["&", "|", "->", "xor", "<->"]), (_counted(rng, 1), _counted(rng, size - 1)))
