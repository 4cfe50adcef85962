"""Online flight that is certified as it goes: robots fly only pieces that were proved for what is left of the formula.

At take-off the whole mission is planned, refined and certified; nobody moves before that has succeeded. When the world
changes, the certificate no longer speaks of what is flown: the robots slow down along their certified paths to a hover (the one
thing here that is not certified), and hold their positions until what is left is certified from there.

What is left is the formula rewritten by what was shown (its progression). That is the whole truth about the rest only where
the readings of the flown letters lead to one state and reading the held letters once more changes nothing; and a mission
file has one initial internal state for all robots. Where either fails the team goes on holding and says which.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ltlplan.automata import DEAD
from ltlplan.online.course import ORDERS, Clock, through_clock
from ltlplan.online.events import changed, rim_distance
from ltlplan.online.pilot import Pilot
from ltlplan.online.team import PERIOD, Desired, OnlineTeam
from ltlplan.pipeline import certified_team, plan
from verify.data import Formula, Infeasible, Letter, LtlplanError, Mission, NotCertified, Plan, Trajectory, Unsatisfiable
from verify.data.formula import FALSE, TRUE
from verify.data.mission import Environment, Point
from verify.data.mission_file import check_mission

Floats = NDArray[np.float64]


class CertifiedTeam(OnlineTeam):
    """A team that flies certified trajectories and holds position whenever it has none.

    Attributes:
        tracks: Each robot's certified trajectory, or None while it hovers without one.
        plan: What is flown now.
        certificates: Digests of all certificates that were flown, in order.
    """

    def __init__(self, mission: Mission, *, seed: int, rng: Generator) -> None:
        """Certify the whole mission at its starts.

        Raises:
            Unsatisfiable: Nothing that these robots can fly satisfies the formula.
            Infeasible: Refinement found no trajectory within the limits.
            NotCertified: The proof was refused.
        """
        self.seed = seed
        self.tracks: dict[str, Trajectory | None] = {}
        self.hover: dict[str, Floats] = {}
        self.instants: dict[str, list[tuple[float, str]]] = {}
        self.plan: Plan | None = None
        self.certificates: tuple[str, ...] = ()
        self.stops: dict[str, float] = {}
        super().__init__(mission, rng=rng)

    @property
    def cost(self) -> float:
        """Summed length of the certified trajectories, m."""
        total = 0.0
        for track in self.tracks.values():
            if track is not None:
                at = track.evaluate(np.linspace(0.0, track.duration, 400))[:, :3]
                total += float(np.linalg.norm(np.diff(at, axis=0), axis=1).sum())
        return total

    def allocate(self) -> None:
        """Plan, refine and certify what is left; on success `holding` is None.

        Raises:
            Unsatisfiable: Nothing that is left satisfies the formula.
            Infeasible: No trajectory keeps the limits, or what is left cannot be written as a mission.
            NotCertified: The proof was refused.
        """
        self.tracks = dict.fromkeys(self.pilots)
        self.hover = {name: np.array(pilot.where.position) for name, pilot in self.pilots.items()}
        try:
            proved = certified_team(self._planned())
        except LtlplanError as error:
            self.holding = f"No certified pieces for what is left: {error}"
            raise
        self.tracks = dict(proved.team)
        self.instants = {name: [] for name in self.pilots}
        for action in sorted(proved.certificate.actions, key=lambda a: a.time):
            self.instants[action.robot].append((action.time, action.target))
        for pilot in self.pilots.values():
            pilot.clock = Clock(0.0, (1.0, 0.0, 0.0, 0.0))
        self.certificates = (*self.certificates, proved.certificate.digest())
        self.holding = None
        self.plan = proved.plan

    def step(self, now: float, positions: Mapping[str, Point]) -> Desired:
        """Go on along the certified trajectories, or come to rest."""
        self._see(now, positions)
        self._shared_again(now)
        flat = np.zeros((ORDERS, 4, len(self.pilots)))
        for j, (name, pilot) in enumerate(self.pilots.items()):
            flat[:, :, j] = self._flat(name, pilot)
            if self.holding is None:
                pilot.clock = Clock(pilot.clock.time + PERIOD, (1.0, 0.0, 0.0, 0.0))
            else:
                go = pilot.clock.time + pilot.clock.run_on + PERIOD <= self.stops.get(name, 0.0)
                pilot.clock = pilot.clock.after(PERIOD, go)
        self.steps += 1
        satisfied = self.standing.accepts()
        finished = satisfied and self.holding is None and all(self._ended(n, p) for n, p in self.pilots.items())
        return Desired(flat, satisfied, finished, self.holding)

    def hold(self, reason: str) -> None:
        """Let everybody come to rest on their certified paths, clear of regions and rings where the path allows it."""
        super().hold(reason)
        self.stops = {name: self._clear_stop(pilot) for name, pilot in self.pilots.items()}

    def _clear_stop(self, pilot: Pilot) -> float:
        """Return the first time on a robot's trajectory at which it can be at rest clear of all regions, s."""
        track = self.tracks.get(pilot.name)
        soonest = pilot.clock.time + pilot.clock.run_on
        if track is None or soonest >= track.duration:
            return soonest
        times = np.append(np.arange(soonest, track.duration, PERIOD), track.duration)
        points = track.evaluate(times)[:, :3]
        clear = np.ones(len(times), dtype=np.bool_)
        for region in self.mission.all_regions.values():
            clear &= region.level(points) > (1 + 1.5 * self.mission.margin / min(region.radii)) ** 2
        for hoop in self.mission.hoops.values():
            need = self.mission.vehicle.radius + 1.5 * self.mission.margin
            clear &= np.array([rim_distance((float(x), float(y), float(z)), hoop) > need for x, y, z in points])
        found = np.flatnonzero(clear)
        # where the way crosses a region that has just moved there is no such point: stop at once
        return float(times[found[0]]) if len(found) else soonest

    def _see(self, now: float, positions: Mapping[str, Point]) -> None:
        for name, pilot in self.pilots.items():
            due = self.instants.get(name, [])
            # the planned instant lies where the robot is in its region for sure, while it is inside its tube
            if due and self.holding is None and pilot.clock.time >= due[0][0]:
                pilot.where = replace(pilot.where, internal=due.pop(0)[1])
        events, inside = self._labelled(positions)
        for name in events:
            self.pilots[name].observe(events[name], inside[name])
        if events:
            self._note(now, events)

    def _flat(self, name: str, pilot: Pilot) -> Floats:
        """Position to snap, with heading, where the robot is on its trajectory. Shape (ORDERS, 4)."""
        track = self.tracks[name]
        if track is None:
            still = np.zeros((ORDERS, 4))
            still[0, :3], still[0, 3] = self.hover[name], self.mission.agents[name].yaw
            return still
        time = max(pilot.clock.time, 0.0)
        return through_clock(np.stack([track.evaluate(time, order) for order in range(ORDERS)]), pilot.clock)

    def _ended(self, name: str, pilot: Pilot) -> bool:
        track = self.tracks[name]
        return track is None or pilot.clock.time >= track.duration

    def _rests(self, pilot: Pilot, now: float) -> bool:  # noqa: ARG002  # certified courses do not glide
        return self.tracks[pilot.name] is None or self._ended(pilot.name, pilot) or pilot.clock.resting

    def _root(self, pilot: Pilot, now: float) -> None:  # noqa: ARG002
        x, y, z = (float(v) for v in self._flat(pilot.name, pilot)[0, :3])
        pilot.where = replace(pilot.where, position=(x, y, z))

    def _planned(self) -> Plan:
        """Plan what is left.

        Raises:
            Infeasible: The environment has no edge to where a robot would have to go first.
        """
        if not self.steps:
            return plan(self.mission, seed=self.seed)
        left = self._left()
        made = plan(check_mission(left), seed=self.seed)
        for name, robot in made.robots.items():
            vertex = self.pilots[name].where.vertex
            first = robot.visits[0].region if robot.visits else None
            # robots have one start vertex in a mission, but have come to different vertices
            if first is not None and first not in self.world.neighbours.get(vertex, ()):
                raise Infeasible(f"{name} would have to go to '{first}', to which no edge leads from '{vertex}'.")
        return made

    def _environment(self) -> Environment | None:
        """Return the environment in which a start leads to every region that all robots may go to next, or else any may."""
        given = self.mission.environment
        if given is None:
            return None
        onward = [set(self.world.neighbours.get(pilot.where.vertex, ())) for pilot in self.pilots.values()]
        common = set.intersection(*onward) or set.union(*onward)
        edges = [edge for edge in given.edges if given.start not in edge]
        return given.model_copy(update={"edges": (*edges, *((given.start, region) for region in sorted(common)))})

    def _left(self) -> Mission:
        """Return what is left as a mission of its own, from where the robots hover.

        Raises:
            Infeasible: It cannot be written as one; the message says why.
        """
        reached = self.standing.settled
        if len(reached) != 1 or DEAD in reached:
            raise Infeasible("the flown letters can be read in ways that lead to different states, so no one formula is left.")
        (state,) = reached
        for letter in set(self.standing.held.values()):
            if self.reader.successor(state, letter) != state:
                raise Infeasible(
                    f"reading {{{', '.join(sorted(letter))}}}, which is still held, once more would change what is left."
                )
        for name in self.standing.held:
            if name not in self.pilots and not self._never_matters(self.standing.held[name], state):
                raise Infeasible(f"{name} has landed and keeps a letter that may matter later.")
        internals = {pilot.where.internal for pilot in self.pilots.values()}
        if len(internals) > 1:
            raise Infeasible(
                f"robots are in different internal states ({', '.join(sorted(internals))}); a mission has one for all at its start."
            )
        agents = {
            name: self.mission.agents[name].model_copy(update={"start": pilot.where.position})
            for name, pilot in self.pilots.items()
        }
        left = progressed(self.mission.formula, self._readings())
        if left == FALSE:
            raise Unsatisfiable("what was flown cannot be completed to satisfy the formula.")
        robot = self.mission.robot.model_copy(update={"initial": internals.pop()})
        spec = self.mission.spec.model_copy(update={"formula": str(left)})
        return changed(self.mission, agents=agents, robot=robot, spec=spec, environment=self._environment())

    def _never_matters(self, letter: Letter, state: object) -> bool:
        """Tell whether a letter that stays held changes no state that can still be reached."""
        seen, stack = {state}, [state]
        while stack:
            at = stack.pop()
            if self.reader.successor(at, letter) != at:
                return False
            for other in self.reader.shown:
                target = self.reader.successor(at, other)
                if target != DEAD and target not in seen:
                    seen.add(target)
                    stack.append(target)
        return True

    def _readings(self) -> list[Letter]:
        """One reading of what was flown: each letter when it was first held (under "joint" the unions)."""
        held = dict(self.first_letters)
        joint = self.mission.spec.team == "joint"
        readings = [frozenset[str]().union(*held.values())] if joint else list(held.values())
        for _, events in self.shown:
            for name in sorted(events):
                held[name] = events[name]
                readings.append(frozenset[str]().union(*held.values()) if joint else events[name])
        return readings


def progressed(formula: Formula, letters: Iterable[Letter]) -> Formula:
    """Return what must hold of the rest of a trace, which is never empty, after letters were read (no X in the formula)."""
    for letter in letters:
        formula = _after(formula, letter)
    return formula


def _after(node: Formula, letter: Letter) -> Formula:
    parts = node.arguments
    match node.operator:
        case "true" | "false":
            return node
        case "name":
            return TRUE if node.name in letter else FALSE
        case "!":
            return _not(_after(parts[0], letter))
        case "&":
            return _and(_after(parts[0], letter), _after(parts[1], letter))
        case "|":
            return _or(_after(parts[0], letter), _after(parts[1], letter))
        case "->":
            return _or(_not(_after(parts[0], letter)), _after(parts[1], letter))
        case "<->" | "xor":
            left, right = _after(parts[0], letter), _after(parts[1], letter)
            same = _or(_and(left, right), _and(_not(left), _not(right)))
            return same if node.operator == "<->" else _not(same)
        case "F":
            return _or(_after(parts[0], letter), node)
        case "G":
            return _and(_after(parts[0], letter), node)
        case "U" | "W":
            return _or(_after(parts[1], letter), _and(_after(parts[0], letter), node))
        case "R" | "M":
            return _and(_after(parts[1], letter), _or(_after(parts[0], letter), node))
        case "X" | "X[!]":
            raise NotCertified("a mission's formula has no X, so none can be left.")


def _not(one: Formula) -> Formula:
    if one in (TRUE, FALSE):
        return FALSE if one == TRUE else TRUE
    return one.arguments[0] if one.operator == "!" else Formula("!", (one,))


def _and(one: Formula, other: Formula) -> Formula:
    if FALSE in (one, other):
        return FALSE
    if one in (TRUE, other):
        return other
    return one if other == TRUE else Formula("&", (one, other))


def _or(one: Formula, other: Formula) -> Formula:
    if TRUE in (one, other):
        return TRUE
    if one in (FALSE, other):
        return other
    return one if other == FALSE else Formula("|", (one, other))
