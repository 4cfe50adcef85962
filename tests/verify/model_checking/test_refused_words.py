"""Words that break a formula: grazes and bumps that no sampler sees, robots that come too early; with letters and times."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.kernel.witnesses import ANY, Right, around, assert_refused, judged
from tests.helpers.motion.flights import changed, legs, plan_of, small_mission
from verify.data.language.word import Word
from verify.data.mission import Mission
from verify.data.plan import Visit
from verify.data.trajectory import Trajectory
from verify.logic.semantics import satisfies

# Grazes, bumps and other things that no sampler sees.


@few_of(3, "direction", range(8))
@few_of(2, "depth", [1e-9, 1e-7, 1e-5, 1e-3])
def test_a_graze_breaks_never(direction, depth):
    """A straight path that dips into a ball by 1e-9 m is inside for a stretch of 2e-5 m; one that misses it by as much is not."""
    angle = direction * math.pi / 4
    line = legs([[0, 0, 1], [2, 0, 1]])
    for sign in (-1, 1):
        y, z = (0.2 + sign * depth) * math.cos(angle), 1 + (0.2 + sign * depth) * math.sin(angle)
        mission = small_mission("G !a", starts=[[0.0, y, z]])
        values = line.coefficients.copy()
        values[:, 1, 0], values[:, 2, 0] = y, z
        path = changed(line, coefficients=values)
        certificate = judged(plan_of(mission, {}), {"r0": path})
        if sign > 0:
            assert certificate.holds
            continue
        half = math.sqrt(2 * 0.2 * depth) / (2.1875 * 0.45)  # s, at the leg's greatest speed
        window = around(path.duration / 2, 1.05 * half)
        formula, _ = assert_refused(
            certificate,
            Right("formula", "r0", "a", None, window, says="it must not hold: `a`"),
            Right("visits", "r0", "a", None, window, says="not planned"),
        )
        assert [letter for _, letter in formula.witness.word] == [frozenset(), frozenset("a"), frozenset()]
        low, high = formula.witness.times[1]
        assert window[0] <= low <= path.duration / 2 <= high <= window[1]


def bumped(quantity: str) -> Trajectory:
    """Return a flight along x with a bump of 2 ms: out of the ball around (1, 0, 1), or of the speed."""
    values = np.zeros((3, 4, 8))
    values[:, 2, 0] = 1.0
    if quantity == "place":
        values[:, 0, 0] = 1.19
        values[1, 0, 1:3] = [0.02 * 4 / 0.002, -0.02 * 4 / 0.002**2]
        return Trajectory([0.5005, 0.002, 0.5], values)
    values[:, 0, 1] = 1.0  # v = 1 + 4e-6 s (1 - s) with s = t / 1 ms
    values[1, 0, 2:4] = [0.5 * 4e-6 / 1e-3, -(1 / 3) * 4e-6 / 1e-6]
    values[1:, 0, 0] = [0.5, 0.501]
    return Trajectory([0.5, 1e-3, 0.5], values)


@pytest.mark.parametrize("formula", ["G a", "G (a -> G a)", "!F (a & F (!a & F a))"])
def test_an_exit_and_a_re_entry_between_two_samples(formula):
    path = bumped("place")
    mission = small_mission(formula, starts=[[1.19, 0.0, 1.0]])
    sampled = path.evaluate(np.arange(0, 1, 0.01))[:, :3]
    assert np.all(mission.all_regions["a"].level(sampled) <= 1)
    (claim,) = assert_refused(judged(plan_of(mission, {"r0": [Visit(region="a")]}), {"r0": path}), Right("formula", "r0"))
    outside = [when for (_, letter), when in zip(claim.witness.word, claim.witness.times, strict=True) if not letter]
    assert outside
    for low, high in outside:
        assert 0.5005 <= low < high <= 0.5025
        assert float(mission.all_regions["a"].level(path.evaluate((low + high) / 2)[:3])) > 1


def test_a_limit_passed_by_a_millionth_for_a_millisecond():
    path = bumped("speed")
    mission = small_mission(regions="", extra="limits: {speed: 1.0}")
    assert np.linalg.norm(path.evaluate(np.linspace(0, 1, 101), 1)[:, :3], axis=1).max() <= 1.0
    assert_refused(
        judged(plan_of(mission, {}), {"r0": path}),
        Right("limits.speed", "r0", None, None, (0.5, 0.501), off=(0.999e-6, 1.001e-6), says="1.000001 m/s"),
    )


def test_visiting_once_is_provable_without_a_margin_only():
    mission = small_mission("F a & G(a -> (a U G !a))")
    path, plan = {"r0": legs([[0, 0, 1], [2, 0, 1]])}, plan_of(mission, {"r0": [Visit(region="a")]})
    assert judged(plan, path, margin=0.0).holds
    (claim,) = assert_refused(judged(plan, path, margin=0.01), Right("formula", "r0"))
    word = [letter for _, letter in claim.witness.word]
    assert word[-2:] == [frozenset(), frozenset("a")] or frozenset("a") in word[word.index(frozenset("a")) + 2 :]


# Words: what was read, of whom, when; every one of them is held against the path and the formula.

HOUSE = """a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}
b: {center: [2.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}
c: {center: [1.0, 0.0, 1.0], radii: [0.1, 0.1, 0.1]}"""
EAST, WEST = [[0, 0, 1], [2, 0, 1]], [[0, 1, 1], [2, 1, 1], [2, 0, 1]]
BESIDE = [[0, 1, 1], [2, 1, 1], [2, 0.15, 1]]
"""To the other side of b: two vehicles fit into it."""
WORDS = [
    # formula, reading, holds of each robot, the robot, region and part of the sentence of the witness
    ("G !a", "own", [0.0], "r0", "a", "it must not hold"),
    ("F d | G !b", "own", [0.0], ANY, ANY, ""),
    ("!b U c & G !c", "own", [0.0], "r0", "c", "`c`"),
    ("G (c -> !a)", "own", [0.0], "r0", ANY, ""),
    ("!F (a & F b)", "own", [0.0], ANY, ANY, ""),
    ("F (b & F a)", "own", [0.0], ANY, ANY, "never"),
    ("!b U a", "own", [4.0, 0.0], ANY, ANY, ""),
    ("F G !b", "own", [0.0], ANY, ANY, ""),
    ("G (b -> F a)", "own", [0.0, 3.0], ANY, ANY, ""),
    ("G !(a & b)", "joint", [4.3, 0.0], ANY, ANY, ""),
    ("!F (a & b)", "joint", [4.3, 0.0], ANY, ANY, ""),
    ("F (a & b) & G !(c & b)", "joint", [3.0, 0.0], ANY, ANY, ""),
]


@pytest.mark.parametrize(
    ("formula", "reading", "holds", "robot", "region", "says"), WORDS, ids=[f"{w[1]} {w[0]}" for w in WORDS]
)
@few_of(1, "margin", [0.0, 0.03])
def test_counterexamples(formula, reading, holds, robot, region, says, margin):
    regions = HOUSE + "\nd: {center: [0.0, -3.0, 1.0], radii: [0.2, 0.2, 0.2]}"
    starts = [EAST[0], WEST[0]][: len(holds)]
    mission = small_mission(formula, regions=regions, starts=starts)
    mission = mission.model_copy(update={"separation": 0.0, "spec": mission.spec.model_copy(update={"team": reading})})
    team = {f"r{i}": legs([EAST, WEST][i], hold=hold) for i, hold in enumerate(holds)}
    certificate = judged(plan_of(mission, {}), team, margin=margin)
    if next(c for c in certificate.claims if c.name == "formula").outcome == "holds":
        pytest.fail("this formula was to be broken")
    (claim,) = assert_refused(certificate, Right("formula", robot, region, says=says))
    witness = claim.witness
    assert not satisfies(mission.formula, Word(tuple(letter for _, letter in witness.word)))
    assert len(witness.times) == len(witness.word)
    lows = [low for low, _ in witness.times]
    assert lows == sorted(lows)
    for (name, letter), (low, high) in zip(witness.word, witness.times, strict=True):
        assert 0 <= low <= high <= certificate.duration
        names = list(team) if name == "team" else [name]
        times = np.linspace(low, high, 41)
        assert any(could_be(mission, [team[n] for n in names], letter, float(t), margin) for t in times), (
            name,
            letter,
            low,
            high,
        )


def could_be(mission: Mission, paths: list[Trajectory], letter: frozenset[str], time: float, margin: float) -> bool:
    """Tell whether robots within the margin of their paths can show a letter together at a time (regions are balls)."""
    for region_name, region in mission.all_regions.items():
        distances = [float(np.linalg.norm(path.evaluate(time)[:3] - np.array(region.center))) for path in paths]
        radius = region.radii[0]
        inside = min(distances) <= radius + margin + 1e-6
        outside = min(distances) >= radius - margin - 1e-6
        if not (inside if region_name in letter else outside):
            return False
    return True


@pytest.mark.parametrize("hold", [0.0, 1.0, 3.0])
def test_one_robot_flown_at_another_time_breaks_the_order_of_the_team(hold):
    """r1 comes to b; r0 must have been at a before. Flown early enough, r1 is first."""
    starts = [EAST[0], WEST[0]]
    mission = small_mission("!b W a", regions=HOUSE, starts=starts).model_copy(update={"separation": 0.14})
    visits = {"r0": [Visit(region="a"), Visit(region="c"), Visit(region="b")], "r1": [Visit(region="b")]}
    team = {"r0": legs(EAST, hold=hold + 6), "r1": legs(BESIDE, hold=hold)}
    late = {"r0": legs(EAST), "r1": legs(BESIDE, hold=hold + 3)}
    plan = plan_of(mission, visits)
    assert judged(plan, late).holds
    arrives = (team["r1"].knots[-2], team["r1"].knots[-1])
    (claim,) = assert_refused(judged(plan, team), Right("formula", "r1", "b", 0, arrives))
    assert ("r1", frozenset("b")) in claim.witness.word
    assert ("r0", frozenset("a")) not in claim.witness.word[: claim.witness.word.index(("r1", frozenset("b")))]
