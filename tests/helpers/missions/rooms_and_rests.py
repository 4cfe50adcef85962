"""Small missions on which plans once were dearer than they had to be: machines that are shared, regions to keep out of, rooms to stay in.

They are ours, written down when these were measured first; figures are in docs/performance/rooms.md.
"""

from __future__ import annotations

from verify.data import Mission, parse_mission

_TEXT = """
format: 1
name: {name}
spec: {{formula: "{formula}"{team}}}
regions: {{{regions}}}
{more}
agents: {{{agents}}}
vehicle: crazyflie-2.1
limits: {{speed: 1.0}}
workspace: {{min: [{low}, 0.2], max: [{high}, 2]}}
"""
CYLINDERS = {"nf1": (0.0, 0.0, 0.6), "nf2": (0.7, 1.0, 0.5), "nf3": (0.5, -1.5, 0.5)}
"""x, y and radius of upright cylinders between a start and a goal, m."""


def keeping_out(*, of: str = "regions", cylinders: dict[str, tuple[float, float, float]] = CYLINDERS) -> Mission:
    """Return a mission to fly past upright cylinders, which are regions that the formula forbids, or obstacles.

    Args:
        of: "regions" or "obstacles".
        cylinders: x, y and radius of each, m.
    """
    shapes = [
        f"{name}: {{center: [{x}, {y}, 1], cylinder: {{radius: {r}, height: 2}}}}" for name, (x, y, r) in cylinders.items()
    ]
    goal = "goal: {center: [2, 0, 1], radii: [0.3, 0.3, 0.3]}"
    forbidden = " | ".join(cylinders)
    formula = f"F goal & G !({forbidden})" if of == "regions" else "F goal"
    regions = ", ".join([goal, *shapes]) if of == "regions" else goal
    more = "" if of == "regions" else f"obstacles: {{{', '.join(shapes)}}}"
    return _mission("keep-out", formula, regions, "q: {start: [-2, 0, 1]}", more=more, low="-2.6, -2", high="2.6, 2")


def _mission(
    name: str, formula: str, regions: str, agents: str, *, more: str = "", low: str = "-2.2, -1.8", high: str = "2.2, 1.8"
) -> Mission:
    team = ", team: joint" if agents.count("start") > 1 else ""
    text = _TEXT.format(name=name, formula=formula, team=team, regions=regions, agents=agents, more=more, low=low, high=high)
    return parse_mission(text)


def room_with_a_corner(*, mirrored: bool = False, turned: bool = False, touching: bool = False) -> Mission:
    """Return a mission to fly to the far end of an L-shaped room without leaving it.

    Args:
        mirrored: Whether left and right change places.
        turned: Whether the room is turned by a quarter.
        touching: Whether its two parts share a wall in place of a corner.
    """

    def at(x: float, y: float) -> tuple[float, float]:
        x = -x if mirrored else x
        return (-y, x) if turned else (x, y)

    def box(x: float, y: float, wide: float, long: float, high: float) -> str:
        (x, y), (wide, long) = at(x, y), (long, wide) if turned else (wide, long)
        return f"{{center: [{x}, {y}, 1], size: [{wide}, {long}, {high}]}}"

    parts = [box(0.0, -1.2, 4.0, 1.0, 1.4), box(-1.5, 0.3 if touching else -0.2, 1.0, 2.0 if touching else 3.0, 1.4)]
    x, y = at(1.4, -1.2)
    regions = f"room: {{union: [{', '.join(parts)}]}}, corner: {box(-1.5, 0.9, 0.5, 0.4, 0.6)}"
    return _mission("room", "G room & F corner", regions, f"q: {{start: [{x}, {y}, 1]}}", low="-2.4, -2.4", high="2.4, 2.4")


STARTS = ((0.0, 1.2), (0.0, 0.0), (0.0, -1.2), (-0.6, 0.6), (-0.6, -0.6))
"""x and y at which robots start that share a machine, m."""


def shared_machine(
    robots: int = 2,
    *,
    more: str = "",
    parts: bool = False,
    mirrored: bool = False,
    names: tuple[str, ...] = ("a", "b", "c", "d", "e"),
    order: tuple[int, ...] = (),
) -> Mission:
    """Return a mission of robots that each come to a machine, which one of them uses at a time.

    Args:
        robots: How many.
        more: Other regions, as they are written in a mission.
        parts: Whether each must have fetched a part before.
        mirrored: Whether left and right change places.
        names: Of the robots, by their starts.
        order: In which they are listed, by their starts; as they stand where empty.
    """
    side = -1 if mirrored else 1
    regions = [f"machine: {{center: [{1.3 * side}, 0, 1], radii: [0.4, 0.4, 0.4]}}"]
    used, made = "machine", ""
    if parts:
        regions.append(f"store: {{center: [{-1.3 * side}, 0, 1], size: [1.0, 2.0, 0.8]}}")
        used = "(machine & part)"
        made = "robot: {initial: e, states: {e: [], p: [part]}, actions: [{from: e, to: p, at: store}]}"
    listed = [(names[k], STARTS[k]) for k in order or range(robots)]
    agents = ", ".join(f"{name}: {{start: [{x * side}, {y}, 1]}}" for name, (x, y) in listed)
    formula = f"each(F {used}) & G(count(machine) <= 1)"
    return _mission("machine", formula, ", ".join([*regions, *([more] if more else [])]), agents, more=made)


def escort() -> Mission:
    """Return a mission of a robot that is only to be in two zones while a guard is there."""
    regions = "one: {center: [-1.2, 0.8, 1], radii: [0.7, 0.7, 0.6]}, other: {center: [1.2, 0.8, 1], radii: [0.7, 0.7, 0.6]}"
    formula = "F(vip.one & F vip.other) & G(vip.one -> guard.one) & G(vip.other -> guard.other)"
    return _mission("escort", formula, regions, "vip: {start: [-0.3, -1, 1]}, guard: {start: [0.5, -1, 1]}")


Box = tuple[tuple[float, float], tuple[float, float]]
"""Centre and lengths of a box in x and y, m."""
FIELD_OR_SPOT: dict[str, Box] = {"field": ((3.0, 0.0), (5.0, 2.0)), "spot": ((-1.5, 0.0), (0.4, 0.4))}


def fields_or_spots(boxes: dict[str, Box], start: tuple[float, float] = (0.0, 0.0), formula: str = "") -> Mission:
    """Return a mission to come to any of some boxes, by their centres and lengths in x and y, m, or as a formula says."""
    regions = [
        f"{name}: {{center: [{x}, {y}, 1], size: [{wide}, {long}, 1]}}" for name, ((x, y), (wide, long)) in boxes.items()
    ]
    formula = formula or f"F({' | '.join(boxes)})"
    agents = f"q: {{start: [{start[0]}, {start[1]}, 1]}}"
    return _mission("fields", formula, ", ".join(regions), agents, low="-6, -6", high="6, 6")
