"""Labels that all robots together must, may or must not show over time: enough for most counts, for any number of robots.

At each time every robot's timeline says of a name that it must, may or must not hold; so it does of a combination that is counted
(three values; where anything is open the answer is *may*), and the number of robots lies between those that must and those
that may or must. A count is then itself must, may or no, as are a robot's own name and a plain name. Every change is *may* for as
long as its enclosure, widened by what clocks may be off, lasts. The words that this leaves open are more than the team can
give: within one span of time all letters that it allows come in any order, any number of times, straight after one another. So
a conjunct that holds of all of them holds of the team; where it does not, nothing is known. The work grows with robots times
changes, not with the product of the robots.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from verify.data.language.formula import Formula
from verify.data.language.word import Letter
from verify.logic.progression import OutOfBudget
from verify.logic.team_letters import TeamLetters
from verify.model_checking.robot_letters import RobotBehaviour
from verify.model_checking.timeline import Status, Timeline

MOST_OPEN = 6
"""Propositions of the team that may be open at one time; 2 to this power letters are then followed."""


def summed(letters: TeamLetters, timelines: Mapping[str, Timeline], clock_error: Fraction) -> RobotBehaviour:
    """Return words of the whole team, as if of one robot that shows a conjunct's propositions: all that it can give, and more.

    Args:
        letters: How the conjunct reads letters.
        timelines: One for each robot, by name.
        clock_error: How far each robot's clock may be off, in s.

    Raises:
        OutOfBudget: More than `MOST_OPEN` propositions are open at one time.
    """
    robots = [_Robot.of(letters, name, timeline, clock_error) for name, timeline in timelines.items()]
    times = sorted({time for robot in robots for time in robot.times})
    slots: list[tuple[tuple[Fraction, Fraction], tuple[Letter, ...]]] = []
    for index, spans in enumerate(_rows(robots, times)):
        choices = _letters(letters, spans)
        start, end = times[index // 2], times[(index + 1) // 2]
        if slots and slots[-1][1] == choices:
            slots[-1] = ((slots[-1][0][0], end), choices)
        else:
            slots.append(((start, end), choices))
    return _graph(slots)


@dataclass(frozen=True, slots=True)
class _Robot:
    """One robot's answers: for each mark and plain name its status in each span between the robot's own times.

    Attributes:
        times: Where anything may begin or end to change, s, 0 and the end among them.
        rows: For each of the robot's slots (each time, and each gap after it) the status of everything that is asked.
    """

    times: tuple[Fraction, ...]
    rows: tuple[Mapping[str, Status], ...]

    @classmethod
    def of(cls, letters: TeamLetters, name: str, timeline: Timeline, clock_error: Fraction) -> _Robot:
        names = letters.names_of(name)
        zero, end = Fraction(0), timeline.duration
        changes: dict[str, list[tuple[Fraction, Fraction, Status]]] = {each: [] for each in names}
        for change in timeline.changes:
            if change.region in names:
                span = max(zero, change.time.low - clock_error), min(end, change.time.high + clock_error)
                changes[change.region].append((*span, change.status))
        inner = timeline.internal
        for action in timeline.actions:
            until = action.time if action.until is None else action.until
            span = max(zero, action.time - clock_error), min(end, until + clock_error)
            for each in (inner ^ action.propositions) & names:
                changes[each].append((*span, "must" if each in action.propositions else "no"))
            inner = action.propositions
        times = sorted({zero, end, *(t for found in changes.values() for low, high, _ in found for t in (low, high))})
        initial: dict[str, Status] = {
            each: "must" if each in timeline.internal else timeline.initial.get(each, "no") for each in names
        }
        columns = {each: _column(initial[each], found, times) for each, found in changes.items()}
        named = letters.named.get(name, ())
        rows: list[Mapping[str, Status]] = []
        for slot in range(2 * len(times) - 1):
            here: dict[str, Status] = {each: column[slot] for each, column in columns.items()}
            row: dict[str, Status] = {each: here[each] for each in letters.plain}
            row |= {text: here[own] for text, own in named}
            row |= {mark: _status(counted, here) for mark, counted in letters.counted.items()}
            rows.append(row)
        return cls(tuple(times), tuple(rows))


def _column(status: Status, changes: Sequence[tuple[Fraction, Fraction, Status]], times: Sequence[Fraction]) -> list[Status]:
    """Return a name's status at each time and in each gap after one."""
    column: list[Status] = []
    may: Status = "may"
    place = {time: 2 * i for i, time in enumerate(times)}
    for low, high, after in changes:
        first, last = place[low], place[high]
        column.extend(itertools.repeat(status, first - len(column)))
        for slot in range(first, len(column)):
            column[slot] = may
        column.extend(itertools.repeat(may, last + 1 - len(column)))
        status = after
    column.extend(itertools.repeat(status, 2 * len(times) - 1 - len(column)))
    return column


_NOT: Mapping[Status, Status] = {"must": "no", "no": "must", "may": "may"}


def _status(counted: Formula, here: Mapping[str, Status]) -> Status:
    """Return whether a combination of names must hold, may hold, or cannot."""
    if counted.operator == "name":
        return here[counted.name]
    if counted.operator in ("true", "false"):
        return "must" if counted.operator == "true" else "no"
    parts: list[Status] = [_status(part, here) for part in counted.arguments]
    match counted.operator:
        case "!":
            return _NOT[parts[0]]
        case "&":
            return "no" if "no" in parts else "may" if "may" in parts else "must"
        case "|" | "->":
            parts = parts if counted.operator == "|" else [_NOT[parts[0]], parts[1]]
            return "must" if "must" in parts else "may" if "may" in parts else "no"
        case _:
            return "may" if "may" in parts else "must" if (parts[0] == parts[1]) == (counted.operator == "<->") else "no"


def _rows(robots: Sequence[_Robot], times: Sequence[Fraction]) -> Iterator[dict[str, tuple[int, int]]]:
    """Yield for each time, and each gap after one, how many robots must and how many may or must show each thing."""
    at = [0] * len(robots)
    sums: dict[str, list[int]] = {}

    def add(row: Mapping[str, Status], sign: int) -> None:
        for name, status in row.items():
            total = sums.setdefault(name, [0, 0])
            total[0] += sign * (status == "must")
            total[1] += sign * (status != "no")

    for robot in robots:
        add(robot.rows[0], 1)
    for index, time in enumerate(times):
        for which, robot in enumerate(robots):  # a robot's slot k is its time k / 2, or the gap after that
            slot = at[which]
            if slot % 2 and robot.times[(slot + 1) // 2] == time:
                add(robot.rows[slot], -1)
                at[which] += 1
                add(robot.rows[slot + 1], 1)
        yield {name: (low, high) for name, (low, high) in sums.items()}
        if index + 1 == len(times):
            return
        for which, robot in enumerate(robots):
            slot = at[which]
            if not slot % 2 and slot + 1 < len(robot.rows):
                add(robot.rows[slot], -1)
                at[which] += 1
                add(robot.rows[slot + 1], 1)
        yield {name: (low, high) for name, (low, high) in sums.items()}


def _letters(letters: TeamLetters, sums: Mapping[str, tuple[int, int]]) -> tuple[Letter, ...]:
    """Return all letters that these numbers of robots leave open."""
    fixed: set[str] = set()
    choices: list[tuple[frozenset[str], ...]] = []
    levels = [(name, ((1, name),)) for name in letters.plain]
    levels += [(text, ((1, text),)) for pairs in letters.named.values() for text, _ in pairs]
    for name, steps in (*levels, *letters.together.sums):
        low, high = sums.get(name, (0, 0))
        fixed.update(text for least, text in steps if least <= low)
        open_ = [text for least, text in steps if low < least <= high]
        if open_:  # of one sum the smaller thresholds come first
            choices.append(tuple(frozenset(open_[:count]) for count in range(len(open_) + 1)))
    if len(choices) > MOST_OPEN:
        raise OutOfBudget(f"more than {MOST_OPEN} propositions of the team are open at one time")
    found = {frozenset(fixed).union(*chosen) for chosen in itertools.product(*choices)}
    return tuple(sorted(found, key=sorted))


def _graph(slots: Sequence[tuple[tuple[Fraction, Fraction], tuple[Letter, ...]]]) -> RobotBehaviour:
    """Return the graph in which all letters of one slot may follow one another, and then those of the next."""
    begins = [0, *itertools.accumulate(len(choices) for _, choices in slots)]
    following: list[tuple[int, ...]] = []
    for index in range(len(slots)):
        here = range(begins[index], begins[index + 1])
        after = range(begins[index + 1], begins[index + 2]) if index + 1 < len(slots) else range(0)
        following += [tuple(target for target in (*here, *after) if target != node) for node in here]
    return RobotBehaviour(
        "",
        tuple(letter for _, choices in slots for letter in choices),
        tuple(span for span, choices in slots for _ in choices),
        tuple(following),
        tuple(range(len(slots[0][1]))),
        frozenset(range(begins[-2], begins[-1])),
        actions=(0,) * begins[-1],
    )
