from fractions import Fraction
from random import Random

import numpy as np
import pytest
from hypothesis import strategies as st

from tests.helpers.few import given_few
from tests.helpers.words.timelines import mission, random_readings, random_unions
from tests.strategies import formulas
from verify import check_samples
from verify.data import BadInput, Mission, Word
from verify.logic.semantics import satisfies
from verify.recordings.measurement import longest_gaps
from verify.recordings.sampled_timelines import sampled_timeline
from verify.recordings.samples import check_recording

CENTRES = {"a": (0, 0, 1), "b": (1, 0, 1), "c": (2, 0, 1)}  # of radius 0.1


def along(points: list[tuple[float, float]], times: np.ndarray) -> np.ndarray:
    """Fly at 1 m/s through (x, y) at height 1, then hover."""
    corners = np.array([(x, y, 1.0) for x, y in points])
    reached = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    return np.stack([np.interp(times, reached, corners[:, i]) for i in range(3)], axis=1)


ACROSS = [(-0.5, 0.0), (2.5, 0.0)]  # through a, b and c in 3 s
AROUND = [(-0.5, 0.3), (2.5, 0.3)]


def judged(formula: str, points=ACROSS, rate: float = 50, speed: float | None = 1.2, **options):
    times = np.arange(0, 3 + 0.5 / rate, 1 / rate)
    return check_samples(times, along(points, times), mission(formula), max_speed=speed, **options)


def test_satisfied_whatever_happened_in_between():
    verdict = judged("F a & F(b & F c) & (!c U b)")
    assert verdict
    assert verdict.sentence.startswith("Satisfied")


def test_violated_whatever_happened_in_between():
    verdict = judged("F a", AROUND)
    assert verdict.outcome == "fails"
    assert verdict.sentence.startswith("Violated, whatever happened")
    assert judged("G !b").outcome == "fails"


def test_too_sparse_to_tell_with_the_rate_that_would_do():
    verdict = judged("F a & G !(a & b)", rate=1.25)
    assert verdict.outcome == "undecided"
    assert "too sparse to tell" in verdict.sentence
    rate = float(verdict.sentence.split("about ")[1].split()[0])
    assert judged("F a & G !(a & b)", rate=rate)


def test_at_the_edge_no_rate_would_do():
    verdict = judged("!F(a & F(!a & F a))", rate=100)
    assert verdict.outcome == "undecided"
    assert "no rate that was tried would do" in verdict.sentence


def test_a_faster_robot_could_have_been_elsewhere():
    assert judged("G !c", [(-0.5, 0), (1.5, 0)], rate=20, speed=1.2)
    verdict = judged("G !c", [(-0.5, 0), (1.5, 0)], rate=20, speed=20)
    assert verdict.outcome == "undecided"


def test_the_measurement_error_counts():
    near = [(-0.5, 0.13), (2.5, 0.13)]
    assert judged("G !a", near, error=0.005, speed=1.01)
    assert judged("G !a", near, error=0.05, speed=1.01).outcome == "undecided"


def test_no_speed_bound_no_proof():
    with pytest.raises(BadInput, match="proves nothing without a speed bound"):
        judged("F a", speed=None)


def test_samples_that_the_speed_does_not_allow():
    with pytest.raises(BadInput, match=r"samples 0 and 1 are 0\.02 m apart"):
        judged("F a", speed=0.5)
    assert judged("F a", speed=1.0)


@pytest.mark.parametrize(
    ("times", "positions", "options", "says"),
    [
        ([0, 1], [[0, 0, 1]], {}, r"shape \(2, 3\)"),
        ([0, 0], [[0, 0, 1]] * 2, {}, "must increase"),
        ([0, np.nan], [[0, 0, 1]] * 2, {}, "finite"),
        ([0, 1], [[0, 0, np.inf]] * 2, {}, "finite"),
        ([], np.zeros((0, 3)), {}, "at least one sample"),
        ([0, 1], [[0, 0]] * 2, {}, "shape"),
        ([0, 1], "here", {}, "array of numbers"),
        ([0, 1], {"q7": [[0, 0, 1]] * 2}, {}, "positions name q7"),
        ([0, 1], [[0, 0, 1]] * 2, {"error": -1}, "error must be"),
        ([0, 1], [[0, 0, 1]] * 2, {"max_speed": 0}, "above 0"),
        ([0, 1], [[0, 0, 1]] * 2, {"max_speed": True}, "max_speed must be"),
        ([0, 1], [[0, 0, 1]] * 2, {"max_speed": 10**400}, "max_speed must be"),
        ([0, 1], [[0, 0, 1]] * 2, {"max_speed": 1e308}, "max_speed must be"),
        ([0, 1], [[0, 0, 1]] * 2, {"max_speed": 5e-324}, "max_speed must be"),
        ([0, 1], [[0, 0, 1]] * 2, {"max_speed": np.inf}, "max_speed must be"),
        ([0, 1], [[0, 0, 1]] * 2, {"error": 10**400}, "error must be"),
        ([0, 1], [[0, 0, 1]] * 2, {"error": np.nan}, "error must be"),
        ([0, 1], [[1e200, 0, 1]] * 2, {}, "no flight"),
        ([-1e308, 1e308], [[0, 0, 1]] * 2, {}, "no flight"),
        ([-1e9, 1.0, np.nextafter(1.0, 2)], [[0, 0, 1]] * 3, {}, "must increase"),
    ],
)
def test_bad_input(times, positions, options, says):
    with pytest.raises(BadInput, match=says):
        check_samples(times, positions, mission("F a"), **{"max_speed": 1.0, **options})


def test_infinite_traces_are_not_recorded():
    with pytest.raises(BadInput, match="recorded flight ends"):
        check_samples([0], [[0, 0, 1]], mission("G F a", trace="infinite"), max_speed=1)


def test_one_sample_is_a_flight_of_no_length():
    assert check_samples([0], [[0, 0, 1]], mission("F a"), max_speed=1)
    assert check_samples([0], [[0, 0.5, 1]], mission("F a"), max_speed=1).outcome == "fails"
    assert check_samples([0], [[0, 0.1, 1]], mission("F a"), max_speed=1, error=0.01).outcome == "undecided"


def test_internal_propositions_come_from_the_log():
    times = np.arange(0, 3.01, 0.02)
    positions = along(ACROSS, times)
    with pytest.raises(BadInput, match="'water'"):
        check_samples(times, positions, mission("G(b -> water)"), max_speed=1.2)
    dry = {"q0": [set() for _ in times]}
    assert check_samples(times, positions, mission("G(b -> water)"), max_speed=1.2, internal=dry).outcome == "fails"
    wet = {"q0": [{"water"} if time > 0.6 else set() for time in times]}
    assert check_samples(times, positions, mission("G(b -> water)"), max_speed=1.2, internal=wet)
    late = {"q0": [{"water"} if time > 1.41 else set() for time in times]}
    assert check_samples(times, positions, mission("G(b -> water)"), max_speed=1.2, internal=late).outcome != "holds"


def test_recordings_are_read_from_flight_logs(tmp_path):
    times = np.arange(0, 3.01, 0.02)
    rows = ["t,robot,x,y,z,letter"]
    for time, (x, y, z) in zip(times, along(ACROSS, times), strict=True):
        rows.append(f"{float(time)!r},q0,{float(x)!r},{float(y)!r},{float(z)!r},{'water' if time > 0.6 else ''}")
    path = tmp_path / "flight.csv"
    path.write_text("\n".join(rows))
    assert check_recording(path, mission("G(b -> water) & F c"), max_speed=1.2)
    path.write_text("t,x,y,z\n0,0,0,1\n")
    with pytest.raises(BadInput, match="column 'robot' is missing"):
        check_recording(path, mission("F a"), max_speed=1)
    path.write_text("t,robot,x,y,z\n0,q9,0,0,1\n")
    with pytest.raises(BadInput, match="line 2: 'q9' is not a robot"):
        check_recording(path, mission("F a"), max_speed=1)
    path.write_text("t,robot,x,y,z\n0,q0,zero,0,1\n")
    with pytest.raises(BadInput, match="line 2: t, x, y and z must be numbers"):
        check_recording(path, mission("F a"), max_speed=1)
    with pytest.raises(BadInput, match="cannot be read"):
        check_recording(tmp_path / "none.csv", mission("F a"), max_speed=1)


def test_near_a_sample_the_status_is_known():
    line = sampled_timeline(
        "q0", np.array([0.0, 1.0, 2.0]), np.array([[-0.5, 0, 1], [0, 0, 1], [0.5, 0, 1]]), mission("F a").all_regions, speed=1.0
    )
    assert line.initial["a"] == "no"
    assert [change.status for change in line.changes if change.region == "a"] == ["may", "must", "may", "no"]
    inside = [change.time.low for change in line.changes if change.region == "a"]
    assert inside[1] < 1 < inside[2]


def dense_signal(asked: Mission, points: list[tuple[float, float]], times: np.ndarray):
    path = along(points, times)
    letters = [
        frozenset(name for name, centre in CENTRES.items() if np.linalg.norm(point - np.array(centre)) <= 0.1) for point in path
    ]
    return [
        (Fraction(float(time)), letter)
        for i, (time, letter) in enumerate(zip(times, letters, strict=True))
        if i == 0 or letter != letters[i - 1]
    ]


corners = st.tuples(st.sampled_from([-0.4, 0.0, 0.5, 1.0, 1.5, 2.0, 2.4]), st.sampled_from([0.0, 0.0, 0.05, 0.15, 0.5]))


@given_few(
    4,
    15,
    formulas(size=6),
    st.lists(st.lists(corners, min_size=2, max_size=4), min_size=1, max_size=2),
    st.sampled_from(["own", "joint"]),
    st.sampled_from([7.0, 30.0]),
    st.randoms(),
)
def test_verdicts_are_true_of_the_path_that_was_sampled(formula, flights, team, rate, rng: Random):
    asked = mission(str(formula), team=team, robots=len(flights))
    times = np.arange(0, 4 + 0.5 / rate, 1 / rate)
    verdict = check_samples(times, np.stack([along(f, times) for f in flights], axis=1), asked, max_speed=1.1, budget=20_000)
    dense = np.linspace(0, times[-1], 4001)
    signals = [dense_signal(asked, flight, dense) for flight in flights]
    end = Fraction(float(times[-1]))
    words = [random_readings(signals, end, rng) if team == "own" else random_unions(signals, rng) for _ in range(10)]
    answers = [satisfies(asked.formula, Word(word)) for word in words]
    if verdict.outcome == "holds":
        assert all(answers)
    if verdict.outcome == "fails" and (team == "joint" or len(flights) == 1):
        assert not any(answers)


def test_gaps_that_the_clock_has_rounded_are_taken_for_longer():
    """Set to 0, times that pass a power of two lose their last bit: a gap may be longer than it looks."""
    rng = np.random.default_rng(0)
    at = np.unique(np.concatenate([[-0.1], rng.uniform(2.0**20 - 0.1, 2.0**20 - 0.1 + 1e-7, 200)]))
    times, true = at - at[0], np.diff([Fraction(float(t)) for t in at])
    assert all(Fraction(float(gap)) >= length for gap, length in zip(longest_gaps(times), true, strict=True))
    assert any(Fraction(float(gap)) < length for gap, length in zip(np.diff(times), true, strict=True))


def test_a_log_that_is_no_csv_is_bad_input(tmp_path):
    path = tmp_path / "flight.csv"
    path.write_text("t,robot,x,y,z\n0,q0,0,0," + "1" * 200_000)
    with pytest.raises(BadInput, match="no CSV"):
        check_recording(path, mission("F a"), max_speed=1)


def test_a_status_near_a_sample_is_not_held_for_too_long():
    """Whoever flies off at once, at full speed, leaves the region no sooner than the timeline says."""
    regions = mission("F a").all_regions
    rng = np.random.default_rng(1)
    for start in (0.0, 1.0, 1e5):
        for _ in range(20):
            point = np.array([rng.uniform(-0.2, 0.2), rng.uniform(-0.1, 0.1), 1.0])
            speed, error = float(rng.uniform(0.5, 5)), float(rng.choice([0.0, 0.01]))
            line = sampled_timeline(
                "q0", start + np.array([0.0, 1.0]), np.stack([point, point]), regions, speed=speed, error=error
            )
            status, until = line.initial["a"], [c.time.low for c in line.changes if c.region == "a"]
            if status == "may" or not until:
                continue
            distance = abs(Fraction(1, 10) - Fraction(float(np.linalg.norm(point - np.array([0.0, 0.0, 1.0])))))
            assert (until[0] - Fraction(start)) * Fraction(speed) + Fraction(error) <= distance
