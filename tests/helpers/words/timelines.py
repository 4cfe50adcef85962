"""Timelines by hand, the missions that they belong to, and random flights that agree with a timeline."""

from __future__ import annotations

from fractions import Fraction
from random import Random
from typing import Any

from verify.data import Letter, Mission
from verify.model_checking.timeline import Change, Enclosure, InternalChange, Relations, Status, Timeline

END = 20


def mission(
    formula: str, *, team: str = "own", robots: int = 1, trace: str = "finite", environment: dict[str, Any] | None = None
) -> Mission:
    """A mission over separate regions a, b and c, where water is taken in at a."""
    radii = (0.1, 0.1, 0.1)
    return Mission.model_validate(
        {
            "name": "by-hand",
            "spec": {"formula": formula, "team": team, "trace": trace},
            "regions": {name: {"center": (float(i), 0.0, 1.0), "radii": radii} for i, name in enumerate("abc")},
            "environment": environment,
            "robot": {
                "initial": "dry",
                "states": {"dry": (), "wet": ("water",)},
                "actions": ({"from": "dry", "to": "wet", "at": "a"},),
            },
            "agents": {f"q{i}": {"start": (float(i), 3.0, 1.0)} for i in range(robots)},
            "vehicle": "crazyflie-2.1",
            "workspace": {"min": (-5.0, -5.0, 0.0), "max": (9.0, 5.0, 3.0)},
        }
    )


APART = Relations(frozenset({("a", "b"), ("a", "c"), ("b", "c")}))


def at(low: float | Fraction, high: float | Fraction | None = None) -> Enclosure:
    """An exact instant, or an enclosure."""
    return Enclosure(Fraction(low), Fraction(low if high is None else high))


def fill(time: float, visit: int = 0, where: str = "a") -> InternalChange:
    """The action of `mission` at an exact time."""
    return InternalChange(Fraction(time), "dry", "wet", where, visit, frozenset({"water"}))


def timeline(
    robot: str,
    *visits: tuple[str, float, float],
    edge: float = 0.0,
    grazes: tuple[tuple[str, float, float], ...] = (),
    actions: tuple[InternalChange, ...] = (),
    cycle: float | None = None,
) -> Timeline:
    """Visits (region, from, to) with spells of *may* of length `edge` around both ends; grazes are *may* only."""
    changes: list[Change] = []
    for region, start, stop in visits:
        if edge:
            statuses: list[tuple[float, Status]] = [
                (start - edge, "may"), (start + edge, "must"), (stop - edge, "may"), (stop + edge, "no")
            ]  # fmt: skip
        else:
            statuses = [(start, "must"), (stop, "no")]
        changes += [Change(at(time), region, status) for time, status in statuses]
    for region, start, stop in grazes:
        changes += [Change(at(start), region, "may"), Change(at(stop), region, "no")]
    changes.sort(key=lambda change: change.time.low)
    lap = None if cycle is None else Fraction(cycle)
    return Timeline(robot, dict.fromkeys(("a", "b", "c"), "no"), tuple(changes), Fraction(END), actions=actions, cycle=lap)


Signal = list[tuple[Fraction, Letter]]
"""Letters with the instants from which they hold."""


def random_signal(line: Timeline, rng: Random) -> Signal | None:
    """Fly one of the flights that a timeline leaves possible; None where the dice gave none."""
    begin: set[str] = set()
    events: list[tuple[Fraction, str, bool]] = []
    for region, first in line.initial.items():
        status: Status = first
        inside = status == "must" or (status == "may" and rng.random() < 0.5)
        if inside:
            begin.add(region)
        since, free_since = Fraction(0), Fraction(0) if status == "may" else None

        def dither(low: Fraction, high: Fraction, wanted: bool | None, inside: bool, region: str = region) -> bool:
            times = sorted(
                low + (high - low) * Fraction(rng.choice([0, 1, rng.random()])) for _ in range(rng.choice([0, 0, 1, 2, 3]))
            )
            if wanted is not None and (inside ^ (len(times) % 2 == 1)) != wanted:
                times.append(high)
            for time in times:
                inside = not inside
                events.append((time, region, inside))
            return inside

        for change in (c for c in line.changes if c.region == region):
            if change.status == status:
                continue
            if change.status == "may":
                free_since = change.time.low
            elif status == "may":
                assert free_since is not None
                inside = dither(max(free_since, since), change.time.high, change.status == "must", inside)
                since = change.time.high
            else:
                low = max(change.time.low, since)
                time = low + (change.time.high - low) * Fraction(rng.choice([0, 1, rng.random()]))
                inside = not inside
                events.append((time, region, inside))
                since = time
            status = change.status
        if status == "may":
            assert free_since is not None
            dither(max(free_since, since), line.duration, None, inside)
    events += [(action.time, "water", True) for action in line.actions]
    rng.shuffle(events)
    events.sort(key=lambda event: event[0])
    held = set(begin)
    signal: Signal = [(Fraction(0), frozenset(held))]
    while events:
        now = [event for event in events if event[0] == events[0][0]]
        events = events[len(now) :]
        while now:
            able = [event for event in now if (event[1] in held) != event[2]]
            if not able:
                return None
            event = rng.choice(able)
            now.remove(event)
            (held.add if event[2] else held.discard)(event[1])
            signal.append((event[0], frozenset(held)))
    return signal


def random_readings(signals: list[Signal], end: Fraction, rng: Random) -> tuple[Letter, ...]:
    """Read every robot at least once in each of its letters, at any times."""
    readings: list[tuple[Fraction, int, int, Letter]] = []
    for robot, signal in enumerate(signals):
        for index, (start, letter) in enumerate(signal):
            stop = signal[index + 1][0] if index + 1 < len(signal) else end
            for _ in range(rng.choice([1, 1, 1, 2, 3])):
                time = rng.choice([start, stop, start + (stop - start) * Fraction(rng.random())])
                readings.append((time, robot, index, letter))
    return _interleaved(readings, rng)


def random_unions(signals: list[Signal], rng: Random) -> tuple[Letter, ...]:
    """Read the union of all letters; what happens at one instant happens in either order or together."""
    places = [0] * len(signals)

    def union() -> Letter:
        return frozenset().union(*(signal[place][1] for signal, place in zip(signals, places, strict=True)))

    found = [union()]
    events = sorted(
        ((time, robot, index) for robot, signal in enumerate(signals) for index, (time, _) in enumerate(signal) if index),
        key=lambda event: (event[0], event[2]),
    )
    while events:
        now = [event for event in events if event[0] == events[0][0]]
        events = events[len(now) :]
        while now:
            first = {robot: index for _, robot, index in reversed(now)}
            movers = rng.sample(sorted(first), rng.randint(1, len(first)))
            for robot in movers:
                places[robot] = first[robot]
            now = [event for event in now if event[1] not in movers or event[2] != first[event[1]]]
            found.append(union())
    return tuple(found)


def _interleaved(readings: list[tuple[Fraction, int, int, Letter]], rng: Random) -> tuple[Letter, ...]:
    """Order readings by time; at equal times robots in any order, each robot's own kept."""
    readings = sorted(readings, key=lambda reading: (reading[0], reading[2]))
    found: list[Letter] = []
    while readings:
        now = [reading for reading in readings if reading[0] == readings[0][0]]
        readings = readings[len(now) :]
        while now:
            robot = rng.choice(sorted({reading[1] for reading in now}))
            ready = [reading for reading in now if reading[1] == robot]
            found.append(ready[0][3])
            now.remove(ready[0])
    return tuple(found)
