"""The check of a flight: each claim that its statement owes, checked by its proof or not.

A claim is checked where all that it says follows from the statement, the CSV files and the evidence; nothing else counts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import partial
from itertools import combinations
from typing import Any, NamedTuple

from . import distances, hoops, joints, limits, orders, rotors, timelines
from .bodies import Body, body_of
from .distances import Pace, Pair
from .evidence import Evidence
from .flights import Path, Team
from .formulas import show
from .hoops import Frame, Opening, Passage, Rim
from .labels import Relations, Row, Timeline
from .planned import check_ordered
from .refused import Refused
from .relations import check_relations
from .statement import Statement, Wait
from .timelines import Visits
from .transitions import check_transitions
from .words import check_formula

LIMITS = (
    "speed",
    "acceleration",
    "thrust_max",
    "thrust_min",
    "tilt",
    "body_rate",
    "yaw_rate",
    "rotor_thrust_max",
    "rotor_thrust_min",
)


class Checked(NamedTuple):
    """One claim, named as in certificate.json, of some robots: what is checked, or what is missing."""

    name: str
    robots: tuple[str, ...]
    sentence: str
    missing: str


class Owed(NamedTuple):
    """One claim that a statement owes, and its check, which returns a sentence or refuses."""

    name: str
    robots: tuple[str, ...]
    check: Callable[[], str]

    def judge(self) -> Checked:
        """Check it."""
        try:
            return Checked(self.name, self.robots, self.check(), "")
        except Refused as refused:
            return Checked(self.name, self.robots, "", str(refused))
        except (ArithmeticError, LookupError, TypeError, ValueError) as error:  # a fault of the kernel's own proves nothing
            return Checked(self.name, self.robots, "", f"the kernel cannot follow it: {type(error).__name__}")


class Check:
    """Consequences of a statement, a flight and evidence; each thing is looked at once."""

    def __init__(self, statement: Statement, team: Team, evidence: Evidence) -> None:
        self.statement = statement
        self.team = team
        self.evidence = evidence
        self._known: dict[tuple[object, ...], Any] = {}

    def owed(self) -> Iterator[Owed]:
        """Yield every claim that the statement owes, in order."""
        statement, paths = self.statement, list(self.team.paths.values())
        yield Owed("formula", (), self._formula)
        for path in paths:
            claims: dict[str, Callable[[Path], str]] = {
                "transitions": self._transitions, "visits": self._visits, "passages": self._passages, "workspace": self._workspace,
                "continuity": self._continuity,
            }  # fmt: skip
            if any(shape.ring for shape in statement.regions.values()):
                claims["rims"] = self._rims
            if statement.obstacles:
                claims["obstacles"] = self._obstacles
            if any(other.robot.cuts for other in paths):
                claims["parts"] = self._parts
            if path.robot.limits.endurance is not None:
                claims["limits.endurance"] = self._endurance
            claims |= {f"limits.{name}": partial(self._limit, name) for name in LIMITS}
            for name, claim in claims.items():
                yield Owed(name, (path.name,), partial(claim, path))
            for number, visit in enumerate(path.robot.visits):
                for name in ("speed", "acceleration"):
                    if (
                        visit.region in path.robot.limits.legs
                        and getattr(path.robot.limits.legs[visit.region], name) is not None
                    ):
                        yield Owed(f"limits.legs.{name}", (path.name,), partial(self._leg, path, number, name))
        for one, other in combinations(paths, 2):
            yield Owed("separation", (one.name, other.name), partial(self._separation, one, other))
        if statement.words:
            yield Owed("ordered", (), self._ordered)
        for wait in statement.waits:
            yield Owed("precedences", (wait.first[0], wait.then[0]), partial(self._wait, wait))

    def claims(self) -> list[Checked]:
        """Return all claims that the statement owes, each checked or not."""
        return [claim.judge() for claim in self.owed()]

    def _once(self, find: Callable[..., Any], *arguments: Any) -> Any:
        """Find something once; what is refused is refused as often as it is asked for."""
        key = (find, *(one.name if isinstance(one, Path) else one for one in arguments))
        if key not in self._known:
            try:
                self._known[key] = find(*arguments)
            except Refused as refused:
                self._known[key] = refused
        if isinstance(self._known[key], Refused):
            raise self._known[key]
        return self._known[key]

    # What claims rest on

    def _find_body(self, region: str, margin: Fraction) -> Body:
        bridges = [bridge for row in self.evidence.rows(f"bridges/{region}", 4) for bridge in row]
        return body_of(self.statement.regions[region], margin, bridges)

    def _find_rows(self, path: Path) -> dict[str, Row]:
        found: dict[str, Row] = {}
        for region in self.statement.regions:
            body = self._once(self._find_body, region, self.statement.margin)
            found[region] = timelines.spans(path, body, self.evidence.marks(f"inside/{path.name}/{region}"))
        return found

    def _find_nominal(self, path: Path, region: str) -> Row:
        body, marks = self._once(self._find_body, region, Fraction(0)), self.evidence.marks(f"nominal/{path.name}/{region}")
        return timelines.spans(path, body, marks)

    def _find_visits(self, path: Path) -> Visits:
        return timelines.visits(path, self._once(self._find_rows, path))

    def _find_timeline(self, path: Path) -> Timeline:
        robot, changes = path.robot, timelines.actions(path, self._once(self._find_visits, path))
        rows = self._once(self._find_rows, path)
        return Timeline(path.name, self.team.end, rows, robot.states[robot.initial], changes, path.lap)

    def timelines(self) -> dict[str, Timeline]:
        """Return what all robots may show over time.

        Raises:
            Refused: That is not proved.
        """
        return {name: self._once(self._find_timeline, path) for name, path in self.team.paths.items()}

    def relations(self) -> Relations:
        """Return the regions' relations that are proved.

        Raises:
            Refused: One that the proof names is not.
        """
        return self._once(self._find_relations)

    def _find_relations(self) -> Relations:
        return check_relations(self.statement, self.evidence)

    def _find_speed(self, path: Path) -> Fraction:
        bound = self.evidence.number(f"speed/{path.name}")
        if not 0 <= bound <= path.robot.limits.speed:
            raise Refused("its speed is not bounded within the limit")
        limits.check_motion(path, "speed", bound, self.evidence.marks(f"limits/speed/{path.name}"))
        return bound

    def _find_pace(self, path: Path) -> Pace:
        error = self.statement.clock_error
        return distances.pace_of(path, self._once(self._find_speed, path) if error else Fraction(0), error)

    # Claims

    def _formula(self) -> str:
        check_formula(self.statement, self.timelines(), self.relations(), self.evidence)
        return f"Every word of the team satisfies {show(self.statement.formula)}."

    def _ordered(self) -> str:
        check_ordered(self.statement, self.evidence)
        return "The planned words satisfy the formula in every order that keeps the waits."

    def _transitions(self, path: Path) -> str:
        check_transitions(self.statement, path.name, self._once(self._find_timeline, path), self.relations())
        return f"Every word of {path.name} is a trace of its transition system."

    def _visits(self, path: Path) -> str:
        self._once(self._find_timeline, path)
        return (
            f"{path.name} makes its {len(path.robot.visits)} planned visits, in order, and no other; its actions are permitted."
        )

    def _passages(self, path: Path) -> str:
        every: list[Passage] = []
        for name, shape in self.statement.regions.items():
            if shape.ring:
                opening = Opening(Frame.of(shape), self.statement.margin, path.robot.radius)
                every += hoops.passages(path, name, opening, self.evidence.marks(f"openings/{path.name}/{name}"))
        every.sort(key=lambda one: one.start)
        hoops.check_passages(self.statement, path, every, self._once(self._find_visits, path))
        return f"{path.name} passes exactly its planned openings: {' '.join(one.hoop + one.way for one in every) or 'none'}."

    def _rims(self, path: Path) -> str:
        length = self.statement.margin + path.robot.radius
        for name, shape in self.statement.regions.items():
            if shape.ring:
                hoops.check_rim(path, Rim(Frame.of(shape), length), self.evidence.marks(f"rims/{path.name}/{name}"))
        return f"{path.name} stays more than {float(length):.4g} m from every rim."

    def _obstacles(self, path: Path) -> str:
        distances.check_obstacles(self.statement, path, self.evidence)
        return f"{path.name} stays more than {float(self.statement.margin + path.robot.radius):.4g} m from every obstacle."

    def _workspace(self, path: Path) -> str:
        distances.check_workspace(self.statement, path, self.evidence.marks(f"workspace/{path.name}"))
        return f"{path.name} stays in the workspace by {float(self.statement.margin):.4g} m."

    def _continuity(self, path: Path) -> str:
        joints.check_continuity(path, self.team)
        return f"The pieces of {path.name} join, from rest at its start."

    def _parts(self, path: Path) -> str:
        joints.check_parts(path, self.team)
        return f"{path.name} rests at each of {len(path.robot.cuts)} cuts."

    def _endurance(self, path: Path) -> str:
        return f"{path.name} is in the air for {float(joints.check_endurance(self.statement, self.team, path)):.5g} s."

    def _limit(self, name: str, path: Path) -> str:
        limit = float(getattr(path.robot.limits, name))
        if name == "speed":
            return f"{path.name}'s speed is at most {float(self._once(self._find_speed, path)):.5g} m/s (limit {limit:.5g})."
        if name in ("yaw_rate", "rotor_thrust_max", "rotor_thrust_min"):
            self._once(rotors.check_turning, path, self._once(self.evidence.marks, f"turning/{path.name}"))
        else:
            limits.check_limit(path, name, self.evidence.marks(f"limits/{name}/{path.name}"))
        return f"{path.name}'s {name.replace('_', ' ')} keeps its limit {limit:.5g}."

    def _leg(self, path: Path, visit: int, name: str) -> str:
        region = path.robot.visits[visit].region
        nominal, limit = self._once(self._find_nominal, path, region), getattr(path.robot.limits.legs[region], name)
        times = orders.windows(self._once(self._find_visits, path), visit, nominal, path.lap)
        limits.check_motion(path, name, limit, self.evidence.marks(f"limits/legs/{name}/{path.name}/{visit}"), times)
        return f"{path.name}'s {name} on the way to its visit {visit}, of {region}, keeps the limit {float(limit):.5g} there."

    def _separation(self, one: Path, other: Path) -> str:
        error, key = self.statement.clock_error, f"{one.name}/{other.name}"
        paces = [self._once(self._find_pace, path) for path in (one, other)]
        steps = paces[0].step + paces[1].step
        if self.evidence.optional(f"apart/{key}") is not None:
            pair = Pair.of(self.statement, one, other, steps)
            pair.check_all_times(error, self.team.end, self.evidence.marks(f"apart/{key}"))
            return f"The paths of {one.name} and {other.name} stay {float(pair.least):.4f} m apart at all times that clocks may show together."
        pair = Pair.of(self.statement, one, other, steps + min(pace.drift for pace in paces))
        pair.check(self.evidence.marks(f"pairs/{key}"))
        return f"The paths of {one.name} and {other.name} stay {float(pair.least):.4f} m apart; margin, clocks and steps may take some of that."

    def _wait(self, wait: Wait) -> str:
        (first, visit), (then, other) = wait.first, wait.then
        one, two = (
            orders.Events(self.team.paths[name], self._once(self._find_visits, self.team.paths[name]), self.team.end)
            for name in (first, then)
        )
        found: list[Fraction] = []
        for lap in (0, 1) if two.repeats(other) else (0,):
            if (due := two.due(other, wait.due, lap)) is not None:
                found.append(due - one.done(visit, wait.done, lap if one.repeats(visit) else 0))
        if found and min(found) <= self.statement.clock_error:
            raise Refused(f"only {float(min(found)):.4f} s are proved to lie in between")
        by = f", by at least {float(min(found)):.4f} s" if found else ", which never happens"
        return f"{first} has {wait.done} at its visit {visit} before {then} {wait.due} at its visit {other}{by}."
