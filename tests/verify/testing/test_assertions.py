import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.helpers.words.timelines import mission
from verify import Trajectory
from verify.data import BadInput, FormulaError
from verify.logic.verdict import show_readings
from verify.testing import assert_satisfies, assert_within_limits

REGIONS = {"a": ((0.5, 0, 1), 0.2), "b": ((0, 1, 1), (0.3, 0.2, 0.2))}


def straight(speed: float = 0.5, *, cycle: int | None = None) -> Trajectory:
    """From x = -1 to x = 1 at height 1."""
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, 0, :2] = -1, speed
    coefficients[0, 2, 0] = 1
    return Trajectory([2 / speed], coefficients, cycle=cycle)


def test_a_flight_that_satisfies():
    assert_satisfies(straight(), "F a & G !b", REGIONS)
    assert_satisfies(straight(), "F a & !F(a & F(!a & F a))", REGIONS)
    assert_satisfies(straight(), "F a & free", REGIONS, margin=0.05)


def test_a_failure_prints_sentence_counterexample_and_timeline():
    with pytest.raises(AssertionError) as failure:
        assert_satisfies(straight(), "F b", REGIONS)
    text = str(failure.value)
    assert "`b` never happens" in text
    assert "counterexample: robot {}, {a}, {}" in text
    assert "a: no from 0 s, must from 2.6 s, no from 3.4 s" in text


@pytest.mark.parametrize("count", [24, 25, 60])
def test_long_counterexamples_are_cut_in_the_middle(count):
    readings = tuple(("q0" if i < 2 else "q1", frozenset({f"p{i}"})) for i in range(count))
    shown = show_readings(readings).split(", ")
    whole = [f"{{p{i}}}" for i in range(count)]
    whole[0], whole[2] = "q0 {p0}", "q1 {p2}"
    assert shown == (whole if count <= 24 else [*whole[:12], "...", *whole[-12:]])


def test_at_a_margin_the_edge_is_open():
    with pytest.raises(AssertionError, match=r"may from 2\.5 s"):
        assert_satisfies(straight(), "F a & !F(a & F(!a & F a))", REGIONS, margin=0.05)


def test_samples_need_a_speed_bound():
    times = np.linspace(0, 4, 201)
    samples = (times, straight().evaluate(times)[:, :3])
    with pytest.raises(AssertionError, match="a sampled path proves nothing without a speed bound"):
        assert_satisfies(samples, "F a", REGIONS)
    assert_satisfies(samples, "F a & G !b", REGIONS, max_speed=0.6)
    with pytest.raises(AssertionError, match="Violated"):
        assert_satisfies(samples, "F b", REGIONS, max_speed=0.6)


def test_regions_of_a_mission():
    assert_satisfies(straight(), "F a & F b & !F c", mission("true"))


def test_limits_for_all_times():
    assert_within_limits(straight(), speed=0.6)
    with pytest.raises(AssertionError, match=r"speed reaches 0\.5 m/s"):
        assert_within_limits(straight(), speed=0.4)


def pieces(*rows: dict[int, tuple[float, ...]], cycle: int | None = None) -> Trajectory:
    """Pieces of 1 s at height 1; each names ascending coefficients by axis."""
    coefficients = np.zeros((len(rows), 4, 8))
    coefficients[:, 2, 0] = 1
    for piece, row in enumerate(rows):
        for axis, values in row.items():
            coefficients[piece, axis, : len(values)] = values
    return Trajectory(np.ones(len(rows)), coefficients, cycle=cycle)


@pytest.mark.parametrize(
    ("flight", "what"),
    [
        (pieces({0: (0,)}, {0: (100,)}), r"position between pieces 0 and 1 jumps by up to 100 at 1\.0000 s"),
        (pieces({0: (0, 0.45)}, {0: (0.45, -0.45)}), r"velocity between pieces 0 and 1 jumps by up to 0\.9"),
        (pieces({0: (0, 0, 0.04)}, {0: (0.04, 0.08, -0.04)}), r"acceleration between pieces 0 and 1 jumps by up to 0\.16"),
        (pieces({0: (0,)}, {0: (0, 0, 0, 0.1)}), r"jerk between pieces 0 and 1 jumps by up to 0\.6"),
        (pieces({3: (0,)}, {3: (2,)}), "heading between pieces 0 and 1 jumps by up to 2"),
        (pieces({3: (0,)}, {3: (0, 1)}), "heading's rate between pieces 0 and 1 jumps by up to 1"),
        (pieces({0: (0,)}, {0: (0,)}, {0: (50,)}, cycle=0), "position between pieces 1 and 2 jumps by up to 50"),
        (pieces({0: (0, 0.3)}, {0: (0.3, 0.3)}, cycle=0), r"position at the end jumps by up to 0\.6"),
        (pieces({3: (0, 1)}, cycle=0), r"heading at the end jumps by up to 1"),
    ],
)
def test_joints_and_seams_are_judged(flight: Trajectory, what: str):
    with pytest.raises(AssertionError, match=what):
        assert_within_limits(flight)


def test_a_joint_at_which_nothing_jumps_is_none():
    smooth = pieces({0: (0, 0.3, 0.01)}, {0: (0.31, 0.32, 0.01)})
    assert_within_limits(smooth)
    with pytest.raises(AssertionError, match=r"velocity at the end jumps by up to 0\.34"):
        assert_within_limits(smooth, rest=True)
    assert_within_limits(pieces({3: (1.0,)}, {3: (1.0,)}), rest=True)
    assert_within_limits(pieces({0: (2,), 3: (1.0,)}, cycle=0), rest=True)


def test_limits_of_legs_are_refused_rather_than_ignored():
    with pytest.raises(BadInput, match="legs: limits on the way to a region need a plan"):
        assert_within_limits(straight(), legs={"a": {"speed": 0.1}})  # type: ignore[arg-type]
    with pytest.raises(BadInput, match=r"limits\.speed: 50 is above the vehicle's own 2"):
        assert_within_limits(straight(), speed=50.0)


def test_the_margin_counts_for_samples_too():
    times = np.linspace(0, 4, 2001)
    samples = (times, straight().evaluate(times)[:, :3])
    region = {"c": ((0, 0.5, 1), 0.3)}  # 0.2 m beside the way
    assert_satisfies(samples, "G !c", region, max_speed=0.6, margin=0.19)
    assert_satisfies(straight(), "G !c", region, margin=0.19)
    with pytest.raises(AssertionError, match="too sparse"):
        assert_satisfies(samples, "G !c", region, max_speed=0.6, margin=0.21)
    with pytest.raises(AssertionError, match="c: no from 0 s, may from"):
        assert_satisfies(straight(), "G !c", region, margin=0.21)
    with pytest.raises(BadInput, match=r"at most 0\.1 m/s and .* m of error"):
        assert_satisfies(samples, "G !c", region, max_speed=0.1, margin=0.19)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), "high", 10**400], ids=["nan", "inf", "text", "huge"])
def test_numbers_that_are_none(bad):
    for samples in (([0, 1], [[bad, 0, 1], [0, 0, 1]]), ([0, bad], [[0, 0, 1], [0, 0, 1]])):
        with pytest.raises(BadInput, match=r"positions\[0, 0\]|times\[1\]|as numbers"):
            assert_satisfies(samples, "F a", REGIONS, max_speed=1.0)
    with pytest.raises(BadInput, match="Region 'a' must be"):
        assert_satisfies(straight(), "F a", {"a": ((bad, 0, 1), 0.2)})
    with pytest.raises(BadInput, match="speed"):
        assert_within_limits(straight(), speed=bad)


def test_bad_input():
    with pytest.raises(FormulaError):
        assert_satisfies(straight(), "F nowhere", REGIONS)
    with pytest.raises(BadInput, match="Region 'a' must be"):
        assert_satisfies(straight(), "F a", {"a": 3})
    with pytest.raises(BadInput, match="as \\(times, positions\\)"):
        assert_satisfies(3, "F a", REGIONS, max_speed=1)  # type: ignore[arg-type]
    with pytest.raises(BadInput, match="Samples are times"):
        assert_satisfies(([0, 1], [[0, 0, 1]]), "F a", REGIONS, max_speed=1)
    with pytest.raises(BadInput, match="Regions are a mission"):
        assert_satisfies(straight(), "F a", [("a", 3)])  # type: ignore[arg-type]
    with pytest.raises(BadInput, match="Give a Trajectory"):
        assert_within_limits(np.zeros(3))  # type: ignore[arg-type]
    with pytest.raises(BadInput, match="sped"):
        assert_within_limits(straight(), sped=1.0)
    with pytest.raises(BadInput, match="not a shipped vehicle"):
        assert_within_limits(straight(), vehicle="balloon")


@pytest.mark.parametrize("margin", [-0.2, float("nan"), float("inf"), True, "0.1", 10**400])
def test_margins_must_be_numbers(margin):
    with pytest.raises(BadInput, match="margin"):
        assert_satisfies(straight(), "G !a", REGIONS, margin=margin)


@pytest.mark.slow
def test_as_a_plugin(tmp_path: Path):
    (tmp_path / "test_it.py").write_text(
        "from verify.testing import assert_satisfies\n"
        "def test_it():\n"
        "    assert_satisfies(([0, 1], [[0, 0, 1], [0.5, 0, 1]]), 'G !a', {'a': ((0, 0, 1), 0.2)}, max_speed=1)\n"
    )
    root = str(Path(__file__).parents[3])
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "verify.testing", "-p", "no:cacheprovider", str(tmp_path)],
        capture_output=True, text=True, cwd=tmp_path, env={"PYTHONPATH": root, "PATH": "/usr/bin:/bin"}, check=False,
    )  # fmt: skip
    assert "verify: flights are judged for all times" in done.stdout
    assert "Violated" in done.stdout
    assert "1 failed" in done.stdout
