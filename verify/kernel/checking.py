"""The check of a flight: a claim is checked where all that it says follows from the statement, the CSV files and the evidence; nothing else counts."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from fractions import Fraction
from functools import cache, partial
from itertools import combinations
from typing import NamedTuple

from .flights import Team
from .formulas import show
from .limits import TURNING, Turning, check_continuity, check_endurance, check_parts, kept
from .statement import Refused, Statement, at_least
from .team import check_transitions
from .timelines import Course
from .timing import check_timing
from .trees import Evidence, Part, Rules
from .words import check_words, flown, planned
from .zones import Flight, Pair, Sums, along, obstacle, rim, workspace


class Checked(NamedTuple):
    """One claim, named as in certificate.json, of some robots: what is checked, or what is missing."""

    name: str
    robots: tuple[str, ...]
    sentence: str
    missing: str


class Owed(NamedTuple):
    """One claim that a statement owes: its sentence, or what is checked and returns it, and trees of parts, by the key of their evidence."""

    name: str
    robots: tuple[str, ...]
    rest: str | Callable[[], object]
    trees: Iterable[tuple[str, Iterable[Part]]] = ()


class Check:
    """Consequences of a statement, a flight and evidence; each tree is looked at once."""

    def __init__(self, statement: Statement, team: Team, evidence: Evidence) -> None:
        self.statement, self.team, self.evidence, self._proved = statement, team, evidence, set[str]()
        self._obstacle, self._rim = cache(self._solid), cache(rim)
        self.courses: Mapping[str, Course] = {name: Course(statement, path, evidence) for name, path in team.paths.items()}

    def claims(self) -> list[Checked]:
        """Return all claims that the statement owes, each checked or not."""
        return [self._judge(owed) for owed in self.owed()]

    def _judge(self, owed: Owed) -> Checked:
        try:
            for key, parts in owed.trees:
                if key not in self._proved:
                    self.evidence.prove(key, parts)
                    self._proved.add(key)
            return Checked(owed.name, owed.robots, str(owed.rest() if callable(owed.rest) else owed.rest), "")
        except Refused as refused:
            return Checked(owed.name, owed.robots, "", str(refused))
        except (ArithmeticError, LookupError, TypeError, ValueError) as error:  # a fault of the kernel's own proves nothing
            return Checked(owed.name, owed.robots, "", f"the kernel cannot follow it: {type(error).__name__}")

    def owed(self) -> Iterator[Owed]:
        """Yield every claim that the statement owes, in order."""
        statement, evidence = self.statement, self.evidence
        yield Owed("formula", (), self._formula)
        for part in statement.timed or ():
            yield Owed("timing", (), partial(check_timing, (statement, part), self.courses))
        for course in self.courses.values():
            yield from self._of_robot(course)
        flights = [Flight(statement, path) for path in self.team.paths.values()]
        for pair in (Pair(statement.separation, one, other) for one, other in combinations(flights, 2)):
            one, other = (flight.path.name for flight in pair.flights)
            apart = f"The paths of {one} and {other} stay {pair.apart} apart at all times that clocks may show together."
            yield Owed("separation", (one, other), apart, [(f"apart/{one}/{other}", pair.parts(statement.clock_error))])
        if statement.words:
            ordered = "The planned words satisfy the formula in every order that keeps the waits."
            yield Owed("ordered", (), lambda: ordered if check_words(planned(statement), evidence) else "")
        for wait in statement.waits:
            first, then = self.courses[wait.first[0]], self.courses[wait.then[0]]
            yield Owed("precedences", (first.name, then.name), partial(then.waits, wait, first))

    def _formula(self) -> str:
        check_words(flown(self.statement, {name: one.timeline for name, one in self.courses.items()}), self.evidence)
        return f"Every word of the team satisfies {show(self.statement.formula)}."

    def _of_robot(self, course: Course) -> Iterator[Owed]:
        statement, team, path, name, of = self.statement, self.team, course.path, course.name, (course.name,)
        margin, near = statement.margin, statement.margin + course.robot.radius
        yield Owed("transitions", of, lambda: check_transitions(statement, course.timeline))
        visits = f"{name} makes its {len(course.robot.visits)} planned visits, no other; its actions are permitted."
        yield Owed("visits", of, lambda: visits if course.timeline else "")
        yield Owed("passages", of, lambda: f"{name} passes exactly its planned openings: {course.passages()}.")
        walls = [(f"workspace/{name}", along(path, workspace((statement.low, statement.high), margin)))]
        yield Owed("workspace", of, f"The path of {name} stays {float(margin)} m inside the workspace.", walls)
        yield Owed("continuity", of, partial(check_continuity, path, team))
        if hoops := {one: shape for one, shape in statement.regions.items() if shape.ring}:
            rims = ((f"rims/{name}/{one}", along(path, self._rim(shape, near))) for one, shape in hoops.items())
            yield Owed("rims", of, f"The path of {name} stays more than {at_least(near)} m from every rim.", rims)
        if statement.obstacles:
            solid = ((f"obstacles/{name}/{one}", along(path, self._obstacle(one, near))) for one in statement.obstacles)
            yield Owed("obstacles", of, f"The path of {name} stays more than {at_least(near)} m from every obstacle.", solid)
        if any(other.robot.cuts for other in team.paths.values()):
            yield Owed("parts", of, partial(check_parts, path, team))
        if course.robot.endurance is not None:
            yield Owed("limits.endurance", of, partial(check_endurance, team, path))
        for limit, value in course.robot.limits.items():
            most = f"On its path {name}'s {limit.replace('_', ' ')} keeps its limit {float(value)}."
            turning = f"turning/{name}", (Turning(course.robot, piece) for piece in path.pieces)
            trees = [turning if limit in TURNING else (f"limits/{limit}/{name}", kept(path, (limit, value)))]
            yield Owed(f"limits.{limit}", of, most, trees)
        for number, visit in enumerate(course.robot.visits):
            for limit in course.robot.legs.get(visit.region, {}).items():
                yield Owed(f"limits.legs.{limit[0]}", of, partial(course.leg, number, limit))

    def _solid(self, name: str, length: Fraction) -> Rules:
        shape, sums = self.statement.obstacles[name], self.evidence.get(f"sums/{name}", tuple[Sums, ...] | None)
        hoops = tuple(self.statement.regions[one] for one in shape.openings or ())
        return obstacle((shape, hoops, sums or ((),) * len(shape.parts)), length)
