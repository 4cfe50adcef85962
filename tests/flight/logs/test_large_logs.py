"""Logs of a hundred robots: files stay below 20 MB, read back as they were written, and still tell where everybody was."""

import dataclasses

import numpy as np
import pytest

import flight
from flight.logs.large_logs import MOST, MOST_BYTES, WHOLE, lightened, run_csv
from flight.logs.log import FlightLog


def team_log(robots: int, samples: int, *, letter: str = "a") -> FlightLog:
    """Return a log of robots that wander, with rotors and motion capture."""
    rng = np.random.default_rng(0)
    many = rng.normal(0.0, 10.0, (samples, robots, 3))
    few = np.abs(many[..., 0])
    letters = tuple(tuple(frozenset((letter,) if (i + j) % 3 else ()) for j in range(robots)) for i in range(samples))
    return FlightLog(
        "many", tuple(f"q{j}" for j in range(robots)), np.arange(samples) * 0.01, many, many / 7, many / 31, few / 30, many / 3,
        few / 99, letters, rotors=np.stack([few] * 4, -1), measured=many,
    )  # fmt: skip


def test_a_log_of_a_few_robots_is_kept_whole():
    log = team_log(3, 50)
    assert lightened(log) is log
    assert run_csv(log) == log.to_csv()


def test_a_log_of_many_keeps_first_and_last_times_and_what_is_flown():
    log = team_log(100, WHOLE // 100 + 1)
    light = lightened(log, most=WHOLE // 3)
    assert light.times.tolist() == [*log.times[::4].tolist()]  # 601 = 4 * 150 + 1: the last time is one of them
    uneven = lightened(log, most=WHOLE // 2 - 1)
    assert np.array_equal(uneven.times, log.times[::3])
    assert np.max(np.abs(light.position - log.position[::4])) <= 0.5e-4 * (1 + 1e-6)
    assert np.max(np.abs(light.velocity - log.velocity[::4])) <= 0.5e-3 * (1 + 1e-6)
    assert light.letters == log.letters[::4]
    assert light.rotors is None
    assert light.measured is None


def test_the_last_time_is_kept_where_the_others_pass_it():
    log = team_log(100, WHOLE // 100 + 2)
    assert lightened(log, most=WHOLE // 2).times[-2:].tolist() == [log.times[600], log.times[-1]]


def test_a_lightened_log_reads_back_and_writes_the_same_bytes(tmp_path):
    light = lightened(team_log(100, WHOLE // 100 + 1), most=3000)
    read = flight.read_log(flight.write_log(light, tmp_path / "flight.csv"))
    assert read.to_csv() == run_csv(read) == light.to_csv()


def test_numbers_that_round_to_zero_have_no_sign():
    log = team_log(100, WHOLE // 100 + 1)
    tiny = dataclasses.replace(log, position=np.full_like(log.position, -1e-7))
    row = lightened(tiny, most=WHOLE // 600).to_csv().splitlines()[1]
    assert row.split(",")[2:5] == ["0", "0", "0"]


@pytest.mark.slow
@pytest.mark.parametrize(("samples", "letter"), [(4000, "a"), (9000, "a"), (4000, "the_shelf_at_the_far_end_of_the_hall")])
def test_the_files_of_a_hundred_robots_stay_small(samples: int, letter: str):
    log = team_log(100, samples, letter=letter)
    text = run_csv(log)
    assert len(text) <= MOST_BYTES
    assert text.count("\n") - 1 <= MOST + 100
    assert len(text) > MOST_BYTES / 2, "no more was left out than must be"


@pytest.mark.slow
def test_the_recording_for_viewers_of_a_hundred_robots_stays_small(tmp_path):
    pytest.importorskip("mcap", reason="mcap is not installed")
    assert flight.write_log(team_log(100, 4000), tmp_path / "flight.mcap").stat().st_size <= MOST_BYTES
