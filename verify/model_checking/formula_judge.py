"""A formula checked on label timelines, conjunct by conjunct: on what each can see of the letters first, which suffices for a yes.

What robots do apart is checked robot by robot, unions and counts on sums over time before all that the robots can do together, laps on the
words of all of them. What fails is told by whole letters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from itertools import combinations
from typing import Literal

from verify.data.errors import InternalError
from verify.data.language.counting import Atom
from verify.data.language.formula import Formula
from verify.data.mission import Mission
from verify.logic.explanation import show
from verify.logic.normal_form import Normal, conjuncts, normal_form, to_formula
from verify.logic.progression import OutOfBudget
from verify.logic.team_letters import TeamLetters, Together
from verify.logic.verdict import TEAM, Verdict
from verify.model_checking.compositional.counterexample_assembly import broken_apart
from verify.model_checking.compositional.relevant_robots import letters_of
from verify.model_checking.compositional.team_answers import Question
from verify.model_checking.compositional.violation_automaton import BreakingWords
from verify.model_checking.counterexamples import Counterexamples
from verify.model_checking.inclusion import Broken, find_broken, holds_for_all, holds_loosely
from verify.model_checking.lassos import BrokenRun, find_broken_run
from verify.model_checking.letter_projection import marked, seen_of, shown, that_show, without_equals
from verify.model_checking.reading_times import all_read
from verify.model_checking.robot_letters import RobotBehaviour, cut_timeline, from_timeline
from verify.model_checking.summed_timelines import summed
from verify.model_checking.team_graph import JointGraph, Observation, OwnGraph, WithOthers
from verify.model_checking.team_laps import Lap, TeamWords, alone, team_words
from verify.model_checking.timeline import Relations, Timeline
from verify.model_checking.vacuous_parts import vacuous_parts

Times = Literal["timed", "parallel"]

_LARGE = 2_000
"""Nodes of one robot up to which its whole letters are followed by themselves, not together with the formula."""

FEW = 4
"""Robots that change their letters up to which a shortest counterexample is sought; beyond, one that is put together."""

Detail = Literal["answer", "counterexample"]
"""Yes or no only; or with a counterexample."""


@dataclass(frozen=True)
class FormulaJudge:
    """Inputs and methods of a formula's check.

    Attributes:
        mission: Carries the trace and the reading.
        timelines: One for each robot.
        relations: What is proved of the regions at large.
        clock_error: How far each robot's clock may be off, s.
        times: For which times it is checked.
        budget: Configurations that each part of the formula may take.
        detail: What is said of a formula that fails.
        atoms: What counts robots or names one, by the name that stands for it.
        behaviours: All that robots may do, with whole letters; filled when it is first asked for.
    """

    mission: Mission
    timelines: Mapping[str, Timeline]
    relations: Relations
    clock_error: Fraction
    times: Times
    budget: int
    detail: Detail
    atoms: Mapping[str, Atom]
    behaviours: list[RobotBehaviour] = field(default_factory=list)

    def judge(self, formula: Formula) -> Verdict:
        """Decide a formula, one conjunct after the other.

        Args:
            formula: Without names that are never shown.

        Raises:
            InternalError: Our progression and Spot disagree, or the timelines contradict themselves.
            OutOfBudget: A part takes more configurations than it may.
        """
        doubts: list[Verdict] = []
        failures: list[Verdict] = []
        for part in conjuncts(normal_form(formula)):
            verdict = self._part(part)
            if verdict.outcome == "fails" and self.detail == "answer":
                return verdict
            if verdict.outcome == "fails":
                failures.append(verdict)
            if verdict.outcome == "undecided":
                doubts.append(verdict)
        if failures:
            return min(failures, key=lambda failure: len(failure.readings()))
        if doubts:
            return doubts[0]
        if self.detail == "answer":
            return Verdict("holds", "")
        vacuous = vacuous_parts(formula, self.timelines.values(), self.relations, self.budget)
        note = f" But {vacuous[0][0].lower()}{vacuous[0][1:]}" if vacuous else ""
        return Verdict("holds", f"Every team word satisfies `{show(formula)}`.{note}", vacuous=vacuous)

    def _part(self, part: Normal) -> Verdict:
        """Decide one conjunct: first on what it can see, which suffices for a yes, then on whole letters."""
        try:
            counts = not self.atoms.keys().isdisjoint(part.propositions)
            if self.mission.spec.trace == "infinite" and (counts or len(self.timelines) > 1):
                return self._of_laps(part, counts=counts)
            if counts:
                return self._counted(part)
            if self._many_together and self._holds_of_sums(part, TeamLetters.of(part, {})):
                return Verdict("holds", "")
            breaks = self._breaks(part)
            if breaks is None:
                return self._part_together(part)
            if not breaks:
                return Verdict("holds", "")
            if self.detail == "answer":
                return Verdict("fails", "")
            robots = self._whole()
            followed = without_equals(robots)
            read = self._readings(followed, part)
        except OutOfBudget as error:
            return Verdict("undecided", f"`{show(to_formula(part))}` could not be decided: {error}.")
        return self._counterexamples.of_flight(followed, all_read(robots, followed, read), part)

    @property
    def _counterexamples(self) -> Counterexamples:
        return Counterexamples(self.mission, self.atoms, self.timelines)

    @property
    def _many_together(self) -> bool:
        """Return whether so many robots are read together that the letters they surely show are checked first."""
        timed = self.times == "timed" and self.mission.spec.trace == "finite"
        return self.mission.spec.team == "joint" and len(self.timelines) > FEW and timed

    def _counted(self, part: Normal) -> Verdict:
        """Decide a conjunct that counts robots or names one: first on sums over time, then on all that the robots can do together."""
        letters = TeamLetters.of(part, self.atoms)
        if self.times == "timed" and self._holds_of_sums(part, letters):
            return Verdict("holds", "")
        robots = [
            marked(name, from_timeline(cut_timeline(timeline, letters.names_of(name)), self.relations), letters)
            for name, timeline in self.timelines.items()
        ]
        followed = [robot for robot in robots if not robot.constant] or robots[:1]
        together = letters.together.beside(robot.letters[0] for robot in robots if robot not in followed)
        graph = JointGraph(followed, timed=self.times == "timed", clock_error=self.clock_error, together=together)
        broken = holds_for_all(graph, part, self.budget)
        if broken is None:
            return Verdict("holds", "")
        if self.detail == "answer":
            return Verdict("fails", "")
        return self._counterexamples.of_flight(followed, [(TEAM, observation) for observation in broken.observations], part)

    def _of_laps(self, part: Normal, *, counts: bool) -> Verdict:
        """Decide a conjunct of a team that flies laps: first on what it sees of the letters, then, but for counts, on whole ones."""
        letters = TeamLetters.of(part, self.atoms)
        cut = [from_timeline(cut_timeline(t, letters.names_of(name)), self.relations) for name, t in self.timelines.items()]
        seen = [seen_of(robot, letters) for robot in cut]
        words, run = self._lap_run(seen, part, letters if counts else None)
        if run is not None:
            robots = self._whole()
            if counts:
                robots = [seen_of(robot, letters) for robot in robots]
            words, run = self._lap_run(robots, part, letters if counts else None)
        if run is None:
            return Verdict("holds", "")
        return Verdict("fails", "") if self.detail == "answer" else self._counterexamples.of_laps(words, run, part)

    def _lap_run(
        self, robots: Sequence[RobotBehaviour], part: Normal, counted: TeamLetters | None
    ) -> tuple[TeamWords, BrokenRun | None]:
        """Return the team's words over all laps, and one that breaks a conjunct, if any."""
        joint = self.mission.spec.team == "joint"
        together = None if counted is None else counted.together
        if joint:  # who shows one thing for ever changes no letter of the team
            followed = [robot for robot in robots if len(set(robot.letters)) > 1] or list(robots[:1])
            always = [robot.letters[0] for robot in robots if robot not in followed]
            union = Together(()) if together is None else together
            together, robots = union.beside(always), followed
        timeline = next(iter(self.timelines.values()))
        assert timeline.cycle is not None
        lap = Lap(timeline.cycle, timeline.duration, self.clock_error)
        words = team_words(robots, lap, self.mission.spec.team, self.budget, together=together)
        return words, find_broken_run(words.behaviour, part, self.budget)

    def _holds_of_sums(self, part: Normal, letters: TeamLetters) -> bool:
        """Try to prove a conjunct from how many robots surely show what; no is no answer."""
        try:
            team = JointGraph([summed(letters, self.timelines, self.clock_error)], timed=False)
            return holds_for_all(team, part, self.budget) is None
        except OutOfBudget:
            return False  # sums leave too much open; the robots themselves may not

    def _readings(self, robots: Sequence[RobotBehaviour], part: Normal) -> tuple[Observation, ...]:
        """Return a counterexample: a shortest one, where few robots change their letters."""
        if sum(not robot.constant for robot in robots) <= FEW:
            broken = find_broken(self._graph(robots), part, self.budget)
            found = None if broken is None else broken.observations
        else:
            words = BreakingWords(part, letters_of(robots, part.propositions))
            timed = self.times == "timed"
            found = broken_apart(robots, words, timed=timed, clock_error=self.clock_error, budget=self.budget)
        if found is None:
            raise InternalError(
                f"`{show(to_formula(part))}` fails for the robots that matter and holds for all. This is a bug of ltlplan's."
            )
        return found

    def _breaks(self, part: Normal) -> bool | None:
        """Return whether some team word breaks a conjunct, robot by robot; None where that cannot tell."""
        if (self.mission.spec.team == "joint" and len(self.timelines) > 1) or self.mission.spec.trace == "infinite":
            return None
        names = part.propositions
        seen = [t for t in self.timelines.values() if not names.isdisjoint(self._shown[t.robot])]
        others = len(seen) < len(self.timelines)
        try:
            robots = [from_timeline(cut_timeline(timeline, names), self.relations) for timeline in seen]
            if others:  # they show nothing all the time
                robots.append(RobotBehaviour("", (frozenset(),), ((Fraction(0), self._end),), ((),), (0,), frozenset({0})))
            question = Question(part, letters_of(robots, names))
            if not self._is_broken(question, robots):
                return False
            whole = self._whole()
            if max(map(len, whole)) > _LARGE:
                return None
            if others and question.nothing_is_idle():
                kept = {timeline.robot for timeline in seen}
                whole = [*(robot for robot in whole if robot.robot in kept), robots[-1]]
            return self._is_broken(question, whole)
        except OutOfBudget:
            return None

    @cached_property
    def _shown(self) -> Mapping[str, frozenset[str]]:
        """All that each robot may show at some time."""
        return {timeline.robot: shown(timeline) for timeline in self.timelines.values()}

    def _is_broken(self, question: Question, robots: Sequence[RobotBehaviour]) -> bool:
        timed = self.times == "timed"
        return question.is_broken(robots, timed=timed, clock_error=self.clock_error, budget=self.budget)

    @property
    def _end(self) -> Fraction:
        return next(iter(self.timelines.values())).duration

    def _whole(self) -> list[RobotBehaviour]:
        """Return all that each robot may do, with whole letters; found once."""
        if not self.behaviours:
            self.behaviours.extend(from_timeline(timeline, self.relations) for timeline in self.timelines.values())
        return self.behaviours

    def _part_together(self, part: Normal) -> Verdict:
        """Decide one conjunct on all ways in which the robots can be where they are together."""
        cut = self._that_show(
            [from_timeline(cut_timeline(t, part.propositions), self.relations) for t in self.timelines.values()], part
        )
        if self._holds_loosely(cut, part) or self._broken(cut, part) is None:
            return Verdict("holds", "")
        robots = self._whole()
        if (
            self.mission.spec.team == "joint"
            and len(robots) > FEW
            and self._broken(self._that_show(robots, part), part) is None
        ):
            return Verdict("holds", "")
        if self.detail == "answer" and len(robots) > FEW and self.mission.spec.team == "joint":
            return Verdict("fails", "")
        followed = without_equals(robots)
        broken = self._broken(followed, part)
        if broken is None:
            return Verdict("holds", "")
        if self.detail == "answer":
            return Verdict("fails", "")
        if isinstance(broken, BrokenRun):
            return self._counterexamples.of_laps(alone(robots[0]), broken, part)
        return self._counterexamples.of_flight(followed, all_read(robots, followed, broken.observations), part)

    def _that_show(self, robots: list[RobotBehaviour], part: Normal) -> list[RobotBehaviour]:
        """Keep one of the robots that show one thing all the time; of unions, those that can show something of a part."""
        joint = self.mission.spec.team == "joint" and len(robots) > 1
        return without_equals(that_show(robots, part.propositions) if joint else robots)

    def _holds_loosely(self, robots: list[RobotBehaviour], part: Normal) -> bool:
        """Try to prove a conjunct from none, one or two robots, the others' letters coming at any time."""
        if self.mission.spec.team == "joint" or len(robots) <= 3:
            return False  # the exact search is as quick
        for size in (0, 1, 2):
            for followed in combinations(range(len(robots)), size):
                others = {letter for r, robot in enumerate(robots) if r not in followed for letter in robot.letters}
                graph = self._graph([robots[r] for r in followed]) if followed else None
                if holds_loosely(WithOthers(graph, others), part):
                    return True
        return False

    def _broken(self, robots: list[RobotBehaviour], part: Normal) -> Broken | BrokenRun | None:
        if not any(robot.laps for robot in robots):
            return holds_for_all(self._graph(robots), part, self.budget)
        return find_broken_run(robots[0], part, self.budget)

    def _graph(self, robots: Sequence[RobotBehaviour]) -> OwnGraph | JointGraph:
        timed = self.times == "timed"
        if self.mission.spec.team == "joint":
            return JointGraph(robots, timed=timed, clock_error=self.clock_error)
        return OwnGraph(robots, timed=timed, clock_error=self.clock_error)
