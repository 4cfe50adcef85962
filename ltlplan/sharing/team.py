"""Online MTAC-E: tasks are shared and paths are improved while the robots fly (2022 paper, Algorithm 5).

`OnlineTeam.step` is called 50 times a second with measured positions and returns what each robot should do now. As in the
paper, a satisfying run is made at the first step; whoever is cheapest gets each part of it; paths are sampled for each robot by
online cross-entropy; the flag says when the formula is satisfied. What the printed algorithm leaves open:

* The run is made by the walk of `ltlplan.mtac.beam_search` with straight lines for costs, so that robots can go within a second. The switch
  condition is asked again several times a second: a task that nobody has begun, and whose beginning is in the decomposition
  set of the states that the automaton may be in now (what is done is done), goes to another robot where that is clearly cheaper.
* A robot that has begun a task outside the decomposition set keeps it to its end, as the paper says.
* The states are a set, because robots fly at the same time (`sharing.belief`); a robot that comes to a region enters
  it only if the team can still finish afterwards, whatever the order of the events; otherwise it waits on its path.
* The desired pose is not the raw sample at time t, which would jump by decimetres 50 times a second. Robots glide to a
  sampled path where it is cheaper than the one that they fly (`sharing.gliding_path`).
* Robots keep the mission's separation by waiting; who waits for one that hovers gets a way around it, or it steps aside.

None of this is certified: sampled paths, measured positions, no bound on what the vehicle does. The verdict on what was flown
is the checker's, afterwards.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ltlplan.logic.automaton import DEAD
from ltlplan.mtac.agent_moves import AgentState, RobotTask, World
from ltlplan.mtac.task_reader import Reader
from ltlplan.sharing.belief import admits, after_events, at_start, can_finish
from ltlplan.sharing.cross_entropy import OnlineSettings
from ltlplan.sharing.pilot import Pilot
from ltlplan.sharing.residual import mission_left
from ltlplan.sharing.room_to_pass import led_around, make_way
from ltlplan.sharing.sharing_out import share_out
from ltlplan.sharing.switch import Handover, better_hands, may_change
from verify.data import BadInput, Infeasible, Letter, LtlplanError, Mission, RobotPlan, Unsatisfiable, Word
from verify.data.events import HoopMoves, RobotJoins, RobotLeaves, WorldEvent
from verify.data.mission import Agent, Point

Floats = NDArray[np.float64]

PERIOD = 0.02
"""s between two steps: 50 Hz, as in the paper's experiment."""

SEARCH_STEPS = 50
"""Steps that robots hover after tasks were shared, while their paths improve most: 1 s."""

SWITCH_STEPS = 25
"""Steps between two looks at the switch condition."""

LOOK_AHEAD = 1.6
"""s over which robots keep out of each other's way."""

PATIENCE = 3.0
"""s that two robots wait for each other before the other one goes first."""

STUCK = 12.0
"""s without any motion after which a team that has something left to do gives up."""


@dataclass(frozen=True, slots=True)
class Desired:
    """What the robots should do now.

    Attributes:
        flat: x, y, z, yaw and their derivatives up to the fourth. Shape (5, 4, robots).
        satisfied: Whether what was shown so far satisfies the formula if nobody's letter changes any more.
        finished: Whether moreover everybody has come to rest at the end of a course.
        holding: A sentence where the team holds position because nothing is left that could satisfy the formula.
        switched: Sentences about tasks that changed hands in this step, and about robots that make way for each other.
    """

    flat: Floats
    satisfied: bool
    finished: bool
    holding: str | None
    switched: tuple[str, ...] = ()


class OnlineTeam:
    """A team in flight under online MTAC-E. It changes with each step.

    Attributes:
        mission: What is asked now; `change` replaces it.
        pilots: One for each robot in the air, in the mission's order.
        belief: Letters held, and the automaton's states that may have been reached.
        first_letters: What each robot showed first.
        shown: Every change of a letter: (s, {robot: letter}); replayed when the world changes.
        holding: Why the team holds position, or None.
    """

    def __init__(
        self, mission: Mission, *, rng: Generator, settings: OnlineSettings | None = None, every_order: bool = False
    ) -> None:
        """Prepare a team at its starts.

        Args:
            mission: What is asked.
            rng: Source of every draw.
            settings: Numbers of online cross-entropy; by default the mission's `planner` says.
            every_order: Share only in ways whose words hold in every order of the robots, as plans are to; in flight some order
                is enough, because the gate keeps it. The world may then not change.

        Raises:
            BadInput: The trace is infinite, there is a sequence, N <= 1 / rho, or a robot starts in two regions.
            Unsatisfiable: Nothing that these robots can fly satisfies the formula.
            Infeasible: No way between the hoops was found.
        """
        if mission.spec.trace == "infinite":
            raise BadInput("online MTAC-E shares tasks that end; an infinite trace is flown from a plan, by `ltlplan run`.")
        if mission.sequence is not None:
            raise BadInput("online MTAC-E chooses what is flown; a sequence is flown exactly from a plan, by `ltlplan run`.")
        self.mission, self.rng, self.every_order = mission, rng, every_order
        self.settings = settings or OnlineSettings(
            elite=mission.planner.elite, trajectories=mission.planner.samples, window=WINDOW, floor=FLOOR
        )
        self.world = World(mission)
        self.reader = Reader(self.world)
        self.pilots = {n: Pilot(mission, self.world, n, self.world.start(n), self.settings) for n in mission.agents}
        held = {name: self.world.letter(pilot.where) for name, pilot in self.pilots.items()}
        self.belief = at_start(self.reader, held, reading=mission.spec.team)
        self.first_letters = held
        self.shown: list[tuple[float, dict[str, Letter]]] = []
        self.holding: str | None = None
        self.steps = 0
        self._replan = False
        self._handover: Handover | None = None
        self._stuck: dict[str, float] = {}
        self._first: list[str] = list(self.pilots)
        self._moved_at = 0.0
        self._led: set[tuple[str, Point]] = set()
        self._said: list[str] = []
        self._begin = 0
        self.allocate()

    @property
    def distance(self) -> float:
        """M between robots' centres that they keep in flight, from where they should be."""
        return self.mission.separation + CLEARANCE

    @property
    def cost(self) -> float:
        """The summed cost of the best paths that are known for all robots."""
        return float(sum(pilot.best_cost for pilot in self.pilots.values()))

    @property
    def complete(self) -> bool:
        """Whether every robot has a path for all that is left, and that satisfies the formula."""
        return self.holding is None and can_finish(self.belief, self._ahead())

    def _ahead(self) -> dict[str, tuple[Letter, ...]]:
        return {name: pilot.ahead for name, pilot in self.pilots.items()}

    def allocate(self) -> None:
        """Make a satisfying run from where the team is and give its tasks to the cheapest robots (lines 1 to 4).

        All robots must be hovering. On success `holding` is None.

        Raises:
            Unsatisfiable: Nothing that is left satisfies the formula; robots keep hovering, `holding` says so.
            Infeasible: A task has no way that keeps clear.
        """
        for pilot in self.pilots.values():
            pilot.take(RobotTask(pilot.where), self.plan_for(pilot, RobotTask(pilot.where)), self.rng)
        blocked: set[tuple[str, tuple]] = set()
        try:
            for _ in range(MAX_ATTEMPTS):
                tasks = share_out(self, blocked)
                problem = self._laid(tasks)
                if problem is None:
                    self.holding, self._begin = None, self.steps + SEARCH_STEPS
                    return
                blocked.add(problem)
            raise Infeasible(f"No way was found for {MAX_ATTEMPTS} ways to share what is left.")
        except (Unsatisfiable, Infeasible) as error:
            self.holding = str(error)
            raise

    def step(self, now: float, positions: Mapping[str, Point]) -> Desired:
        """Do one step of Algorithm 5.

        Args:
            now: Flight time, s.
            positions: Measured position of each robot in the air, m.

        Returns:
            Where each robot in the air should be, in the mission's order.
        """
        self._see(now, positions)
        self._shared_again(now)
        self._said = list(self._switch(now))
        going = self._permitted(now)
        searching = self._searching()
        paths = min(MOST_PATHS, PATHS // max(len(searching), 1))
        for name, pilot in self.pilots.items():
            if self.holding is None and name in searching:
                others = self._standing_still(name)
                pilot.search(now, self.rng, paths, others, self.distance)
            pilot.clock = pilot.clock.after(PERIOD, going[name]) if not pilot.arrived else pilot.clock
        self._give_up_if_stuck(now)
        self.steps += 1
        flat = np.zeros((5, 4, len(self.pilots)))
        for j, (name, pilot) in enumerate(self.pilots.items()):
            flat[:, :3, j] = pilot.course.flat(pilot.clock, now)
            flat[0, 3, j] = self.mission.agents[name].yaw
        satisfied = self.belief.accepts()
        finished = satisfied and all(p.done and p.arrived for p in self.pilots.values())
        return Desired(flat, satisfied, finished, self.holding, tuple(self._said))

    def change(self, event: WorldEvent, now: float) -> None:
        """Take note of a change in the world: progress is kept, robots wait, and what is left is shared again.

        Args:
            event: What has changed.
            now: Flight time, s.
        """
        self.mission = event.apply(self.mission)
        self.world = World(self.mission)
        self.reader = Reader(self.world)
        if isinstance(event, RobotLeaves):
            del self.pilots[event.robot]
        if isinstance(event, RobotJoins):
            where = self.world.start(event.robot)
            self.pilots[event.robot] = Pilot(self.mission, self.world, event.robot, where, self.settings)
            self.first_letters = {**self.first_letters, event.robot: self.world.letter(where)}
            self._first.append(event.robot)
        for pilot in self.pilots.values():
            pilot.mission, pilot.world = self.mission, self.world
            # a ring that has moved is not where the course goes
            pilot.stop = isinstance(event, HoopMoves) and bool(pilot.moves) and pilot.moves[0].visit.region == event.region
        # the whole flown word counts: the new automaton reads it from its beginning
        self.belief = at_start(self.reader, self.first_letters, reading=self.mission.spec.team)
        for _, events in self.shown:
            self.belief = after_events(self.belief, events)
        # no matter how: that is known at once, whatever else turns out when what is left is shared
        lost = ", and what was flown cannot be completed to satisfy what is asked now" if DEAD in self.belief.states else ""
        self.hold(f"at {now:.2f} s {event}{lost}")

    def hold(self, reason: str) -> None:
        """Let everybody wait on their courses; what is left is shared again once all have come to rest."""
        self.holding, self._replan, self._handover = f"Waiting: {reason}.", True, None

    def give_up(self, reason: str) -> None:
        """Let everybody hover for good."""
        self.holding, self._replan, self._handover = reason, False, None

    def _shared_again(self, now: float) -> None:
        """Share what is left when all robots hover; where that cannot be done they go on hovering, and say why."""
        if not self._replan or not all(self.rests(pilot, now) for pilot in self.pilots.values()):
            return
        self._replan = False
        for pilot in self.pilots.values():
            self.root(pilot, now)
        if not self.pilots:
            self.holding = "No robot is left in the air."
            return
        self.holding = None
        try:
            self.allocate()
        except LtlplanError as error:
            self.holding = self.holding or str(error)

    def rests(self, pilot: Pilot, now: float) -> bool:
        """Tell whether a robot hovers, so that it can begin another course."""
        if self._replan and pilot.entered and not pilot.stop and not pilot.arrived:
            return False
        return (pilot.arrived or pilot.clock.resting) and not pilot.course.gliding(now)

    def root(self, pilot: Pilot, now: float) -> None:
        """Let a robot's state be where it hovers, so that its next course begins without a jump."""
        x, y, z = (float(v) for v in pilot.course.flat(pilot.clock, now)[0])
        pilot.where = replace(pilot.where, position=(x, y, z))

    # -- what was flown ------------------------------------------------------------------------------------

    def _see(self, now: float, positions: Mapping[str, Point]) -> None:
        """Label the robots, let them act where they are to, and take note of what has changed."""
        events, inside = self._labelled(positions)
        if not events:
            return
        self._note(now, events)
        names = sorted(events)
        unforeseen = [name for name in names if not self.pilots[name].observe(events[name], inside[name])]
        for name in unforeseen:
            self.pilots[name].surprised(inside[name])
        # what was foreseen was asked for at the gate
        if unforeseen and self.holding is None and not can_finish(self.belief, self._ahead()):
            seen_by = ", ".join(unforeseen)
            self.hold(f"at {now:.2f} s {seen_by} showed letters after which the plan cannot be finished")

    def _note(self, now: float, events: dict[str, Letter]) -> None:
        """Remember letters that have changed, and where they lead."""
        self.shown.append((now, events))
        self.belief = after_events(self.belief, events)

    def _labelled(self, positions: Mapping[str, Point]) -> tuple[dict[str, Letter], dict[str, str | None]]:
        """Return the letters that have changed, and the region that each robot is in; planned actions happen here."""
        events: dict[str, Letter] = {}
        inside: dict[str, str | None] = {}
        where = self.world.regions_at(np.array([positions[name] for name in self.pilots], dtype=np.float64).reshape(-1, 3))
        for (name, pilot), here in zip(self.pilots.items(), where, strict=True):
            x, y, z = (float(v) for v in positions[name])
            inside[name] = here
            target = pilot.wants_to_act() if here is not None else None
            pilot.where = AgentState(
                (x, y, z),
                here if target is not None else pilot.where.inside,
                pilot.where.vertex,
                pilot.where.internal if target is None else target,
            )
            letter = self.world.free_letter(pilot.where.internal) | (frozenset() if here is None else {here})
            if letter != self.belief.held[name]:
                events[name] = letter
        return events, inside

    # -- who may go ----------------------------------------------------------------------------------------

    def _permitted(self, now: float) -> dict[str, bool]:
        """Tell which robots may go on along their courses in this step."""
        if self.holding is not None:
            # who is in a passage finishes it first: inside a ring is no place to wait
            return {name: self._replan and pilot.entered and not pilot.stop for name, pilot in self.pilots.items()}
        going = self._clear_of_each_other(now)
        if self.steps < self._begin:
            return dict.fromkeys(going, False)
        if self._handover is not None:
            going[self._handover.giver] = False
        for name, pilot in self.pilots.items():
            if going[name] and pilot.comes_to_region(PERIOD):
                pilot.entered = self._admitted(name)
                going[name] = pilot.entered
        return going

    def _admitted(self, name: str) -> bool:
        """Ask the gate whether this robot may begin its passage while others are in theirs."""
        inside = {n: p.chain for n, p in self.pilots.items() if n == name or p.entered}
        rest = {n: p.rest if n in inside else p.ahead for n, p in self.pilots.items()}
        return admits(self.belief, inside, rest)

    def _clear_of_each_other(self, now: float) -> dict[str, bool]:
        """Let robots wait that would come too near to one that has priority; priorities change when nobody can go."""
        names = [name for name in self._first if name in self.pilots]
        going = dict.fromkeys(names, True)
        moving = [name for name in names if not self.pilots[name].arrived]
        if len(names) < 2 or not moving:
            return going
        horizon = np.arange(1, 9) * (LOOK_AHEAD / 8)
        least = self.distance
        held = np.stack([self.pilots[n].future(horizon, go=False) for n in names])
        gone = np.stack([self.pilots[n].future(horizon, go=True) if n in moving else held[i] for i, n in enumerate(names)])
        chosen = held.copy()
        for i, name in enumerate(names):
            if name not in moving:
                continue
            others = np.arange(len(names)) != i
            away = _distance(gone[i], chosen[others])
            stay = _distance(held[i], chosen[others])
            # where standing still is no better, going is the way out
            if away.min() >= least or away.min() >= stay.min():
                chosen[i] = gone[i]
            else:
                going[name] = False
        waiting = [n for n in moving if not going[n] and self.pilots[n].clock.resting]
        self._stuck = {n: self._stuck.get(n, now) for n in waiting}
        if waiting and len(waiting) == len(moving) and now - min(self._stuck.values()) > PATIENCE:
            self._stuck = {}
            said = make_way(self, waiting, now, self._led)
            if said is not None:
                self._said.append(said)
            else:
                self._first = self._first[1:] + self._first[:1]
        return going

    def _searching(self) -> set[str]:
        """Return whose paths are sampled in this step: all robots that are under way, or so many of them in turn."""
        open_ = [name for name, pilot in self.pilots.items() if not pilot.arrived]
        first = self.steps * SEARCHES % max(len(open_), 1)
        return {open_[(first + i) % len(open_)] for i in range(min(SEARCHES, len(open_)))}

    def _give_up_if_stuck(self, now: float) -> None:
        """Say so when nobody has moved for long although something is left to do."""
        waiting = [n for n, p in self.pilots.items() if not p.arrived and p.clock.resting]
        moving = [n for n, p in self.pilots.items() if not p.arrived and not p.clock.resting]
        if moving or not waiting or self.holding is not None:
            self._moved_at = now
        elif now - self._moved_at > STUCK:
            self.give_up(f"For {STUCK:.0f} s {', '.join(waiting)} had no way past the others; the robots hold their positions.")

    def _standing_still(self, name: str) -> Floats:
        """Positions of the other robots that have nothing left to fly. Shape (n, 3)."""
        still = [p.course.new[-1] for n, p in self.pilots.items() if n != name and p.arrived]
        return np.array(still).reshape(-1, 3)

    # -- who does what -------------------------------------------------------------------------------------

    def left(self) -> Mission:
        """Return what is left as a mission of its own, from where the robots hover.

        Raises:
            Unsatisfiable: Nothing that comes can make the formula true.
        """
        agents = {name: self.agent(pilot) for name, pilot in self.pilots.items()}
        return mission_left(self.mission, agents, self.reader, self.first_letters, self.shown)

    def agent(self, pilot: Pilot) -> Agent:
        """Return a robot as it hovers now, with what it brings from before."""
        where = pilot.where
        been = where.vertex if where.inside is None and where.vertex in self.mission.all_regions else None
        return self.mission.agents[pilot.name].model_copy(
            update={"start": where.position, "internal": where.internal, "visited": been}
        )

    def keeps(self, ahead: Mapping[str, tuple[Letter, ...]]) -> bool:
        """Tell whether the team can finish by these letters: in some order from now on, or if asked, in every order from the start."""
        if not self.every_order:
            return can_finish(self.belief, ahead)
        return self.reader.holds_in_every_order({robot: (*self.word(robot), *letters) for robot, letters in ahead.items()})

    def word(self, robot: str) -> list[Letter]:
        """Return the letters that a robot has shown so far."""
        return [self.first_letters[robot], *(events[robot] for _, events in self.shown if robot in events)]

    def _laid(self, tasks: Mapping[str, RobotTask]) -> tuple[str, tuple] | None:
        """Give robots their tasks and courses; return a task that has no way, if there is one."""
        plans = {}
        for name, task in tasks.items():
            try:
                plans[name] = self.plan_for(self.pilots[name], task)
            except Infeasible:
                return name, task.moves
        for name, task in tasks.items():
            self.pilots[name].take(task, plans[name], self.rng)
        return None

    def plan_for(self, pilot: Pilot, task: RobotTask, around: Iterable[Point] = ()) -> RobotPlan:
        """Lay the way of one robot from where it hovers, around places where others do.

        Raises:
            Infeasible: There is none.
        """
        word = Word((self.world.letter(pilot.where), *task.ahead(self.world)))
        visits = task.visits if task.moves else ()
        return led_around(self.mission, pilot.name, pilot.where.position, visits, word, around, self.distance)

    def _may_change(self, handover: Handover) -> bool:
        if not may_change(self.world, self.reader, self.belief, self.pilots, handover):
            return False
        tasks = handover.tasks(self.world, self.pilots) if self.every_order else {}
        return not tasks or self.keeps({**self._ahead(), **{name: task.ahead(self.world) for name, task in tasks.items()}})

    def _switch(self, now: float) -> tuple[str, ...]:
        """Let a task that nobody has begun change hands where that is clearly cheaper (lines 15 to 17)."""
        if self.holding is not None:
            return ()
        if self._handover is None and self.steps % SWITCH_STEPS == 0:
            self._handover = better_hands(self.mission, self.world, self.pilots, self._may_change)
        if self._handover is None:
            return ()
        giver, taker = self._handover.giver, self._handover.taker
        one, other = self.pilots[giver], self.pilots[taker]
        if not self._may_change(self._handover):
            self._handover = None  # it went on before it could stop, or another robot has changed what may be divided
            return ()
        if not (self.rests(one, now) and self.rests(other, now)):
            return ()
        self.root(one, now)
        self.root(other, now)
        tasks = self._handover.tasks(self.world, self.pilots)
        self._handover = None
        if self._laid(tasks) is not None:
            self.hold(f"at {now:.2f} s a task could not change hands from {giver} to {taker}")
            return ()
        regions = ", ".join(move.visit.region for move in tasks[taker].moves)
        return (f"At {now:.2f} s {taker} takes {regions} over from {giver}.",)


WINDOW, FLOOR = 12, 0.2
"""Elites that a row's Gaussian is fitted to, and the least standard deviation of its coordinates (the first one is 1)."""

CLEARANCE = 0.08
"""m that robots keep beyond the mission's separation, for what the vehicles do not follow."""

MAX_ATTEMPTS = 20
"""Ways to share what is left that are tried when some way between hoops is blocked."""

SEARCHES = 4
"""Robots whose paths are sampled in one step; more take turns, so that a step's time stays bounded."""

PATHS, MOST_PATHS = 72, 64
"""Paths that are sampled in one step, for all robots together and for one robot at most."""


def _distance(path: Floats, others: Floats) -> Floats:
    """Distances of a path from others at the same instants. Shapes (n, 3), (k, n, 3) to (k, n)."""
    return np.sqrt(np.sum((others - path) ** 2, axis=-1))
