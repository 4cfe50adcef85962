"""Progress in a log: new work at once, whoever is worked on by name, counters now and then, and no silence of more than two seconds."""

from __future__ import annotations

import re
import sys
import time

import pytest

from ltlplan.commands.support.progress import Lines, progress_bar


class Log:
    """Lines with the times at which they were written, on a clock that is moved by hand."""

    def __init__(self) -> None:
        self.now, self.lines = 100.0, list[tuple[float, str]]()
        self.progress = Lines(lambda line: self.lines.append((self.now, line)), lambda: self.now)

    def wait(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.25)):
            self.now += 0.25
            self.progress.beat()

    @property
    def said(self) -> list[str]:
        return [line for _, line in self.lines]


def test_each_robot_is_named_while_it_is_worked_on() -> None:
    log = Log()
    for index in range(4):
        log.progress.move(f"optimising the path of quad{index}", index / 4)
        log.wait(1.0)
    assert [re.search(r"quad\d", line).group() for line in log.said] == ["quad0", "quad1", "quad2", "quad3"]  # type: ignore[union-attr]


def test_a_counter_moves_every_two_seconds_and_no_more_often() -> None:
    log = Log()
    for step in range(101):
        log.progress.move(f"flying online, {step} s", step / 100)
        log.wait(0.25)
    gaps = [b - a for (a, _), (b, _) in zip(log.lines, log.lines[1:], strict=False)]
    assert gaps
    assert all(gap == 2.0 for gap in gaps)
    assert log.said[:2] == ["[  0%] flying online, 0 s", "[  7%] flying online, 7 s"]


def test_the_share_moves_where_the_sentence_does_not() -> None:
    log = Log()
    for step in range(40):
        log.progress.move("simulating 60 runs", step / 40)
        log.wait(0.25)
    assert log.said[:3] == ["[  0%] simulating 60 runs", "[ 18%] simulating 60 runs", "[ 38%] simulating 60 runs"]


def test_work_that_says_nothing_is_said_to_go_on() -> None:
    log = Log()
    log.wait(10.0)
    assert not log.said  # nothing is known yet
    log.progress.move("searching words and robots", 0.05)
    log.wait(7.0)
    log.progress.move("laying the path of q", 0.2)
    again = [f"[   5%] searching words and robots ({seconds} s)".replace("[   5", "[  5") for seconds in (2, 4, 6)]
    assert log.said == ["[  5%] searching words and robots", *again, "[ 20%] laying the path of q"]


def test_many_robots_flood_no_log() -> None:
    log = Log()
    for index in range(1000):
        log.progress.move(f"smoothing the path of quad{index}", index / 1000)
        log.now += 0.01
    assert len(log.lines) <= 10.0 / 0.2 + 2


@pytest.mark.slow
def test_a_command_beats_by_itself_and_stops_when_it_is_done(capfd: pytest.CaptureFixture[str]) -> None:
    with progress_bar(quiet=False) as progress:
        progress("thinking hard", 0.5)
        until = time.monotonic() + 30.0
        said = ""
        while "(2 s)" not in said and time.monotonic() < until:
            time.sleep(0.05)
            said += capfd.readouterr().err
    assert said.startswith("[ 50%] thinking hard\n")
    assert "[ 50%] thinking hard (2 s)\n" in said
    assert capfd.readouterr().out == ""
    assert "progress" not in [thread.name for thread in sys.modules["threading"].enumerate()]
