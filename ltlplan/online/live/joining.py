"""A robot that joins a team in flight: it waits on the ground, climbs while all others hover, and takes part from when it hovers at its start.

Its climb is no part of the flight's claim, as no take-off is; it is proved by itself, with all robots. The newcomer is one of the team from the instant
at which it hovers at its start (`RobotJoins`, with `climbs` saying when it left the ground). Until then it shows no region, so its start must be
clear of every region, in the world as it ever was in this flight: nothing that it had shown before it was there may satisfy anything.

| step | what happens | what ends it without harm |
|---|---|---|
| `brakes` | all others come to rest in a proved way, as for every event | it stays on the ground |
| `asks` | its climb is planned and proved beside the flight | there is no way, or no proof: it stays |
| `waits` | all hover; it is looked at for half a second, and checked as before take-off | a check fails: it stays |
| `wakes` | it is armed where it has to be; its motors may turn | it does not answer, or moved: its motors are stopped |
| `climbs` | all fly the proved climb, and the way where there is one, under one watch | it is lost, or leaves its margin, or a solid body or a rim moved: it lands where it is, not certified, and the others wait until it is down |

Whatever ends it, the team goes on without it, and a sentence says why. Alarms that concern others, a lost link and Ctrl-C end the flight of all:
then it is brought down with them from the moment its motors may turn. Events that come meanwhile are taken as ever; before it moves
the climb is asked for anew in the world as it is then. One robot joins at a time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Literal

from flight.exports.scripts.flying.checks import refusals
from flight.link.link import LinkLost
from flight.link.live_executive import SETTLE
from flight.link.phases import Part
from flight.link.preflight_checks import at_start
from ltlplan.online.event_queue import TOO_LATE, Told
from ltlplan.online.live.executors import Answer, way_up
from ltlplan.online.live.flight_session import InAir, result_of
from ltlplan.online.live.leaving import Leaving
from ltlplan.online.standby import Lookout, Standby
from ltlplan.transfers import Place, Solo
from verify.data import LtlplanError, Mission
from verify.data.events import HoopMoves, ObstacleAppears, RobotJoins, RobotLeaves, WorldEvent
from verify.data.sections import Agent
from verify.data.shapes.inequalities import point_of
from verify.flight_segments import Piece

PATIENCE = 5.0
"""s that a newcomer has to be ready, and that the others have to hover quietly enough."""

Step = Literal["brakes", "asks", "waits", "wakes", "climbs"]


@dataclass
class _Newcomer:
    """Robot that joins now, and the progress of its joining.

    Attributes:
        event: As it was told.
        told: Who told it.
        place: Where it stands, m.
        step: As above.
        since: When that began, s of the link's clock.
        ways: What it flies: its climb, and perhaps a way.
        number: Under which what it flies next is stored.
        climbs: When it left the ground, s of the flight.
    """

    event: RobotJoins
    told: Told
    place: Place
    step: Step
    since: float
    ways: tuple[Solo, ...] = ()
    number: int = -1
    climbs: float = math.nan

    @property
    def robot(self) -> str:
        """Its name."""
        return self.event.robot


@dataclass
class Joining:
    """Robots that wait on the ground, and the one that joins.

    Attributes:
        air: The team.
        standby: Who waits, the one that joins included until it moves.
        agents: All who ever take part, or may.
        lasts: s for which a newcomer's battery must last, beside its climb.
        newcomer: Who joins now; None where nobody does.
        gave_up: Whether somebody did not come to join, and the team was not asked to go on since.
        lookout: Looks where those are that wait.
    """

    air: InAir
    standby: Standby
    agents: Mapping[str, Agent]
    lasts: float
    newcomer: _Newcomer | None = None
    gave_up: bool = False
    lookout: Lookout = field(default_factory=Lookout)

    def solid(self, mission: Mission, but: str = "") -> Mission:
        """Return a mission with a solid body for each robot on the ground: those that wait, one left out, and those that left, where they lie.

        Args:
            mission: The world without them.
            but: Who is left out.
        """
        seen = [(one, self.air.link.pose(one.robot)) for one in self.air.leaving]
        places = {one.robot: (*pose.position[:2], one.ground) for one, pose in seen if pose is not None}
        left = Standby({robot: self.agents[robot] for robot in places}, places)
        return left.solid(self.standby.without((but,)).solid(mission))

    @property
    def moves(self) -> bool:
        """True if a robot climbs, or its motors may turn."""
        return self.newcomer is not None and self.newcomer.step in ("wakes", "climbs")

    @property
    def astray(self) -> str:
        """Reason why the climbing robot cannot go on, though the others can; empty where it can."""
        if self.newcomer is None or self.newcomer.step != "climbs":
            return ""
        robot, watch = self.newcomer.robot, self.air.watch
        lost, why = watch.lost() or ("", "")
        return watch.outside(robot) or (why if lost == robot else "")

    def begin(self, event: RobotJoins, told: Told) -> None:
        """Have a robot join; all others are to come to rest now.

        Args:
            event: Who, and where to.
            told: Who told it, and hears what came of it.
        """
        self.newcomer = _Newcomer(event, told, self.standby.places[event.robot], "brakes", self.air.link.now())

    def at_rest(self) -> None:
        """Ask for a climb, now that it is known where all others come to rest; one that goes on already goes on."""
        if self.newcomer is None or self.moves:
            return
        air, event, present = self.air, self.newcomer.event, self.air.present
        agents = {**present.mission.agents, event.robot: event.agent}
        world = self.solid(present.mission.model_copy(update={"agents": agents}), but=event.robot)
        self._goes("asks")
        air.ask(way_up, (world, event.robot, self.newcomer.place, present.team), self._found)

    def world_changes(self, event: WorldEvent) -> None:
        """Take in that something else happens: what moves through a world that changed in its body was not proved in it.

        Args:
            event: What happens.
        """
        newcomer, mission = self.newcomer, self.air.team.mission
        if newcomer is None:
            return
        solid = isinstance(event, ObstacleAppears) or (
            isinstance(event, HoopMoves) and event.region in {**mission.obstacles, **mission.hoops}
        )
        if self.moves and (solid or (newcomer.step == "wakes" and isinstance(event, RobotLeaves))):
            self.give_up(f"{event}, and its climb was proved without that.")
        elif not self.moves:
            self._goes("brakes")

    def go_on(self) -> RobotJoins | None:
        """Do what is next; return the event by which it joins, once it hovers at its start.

        Nothing is asked when this is called, and whoever calls says then whether it has joined (`joined`), or may not (`give_up`).
        """
        newcomer = self.newcomer
        if newcomer is None:
            return None
        match newcomer.step:
            case "waits":
                self._wait(newcomer)
            case "wakes":
                self._wake(newcomer)
            case "climbs":
                return self._climb(newcomer)
            case _:
                pass
        return None

    def give_up(self, why: str) -> None:
        """Let nobody join; who moves is brought to the ground where it is, while the others hover.

        Args:
            why: A sentence.
        """
        newcomer, air, now = self.newcomer, self.air, self.air.link.now()
        if newcomer is None:
            return
        self.newcomer, self.gave_up, air.climb = None, True, None
        robot, ground = newcomer.robot, newcomer.place[2]
        stays = {"wakes": "its motors are stopped", "climbs": "it lands where it is"}.get(
            newcomer.step, "it stays on the ground"
        )
        sentence = f"{robot} does not join, {stays}: {why}"
        air.note(sentence, robot, "reaction")
        newcomer.told.answer(False, sentence)
        if newcomer.step == "climbs":
            air.leaving.append(Leaving(robot, ground))
            air.watch_again()
        elif newcomer.step == "wakes":
            air.leaving.append(Leaving(robot, ground, asked=now, down=now))
        if newcomer.step in ("wakes", "climbs"):
            self.standby = self.standby.without((robot,))

    def joined(self, sentence: str) -> None:
        """Take the newcomer for one of the team.

        Args:
            sentence: What whoever told of it hears.
        """
        assert self.newcomer is not None, "somebody joins"
        self.newcomer.told.answer(True, sentence)
        self.newcomer = self.air.climb = None

    def end(self) -> None:
        """Answer who told of a robot that did not come to join."""
        if self.newcomer is not None:
            self.newcomer.told.answer(False, f"{self.newcomer.event}: {TOO_LATE}")
            self.newcomer = None

    # -- one step after the other ----------------------------------------------------------------------------

    def _goes(self, step: Step) -> None:
        assert self.newcomer is not None, "somebody joins"
        self.newcomer.step, self.newcomer.since = step, self.air.link.now()

    def _found(self, answer: Answer) -> None:
        """Take in that there is a climb, or none."""
        assert self.newcomer is not None, "somebody joins"
        try:
            self.newcomer.ways = result_of(answer)
        except LtlplanError as error:
            self.give_up(f"no climb is certified: {error}")
            return
        self._goes("waits")

    def _wait(self, newcomer: _Newcomer) -> None:
        """Check everybody once all hover and nobody is on the way down."""
        air, robot, now = self.air, newcomer.robot, self.air.link.now()
        down = max((math.inf if one.down is None else one.down for one in air.leaving), default=-math.inf)
        quiet = max(newcomer.since, air.began + float(air.present.end) + SETTLE)
        if now < max(quiet, down):
            return
        stage = self._part(newcomer.ways[0])
        hover = _not_at_start(air, stage, but=robot)
        if hover and now - max(quiet, down) <= PATIENCE:
            return
        lasts = self.lasts + sum(way.part.duration for way in newcomer.ways)
        checks = self.lookout.checks(air.link, stage, robot, lasts)
        for check in checks:
            air.note(check.sentence, check.robot, "check")
        if failed := [*hover, *refusals(checks, air.flying.unchecked)]:
            self.give_up(f"{'; '.join(failed)}.")
            return
        try:
            air.link.upload(robot, air.flying.number, stage.paths[robot])
        except LinkLost as error:
            self.give_up(str(error))
            return
        newcomer.number = air.flying.store(stage.paths)
        air.flying.grounded = (*air.flying.grounded, robot)
        self._goes("wakes")

    def _wake(self, newcomer: _Newcomer) -> None:
        """Have it ready, and begin its climb."""
        air, robot, now = self.air, newcomer.robot, self.air.link.now()
        stage = self._part(newcomer.ways[0])
        moved = [check.sentence for check in at_start(air.link, stage) if check.robot == robot and not check.passed]
        others = _not_at_start(air, stage, but=robot)
        if not air.link.ready(robot, newcomer.number):
            others.append(f"{robot} does not make ready to fly")
        if moved or (others and now - newcomer.since > PATIENCE):
            self.give_up(f"{'; '.join(moved or others)}.")
        if moved or others:
            return
        air.flying.robots = (*air.flying.robots, robot)  # first: from here on it has to land
        newcomer.climbs = self._fly(newcomer)
        air.flying.grounded = tuple(name for name in air.flying.grounded if name != robot)

    def _fly(self, newcomer: _Newcomer) -> float:
        """Begin a proved flight of all in which only the newcomer moves; return when, s of the flight."""
        air, way = self.air, newcomer.ways[0]
        begin = air.link.start(newcomer.number)
        air.number = newcomer.number
        air.record.starts[f"{newcomer.robot} {way.name}"] = begin
        start = Fraction(begin - air.began)
        air.climb = Piece(start, start, way.mission, way.team)
        self._goes("climbs")
        self.standby = self.standby.without((newcomer.robot,))
        air.watch_again()
        return float(start)

    def _part(self, way: Solo) -> Part:
        """Return a flight as those begin it who are in the air still: who left is told nothing more."""
        return replace(way.part, paths={name: path for name, path in way.team.items() if name not in self.air.gone})

    def _climb(self, newcomer: _Newcomer) -> RobotJoins | None:
        """Fly on where it has come to an end; return the event where it was the last one."""
        air = self.air
        assert air.climb is not None, "it climbs"
        way, *following = newcomer.ways
        ended = float(air.climb.end)
        if air.now < ended + SETTLE:
            return None
        air.record.ends.setdefault(f"{newcomer.robot} {way.name}", air.began + ended)
        if not following:
            path = way.team[newcomer.robot]
            agent = newcomer.event.agent.model_copy(update={"start": point_of(path.evaluate(path.duration)[:3])})
            return replace(newcomer.event, agent=agent, climbs=newcomer.climbs)
        next_part = self._part(following[0])
        if faults := _not_at_start(air, next_part):
            if air.now > ended + SETTLE + PATIENCE:
                self.give_up(f"{'; '.join(faults)}.")
            return None
        newcomer.ways = tuple(following)
        newcomer.number = air.flying.store(next_part.paths)
        self._fly(newcomer)
        return None


def _not_at_start(air: InAir, stage: Part, but: str = "") -> list[str]:
    """Say who does not hover where a flight begins, one who is not meant left out."""
    return [check.sentence for check in at_start(air.link, stage) if check.robot != but and not check.passed]
