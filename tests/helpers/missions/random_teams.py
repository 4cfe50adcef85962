"""Random formulas and timelines in great numbers, quicker than hypothesis draws them."""

from __future__ import annotations

from fractions import Fraction
from random import Random

from tests.helpers.words.timelines import fill
from verify.data import Formula
from verify.model_checking.timeline import Change, Enclosure, Status, Timeline

NAMES = ("a", "b", "c")
_END = 12


def random_formula(rng: Random, size: int) -> Formula:
    """A formula without X, of about `size` operators and names."""
    if size <= 1:
        return Formula("name", (), rng.choice((*NAMES, *NAMES, "water"))) if rng.random() < 0.95 else Formula("true")
    if rng.random() < 0.45:
        return Formula(rng.choice("!FGFG"), (random_formula(rng, size - 1),))
    left = rng.randint(1, size - 1)
    operator = rng.choice(["&", "|", "->", "U", "W", "R", "M", "xor", "<->"])
    return Formula(operator, (random_formula(rng, left), random_formula(rng, size - left)))


def random_timeline(rng: Random, robot: str, *, busy: float, cycle: bool = False) -> Timeline:
    """Crossings, spells of may, enclosures that touch and overlap; `busy` regions in one are visited."""
    initial: dict[str, Status] = {}
    changes: list[Change] = []
    for name in NAMES:
        visited = rng.random() < busy
        status: Status = rng.choice(["no", "no", "may", "must"]) if visited else "no"
        initial[name] = status
        time = 0
        for _ in range(rng.randint(0, 3) if visited else 0):
            time += rng.randint(0, 6) if time else rng.randint(1, 6)
            width = rng.choice([0, 0, 1, 2])
            if time + width > _END:
                break
            others: list[Status] = [s for s in ("no", "may", "must") if s != status]
            status = rng.choice(others)
            changes.append(Change(Enclosure(Fraction(time), Fraction(time + width)), name, status))
            time += width
    changes.sort(key=lambda change: change.time.low)
    actions = (fill(rng.randint(1, _END - 1)),) if rng.random() < 0.2 else ()
    lap = Fraction(rng.randint(0, _END - 1)) if cycle else None
    return Timeline(robot, initial, tuple(changes), Fraction(_END), actions=actions, cycle=lap)


SHORT = 5


def short_timeline(rng: Random, robot: str, *, touching: bool) -> Timeline:
    """Regions a and b over 5 s, with up to two changes each, at the very ends too; `touching`: whether enclosures may share an end."""
    initial: dict[str, Status] = {"c": "no"}
    changes: list[Change] = []
    for name in "ab":
        status: Status = rng.choice(["no", "no", "may", "must"])
        initial[name] = status
        time = rng.randint(0, 3)
        for _ in range(rng.choice([0, 1, 1, 2])):
            width = rng.choice([0, 0, 1, 2])
            if time + width > SHORT:
                break
            others: list[Status] = [s for s in ("no", "may", "must") if s != status]
            status = rng.choice(others)
            changes.append(Change(Enclosure(Fraction(time), Fraction(time + width)), name, status))
            time += width + rng.randint(0 if touching else 1, 3)
    changes.sort(key=lambda change: change.time.low)
    actions = (fill(rng.randint(1, SHORT - 1)),) if rng.random() < 0.2 else ()
    return Timeline(robot, initial, tuple(changes), Fraction(SHORT), actions=actions)


LAP, LAPS_END = 4, 10


def lap_timeline(rng: Random, robot: str) -> Timeline:
    """Regions a and b over a prefix of 4 s and a lap of 6 s, at whose ends nothing changes and all is as at the lap's beginning."""
    initial: dict[str, Status] = {"c": "no"}
    changes: list[Change] = []
    for name in "ab":
        status: Status = rng.choice(["no", "no", "must", "may"])
        initial[name] = status

        def some(time: int, end: int, count: int, status: Status, name: str = name) -> Status:
            for _ in range(count):
                width = rng.choice([0, 0, 1])
                if time + width >= end:
                    break
                others: list[Status] = [s for s in ("no", "may", "must") if s != status]
                status = rng.choice(others)
                changes.append(Change(Enclosure(Fraction(time), Fraction(time + width)), name, status))
                time += width + rng.randint(1, 2)
            return status

        before = some(1, LAP, rng.choice([0, 0, 1]), status)
        if some(LAP + 1, LAPS_END - 2, rng.choice([0, 1, 1, 2]), before) != before:
            changes.append(Change(Enclosure(Fraction(LAPS_END - 1), Fraction(LAPS_END - 1)), name, before))
    changes.sort(key=lambda change: change.time.low)
    return Timeline(robot, initial, tuple(changes), Fraction(LAPS_END), cycle=Fraction(LAP))
