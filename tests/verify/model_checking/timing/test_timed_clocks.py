"""Random clocks: robots fly within their tubes on clocks that run fast and slow, and no such flight contradicts the verdict."""

from __future__ import annotations

import itertools
import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import pytest

from tests.helpers.few import few_of
from tests.helpers.words.timed_signals import Cells, drawn_formula, truth, truth_for_ever
from verify.data.language.formula import Formula
from verify.model_checking.timeline import Change, Enclosure, Relations, Status, Timeline
from verify.model_checking.timing.timed_verdict import TimedJudge

NAMES = ("a", "b")
STEP = 4
"""s between instants at which labels change, so that clocks have room to differ by whole seconds."""


@dataclass(frozen=True)
class _Tube:
    """Statuses of a robot's regions between instants, `STEP` apart; those from `cycle` on are repeated where there is one."""

    rows: Mapping[str, Sequence[Status]]
    cycle: int | None

    @property
    def count(self) -> int:
        return len(self.rows[NAMES[0]])

    @classmethod
    def drawn(cls, rng: random.Random, count: int, cycle: int | None) -> _Tube:
        rows: dict[str, list[Status]] = {}
        for name in NAMES:
            row: list[Status] = [rng.choice(("no", "may", "must"))]
            while len(row) < count:
                row.append(rng.choice(("no", "may", "must")) if rng.random() < 0.4 else row[-1])
            if cycle is not None:
                row[cycle] = row[-1]  # a lap ends as it begins, and nothing changes there
                if cycle > 0:
                    row[cycle - 1] = row[-1]
            rows[name] = row
        return cls(rows, cycle)

    def timeline(self, robot: str) -> Timeline:
        changes = [
            Change(Enclosure(Fraction(at * STEP), Fraction(at * STEP)), name, row[at])
            for at in range(1, self.count)
            for name, row in self.rows.items()
            if row[at] != row[at - 1]
        ]
        initial: dict[str, Status] = {name: row[0] for name, row in self.rows.items()}
        cycle = None if self.cycle is None else Fraction(self.cycle * STEP)
        return Timeline(robot, initial, tuple(changes), Fraction(self.count * STEP), cycle=cycle)

    def flown(self, rng: random.Random, laps: int) -> dict[str, tuple[list[bool], list[bool]]]:
        """Return for each region whether the robot is in it between instants, and at them; of laps what they repeat for ever is the last one."""
        found: dict[str, tuple[list[bool], list[bool]]] = {}
        for name, row in self.rows.items():
            written = [*row, *[status for _ in range(laps) for status in row[self.cycle :]]] if self.cycle is not None else row
            likely = rng.choice((0.0, 0.5, 1.0))
            between = [status == "must" or (status == "may" and rng.random() < likely) for status in written]
            period = None if self.cycle is None else self.count - self.cycle
            instants: list[bool] = []
            for at, status in enumerate(written):
                before = at - 1 if at or period is None else None
                loops = period is not None and at == len(written) - period
                sides = [between[at], *([between[before]] if before is not None and before >= 0 else [])]
                sides += [between[-1]] if loops else []
                beside = {status, *({written[at - 1]} if at else set())}
                instants.append(any(sides) or (beside == {"may"} and rng.random() < 0.3))
            found[name] = between, instants
        return found


def _boundaries(rng: random.Random, count: int, error: int, period: int | None) -> list[int]:
    """Return when, on the reference clock, a robot is at each instant of its plan, s; later ones by as much as the last, or as a lap before."""
    while True:
        off = [rng.choice((-error, error, rng.randint(-error, error))) for _ in range(count)]
        if period is not None:
            off += [off[count - period]]
        at = [STEP * number + by for number, by in enumerate(off)]
        if all(one < other for one, other in itertools.pairwise(at)):
            return at[:count]
        error = max(error - 1, 0) if rng.random() < 0.05 else error


def _shown(between: Sequence[bool], instants: Sequence[bool], at: Sequence[int], seconds: int) -> Cells:
    """Return what is shown in cells on the reference clock: before its first instant what is shown there."""
    cells: Cells = []
    for cell in range(2 * seconds):
        number = max((n for n, time in enumerate(at) if 2 * time <= cell), default=-1)
        if number < 0:
            cells.append(instants[0])
        else:
            cells.append(instants[number] if 2 * at[number] == cell else between[number])
    return cells


def _flight(rng: random.Random, tubes: Mapping[str, _Tube], error: int) -> tuple[dict[str, Cells], int]:
    """Return what robots show on the reference clock, as `robot.name`, and the cells that are repeated for ever (0 for none)."""
    cycle = next(iter(tubes.values())).cycle
    laps = 4 if cycle is not None else 0
    signals: dict[str, Cells] = {}
    loop = 0
    for robot, tube in tubes.items():
        flown = tube.flown(rng, laps)
        count = len(flown[NAMES[0]][0])
        period = None if cycle is None else tube.count - cycle
        at = _boundaries(rng, count, error, period)
        if period is not None:  # two more laps, repeated, so that what is repeated lies behind all that clocks may be late
            at += [time + STEP * period * lap for lap in (1, 2, 3) for time in at[count - period :]]
            loop = 2 * STEP * period
        for name, (between, instants) in flown.items():
            more = 0 if period is None else 3
            inside, there = ([*row, *list(row[-(period or 0) :]) * more] for row in (between, instants))
            seconds = STEP * (count + (period or 0) * more) + (error if period is None else -2 * error)
            signals[f"{robot}.{name}"] = _shown(inside, there, at, seconds)
    shortest = min(len(cells) for cells in signals.values())
    return {name: cells[:shortest] for name, cells in signals.items()}, loop


def _counted(rng: random.Random, node: Formula, robots: Sequence[str]) -> Formula:
    """Return a formula in which names are asked of some robot, of one, or of how many."""
    if node.operator == "name":
        kind = rng.random()
        if kind < 0.3:
            return replace(node, robot=rng.choice(robots))
        if kind < 0.6:
            return Formula("count", (node,), bound=(">=", rng.randint(1, len(robots))))
        return node
    return replace(node, arguments=tuple(_counted(rng, part, robots) for part in node.arguments))


def _plain(node: Formula, signals: dict[str, Cells], robots: Sequence[str]) -> Formula:
    """Return the formula over signals of its own for robots and counts."""
    if node.operator in ("name", "count"):
        name, least = (node.arguments[0], node.bound[1]) if node.operator == "count" and node.bound else (node, 1)
        who = [name.robot] if name.robot else robots
        rows = [signals[f"{robot}.{name.name}"] for robot in who]
        key = str(node)
        signals[key] = [sum(cells) >= least for cells in zip(*rows, strict=True)]
        return Formula("name", (), key)
    return replace(node, arguments=tuple(_plain(part, signals, robots) for part in node.arguments))


def assert_no_clocks_contradict(seed: int, count: int, flights: int, *, laps: bool) -> dict[str, int]:
    rng = random.Random(seed)
    found = {"holds": 0, "fails": 0, "undecided": 0}
    for _ in range(count):
        robots = ["r", "s"][: rng.randint(1, 2)]
        length = rng.randint(2, 5)
        cycle = rng.randint(0, length - 2) if laps else None
        tubes = {robot: _Tube.drawn(rng, length, cycle) for robot in robots}
        error = rng.choice([0, 1, 1, 1, 2, 3, 5])
        formula = _counted(rng, _wider(drawn_formula(rng, NAMES, rng.randint(1, 3)), rng.choice([1, 2, 4])), robots)
        lines = {robot: tube.timeline(robot) for robot, tube in tubes.items()}
        verdict = TimedJudge(lines, Relations(), Fraction(error)).judge(formula, slack=False)
        found[verdict.outcome] += 1
        for _ in range(flights):
            signals, loop = _flight(rng, tubes, error)
            plain = _plain(formula, signals, robots)
            holds = truth_for_ever(plain, signals, loop)[0] if loop else truth(plain, signals, 1)[0]
            told = (str(formula), error, lines, signals, loop)
            assert not (verdict.outcome == "holds" and not holds), told
            assert not (verdict.outcome == "fails" and holds), told
    return found


def _wider(node: Formula, factor: int) -> Formula:
    window = node.window and (node.window[0] * factor, None if node.window[1] is None else node.window[1] * factor)
    return replace(node, arguments=tuple(_wider(part, factor) for part in node.arguments), window=window)


@pytest.mark.parametrize("laps", [False, True])
@few_of(1, ("seed", "count"), [(0, 20), (0, 60), (1, 60)])
def test_no_clocks_contradict_the_verdict(seed: int, count: int, laps: bool) -> None:
    found = assert_no_clocks_contradict(seed, count, 5, laps=laps)
    assert found["holds"] > count // 20
    assert found["fails"] > count // 20


@pytest.mark.slow
@pytest.mark.parametrize("laps", [False, True])
@pytest.mark.parametrize("seed", range(500, 510))
def test_no_clocks_of_many_contradict_the_verdict(seed: int, laps: bool) -> None:
    assert_no_clocks_contradict(seed, 200, 8, laps=laps)
