"""The check of a flight: each claim that its statement owes, checked by its proof or not.

A claim is checked where all that it says follows from the statement, the CSV files and the evidence; nothing else counts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from fractions import Fraction
from functools import partial
from itertools import combinations
from typing import NamedTuple

from .distances import Flight, Pair
from .flights import Team
from .joints import check_continuity, check_endurance, check_parts
from .limits import LIMITS, TURNING, Turning, kept
from .places import check_transitions
from .refused import Refused, require
from .statement import ZERO, Statement
from .timelines import Course
from .trees import Evidence, Rules, Trees
from .words import check_formula, check_ordered
from .zones import Sums, along, hoop_of, obstacle, rim, workspace


class Checked(NamedTuple):
    """One claim, named as in certificate.json, of some robots: what is checked, or what is missing."""

    name: str
    robots: tuple[str, ...]
    sentence: str
    missing: str


class Owed(NamedTuple):
    """One claim that a statement owes: its sentence, or what is checked and returns it, and its trees."""

    name: str
    robots: tuple[str, ...]
    rest: str | Callable[[], str]
    trees: Iterable[Trees] = ()


class Check:
    """Consequences of a statement, a flight and evidence; each tree is looked at once."""

    def __init__(self, statement: Statement, team: Team, evidence: Evidence) -> None:
        self.statement, self.team, self.evidence = statement, team, evidence
        self.courses: Mapping[str, Course] = {name: Course(statement, path, evidence) for name, path in team.paths.items()}
        self._proved, self._flights = set[str](), dict[str, Flight]()

    def claims(self) -> list[Checked]:
        """Return all claims that the statement owes, each checked or not."""
        return [self._judge(owed) for owed in self.owed()]

    def _judge(self, owed: Owed) -> Checked:
        try:
            for trees in owed.trees:
                if trees.key not in self._proved:
                    trees.check(self.evidence)
                    self._proved.add(trees.key)
            return Checked(owed.name, owed.robots, owed.rest if isinstance(owed.rest, str) else owed.rest(), "")
        except Refused as refused:
            return Checked(owed.name, owed.robots, "", str(refused))
        except (ArithmeticError, LookupError, TypeError, ValueError) as error:  # a fault of the kernel's own proves nothing
            return Checked(owed.name, owed.robots, "", f"the kernel cannot follow it: {type(error).__name__}")

    def owed(self) -> Iterator[Owed]:
        """Yield every claim that the statement owes, in order."""
        yield Owed("formula", (), self._formula)
        for course in self.courses.values():
            yield from self._of_robot(course)
        for one, other in combinations(self.courses.values(), 2):
            yield Owed("separation", (one.name, other.name), partial(self._apart, one, other), self.separation(one, other))
        if self.statement.words:
            yield Owed("ordered", (), partial(check_ordered, self.statement, self.evidence))
        for wait in self.statement.waits:
            first, then = self.courses[wait.first[0]], self.courses[wait.then[0]]
            yield Owed("precedences", (first.name, then.name), partial(then.waits, wait, first))

    def _of_robot(self, course: Course) -> Iterator[Owed]:
        statement, team, path, name, of = self.statement, self.team, course.path, course.name, (course.name,)
        margin, near, limits = statement.margin, statement.margin + course.robot.radius, course.robot.limits
        yield Owed("transitions", of, lambda: check_transitions(statement, course.timeline))
        visits = f"{name} makes its {len(course.robot.visits)} planned visits, no other; its actions are permitted."
        yield Owed("visits", of, lambda: visits if course.timeline else "")
        yield Owed("passages", of, lambda: f"{name} passes exactly its planned openings: {course.passages()}.")
        walls = Trees(f"workspace/{name}", along(path, workspace((statement.low, statement.high), margin)))
        yield Owed("workspace", of, f"{name} stays in the workspace by {float(margin):.4g} m.", [walls])
        yield Owed("continuity", of, partial(check_continuity, path, team))
        if hoops := {one: hoop_of(shape) for one, shape in statement.regions.items() if shape.ring}:
            rims = (Trees(f"rims/{name}/{one}", along(path, rim(hoop, near))) for one, hoop in hoops.items())
            yield Owed("rims", of, f"{name} stays more than {float(near):.4g} m from every rim.", rims)
        if statement.obstacles:
            solid = (Trees(f"obstacles/{name}/{one}", along(path, self._obstacle(one, near))) for one in statement.obstacles)
            yield Owed("obstacles", of, f"{name} stays more than {float(near):.4g} m from every obstacle.", solid)
        if any(other.robot.cuts for other in team.paths.values()):
            yield Owed("parts", of, partial(check_parts, path, team))
        if limits.endurance is not None:
            yield Owed("limits.endurance", of, partial(check_endurance, team, path))
        for limit in LIMITS:
            most = f"{name}'s {limit.replace('_', ' ')} keeps its limit {float(getattr(limits, limit)):.5g}."
            kept_by = partial(self._bound, course) if limit == "speed" else most
            yield Owed(f"limits.{limit}", of, kept_by, self._limit(limit, course))
        for number, visit in enumerate(course.robot.visits):
            for limit, value in limits.legs.get(visit.region, {}).items():
                most = f"{name}'s {limit} keeps the limit {float(value):.5g} on the way to visit {number}, of {visit.region}."
                yield Owed(f"limits.legs.{limit}", of, most, self._leg(course, number, limit))

    # What claims rest on

    def _obstacle(self, name: str, length: Fraction) -> Rules:
        shape, sums = self.statement.obstacles[name], self.evidence.get(f"sums/{name}", tuple[Sums, ...] | None)
        hoops = tuple(self.statement.regions[one] for one in shape.openings or ())
        return obstacle(shape, hoops, length, sums or ((),) * len(shape.parts))

    def _speed(self, course: Course) -> Fraction:
        """Return a bound on a robot's speed, m/s, that has trees of its own."""
        bound: Fraction = self.evidence.get(f"speed/{course.name}", Fraction)
        require(0 <= bound <= course.robot.limits.speed, "its speed is not bounded within the limit")
        return bound

    def _bound(self, course: Course) -> str:
        return f"{course.name}'s speed is at most {float(self._speed(course)):.5g} m/s (limit {float(course.robot.limits.speed):.5g})."

    def _leg(self, course: Course, visit: int, limit: str) -> Iterator[Trees]:
        value, times = course.robot.limits.legs[course.robot.visits[visit].region][limit], course.windows(visit)
        yield Trees(f"limits/legs/{limit}/{course.name}/{visit}", kept(course.path, limit, value, times))

    def _limit(self, limit: str, course: Course) -> Iterator[Trees]:
        if limit in TURNING:
            yield Trees(f"turning/{course.name}", (Turning(course.robot, piece) for piece in course.path.pieces))
        else:
            value = self._speed(course) if limit == "speed" else getattr(course.robot.limits, limit)
            yield Trees(f"limits/{limit}/{course.name}", kept(course.path, limit, value))

    def separation(self, one: Course, other: Course) -> Iterator[Trees]:
        """Yield the trees of a pair's distance: of all times that clocks may show together, where the proof has them, or of each time."""
        key, error = f"{one.name}/{other.name}", self.statement.clock_error
        if self.evidence.has(f"apart/{key}"):
            yield Trees(f"apart/{key}", self.pair((one, other), all_times=True).at_all_times(error))
        else:
            for course in (one, other) if error else ():
                yield from self._limit("speed", course)
            yield Trees(f"pairs/{key}", self.pair((one, other), all_times=False).at_each_time())

    def pair(self, both: tuple[Course, Course], *, all_times: bool) -> Pair:
        """Return how far apart two paths have to be at all times that clocks may show together, or at each time."""
        for course in both:
            if course.name not in self._flights:
                self._flights[course.name] = Flight(self.statement, course.path)
        error, drift = self.statement.clock_error, ZERO
        if error and not all_times:
            drift = min(course.path.drift(self._speed(course), error) for course in both)
        return Pair(self.statement.separation, (self._flights[both[0].name], self._flights[both[1].name]), drift)

    # The rest of claims

    def _formula(self) -> str:
        return check_formula(self.statement, {name: one.timeline for name, one in self.courses.items()}, self.evidence)

    def _apart(self, one: Course, other: Course) -> str:
        all_times = self.evidence.has(f"apart/{one.name}/{other.name}")
        least, when = float(self.pair((one, other), all_times=all_times).least), "at all times that clocks may show together"
        when = when if all_times else "at each time; margin, clocks and steps may take some of that"
        return f"The paths of {one.name} and {other.name} stay {least:.4f} m apart {when}."
