"""What the judge of words costs, and whether its two opinions and its evaluator ever differ.

python tests/benchmarks/words.py                    # times
python tests/benchmarks/words.py --random 3000      # and random words and teams against Spot and plain enumeration
"""

from __future__ import annotations

import argparse
import itertools
import random
import sys
import time
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.helpers.benchmarks import run_benchmark
from tests.helpers.words.spot_reading import spot_accepts
from tests.helpers.words.timelines import mission
from verify import check_samples, check_team, check_word
from verify.data import Formula, Word, parse_formula
from verify.logic.semantics import satisfies
from verify.model_checking import inclusion
from verify.model_checking.timeline import Change, Enclosure, InternalChange, Relations, Status, Timeline
from verify.model_checking.word_claims import judge_formula

FIREFIGHTING = "F loc1 & F loc2 & G(smoke -> carrying)"


def least(function: Callable[[], object], rounds: int = 5) -> float:
    """Return the least time of several runs, in ms of this process; answers kept from earlier runs are forgotten."""
    best = float("inf")
    for _ in range(rounds):
        inclusion._ANSWERS.clear()
        start = time.process_time()
        function()
        best = min(best, time.process_time() - start)
    return best * 1e3


def word(text: str) -> list[set[str]]:
    return [set(letter.split()) for letter in text.split(",")]


def fire_team(robots: int) -> dict[str, list[set[str]]]:
    """Two robots at work, half of the others only fetch water, the rest are idle."""
    carrier = word(", water, water carrying, carrying, smoke carrying, carrying, loc2 carrying, carrying")
    team = {"q0": carrier, "q1": word(", loc1, ")}
    for i in range(2, robots):
        team[f"q{i}"] = word(", water, water carrying, carrying") if i % 2 else word("")
    return dict(itertools.islice(team.items(), robots))


def visits(robot: str, *stays: tuple[str, float, float], wet: float | None = None) -> Timeline:
    """A timeline of 100 s with spells of may of 20 ms around every crossing."""
    changes: list[Change] = []
    for region, start, stop in stays:
        steps: list[tuple[float, Status]] = [
            (start - 0.01, "may"), (start + 0.01, "must"), (stop - 0.01, "may"), (stop + 0.01, "no")
        ]  # fmt: skip
        changes += [Change(Enclosure(Fraction(t), Fraction(t)), region, status) for t, status in steps]
    actions = () if wet is None else (InternalChange(Fraction(wet), "dry", "wet", "a", 0, frozenset({"water"})),)
    return Timeline(robot, dict.fromkeys("abc", "no"), tuple(changes), Fraction(100), actions=actions)


def fire_flight(robots: int) -> dict[str, Timeline]:
    """Take in water at a, fly through b to c; another goes to c; every third of the others fetches water."""
    team = [visits("q0", ("a", 5, 8), ("b", 20, 22), ("c", 30, 33), wet=6.5), visits("q1", ("c", 50, 54))]
    for i in range(2, robots):
        team.append(visits(f"q{i}", ("a", 10 + i / 7, 11 + i / 7), wet=10.5 + i / 7) if i % 3 == 0 else visits(f"q{i}"))
    return {line.robot: line for line in team[:robots]}


def times() -> None:
    """Print the table."""
    print("| what | ms |\n|---|---|")
    formula = parse_formula("G(a -> (!b U c) & F b) & G F a")
    lasso = Word.of([[]] * 50, [["a"], [], ["c"], [], ["b"], []])
    print(f"| `check_word`, lasso of 56 letters | {least(lambda: check_word(formula, lasso)):.2f} |")
    sizes = (1, 2, 3, 5, 10, 20, 50, 100)
    found = []
    for robots in sizes:
        team = fire_team(robots)
        found.append(least(lambda team=team: check_team(FIREFIGHTING, team), 3))
        print(f"| `check_team`, fire fighting, {robots} robots | {found[-1]:.1f} |")
    print(f"| fitted exponent, 10 to 100 robots | {np.polyfit(np.log(sizes[4:]), np.log(found[4:]), 1)[0]:.2f} |")
    for robots in (10, 50, 100):
        team = {f"q{i}": word(f", p{i}, ") for i in range(robots)}
        goals = " & ".join(f"F p{i}" for i in range(robots))
        print(f"| `check_team`, {robots} robots with a goal each | {least(lambda f=goals, t=team: check_team(f, t), 2):.1f} |")
    for robots in (1, 3, 10, 30, 100):
        asked = mission("F b & F c & G(b -> water)", robots=robots)
        flight = fire_flight(robots)
        apart = Relations(frozenset({("a", "b"), ("a", "c"), ("b", "c")}))
        print(
            f"| `judge_formula`, {robots} robots | {least(lambda m=asked, f=flight, r=apart: judge_formula(m, f, r), 3):.1f} |"
        )
    at = np.arange(0, 60, 0.01)
    path = np.stack([np.sin(at / 3) + 1, 0.3 * np.cos(at / 5), 1 + 0 * at], axis=1)
    asked = mission("F a & F(b & F c)")
    print(f"| `check_samples`, 60 s at 100 Hz | {least(lambda: check_samples(at, path, asked, max_speed=1.0)):.1f} |")


def random_formula(dice: random.Random, depth: int, *, with_next: bool) -> Formula:
    if depth == 0 or dice.random() < 0.1:
        return Formula("name", (), dice.choice("abc"))
    unary = ["!", "F", "G", *(["X", "X[!]"] if with_next else [])]
    operator = dice.choice([*unary, "&", "|", "->", "<->", "xor", "U", "W", "R", "M"])
    count = 1 if operator in unary else 2
    parts = tuple(random_formula(dice, depth - 1, with_next=with_next) for _ in range(count))
    return Formula(operator, parts)  # type: ignore[arg-type]  # one of the operators


def compare(rounds: int) -> None:
    """Hold random words and teams against Spot and against all orders; every question is also asked of Spot inside."""
    dice = random.Random(0)
    held = failed = undecided = 0

    def letters(most: int) -> list[frozenset[str]]:
        return [frozenset(n for n in "abc" if dice.random() < 0.35) for _ in range(dice.randint(1, most))]

    for _ in range(rounds):
        formula = random_formula(dice, dice.randint(2, 4), with_next=dice.random() < 0.3)
        finite, lasso = Word.of(letters(6)), Word.of(letters(3), letters(3))
        for asked in (finite, lasso):
            if bool(check_word(formula, asked)) != spot_accepts(formula, asked):
                raise SystemExit(f"check_word and Spot differ on {formula} and {asked}")
        team = {f"q{i}": letters(3) for i in range(dice.randint(1, 4))}
        verdict = check_team(formula, team)
        orders = itertools.permutations(team.values())
        every = all(satisfies(formula, Word(tuple(letter for robot in order for letter in robot))) for order in orders)
        if bool(verdict.sequential) != every or (verdict.parallel and not every):
            raise SystemExit(f"check_team and plain enumeration differ on {formula} and {team}")
        held += verdict.parallel.outcome == "holds"
        failed += verdict.parallel.outcome == "fails"
        undecided += verdict.parallel.outcome == "undecided"
    print(f"\n{rounds} random formulas: no difference; `parallel` held {held}, failed {failed}, undecided {undecided}.")


def main() -> None:
    """Print times, and what came of the comparison."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--random", type=int, default=0, help="random formulas to compare on")
    asked = parser.parse_args()
    times()
    if asked.random:
        compare(asked.random)


if __name__ == "__main__":
    run_benchmark(main, ["--random", "5"])
