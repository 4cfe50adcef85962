"""Teams of two to six robots in rooms with doors, drawn at random: walls, narrow and wide doors, pillars, places to come to, formulas.

A mission is drawn from a seed as plain numbers first (`RoomTeam`), so that it can be mirrored, renamed and reordered, and bounded without the planner.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from verify.data import Mission, parse_mission

CLEARANCE = 0.12
"""m from a robot's centre to what is solid: radius and margin."""
MARGIN, APART = 0.05, 0.401
"""m; what robots' centres keep from walls of the workspace and edges of regions, and from each other where they rest."""
HALF_HEIGHT = {"low": 0.1, "tall": 0.6}
"""m above and below 1 m; in a low hall no robot passes above another one."""
KINDS = ("shared", "named", "ends", "gather", "turns", "until", "avoid")
_DRAWS = 400

Point = tuple[float, float]


@dataclass(frozen=True)
class Box:
    """Rectangle in x and y, m."""

    low: Point
    high: Point

    def grown(self, by: float) -> Box:
        """Return the box with its sides further out."""
        return Box((self.low[0] - by, self.low[1] - by), (self.high[0] + by, self.high[1] + by))

    def meets(self, other: Box) -> bool:
        """Tell whether two boxes have a common point."""
        return all(a <= d and c <= b for a, b, c, d in zip(self.low, self.high, other.low, other.high, strict=True))

    def mirrored(self) -> Box:
        """Return the box with left and right exchanged."""
        return Box((-self.high[0], self.low[1]), (-self.low[0], self.high[1]))

    def text(self, half_height: float) -> str:
        """Return the box as a mission has it."""
        (a, b), (c, d) = self.low, self.high
        return f"{{center: [{(a + c) / 2:.4f}, {(b + d) / 2:.4f}, 1], size: [{c - a:.4f}, {d - b:.4f}, {2 * half_height:.4f}]}}"


@dataclass(frozen=True)
class Door:
    """The one door of a wall that cuts the hall in two: between two places in y, in a wall between two places in x, m."""

    wall: Point
    side: Point


@dataclass(frozen=True)
class RoomTeam:
    """A mission in plain numbers.

    Attributes:
        kind: Of its formula.
        hall: The workspace.
        height: "low" or "tall".
        solid: Walls and pillars.
        doors: Of walls with one door each.
        places: Regions by name.
        starts: Of robots, by name, in the order in which they are listed.
        ends: Of robots that have one.
        tasks: Places that a named robot has to come to; of shared ones all that any robot may do, under "".
        formula: As it is written.
        joint: Whether robots are read together.
    """

    kind: str
    hall: Box
    height: str
    solid: tuple[Box, ...]
    doors: tuple[Door, ...]
    places: dict[str, Box]
    starts: dict[str, Point]
    ends: dict[str, Point]
    tasks: dict[str, tuple[str, ...]]
    formula: str
    joint: bool

    @property
    def meeting(self) -> int:
        """How many robots gather."""
        return min(3, len(self.starts))

    def mission(self, pace: str = "nominal", more: dict[str, Box] | None = None) -> Mission:
        """Return the mission.

        Args:
            pace: As `planner.pace`.
            more: Regions that the formula does not name.
        """
        half = HALF_HEIGHT[self.height]
        (a, b), (c, d) = self.hall.low, self.hall.high
        solid = ", ".join(f"wall{k}: {box.text(2.0)}" for k, box in enumerate(self.solid))
        regions = ", ".join(f"{name}: {box.text(0.9 * half)}" for name, box in (self.places | (more or {})).items())
        agents = ", ".join(f"{name}: {{start: [{x:.4f}, {y:.4f}, 1]{self._end(name)}}}" for name, (x, y) in self.starts.items())
        team = "joint" if self.joint else "own"
        return parse_mission(
            f"""format: 1
name: rooms
spec: {{formula: "{self.formula}", team: {team}}}
regions: {{{regions}}}
obstacles: {{{solid}}}
agents: {{{agents}}}
vehicle: crazyflie-2.1
planner: {{pace: {pace}}}
workspace: {{min: [{a:.4f}, {b:.4f}, {1 - half}], max: [{c:.4f}, {d:.4f}, {1 + half}]}}
"""
        )

    def _end(self, name: str) -> str:
        return ", end: [{:.4f}, {:.4f}, 1]".format(*self.ends[name]) if name in self.ends else ""

    def mirrored(self) -> RoomTeam:
        """Return the mission with left and right exchanged."""

        def turned(points: dict[str, Point]) -> dict[str, Point]:
            return {name: (-x, y) for name, (x, y) in points.items()}

        return replace(
            self,
            hall=self.hall.mirrored(),
            solid=tuple(box.mirrored() for box in self.solid),
            doors=tuple(replace(door, wall=(-door.wall[1], -door.wall[0])) for door in self.doors),
            places={name: box.mirrored() for name, box in self.places.items()},
            starts=turned(self.starts),
            ends=turned(self.ends),
        )

    def reordered(self) -> RoomTeam:
        """Return the mission with its robots listed the other way round."""
        return replace(self, starts=dict(reversed(self.starts.items())))

    def renamed(self) -> RoomTeam:
        """Return the mission with robots that have other names, in the same places of the list."""
        new = {name: f"drone_{chr(ord('z') - k)}" for k, name in enumerate(self.starts)}
        formula = self.formula
        for old, name in new.items():
            formula = formula.replace(f"{old}.", f"{name}.")
        return replace(
            self,
            formula=formula,
            **{
                field: {new.get(name, name): value for name, value in getattr(self, field).items()}
                for field in ("starts", "ends", "tasks")
            },
        )

    def unrelated(self, seed: int) -> dict[str, Box]:
        """Return a region, in free space, that the formula does not name; none where there is no room for one."""
        rng = np.random.default_rng(seed)
        taken = [*self.solid, *(box.grown(0.2) for box in self.places.values())]
        taken += [Box(point, point).grown(0.25) for point in (*self.starts.values(), *self.ends.values())]
        found = _free_box(rng, self.hall, taken, 0.3, 0.5)
        return {} if found is None else {"shelf": found}


def drawn(seed: int) -> RoomTeam:
    """Draw a mission.

    Args:
        seed: Of all draws; the kind of formula goes round with it.
    """
    rng = np.random.default_rng([2026, seed])
    while True:
        team = _drawn(rng, KINDS[seed % len(KINDS)])
        if team is not None:
            return team


def _drawn(rng: np.random.Generator, kind: str) -> RoomTeam | None:
    """Draw a mission; None where there is no room for what was drawn."""
    hall = Box((-2.5, -1.8), (2.5, 1.8))
    height = "low" if rng.random() < 0.5 else "tall"
    solid, doors, doorways = _walls(rng, hall)
    shut = [*solid, *(doorway.grown(0.35) for doorway in doorways)]
    for _ in range(int(rng.integers(0, 3))):
        pillar = _free_box(rng, hall.grown(-0.5), shut, 0.15, 0.4)
        if pillar is not None:
            solid.append(pillar)
            shut.append(pillar.grown(0.45))
    count = int(rng.integers(2, 7))
    places: dict[str, Box] = {}
    for name in "abcd"[: 1 if kind in ("gather", "turns") else int(rng.integers(2, 5))]:
        least, most = (1.0, 1.4) if kind == "gather" else (0.4, 0.9)
        place = _free_box(rng, hall.grown(-0.2), [box.grown(0.15) for box in shut], least, most)
        if place is None:
            return None
        places[name] = place
        shut.append(place.grown(0.3))
    starts: dict[str, Point] = {}
    ends: dict[str, Point] = {}
    for points, wanted in ((starts, count), (ends, count if kind == "ends" else 0)):
        free = [*shut, *(Box(point, point).grown(0.45) for point in points.values())]
        for k in range(wanted):
            spot = _free_box(rng, hall.grown(-0.2), [box.grown(0.2) for box in free], 0.0, 0.0)
            if spot is None:
                return None
            points[f"q{k}"] = spot.low
            free.append(Box(spot.low, spot.low).grown(0.3))
    tasks, formula, joint = _formula(rng, kind, list(places), list(starts))
    return RoomTeam(kind, hall, height, tuple(solid), tuple(doors), places, starts, ends, tasks, formula, joint)


def _walls(rng: np.random.Generator, hall: Box) -> tuple[list[Box], list[Door], list[Box]]:
    """Draw walls across the hall; return what is solid, the only doors of walls, and all doorways."""
    solid: list[Box] = []
    doors: list[Door] = []
    doorways: list[Box] = []
    low, high = hall.low[1] - 0.2, hall.high[1] + 0.2
    for x in (0.0,) if rng.random() < 0.5 else (-0.9, 0.9):
        thick = float(rng.uniform(0.08, 0.5))
        sides: list[Point] = []
        for middle in rng.uniform(-1.2, 1.2, 1) if rng.random() < 0.7 else (rng.uniform(-1.2, -0.8), rng.uniform(0.8, 1.2)):
            wide = float(rng.uniform(0.4, 0.6) if rng.random() < 0.6 else rng.uniform(0.9, 1.3))
            sides.append((float(middle) - wide / 2, float(middle) + wide / 2))
        edges = [low, *(y for side in sides for y in side), high]
        one, other = x - thick / 2, x + thick / 2
        solid += [Box((one, a), (other, b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
        doorways += [Box((one, a), (other, b)) for a, b in sides]
        if len(sides) == 1:
            doors.append(Door((one, other), sides[0]))
    return solid, doors, doorways


def _free_box(rng: np.random.Generator, within: Box, taken: list[Box], least: float, most: float) -> Box | None:
    """Draw a box of sides between two lengths that meets no other; None where none is found."""
    for _ in range(_DRAWS):
        size = rng.uniform(least, most, 2) if most else np.zeros(2)
        low = rng.uniform(within.low, np.array(within.high) - size)
        box = Box((float(low[0]), float(low[1])), (float(low[0] + size[0]), float(low[1] + size[1])))
        if not any(box.meets(other) for other in taken):
            return box
    return None


def _formula(
    rng: np.random.Generator, kind: str, places: list[str], robots: list[str]
) -> tuple[dict[str, tuple[str, ...]], str, bool]:
    """Return who has to come where, the formula, and whether robots are read together."""
    everywhere = " & ".join(f"F {place}" for place in places)
    match kind:
        case "named" | "ends":
            tasks = {
                robot: tuple(sorted(rng.choice(places, int(rng.integers(1, 3)), replace=False).tolist())) for robot in robots
            }
            return tasks, " & ".join(f"F {robot}.{place}" for robot, own in tasks.items() for place in own), True
        case "gather":
            return {"": ("a",)}, f"F(count(a) >= {min(3, len(robots))})", True
        case "turns":
            return dict.fromkeys(robots, ("a",)), "each(F a) & G(count(a) <= 1)", True
        case "until":
            return {"": tuple(places)}, f"(!b U a) & {everywhere}", False
        case "avoid":
            return {"": tuple(places[:-1])}, " & ".join([f"F {p}" for p in places[:-1]] + [f"G !{places[-1]}"]), False
        case _:
            return {"": tuple(places)}, everywhere, False
