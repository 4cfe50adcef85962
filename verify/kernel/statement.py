"""Statements that are to be proved: `statement.json`, read strictly into the values below; the file has their fields, and no others.

Each number of the file is a float and means exactly that float. That the file says what the mission's YAML and `plan.json` say is not
the kernel's to know. SI units, radians.
"""

from __future__ import annotations

import collections.abc
import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from fractions import Fraction
from functools import lru_cache
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

from .refused import Refused

FORMAT = 1
LARGEST = 10**9
"""Numbers are no larger in size, so that a mission of absurd numbers costs no more than another one."""

Positive = Annotated[Fraction, "positive"]
NotNegative = Annotated[Fraction, "not negative"]
Vector = tuple[Fraction, Fraction, Fraction]
Matrix = tuple[Vector, Vector, Vector]
Words = tuple[frozenset[str], ...]
Way = Literal["F", "R"]
"""In which direction an opening is passed: along the hoop's normal, or against it."""


@dataclass(frozen=True, slots=True)
class Inequality:
    """The points x, around a centre, with x' quadratic x + linear . x <= bound; what is missing is zero."""

    bound: Fraction
    linear: Vector | None = None
    quadratic: Matrix | None = None


@dataclass(frozen=True, slots=True)
class Ring:
    """A hoop's ring: its normal, the opening's radius, and the rim's width along and across the normal."""

    normal: Vector
    opening: Positive
    rim: Positive


@dataclass(frozen=True, slots=True)
class Shape:
    """A closed body: a union of convex parts. `openings` of an obstacle are hoops that lead through the parts that hold their centres."""

    center: Vector
    parts: tuple[tuple[Inequality, ...], ...]
    ring: Ring | None = None
    openings: tuple[str, ...] | None = None


@dataclass(frozen=True, slots=True)
class Visit:
    """A planned visit."""

    region: str
    direction: Way | None


@dataclass(frozen=True, slots=True)
class Action:
    """A change of the internal state that is permitted at a region."""

    before: str
    after: str
    at: str


@dataclass(frozen=True, slots=True)
class Deed:
    """A change of the internal state during a visit, at an instant."""

    before: str
    after: str
    visit: int
    time: NotNegative


@dataclass(frozen=True, slots=True)
class Wait:
    """Of two visits, each a robot and a number: what the first is done with before the second may happen."""

    first: tuple[str, int]
    then: tuple[str, int]
    done: Literal["entered", "left", "acted"]
    due: Literal["enters", "leaves", "acts", "sets out"]


@dataclass(frozen=True, slots=True)
class Leg:
    """Limits on the way to a region."""

    speed: Positive | None = None
    acceleration: Positive | None = None


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of one robot; `pieces` is how many it holds at once."""

    speed: Positive
    acceleration: Positive
    thrust_min: Positive
    thrust_max: Positive
    rotor_thrust_min: NotNegative
    rotor_thrust_max: Positive
    tilt: Positive
    body_rate: Positive
    yaw_rate: Positive
    endurance: Positive | None
    pieces: int | None
    legs: Mapping[str, Leg]


@dataclass(frozen=True, slots=True)
class Robot:
    """One robot: what it is, may do and plans to do.

    `edges` says where it may go from where (None: anywhere), `vertex` where it comes from at the start, `closed` which regions it may not
    enter. Laps begin with the piece `cycle`, and make the visits from `cycle_visit` on. Parts of the flight begin with the pieces `cuts`.
    """

    radius: Positive
    mass: Positive
    arm: Positive
    inertia: Vector
    torque_to_thrust: Positive
    limits: Limits
    start: Vector
    yaw: Fraction
    end: Vector | None
    edges: Mapping[str, frozenset[str]] | None
    vertex: str
    closed: frozenset[str]
    initial: str
    states: Mapping[str, frozenset[str]]
    actions: tuple[Action, ...]
    visits: tuple[Visit, ...]
    cycle_visit: int | None
    changes: tuple[Deed, ...]
    cycle: int | None
    cuts: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Statement:
    """Everything that is to be proved of a flight.

    `digests` link it to a certificate; nothing here depends on them. `lasso`: laps for ever, of which the files hold `repeat`. `joint`:
    letters of all robots are joined, else each robot is read by itself. `sequence`: passages to be flown exactly, before the laps and in
    each. `words`: planned words, where they are to satisfy the formula in every order that keeps the `waits`; else none.
    """

    format: int
    name: str
    digests: Mapping[str, str]
    lasso: bool
    repeat: int
    joint: bool
    formula: Any  # nested lists, which `formulas` reads
    sequence: tuple[tuple[tuple[str, Way], ...], tuple[tuple[str, Way], ...] | None] | None
    margin: NotNegative
    clock_error: NotNegative
    separation: NotNegative
    separation_z: Positive | None
    low: Vector  # the workspace's corners
    high: Vector
    regions: Mapping[str, Shape]
    obstacles: Mapping[str, Shape]
    order: tuple[str, ...]
    robots: Mapping[str, Robot]
    waits: tuple[Wait, ...]
    words: Mapping[str, Words]


def read_json(text: str, what: str) -> Any:
    """Return JSON whose numbers are whole, or fractions that equal a float; no key stands twice.

    Raises:
        Refused: It is none.
    """

    def table(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len(dict(pairs)) != len(pairs):
            raise ValueError("a key stands twice")
        return dict(pairs)

    def exact(number: str) -> Fraction:
        if len(number) > 60 or not math.isfinite(value := float(number)):
            raise ValueError(f"{number[:40]} is no number")
        return Fraction(value)

    try:
        return json.loads(text, object_pairs_hook=table, parse_float=exact, parse_constant=exact)
    except (ValueError, RecursionError) as error:
        raise Refused(f"{what} cannot be read: {str(error)[:200]}.") from None


@lru_cache(maxsize=64)
def _hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind, include_extras=True)


def _read(kind: Any, value: Any, where: str) -> Any:
    """Return a value of some type; how deep this goes is given by the type."""
    origin, args = get_origin(kind), get_args(kind)
    if kind is Any:
        return value
    if type(None) in args:
        return None if value is None else _read(args[0], value, where)
    if origin is Annotated:
        found = _read(args[0], value, where)
        if found < 0 or (found == 0 and args[1] == "positive"):
            raise Refused(f"{where} is not allowed to be {float(found):g}.")
        return found
    if kind in (int, Fraction):
        known = type(value) is int or (kind is Fraction and isinstance(value, Fraction))
        if not known or abs(value) > LARGEST or (kind is int and value < 0):
            raise Refused(f"{where} is no number that is allowed there.")
        return kind(value)
    if kind in (str, bool) and type(value) is kind and len(str(value)) < 1000:
        return value
    if origin is Literal and value in args:
        return value
    if origin in (tuple, frozenset) and isinstance(value, list):
        kinds: list[Any] = [args[0]] * len(value) if args[1:] in ((), (...,)) else list(args)
        if len(kinds) == len(value):
            return origin(_read(one, entry, where) for one, entry in zip(kinds, value, strict=True))
    if origin is collections.abc.Mapping and isinstance(value, dict) and all(len(key) < 1000 for key in value):
        return {key: _read(args[1], entry, f"{where}, {key[:60]}") for key, entry in value.items()}
    if is_dataclass(kind) and isinstance(value, dict):
        hints = _hints(kind)
        for key in {one.name for one in fields(kind)} ^ set(value):
            if key not in hints or type(None) not in get_args(hints[key]):
                raise Refused(f"{where} has no {key[:60]}, or should have none.")
        return kind(**{key: _read(hint, value.get(key), f"{where}, {key}") for key, hint in hints.items()})
    raise Refused(f"{where} is not what it should be.")


def read_statement(text: str) -> Statement:
    """Read a statement.

    Raises:
        Refused: It is none, or what it says does not fit together.
    """
    found: Statement = _read(Statement, read_json(text, "statement.json"), "statement.json")
    hoops = {name for name, shape in found.regions.items() if shape.ring}
    shapes = [*found.regions.values(), *found.obstacles.values()]
    matrices = [one.quadratic for shape in shapes for part in shape.parts for one in part if one.quadratic]
    order, named = found.order, re.compile(r"[A-Za-z0-9][A-Za-z0-9_. -]{0,99}\Z")
    fits = {
        "another format": found.format == FORMAT,
        "no laps": found.repeat > 0,
        "other robots than named": sorted(order) == sorted(found.robots) and bool(order) and all(map(named.match, order)),
        "a shape without parts": all(shape.parts and all(shape.parts) for shape in shapes),
        "a form that is not symmetric": all(m == tuple(zip(*m, strict=True)) for m in matrices),
        "a hoop without a normal": all(any(s.ring.normal) for s in found.regions.values() if s.ring),
        "an opening of no hoop": all(set(s.openings or ()) <= hoops for s in found.obstacles.values()),
        "words of other robots": set(found.words) in (set(), set(found.robots)),
        "a wait for no visit": all(
            name in found.robots and visit < len(found.robots[name].visits)
            for w in found.waits
            for name, visit in (w.first, w.then)
        ),
    }
    for name, robot in found.robots.items():
        states = {robot.initial, *(one.after for one in (*robot.actions, *robot.changes))}
        fits |= {
            f"laps of {name} where there are none, or none": {robot.cycle is not None, robot.cycle_visit is not None}
            == {found.lasso},
            f"a visit of {name} that cannot be": all(
                visit.region in (hoops if visit.direction else found.regions) for visit in robot.visits
            ),
            f"an action of {name} at no visit": all(one.visit < len(robot.visits) for one in robot.changes),
            f"a state that {name} does not have": states <= set(robot.states),
        }
    for fault, is_well in fits.items():
        if not is_well:
            raise Refused(f"statement.json has {fault}.")
    return replace(found, robots={name: found.robots[name] for name in order})
