"""Verdicts on words: holds, fails or undecided, with a shortest counterexample.

A verdict is truthy only for `holds`, so that `if verdict:` never takes a doubt for a yes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from verify.data.language.word import Word, show_letter
from verify.data.witness import Witness

Outcome = Literal["holds", "fails", "undecided"]

RobotLetter = tuple[str, frozenset[str]]
"""One position of a team word: a robot (or the whole team) and the letter that it shows."""

TEAM = "team"
"""Stands for the robot's name where a letter is the union of all robots' letters."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """The checker's answer to one question.

    Attributes:
        outcome: "holds", "fails", or "undecided" where a stated budget ran out.
        sentence: One sentence for a person.
        counterexample: A shortest word (of a large team a short one) that breaks the claim: a `Word`, or a team's readings in order.
        time: Mission time, in s, at which the claim is broken, where there are times.
        claim: What was asked: "formula", "transitions", ...
        robot: The robot concerned, or None for the team.
        visit: Index of that robot's planned visit or letter concerned.
        region: The region concerned.
        times: For each reading of the counterexample the interval of times, in s, in which it can be made.
        slack: For the claim "timing" that holds: s by which all may be late, or early, before it fails; None where any delay is allowed.
        vacuous: Sentences: parts of the formula that hold only because they are never put to the test.
    """

    outcome: Outcome
    sentence: str
    counterexample: tuple[RobotLetter, ...] | Word | None = None
    time: float | None = None
    claim: str = "formula"
    robot: str | None = None
    visit: int | None = None
    region: str | None = None
    times: tuple[tuple[float, float], ...] = ()
    vacuous: tuple[str, ...] = ()
    slack: float | None = None

    def __bool__(self) -> bool:
        return self.outcome == "holds"

    def witness(self) -> Witness:
        """Return the refusal as the value that repair and reports work with."""
        return Witness(
            claim=self.claim,
            sentence=self.sentence,
            robot=self.robot,
            time=self.time,
            region=self.region,
            visit=self.visit,
            word=self.readings(),
            times=self.times,
        )

    def readings(self) -> tuple[RobotLetter, ...]:
        """Return the counterexample as (robot, letter) pairs, a lasso's cycle once; empty where there is none."""
        if self.counterexample is None:
            return ()
        if isinstance(self.counterexample, Word):
            return tuple((self.robot or "", letter) for letter in self.counterexample.letters)
        return self.counterexample

    def to_dict(self) -> dict[str, Any]:  # of any type: JSON nests
        """Return the verdict as plain data for JSON."""
        word = self.counterexample
        cycle = word.cycle if isinstance(word, Word) else None
        return {
            "outcome": self.outcome,
            "sentence": self.sentence,
            "claim": self.claim,
            "robot": self.robot,
            "visit": self.visit,
            "region": self.region,
            "time": self.time,
            "counterexample": [[robot, sorted(letter)] for robot, letter in self.readings()] or None,
            "cycle_length": None if cycle is None else len(cycle),
            "times": [list(interval) for interval in self.times],
            "slack": self.slack,
            "order": [],  # waits, which earlier versions proposed here and read back
            "vacuous": list(self.vacuous),
        }


@dataclass(frozen=True, slots=True)
class TeamVerdict:
    """Verdict on a team's words without their times; truthy only where both claims hold.

    Attributes:
        sequential: The words one after another, in every order (a plan must have it).
        parallel: The words interleaved in every way that keeps each robot's own order.
    """

    sequential: Verdict
    parallel: Verdict

    def __bool__(self) -> bool:
        return bool(self.sequential) and bool(self.parallel)

    def to_dict(self) -> dict[str, Any]:  # of any type: JSON nests
        """Return both verdicts as plain data for JSON."""
        return {"sequential": self.sequential.to_dict(), "parallel": self.parallel.to_dict()}


def show_readings(readings: tuple[RobotLetter, ...], limit: int = 24) -> str:
    """Return readings such as `quad0 {}, quad1 {a}`, the robot named where it changes, cut in the middle when long."""
    parts: list[str] = []
    previous: str | None = None
    for robot, letter in readings:
        parts.append(show_letter(letter) if robot in (previous, "") else f"{robot} {show_letter(letter)}")
        previous = robot
    if len(parts) > limit:
        parts = [*parts[: limit // 2], "...", *parts[-limit // 2 :]]
    return ", ".join(parts)
