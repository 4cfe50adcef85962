"""The 169 formulas of Spot's pattern lists, asked of ten robots: each is decided; and of two of them as by the judge that interleaves them.

That judge ends for two of these formulas with ten robots, and for nearly all with two.
"""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from random import Random
from typing import Any

import pytest

from tests.helpers.words.plain_word_judge import plainly
from verify.data import Formula, FormulaError, Mission, parse_formula
from verify.model_checking.timeline import Change, Enclosure, Relations, Timeline
from verify.model_checking.word_claims import judge_formula

LISTS = ("DAC", "EH", "HKRSS", "SB", "P")
ROBOTS = 10
LONG = 40
"""s."""


def spot_patterns() -> list[Formula]:
    """Return the formulas of the lists, in the grammar of missions, over regions p1, p2 and so on."""
    gen: Any = pytest.importorskip("spot.gen", reason="Spot is not installed")
    found = [
        parse_formula(f"{pattern:p}") for pattern in gen.ltl_patterns(*(getattr(gen, f"LTL_{name}_PATTERNS") for name in LISTS))
    ]
    return [
        formula.substitute({name: Formula("name", (), f"p{i + 1}") for i, name in enumerate(sorted(formula.names()))})
        for formula in found
    ]


def asked_of(formula: Formula, robots: int, team: str) -> Mission:
    """Return a mission with the regions that a formula names, and robots."""
    names = sorted(formula.names()) or ["p1"]
    place = {name: {"center": (float(i), 0.0, 1.0), "radii": (0.1, 0.1, 0.1)} for i, name in enumerate(names)}
    return Mission.model_validate(
        {
            "name": "patterns",
            "spec": {"formula": str(formula), "team": team},
            "regions": place,
            "agents": {f"q{i}": {"start": (float(i), 3.0, 1.0)} for i in range(robots)},
            "vehicle": "crazyflie-2.1",
            "workspace": {"min": (-5.0, -5.0, 0.0), "max": (20.0, 5.0, 3.0)},
        }
    )


def flown(rng: Random, robot: str, names: list[str]) -> Timeline:
    """Return a flight through one to three of the regions, one after another; entering and leaving take up to a second of *may*."""
    changes: list[Change] = []
    time = rng.randint(1, 6)
    for name in rng.choices(names, k=rng.randint(1, 3)):
        unsure = rng.choice([0, 1])
        stay = rng.randint(2, 5)
        for begin, status in ((time, "may"), (time + unsure, "must"), (time + stay, "may"), (time + stay + unsure, "no")):
            if status != "may" or unsure:
                changes.append(Change(Enclosure(Fraction(begin), Fraction(begin)), name, status))
        time += stay + unsure + rng.randint(1, 4)
    return Timeline(robot, dict.fromkeys(names, "no"), tuple(changes), Fraction(LONG))


def has_next(formula: Formula) -> bool:
    """Tell whether a formula speaks of a next step, of which a flight has none."""
    return formula.operator in ("X", "X[!]") or any(map(has_next, formula.arguments))


def test_lists_are_whole_and_formulas_with_a_next_step_are_refused() -> None:
    patterns = spot_patterns()
    assert len(patterns) == 169
    refused = [formula for formula in patterns if has_next(formula)]
    assert len(refused) == 63
    rng = Random(0)
    for formula in rng.sample(refused, 5):
        asked = asked_of(formula, 1, "own")
        with pytest.raises(FormulaError, match=r"`X` is not allowed in a mission"):
            judge_formula(asked, {"q0": flown(rng, "q0", sorted(formula.names()))}, Relations())


@pytest.mark.slow
@pytest.mark.parametrize("team", ["own", "joint"])
def test_patterns_of_ten_robots_are_decided_and_of_two_as_plainly(team: str) -> None:
    rng, plain = Random(1), Counter[str]()
    for formula in spot_patterns():
        if has_next(formula):
            continue
        names = sorted(formula.names()) or ["p1"]
        lines = [flown(rng, f"q{i}", names) for i in range(ROBOTS)]
        assert decided(formula, lines, team) != "undecided", str(formula)
        slow = plainly(formula, lines[:2], Relations(), team, budget=4_000, spot=False)
        plain[slow] += 1
        assert slow in ("undecided", decided(formula, lines[:2], team)), str(formula)
    assert plain["holds"] + plain["fails"] > 95, plain
    assert min(plain["holds"], plain["fails"]) > 10, plain


def decided(formula: Formula, lines: list[Timeline], team: str) -> str:
    (verdict,) = judge_formula(
        asked_of(formula, len(lines), team), {line.robot: line for line in lines}, Relations(), detail="answer"
    )
    return verdict.outcome
