"""Flights in pieces: what a team that was given new tasks in the air shows in all, and where it may come to rest.

A certificate speaks of one flight in one world. When the world changes (a region moves, a formula arrives, a robot leaves),
robots come to rest and go on with another certified flight. The word that counts is the whole one, so the label
timelines of all pieces are put end to end, each in the world as it then was, and checked against the whole formula: what may
have been shown on the way counts as much as what must have been. A piece that was cut short is known by the same bits as
before up to the cut; nothing here rests on measured positions.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from types import MappingProxyType

import numpy as np

from verify.claims.claim import Claim
from verify.claims.distance_claims import Clocks, rim_claims, separation_claims, workspace_claims
from verify.claims.evidence import Evidence
from verify.claims.limit_claims import braking_claims, continuity_claims, endurance_claims, limit_claims
from verify.claims.obstacle_claims import obstacle_claims
from verify.claims.visit_claims import closed_region_claims
from verify.data.errors import BadInput
from verify.data.mission import Mission
from verify.data.plan import Plan
from verify.data.sections import Agent
from verify.data.trajectory import Trajectory
from verify.data.validation.clocks import clock_error_of
from verify.logic.verdict import Verdict
from verify.model_checking.timeline import Change, Enclosure, InternalChange, Relations, Status, Timeline
from verify.model_checking.transitions import judge_transitions
from verify.model_checking.word_claims import judge_formula
from verify.motion.continuity import jumps
from verify.motion.cutting import SHIFT, cut
from verify.motion.leg_windows import ways
from verify.motion.membership.bodies import Mark, Span
from verify.motion.membership.polynomials import membership_polynomials
from verify.motion.membership.statuses import changes, statuses
from verify.motion.paths import read_team
from verify.motion.regions import relations
from verify.motion.visits import match

Approach = tuple[Fraction, Fraction, str]
"""From when until when, exact, in s, a robot may be on its way to a region, and which that is."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A stretch of a flight in one world.

    Attributes:
        start: Flight time at which the trajectories' clocks begin, exact, in s.
        since: Flight time from which the piece counts, until the next one does, exact, in s; not before `start`.
        mission: The world: regions and margin.
        team: Trajectories of the robots in the air.
        actions: For each robot the internal changes that were made, on the trajectories' clocks.
    """

    start: Fraction
    since: Fraction
    mission: Mission
    team: Mapping[str, Trajectory]
    actions: Mapping[str, tuple[InternalChange, ...]] = field(default_factory=dict)

    @property
    def end(self) -> Fraction:
        """Flight time at which the last robot has come to its end, exact, in s."""
        return self.start + max((_duration(t) for t in self.team.values()), default=Fraction(0))


@np.errstate(all="ignore")
def judge_pieces(mission: Mission, pieces: Sequence[Piece]) -> list[Verdict]:
    """Decide whether a flight in pieces satisfies the formula and keeps to the robots' transition systems, for all times.

    Args:
        mission: The whole formula, as it is asked now, and every robot that ever was in the air, as it began.
        pieces: In order of `since`. A robot that is in no later piece has landed: its last letter is held. One that is in
            no earlier piece hovered at its start.

    Returns:
        The verdict on the formula, one on each part that is bounded in seconds, then one on the transitions of each robot.

    Raises:
        BadInput: There is no piece, pieces are not in order of time, or the mission's trace is infinite.
        InternalError: Our progression and Spot disagree: a bug of ours.
        MissingEngine: Spot is absent.
    """
    timelines = timelines_of(mission, pieces)
    if isinstance(timelines, Verdict):
        return [timelines]
    known = relations_of(pieces)
    end = max(timeline.duration for timeline in timelines.values())
    error = clock_error_of(mission, end) if mission.timed_parts else 0.0  # of the clock by which bounds are read
    words = judge_formula(mission, timelines, known, clock_error=Fraction(error))
    return [*words, *judge_transitions(mission, timelines, known)]


@np.errstate(all="ignore")
def timelines_of(mission: Mission, pieces: Sequence[Piece]) -> dict[str, Timeline] | Verdict:
    """Return what each robot may show in a flight in pieces, put end to end; why that cannot be told, where letters change in no order.

    Args:
        mission: As for `judge_pieces`.
        pieces: As for `judge_pieces`.

    Raises:
        BadInput: There is no piece, or pieces are not in order of time.
    """
    if not pieces or any(b.since < a.since for a, b in itertools.pairwise(pieces)):
        raise BadInput("A flight has at least one piece, and its pieces are given in order of time.")
    end, timelines = max(pieces[-1].end, pieces[-1].since), dict[str, Timeline]()
    for robot, agent in mission.agents.items():
        joined = _joined(mission, robot, agent, pieces, end)
        if isinstance(joined, str):
            return Verdict("undecided", joined, robot=robot)
        timelines[robot] = joined
    return timelines


def relations_of(pieces: Sequence[Piece]) -> Relations:
    """Return what is proved of the regions in every world of a flight.

    Args:
        pieces: Of the flight.
    """
    found = [relations(piece.mission) for piece in pieces]
    return Relations(
        frozenset.intersection(*(one.disjoint for one in found)), frozenset.intersection(*(one.nested for one in found))
    )


@np.errstate(all="ignore")
def approaches(plan: Plan, team: Mapping[str, Trajectory]) -> dict[str, tuple[Approach, ...]]:
    """Return for each robot when it may be on its way to each planned visit, as `verify.motion.leg_windows` says, in order of their starts.

    Of certified trajectories, that is every planned visit.
    """
    evidence = Evidence.of(plan, team)
    found: dict[str, tuple[Approach, ...]] = {}
    for robot, spans in statuses(evidence.membership, Fraction(plan.mission.margin)).items():
        matching = match(plan.robots[robot], spans)
        rows = [
            (start, stop, stay.region)
            for visit, stay in enumerate(matching.stays)
            for start, stop in ways(matching, visit, evidence.nominal[robot][stay.region])
        ]
        found[robot] = tuple(sorted(rows))
    return found


@np.errstate(all="ignore")
def judge_stop(
    mission: Mission,
    team: Mapping[str, Trajectory],
    since: Fraction,
    towards: Mapping[str, tuple[Fraction, *tuple[str, ...]]] = MappingProxyType({}),
    *,
    seams: Collection[int] = (),
) -> tuple[Claim, ...]:
    """Check trajectories by which a team comes to rest, whatever it had planned: all that is claimed but words.

    The flight before `since` was checked before. From then on: workspace, separation, rims and obstacles in this world, no region that is
    closed to the robot's kind, and an end that is in each region for sure or out of it for sure. Continuity and limits are checked of the
    whole trajectories.

    Args:
        mission: The world as it is now; its agents are those in the air, with the starts of these trajectories.
        team: One trajectory for each agent, from rest to rest.
        since: Time on the trajectories' clocks, exact, in s.
        towards: For each robot that slows down: when it begins to, and the regions that it is on its way to; the limits of those
            legs are checked from then on. What was flown of a leg before was checked with the leg.
        seams: Pieces with which laps begin anew, where headings may turn fully.

    Raises:
        BadInput: Coefficients are so large that a trajectory cannot be cut.
    """
    agents = {name: agent.model_copy(update={"end": None}) for name, agent in mission.agents.items()}
    whole = _evidence(mission, agents, team)
    rest = {name: cut(trajectory, since) for name, trajectory in team.items()}
    moved = {n: a.model_copy(update={"start": tuple(rest[n].coefficients[0, :3, 0].tolist())}) for n, a in agents.items()}
    ahead = _evidence(mission, moved, rest)
    margin = Fraction(mission.margin) + Fraction(SHIFT)
    still = Clocks(Fraction(0), dict.fromkeys(agents, Fraction(0)))
    return (
        *continuity_claims(jumps(whole.paths, seams=seams)),
        *limit_claims(whole),
        *braking_claims(whole, towards),
        *rim_claims(ahead, margin),
        *obstacle_claims(ahead, margin),
        *workspace_claims(ahead, margin),
        *separation_claims(ahead, margin, still),
        *(
            claim
            for robot, spans in statuses(ahead.membership, margin).items()
            for claim in _region_claims(ahead, robot, spans)
        ),
    )


@np.errstate(all="ignore")
def judge_braking(mission: Mission, robot: str, laps: Trajectory, flown: Trajectory, since: Fraction) -> tuple[Claim, ...]:
    """Check how the one robot of a patrol comes to rest after its last lap: all that `judge_stop` claims, and that it shows nothing new.

    Until it brakes it flies laps that are certified for ever. From then on it keeps the limits of all legs that it may be on, and comes to
    and leaves regions, if any, in the order in which another lap does: so its word is one that its laps begin with.

    Args:
        mission: The patrol's; its margin is proved.
        robot: Its name.
        laps: What is certified.
        flown: Laps and the braking, as a finite flight.
        since: When it begins to brake, exact, in s.

    Raises:
        BadInput: Coefficients are so large that a trajectory cannot be cut, or there are no laps.
    """
    spec = mission.spec.model_copy(update={"trace": "finite", "repeat": 1})
    agents = {robot: mission.agents[robot].model_copy(update={"end": None})}
    world = mission.model_copy(update={"spec": spec, "agents": agents})
    more = laps.flattened(mission.spec.repeat + 1)
    first = laps.cycle or 0
    lap = len(laps) - first
    seams = range(first + lap, min(first + lap * mission.spec.repeat, len(flown) - 1) + 1, lap)
    return (
        _laps_claim(robot, more, flown, since),
        *judge_stop(world, {robot: flown}, since, {robot: (since, *mission.leg_limits_of(robot))}, seams=seams),
        _as_a_lap_claim(world, robot, more, flown, since),
        *endurance_claims(_evidence(world, agents, {robot: flown})),
    )


def _laps_claim(robot: str, laps: Trajectory, flown: Trajectory, since: Fraction) -> Claim:
    """Claim that until it brakes a robot flies its laps, bit for bit."""
    knots = list(itertools.accumulate(map(Fraction, flown.durations.tolist()), initial=Fraction(0)))
    count = knots.index(since) if since in knots else len(flown) + len(laps)
    if laps.part(0, count) == flown.part(0, count) if 0 < count <= min(len(laps), len(flown)) else False:
        return Claim("laps", "holds", f"{robot} flies its certified laps until it brakes at {float(since):.4f} s.", robot=robot)
    return Claim("laps", "fails", f"{robot} does not fly its certified laps until {float(since):.4f} s.", robot=robot)


def _as_a_lap_claim(mission: Mission, robot: str, laps: Trajectory, flown: Trajectory, since: Fraction) -> Claim:
    """Claim that what a robot shows while it brakes is what it shows at first in another lap."""
    shown: list[tuple[dict[str, Status], tuple[Change, ...]]] = []
    for path in (flown, laps):
        rest = cut(path, since)
        place = tuple(rest.coefficients[0, :3, 0].tolist())
        there = {robot: mission.agents[robot].model_copy(update={"start": place})}
        found = statuses(_evidence(mission, there, {robot: rest}).membership, Fraction(mission.margin) + Fraction(SHIFT))
        shown.append(changes(found[robot]))
    (begins, braking), (lap_begins, lap) = shown
    time = float(since)
    if begins != lap_begins:
        return Claim("formula", "fails", f"{robot} brakes where its lap is elsewhere.", robot=robot, time=time)
    if braking and (mission.robot_of(robot).actions or mission.passages is not None):
        region = braking[0].region
        sentence = f"{robot} may enter or leave '{region}' while it brakes, and what it would do or pass there is not told."
        return Claim("formula", "fails", sentence, robot=robot, time=time)
    for events in (braking, lap[: len(braking) + 1]):  # whose order is sure
        for one, then in itertools.pairwise(events):
            if one.time.high >= then.time.low:
                sentence = f"{robot} comes to '{one.region}' and '{then.region}' in an order that cannot be told."
                return Claim("formula", "undecided", sentence, robot=robot, time=time)
    if [(c.region, c.status) for c in braking] != [(c.region, c.status) for c in lap[: len(braking)]]:
        sentence = f"{robot} may enter or leave regions while it brakes as its laps do not."
        return Claim("formula", "fails", sentence, robot=robot, time=time)
    regions = " and ".join(dict.fromkeys(change.region for change in braking)) or "nothing"
    return Claim("formula", "holds", f"{robot} comes to {regions} while it brakes, as in another lap.", robot=robot, time=time)


def _duration(trajectory: Trajectory) -> Fraction:
    return sum(map(Fraction, trajectory.durations.tolist()), Fraction(0))


def _evidence(mission: Mission, agents: Mapping[str, Agent], team: Mapping[str, Trajectory]) -> Evidence:
    """Return evidence about paths for which nothing was planned."""
    return Evidence.unplanned(mission.model_copy(update={"agents": dict(agents)}), team)


def _region_claims(evidence: Evidence, robot: str, spans: Mapping[str, tuple[Span, ...]]) -> Iterator[Claim]:
    """Yield what is claimed of regions: none that is closed to the robot is entered, and it rests clear of every edge."""
    yield from closed_region_claims(evidence, robot, spans)
    yield _rest_claim(evidence, robot, spans)


def _rest_claim(evidence: Evidence, robot: str, spans: Mapping[str, tuple[Span, ...]]) -> Claim:
    open_ = [region for region, row in spans.items() if row[-1].mark not in ("no", "must")]
    end = float(evidence.paths.end)
    if open_:
        sentence = f"{robot} comes to rest at the edge of '{open_[0]}', where it may be in or out."
        return Claim("rest", "fails", sentence, robot=robot, time=end)
    return Claim("rest", "holds", f"{robot} comes to rest clear of every region's edge.", robot=robot, time=end)


# -- timelines end to end -------------------------------------------------------------------------------------


def _joined(mission: Mission, robot: str, agent: Agent, pieces: Sequence[Piece], end: Fraction) -> Timeline | str:
    """Put one robot's timelines end to end, or say why they do not fit."""
    initial: dict[str, Status] = {}
    now: dict[str, Status] = {}
    changes: list[Change] = []
    actions: list[InternalChange] = []
    first = next((i for i, piece in enumerate(pieces) if robot in piece.team), len(pieces))
    flown: Trajectory | None = None
    for index, piece in enumerate(pieces):
        until = pieces[index + 1].since if index + 1 < len(pieces) else end
        if robot in piece.team:
            flown = piece.team[robot]
        elif index > first:
            break  # it has landed, and what it held it holds
        else:
            flown = _hover(agent)
        rows = _rows(piece.mission, robot, agent, flown)
        entered: dict[str, Status] = {region: _status_at(row, piece.since - piece.start) for region, row in rows.items()}
        if index == 0:
            initial, now = entered, dict(entered)
        fault = torn(pieces[index - 1].mission, piece.mission, now, entered) if index else ""
        if fault:
            return f"{fault} of {robot} at {float(piece.since):.3f} s, so the order of its letters cannot be told."
        changes += _steps(piece.since, now, entered)
        now = dict(entered)
        for region, row in rows.items():
            for start, status in row:
                time = piece.start + start
                last = index + 1 == len(pieces)
                if piece.since < time and (time < until or (last and time == until)) and status != now[region]:
                    changes.append(Change(Enclosure(time, time), region, status))
                    now[region] = status
        for action in piece.actions.get(robot, ()):
            if piece.since <= piece.start + action.time <= until:
                actions.append(replace(action, time=piece.start + action.time))
    changes.sort(key=lambda change: change.time.low)
    return Timeline(robot, initial, tuple(changes), end, mission.initial_letter(robot), tuple(actions))


def _steps(time: Fraction, before: Mapping[str, Status], after: Mapping[str, Status]) -> Iterable[Change]:
    return (Change(Enclosure(time, time), region, status) for region, status in after.items() if status != before[region])


def torn(old: Mission, new: Mission, before: Mapping[str, Status], after: Mapping[str, Status]) -> str:
    """Say where a region that jumps and another one's edge come together: then two letters change with none between.

    Args:
        old: The world before.
        new: The world after, with the same regions.
        before: A robot's status in each region just before the change.
        after: Its status in each region just after.

    Returns:
        A sentence without its end; empty where they do not come together.
    """
    jumped = [
        name
        for name, region in new.all_regions.items()
        if (region.center, region.body) != (old.all_regions[name].center, old.all_regions[name].body)
        and (before[name], after[name]) != ("no", "no")
    ]
    if not jumped:
        return ""
    others = [n for n in after if n != jumped[0] and ("may" in (before[n], after[n]) or before[n] != after[n])]
    return f"{jumped[0]} jumps to or from the path while {others[0]} may change under it, in the flight" if others else ""


def _rows(mission: Mission, robot: str, agent: Agent, trajectory: Trajectory) -> dict[str, list[tuple[Fraction, Status]]]:
    """Return for each region (from when, status) along a trajectory, neighbours different; the last holds for ever."""
    start: tuple[float, ...] = tuple(trajectory.coefficients[0, :3, 0].tolist())
    own = agent.model_copy(update={"start": start, "end": None})
    paths = read_team(mission.model_copy(update={"agents": {robot: own}}), {robot: trajectory})
    result: dict[str, list[tuple[Fraction, Status]]] = {}
    for region, spans in statuses(membership_polynomials(paths), Fraction(mission.margin))[robot].items():
        row: list[tuple[Fraction, Status]] = []
        for span in spans:
            status: Status = _as_status(span.mark)
            if not row or row[-1][1] != status:
                row.append((span.start, status))
        result[region] = row
    return result


def _as_status(mark: Mark) -> Status:
    return "may" if mark == "switch" else mark


def _status_at(row: Sequence[tuple[Fraction, Status]], time: Fraction) -> Status:
    found = row[0][1]
    for start, status in row:
        if start <= time:
            found = status
    return found


def _hover(agent: Agent) -> Trajectory:
    still = np.zeros((1, 4, 8))
    still[0, :3, 0], still[0, 3, 0] = agent.start, agent.yaw
    return Trajectory([1.0], still)
