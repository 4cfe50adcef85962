"""Recordings and logs are read exactly or refused: one column a meaning, one row a robot and time, no digit lost."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import strategies as st

import flight
from tests.helpers.few import given_few
from tests.helpers.motion.flights import small_mission
from verify import check_recording, check_samples
from verify.data import BadInput
from verify.data.storage.tables import counted, decimal, rounding, since

HEAD = "t,robot,x,y,z\n"


def read(tmp_path: Path, text: str, *robots: str, **options: object) -> flight.Recording:
    (tmp_path / "mocap.csv").write_text(text)
    return flight.read_recording(tmp_path / "mocap.csv", robots or ("r0",), **options)


@pytest.mark.parametrize(
    ("text", "robots", "says"),
    [
        (HEAD + "0,r0,0,0,1\n1,r0,5,5,1\n1,r0,0,0,1\n", ("r0",), ":4: 'r0' stands twice at one time, here and on line 3"),
        (HEAD + "0,r0,0,0,1\n1,r0,5,5,1\n1.0,r0,0,0,1\n", ("r0",), "stands twice"),
        ("t,r0.x,r0.y,r0.z\n0,0,0,1\n1,5,5,1\n1,0,0,1\n", ("r0",), ":4: times must go forward.*same as that of line 3"),
        ("t,r0.x,r0.y,r0.z\n0,0,0,1\n1,0,0,1\n", ("r0", "R0"), "no columns for the position of 'R0'"),
        ("t,R0.x,R0.y,R0.z\n0,0,0,1\n1,0,0,1\n", ("r0",), "no columns for the position of 'r0'"),
        (HEAD + "0,R0,0,0,1\n1,R0,0,0,1\n", ("r0",), "no rows for 'r0'"),
        ("t,px,x,y,z\n0,9,0,0,1\n1,9,0,0,1\n", ("r0",), r"several columns .* x .*'px' \(column 2\), 'x' \(column 3\)"),
        ("t,x,x,y,z\n0,9,0,0,1\n1,9,0,0,1\n", ("r0",), "several columns"),
        ("t,x,x_mm,y,z\n0,0,0,0,1\n1,0,0,0,1\n", ("r0",), "several columns"),
        ("t,time,x,y,z\n0,9,0,0,1\n1,8,0,0,1\n", ("r0",), "several columns that could be the time"),
        ("time,time_ns,x,y,z\n0,0,0,0,1\n1,8,0,0,1\n", ("r0",), "several columns that could be the time"),
        ("t,robot,id,x,y,z\n0,r0,1,0,0,1\n1,r0,1,0,0,1\n", ("r0",), "several columns that could be the robot's name"),
        ("t,r0.x,r0.x,r0.y,r0.z\n0,9,0,0,1\n1,9,0,0,1\n", ("r0",), "several columns that could be x of r0's position"),
        ("t,x,y,z,r0.x,r0.y,r0.z\n0,0,0,1,9,9,9\n1,0,0,1,9,9,9\n", ("r0",), "several columns that could be positions"),
        (HEAD + "0,r0,0,0,1\n1,r0,0,0\n", ("r0",), ":3: 4 cells under 5 columns"),
        (HEAD + "0,r0,0,0,1\n1,r0,0,0,1", ("r0",), "may have been cut"),
        (HEAD + "0,r0,0,0,1\n1,r0,0,,1\n", ("r0",), "2 of its three coordinates"),
        (HEAD + "0,r0,0,0,1_0\n1,r0,0,0,1\n", ("r0",), ":2: z is '1_0'"),
        (HEAD + "0,r0,0,0,1\n\n# a note\n1,r0,0,0,one\n", ("r0",), ":5: z is 'one'"),
        (HEAD + "0,r0,0,0,1\n1e99,r0,0,0,1\n", ("r0",), "finite number"),
    ],
)
def test_nothing_is_chosen_in_silence(tmp_path: Path, text: str, robots: tuple[str, ...], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        read(tmp_path, text, *robots)


def test_robots_that_differ_in_case_or_begin_alike_have_their_own_columns(tmp_path: Path) -> None:
    text = "t,r0.x,r0.y,r0.z,R0.x,R0.y,R0.z,r0_pos_x,r0_pos_y,r0_pos_z\n0,1,2,3,4,5,6,7,8,9\n1,1,2,3,4,5,6,7,8,9\n"
    found = read(tmp_path, text, "R0", "r0", "r0_pos")
    assert found.position[1].tolist() == [[4, 5, 6], [1, 2, 3], [7, 8, 9]]


def test_what_a_column_is_can_be_said(tmp_path: Path) -> None:
    text = "t,time_ns,px,x,y,z\n0,0,9,0,0,1\n9,2000000000,9,0,0,1\n"
    found = read(tmp_path, text, columns={"time_ns": "time_ns", "x": "px"})
    assert found.times.tolist() == [0.0, 2.0]
    assert found.position[:, 0, 0].tolist() == [9.0, 9.0]


def test_rows_of_other_bodies_are_no_samples(tmp_path: Path) -> None:
    found = read(tmp_path, HEAD + "0,wand,9,9,9\n1,r0,0,0,1\n1,wand,9,9,9\n1,wand,8,8,8\n2,r0,1,0,1\n3,wand,9,9,9\n")
    assert found.times.tolist() == [0.0, 1.0]
    assert found.position[:, 0].tolist() == [[0, 0, 1], [1, 0, 1]]


@pytest.mark.parametrize("unit", ["time_ns", "stamp"])
def test_stamps_since_an_epoch_lose_nothing(tmp_path: Path, unit: str) -> None:
    """Nanoseconds since 1970 have nineteen digits, floats sixteen."""
    rng = np.random.default_rng(0)
    stamps = 1_767_225_600_123_456_789 + np.cumsum(rng.integers(1, 20_000_000, 200))
    cells = [str(s) if unit == "time_ns" else f"{s // 10**9}.{s % 10**9:09d}" for s in stamps.tolist()]
    found = read(tmp_path, f"{unit},x,y,z\n" + "".join(f"{cell},0,0,1\n" for cell in cells))
    exact = [Fraction(int(s - stamps[0]), 10**9) for s in stamps]
    assert found.times.tolist() == [float(time) for time in exact]
    begun = read(tmp_path, f"{unit},x,y,z\n" + "".join(f"{c},0,0,1\n" for c in cells), start=1_767_225_600.5)
    assert len(begun.times) < len(found.times)
    assert Fraction(float(begun.times[0])) - Fraction(int(stamps[-len(begun.times)]) - 1_767_225_600_500_000_000, 10**9) < 1e-16


@given_few(
    33, 200, st.lists(st.decimals(-1000, 1000, allow_nan=False, places=6), min_size=1, max_size=6), st.sampled_from([0, -3, -9])
)
def test_decimals_are_rounded_once(values: list, unit: int) -> None:
    numbers = [decimal(f"{value:f}") for value in values]
    assert [n.exact(unit) for n in numbers] == [Fraction(value) * Fraction(10) ** unit for value in values]
    assert [n.float(unit) for n in numbers] == [float(Fraction(value) * Fraction(10) ** unit) for value in values]
    counts, power = counted(numbers, unit)
    zero = Fraction(values[0]) * Fraction(10) ** unit + Fraction(1, 3)
    assert since(counts, power, zero) == [float(Fraction(value) * Fraction(10) ** unit - zero) for value in values]


@given_few(
    33, 200, st.lists(st.floats(-2000, 2000), min_size=1, max_size=8), st.sampled_from([".4f", ".6f", ".9g", ".7e", "r"])
)
def test_what_writing_a_number_lost_is_covered(values: list[float], form: str) -> None:
    texts = [repr(value) if form == "r" else f"{value:{form}}" for value in values]
    numbers = [decimal(text) for text in texts]
    if any(number is None for number in numbers):  # 1e-300 is no measurement
        return
    lost = max(abs(Fraction(value) - number.exact()) for value, number in zip(values, numbers, strict=True))
    bound = rounding(numbers)
    assert bound == 0 or lost <= bound + float(np.spacing(max(map(abs, values))))  # floats themselves count apart
    assert bound <= 5.1e-5
    if form == ".6f":
        assert bound > 0


def at_full_speed(speed: float = 2.2, rate: float = 100.0) -> tuple[np.ndarray, np.ndarray]:
    times = np.arange(0, 2, 1 / rate)
    way = np.array([0.3, 0.5, 0.2]) / np.linalg.norm([0.3, 0.5, 0.2])
    return times, np.array([-2.0, -2.0, 0.5]) + speed * times[:, None] * way


@pytest.mark.parametrize("form", [".9g", ".6f", ".5f", "r"])
def test_a_true_flight_at_the_greatest_speed_is_not_refused_for_rounding(tmp_path: Path, form: str) -> None:
    times, places = at_full_speed()
    mission = small_mission("F a", regions="a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}")
    lines = [
        ",".join(repr(float(v)) if form == "r" else f"{v:{form}}" for v in (t, *p)) for t, p in zip(times, places, strict=True)
    ]
    found = read(tmp_path, "t,x,y,z\n" + "".join(f"{line}\n" for line in lines))
    verdict = check_samples(found.times, found.position, mission, max_speed=2.2, rounding=found.rounding)
    assert verdict.outcome == "fails"
    rows = [line.split(",", 1) for line in lines]
    (tmp_path / "flight.csv").write_text(HEAD + "".join(f"{t},r0,{rest}\n" for t, rest in rows))
    assert check_recording(tmp_path / "flight.csv", mission, max_speed=2.2).outcome == "fails"
    if form == ".9g":  # zeros at the ends are left out, so that nothing tells these times from some that were rounded to 10 ms
        return
    with pytest.raises(BadInput, match="need an error"):
        check_recording(tmp_path / "flight.csv", mission, max_speed=2.19)


def test_stamps_as_floats_are_no_reason_to_refuse(tmp_path: Path) -> None:
    """Times that a caller has as floats since 1970 are a quarter of a microsecond off, which counts as an error."""
    times, places = at_full_speed()
    mission = small_mission("F a", regions="a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}")
    assert check_samples(1.767e9 + times, places, mission, max_speed=2.2).outcome == "fails"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("t,robot,x,y,z,x\n0,r0,0,0,1,0\n", "2 columns 'x'"),
        ("t,robot,x,y,z,letter,letter\n0,r0,0,0,1,,\n", "2 columns 'letter'"),
        ("t,robot,x,y,z\n0,r0,0,0,1\n0,r0,9,9,1\n", "line 3: r0's times must go forward.*the same as"),
        ("t,robot,x,y,z,letter\n0,r0,0,0,1,\n1,r0,0,0,1\n", ":3: 5 cells under 6 columns"),
        ("t,robot,x,y,z\n0,r0,0,0,1\n1,r0,0,0,1", "may have been cut"),
        ("t,robot,x,y,z,letter\n0,r0,0,0,1,wter\n", "'wter' is neither a region nor"),
        ("", "empty"),
        (HEAD, "at least once"),
    ],
)
def test_flight_logs_are_evidence_only_if_they_have_one_meaning(tmp_path: Path, text: str, says: str) -> None:
    (tmp_path / "flight.csv").write_text(text)
    mission = small_mission("F a", regions="a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}")
    with pytest.raises(BadInput, match=says):
        check_recording(tmp_path / "flight.csv", mission, max_speed=1)
