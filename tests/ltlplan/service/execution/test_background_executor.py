"""Answers that are computed beside a flight."""

import os
import signal
import time

import pytest

from ltlplan.online.live.executors import NoAnswer
from ltlplan.service.execution.background_executor import Beside
from tests.helpers.serving import work_for_workers as work
from verify.data import MissionError


@pytest.fixture(scope="module")
def beside():
    return Beside()


def waited(answer):
    while not answer.done(wait=0.1):
        pass
    return answer


def test_questions_are_answered_side_by_side_in_processes_of_their_own(beside):
    answers = [beside.ask(work.own_process, None) for _ in range(2)]
    found = {waited(answer).result() for answer in answers}
    assert len(found) == 2
    assert os.getpid() not in found
    for answer in answers:
        answer.drop()


def test_what_is_raised_there_is_raised_here(beside):
    answer = waited(beside.ask(work.wrong_question, None))
    with pytest.raises(MissionError, match="there is no such hoop"):
        answer.result()
    answer.drop()


def test_one_that_was_killed_gives_no_answer_and_the_next_one_does(beside):
    answer = beside.ask(work.sleep, 60.0)
    os.kill(answer.pid, signal.SIGKILL)
    with pytest.raises(NoAnswer, match="signal 9"):
        waited(answer).result()
    answer.drop()
    assert waited(beside.ask(work.own_process, None)).result()


def test_one_that_hangs_is_asked_without_waiting_and_ended_when_it_is_dropped(beside):
    answer = beside.ask(work.sleep, 60.0)
    os.kill(answer.pid, signal.SIGSTOP)
    begun = time.process_time()
    assert not any(answer.done() for _ in range(100))
    assert time.process_time() - begun < 1.0
    answer.drop()
    with pytest.raises(ProcessLookupError):
        os.kill(answer.pid, 0)
