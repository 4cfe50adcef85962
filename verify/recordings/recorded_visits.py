"""Planned visits and passages of a recorded flight: made for sure, surely not made as planned, or not to be told.

What the samples show is a row of tokens: stays in regions and crossings of openings. A sure one happened, another may have. A
claim holds where all tokens are sure and are what was planned; it is broken where no way to read the tokens gives the plan.

At the edge of a region, or in the plane of an opening, a robot may go to and fro between two samples. As for a certificate, going
out by less than the margin and coming back is no other visit, and going through by less is no other passage.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from verify.arithmetic.intervals import Interval
from verify.claims.claim import Claim, Outcome
from verify.data.mission import Mission
from verify.data.plan import RobotPlan
from verify.data.shapes.region import Hoop
from verify.model_checking.timeline import Status
from verify.motion.visits import match, stays
from verify.recordings.flight_reference import World
from verify.recordings.geometric_claims import recorded_claim, seen_from
from verify.recordings.reachable_sets import Cells, Track
from verify.recordings.temporal_claims import Row, spans_of, statuses_within

_FINE = 4
"""How often cells at an opening are halved, so that a crossing's ends are known well."""


@dataclass(frozen=True, slots=True)
class Token:
    """Something that a robot did or may have done.

    Attributes:
        name: What it is if it is sure: a region, or a passage such as "hoop0F".
        may: All that it can count as, any number of times.
        sure: Whether it happened, at least once.
        start: s of the recording.
        stop: s of the recording.
    """

    name: str
    may: frozenset[str]
    sure: bool
    start: float
    stop: float


def visit_claim(
    track: Track, plan: RobotPlan, rows: Mapping[str, Row], around: Mapping[str, Row], starts_in: frozenset[str]
) -> Claim:
    """Claim that the robot's stays in regions are its planned visits, in order, and no other.

    Args:
        track: Where it was.
        plan: Its visits.
        rows: Its regions.
        around: The same of regions that are larger by the margin (`widened`).
        starts_in: Regions that its planned start is in; a stay in another one at the beginning is a visit.
    """
    robot, zero, end = track.robot, Fraction(track.start), Fraction(track.stop)
    spans = {region: spans_of(_without_edges(row, around[region]), zero, end) for region, row in rows.items()}
    matching = match(plan, spans)
    if matching.extra is not None and matching.extra.region not in starts_in:
        region = matching.extra.region
        matching = replace(matching, fault=f"it begins in '{region}', where it does not start", region=region, time=Fraction(0))
    if not matching.fault:
        sentence = f"{robot} makes its {len(plan.visits)} planned visits, in order, and no other."
        return recorded_claim("visits", "holds", sentence, robot=robot)
    tokens = [
        Token(
            stay.region, frozenset({stay.region}), bool(stay.must) and (stay.start > 0 or stay.region not in starts_in),
            float(stay.start + zero), float(stay.stop + zero),
        )
        for stay in stays(spans)
    ]  # fmt: skip
    wanted = [visit.region for visit in plan.visits]
    broken = unreadable(wanted, tokens)
    if broken is None:
        time = None if matching.time is None else float(matching.time + zero)
        sentence = f"{robot}: {matching.fault}, as far as the samples tell."
        return recorded_claim(
            "visits", "undecided", sentence, robot=robot, time=time, region=matching.region, visit=matching.visit
        )
    sentence, visit, token = broken
    return recorded_claim(
        "visits", "fails", f"{robot}: {sentence}.", robot=robot, time=None if token is None else token.start,
        region=wanted[visit] if token is None and visit is not None else None if token is None else token.name, visit=visit,
    )  # fmt: skip


def widened(mission: Mission, margin: float) -> Mission:
    """Return a mission with every region larger by the margin, in the way in which a certificate's *no* is."""
    hoops = {name: hoop.grown(margin) for name, hoop in mission.hoops.items()}
    regions = {name: region.grown(margin) for name, region in mission.regions.items()}
    return mission.model_copy(update={"hoops": hoops, "regions": regions})


def _without_edges(row: Row, around: Row) -> Row:
    """Return a row in which a robot that was out of a region, but surely never further than the margin, only may have been out."""
    found: list[tuple[Fraction, Status]] = []
    for index, (since, status) in enumerate(row):
        between = status == "no" and 0 < index < len(row) - 1
        edge = between and statuses_within(around, since, row[index + 1][0]) == {"must"}
        shown: Status = "may" if edge else status
        if not found or found[-1][1] != shown:
            found.append((since, shown))
    return tuple(found)


def unreadable(wanted: Sequence[str], tokens: Sequence[Token]) -> tuple[str, int | None, Token | None] | None:
    """Say why no way to read tokens gives what was wanted, which wanted one is concerned, and which token; None where one does.

    Where tokens overlap in time their order is open, and only what is missing or was never wanted is compared with them.
    """
    possible = {name for token in tokens for name in token.may}
    for index, name in enumerate(wanted):
        if name not in possible:
            return f"the planned '{name}' does not happen", index, None
    for token in tokens:
        if token.sure and not token.may & set(wanted):
            return f"'{token.name}' happens at {token.start:.4f} s, which is not planned", None, token
    if any(token.start <= max(before.stop for before in tokens[:i]) for i, token in enumerate(tokens) if i):
        return None
    places = {0}
    for token in tokens:
        after = set() if token.sure else set(places)
        for place in places:
            at = place
            while at < len(wanted) and wanted[at] in token.may:
                at += 1
                after.add(at)
        if not after:
            furthest = max(places)
            planned = f"'{wanted[furthest]}'" if furthest < len(wanted) else "nothing more"
            return (
                f"'{token.name}' happens at {token.start:.4f} s where {planned} is planned next",
                _index(furthest, wanted),
                token,
            )
        places = after
    if len(wanted) not in places:
        return f"the planned '{wanted[max(places)]}' does not happen after what was planned before it", max(places), None
    return None


def _index(place: int, wanted: Sequence[str]) -> int | None:
    return place if place < len(wanted) else None


# -- passages -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class RecordedCrossing:
    """A time during which a robot may be in a hoop's opening, and is not just before and after.

    Attributes:
        hoop: Name.
        way: "F" or "R" where it is on different sides before and after; "" otherwise.
        off_axis: Upper bound on the distance from the axis meanwhile, m.
        start: s of the recording.
        stop: s of the recording.
    """

    hoop: str
    way: str
    off_axis: float
    start: float
    stop: float


def passage_claim(
    track: Track, worlds: Sequence[World], wanted: Sequence[tuple[str, str]], rows: Mapping[str, Row], margin: float
) -> Claim:
    """Claim that the robot passes exactly the wanted openings, in order, each within a stay in its hoop's region.

    Args:
        track: Where it was.
        worlds: Where hoops stand, each from its time on; all hoops and the vehicle are the same in all of them.
        wanted: (hoop, way) of each planned passage.
        rows: The robot's regions.
        margin: How far from the plane of an opening a robot may turn back without having passed it once more, m.
    """
    mission = worlds[0].mission
    robot, radius = track.robot, mission.vehicle_of(track.robot).radius
    found = crossings(track, worlds, margin)
    tokens = []
    for crossing in found:
        through = bool(crossing.way) and crossing.off_axis <= mission.hoops[crossing.hoop].opening
        name = crossing.hoop + (crossing.way if crossing.way else "")
        may = frozenset({crossing.hoop + "F", crossing.hoop + "R"})
        tokens.append(Token(name, may, through, crossing.start, crossing.stop))
    names = [hoop + way for hoop, way in wanted]
    listed = " ".join(names)
    if [token.name for token in tokens] == names and all(token.sure for token in tokens):
        doubt = _doubt(found, mission, radius, rows)
        if doubt is None:
            if not names:
                return recorded_claim("passages", "holds", f"{robot} passes no opening, as planned.", robot=robot)
            room = min(mission.hoops[c.hoop].opening - c.off_axis for c in found)
            sentence = f"{robot} passes exactly its planned openings: {listed}; at least {room:.4f} m inside the rims."
            return recorded_claim("passages", "holds", sentence, robot=robot, bound=room, limit=radius)
        sentence, crossing, verdict = doubt
        return recorded_claim(
            "passages", verdict, f"{robot}: {sentence}.", robot=robot, time=crossing.start, region=crossing.hoop
        )
    broken = unreadable(names, tokens)
    if broken is None:
        first = next((t for t in tokens if not t.sure), None)
        when = "" if first is None else f": whether '{first.name}' is passed at {first.start:.4f} s is open"
        sentence = f"{robot}'s passages cannot be told from the planned ones, {listed or 'none'}{when}."
        return recorded_claim("passages", "undecided", sentence, robot=robot, time=None if first is None else first.start)
    sentence, index, token = broken
    hoop = wanted[index][0] if index is not None and token is None else None if token is None else token.name.rstrip("FR")
    return recorded_claim(
        "passages", "fails", f"{robot}: {sentence}; planned are {listed or 'no passages'}.", robot=robot,
        time=None if token is None else token.start, region=hoop, visit=index,
    )  # fmt: skip


def _doubt(
    found: Sequence[RecordedCrossing], mission: Mission, radius: float, rows: Mapping[str, Row]
) -> tuple[str, RecordedCrossing, Outcome] | None:
    """Say what of passages in the right order is not shown: room for the vehicle, the hoop's region around, time between them."""
    for index, crossing in enumerate(found):
        at = f"at {crossing.start:.4f} s"
        if not crossing.off_axis <= mission.hoops[crossing.hoop].opening - radius:
            room = mission.hoops[crossing.hoop].opening - radius
            return (
                f"'{crossing.hoop}' is passed up to {crossing.off_axis:.4f} m off its axis {at}, {room:.4f} m leave room",
                crossing,
                "undecided",
            )
        statuses = statuses_within(rows[crossing.hoop], Fraction(crossing.start), Fraction(crossing.stop))
        if statuses != {"must"}:
            verdict: Outcome = "fails" if statuses == {"no"} else "undecided"
            return f"the visit of '{crossing.hoop}' may not contain its passage {at}", crossing, verdict
        if index and found[index - 1].stop >= crossing.start:
            return f"two passages cannot be told apart in time {at}", crossing, "undecided"
    return None


def crossings(track: Track, worlds: Sequence[World], margin: float) -> list[RecordedCrossing]:
    """Return the times at which a robot may be in an opening, in order of their starts.

    A hoop that moves or turns stands somewhere else from then on: it is not flown through by that.

    Args:
        track: The robot's samples.
        worlds: In order of time, with the same hoops.
        margin: delta, m.
    """
    found: list[RecordedCrossing] = []
    for name in worlds[0].mission.hoops:
        for hoop, part in _standing(track, worlds, name):
            cells = part.cells()
            for _ in range(_FINE):
                cells = cells.at(np.flatnonzero(_near_plane(cells, hoop, margin) & _near_axis(cells, hoop))).halved()
            if len(cells):
                found.extend(_crossing(run, name, hoop, touching) for run, touching in _runs(cells, hoop, margin))
    return sorted(found, key=lambda crossing: crossing.start)


def _standing(track: Track, worlds: Sequence[World], name: str) -> Iterator[tuple[Hoop, Track]]:
    """Yield each place at which a hoop stands while a robot is checked, with the robot's track meanwhile."""
    changes = [i for i, world in enumerate(worlds) if i and world.mission.hoops[name] != worlds[i - 1].mission.hoops[name]]
    since = [track.start, *(worlds[i].since for i in changes)]
    until = [*since[1:], track.stop]
    for index, start, stop in zip([0, *changes], since, until, strict=True):
        part = track.over(start, stop)
        if part.start <= part.stop:
            yield worlds[index].mission.hoops[name], part


def _near_plane(cells: Cells, hoop: Hoop, margin: float) -> np.ndarray:
    """Return which cells may come within the margin of an opening's plane."""
    along, reach = seen_from(cells.centres, hoop)[0], cells.reach + margin
    return (along.low <= reach) & (along.high >= -reach)


def _near_axis(cells: Cells, hoop: Hoop) -> np.ndarray:
    """Return which cells may come as near to an opening's axis as its edge."""
    return seen_from(cells.centres, hoop)[1].low <= np.nextafter(hoop.opening + cells.reach, np.inf)


def _runs(cells: Cells, hoop: Hoop, margin: float) -> list[tuple[Cells, Cells]]:
    """Return runs of cells that begin and end where the opening may be touched, and of each the cells that may touch it.

    In between the robot is surely no further than the margin from the plane, and no part of the time is missing.
    """
    touching = _near_plane(cells, hoop, 0.0) & _near_axis(cells, hoop)
    along, reach = seen_from(cells.centres, hoop)[0], cells.reach
    held = touching | ((along.high + reach <= margin) & (along.low - reach >= -margin))
    begin, end = cells.gap + cells.low, cells.gap + cells.high
    runs: list[list[int]] = []
    for index in np.flatnonzero(touching):
        last = runs[-1][-1] if runs else None
        joined = (
            last is not None and held[last : index + 1].all() and np.array_equal(begin[last + 1 : index + 1], end[last:index])
        )
        if joined:
            runs[-1].append(int(index))
        else:
            runs.append([int(index)])
    return [(cells.at(np.arange(run[0], run[-1] + 1)), cells.at(np.array(run))) for run in runs]


def _crossing(cells: Cells, name: str, hoop: Hoop, touching: Cells) -> RecordedCrossing:
    first, last = _side(cells, 0, hoop), _side(cells, -1, hoop)
    way = "F" if first < 0 < last else "R" if last < 0 < first else ""
    off_axis = float(np.nextafter(seen_from(touching.centres, hoop)[1].high + touching.reach, np.inf).max())
    start, stop = cells.times(cells.low)[0], cells.times(cells.high)[-1]
    low = max(float(np.nextafter(start, -np.inf)), cells.track.start)
    return RecordedCrossing(name, way, off_axis, low, min(float(np.nextafter(stop, np.inf)), cells.track.stop))


def _side(cells: Cells, index: int, hoop: Hoop) -> int:
    """Return on which side of the plane a run of cells surely begins (index 0) or ends (-1): -1, 1, or 0 where that is open."""
    share = cells.low if index == 0 else cells.high
    gap, at = cells.gap[[index]], share[[index]]
    along: Interval = seen_from(cells.track.places(gap, at), hoop)[0]
    spread = float(cells.track.spread(gap, at, at)[0] + cells.track.rounding(gap)[0])
    if float(along.high[0]) + spread < 0:
        return -1
    return 1 if float(along.low[0]) - spread > 0 else 0
