"""Rules that span several keys of a mission: names, starts, edges, limits. Each rule yields (keys, sentence) pairs.

The rules take whichever sections are sound, so that a mistake in one section does not hide those in the others.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from verify.data.errors import did_you_mean
from verify.data.language.counting import first_count
from verify.data.language.formula import FREE, NAME, RESERVED_NAMES
from verify.data.language.formula_error import FormulaError
from verify.data.language.formula_reader import parse_formula
from verify.data.language.sequence import SequenceError, parse_sequence
from verify.data.names.choices import COST_TERMS, PLANNING_METHODS
from verify.data.sections import Agent, Box, Environment, Planner, Robot, Spec
from verify.data.shapes.region import Hoop
from verify.data.storage.file_names import robot_name_fault
from verify.data.validation.agents import broken_by_agents, unknown_region
from verify.data.validation.faults import Finding, KeyPath
from verify.data.validation.kinds import broken_by_kinds, flown, limit_faults
from verify.data.validation.obstacles import broken_by_obstacles

COARSEST = 1e-4
"""m; the coarsest step of float32 positions in a workspace."""


def broken_rules(
    values: Mapping[str, Any],  # of any type: each section has its own
    data: Mapping[str, Any],  # of any type: what a mission file may hold
    *,
    to_plan: bool = True,
    installed: bool = True,
) -> Iterator[Finding]:
    """Yield what is wrong with a mission.

    Args:
        values: The sections that are sound by themselves, by key, as the schema's types.
        data: The whole mission as plain data, for the names of entries that are not sound.
        to_plan: Whether it is to be planned: then it asks for something, and starts, ends and hoops leave room. A flight
            that is there already can be judged without that.
        installed: Whether the planning method and the cost terms that it names must be there.
    """
    region_names = [name for table in ("hoops", "regions") for name in _keys(data.get(table))]
    systems: dict[str | None, Robot] = dict(values.get("robots") or {})
    if (robot := values.get("robot") or (Robot() if "robot" not in data else None)) is not None:
        systems[None] = robot
    yield from _names(data, region_names, systems)
    for kind, system in systems.items():
        yield from _robot(system, region_names, ("robot",) if kind is None else ("robots", kind))
    yield from broken_by_kinds(values, data)
    if systems.keys() == {None, *_keys(data.get("robots"))}:
        internal = {p for system in systems.values() for names in system.states.values() for p in names}
        yield from _formula(values, data, {*region_names, *internal, FREE}, needed=to_plan)
    yield from _sequence(values, data)
    if (environment := values.get("environment")) is not None:
        yield from _environment(environment, region_names)
    yield from _limits(values, region_names)
    if to_plan:
        yield from _workspace(values.get("workspace"))
        yield from _control_points(values)
    if "agents" in data and not _keys(data["agents"]):
        yield ("agents",), "a mission needs at least one agent, such as `quad0: {start: [0, 0, 1]}`."
    yield from broken_by_agents(values, systems, region_names, to_plan=to_plan)
    yield from broken_by_obstacles(values, _keys(data.get("hoops")), to_plan=to_plan)
    yield from _planner(values.get("planner"), values.get("agents", {}))
    if installed:
        yield from _choices(values.get("planner"), values.get("agents", {}))


def _names(data: Mapping[str, Any], regions: list[str], systems: Mapping[str | None, Robot]) -> Iterator[Finding]:
    for table in ("hoops", "regions", "obstacles", "agents", "robots"):
        for name in _keys(data.get(table)):
            if not NAME.fullmatch(name):
                yield (table, name), f"'{name}' is no name: use a letter or _, then letters, digits and _."
            elif table not in ("agents", "robots") and name in RESERVED_NAMES:
                what = "an obstacle" if table == "obstacles" else "a region"
                yield (table, name), f"'{name}' is an operator of the formula language and cannot name {what}."
            elif table not in ("agents", "robots") and name == FREE:
                yield (table, name), "'free' is built in and means in no region; choose another name."
    robots = _keys(data.get("agents"))
    for index, name in enumerate(robots):
        if NAME.fullmatch(name) and (fault := robot_name_fault(name, robots[:index])) is not None:
            yield ("agents", name), fault
    for name in regions:
        if regions.count(name) > 1 and name in _keys(data.get("regions")):
            yield ("regions", name), f"'{name}' names both a hoop and a region."
            break
    internal = {name for system in systems.values() for names in system.states.values() for name in names}
    for name in _keys(data.get("obstacles")):
        other = "a hoop" if name in _keys(data.get("hoops")) else "a region" if name in regions else "an internal proposition"
        if name in regions or name in internal:
            yield ("obstacles", name), f"'{name}' names both an obstacle and {other}; an obstacle needs a name of its own."
    for kind, system in systems.items():
        where = ("robot", "states") if kind is None else ("robots", kind, "states")
        for name in sorted({name for names in system.states.values() for name in names}):
            if not NAME.fullmatch(name) or name in RESERVED_NAMES or name == FREE:
                yield where, f"'{name}' cannot name a proposition."
            elif name in regions:
                yield where, f"'{name}' is both a region and an internal proposition; names must differ."


def _robot(robot: Robot, regions: list[str], table: KeyPath) -> Iterator[Finding]:
    def state(name: str, keys: tuple[str | int, ...]) -> Iterator[Finding]:
        if name not in robot.states:
            known = ", ".join(robot.states)
            yield keys, f"'{name}' is not a state of the robot.{did_you_mean(name, robot.states)} States: {known}."

    yield from state(robot.initial, (*table, "initial"))
    for index, action in enumerate(robot.actions):
        yield from state(action.source, (*table, "actions", index, "from"))
        yield from state(action.target, (*table, "actions", index, "to"))
        if action.at not in regions:
            yield (*table, "actions", index, "at"), unknown_region(action.at, regions)


_OWN = (
    "speaks of what several robots show at one time, and under `team: own` each letter is one robot's by itself, in any order. Write "
    "`team: joint`, where time is common; there a plain name is true where some robot shows it."
)


def _unmeasured(spec: Spec, robots: int, *, soft: bool) -> str:
    """Return why bounds in seconds have no meaning in a mission; empty where they have."""
    if spec.team == "own" and robots > 1:
        return (
            "and under `team: own` the robots' letters are read in any order, which measures no time. Write `team: joint`, where time is common; "
            "`each(...)` asks something of every robot there."
        )
    return "which is not supported in a soft specification. Ask it in `spec.formula`, or leave the bounds out." if soft else ""


def _formula(values: Mapping[str, Any], data: Mapping[str, Any], names: set[str], *, needed: bool) -> Iterator[Finding]:
    spec: Spec | None = values.get("spec")
    if spec is None:
        if needed and "spec" not in data and "sequence" not in data:
            yield ("spec",), "missing: a mission needs spec.formula, a sequence, or both."
        return
    if needed and spec.formula is None and "sequence" not in data:
        yield ("spec", "formula"), "missing: a mission needs spec.formula, a sequence, or both."
    asked: list[tuple[KeyPath, str | None]] = [(("spec", "formula"), spec.formula)]
    asked += [(("spec", "soft", index, "formula"), part.formula) for index, part in enumerate(spec.soft or ())]
    for keys, formula in asked:
        if formula is None:
            continue
        try:
            written = parse_formula(formula, names, robots=_keys(data.get("agents")), allow_next=False)
            if spec.team == "own" and (count := first_count(written)) is not None:
                raise FormulaError(formula, [(count.position, f"`{count}` {_OWN}")])
            if (bounded := next((node for node in written.walk() if node.window not in (None, (0, None))), None)) is not None:
                robots = len(_keys(data.get("agents")))
                if said := _unmeasured(spec, robots, soft=keys[1] == "soft"):
                    raise FormulaError(formula, [(bounded.position, f"`{bounded}` is bounded in seconds, {said}")])
        except FormulaError as error:
            yield keys, str(error)
    if spec.trace == "finite" and spec.repeat != 1:
        yield ("spec", "repeat"), "a finite trace has no cycle to repeat; use `trace: infinite` or leave repeat out."


def _sequence(values: Mapping[str, Any], data: Mapping[str, Any]) -> Iterator[Finding]:
    text = values.get("sequence")
    if text is None:
        return
    try:
        sequence = parse_sequence(text, _keys(data.get("hoops")))
    except SequenceError as error:
        yield ("sequence",), str(error)
        return
    spec: Spec = values.get("spec") or Spec.model_construct(trace="finite")
    if sequence.cycle is not None and spec.trace == "finite":
        yield ("sequence",), "a cycle `(...)*` repeats for ever; set `spec.trace: infinite`."
    if sequence.cycle is None and spec.trace == "infinite":
        yield ("sequence",), "an infinite trace needs a cycle `(...)*` at the end of the sequence."
    if len(_keys(data.get("agents"))) > 1:
        yield ("sequence",), "a sequence is flown by one robot; this mission has several agents."


def _environment(environment: Environment, regions: list[str]) -> Iterator[Finding]:
    if environment.start in regions:
        yield ("environment", "start"), f"'{environment.start}' is a region; the start vertex needs a name of its own."
    for index, edge in enumerate(environment.pairs):
        for name in edge:
            if name != environment.start and name not in regions:
                yield ("environment", "edges", index), unknown_region(name, [*regions, environment.start])
        if edge[0] == edge[1]:
            yield ("environment", "edges", index), "an edge joins two different regions; staying is always allowed."
        if environment.directed and edge[1] == environment.start:
            yield ("environment", "edges", index), f"the start vertex '{environment.start}' is left, never entered."


def _workspace(workspace: Box | None) -> Iterator[Finding]:
    """Vehicles hold positions as float32, whose steps grow with the distance from the origin."""
    if workspace is None:
        return
    far = max((abs(x), key, x) for key, corner in (("min", workspace.min), ("max", workspace.max)) for x in corner)
    step = math.ldexp(1.0, math.frexp(far[0])[1] - 24)  # between float32 numbers there
    if step > COARSEST:
        yield (
            ("workspace", far[1]),
            f"{far[2]:g} m is so far from the origin that a vehicle's float32 holds positions there in steps of "
            f"{1000 * step:.3g} mm; at most {1000 * COARSEST:g} mm is accepted. Use local coordinates, with the origin in or "
            "near the workspace (up to 1000 m away).",
        )


def _limits(values: Mapping[str, Any], regions: list[str]) -> Iterator[Finding]:
    agents: Mapping[str, Agent] = values.get("agents", {})
    given = [(("limits",), values.get("limits"))]
    given += [(("agents", name, "limits"), agent.limits) for name, agent in agents.items()]
    for keys, limits in given:
        for name in () if limits is None else limits.legs:
            if name not in regions:
                yield (*keys, "legs", name), unknown_region(name, regions)
    yield from limit_faults(values)


def _control_points(values: Mapping[str, Any]) -> Iterator[Finding]:
    workspace, agents = values.get("workspace"), values.get("agents", {})
    vehicles = flown(values)
    margin = values.get("margin", 0.05)
    for name, hoop in values.get("hoops", {}).items():
        vehicle = min(
            (v for name, v in vehicles.items() if _open(hoop, agents.get(name))), key=lambda v: v.radius, default=None
        )
        if vehicle is not None and hoop.opening <= vehicle.radius:
            yield (
                ("hoops", name, "opening"),
                f"{hoop.opening:g} m is no wider than the vehicle's radius {vehicle.radius:g} m ({vehicle.name}).",
            )
        elif vehicle is not None and hoop.opening <= vehicle.radius + margin:
            yield (
                ("hoops", name, "opening"),
                f"{hoop.opening:g} m leaves no room: vehicle radius {vehicle.radius:g} m plus margin {margin:g} m.",
            )
        if workspace is None:
            continue
        centre, normal = np.array(hoop.center), np.array(hoop.normal)
        for role, point in (
            ("centre", centre),
            ("front", centre + hoop.reach * normal),
            ("rear", centre - hoop.reach * normal),
        ):
            if not workspace.holds(tuple(point)):
                at = ", ".join(f"{x:.3g}" for x in np.round(point, 9) + 0.0)
                box = f"{list(workspace.min)} to {list(workspace.max)}"
                mend = "move the hoop" if role == "centre" else "move the hoop or set a shorter `reach`"
                yield ("hoops", name), f"its {role} control point ({at}) lies outside the workspace {box}; {mend}."
                if role == "centre":
                    break
    for name, region in values.get("regions", {}).items():
        if workspace is not None and not workspace.holds(region.center):
            at, low, high = (", ".join(f"{x:g}" for x in p) for p in (region.center, workspace.min, workspace.max))
            yield ("regions", name, "center"), f"({at}) lies outside the workspace [{low}] to [{high}]."


def _open(hoop: Hoop, agent: Agent | None) -> bool:
    """Return whether a hoop is open to an agent; to a mission without agents all are."""
    return agent is None or hoop.only is None or agent.robot in hoop.only


def _planner(planner: Planner | None, agents: Mapping[str, Agent]) -> Iterator[Finding]:
    for name, agent in agents.items():
        if agent.cost is not None and not any(agent.cost.values()):
            yield ("agents", name, "cost"), "at least one weight must be above zero."
    if planner is None:
        return
    if not any(planner.cost.values()):
        yield ("planner", "cost"), "at least one weight must be above zero."
    if planner.method == "online-mtac-e" and planner.samples <= 1 / planner.elite:
        yield (
            ("planner", "samples"),
            f"{planner.samples} samples are too few: more than 1 / elite = {1 / planner.elite:g} are needed.",
        )
    elif planner.method != "online-mtac-e" and not 0.1 <= planner.elite < 0.3:
        yield ("planner", "elite"), f"{planner.elite:g} is out of range: offline, 0.1 <= elite < 0.3."
    elif planner.method != "online-mtac-e" and math.ceil(planner.samples * planner.elite) < 2:
        yield (
            ("planner", "samples"),
            f"{planner.samples} samples at elite {planner.elite:g} leave fewer than 2 elites; use more samples.",
        )


def _choices(planner: Planner | None, agents: Mapping[str, Agent]) -> Iterator[Finding]:
    """Names of planning methods and cost terms that nobody brings."""
    if planner is not None and not PLANNING_METHODS.knows(planner.method):
        yield ("planner", "method"), PLANNING_METHODS.unknown(planner.method)
    weighed = [(("planner", "cost"), {} if planner is None else planner.cost)]
    weighed += [(("agents", name, "cost"), agent.cost or {}) for name, agent in agents.items()]
    for keys, costs in weighed:
        for term in costs:
            if not COST_TERMS.knows(term):
                yield (*keys, term), COST_TERMS.unknown(term)


def _keys(table: object) -> tuple[str, ...]:
    return tuple(str(key) for key in table) if isinstance(table, dict) else ()
