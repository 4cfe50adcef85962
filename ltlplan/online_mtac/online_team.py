"""Online MTAC-E: tasks are shared and paths are improved while the robots fly (2022 paper, Algorithm 5).

`OnlineTeam.step` is called 50 times a second with measured positions and returns what each robot should do now. As in the
paper, a satisfying run is made at the first step; whoever is cheapest gets each part of it; paths are sampled for each robot by
online cross-entropy; the flag says when the formula is satisfied. What the printed algorithm leaves open:

* The run is made by the exact search with straight lines for costs, so that robots can go within a second. The switch
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

from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np
from numpy.random import Generator

from ltlplan.allocation import Allocation, Leg
from ltlplan.mtac.agent_moves import RobotTask
from ltlplan.online_mtac.cross_entropy import OnlineSettings
from ltlplan.online_mtac.deadlock_resolution import clear_ahead, make_way
from ltlplan.online_mtac.initial_allocation import left_of, share_out
from ltlplan.online_mtac.pilot import PilotedTeam
from ltlplan.online_mtac.possible_states import admits, can_finish
from ltlplan.online_mtac.task_switching import Handover, better_hands, may_change
from ltlplan.online_mtac.team_in_flight import PERIOD, Desired
from ltlplan.search.lawler import Partition
from verify.data import Infeasible, Mission, Unsatisfiable
from verify.data.events import HoopMoves, RobotJoins, WorldEvent
from verify.data.shapes.inequalities import Point

SEARCH_STEPS = 50
"""Steps that robots hover after tasks were shared, while their paths improve most: 1 s."""

SWITCH_STEPS = 25
"""Steps between two looks at the switch condition."""

PATIENCE = 3.0
"""s that two robots wait for each other before the other one goes first."""

STUCK = 12.0
"""s without any motion after which a team that has something left to do gives up."""


class OnlineTeam(PilotedTeam):
    """A team in flight under online MTAC-E. It changes with each step."""

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
            BadInput: The trace is infinite, there is a sequence, or N <= 1 / rho.
            Unsatisfiable: Nothing that these robots can fly satisfies the formula.
            Infeasible: No way between the hoops was found.
        """
        chosen = settings or OnlineSettings(
            elite=mission.planner.elite, trajectories=mission.planner.samples, window=WINDOW, floor=FLOOR
        )
        super().__init__(mission, chosen, rng=rng, every_order=every_order)
        self._stuck: dict[str, float] = {}
        self._first: list[str] = list(self.pilots)
        self._moved_at = 0.0
        self._led: set[tuple[str, Point]] = set()
        self._said: list[str] = []
        self._begin = 0
        self.allocate()

    @property
    def cost(self) -> float:
        """The summed cost of the best paths that are known for all robots."""
        return float(sum(pilot.way.best_cost for pilot in self.pilots.values()))

    @property
    def complete(self) -> bool:
        """Return whether every robot has a path for all that is left, and that satisfies the formula."""
        return self.holding is None and can_finish(self.belief, self.ahead())

    def allocate(self) -> None:
        """Make a satisfying run from where the team is and give its tasks to the cheapest robots (lines 1 to 4).

        All robots must be hovering. On success `holding` is None.

        Raises:
            Unsatisfiable: Nothing that is left satisfies the formula; robots keep hovering, `holding` says so.
            Infeasible: A task has no way that keeps clear.
        """
        self._handover: Handover | None = None
        for pilot in self.pilots.values():
            pilot.take(RobotTask(pilot.where), self.plan_for(pilot, RobotTask(pilot.where)), self.rng)
        blocked = ""

        def part(shut: frozenset[Leg], found: tuple[Allocation, object]) -> Iterator[frozenset[Leg]]:
            legs = found[0].robots[blocked].legs(left_of(self), blocked)
            return (shut | {leg} for leg in sorted(legs, key=str))

        try:
            for _, _, _, (_, tasks) in Partition([frozenset[Leg]()], partial(share_out, self), part, searches=MAX_ATTEMPTS):
                problem = self._laid(tasks)
                if problem is None:
                    self.holding, self._begin = None, self.steps + SEARCH_STEPS
                    return
                blocked = problem
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
        self.share_again(now)
        self._said = list(self._switch(now))
        going = self._permitted(now)
        searching = self._searching()
        paths = min(MOST_PATHS, PATHS // max(len(searching), 1))
        for name, pilot in self.pilots.items():
            if self.holding is None and name in searching:
                still = [p.way.course.new[-1] for n, p in self.pilots.items() if n != name and p.way.arrived]
                pilot.way.search(now, self.rng, paths, np.array(still).reshape(-1, 3), self.distance)
            pilot.way.clock = pilot.way.clock.after(PERIOD, going[name]) if not pilot.way.arrived else pilot.way.clock
        self._give_up_if_stuck(now)
        self.steps += 1
        flat = np.zeros((5, 4, len(self.pilots)))
        for j, (name, pilot) in enumerate(self.pilots.items()):
            flat[:, :3, j] = pilot.way.course.flat(pilot.way.clock, now)
            flat[0, 3, j] = self.mission.agents[name].yaw
        satisfied = self.belief.accepts()
        finished = satisfied and all(p.done and p.way.arrived for p in self.pilots.values())
        return Desired(flat, satisfied, finished, self.holding, tuple(self._said))

    def change(self, event: WorldEvent, now: float) -> None:
        """Take note of a change in the world: progress is kept, robots wait, and what is left is shared again.

        Args:
            event: What has changed.
            now: Flight time, s.
        """
        super().change(event, now)
        if isinstance(event, RobotJoins):
            self._first.append(event.robot)
        for pilot in self.pilots.values():
            pilot.way.mission, pilot.world = self.mission, self.world
            # a ring that has moved is not where the course goes
            pilot.stop = isinstance(event, HoopMoves) and bool(pilot.moves) and pilot.moves[0].visit.region == event.region

    # -- what was flown ------------------------------------------------------------------------------------

    def _see(self, now: float, positions: Mapping[str, Point]) -> None:
        """Label the robots, let them act where they are to, and take note of what has changed."""
        events, inside = self.labelled(positions)
        if not events:
            return
        self.note(now, events)
        names = sorted(events)
        unforeseen = [name for name in names if not self.pilots[name].observe(events[name], inside[name])]
        for name in unforeseen:
            self.pilots[name].surprised(inside[name])
        # what was foreseen was asked for at the gate
        if unforeseen and self.holding is None and (self.world.overlaps or not can_finish(self.belief, self.ahead())):
            seen_by = ", ".join(unforeseen)
            self.hold(f"at {now:.2f} s {seen_by} showed letters after which the plan cannot be finished")

    # -- who may go ----------------------------------------------------------------------------------------

    def _permitted(self, now: float) -> dict[str, bool]:
        """Tell which robots may go on along their courses in this step."""
        if self.holding is not None:
            # who is in a passage finishes it first: inside a ring is no place to wait
            return {name: self.waits_to_share and pilot.entered and not pilot.stop for name, pilot in self.pilots.items()}
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
        moving = [name for name in names if not self.pilots[name].way.arrived]
        if len(names) < 2 or not moving:
            return going
        going |= clear_ahead(self, names, moving)
        waiting = [n for n in moving if not going[n] and self.pilots[n].way.clock.resting]
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
        open_ = [name for name, pilot in self.pilots.items() if not pilot.way.arrived]
        first = self.steps * SEARCHES % max(len(open_), 1)
        return {open_[(first + i) % len(open_)] for i in range(min(SEARCHES, len(open_)))}

    def _give_up_if_stuck(self, now: float) -> None:
        """Say so when nobody has moved for long although something is left to do."""
        waiting = [n for n, p in self.pilots.items() if not p.way.arrived and p.way.clock.resting]
        moving = [n for n, p in self.pilots.items() if not p.way.arrived and not p.way.clock.resting]
        if moving or not waiting or self.holding is not None:
            self._moved_at = now
        elif now - self._moved_at > STUCK:
            self.give_up(f"For {STUCK:.0f} s {', '.join(waiting)} had no way past the others; the robots hold their positions.")

    # -- who does what -------------------------------------------------------------------------------------

    def _laid(self, tasks: Mapping[str, RobotTask]) -> str | None:
        """Give robots their tasks and courses; return a robot whose task has no way, if there is one."""
        plans = {}
        for name, task in tasks.items():
            try:
                plans[name] = self.plan_for(self.pilots[name], task)
            except Infeasible:
                return name
        for name, task in tasks.items():
            self.pilots[name].take(task, plans[name], self.rng)
        return None

    def _may_change(self, handover: Handover) -> bool:
        if not may_change(self.world, self.reader, self.belief, self.pilots, handover):
            return False
        tasks = handover.tasks(self.world, self.pilots) if self.every_order else {}
        return not tasks or self.keeps({**self.ahead(), **{name: task.ahead for name, task in tasks.items()}})

    def _switch(self, now: float) -> tuple[str, ...]:
        """Let a task that nobody has begun change hands where that is clearly cheaper (lines 15 to 17)."""
        if self.holding is not None:
            return ()
        if self._handover is None and self.steps % SWITCH_STEPS == 0:
            self._handover = better_hands(self.mission, self.pilots, self._may_change)
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
        if not tasks or self._laid(tasks) is not None:
            self.hold(f"at {now:.2f} s a task could not change hands from {giver} to {taker}")
            return ()
        regions = ", ".join(move.visit.region for move in tasks[taker].moves)
        return (f"At {now:.2f} s {taker} takes {regions} over from {giver}.",)


WINDOW, FLOOR = 12, 0.2
"""Elites that a row's Gaussian is fitted to, and the least standard deviation of its coordinates (the first one is 1)."""

MAX_ATTEMPTS = 20
"""Ways to share what is left that are tried when some way between hoops is blocked."""

SEARCHES = 4
"""Robots whose paths are sampled in one step; more take turns, so that a step's time stays bounded."""

PATHS, MOST_PATHS = 72, 64
"""Paths that are sampled in one step, for all robots together and for one robot at most."""
