"""A plan: who visits what in which order, and the points that lead there. No times are promised yet.

The planner writes it, refinement turns it into polynomials, and the checker holds the polynomials against it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError

from verify.data.errors import BadInput
from verify.data.language.sequence import Direction
from verify.data.language.word import Word
from verify.data.mission import Mission, check_mission
from verify.data.sections import Action
from verify.data.shapes.inequalities import Point
from verify.data.storage.safe_reading import parse_json, read_text
from verify.data.value import Remembered, Value, faults_of, plain
from verify.data.vehicle import NotNegative, Number

PLAN_FORMAT = 1
PLAN_FILE = "plan.json"

MAX_BYTES = 20_000_000

Role = Literal["start", "front", "rear", "centre", "avoid", "via", "end"]


class Visit(Value):
    """One stay in one region.

    Attributes:
        region: Which region or hoop.
        direction: For a hoop that is flown through: the side; None where no passage is planned.
        actions: Changes of the internal state made during this visit, in order.
    """

    region: str
    direction: Direction | None = None
    actions: tuple[Action, ...] = ()


class Waypoint(Value):
    """A point that the path goes through.

    Attributes:
        position: m, world frame.
        role: Which control point it is; "via" for points that a planner added.
        region: The hoop or region that it belongs to, if any (for "avoid": the hoop that is avoided).
        visit: Index of the planned visit that it serves, if any.
    """

    position: Point
    role: Role
    region: str | None = None
    visit: int | None = None


class RobotPlan(Value):
    """Plan of one robot.

    Attributes:
        word: The letters that it will show; free flight included.
        visits: Regions in the order in which they are entered (for a lasso: prefix, then one lap).
        waypoints: At least the start. For a lasso the last waypoint repeats `waypoints[cycle_waypoint]`.
        times: Nominal time at each waypoint, s; the first is 0 and none goes back.
        cycle_visit: Index of the first visit of the cycle; None for a finite flight. Equal to the number of
            visits where the cycle visits nothing (a hover).
        cycle_waypoint: Index of the waypoint at which the cycle begins; None for a finite flight.
        hold: s that the robot waits at its start before it departs.
        cost: The robot's own cost under the planner's cost function; of laps the first counts, and what leads to it.
    """

    word: Word
    visits: tuple[Visit, ...] = ()
    waypoints: tuple[Waypoint, ...] = Field(min_length=1)
    times: tuple[NotNegative, ...] = Field(min_length=1)
    cycle_visit: int | None = None
    cycle_waypoint: int | None = None
    hold: NotNegative = 0.0
    cost: Number = 0.0

    @property
    def hovers(self) -> bool:
        """True if it is a lasso whose cycle visits nothing: the robot hovers where its last visit has led it."""
        return self.cycle_visit == len(self.visits)

    @property
    def still(self) -> bool:
        """True if the robot never leaves its start."""
        return len({waypoint.position for waypoint in self.waypoints}) == 1

    @property
    def ends_in(self) -> str | None:
        """Region in which the robot ends its flight; None where it has left the last one, or visits none."""
        last = self.waypoints[-1]
        return None if last.role == "via" else last.region  # one that leads out of a region names it


Done = Literal["left", "entered", "acted"]
Due = Literal["enters", "leaves", "acts"]


class Precedence(Value):
    """An event of one robot that is over before one of another robot happens.

    Attributes:
        first: (robot, index of visit): whose visit is waited for.
        then: (robot, index of visit): who waits.
        done: What `first` must have done: left its visit, entered it, or made all of its actions there.
        due: What `then` does only afterwards: enter its visit, leave it, or make the first of its actions there.
    """

    first: tuple[str, int]
    then: tuple[str, int]
    done: Done = "left"
    due: Due = "enters"

    def sentence(self, robots: Mapping[str, RobotPlan]) -> str:
        """Return the precedence in words, such as "quad1 enters b only when quad0 has left a"."""
        done = {"left": "left", "entered": "entered", "acted": "acted in"}[self.done]
        due = {"enters": "enters", "leaves": "leaves", "acts": "acts in"}[self.due]
        return _sentence(robots, self, due, done)


class Meeting(Value):
    """`first` must have entered its visit before `then` sets out for its own, and leaves where it is. Each is (robot, index of visit)."""

    first: tuple[str, int]
    then: tuple[str, int]

    def sentence(self, robots: Mapping[str, RobotPlan]) -> str:
        """Return the meeting in words, such as "quad1 sets out for b only when quad0 has entered a"."""
        return _sentence(robots, self, "sets out for", "entered")


class Hover(Value):
    """A robot hovers for some time where it visits a region, or before or after all of its visits, for the sake of bounds in seconds.

    Attributes:
        robot: Its name.
        visit: Index of the visit; -1 for its start, the number of its visits for its end.
        seconds: For how long, s.
    """

    robot: str
    visit: int
    seconds: NotNegative


def _sentence(robots: Mapping[str, RobotPlan], wait: Precedence | Meeting, due: str, done: str) -> str:
    (first, i), (then, j) = wait.first, wait.then
    lap = robots[then].cycle_visit
    repeated = "" if lap is None or j < lap else ", in each lap"
    return f"{then} {due} {_place(robots[then], j)} only when {first} has {done} {_place(robots[first], i)}{repeated}"


def _place(robot: RobotPlan, visit: int) -> str:
    """Return where a visit is made; of several visits of a region before the laps, or in a lap, also which one it is."""
    regions, lap, when = [each.region for each in robot.visits], robot.cycle_visit, ""
    if lap is not None and visit < lap:
        regions, when = regions[:lap], " before the first lap"
    elif lap is not None:
        regions, visit = regions[lap:], visit - lap
    region = regions[visit]
    if regions.count(region) == 1:
        return region + when
    number = regions[: visit + 1].count(region)
    return f"{region} for the {('first', 'second', 'third')[number - 1] if number <= 3 else f'{number}th'} time{when}"


class Plan(Value):
    """The planner's whole answer; carries its mission.

    Attributes:
        mission: What was asked.
        robots: One entry for each of the mission's agents, in the mission's order.
        precedences: Waits under which the words satisfy the formula, or that the `timed` claim needs.
        meetings: Arrivals that others wait for where they are, so that stays overlap.
        hovers: Hovers that bounds in seconds ask for: dwells, waits until something may begin, and what lasts after the last arrival.
        method: Which planner made it.
        seed: The seed it was made with.
        cost: Value of the objective (sum, or longest robot); of laps the first counts, and what leads to it.
        lower_bound: No plan of this mission has a smaller `cost`: in the same unit, also of prefix and one lap. Never above `cost`; None
            where no bound is known. It counts straight lines between regions at their nearest, and terms without a bound as 0.
        complete: Whether the search was exhausted, so that the discrete objective is optimal.
        notes: Sentences for a person: warnings, vacuous parts, how many candidates were tried.
    """

    mission: Mission
    robots: dict[str, RobotPlan]
    precedences: tuple[Precedence, ...] = ()
    meetings: tuple[Meeting, ...] = ()
    hovers: tuple[Hover, ...] = ()
    method: str = "exact"
    seed: int = 0
    cost: Number = 0.0
    lower_bound: Number | None = None
    complete: bool = False
    notes: tuple[str, ...] = ()

    @property
    def cost_text(self) -> str:
        """The cost for a person, and of what it is where laps are flown."""
        laps = any(robot.cycle_visit is not None and not robot.hovers for robot in self.robots.values())
        return f"{self.cost:.3f}{' of prefix and one lap' if laps else ''}"

    def __repr__(self) -> str:
        visits = "; ".join(
            f"{name}: {' '.join(v.region for v in robot.visits) or 'stays'}" for name, robot in self.robots.items()
        )
        return f"<Plan of '{self.mission.name}' by {self.method}, cost {self.cost_text}: {visits}>"

    def __str__(self) -> str:
        return repr(self)

    def changed(self, **fields: Any) -> Plan:  # of any type: pydantic looks at them
        """Return a plan with some fields replaced, which is sound as a whole, its mission included.

        Raises:
            BadInput: There is no such field, or the new plan is not allowed; all faults are listed.
        """
        self._require_fields(fields)
        return check_plan(self.model_copy(update=fields))

    def noting(self, *notes: str) -> Plan:
        """Return the plan with more notes, each once."""
        return self.model_copy(update={"notes": tuple(dict.fromkeys((*self.notes, *notes)))}) if notes else self

    @property
    def words(self) -> dict[str, Word]:
        """Each robot's word, in the mission's order."""
        return {name: robot.word for name, robot in self.robots.items()}

    def to_json(self) -> str:
        """Return plan.json: everything but the mission, which is written beside it and named by digest."""
        data: dict[str, Any] = {"format": PLAN_FORMAT, "mission": self.mission.digest()}
        empty = {name for name in ("meetings", "hovers") if not getattr(self, name)}
        data.update(self.model_dump(mode="json", exclude={"mission", *empty}))
        data["precedences"] = [
            {key: value for key, value in each.items() if value not in ("left", "enters")} for each in data["precedences"]
        ]
        for robot in data["robots"].values():
            word = robot["word"]
            word["prefix"] = [sorted(letter) for letter in word["prefix"]]
            word["cycle"] = None if word["cycle"] is None else [sorted(letter) for letter in word["cycle"]]
        return json.dumps(data, indent=1, allow_nan=False) + "\n"

    def digest(self) -> str:
        """Return the SHA-256 of plan.json, in hexadecimal."""
        return hashlib.sha256(self.to_json().encode()).hexdigest()


_SOUND = Remembered()


def check_plan(plan: Plan) -> Plan:
    """Return the plan, and its mission, after every check that a plan's file undergoes, for plans built or changed in code.

    Raises:
        BadInput: It is no plan, or it or its mission is not allowed; all faults are listed.
    """
    if not isinstance(plan, Plan):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
        raise BadInput(f"A plan is a Plan, not {type(plan).__name__}; `ltlplan.plan` makes one, `ltlplan.load_plan` reads one.")
    mission = check_mission(getattr(plan, "mission", None), to_plan=False)  # type: ignore[arg-type]  # a plan that skipped its validation may have none
    data = plain(plan)
    if _SOUND.knows(plan, data):
        return plan.model_copy(update={"mission": mission})
    try:
        sound = Plan.model_validate({**data, "mission": mission})
    except ValidationError as error:
        raise BadInput("\n".join(faults_of(error, "The plan"))) from None
    _check(sound, "The plan")
    _SOUND.add(sound)
    return sound


def plan_from_json(text: str, mission: Mission, source: str = PLAN_FILE) -> Plan:
    """Read plan.json again; `source` names it in messages.

    Args:
        text: The file's text.
        mission: The one that the plan was made for.
        source: Names the text in messages.

    Raises:
        BadInput: It is no plan of format 1, or was made for another mission.
    """
    data = parse_json(text, source)
    if not isinstance(data, dict) or data.get("format") != PLAN_FORMAT or isinstance(data["format"], bool | float):
        raise BadInput(f'{source} must be an object with "format": {PLAN_FORMAT}.')
    made_for = data.pop("mission", None)
    del data["format"]
    if made_for != mission.digest():
        raise BadInput(f"{source} was made for another mission than mission.yaml (their digests differ).")
    try:
        plan = Plan.model_validate({**data, "mission": mission})
    except ValidationError as error:
        first = error.errors()[0]
        raise BadInput(f"{source}, {'.'.join(map(str, first['loc']))[:200]}: {first['msg'].splitlines()[0][:200]}.") from None
    if where := _read_otherwise(data, json.loads(plan.to_json())):
        raise BadInput(
            f"{source}, {where.strip('.')}: this is not written as a plan is; numbers stand without quotes, names once."
        )
    _check(plan, source)
    return plan


def _read_otherwise(given: Any, read: Any) -> str:
    """Return where a file says something in another way than a plan that was read from it; keys with defaults may be left out."""
    if isinstance(given, dict) and isinstance(read, dict):
        return next((f".{k[:40]}{where}" for k, v in given.items() if (where := _read_otherwise(v, read.get(k)))), "")
    if isinstance(given, list) and isinstance(read, list) and len(given) == len(read):
        if all(isinstance(text, str) for text in (*given, *read)):
            given, read = sorted(given), sorted(read)  # letters are sets
        return next(
            (f".{i}{where}" for i, (a, b) in enumerate(zip(given, read, strict=True)) if (where := _read_otherwise(a, b))), ""
        )
    same = type(given) is type(read) or (type(given) is int and type(read) is float)  # 2 for 2.0, but no 2.0 for an index
    return "" if same and given == read else "."


def load_plan(path: str | Path, mission: Mission) -> Plan:
    """Read a plan file that was made for `mission`."""
    return plan_from_json(read_text(path, most=MAX_BYTES, what="plan"), mission, str(path))


def _check(plan: Plan, source: str) -> None:
    """Reject a plan whose parts do not refer to each other and to the mission."""
    agents = tuple(plan.mission.agents)
    if tuple(plan.robots) != agents:
        raise BadInput(f"{source} has robots {', '.join(plan.robots)}; the mission has {', '.join(agents)}.")
    for name, robot in plan.robots.items():
        if len(robot.times) != len(robot.waypoints):
            raise BadInput(f"{source}, {name}: {len(robot.times)} times for {len(robot.waypoints)} waypoints.")
        unknown = [visit.region for visit in robot.visits if visit.region not in plan.mission.all_regions]
        if unknown:
            raise BadInput(f"{source}, {name}: '{unknown[0]}' is not a region of the mission.")
        if robot.cycle_visit is not None and not 0 <= robot.cycle_visit <= len(robot.visits):
            raise BadInput(f"{source}, {name}: cycle_visit is {robot.cycle_visit}; it must lie from 0 to {len(robot.visits)}.")
        _check_cycle(robot, f"{source}, {name}")
    for hover in plan.hovers:
        if hover.robot not in plan.robots or not -1 <= hover.visit <= len(plan.robots[hover.robot].visits):
            raise BadInput(f"{source}: '{hover.robot}' hovers in its visit {hover.visit}, which the plan does not have.")
    for precedence in (*plan.precedences, *plan.meetings):
        for robot, visit in (precedence.first, precedence.then):
            if robot not in plan.robots or not 0 <= visit < len(plan.robots[robot].visits):
                count = len(plan.robots[robot].visits) if robot in plan.robots else 0
                raise BadInput(
                    f"{source}: a {type(precedence).__name__.lower()} names visit {visit} of {robot}, which has {count} visits, so it does not exist."
                )
    for wait in plan.precedences:
        for (robot, visit), acts in ((wait.first, wait.done == "acted"), (wait.then, wait.due == "acts")):
            if acts and not plan.robots[robot].visits[visit].actions:
                raise BadInput(f"{source}: a precedence waits for an action of {robot} in visit {visit}, which has none.")


def _check_cycle(robot: RobotPlan, where: str) -> None:
    """Reject a cycle that begins at a waypoint but at no visit; where waypoints lead is refinement's to look at."""
    if robot.cycle_waypoint is not None and robot.cycle_visit is None:
        raise BadInput(
            f"{where}: cycle_waypoint is {robot.cycle_waypoint}, and cycle_visit says that there is no cycle; give both or neither."
        )
