"""Temporal claims of a recorded flight: regions over time, actions that the samples allow, transitions and the formula."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np

from verify.claims.claim import Claim
from verify.flight_segments import torn
from verify.logic.verdict import Verdict
from verify.model_checking.inclusion import DEFAULT_BUDGET
from verify.model_checking.timeline import Change, Enclosure, InternalChange, Relations, Status, Timeline
from verify.model_checking.transitions import judge_transitions, no_word_is_a_trace
from verify.motion.membership.bodies import Span
from verify.motion.regions import relations
from verify.recordings.flight_reference import World
from verify.recordings.geometric_claims import recorded_claim
from verify.recordings.reachable_sets import Floats, Track
from verify.recordings.recorded_laps import laps_claim
from verify.recordings.sampled_timelines import sampled_timeline
from verify.recordings.samples import judge_timelines

Row = tuple[tuple[Fraction, Status], ...]
"""A region's status from each time on, s of the recording; the first is at the start of the checked time."""


def region_rows(track: Track, worlds: Sequence[World]) -> dict[str, Row]:
    """Return each region's statuses over a track's checked time, every world's own while it lasts.

    A status that jumps between "no" and "must" was crossed in between, unless it is the region that moved.
    """
    rows: dict[str, list[tuple[Fraction, Status]]] = {}
    for index, world in enumerate(worlds):
        since = track.start if index == 0 else max(world.since, track.start)
        until = track.stop if index + 1 == len(worlds) else min(worlds[index + 1].since, track.stop)
        if since > until:
            continue
        line = sampled_timeline(
            track.robot,
            track.times,
            track.positions,
            world.mission.all_regions,
            speed=track.bounds.speed,
            error=track.bounds.error,
        )
        low, high = Fraction(since), Fraction(until)
        for region in world.mission.all_regions:
            status, row = line.initial[region], rows.setdefault(region, [])
            later: list[tuple[Fraction, Status]] = []
            for change in line.changes:
                if change.region == region and change.time.low <= low:
                    status = change.status
                elif change.region == region and change.time.low <= high:
                    later.append((change.time.low, change.status))
            if not row or row[-1][1] != status:
                row.append((low, status))
            row.extend(later)
    return {region: tuple(row) for region, row in rows.items()}


def statuses_within(row: Row, low: Fraction, high: Fraction) -> set[Status]:
    """Return all statuses that a region has at some time from `low` to `high`, ends included.

    Args:
        row: A region's statuses.
        low: s of the recording, exact.
        high: s of the recording, exact.
    """
    ends = [*(time for time, _ in row[1:]), None]
    found: set[Status] = set()
    for (since, status), until in zip(row, ends, strict=True):
        if since <= high and (until is None or until >= low):
            found.add(status)
    return found


def spans_of(row: Row, start: Fraction, stop: Fraction) -> tuple[Span, ...]:
    """Return a row as the spans that visits are read from, time counted from `start`.

    Args:
        row: A region's statuses.
        start: s of the recording, exact.
        stop: s of the recording, exact, at which the last status ends.
    """
    ends = [*(time for time, _ in row[1:]), stop]
    return tuple(Span(since - start, until - start, status) for (since, status), until in zip(row, ends, strict=True))


def recorded_timeline(
    track: Track,
    rows: Mapping[str, Row],
    *,
    start: float,
    stop: float,
    internal: frozenset[str],
    actions: Sequence[InternalChange],
) -> Timeline:
    """Put together what is known of one robot, its time from `start` to `stop` counted from 0.

    What a robot showed last it goes on showing where it was checked for a shorter time than the team. Before it was checked it showed no
    region.

    Args:
        track: The robot's samples.
        rows: The robot's regions.
        start: s of the recording.
        stop: s of the recording.
        internal: Internal propositions at `start`.
        actions: Changes of the internal state, s from `start`.
    """
    zero, end = Fraction(start), Fraction(stop) - Fraction(start)
    changes = [
        Change(Enclosure(time - zero, time - zero), region, status) for region, row in rows.items() for time, status in row[1:]
    ]
    late = {region: row[0] for region, row in rows.items() if row[0][0] > zero}
    changes += [Change(Enclosure(t - zero, t - zero), region, status) for region, (t, status) in late.items() if status != "no"]
    changes.sort(key=lambda change: change.time.low)
    initial: dict[str, Status] = {region: "no" if region in late else row[0][1] for region, row in rows.items()}
    return Timeline(track.robot, initial, tuple(changes), end, internal, tuple(actions))


# seven parameters: what was asked and what is known of the flight, and each limit of that by its keyword
def formula_claim(
    worlds: Sequence[World], timelines: Mapping[str, Timeline], rows: Mapping[str, Mapping[str, Row]], *, doubtful: str,
    begins: tuple[float, float], lap: Fraction | None = None, budget: int = DEFAULT_BUDGET,
) -> Claim:  # fmt: skip
    """Claim that the formula of the last world holds of the whole flight; of laps for ever see `recorded_laps`.

    Args:
        worlds: In order of time.
        timelines: One for each robot.
        rows: Each robot's regions.
        doubtful: Why internal states are not known; empty where they are.
        begins: Time of the timelines' 0, and by how much later the flight may have begun, s.
        lap: Length of the lap with which the flight ends, s; None where it is not known, or where there are none.
        budget: Configurations that each part of the formula may take.
    """
    mission, (zero, late) = worlds[-1].mission, begins
    for robot, own in rows.items():
        for region, row in own.items():
            if row[0][0] > Fraction(zero) and row[0][1] != "no":
                sentence = f"{robot} may be in '{region}' when it joins at {float(row[0][0]):.3f} s, so what it showed first cannot be told."
                return recorded_claim("formula", "undecided", sentence, robot=robot, time=float(row[0][0]), region=region)
    if doubtful and mission.internal_propositions & mission.formula.names():
        return recorded_claim("formula", "undecided", f"The formula speaks of internal states: {doubtful}.")
    for one, other in itertools.pairwise(worlds):
        at = Fraction(other.since)
        for robot, own in rows.items():
            if any(at < row[0][0] for row in own.values()):
                continue  # the world changed before the flight began
            before: dict[str, Status] = {region: _until(row, at) for region, row in own.items()}
            after: dict[str, Status] = {
                region: max(statuses_within(row, at, at), key=_ORDER.index) for region, row in own.items()
            }
            fault = torn(one.mission, other.mission, before, after)
            if fault:
                sentence = f"{fault} of {robot} at {other.since:.3f} s, so the order of its letters cannot be told."
                return recorded_claim("formula", "undecided", sentence, robot=robot, time=other.since)
    if mission.spec.trace == "infinite":
        return laps_claim(mission, timelines, common_relations(worlds), lap, begins, budget)
    return _word_claim(judge_timelines(mission, timelines, common_relations(worlds), budget, late=Fraction(late)), zero)


_ORDER: tuple[Status, ...] = ("no", "must", "may")


def _until(row: Row, time: Fraction) -> Status:
    """Return the status just before a time."""
    found = row[0][1]
    for since, status in row:
        if since < time:
            found = status
    return found


def transition_claim(worlds: Sequence[World], timeline: Timeline, *, zero: float) -> Claim:
    """Every word of a robot is a trace of its transition system.

    Args:
        worlds: In order of time; the last one's transition system is asked.
        timeline: What is known of the robot.
        zero: Time of the timeline's 0, s of the recording.
    """
    mission, known = worlds[-1].mission, common_relations(worlds)
    (verdict,) = judge_transitions(mission, {timeline.robot: timeline}, known)
    if verdict.outcome == "fails" and not no_word_is_a_trace(mission, timeline, known):
        verdict = Verdict(
            "undecided", verdict.sentence, verdict.counterexample, verdict.time, "transitions", verdict.robot, verdict.visit,
            verdict.region, verdict.times,
        )  # fmt: skip
    return _word_claim(verdict, zero)


def _word_claim(verdict: Verdict, zero: float) -> Claim:
    """Return a verdict on timelines as a claim whose times are those of the recording."""
    if verdict.outcome == "holds":
        return Claim(verdict.claim, verdict.outcome, verdict.sentence, robot=verdict.robot)
    time = None if verdict.time is None else verdict.time + zero
    sentence = (
        f"{verdict.sentence} (Times from {zero:.4f} s of the recording on.)" if zero and verdict.times else verdict.sentence
    )
    times = tuple((low + zero, high + zero) for low, high in verdict.times)
    witness = replace(verdict.witness(), sentence=sentence, time=time, times=times)
    return Claim(verdict.claim, verdict.outcome, sentence, robot=verdict.robot, time=time, witness=witness)


def common_relations(worlds: Sequence[World]) -> Relations:
    """Return what is proved of the regions in every world."""
    found = [relations(world.mission) for world in worlds]
    return Relations(
        frozenset.intersection(*(one.disjoint for one in found)), frozenset.intersection(*(one.nested for one in found))
    )


def within(times: Floats, start: float, stop: float) -> np.ndarray:
    """Return the indices of times in a closed span.

    Args:
        times: s. Shape (n,).
        start: First time, s.
        stop: Last time, s.
    """
    return np.flatnonzero((times >= start) & (times <= stop))
