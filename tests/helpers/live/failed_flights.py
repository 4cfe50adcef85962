"""How flights ended in which something failed, judged by what the simulated world knows, not by what the flight says of itself."""

from __future__ import annotations

import functools
import json
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from multiprocessing import get_context

import numpy as np

from flight.link.live_executive import LiveFlight
from flight.link.phases import Stage
from tests.helpers.live.failure_draws import Draw, Failing
from tests.helpers.live.live_failures import require_whole_logs
from tests.helpers.live.patience import be_patient

TOGETHER = 4
"""Flights that are flown side by side, each in a process of its own: they mostly wait."""
NEAR = 0.2
"""m above the ground at which motors may stop."""
STALL = 0.25
"""s that this process may be kept from its work: poses are old after 0.7 s, and signs of life come every 0.2 s of the 1 s that watchdogs wait."""
NOTICED = 1.5
"""s within which each failure is noticed."""
FASTEST = 1.6
"""m/s that nobody flies, not even where something fails: plans reach 1.0, and a jump would be many."""
PASSING = ("hangs", "outage")
"""What passes by itself."""
SEEN = 0.02
"""m by which a recorded place may be off from where the vehicle was about then."""


@dataclass(frozen=True)
class End:
    """What became of one vehicle.

    Attributes:
        name: The robot's.
        at_return: Whether its motors turned when the flight was said to be over.
        state: `ground` (it never took off), `landed`, `stopped` (in the air), `holding`, `flying`, some seconds later.
        fell: Whether it was let fall by what nobody meant to stop it.
        jump: m/s that it flew, or was asked to fly, at the most.
    """

    name: str
    at_return: bool
    state: str
    fell: bool = False
    jump: float = 0.0


@dataclass(frozen=True)
class Ended:
    """What became of a flight.

    Attributes:
        draw: What failed.
        outcome: `flown`, `refused` before take-off, or `ended`.
        states: Of all vehicles.
        lies: What must never be: it was said of a vehicle, and is not so.
        faults: What must not be where the machine has time for a flight.
        late: Whether it had none.
    """

    draw: Draw
    outcome: str
    states: tuple[str, ...]
    lies: tuple[str, ...] = ()
    faults: tuple[str, ...] = ()
    late: bool = False


class Stalls(threading.Thread):
    """Looks whether this process gets its time: what waits for 10 ms and comes back much later was kept from it by others.

    Attributes:
        longest: s that it came late at the most.
    """

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.longest, self._ended = 0.0, threading.Event()

    def run(self) -> None:
        before = time.monotonic()
        while not self._ended.wait(0.01):
            now = time.monotonic()
            self.longest, before = max(self.longest, now - before), now

    def __enter__(self) -> Stalls:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self.join()


@dataclass
class Truth:
    """Where vehicles truly were.

    Attributes:
        times: s of the link's clock. Shape (n,).
        places: x, y, z in m by robot. Shape (n, 3).
    """

    times: np.ndarray
    places: Mapping[str, np.ndarray]

    def off(self, time: float, robot: str, place: Sequence[float], late: float = STALL) -> float:
        """Return how far a place is from the nearest one of about then, m."""
        near = slice(*self.times.searchsorted([time - late, time + late]))
        return float(np.linalg.norm(self.places[robot][near] - np.array(place), axis=1).min(initial=np.inf))


def lies_of(done: LiveFlight | None, ends: Sequence[End]) -> list[str]:
    """Return what a flight says of vehicles that is not so; None where it raised, which it does only while all stand."""
    if done is None:
        return [f"{end.name} is {end.state}, and it was not said how it ended" for end in ends if end.state != "ground"]
    found = [f"{end.name} is {end.state}" for end in ends if end.state == "flying"]
    for end in ends:
        if end.fell:
            found.append(f"{end.name} was let fall")
        if end.name not in done.unsafe and (end.at_return or end.state == "holding"):
            found.append(f"{end.name} is said to be safe, and its motors turned; it is {end.state}")
    if done.flown is not (not done.reason and not done.unsafe):
        found.append(f"flown is {done.flown} with the reason {done.reason!r} and {done.unsafe} unsafe")
    return found


def faults_of(
    draw: Draw,
    done: LiveFlight,
    stages: Sequence[Stage],
    ends: Sequence[End],
    truth: Truth,
    *,
    failing: Failing,
    alone: Callable[[str], bool],
    misplaced: str = "",
) -> list[str]:
    """Return what must not be of a flight's end.

    Args:
        draw: What failed.
        done: What the flight says of itself.
        stages: What was to be flown.
        ends: What became of vehicles.
        truth: Where they truly were.
        failing: When it failed.
        alone: Whether a robot that cannot be told anything may end in a state other than on the ground.
        misplaced: Who does not know where it is.
    """
    found: list[str] = []
    concerned = {draw.robot} if not draw.of_host else {end.name for end in ends}
    for end in ends:
        if end.jump > FASTEST:
            found.append(f"{end.name} flew {end.jump:.1f} m/s")
        if end.state in ("holding", "stopped") and not (end.name in concerned and alone(end.state)) and draw.again is None:
            found.append(f"{end.name} is {end.state}")
        if end.name in done.unsafe and end.name not in concerned and draw.again is None:
            found.append(f"{end.name} is said to be unsafe")
    if failing.failed_at == np.inf:
        found.append("it ended before anything failed")
    if done.flown and _noticed(draw, done, stages, failing):
        found.append("nobody noticed")
    found += _faults_of_logs(done, stages, ends, truth, misplaced)
    return found and [
        *found,
        f"said: {done.reason!r}, unsafe {done.unsafe}, failed at {failing.failed_at:.2f} s of {done.record.starts}",
    ]


def _noticed(draw: Draw, done: LiveFlight, stages: Sequence[Stage], failing: Failing) -> bool:
    """Tell whether it failed in the air, so early and for so long that it has to be noticed."""
    begins = [done.record.starts.get(stage.name, np.inf) for stage in stages]
    until = begins[-1] + stages[-1].duration
    return begins[0] < failing.failed_at < until - NOTICED and (draw.kind not in PASSING or draw.lasts > NOTICED)


def _faults_of_logs(done: LiveFlight, stages: Sequence[Stage], ends: Sequence[End], truth: Truth, misplaced: str) -> list[str]:
    """Return what is missing or wrong in what is kept."""
    try:
        require_whole_logs(done, tuple(stage.name for stage in stages))
    except AssertionError as error:
        return [f"log: {error}"]
    files, found, last = done.record.files(), [], dict[str, tuple[float, float]]()
    for row in files["poses.csv"].splitlines()[1:]:
        time, robot, *place = row.split(",")
        where = [float(value) for value in place]
        last[robot] = (float(time), where[2])
        if robot != misplaced and (off := truth.off(float(time), robot, where)) > SEEN:
            found.append(f"{robot} is recorded {off:.3f} m from where it was at {time} s")
    starts = json.loads(files["live.json"])["starts"]
    if bool(starts) != ("live.csv" in files) and "flight" in starts:
        found.append("there is no recording of the flight")
    for end in ends:
        ground = next(iter(stages)).paths[end.name].evaluate(0.0)[2]
        if starts and end.state == "landed" and end.name not in done.unsafe and end.name != misplaced:
            if end.name not in last:
                found.append(f"{end.name} was never recorded")
            elif abs(last[end.name][1] - truth.places[end.name][-1, 2]) > NEAR:
                found.append(f"{end.name} was recorded last {last[end.name][1] - ground:.2f} m above the ground")
    return found[:5]


@dataclass
class Tally:
    """What became of many flights."""

    outcomes: Counter[str] = field(default_factory=Counter)
    kinds: Counter[str] = field(default_factory=Counter)
    states: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        told = (
            ", ".join(f"{n} {name}" for name, n in found.most_common()) for found in (self.outcomes, self.kinds, self.states)
        )
        return "; ".join(told) + f"; {len(self.faults)} faults"


def was_late(done: LiveFlight | None, failing: Failing, behind: float) -> bool:
    """Tell whether the machine had no time for a flight: it was behind by so many s, or ended it before anything had failed."""
    return behind > STALL or (done is not None and not done.flown and failing.failed_at == np.inf)


def outcome_of(done: LiveFlight | None) -> str:
    """Return a word for how a flight ended."""
    return "flown" if done and done.flown else "ended" if done and done.record.starts else "refused"


def flown_in_time(fly: Callable[[int], Ended], number: int) -> Ended:
    """Fly a draw, again where something is wrong that may be as the machine was late; three times at the most."""
    for _ in range(2):
        ended = fly(number)
        if ended.lies or not (ended.late and ended.faults):
            return ended
    return fly(number)


def flown_side_by_side(fly: Callable[[int], Ended], numbers: Iterable[int], together: int = TOGETHER) -> Tally:
    """Fly draws in processes beside each other, and return what became of them.

    Args:
        fly: Flies one, by its number; can be imported.
        numbers: Of the draws.
        together: How many at once.
    """
    tally = Tally()
    with ProcessPoolExecutor(together, mp_context=get_context("spawn"), initializer=be_patient) as pool:
        for ended in pool.map(functools.partial(flown_in_time, fly), numbers):
            tally.outcomes[ended.outcome] += 1
            tally.kinds[ended.draw.kind] += 1
            tally.states.update(ended.states)
            tally.faults += [f"{ended.draw}: {fault}" for fault in (*ended.lies, *ended.faults)]
    return tally
