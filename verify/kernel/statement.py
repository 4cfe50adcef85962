"""Statements that are to be proved: `statement.json`, read strictly into the values below; the file has their fields, and no others. Each number is a
float and means exactly that, in SI units and radians. That the file says what mission and plan say is not the kernel's to know.
"""

import collections.abc
import json
import math
import re
from collections.abc import Mapping
from fractions import Fraction
from functools import cache
from typing import Annotated, Any, Literal, NamedTuple, get_args, get_origin, get_type_hints

FORMAT = 4
LARGEST = 10**9
"""Numbers are no larger in size, so that a mission of absurd numbers costs no more than another one; whole ones are below 2^64."""
ZERO = Fraction(0)
_hints = cache(get_type_hints)  # a type's fields and their types; to find them takes long
MOST = {  # of something the kernel looks at, so that its work is bounded
    "parts of a formula": 20_000, "parts of a formula in one another": 400, "alternatives of what is left of a formula": 500,
    "regions open at one time": 6, "states of a transition system": 100_000, "ways to go on at one instant": 20_000,
    "letters of a team at one place": 64, "halvings of an interval": 64, "sums of half-spaces": 64, "choices of faces": 300, "spans of time within bounds": 200_000,
}  # fmt: skip


class Refused(Exception):
    """A file cannot be read, or what a proof says was not so; the message says which."""


def require(holds: object, fault: str) -> None:
    """Go on only if something holds.

    Raises:
        Refused: It does not.
    """
    if not holds:
        raise Refused(fault)


def few(count: int, what: str) -> None:
    """Refuse more of something than the kernel looks at."""
    require(count <= MOST[what], f"not covered by the kernel: more than {MOST[what]} {what}")


Positive = Annotated[Fraction, "positive"]
NotNegative = Annotated[Fraction, "not negative"]
Vector = tuple[Fraction, Fraction, Fraction]
Limit = Literal[
    "speed", "acceleration", "thrust_max", "thrust_min", "tilt", "body_rate", "yaw_rate", "rotor_thrust_max", "rotor_thrust_min"
]
Way = Literal["F", "R"]  # in which direction an opening is passed: along the hoop's normal, or against it


class Inequality(NamedTuple):
    """The points x, around a centre, with x' quadratic x + linear . x <= bound; what is missing is zero."""

    bound: Fraction
    linear: Vector | None = None
    quadratic: tuple[Vector, Vector, Vector] | None = None


class Ring(NamedTuple):
    """A hoop's ring: its normal, the opening's radius, and the rim's width along and across the normal."""

    normal: Vector
    opening: Positive
    rim: Positive


class Shape(NamedTuple):
    """A closed body: a union of convex parts. `openings` of an obstacle are hoops that lead through the parts that hold their centres."""

    center: Vector
    parts: tuple[tuple[Inequality, ...], ...]
    ring: Ring | None = None
    openings: tuple[str, ...] | None = None


class Visit(NamedTuple):
    """A planned visit."""

    region: str
    direction: Way | None


class Action(NamedTuple):
    """A change of the internal state that is permitted at a region."""

    before: str
    after: str
    at: str


class Deed(NamedTuple):
    """A change of the internal state during a visit, at an instant."""

    before: str
    after: str
    visit: int
    time: NotNegative


class Wait(NamedTuple):
    """Of two visits, each a robot and a number: what the first is done with before the second may happen."""

    first: tuple[str, int]
    then: tuple[str, int]
    done: Literal["entered", "left", "acted"]
    due: Literal["enters", "leaves", "acts", "sets out"]


class Robot(NamedTuple):
    """One robot: what it is, may do and plans to do.

    `legs` has limits of speed and acceleration on the way to regions, `pieces` is how many it holds at once. `edges` says where it may go from where
    (None: anywhere), `vertex` where it comes from at the start, `closed` which regions it may not enter. Laps begin with the piece `cycle`, and make
    the visits from `cycle_visit` on. Parts of the flight begin with the pieces `cuts`.
    """

    radius: Positive
    mass: Positive
    arm: Positive
    inertia: Vector
    torque_to_thrust: Positive
    limits: Mapping[Limit, NotNegative]
    legs: Mapping[str, Mapping[Limit, Positive]]
    endurance: Positive | None
    pieces: int | None
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


class Statement(NamedTuple):
    """Everything that is to be proved of a flight.

    `digests` link it to a certificate; nothing here depends on them. `lasso`: laps for ever, of which the files hold `repeat`. `joint`: letters of
    all robots are joined, else each robot is read by itself. `sequence`: passages to be flown exactly, before the laps and in each. `low` and `high`
    are the workspace's corners. `words`: planned words, where they are to satisfy the formula in every order that keeps the `waits`; else none.
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
    low: Vector
    high: Vector
    regions: Mapping[str, Shape]
    obstacles: Mapping[str, Shape]
    robots: Mapping[str, Robot]
    waits: tuple[Wait, ...]
    words: Mapping[str, tuple[frozenset[str], ...]]
    timed: tuple[Any, ...] | None  # formulas that are bounded in seconds; `formula` is what words can say of them, and the rest


def read_json(text: str, what: str) -> Any:
    """Return JSON whose numbers are whole, or fractions that equal a float; no key stands twice."""

    def table(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        require(len(dict(pairs)) == len(pairs), f"{what} has a key twice.")
        return dict(pairs)

    def exact(number: str) -> Fraction:
        require(len(number) <= 60 and math.isfinite(float(number)), f"{what} has {number[:40]}, which is no number.")
        return Fraction(float(number))

    try:
        return json.loads(text, object_pairs_hook=table, parse_float=exact, parse_constant=exact)
    except (ValueError, RecursionError) as error:
        return require(False, f"{what} cannot be read: {str(error)[:200]}.")


def read(kind: Any, value: Any, where: str) -> Any:
    """Return a value of JSON as one of some type, or refuse it; how deep this goes is given by the type.

    Args:
        kind: The type.
        value: The value.
        where: Where it stands.
    """
    if kind is Fraction and (type(value) is int or isinstance(value, Fraction)) and abs(value) <= LARGEST:
        return Fraction(value)
    origin, args = get_origin(kind), get_args(kind)
    if type(None) in args:
        return None if value is None else read(args[0], value, where)
    if origin is Annotated:
        found = read(args[0], value, where)
        require(found > 0 or (found == 0 and args[1] != "positive"), f"{where} is not allowed to be {float(found):g}.")
        return found
    plain = kind == Any or (kind in (str, bool) and type(value) is kind and len(str(value)) < 1000)
    if plain or (origin is Literal and value in args) or (kind is int and type(value) is int and 0 <= value < 1 << 64):
        return value
    if origin in (tuple, frozenset) and isinstance(value, list):
        kinds: list[Any] = [args[0]] * len(value) if args[1:] in ((), (...,)) else list(args)
        if len(kinds) == len(value):
            return origin(read(one, entry, where) for one, entry in zip(kinds, value, strict=True))
    if origin is collections.abc.Mapping and isinstance(value, dict):
        return {read(args[0], key, where): read(args[1], entry, f"{where}, {key[:60]}") for key, entry in value.items()}
    if hasattr(kind, "_fields") and isinstance(value, dict):
        hints = _hints(kind, include_extras=True)
        for key in {*hints} ^ {*value}:
            optional = key in hints and type(None) in get_args(hints[key])
            require(optional, f"{where} has no {key[:60]}, or should have none.")
        return kind(**{key: read(hint, value.get(key), f"{where}, {key}") for key, hint in hints.items()})
    return require(False, f"{where} is not what it should be.")


def at_least(value: Fraction) -> str:
    """Return a number that is not above a value, with four digits behind the point."""
    return f"{math.floor(value * 10**4) / 10**4:.4f}"


def read_statement(text: str) -> Statement:
    """Read a statement; what it says has to fit together."""
    data = read_json(text, "statement.json")
    require(isinstance(data, dict) and data.get("format") == FORMAT, f"statement.json is no statement of format {FORMAT}.")
    found: Statement = read(Statement, data, "statement.json")
    regions, robots = found.regions, found.robots
    hoops = {name: shape.ring for name, shape in regions.items() if shape.ring}
    shapes, named = [*regions.values(), *found.obstacles.values()], re.compile(r"[A-Za-z0-9][A-Za-z0-9_. -]{0,99}\Z")
    matrices = [one.quadratic for shape in shapes for part in shape.parts for one in part if one.quadratic]
    events = [event for wait in found.waits for event in (wait.first, wait.then)]
    fits = {
        "no laps": found.repeat > 0,
        "no robots, or odd names": bool(robots) and all(map(named.match, robots)),
        "a shape without parts": all(shape.parts and all(shape.parts) for shape in shapes),
        "a form that is not symmetric": all(m == tuple(zip(*m, strict=True)) for m in matrices),
        "a hoop without a normal": all(any(ring.normal) for ring in hoops.values()),
        "an opening of no hoop": all(set(shape.openings or ()) <= hoops.keys() for shape in shapes),
        "words of other robots": set(found.words) in (set(), set(robots)),
        "a wait for no visit": all(name in robots and visit < len(robots[name].visits) for name, visit in events),
    }
    for name, robot in robots.items():
        states, visits = {robot.initial, *(one.after for one in (*robot.actions, *robot.changes))}, robot.visits
        fits |= {
            f"laps of {name} where there are none, or none": {robot.cycle is None, robot.cycle_visit is None}
            == {not found.lasso},
            f"an end of {name}, whose laps never end": robot.end is None or not found.lasso,
            f"a visit of {name} that cannot be": all(v.region in (hoops if v.direction else regions) for v in visits),
            f"an action of {name} at no visit": all(one.visit < len(visits) for one in robot.changes),
            f"a state that {name} does not have": states <= set(robot.states),
            f"no least thrust of {name}, or no other limit": set(robot.limits) == {*get_args(Limit)}
            and robot.limits["thrust_min"] > 0,
            f"other limits of {name} on ways": all({*leg} <= {"speed", "acceleration"} for leg in robot.legs.values()),
        }
    for fault, is_well in fits.items():
        require(is_well, f"statement.json has {fault}.")
    return found
