"""Missions that have no plan or no flight, with the names that the refusal has to say, and what no refusal may name."""

from __future__ import annotations

import re
from dataclasses import dataclass

from verify.data import Mission

_WORDS = {"hoop": "hoops", "ring": "hoops", "rim": "hoops", "passage": "hoops", "opening": "hoops", "obstacle": "obstacles"}
"""Words that are said only of missions that have such things."""
_KEYS = {"margin", "separation", "only", "joint", "own"}


@dataclass(frozen=True)
class Refused:
    """A mission and what the sentence of its refusal has.

    Attributes:
        formula: What is asked.
        agents: By name, as they are written in a mission.
        regions: As above.
        obstacles: As above.
        says: Pieces of the sentence.
        team: How words are read.
        trace: Whether robots fly for ever.
        more: Other keys of the mission.
        never: Pieces that the sentence has not.
    """

    formula: str
    agents: str
    says: tuple[str, ...]
    regions: str = ""
    obstacles: str = ""
    team: str = "joint"
    trace: str = "finite"
    more: str = ""
    never: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The mission file."""
        return f"""format: 1
name: refused
spec: {{formula: "{self.formula}", team: {self.team}, trace: {self.trace}}}
regions: {{{self.regions}}}
obstacles: {{{self.obstacles}}}
agents: {{{self.agents}}}
vehicle: crazyflie-2.1
planner: {{pace: nominal}}
workspace: {{min: [-2, -1, 0.9], max: [2, 1, 1.1]}}
{self.more}
"""


def _box(x: float, y: float, wide: float, long: float, high: float = 4.0) -> str:
    return f"{{center: [{x}, {y}, 1], size: [{wide}, {long}, {high}]}}"


def _at(x: float, y: float, end: tuple[float, float] | None = None) -> str:
    return f"{{start: [{x}, {y}, 1]" + (f", end: [{end[0]}, {end[1]}, 1]}}" if end else "}")


def _between(name: str, x: float, y: float, wide: float, long: float) -> str:
    """Return a region between walls."""
    return f"{name}: {_box(x, y, wide, long, 0.2)}"


def _walls(x: float, length: float, gap: float) -> str:
    """Return two walls along x with a corridor between them."""
    deep = 1.2 - gap / 2
    return f"north: {_box(x, gap / 2 + deep / 2, length, deep)}, south: {_box(x, -gap / 2 - deep / 2, length, deep)}"


def _union(x: float, other: float, y: float, long: float = 1.8, wide: float = 0.6) -> str:
    """Return a room of two boxes, one to the south of the other one."""
    boxes = f"{_box(x, -y, long, wide, 0.4)}, {_box(other, y, long, wide, 0.4)}"
    return f"room: {{union: [{boxes}]}}"


def _linked(wide: float) -> str:
    """Return a room of two halls and a link between them."""
    return f"room: {{union: [{_box(-1.2, 0, 1.4, 1.6, 0.2)}, {_box(0, 0, 1.2, wide, 0.2)}, {_box(1.2, 0, 1.4, 1.6, 0.2)}]}}"


_TUBE, _CORRIDOR, _DEAD_END = _walls(0.0, 4.4, 0.5), _walls(0.0, 2.0, 0.5), _walls(0.6, 2.8, 0.5)
_LEFT, _RIGHT = _between("left", -1.6, 0, 0.5, 0.5), _between("right", 1.6, 0, 0.5, 0.5)
_DEEP, _SPOT = _between("deep", 1.6, 0, 0.4, 0.3), _between("spot", 1.0, 0, 0.3, 0.3)
_NARROW = ("'north'", "'south'", "0.5 m wide", "from 0.628 m on", "second", "`separation`")
_IN_ROOM = ("0.3 m wide", "two sides of 'room'", "from 0.488 m on", "second way", "cross the border of 'room'", "`margin`")
_BLOCK = f"block: {_box(0, 0, 0.3, 0.5)}"
_THREE = f"a: {_at(-1.5, 0.5)}, b: {_at(-1.5, -0.5)}, c: {_at(-1.0, 0)}"
_TWO = f"a: {_at(-1.5, 0.5)}, b: {_at(-1.5, -0.5)}"
_ONE = f"a: {_at(-1.5, 0)}"
_STRIP = f"{_RIGHT}, strip: {_box(0, 0, 0.4, 2.4)}"

CASES = {
    "two robots swap places in a tube": Refused(
        "F a.right & F b.left", f"a: {_at(-1.2, 0)}, b: {_at(1.2, 0)}", ("keep b and a apart", *_NARROW, "Tried:"), f"{_LEFT}, {_RIGHT}", _TUBE
    ),
    "two robots swap ends in a tube": Refused(
        "true", f"a: {_at(-1.2, 0, (1.2, 0))}, b: {_at(1.2, 0, (-1.2, 0))}", (*_NARROW, "ends or last regions elsewhere for", "Tried:"), "", _TUBE
    ),
    "two robots swap places in a dead end": Refused(
        "true", f"a: {_at(0.2, 0, (1.6, 0))}, b: {_at(1.6, 0, (0.2, 0))}", (*_NARROW, "elsewhere"), "", _DEAD_END
    ),
    "the one in front has no place to come out to": Refused(
        "F a.deep & F b.deep", f"a: {_at(0.2, 0)}, b: {_at(-1.5, 0)}", (*_NARROW, "elsewhere"), _DEEP, _TUBE
    ),
    "two robots swap places in a room": Refused(
        "G all(room) & F a.right & F b.left", f"a: {_at(-1.2, 0)}, b: {_at(1.2, 0)}", (*_IN_ROOM, "elsewhere for b"), f"{_LEFT}, {_RIGHT}, {_union(-1.0, 1.0, 0.0, 2.2, 0.3)}",
        never=("second door",),
    ),
    "two robots swap ends in a room": Refused(
        "G room", f"a: {_at(-1.2, 0, (1.2, 0))}, b: {_at(1.2, 0, (-1.2, 0))}", (*_IN_ROOM, "elsewhere for"), _between("room", 0, 0, 3.6, 0.3), team="own",
    ),
    "two robots swap places between forbidden regions": Refused(
        "F a.right & F b.left & G !some(one) & G !some(other)", f"a: {_at(-1.2, 0)}, b: {_at(1.2, 0)}",
        ("between 'other' and 'one'", "0.488 m", "cross the border of 'one' or 'other'"),
        f"{_between('left', -1.6, 0, 0.4, 0.25)}, {_between('right', 1.6, 0, 0.4, 0.25)}, one: {_box(0, 0.65, 4.4, 0.95, 0.4)}, other: {_box(0, -0.65, 4.4, 0.95, 0.4)}",
        never=("door",),
    ),
    "a robot is to stay in a corridor": Refused(
        "F a.right", f"{_ONE}, b: {_at(0, 0, (0, 0))}", (*_NARROW, "elsewhere for b, as it hovers there"), _RIGHT, _CORRIDOR
    ),
    "a robot may not leave a region in a corridor": Refused(
        "F a.right & G b.mid", f"a: {_at(-1.2, 0)}, b: {_at(0, 0)}", (*_NARROW, "a formula that lets b leave 'mid'"), f"{_RIGHT}, {_between('mid', 0, 0, 0.4, 0.4)}", _walls(0, 1.0, 0.5),
        never=("last region", "hovers there"),
    ),
    "two regions are too near each other for two robots": Refused(
        "F(a.p & b.q)", _TWO, ("Robots in 'p' and 'q' at once are 0.39 m apart at the most", "'p' and 'q' further apart, or larger", "`margin`"),
        f"{_between('p', 1.0, 0.1, 0.3, 0.2)}, {_between('q', 1.0, -0.12, 0.3, 0.2)}", never=("to wait in",),
    ),
    "an escort into a dead end": Refused(
        "F(vip.deep) & G(vip.deep -> guard.deep)", f"vip: {_at(-1.5, 0.5)}, guard: {_at(-1.5, -0.5)}",
        ("guard and vip were in 'deep' at once", "room for 1", "0.4 x 0.3 x 0.2 m now"), _DEEP, _DEAD_END
    ),
    "two robots end where there is room for one": Refused(
        "F(a.spot & b.spot)", _TWO, ("a and b were in 'spot' at once", "room for 1", "0.3 x 0.3 x 0.2 m now", "`margin`"), _SPOT
    ),
    "two robots stay where there is room for one": Refused(
        "F G all(spot)", _TWO, ("2 robots in 'spot'", "room for 1", "Make it larger"), _SPOT
    ),
    "three are counted where there is room for one": Refused(
        "F(count(spot) >= 3)", _THREE, ("3 robots in 'spot'", "room for 1", "Make it larger"), _SPOT
    ),
    "two meet in a door": Refused(
        "F(count(door) >= 2)", f"{_ONE}, b: {_at(1.5, -0.5)}", ("2 robots in 'door'", "room for 1"), _between("door", 0, 0, 0.3, 0.4), _walls(0, 0.1, 0.5)
    ),
    "more are counted than there are": Refused("F(count(right) >= 3)", _TWO, ("more robots than the mission has: 2",), _RIGHT),
    "a door is narrower than radius and margin": Refused(
        "F right", _ONE, ("between 'north' and 'south', 0.2 m apart", "a needs 0.24 m"), _RIGHT, _walls(0, 0.1, 0.2)
    ),
    "a door with a name is narrower than radius and margin": Refused(
        "F right", _ONE, ("through door, 0.2 m wide", "'north'", "a needs 0.24 m"), f"{_RIGHT}, {_between('door', 0, 0, 0.3, 0.2)}", _walls(0, 0.1, 0.2)
    ),
    "a region is thinner than the margin": Refused(
        "F door & F right", _ONE, ("'door'", "`margin`", "wider"), f"{_RIGHT}, {_between('door', 0, 0, 0.3, 0.09)}", _walls(0, 0.1, 0.4)
    ),
    "a region to keep out of closes the hall": Refused(
        "F right & G !strip", _ONE, ("'strip'", "It concerns a", "a formula that lets a enter it", "no way leads around it"), _STRIP, team="own",
        never=("`margin`", "0.12 m"),
    ),
    "robots are counted in a region that closes the hall": Refused(
        "F(count(right) >= 1) & G(count(strip) <= 0)", _TWO, ("'strip'", "a formula that lets a enter it", "no way leads around it"), _STRIP
    ),
    "regions to keep out of leave a gap that is too narrow": Refused(
        "F right & G !(one | other)", _ONE, ("near (-0.", "0.08 m wide between 'one' and 'other'", "more than 0.1 m", "(margin on both sides)", "concerns a", "`margin`"),
        f"{_RIGHT}, one: {_box(0, 0.64, 0.5, 1.2, 0.6)}, other: {_box(0, -0.64, 0.5, 1.2, 0.6)}", team="own", never=("radius", "0.12 m"),
    ),
    "a region to keep out of leaves a gap at the wall": Refused(
        "F right & G !one", _ONE, ("0.96, 1.00)", "0.08 m wide between 'one' and the workspace's wall", "more than 0.1 m"),
        f"{_RIGHT}, one: {_box(0, -0.06, 0.5, 1.96, 0.6)}", team="own",
    ),
    "a region to keep out of leaves a gap at an obstacle": Refused(
        "F right & G !strip", _ONE, ("No way past 'strip' leads a to right", "0.1 m wide between 'north' and 'strip'", "more than 0.17 m", "radius and margin to what is solid", "`margin`"),
        f"{_RIGHT}, strip: {_box(0, -0.1, 0.4, 0.6)}", _walls(0, 0.1, 0.6), team="own", never=("needs strip",),
    ),
    "a region to keep out of for a while leaves a gap at an obstacle": Refused(
        "!strip U right", _ONE, ("No way past 'strip' leads a to right", "0.1 m wide between 'north' and 'strip'"),
        f"{_RIGHT}, strip: {_box(0, -0.1, 0.4, 0.6)}", _walls(0, 0.1, 0.6), team="own",
    ),
    "a region to keep out of for a while closes a door": Refused(
        "!strip U right", _ONE, ("Every way to right leads through 'strip'",), f"{_RIGHT}, strip: {_box(0, 0, 0.4, 0.6)}", _walls(0, 0.1, 0.5), team="own",
        never=("`margin`",),
    ),
    "a region to keep out of closes a door": Refused(
        "F right & G !strip", _ONE, ("`F right` needs strip", "`G !strip`"), f"{_RIGHT}, strip: {_box(0, 0, 0.4, 0.6)}", _walls(0, 0.1, 0.5), team="own"
    ),
    "a region reaches into an obstacle": Refused(
        "F right", _ONE, ("middle of right", "lies in the obstacle 'block'"), _RIGHT, f"block: {_box(1.9, 0, 0.6, 0.6)}"
    ),
    "a wall shuts the hall": Refused("F right", _ONE, ("No way of any width leads to right", "'wall' stands between"), _RIGHT, f"wall: {_box(0, 0, 0.1, 2.4)}"),
    "a room may not be left": Refused(
        "F right & G house", _ONE, ("house and right lie apart",), f"{_RIGHT}, house: {_box(-1.3, 0, 1.2, 1.8, 0.2)}", team="own"
    ),
    "no edge leads there": Refused("F right", f"a: {_at(-0.5, 0)}", ("With the edge robot - right added",), f"{_RIGHT}, {_LEFT}", more="environment: {edges: [[robot, left]]}"),
    "a region is closed to a robot's kind": Refused(
        "F a.right", f"a: {_at(-0.5, 0)}, b: {{start: [-0.5, 0.6, 1], robot: big}}", ("right is closed to a: only big may enter it",),
        "right: {center: [1.6, 0, 1], size: [0.5, 0.5, 0.2], only: [big]}", more="robots: {big: {initial: idle, states: {idle: []}}}",
    ),
    "two regions at once lie apart": Refused("F(left & right)", f"a: {_at(-0.5, 0)}", ("right", "left"), f"{_RIGHT}, {_LEFT}", team="own"),
    "a contradiction": Refused("F right & G !right", _ONE, ("no word satisfies this",), _RIGHT, team="own"),
    "a vehicle flies too shortly": Refused(
        "F left & F right", f"a: {_at(0, 0)}", ("a's endurance of 13 s", "vehicles of longer endurance"), f"{_RIGHT}, {_LEFT}", more="limits: {endurance: 13}"
    ),
    "a robot starts where nobody may be": Refused(
        "F left & G !right", f"a: {_at(1.6, 0)}, b: {_at(0, 0)}", ("`G !right` cannot hold", "a starts inside right"), f"{_RIGHT}, {_LEFT}", never=("b starts",)
    ),
    "a robot with a name starts where it may not be": Refused(
        "F a.left & G !b.right", f"a: {_at(0, 0)}, b: {_at(1.6, 0)}", ("`G !b.right` cannot hold", "b starts inside right"), f"{_RIGHT}, {_LEFT}",
        never=("a starts", "each waits"),
    ),
    "a robot is to end where nobody may be": Refused(
        "F left & G !right", f"a: {_at(0, 0, (1.6, 0))}, b: {_at(0, 0.7, (0, -0.7))}", ("`G !right` cannot hold", "a is to end inside right"),
        f"{_RIGHT}, {_LEFT}", never=("b is",),
    ),
    "parts of a room lie apart": Refused(
        "F right & G room", f"a: {_at(-1.5, 0)}", ("lies within 'room', however near", "concerns a", "parts that join"), f"{_RIGHT}, {_union(-1.1, 1.1, 0.0)}",
        team="own", never=("margin",),
    ),
    "parts of a room join in a narrow place": Refused(
        "F nook & G room", f"a: {_at(-1.5, -0.3)}", ("0.05 m within 'room'", "Around (", "concerns a", "'room' wider than 0.1 m there", "`margin` below 0.0"),
        f"{_between('nook', 1.5, 0.3, 0.2, 0.2)}, {_union(-0.87, 0.87, 0.27)}", team="own",
    ),
    "a link between parts of a room is too narrow": Refused(
        "F right & G room", f"a: {_at(-1.5, 0.4)}, b: {_at(-1.5, -0.4)}",
        ("0.05 m within 'room'", "Around (-0.", ", 1.00) no way is more than 0.0", "'room' wider than 0.1 m there"),
        f"{_RIGHT}, {_linked(0.08)}", team="own",
    ),
    "a link between parts of a room is as wide as the margins": Refused(
        "F right & G room", f"a: {_at(-1.5, 0.4)}", ("Around (", "no way of a", "within 'room'", "asks for 0.05 m", "a wider 'room'", "a smaller `margin`"),
        f"{_RIGHT}, {_linked(0.1)}", team="own",
    ),
    "a link between parts of a room hardly lets one of two robots through": Refused(
        "each(F right) & G all(room)", f"a: {_at(-1.5, 0.4)}, b: {_at(-1.5, -0.4)}", ("Around (", "within 'room'", "asks for 0.05 m", "a wider 'room'"),
        f"{_between('right', 1.4, 0, 0.9, 1.2)}, {_linked(0.1)}",
    ),
    "robots are counted behind a door that is too narrow": Refused(
        "F(count(right) >= 2)", _TWO, ("right can only be reached between", "'north'", "0.2 m apart", "needs 0.24 m"), _between("right", 1.4, 0, 0.9, 1.2), _walls(0, 0.1, 0.2),
        never=("each waits",),
    ),
    "one of two robots is asked for behind a wall": Refused(
        "F a.right & F b.left", f"a: {_at(-1.5, 0.5)}, b: {_at(-1.5, -0.5)}", ("No way of any width leads to right", "'wall' stands between"), f"{_LEFT}, {_RIGHT}",
        f"wall: {_box(0, 0, 0.1, 2.4)}", never=("each waits",),
    ),
    "two robots enter a small region at one instant": Refused(
        "F vip.mid & G(vip.mid <-> guard.mid)", f"vip: {_at(-1.5, 0.5)}, guard: {_at(-1.5, -0.5)}",
        ("`guard.mid` and `vip.mid` to change together", "room for both in 'mid'", "0.3 x 0.3 x 0.2 m now", "0.4 m apart", "such as `G (guard.mid -> F vip.mid)`"),
        f"{_RIGHT}, {_between('mid', 0, 0, 0.3, 0.3)}", never=("each waits",),
    ),
    "an escort into a region that is too small for two": Refused(
        "F vip.mid & G(vip.mid -> guard.mid)", f"vip: {_at(-1.5, 0.5)}, guard: {_at(-1.5, -0.5)}",
        ("guard and vip were in 'mid' at once, which has room for 1", "0.3 x 0.3 x 0.2 m now", "0.4 m apart"),
        f"{_RIGHT}, {_between('mid', 0, 0, 0.3, 0.3)}", never=("each waits", "very same instant"),
    ),
    "an obstacle leaves a gap in a room": Refused(
        "F right & G room", _ONE, ("No way of a to right stays within 'room'", "around (0.", "0.029 m within", "asks for 0.05 m", "a wider 'room' there", "`margin` below 0.029 m"),
        f"{_RIGHT}, room: {_box(0, 0, 3.9, 0.8)}", _BLOCK, team="own", never=("overlap", "outside"),
    ),
    "an obstacle leaves a gap in a region that may be left": Refused(
        "F a.right", _TWO.replace("0.5", "0.3"), ("stays within 'room'", "a region outside to go by", "a wider 'room' there"),
        f"{_RIGHT}, room: {_box(0, 0, 3.9, 0.8)}", _BLOCK, never=("overlap", "cannot reach"),
    ),
    "a robot by name would have to pass a forbidden region": Refused(
        "G(a.left -> F b.right) & F a.left & G !b.door", f"a: {_at(-0.9, 0.5)}, b: {_at(-0.9, -0.5)}", ("Every way to right leads through 'door'.",),
        f"{_LEFT}, {_RIGHT}, {_between('door', 0, 0, 0.3, 0.5)}", _walls(0, 0.1, 0.5), never=("each waits",),
    ),
    "counted robots have a gap that is too narrow": Refused(
        "F(count(right) >= 1) & G(count(strip) <= 0)", _TWO, ("No way past 'strip' leads", "0.1 m wide between 'north' and 'strip'", "more than 0.17 m"),
        f"{_RIGHT}, strip: {_box(0, 0, 0.4, 0.3)}", _walls(0, 0.1, 0.5), never=("needs strip",),
    ),
    "counted robots would have to pass a forbidden region": Refused(
        "F(count(right) >= 1) & G(count(strip) <= 0)", _TWO, ("`F count(right) >= 1` needs strip",), f"{_RIGHT}, strip: {_box(0, 0, 0.3, 0.6)}", _walls(0, 0.1, 0.5),
        never=("each waits",),
    ),
    "no edge leads to what is counted": Refused(
        "F(count(right) >= 1)", _TWO, ("No robot can reach right", "With the edge robot - right added"), f"{_RIGHT}, {_LEFT}", more="environment: {edges: [[robot, left]]}",
    ),
    "counted robots are asked into a region that is too thin": Refused(
        "F(count(spot) >= 1)", _TWO, ("No robot can reach spot", "'spot'", "wider than 0.102 m"), _between("spot", 1.0, 0, 0.09, 0.09), never=("each waits",),
    ),
    "one robot is asked into two places at once": Refused(
        "F(a.left & a.right)", _TWO, ("left and right lie apart: no robot is in both at once.",), f"{_RIGHT}, {_LEFT}", never=("each waits", "2 robots"),
    ),
    "an action is made behind a wall": Refused(
        "F loaded", _ONE, ("no robot can reach right", "'wall' stands between"), _RIGHT, f"wall: {_box(0, 0, 0.1, 2.4)}", team="own",
        more="robot: {initial: empty, states: {empty: [], full: [loaded]}, actions: [{from: empty, to: full, at: right}]}",
    ),
    "all gather where there is room for one": Refused(
        "F(all(left) & F all(right))", f"a: {_at(-1.0, 0.7)}, b: {_at(-1.0, -0.7)}", ("2 robots in 'right'", "room for 1"), f"{_LEFT}, {_between('right', 1.6, 0, 0.3, 0.3)}",
        never=("each waits",),
    ),
    "robots swap places for ever in a tube": Refused(
        "G F a.right & G F b.left", f"a: {_at(-1.2, 0)}, b: {_at(1.2, 0)}", (*_NARROW, "Tried:"),
        f"{_between('left', -1.6, 0, 0.4, 0.25)}, {_between('right', 1.6, 0, 0.4, 0.25)}", _TUBE, trace="infinite", never=("ends there", "last region"),
    ),
    "a deadline is too soon": Refused(
        "F[0,1] right", f"a: {_at(-1.5, 0)}, b: {_at(-1.0, 0.5)}", ("`F[0,1] right` cannot hold", "b comes there at", "s after its deadline", "a later deadline"),
        _RIGHT,
    ),
    "a window outlasts a vehicle": Refused(
        "F[0,5] G[0,20] right", f"{_ONE[:-1]}, limits: {{endurance: 25}}}}, b: {_at(-1.0, 0.5)}", ("a's `endurance` allows no longer one than 14 s",), _RIGHT
    ),
    "a region that nothing names is as thin": Refused(
        "F door", _ONE, ("'door'", "wider"), f"{_between('slot', 1.0, 0, 0.09, 0.3)}, {_between('door', 0, 0, 0.3, 0.09)}", never=("'slot'",)
    ),
    "two regions overlap too closely": Refused(
        "F (left & !right) & F(right & !left)", f"a: {_at(-1, 0)}", ("left and right overlap", "Move them apart"),
        f"{_between('right', 0.3, 0, 0.5, 0.5)}, {_between('left', 0.33, 0, 0.5, 0.5)}", team="own",
    ),
}  # fmt: skip


STEPS_ASIDE = {
    "one of two robots may not leave a room": Refused(
        "G a.room & F a.right & F b.left", f"a: {_at(-1.2, 0)}, b: {_at(1.2, 0)}", (), f"{_LEFT}, {_RIGHT}, {_union(-1.0, 1.0, 0.0, 2.2, 0.3)}"
    ),
    "a region holds both robots that swap places": Refused(
        "F a.right & F b.left", f"a: {_at(-1.2, 0)}, b: {_at(1.2, 0)}", (), f"{_LEFT}, {_RIGHT}, {_between('room', 0, 0, 4.0, 0.3)}"
    ),
    "the one in front comes out first": Refused("F a.deep & F b.deep", f"a: {_at(0.2, 0)}, b: {_at(-1.5, 0)}", (), _DEEP, _DEAD_END),
    "a robot that does nothing comes out first": Refused("F b.deep", f"a: {_at(0.6, 0)}, b: {_at(-1.5, 0)}", (), _DEEP, _DEAD_END),
    "a robot hovers in a corridor": Refused("F a.right", f"{_ONE}, b: {_at(0, 0)}", (), _RIGHT, _CORRIDOR),
    "two robots that do nothing come out first": Refused(
        "F c.deep", f"a: {_at(0.6, 0)}, b: {_at(0.1, 0)}, c: {_at(-1.5, 0)}", (), _DEEP, _DEAD_END
    ),
    "the one in front comes back into the room": Refused(
        "G all(room) & F a.nook & F b.nook", f"a: {_at(1.2, 0)}, b: {_at(-1.5, -0.3)}", (),
        f"{_between('nook', 1.6, 0, 0.3, 0.3)}, room: {{union: [{_box(-1.2, 0, 1.4, 1.6, 0.2)}, {_box(0.6, 0, 2.6, 0.3, 0.2)}]}}",
    ),
    "a robot that may not leave a region makes room in it": Refused(
        "F a.right & G b.mid", f"a: {_at(-1.2, 0)}, b: {_at(0, 0)}", (), f"{_RIGHT}, {_between('mid', 0, 0, 0.4, 1.2)}", _walls(0, 1.0, 0.9)
    ),
    "two robots swap ends through a corridor": Refused(
        "true", f"a: {_at(-1.2, 0, (1.2, 0))}, b: {_at(1.2, 0, (-1.2, 0))}", (), "", _walls(0, 1.0, 0.5)
    ),
    "two robots swap places through a corridor": Refused(
        "F a.right & F b.left", f"a: {_at(-1.2, 0)}, b: {_at(1.2, 0)}", (), f"{_LEFT}, {_RIGHT}", _walls(0, 1.0, 0.5)
    ),
}  # fmt: skip
"""Missions that were refused, as planning has robots rest in regions alone: a robot has to step aside to a place of its own."""


def strangers(mission: Mission, sentence: str) -> list[str]:
    """Return what a sentence names although the mission has no such thing: names in quotation marks, kinds of things.

    Args:
        mission: What is refused.
        sentence: Why.
    """
    known = {
        *mission.all_regions,
        *mission.obstacles,
        *mission.agents,
        *(mission.robots or ()),
        *mission.internal_propositions,
        *_KEYS,
    }
    quoted = re.findall(r"'([A-Za-z_][\w.]*)'", sentence)
    found = [name for name in quoted if name not in known]
    for word, table in _WORDS.items():
        if re.search(rf"\b{word}s?\b", sentence) and not getattr(mission, table):
            found.append(word)
    if re.search(r"\bdoors?\b", sentence) and not mission.obstacles and "door" not in mission.all_regions:
        found.append("door")
    return found
