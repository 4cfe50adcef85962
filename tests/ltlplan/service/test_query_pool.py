"""Questions wait for their like only, and users take turns: told by what is begun and in which order, never by seconds."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ltlplan.service.execution.turns import SharedPool, Turns
from ltlplan.service.problems import Busy, TooManyRequests
from ltlplan.service.query_pool import Questions
from ltlplan.service.settings import Limits


class Held:
    """A pool that begins what has the lowest rank, and ends it when a test says so."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.begun: list[Any] = []
        self._waiting: list[tuple[float, int, Any, Future[Any]]] = []
        self._running: list[Future[Any]] = []
        self.asked = 0
        self.trouble: str | None = None

    def submit(self, _work: Callable[..., Any], /, *arguments: Any, rank: float) -> Future[Any]:
        future: Future[Any] = Future()
        self.asked += 1
        self._waiting.append((rank, self.asked, arguments[-1], future))
        self._begin()
        return future

    def _begin(self) -> None:
        while self._waiting and len(self._running) < self.count:
            first = min(self._waiting, key=lambda each: each[:2])
            self._waiting.remove(first)
            self.begun.append(first[2])
            self._running.append(first[3])

    def end_one(self) -> None:
        """End what was begun first of what runs."""
        self._running.pop(0).set_result("answered")
        self._begin()


def work() -> None:
    """Stand for any work: held pools do none."""


def made(folder: Path, *, short: Held | None = None, errands: Held | None = None, most: int = 100, each: int = 50) -> Questions:
    return Questions(SharedPool(short or Held(2)), SharedPool(errands or Held(2)), folder, most=most, each=each)


async def settled(condition: Callable[[], bool]) -> None:
    """Let what was asked arrive at its pool."""
    async with asyncio.timeout(60):
        while not condition():
            await asyncio.sleep(0.001)


async def asked_in_order(questions: Questions, pool: Held, names: list[str]) -> list[asyncio.Task[Any]]:
    """Have users ask, one after the other."""
    tasks: list[asyncio.Task[Any]] = []
    for index, name in enumerate(names):
        tasks.append(asyncio.create_task(questions.ask(work, f"{name}{index}", who=name)))
        await settled(lambda index=index: questions.open["short"] == index + 1)
        await settled(lambda index=index: pool.asked >= len(set(names[: index + 1])))
    return tasks


def test_a_check_waits_behind_no_recording(tmp_path: Path) -> None:
    async def check() -> None:
        short, errands = Held(1), Held(1)
        questions = made(tmp_path / "scratch", short=short, errands=errands)
        judged = [asyncio.create_task(questions.ask_in_folder(work, f"recording {index}", who="a")) for index in range(3)]
        await settled(lambda: len(errands.begun) == 1)
        checked = asyncio.create_task(questions.ask(work, "check", who="a"))
        await settled(lambda: short.begun == ["check"])
        short.end_one()
        assert await checked == "answered"
        assert [task.done() for task in judged] == [False, False, False]
        for count in (1, 2, 3):
            await settled(lambda count=count: len(errands.begun) == count)
            errands.end_one()
        await asyncio.gather(*judged)

    asyncio.run(check())


def test_users_take_turns_and_each_ones_questions_are_answered_in_order(tmp_path: Path) -> None:
    async def check() -> None:
        short = Held(1)
        questions = made(tmp_path / "scratch", short=short)
        tasks = await asked_in_order(questions, short, ["a", "a", "a", "a", "b", "b", "c", "a"])
        for ended, asked in enumerate((3, 4, 5, 5, 6, 6, 7, 8)):  # whose question was answered asks the next
            await settled(lambda ended=ended, asked=asked: (sum(each.done() for each in tasks), short.asked) == (ended, asked))
            short.end_one()
        await asyncio.gather(*tasks)
        assert short.begun == ["a0", "b4", "c6", "a1", "b5", "a2", "a3", "a7"]

    asyncio.run(check())


def test_of_one_user_one_question_is_answered_at_a_time(tmp_path: Path) -> None:
    async def check() -> None:
        short = Held(3)
        questions = made(tmp_path / "scratch", short=short)
        tasks = await asked_in_order(questions, short, ["a", "a", "a", "b"])
        assert short.begun == ["a0", "b3"], "a place is free, and a's others wait"
        tasks[1].cancel()
        short.end_one()
        await settled(lambda: short.begun == ["a0", "b3", "a2"])
        for _ in range(2):
            short.end_one()
        assert [str(each) for each in await asyncio.gather(*tasks, return_exceptions=True)] == [
            "answered",
            "",
            "answered",
            "answered",
        ]
        assert questions.open["short"] == 0

    asyncio.run(check())


def test_who_asks_much_is_refused_before_others_are(tmp_path: Path) -> None:
    async def check() -> None:
        short = Held(1)
        questions = made(tmp_path / "scratch", short=short, most=5, each=3)
        tasks = await asked_in_order(questions, short, ["a"] * 4)
        with pytest.raises(TooManyRequests, match="4 of your questions"):
            await questions.ask(work, "a4", who="a")
        tasks += [asyncio.create_task(questions.ask(work, f"b{index}", who="b")) for index in range(2)]
        await settled(lambda: questions.open["short"] == 6 and short.asked == 2)
        with pytest.raises(Busy, match="6 questions"):
            await questions.ask(work, "c", who="c")
        for ended in range(1, 7):
            await settled(lambda ended=ended: len(short.begun) == ended)
            short.end_one()
            await settled(lambda ended=ended: sum(task.done() for task in tasks) == ended)
        again = asyncio.create_task(questions.ask(work, "a5", who="a"))
        await settled(lambda: short.begun[-1] == "a5")
        short.end_one()
        await again

    asyncio.run(check())


@given(st.lists(st.one_of(st.sampled_from("abc"), st.none()), max_size=60))
def test_nobody_is_passed_often(happenings: list[str | None]) -> None:
    """Of one place: while a user waits, no other is begun more than three times before that user is. None ends what runs.

    Twice would be the law of ranks that go on when work begins; a pool says when it ends.
    """
    turns, number = Turns(), 0
    waiting: list[tuple[int, int, str]] = []
    running: tuple[int, int, str] | None = None
    passed: dict[str, Counter[str]] = {}
    order: dict[str, list[int]] = {}
    for happening in [*happenings, *[None] * 100]:
        if happening is not None:
            number += 1
            waiting.append((turns.rank(happening), number, happening))
            passed.setdefault(happening, Counter())
        elif running is not None:
            turns.ended(running[0])
            running = None
        if running is None and waiting:
            running = min(waiting)
            waiting.remove(running)
            user = running[2]
            order.setdefault(user, []).append(running[1])
            passed.pop(user)
            for other in {each[2] for each in waiting}:
                counted = passed.setdefault(other, Counter())
                counted[user] += other != user
                assert counted[user] <= 3, (other, user)
    assert waiting == []
    assert all(numbers == sorted(numbers) for numbers in order.values())


def test_a_recording_may_take_longer_than_a_check() -> None:
    limits = Limits()
    assert limits.errand_seconds > limits.question_seconds
    assert limits.errand_megabytes > limits.question_megabytes


def test_the_lanes_say_when_nothing_is_answered(tmp_path: Path) -> None:
    short, errands = Held(1), Held(1)
    questions = made(tmp_path / "scratch", short=short, errands=errands)
    assert questions.trouble is None
    errands.trouble = "they die"
    assert questions.trouble == "they die"
