"""Sentences of a certificate held against dense samples of the flight's CSV files: numbers are read from the text, nothing is asked of the judge."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from tests.helpers.motion.dense_motion import GRAVITY, Floats, SampledFlight, body_rates, rotor_thrusts

STEP = 0.004
"""s between samples."""
STANDS = 1e-5
"""m/s below which a sampled robot stands still."""
_ORDINALS = {"first": 1, "second": 2, "third": 3}
_PLACE = r"(\w+)(?: for the (\w+) time)?( before the first lap)?"


class Flown:
    """A folder's flight: its mission and plan as plain data, and its files as samples.

    Regions and obstacles are balls, ellipsoids or boxes along the axes.
    """

    def __init__(self, folder: Path) -> None:
        """Read a folder that `write_folder` wrote."""
        self.mission: dict[str, Any] = yaml.safe_load((folder / "mission.yaml").read_text())
        self.plan: dict[str, Any] = json.loads((folder / "plan.json").read_text())
        self.certificate: dict[str, Any] = json.loads((folder / "certificate.json").read_text())
        self.flights = {name: SampledFlight.of_csv(folder / f"{name}.csv") for name in self.plan["robots"]}
        self.end = max(float(flight.knots[-1]) for flight in self.flights.values())
        self.times = np.arange(0.0, self.end + STEP, STEP)
        self.laps = int(self.mission["spec"].get("repeat", 1)) if self.mission["spec"].get("trace") == "infinite" else 0

    @cached_property
    def places(self) -> dict[str, Floats]:
        """Positions at `times`. Shape (times, 3) each."""
        return {name: flight.at(self.times)[:, :3] for name, flight in self.flights.items()}

    @cached_property
    def speeds(self) -> dict[str, Floats]:
        """Speeds at `times`, m/s."""
        return {name: np.linalg.norm(flight.at(self.times, 1)[:, :3], axis=1) for name, flight in self.flights.items()}

    def stays(self, robot: str, region: str) -> list[tuple[float, float]]:
        """Return from when to when a robot's nominal path is in a region; a stay in which it starts only if it is planned."""
        body = self.mission["regions"][region]
        inside = _inside(self.places[robot], body).astype(int)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], inside, [0]])))
        found = [
            (float(self.times[a]), float(self.times[min(b, len(self.times) - 1)]))
            for a, b in zip(edges[::2], edges[1::2], strict=True)
        ]
        planned = [visit["region"] for visit in self.plan["robots"][robot]["visits"]].count(region)
        begun = self.plan["robots"][robot]["cycle_visit"]
        if begun is not None:
            again = [visit["region"] for visit in self.plan["robots"][robot]["visits"][begun:]].count(region)
            planned += again * (self.laps - 1)
        return found[1:] if found and found[0][0] == 0.0 and len(found) > planned else found

    def stay(self, robot: str, region: str, number: int, lap: int | None) -> tuple[tuple[float, float], int]:
        """Return the stay of a region's so-many-th visit, and the visit's index; of a lap's visits that of one lap."""
        visits, begun = [v["region"] for v in self.plan["robots"][robot]["visits"]], self.plan["robots"][robot]["cycle_visit"]
        if lap is None or begun is None:
            index = [i for i, name in enumerate(visits) if name == region][number - 1]
            return self.stays(robot, region)[number - 1], index
        once, again = visits[:begun].count(region), visits[begun:].count(region)
        index = [i for i, name in enumerate(visits) if name == region and i >= begun][number - 1]
        return self.stays(robot, region)[once + lap * again + number - 1], index

    def sets_out(self, robot: str, visit: int, enters: float) -> float:
        """Return when a robot sets out for a visit: when it first differs from its start, or where it stood still last before."""
        places, speeds = self.places[robot], self.speeds[robot]
        if visit == 0 and not self.laps:
            return float(self.times[np.argmax((places != places[0]).any(axis=1))])
        before = int(np.searchsorted(self.times, enters))
        region = self.plan["robots"][robot]["visits"][visit - 1]["region"] if visit else None
        left = [b for _, b in self.stays(robot, region) if b <= enters] if region else []
        if left and not self.laps:
            before = min(before, int(np.searchsorted(self.times, left[-1])))
        still = np.flatnonzero(speeds[: before + 1] <= STANDS)
        return float(self.times[still[-1]]) if len(still) else 0.0

    def acted(self, robot: str, visit: int, which: int) -> float:
        """Return when a robot acts in a visit."""
        times = sorted(a["time"] for a in self.certificate["actions"] if (a["robot"], a["visit"]) == (robot, visit))
        return float(times[which])

    def quantity(self, robot: str, name: str) -> Floats:
        """Return a limited quantity of a robot at dense times, all rotors one after another."""
        flight = self.flights[robot]
        times = flight.inner_times(STEP)
        acceleration, vehicle = flight.at(times, 2)[:, :3], self.vehicle
        force = acceleration + np.array([0.0, 0.0, GRAVITY])

        def flat(after: float) -> tuple[Floats, Floats]:
            return flight.at(times, 2, after)[:, :3], flight.at(times, 0, after)[:, 3]

        makers: dict[str, Callable[[], Floats]] = {
            "speed": lambda: np.linalg.norm(flight.at(times, 1)[:, :3], axis=1),
            "acceleration": lambda: np.linalg.norm(acceleration, axis=1),
            "thrust": lambda: vehicle.mass * np.linalg.norm(force, axis=1),
            "tilt": lambda: np.arccos(force[:, 2] / np.linalg.norm(force, axis=1)),
            "body rate": lambda: np.linalg.norm(body_rates(flat)[:, :2], axis=1),
            "yaw rate": lambda: np.abs(body_rates(flat)[:, 2]),
            "rotor thrust": lambda: rotor_thrusts(
                flat, vehicle.mass, vehicle.arm, vehicle.inertia, vehicle.torque_to_thrust
            ).ravel(),
        }
        return makers[name.removesuffix(" (roll and pitch)")]()

    vehicle: Any = None
    """The vehicle's own numbers; set by who reads the folder, as a mission may name a profile."""


def _inside(places: Floats, body: dict[str, Any]) -> np.ndarray:
    away = places - np.array(body["center"])
    if "radii" in body:
        return ((away / np.array(body["radii"])) ** 2).sum(axis=1) <= 1.0
    return (np.abs(away) <= _half(body)).all(axis=1)


def _half(body: dict[str, Any]) -> Floats:
    """Return half the lengths of a box along the axes, which a resolved mission writes as half-spaces."""
    half = np.zeros(3)
    (part,) = body["parts"]
    for side in part:
        assert not np.any(side.get("quadratic", 0.0))
        half += np.where(np.array(side["linear"]) == 1.0, side["bound"], 0.0)
    return half


def _distance(places: Floats, body: dict[str, Any]) -> Floats:
    beyond = np.maximum(np.abs(places - np.array(body["center"])) - _half(body), 0.0)
    return np.linalg.norm(beyond, axis=1)


def faults(flown: Flown) -> list[str]:
    """Return the sentences that dense samples refute, or that nobody here can read, with why."""
    found: list[str] = []
    for claim in flown.certificate["claims"]:
        if claim["verdict"] != "holds":
            continue
        for pattern, check in _CHECKS:
            match = re.fullmatch(pattern, claim["sentence"])
            if match:
                fault = check(flown, claim, *match.groups())
                break
        else:
            fault = "no check reads this sentence"
        if fault:
            found.append(f"{claim['sentence']} -- {fault}")
    return found


def _nothing(flown: Flown, claim: dict[str, Any], *said: str) -> str:
    del flown, claim, said
    return ""


def _visits(flown: Flown, claim: dict[str, Any], robot: str, count: str) -> str:
    del claim
    visits, begun = flown.plan["robots"][robot]["visits"], flown.plan["robots"][robot]["cycle_visit"]
    flying = len(visits) + (0 if begun is None else (flown.laps - 1) * (len(visits) - begun))
    seen = sum(len(flown.stays(robot, region)) for region in flown.mission["regions"])
    return "" if (int(count), flying) == (len(visits), seen) else f"sampled are {seen} stays"


# as many parts as the sentence has
def _precedence(flown: Flown, claim: dict[str, Any], *said: str) -> str:
    then, due, place, number, _, first, done, where, which, once, _lap, every, least, _of, error = said
    if abs(float(error or 0.0) - claim["limit"]) > 1e-6 or not 0.0 <= claim["bound"] - float(least) < 1.01e-4:
        return "its numbers are not those of the claim"
    for lap in range(flown.laps) if every else (None,):
        (enters, leaves), visit = flown.stay(then, place, _ORDINALS.get(number or "first", 1), lap)
        before_laps = flown.laps > 0 and bool(once)
        (entered, left), other = flown.stay(first, where, _ORDINALS.get(which or "first", 1), None if before_laps else lap)
        happens = enters if due == "enters" else leaves if due == "leaves" else None
        if happens is None:
            happens = flown.sets_out(then, visit, enters) if due == "sets out for" else flown.acted(then, visit, 0)
        over = entered if done == "entered" else left if done == "left" else flown.acted(first, other, -1)
        if happens - over < float(least) - 2 * STEP:
            return f"sampled are {happens - over:.4f} s, from {over:.3f} to {happens:.3f} s{'' if lap is None else f' in lap {lap}'}"
    return ""


def _obstacle(flown: Flown, claim: dict[str, Any], robot: str, least: str, name: str) -> str:
    del claim
    near = {each: float(_distance(flown.places[robot], body).min()) for each, body in flown.mission["obstacles"].items()}
    if min(near.values()) < float(least) - 1e-9:
        return f"sampled is {min(near.values())} m"
    return "" if near[name] < float(least) + 0.02 else f"it is {near[name]} m from {name}"


def _wall(flown: Flown, claim: dict[str, Any], robot: str, least: str, axis: str, side: str) -> str:
    del claim
    room, places = flown.mission["workspace"], flown.places[robot]
    gaps = {"min": places - np.array(room["min"]), "max": np.array(room["max"]) - places}
    nearest = min(float(gap.min()) for gap in gaps.values())
    named = float(gaps[side][:, "xyz".index(axis)].min())
    return "" if nearest >= float(least) - 1e-9 and named < float(least) + 1e-3 else f"sampled are {nearest} m, {named} m"


def _apart(flown: Flown, claim: dict[str, Any], one: str, other: str, least: str, _of: str, error: str, asked: str) -> str:
    scale = np.array([1.0, 1.0, _weight(flown)])
    shifts = np.linspace(-1.0, 1.0, 5) * float(error or 0.0)
    a, b = flown.flights[one], flown.flights[other]
    here = a.at(flown.times)[:, :3]
    nearest = min(
        float(np.linalg.norm((here - b.at(np.maximum(flown.times + shift, 0.0))[:, :3]) * scale, axis=1).min())
        for shift in shifts
    )
    if nearest < float(least) - 1e-9:
        return f"sampled are {nearest} m"
    return "" if float(least) >= float(asked) and abs(float(asked) - claim["limit"]) < 1e-4 else "less than is asked"


def _weight(flown: Flown) -> float:
    mission = flown.mission
    return mission["separation"] / mission["separation_z"] if mission.get("separation_z") else 1.0


def _jump(
    flown: Flown, claim: dict[str, Any], robot: str, quantity: str, before: str, after: str, most: str, allowed: str
) -> str:
    del claim
    flight = flown.flights[robot]
    order = ("position", "velocity", "acceleration", "jerk").index(quantity)
    times = np.array([flight.knots[int(after)]])
    begins = flight.at(times, order)[0, :3]
    ends = flight.at(np.array([flight.knots[int(before)]]), order, flight.durations[int(before)])[0, :3]
    size = float(np.linalg.norm(begins - ends))
    return "" if size <= float(most) * (1 + 1e-6) + 1e-12 <= float(allowed) else f"sampled is {size}"


# as many parts as the sentence has
def _limit(flown: Flown, claim: dict[str, Any], robot: str, name: str, side: str, bound: str, unit: str, limit: str) -> str:
    values, number = flown.quantity(robot, name), float(bound)
    reached = float(values.max() if side == "most" else values.min())
    room = number - reached if side == "most" else reached - number
    kept = number <= float(limit) if side == "most" else number >= float(limit)
    if room < -1e-7 * max(1.0, abs(reached)) or not kept or abs(number - claim["bound"]) > 2e-4 * max(abs(number), 1e-3):
        return f"sampled is {reached} {unit}"
    return "" if room < 0.02 * abs(float(limit)) + 0.02 * abs(reached) else f"sampled is only {reached} {unit}"


def _airborne(flown: Flown, claim: dict[str, Any], robot: str, seconds: str, extra: str, limit: str) -> str:
    del claim, robot
    total = flown.end + float(extra)
    return "" if total - 1e-6 <= float(seconds) <= float(limit) else f"sampled are {total} s"


def _parts(flown: Flown, claim: dict[str, Any], robot: str, count: str) -> str:
    """Look at the cuts of the prefix and the first lap: so many, each at rest."""
    del claim
    flight, cuts = flown.flights[robot], flown.certificate["trajectories"][robot]["cuts"]
    speeds = [float(np.linalg.norm(flight.at(flight.knots[[cut]], 1)[0, :3])) for cut in cuts]
    right = int(count) == len(cuts) + (0 not in cuts)
    return "" if right and max(speeds) < 1e-3 else f"there are cuts at {cuts}, flown at {speeds} m/s"


_NUMBER = r"(\d+(?:\.\d+)?(?:e-?\d+)?)"
_CHECKS: tuple[tuple[str, Callable[..., str]], ...] = (
    (r"Every team word satisfies `.*`\.", _nothing),
    (r"Every team word that keeps the stated precedences satisfies `.*`\.", _nothing),
    (r"Every word of (\w+) is a trace of its transition system\.", _nothing),
    (r"(\w+) passes no opening, as planned\.", _nothing),
    (r"(\w+) makes its (\d+) planned visits, in order, and no other\.", _visits),
    (
        rf"In flight (\w+) (sets out for|enters|leaves|acts in) {_PLACE} only when (\w+) has (entered|left|acted in) {_PLACE}()"
        rf"(, in each lap)?, by (?:at least )?{_NUMBER} s(, of which clocks that differ may take {_NUMBER} s)?\.",
        _precedence,
    ),
    (r"(\w+) flies in (\d+) parts of at most \d+ pieces \(its vehicle holds \w+\)\. At each cut .*\.", _parts),
    (r"(\w+) never does what would have to wait: .*\.", _nothing),
    (rf"(\w+) stays {_NUMBER} m from obstacle '(\w+)' and from every other\.", _obstacle),
    (rf"(\w+) stays {_NUMBER} m from the wall ([xyz]) (min|max)\.", _wall),
    (
        rf"(\w+) and (\w+) stay {_NUMBER} m apart( with clocks up to {_NUMBER} s apart)?; {_NUMBER} m are asked \(separation .*\)\.",
        _apart,
    ),
    (rf"(\w+): the (position|velocity|acceleration|jerk) between pieces (\d+) and (\d+) jumps by at most {_NUMBER}; {_NUMBER} is allowed\.", _jump),
    (r"(\w+): the [\w' ]+ jumps by at most .* is allowed\.", _nothing),
    (rf"(\w+)'s ([a-z ]+(?: \(roll and pitch\))?) is at (most|least) {_NUMBER} (\S+) \(limit {_NUMBER}\)\.", _limit),
    (rf"(\w+) is in the air for {_NUMBER} s, {_NUMBER} s of them for .*; its endurance is {_NUMBER} s\.", _airborne),
)  # fmt: skip
