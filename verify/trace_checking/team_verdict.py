"""Words of a team checked against a formula: one robot after another, and all at once.

Each claim is about every team word, so a conjunction is decided conjunct by conjunct, each seeing only its own
propositions: most robots then do nothing that it could notice. `sequential` follows what whole words do to the states
of our automaton; words that act alike are one kind, and words that change nothing drop out. Where the team's words are
few enough to be written down, Spot decides the same question from scratch, and the two must agree.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from verify.data.errors import BadInput, InternalError
from verify.data.language.counting import Atom, atoms
from verify.data.language.formula import Formula
from verify.data.language.word import Letter
from verify.data.names.former_names import former_arguments
from verify.data.sections import TeamReading
from verify.logic.explanation import show
from verify.logic.normal_form import Normal
from verify.logic.progression import OutOfBudget
from verify.logic.team_letters import TeamLetters, Together
from verify.logic.verdict import TEAM, TeamVerdict, Verdict
from verify.model_checking.inclusion import DEFAULT_BUDGET, LOOSE_BUDGET, find_broken, holds_loosely
from verify.model_checking.team_graph import Observation, WithOthers
from verify.trace_checking.conjunct_by_conjunct import Failure, as_team, decided, require_second_opinion
from verify.trace_checking.counterexamples import Reading
from verify.trace_checking.orders import find_bad_order
from verify.trace_checking.word_graph import InTurn, JointShuffle, Shuffle
from verify.trace_checking.word_verdict import Letters, check_word


@former_arguments(reading="team")
def check_team(
    formula: str | Formula,
    words: Mapping[str, Letters],
    team: TeamReading = "own",
    *,
    budget: int = DEFAULT_BUDGET,
) -> TeamVerdict:
    """Decide what a team's words satisfy without regard to times.

    Args:
        formula: LTLf in Spot's syntax.
        words: Each robot's word: a `Word`, or a sequence of sets of names.
        team: "own": a position is one robot's letter; "joint": the union of all robots' letters.
        budget: Configurations that each conjunct may take before the answer is `undecided`.

    Returns:
        `sequential`: one robot after another, in every order. `parallel`: all at once, whatever the times.

    Raises:
        FormulaError: The text is no formula.
        BadInput: No robots, an empty word, a lasso in a team of several robots (laps are checked with their times), or a formula under "own" that counts robots.
        MissingEngine: Spot, which gives the second opinion, is absent.
    """
    formula, given = as_team(formula, words, team)
    lassos = [name for name, word in given.items() if word.cycle is not None]
    if lassos and len(given) > 1:
        raise BadInput(
            f"{lassos[0]}'s word has a cycle. What laps of a team show depends on their times: certify the flight. Words by themselves are finite, or one robot's."
        )
    if lassos:
        verdict = check_word(formula, given[lassos[0]])
        return TeamVerdict(verdict, verdict)
    known = atoms(formula)
    asked = _Team(formula, {name: word.prefix for name, word in given.items()}, team, budget, known)
    sequential = asked.decide("sequential")
    parallel = asked.decide("parallel")
    if parallel.outcome == "holds" and sequential.outcome == "fails":
        raise InternalError("`parallel` holds but `sequential` fails, which cannot be. This is a bug of ltlplan's.")
    return TeamVerdict(sequential, parallel)


@dataclass(frozen=True)
class _Kinds:
    """Robots sorted by what one conjunct sees of their words.

    Attributes:
        words: One word for each kind.
        robots: The robots of each kind.
        runs: For each robot and each letter of its kind's word, the whole letters that look like it.
    """

    words: tuple[tuple[Letter, ...], ...]
    robots: tuple[tuple[str, ...], ...]
    runs: Mapping[str, tuple[tuple[int, ...], ...]]

    @property
    def counts(self) -> tuple[int, ...]:
        """Return how many robots there are of each kind."""
        return tuple(len(names) for names in self.robots)


@dataclass(frozen=True)
class _Team:
    formula: Formula
    words: Mapping[str, tuple[Letter, ...]]
    reading: TeamReading
    budget: int
    atoms: Mapping[str, Atom]

    def decide(self, claim: str) -> Verdict:
        """Decide one claim."""
        in_turn = claim == "sequential"
        how = "in every order, one robot after another" if in_turn else "however their flights interleave"
        holds = f"The words satisfy `{show(self.formula)}` {how}"
        return decided(self.formula, self.words, claim, self._in_turn if in_turn else self._at_once, holds)

    def _kinds(self, part: Normal, *, whole: bool = False) -> _Kinds:
        """Sort the robots by their words as one conjunct sees them; `whole` keeps repeated letters."""
        seen_of = self._seen_of(part)
        shorten = not whole and not part.uses_next  # repeating a letter changes no verdict
        seen: dict[tuple[Letter, ...], list[str]] = {}
        runs: dict[str, tuple[tuple[int, ...], ...]] = {}
        for name, word in self.words.items():
            kept: list[Letter] = []
            run: list[list[int]] = []
            for index, letter in enumerate(word):
                cut = seen_of(name, letter)
                if shorten and kept and cut == kept[-1]:
                    run[-1].append(index)
                else:
                    kept.append(cut)
                    run.append([index])
            seen.setdefault(tuple(kept), []).append(name)
            runs[name] = tuple(map(tuple, run))
        return _Kinds(tuple(seen), tuple(map(tuple, seen.values())), runs)

    def _seen_of(self, part: Normal) -> Callable[[str, Letter], Letter]:
        """Return what a conjunct sees of a robot's letter."""
        return TeamLetters.of(part, self.atoms).own

    def _together(self, part: Normal) -> Together | None:
        """Return what puts letters together for a conjunct, where that is not their union."""
        return None if self.atoms.keys().isdisjoint(part.propositions) else TeamLetters.of(part, self.atoms).together

    @cached_property
    def _whole(self) -> TeamLetters | None:
        """Reading of letters by the whole formula; None where it reads unions."""
        return TeamLetters.of(self.formula, self.atoms) if self.atoms else None

    def _union(self, held: Mapping[str, Letter]) -> Letter:
        """Return the team's letter, with all propositions of the team that hold."""
        union: Letter = frozenset().union(*held.values())
        return union if self._whole is None else union | self._whole.letter(held)

    def _in_turn(self, part: Normal) -> Failure | None:
        kinds = self._kinds(part)
        graph = InTurn(kinds.words, kinds.counts, self.reading, self._together(part))
        order = find_bad_order(part, graph, self.budget)
        require_second_opinion(graph, part, broken=order is not None)
        if order is None:
            return None
        waiting = [list(names) for names in kinds.robots]
        robots = [waiting[kind].pop(0) for kind in order]
        readings: list[Reading] = []
        for position, robot in enumerate(robots):
            held: dict[str, Letter] = {}
            if self.reading == "joint":
                held |= {other: self.words[other][-1] for other in robots[:position]}
                held |= {other: self.words[other][0] for other in robots[position + 1 :]}
            first = 1 if self.reading == "joint" and position else 0  # its first letter is held already
            word = list(enumerate(self.words[robot]))[first:]
            readings += [(robot, i, self._union({**held, robot: letter})) for i, letter in word]
        return readings, f"In the order {', '.join(robots)}: "

    def _at_once(self, part: Normal) -> Failure | None:
        kinds = self._kinds(part)
        if self.reading == "own" and not part.uses_next and _holds_loosely(part, kinds):
            return None
        broken = find_broken(self._graph(part, kinds), part, self.budget)
        require_second_opinion(self._graph(part, kinds), part, broken=broken is not None)
        if broken is None:
            return None
        try:  # on whole words, so that the counterexample is a shortest one
            whole = self._kinds(part, whole=True)
            exact = find_broken(self._graph(part, whole), part, self.budget)
            if exact is None:
                raise InternalError("Repeating letters changed a verdict without X. This is a bug of ltlplan's.")
            kinds, broken = whole, exact
        except OutOfBudget:
            pass  # the counterexample on shortened words is one as well, only perhaps not a shortest
        if self.reading == "joint":
            readings = _joint_places(kinds, broken.observations, self.words, self._union)
        else:
            readings = _own_places(kinds, broken.observations, self.words, one_for_all=not part.uses_next)
        return readings, "When the flights interleave: "

    def _graph(self, part: Normal, kinds: _Kinds) -> Shuffle | JointShuffle:
        if self.reading == "joint":
            return JointShuffle(kinds.words, kinds.counts, self._together(part))
        counts = kinds.counts
        if not part.uses_next:  # several robots that hold one letter for ever read like one of them
            counts = tuple(1 if len(word) == 1 else count for word, count in zip(kinds.words, counts, strict=True))
        return Shuffle(kinds.words, counts)


def _holds_loosely(part: Normal, kinds: _Kinds) -> bool:
    """Try to prove a conjunct from few robots alone, the others' letters coming at any time.

    Where a conjunct is about what one or two robots do, this spares the product of all.
    """
    states = math.prod(math.comb(n + len(word), n) for word, n in zip(kinds.words, kinds.counts, strict=True))
    if states <= LOOSE_BUDGET:
        return False  # the exact search is as quick
    everyone = [kind for kind, count in enumerate(kinds.counts) for _ in range(min(count, 2))]
    for size in (0, 1, 2):
        for followed in sorted(set(itertools.combinations(everyone, size))):
            left = [count - followed.count(kind) for kind, count in enumerate(kinds.counts)]
            others = {letter for word, count in zip(kinds.words, left, strict=True) if count for letter in word}
            graph = Shuffle([kinds.words[kind] for kind in followed], [1] * size) if followed else None
            if holds_loosely(WithOthers(graph, others), part):
                return True
    return False


def _own_places(
    kinds: _Kinds, observations: Sequence[Observation], words: Mapping[str, tuple[Letter, ...]], *, one_for_all: bool
) -> list[Reading]:
    """Give each reading of a kind to one of its robots, and read whole letters."""
    at = [dict.fromkeys(names, -1) for names in kinds.robots]
    readings: list[Reading] = []
    for observation in observations:
        assert observation.robot is not None
        index, fresh = observation.nodes
        robots = at[observation.robot]
        able = [name for name, place in robots.items() if place == index - fresh]
        stood_for_all = one_for_all and fresh and len(kinds.words[observation.robot]) == 1
        for name in able if stood_for_all else able[:1]:
            robots[name] = index
            run = kinds.runs[name][index]
            readings += [(name, i, words[name][i]) for i in (run if fresh else run[-1:])]
    return readings


def _joint_places(
    kinds: _Kinds,
    observations: Sequence[Observation],
    words: Mapping[str, tuple[Letter, ...]],
    union: Callable[[Mapping[str, Letter]], Letter],
) -> list[Reading]:
    """Follow which robots go on from one union to the next, and read whole letters."""
    at = {name: 0 for names in kinds.robots for name in names}
    held = dict.fromkeys(at, 0)
    readings: list[Reading] = []

    def read() -> None:
        readings.append((TEAM, None, union({name: words[name][index] for name, index in held.items()})))

    before: tuple[int, ...] | None = None
    for observation in observations:
        movers = [] if before is None else _movers(kinds, at, before, observation.nodes)
        for name in movers:
            at[name] += 1
            held[name] = kinds.runs[name][at[name]][0]
        read()
        for name in at if before is None else movers:
            for index in kinds.runs[name][at[name]][1:]:
                held[name] = index
                read()
        before = observation.nodes
    return readings


def _movers(kinds: _Kinds, at: Mapping[str, int], before: tuple[int, ...], after: tuple[int, ...]) -> list[str]:
    """Return robots that go on by one letter so that the counts `before` become those `after`."""
    movers: list[str] = []
    offset = 0
    for word, names in zip(kinds.words, kinds.robots, strict=True):
        leaving = 0
        for place in range(len(word) - 1):
            leaving += before[offset + place] - after[offset + place]
            movers += [name for name in names if at[name] == place][:leaving]
        offset += len(word)
    return movers
