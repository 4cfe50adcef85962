"""Verdicts on formulas that are bounded in seconds, with the time by which all could be late or early before they fail."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

from verify.data.language.counting import atoms
from verify.data.language.formula import Formula
from verify.data.language.word import Letter
from verify.logic.explanation import show
from verify.logic.progression import OutOfBudget
from verify.logic.team_letters import TeamLetters
from verify.logic.verdict import Verdict
from verify.model_checking.timeline import Relations, Timeline
from verify.model_checking.timing.instants import Instants, at
from verify.model_checking.timing.laps import recurrence_of, unrolled
from verify.model_checking.timing.team_instants import Clocks, TeamInstants, robot_instants, ticks_per_second, times_of
from verify.model_checking.timing.timed_formula import Sure, TimedFormula, bounds_of
from verify.model_checking.timing.timed_reasons import decimals, reason

RESOLUTION = Fraction(1, 20_000)
"""s; slack is found to this, rounded down."""

Side = Literal["late", "early"]


@dataclass(frozen=True, slots=True)
class Slack:
    """Error of all times up to which a formula stays proved.

    Attributes:
        seconds: That far it is proved; None where no delay within the formula's times matters.
        side: Which way it breaks first.
    """

    seconds: Fraction | None
    side: Side


@dataclass(frozen=True)
class TimedJudge:
    """Inputs of the check of conjuncts that are bounded in seconds.

    Attributes:
        timelines: One for each robot; where they have cycles, these are flown one after another without a wait, for ever.
        relations: What is proved of the regions at large.
        clock_error: How far apart two clocks, the reference clock one of them, may be at any time, s.
    """

    timelines: Mapping[str, Timeline]
    relations: Relations
    clock_error: Fraction
    _known: dict[Formula, tuple[TeamLetters, int, list[dict[Letter, Instants]]]] = field(default_factory=dict, repr=False)

    def judge(self, part: Formula, *, slack: bool) -> Verdict:
        """Decide one conjunct.

        Args:
            part: Written out for the team.
            slack: Whether to say by how much it holds.
        """
        try:
            return self._judged(part, slack=slack)
        except OutOfBudget as error:
            return Verdict("undecided", f"`{show(part)}` could not be decided: {error}.", claim="timing")

    def _judged(self, part: Formula, *, slack: bool) -> Verdict:
        found = self._sure(part)
        if at(found.flown, 0):
            if not slack:
                return Verdict("holds", "", claim="timing")
            room = self.slack(part)
            spare = None if room.seconds is None else float(room.seconds)
            laps = any(timeline.cycle is not None for timeline in self.timelines.values())
            where = ", of laps that follow one another without a wait," if laps else ""
            return Verdict("holds", f"`{show(part)}` holds{where}{_told(room)}.", claim="timing", slack=spare)
        if at(found.held, 0):
            wait = self._hover(part)
            how_long = "for ever" if wait is None else f"for {decimals(wait)} s"
            return Verdict(
                "undecided",
                f"`{show(part)}` holds only where the flight's last letter is held {how_long} after its end, of which it says nothing.",
                claim="timing",
            )
        fails = at(self._evaluated(part).sure(part, negated=True).held, 0)
        return self._failed(part, "fails" if fails else "undecided")

    def slack(self, part: Formula) -> Slack:
        """Return by how much a conjunct that is proved holds, to `RESOLUTION`, rounded down."""
        sides: list[tuple[Fraction | None, Side]] = [
            (_greatest(lambda s: at(self._sure(part, late=s).flown, 0), self._horizon(part)), "late"),
            (_greatest(lambda s: at(self._sure(part, early=s).flown, 0), self._horizon(part)), "early"),
        ]
        found: list[tuple[Fraction, Side]] = [(seconds, side) for seconds, side in sides if seconds is not None]
        return Slack(*min(found)) if found else Slack(None, "late")

    def lost_from(self, part: Formula) -> Fraction | None:
        """Return from when on no continuation of the flights satisfies a conjunct, to `RESOLUTION`, rounded up, s; None where one may.

        Args:
            part: Written out for the team; the timelines have no cycles.
        """
        reading, scale, shown = self._letters(part)
        error = int(self.clock_error * scale)
        team = TeamInstants.of(reading, shown, Clocks(error, error))

        def may_hold(time: Fraction) -> bool:
            known = max(int(time * scale) - error, 0)
            return not at(TimedFormula(team.until(known), known, scale).sure(part, negated=True).held, 0)

        lost = _greatest(may_hold, max(timeline.duration for timeline in self.timelines.values()))
        return None if lost is None else lost + RESOLUTION

    def _horizon(self, part: Formula) -> Fraction:
        """Return a time after which nothing that is bounded depends on a delay, s."""
        ends = (t.duration + (0 if t.cycle is None else t.duration - t.cycle) for t in self.timelines.values())
        return max(ends) + sum(bounds_of(part), Fraction(1))

    def _sure(self, part: Formula, *, late: Fraction = Fraction(0), early: Fraction = Fraction(0)) -> Sure:
        return self._evaluated(part, late, early).sure(part)

    def _evaluated(
        self, part: Formula, late: Fraction = Fraction(0), early: Fraction = Fraction(0), hover: Fraction = Fraction(0)
    ) -> TimedFormula:
        reading, scale, shown = self._letters(part)
        clocks = Clocks(int((self.clock_error + early) * scale), int((self.clock_error + late) * scale))
        timelines = list(self.timelines.values())
        if timelines[0].cycle is not None:
            laps = recurrence_of(timelines[0], scale)
            later = laps.later(clocks.late)
            shown = [
                {letter: laps.repeated(instants, later.reach + clocks.early) for letter, instants in robot.items()}
                for robot in shown
            ]
            return TimedFormula(TeamInstants.of(reading, shown, clocks), later, scale)
        last = max(timeline.duration for timeline in timelines) + hover - self.clock_error - early
        return TimedFormula(TeamInstants.of(reading, shown, clocks), max(int(last * scale), 0), scale)

    def _letters(self, part: Formula) -> tuple[TeamLetters, int, list[dict[Letter, Instants]]]:
        """Return how a part reads letters, the ticks of a second, and when each robot may show which letter."""
        if part not in self._known:
            reading = TeamLetters.of(part, atoms(part))
            times = {self.clock_error, RESOLUTION}.union(*(times_of(timeline) for timeline in self.timelines.values()))
            scale = ticks_per_second([*times, *bounds_of(part)])
            robots = {name: t if t.cycle is None else unrolled(t) for name, t in self.timelines.items()}
            shown = [robot_instants(reading, name, timeline, self.relations, scale) for name, timeline in robots.items()]
            self._known[part] = reading, scale, shown
        return self._known[part]

    def _hover(self, part: Formula) -> Fraction | None:
        """Return for how long the last letter has to be held, to a millisecond, rounded up; None where no time is enough."""
        step = 20 * RESOLUTION
        low, high = 0, int((self._horizon(part) + 2 * self.clock_error) / step) + 1
        if not at(self._evaluated(part, hover=high * step).sure(part).flown, 0):
            return None
        while high - low > 1:
            middle = (low + high) // 2
            if at(self._evaluated(part, hover=middle * step).sure(part).flown, 0):
                high = middle
            else:
                low = middle
        return high * step

    def _failed(self, part: Formula, outcome: Literal["fails", "undecided"]) -> Verdict:
        told, time = reason(part, self._evaluated(part), refuted=outcome == "fails")
        start = "fails" if outcome == "fails" else "cannot be proved"
        return Verdict(outcome, f"`{show(part)}` {start}: {told}", time=time, claim="timing")


def _greatest(holds: Callable[[Fraction], bool], most: Fraction) -> Fraction | None:
    """Return the greatest delay up to `most` that is still allowed, rounded down; None where all are."""
    if holds(most):
        return None
    low, high = 0, int(most / RESOLUTION) + 1
    step = 1
    while step < high and holds(step * RESOLUTION):
        low, step = step, 2 * step
    high = min(step, high)
    while high - low > 1:
        middle = (low + high) // 2
        if holds(middle * RESOLUTION):
            low = middle
        else:
            high = middle
    return low * RESOLUTION


def _told(slack: Slack) -> str:
    if slack.seconds is None:
        return " however late or early"
    spare = Fraction(math.floor(slack.seconds * 10_000), 10_000)  # what is printed is proved, too
    return f" with {decimals(spare)} s to spare, before it is too {slack.side}"
