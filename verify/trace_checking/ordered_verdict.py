"""Words of a team checked against a formula under stated precedences: every team word that keeps them must satisfy it.

An *event* is a robot's coming to a letter of its word (entering or leaving a region, an action); a *precedence* says that one
robot's event is over before another robot's happens. With none this is the claim `parallel`. Like that one it is decided
conjunct by conjunct, over what each sees of the robots' letters, by our progression and, where the team's words are few
enough to be written down, by Spot as well.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from verify.data.errors import BadInput
from verify.data.language.counting import Atom, atoms
from verify.data.language.formula import Formula
from verify.data.language.word import Letter
from verify.data.names.former_names import former_arguments
from verify.data.sections import TeamReading
from verify.logic.explanation import show
from verify.logic.normal_form import Normal
from verify.logic.progression import OutOfBudget
from verify.logic.team_letters import TeamLetters
from verify.logic.verdict import TEAM, Verdict
from verify.model_checking.inclusion import DEFAULT_BUDGET, find_broken
from verify.model_checking.team_graph import Observation
from verify.trace_checking.conjunct_by_conjunct import Failure, as_team, decided, require_second_opinion
from verify.trace_checking.counterexamples import Reading
from verify.trace_checking.ordered_graph import Event, OrderedTogether, OrderedTurns
from verify.trace_checking.word_verdict import Letters

LetterEvent = tuple[str, int]
"""A robot and the index, from 1 on, of the letter of its word that it comes to."""


@former_arguments(reading="team")
def check_ordered(
    formula: str | Formula,
    words: Mapping[str, Letters],
    precedences: Iterable[tuple[LetterEvent, LetterEvent]],
    team: TeamReading = "own",
    *,
    budget: int = DEFAULT_BUDGET,
) -> Verdict:
    """Decide whether every team word that keeps some precedences satisfies a formula.

    Args:
        formula: LTLf in Spot's syntax.
        words: Each robot's word: a `Word`, or a sequence of sets of names.
        precedences: Pairs of events ((robot, letter), (robot, letter)): the first is over before the second happens.
        team: "own": a position is one robot's letter; "joint": the union of all robots' letters.
        budget: Configurations that each conjunct may take before the answer is `undecided`.

    Returns:
        A verdict on the claim `ordered`. Precedences that go round in a circle are kept by no flight: it fails.

    Raises:
        FormulaError: The text is no formula.
        BadInput: No robots, an empty word, a word with a cycle, an event that is none, or a formula under "own" that counts robots.
        MissingEngine: Spot, which gives the second opinion, is absent.
    """
    formula, given = as_team(formula, words, team)
    if lassos := [name for name, word in given.items() if word.cycle is not None]:
        raise BadInput(f"{lassos[0]}'s word has a cycle; precedences order the events of finite words.")
    letters = {name: word.prefix for name, word in given.items()}
    pairs = _checked(precedences, letters)
    if circle := _circle(letters, pairs):
        return Verdict("fails", f"No flight keeps these precedences, which go round in a circle: {circle}.", claim="ordered")
    return _Ordered(formula, letters, pairs, team, budget, atoms(formula)).decide()


_Pairs = tuple[tuple[LetterEvent, LetterEvent], ...]


def _checked(precedences: Iterable[tuple[LetterEvent, LetterEvent]], letters: Mapping[str, tuple[Letter, ...]]) -> _Pairs:
    """Return precedences whose events are some.

    Raises:
        BadInput: An event names no robot of the team, or no letter that is come to.
    """
    pairs = tuple(dict.fromkeys(precedences))
    for robot, index in (event for pair in pairs for event in pair):
        if robot not in letters:
            raise BadInput(f"A precedence names '{robot}', which has no word here.")
        if isinstance(index, bool) or not isinstance(index, int) or not 1 <= index < len(letters[robot]):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
            raise BadInput(
                f"A precedence names letter {index!r} of {robot}, which comes to letters 1 to {len(letters[robot]) - 1} after its "
                "first one, letter 0."
            )
    return pairs


def _circle(letters: Mapping[str, tuple[Letter, ...]], pairs: _Pairs) -> str:
    """Return events that wait for each other, as a sentence's end; empty where none do."""
    waiting: dict[LetterEvent, set[LetterEvent]] = {
        (name, i): set() for name, word in letters.items() for i in range(1, len(word))
    }
    for first, then in pairs:
        waiting[then].add(first)
    for (name, index), events in waiting.items():
        if index > 1:
            events.add((name, index - 1))
    done: set[LetterEvent] = set()
    while free := [event for event, events in waiting.items() if events <= done]:
        for event in free:
            done.add(event)
            del waiting[event]
    if not waiting:
        return ""
    at, seen = min(waiting), list[LetterEvent]()
    while at not in seen:
        seen.append(at)
        at = min(waiting[at] & waiting.keys())
    return ", after ".join(f"{name}'s letter {index + 1}" for name, index in (*seen[seen.index(at) :], at))


def _earlier(words: Mapping[str, tuple[Letter, ...]], pairs: _Pairs) -> dict[LetterEvent, dict[str, int]]:
    """Return for each event the last letter of each robot that is come to earlier for sure; precedences must not go round in a circle."""
    waits: dict[LetterEvent, list[LetterEvent]] = {}
    for first, then in pairs:
        waits.setdefault(then, []).append(first)
    found: dict[LetterEvent, dict[str, int]] = {}
    left = [(name, index) for name, word in words.items() for index in range(1, len(word))]
    while left:
        later: list[LetterEvent] = []
        for name, index in left:
            events = [*waits.get((name, index), ()), *([(name, index - 1)] if index > 1 else ())]
            if any(event not in found for event in events):
                later.append((name, index))
                continue
            last: dict[str, int] = {}
            for event in events:
                for other, at in (*found[event].items(), event):
                    last[other] = max(last.get(other, 0), at)
            found[name, index] = last
        left = later
    return found


@dataclass(frozen=True)
class _Seen:
    """View of the robots by one conjunct.

    Attributes:
        names: The robots that are followed.
        words: What is seen of each one's word, without repetitions that no precedence tells apart.
        runs: For each of these letters the whole letters, by index.
        before: What each event waits for, by numbers of robots and letters.
        equals: For robots that hold one letter all the time: others that hold what looks like it.
    """

    names: tuple[str, ...]
    words: tuple[tuple[Letter, ...], ...]
    runs: tuple[tuple[tuple[int, ...], ...], ...]
    before: Mapping[Event, tuple[Event, ...]]
    equals: Mapping[str, tuple[str, ...]]


@dataclass(frozen=True)
class _Ordered:
    formula: Formula
    words: Mapping[str, tuple[Letter, ...]]
    pairs: _Pairs
    reading: TeamReading
    budget: int
    atoms: Mapping[str, Atom]

    def decide(self) -> Verdict:
        """Decide the claim."""
        holds = f"Every team word that keeps the stated precedences satisfies `{show(self.formula)}`"
        return decided(self.formula, self.words, "ordered", self._broken, holds)

    def _broken(self, part: Normal) -> Failure | None:
        """Return a team word that keeps the precedences and breaks one conjunct, or None."""
        if self.reading == "joint" and not part.uses_next and self._always_holds(part):
            return None
        seen = self._seen(part)
        broken = find_broken(self._graph(part, seen), part, self.budget)
        require_second_opinion(self._graph(part, seen), part, broken=broken is not None)
        if broken is None:
            return None
        read = self._together if self.reading == "joint" else self._turns
        how = "With these precedences the flights can still come so: " if self.pairs else "When the flights interleave: "
        return read(seen, broken.observations), how

    def _always_holds(self, part: Normal) -> bool:
        """Tell whether a conjunct holds in all orders of the events that it sees; False where the budget does not suffice to know."""
        seen = self._seen_alone(part)
        try:
            broken = find_broken(self._graph(part, seen), part, self.budget) is not None
        except OutOfBudget:
            return False
        require_second_opinion(self._graph(part, seen), part, broken=broken)
        return not broken

    def _graph(self, part: Normal, seen: _Seen) -> OrderedTurns | OrderedTogether:
        if self.reading == "own":
            return OrderedTurns(seen.words, seen.before)
        counts = not self.atoms.keys().isdisjoint(part.propositions)
        return OrderedTogether(seen.words, seen.before, TeamLetters.of(part, self.atoms).together if counts else None)

    def _seen(self, part: Normal) -> _Seen:
        """Cut words to what a conjunct sees; a letter that looks like the one before is the same where no precedence names it."""
        own, firm = TeamLetters.of(part, self.atoms).own, {event for pair in self.pairs for event in pair}
        words: dict[str, list[Letter]] = {}
        runs: dict[str, list[list[int]]] = {}
        place: dict[LetterEvent, int] = {}
        for name, word in self.words.items():
            kept, run = words.setdefault(name, []), runs.setdefault(name, [])
            for index, letter in enumerate(word):
                cut = own(name, letter)
                if kept and cut == kept[-1] and (name, index) not in firm and not part.uses_next:
                    run[-1].append(index)
                else:
                    kept.append(cut)
                    run.append([index])
                place[name, index] = len(kept) - 1
        equals: dict[str, tuple[str, ...]] = {}
        followed = list(words)
        if self.reading == "own" and not part.uses_next:  # several that hold one letter for ever read like one of them
            same: dict[Letter, list[str]] = {}
            for name, kept in words.items():
                if len(kept) == 1:
                    same.setdefault(kept[0], []).append(name)
            equals = {names[0]: tuple(names[1:]) for names in same.values()}
            followed = [name for name in words if not any(name in others for others in equals.values())]
        number = {name: i for i, name in enumerate(followed)}
        before: dict[Event, tuple[Event, ...]] = {}
        for (a, i), (b, j) in self.pairs:
            then = number[b], place[b, j]
            before[then] = (*before.get(then, ()), (number[a], place[a, i]))
        return _Seen(
            tuple(followed),
            tuple(tuple(words[name]) for name in followed),
            tuple(tuple(map(tuple, runs[name])) for name in followed),
            before,
            equals,
        )

    def _seen_alone(self, part: Normal) -> _Seen:
        """Cut words to the letters that change what a conjunct sees, in the order in which those come by all precedences.

        The order of the other events is left out: as time passes they may come at any time that it allows, and nothing is seen of them.
        """
        own = TeamLetters.of(part, self.atoms).own
        seen = {name: [own(name, letter) for letter in word] for name, word in self.words.items()}
        changes = {name: [i for i, cut in enumerate(cuts) if i == 0 or cut != cuts[i - 1]] for name, cuts in seen.items()}
        number = {name: i for i, name in enumerate(self.words)}
        before: dict[Event, tuple[Event, ...]] = {}
        earlier = _earlier(self.words, self.pairs)
        for name, kept in changes.items():
            for place, index in enumerate(kept[1:], start=1):
                events = [
                    (number[other], at)
                    for other, last in earlier[name, index].items()
                    if other != name and (at := sum(i <= last for i in changes[other]) - 1) > 0
                ]
                if events:
                    before[number[name], place] = tuple(events)
        words = tuple(tuple(seen[name][i] for i in kept) for name, kept in changes.items())
        return _Seen(tuple(self.words), words, (), before, {})

    def _turns(self, seen: _Seen, observations: Sequence[Observation]) -> list[Reading]:
        """Read whole letters of single robots."""
        readings: list[Reading] = []
        known: set[Event] = set()
        for observation in observations:
            assert observation.robot is not None
            robot, node = observation.robot, observation.nodes[observation.robot]
            name, run = seen.names[robot], seen.runs[robot][node]
            fresh = (robot, node) not in known
            known.add((robot, node))
            readings += [(name, index, self.words[name][index]) for index in (run if fresh else run[-1:])]
            for other in seen.equals.get(name, ()) if fresh else ():
                readings += [(other, index, letter) for index, letter in enumerate(self.words[other])]
        return readings

    def _together(self, seen: _Seen, observations: Sequence[Observation]) -> list[Reading]:
        """Read unions of whole letters; letters that look alike to the conjunct are gone through one robot after another."""
        held = dict.fromkeys(self.words, 0)
        whole = TeamLetters.of(self.formula, self.atoms) if self.atoms else None
        readings: list[Reading] = []

        def read() -> None:
            letters = {name: self.words[name][index] for name, index in held.items()}
            union = frozenset[str]().union(*letters.values())
            readings.append((TEAM, None, union if whole is None else union | whole.letter(letters)))

        before: tuple[int, ...] | None = None
        for observation in observations:
            moved = [i for i, node in enumerate(observation.nodes) if before is None or before[i] != node]
            for robot in moved:
                held[seen.names[robot]] = seen.runs[robot][observation.nodes[robot]][0]
            read()
            for robot in moved:
                for index in seen.runs[robot][observation.nodes[robot]][1:]:
                    held[seen.names[robot]] = index
                    read()
            before = observation.nodes
        return readings
