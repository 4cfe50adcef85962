"""Verdicts on a formula that fails: the word that breaks it, when its letters are read, and why."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from verify.data.errors import InternalError
from verify.data.language.counting import Atom, atoms, written_out
from verify.data.language.formula import FREE
from verify.data.language.relaxation import relaxed, without_idle_bounds
from verify.data.language.word import Letter, Word, show_letter
from verify.data.mission import Mission
from verify.logic.explanation import Reason, Where, explain
from verify.logic.normal_form import Normal, to_formula
from verify.logic.semantics import satisfies
from verify.logic.verdict import TEAM, Verdict
from verify.model_checking.lassos import BrokenRun
from verify.model_checking.reading_times import when, when_read
from verify.model_checking.robot_letters import RobotBehaviour
from verify.model_checking.team_graph import Observation
from verify.model_checking.team_laps import TeamWords
from verify.model_checking.timeline import Timeline


@dataclass(frozen=True, slots=True)
class Counterexamples:
    """Tells of words that break a mission's formula.

    Attributes:
        mission: Carries the formula.
        atoms: Its counts and names of robots, by how letters show them.
        timelines: One for each robot.
    """

    mission: Mission
    atoms: Mapping[str, Atom]
    timelines: Mapping[str, Timeline]

    def of_laps(self, words: TeamWords, run: BrokenRun, part: Normal) -> Verdict:
        """Tell of a run over all laps that breaks a conjunct.

        Args:
            words: The team's.
            run: One of them.
            part: What it breaks.
        """
        read = [words.readings[node] for node in run.nodes]
        names = [words.names[reading.robot] if reading.robot is not None else TEAM for reading in read]

        def where(position: int) -> str:
            name, shown = names[position], self._said(run.word.letters[position])
            return f"{'the team' if name == TEAM else name}'s {shown} ({when(read[position].span)})"

        reason = explain(to_formula(part), run.word, where) if self.atoms else self._explain(run.word, where)
        at = reason.position
        return Verdict(
            "fails",
            reason.sentence,
            run.word,
            None if at is None else float(read[at].span[0]),
            robot=words.names[0] if len(self.timelines) == 1 else None if at is None or names[at] == TEAM else names[at],
            region=self._region(reason, None if at is None else run.word.letters[at]),
            times=tuple((float(reading.span[0]), float(reading.span[1])) for reading in read),
        )

    def of_flight(self, robots: Sequence[RobotBehaviour], read: Sequence[tuple[str, Observation]], part: Normal) -> Verdict:
        """Tell of a team word that breaks a conjunct.

        Args:
            robots: Those whose times bind the readings.
            read: Its letters, and whose they are.
            part: What it breaks.
        """
        word = Word(tuple(observation.letter for _, observation in read))
        spans = when_read(robots, [observation for _, observation in read])

        def where(position: int) -> str:
            name, observation = read[position]
            shown = self._said(observation.letter)
            return f"{'the team' if name == TEAM else name}'s {shown} ({when(spans[position])})"

        reason = explain(to_formula(part), word, where) if self.atoms else self._explain(word, where)
        at = reason.position
        return Verdict(
            "fails",
            reason.sentence,
            tuple((name, observation.letter) for name, observation in read),
            None if at is None else float(spans[at][0]),
            robot=None if at is None or read[at][0] == TEAM else read[at][0],
            region=self._region(reason, None if at is None else word.letters[at]),
            times=tuple((float(low), float(high)) for low, high in spans),
        )

    def _said(self, letter: Letter) -> str:
        """Return a letter for a person: plain names as they are, of each count how many robots there are at least."""
        if not self.atoms:
            return show_letter(letter)
        most: dict[str, int] = {}
        for text in letter & self.atoms.keys():
            atom = self.atoms[text]
            if not atom.robot:
                most[str(atom.counted)] = max(atom.least, most.get(str(atom.counted), 0))
        counted = [
            f"{least} or more robots {'in' if name in self.mission.all_regions else 'with'} {name}"
            for name, least in sorted(most.items())
        ]
        plain = letter - {text for text in letter if text in self.atoms and not self.atoms[text].robot}
        return " with ".join([show_letter(plain), *([" and ".join(counted)] if counted else [])])

    def _region(self, reason: Reason, letter: Letter | None) -> str | None:
        """Return the one region that a broken part is about: of the letter that breaks it, or at all; None where several are."""
        named = reason.part.names() & self.mission.all_regions.keys()
        held = named if letter is None else named & letter
        return next(iter(held)) if len(held) == 1 else None

    def _explain(self, word: Word, where: Where) -> Reason:
        """Explain with the formula as it was written, bounds in seconds left out, where nothing in it counts: `free` is a name again."""
        if satisfies(self.mission.formula, word):
            raise InternalError("A counterexample satisfies the formula after all. This is a bug of ltlplan's.")
        written = relaxed(without_idle_bounds(written_out(self.mission.written, tuple(self.mission.agents))))
        if atoms(written):  # such as `all(free)`, which comes to plain names of regions
            return explain(self.mission.formula, word, where)
        regions = self.mission.all_regions.keys()

        def with_free(letters: tuple[Letter, ...]) -> tuple[Letter, ...]:
            return tuple(letter if letter & regions else letter | {FREE} for letter in letters)

        shown = Word(with_free(word.prefix), None if word.cycle is None else with_free(word.cycle))
        return explain(written, shown, where)
