"""The door: what others planned, judged for all times, with the tightest instants of what holds and every breach of what does not.

From 0 until the last flight ends every drone is judged, at rest on its first position before its own flight begins and on its last one
after it has ended: take-off and landing are part of what is judged, and so is standing on the ground.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from verify.arithmetic.balls import Floats
from verify.certificate import claim_data, payload_digest, versions
from verify.claims.claim import Claim, claim_of
from verify.data.errors import BadInput
from verify.data.mission import Mission, check_mission
from verify.data.progress import Progress, silent
from verify.foreign.asked import Asked, AuditLimits, require_agents, resolve
from verify.foreign.distances import Breach, Closest, Separation, judge_distances
from verify.foreign.extremes import Extreme, rate_extremes, wall_extremes
from verify.foreign.fleet import Fleet
from verify.foreign.instants import TIGHTEST, Instant, all_of
from verify.foreign.joints import Joints, home_jumps, jumps
from verify.foreign.letters import check_words, word_claims
from verify.foreign.near_pieces import near_pieces
from verify.foreign.reading import read_fleet
from verify.foreign.shows.fence_claims import fence_claims
from verify.logic.verdict import Outcome

AUDIT_FORMAT = 1

_NOTHING = 1e-12
"""Bounds below this are told as 0: what keeps them above it is rounding."""

POSITION_JUMP = 1e-3
"""m by which positions may jump between pieces; shows are written in millimetres."""


@dataclass(frozen=True, eq=False)
class Audit:
    """What was judged of others' flights; true only where every claim is proved.

    Attributes:
        source: Names the files.
        digest: SHA-256 of the flights' numbers.
        drones: How many.
        pieces: Of all drones together, rests included.
        duration: Until the last flight ends, in s.
        asked: The limits.
        claims: One of each kind for all drones where it holds, or one for each drone or pair that breaks it.
        tightest: For each kind of claim the instants nearest to the limit, nearest first.
        versions: Of the software that judged.
        notes: What is not judged or not asked of what the files hold, in sentences.
        fleet: The flights, for pictures; no part of what is written.
    """

    source: str
    digest: str
    drones: int
    pieces: int
    duration: float
    asked: Mapping[str, object]
    claims: tuple[Claim, ...]
    tightest: Mapping[str, tuple[Instant, ...]]
    versions: Mapping[str, str]
    notes: tuple[str, ...]
    fleet: Fleet

    @property
    def holds(self) -> bool:
        """Whether every claim is proved."""
        return bool(self.claims) and all(claim.outcome == "holds" for claim in self.claims)

    def __bool__(self) -> bool:
        return self.holds

    @property
    def broken(self) -> tuple[Claim, ...]:
        """Claims that are not proved."""
        return tuple(claim for claim in self.claims if claim.outcome != "holds")

    def to_dict(self) -> dict[str, Any]:  # of any type: JSON nests
        """Return the audit as plain data, with a digest of itself."""
        data = {
            "format": AUDIT_FORMAT,
            "source": self.source,
            "flights": self.digest,
            "drones": self.drones,
            "pieces": self.pieces,
            "duration": self.duration,
            "asked": dict(self.asked),
            "holds": self.holds,
            "claims": [claim_data(claim) for claim in self.claims],
            "tightest": {name: [asdict(instant) for instant in row] for name, row in self.tightest.items()},
            "notes": list(self.notes),
            "versions": dict(self.versions),
        }
        return {**data, "digest": payload_digest(data)}

    def to_json(self) -> str:
        """Return the audit as JSON."""
        return json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n"


def audit(
    files: str | Path | Sequence[str | Path],
    mission: Mission | None = None,
    limits: AuditLimits = AuditLimits(),  # noqa: B008  # frozen
    *,
    progress: Progress = silent,
) -> Audit:
    """Judge what others planned, for all times.

    Args:
        files: A Skybrush show (`.skyc`), or a folder of CSV files, each of one robot as crazyswarm2 has them, or the files.
        mission: Whose agents they are: its workspace, separation, vehicles' limits, margin, obstacles and rims are asked, and its formula
            where it has one.
        limits: Single limits, in place of the mission's or beside it.
        progress: Called with what is being done and the share that is done.

    Raises:
        BadInput: A file is at fault, nothing is asked, the drones are not the mission's agents, or its trace is infinite.
        InternalError: Two independent answers to the formula disagree: a bug of ours.
        MissingEngine: The mission has a formula, and Spot is absent.
    """
    if not isinstance(limits, AuditLimits):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
        raise BadInput(f"limits must be verify.AuditLimits(...), not {type(limits).__name__}.")
    if mission is not None:
        mission = check_mission(mission, to_plan=False)
        check_words(mission)
    progress("reading", 0.0)
    fleet = read_fleet(files)
    if mission is not None:
        require_agents(fleet, mission)
        starts = (
            (*homes, ("start", 0, mission.agents[name].start)) for name, homes in zip(fleet.names, fleet.homes, strict=True)
        )
        fleet = replace(fleet, homes=tuple(starts))
    asked = resolve(fleet, mission, limits)
    found = judge_fleet(fleet, asked, progress)
    if mission is None:
        return found
    progress("the mission's words", 0.9)
    return replace(found, claims=(*found.claims, *word_claims(mission, fleet, asked)))


def judge_fleet(fleet: Fleet, asked: Asked, progress: Progress = silent) -> Audit:
    """Judge flights that were read.

    Args:
        fleet: The drones.
        asked: What is asked of them.
        progress: Called with what is being done and the share that is done.
    """
    claims: list[Claim] = []
    tightest: dict[str, tuple[Instant, ...]] = {}

    def take(name: str, found: tuple[list[Claim], list[Instant]]) -> None:
        claims.extend(found[0])
        tightest[name] = tuple(found[1])

    progress("how pieces join", 0.1)
    steps = jumps(fleet, 0)
    claims.extend(_joint_claims(fleet, steps, asked))
    if not (asked.workspace is None and asked.min_height is None and asked.altitude is None):
        progress("the workspace", 0.2)
    if asked.workspace is not None:
        low, high = asked.workspace.min, asked.workspace.max
        walls = [(axis, side, corner[axis]) for axis in range(3) for side, corner in (("min", low), ("max", high))]
        found = [extreme for axis, side, at in walls for extreme in _wall(fleet, axis, side, at, asked.margin)]
        take("workspace", _told(fleet, "workspace", "m", _nearest_walls(found)))
    if asked.min_height is not None:
        take("height", _told(fleet, "height", "m", _wall(fleet, 2, "min", asked.min_height, asked.margin)))
    if asked.altitude is not None:
        take("altitude", _told(fleet, "altitude", "m", _wall(fleet, 2, "max", asked.altitude, asked.margin)))
    if asked.fences:
        progress("the geofence", 0.25)
        take("geofence", fence_claims(fleet, asked.fences, asked.margin))
    for rate in asked.rates:
        progress("speeds" if rate.order == 1 else "accelerations", 0.2 + 0.1 * rate.order)
        take(rate.name, _told(fleet, rate.name, rate.unit, rate_extremes(fleet, rate), rate.what))
    if asked.least is not None and len(fleet) == 1:
        sentence = f"There is one drone, {fleet.names[0]}, which has none to keep apart from."
        claims.append(claim_of("separation", "holds", sentence, robot=fleet.names[0], unit="m", limit=asked.most))
    elif asked.least is not None:
        progress("distances", 0.5)
        take("separation", _separation(fleet, asked, steps, progress))
    return Audit(
        source=fleet.source, digest=fleet.digest, drones=len(fleet), pieces=len(fleet.values), duration=float(fleet.end),
        asked=MappingProxyType(asked.said), claims=tuple(claims), tightest=MappingProxyType(tightest),
        versions=MappingProxyType(versions()), notes=(*fleet.notes, *asked.notes), fleet=fleet,
    )  # fmt: skip


def _wall(fleet: Fleet, axis: int, side: str, at: float, margin: Fraction) -> list[Extreme]:
    return wall_extremes(fleet, axis, side, Fraction(at) + (margin if side == "min" else -margin))


def _nearest_walls(found: Iterable[Extreme]) -> list[Extreme]:
    """Return for each drone the wall that it comes nearest to, and every wall that it passes."""
    by_drone: dict[int, list[Extreme]] = {}
    for extreme in found:
        by_drone.setdefault(extreme.drone, []).append(extreme)
    result: list[Extreme] = []
    for row in by_drone.values():
        broken = [extreme for extreme in row if extreme.outcome != "holds"]
        result += broken or [min(row, key=lambda e: abs(e.bound - e.limit))]
    return result


# five parameters: the claim's name and what it speaks of
def _told(fleet: Fleet, name: str, unit: str, found: Sequence[Extreme], what: str = "") -> tuple[list[Claim], list[Instant]]:
    """Word what one kind of extreme comes to: one claim where all drones keep the limit, else one for each that does not."""
    least = not what
    what = what or {"workspace": "position"}.get(name, name)

    def room(extreme: Extreme) -> float:
        return abs(extreme.bound - extreme.limit) * (1 if extreme.outcome == "holds" else -1)

    order = sorted(found, key=room)
    figure = f"{order[0].bound:.5g}" if abs(order[0].bound) > _NOTHING else "0"
    claims = [_broken(fleet, name, unit, extreme, room(extreme)) for extreme in order if extreme.outcome != "holds"]
    if not claims:
        near, robot = order[0], fleet.names[order[0].drone]
        quantity = {"workspace": f"{room(near):.4g} m from the wall {near.what}", "limits": f"{figure} {unit}"}
        reached = quantity.get(name.split(".")[0], f"z = {figure} m")
        verb = "comes nearest to it" if least else "is nearest to it"
        sentence = f"{all_of(fleet)} keep the limit of {what} at all times; {robot} {verb}, with {reached} at {near.time:.3f} s"
        sentence += "." if name == "workspace" else f" (limit {near.limit:.5g} {unit})."
        claims = [
            claim_of(
                name,
                "holds",
                sentence,
                robot=robot,
                unit=unit,
                bound=near.bound,
                limit=near.limit,
                margin=room(near),
                time=near.time,
            )
        ]
    return claims, [Instant(fleet.names[e.drone], None, e.reached, e.limit, e.time) for e in order[:TIGHTEST]]


def _broken(fleet: Fleet, name: str, unit: str, extreme: Extreme, room: float) -> Claim:
    robot = fleet.names[extreme.drone]
    over = f"at {extreme.time:.4f} s; the limit is {extreme.limit:.6g} {unit}."
    if name == "workspace":
        sentence = f"{robot} passes the wall {extreme.what} at {extreme.limit:.6g} m: it is at {extreme.reached:.6g} m at {extreme.time:.4f} s."
    elif name == "height":
        sentence = (
            f"{robot} comes down to z = {extreme.reached:.6g} m at {extreme.time:.4f} s; {extreme.limit:.6g} m are asked."
        )
    elif name == "altitude":
        sentence = f"{robot} rises to z = {extreme.reached:.6g} m {over}"
    else:
        sentence = f"{robot}'s {extreme.what} reaches {extreme.reached:.6g} {unit} {over}"
    return claim_of(
        name, "fails", sentence, robot=robot, unit=unit, bound=extreme.bound, limit=extreme.limit, margin=room, time=extreme.time,
        what=extreme.what,
    )  # fmt: skip


def _joint_claims(fleet: Fleet, steps: Joints, asked: Asked) -> Iterator[Claim]:
    """Yield what is claimed of joints: positions join, velocities too where acceleration is asked, and drones stand where the file says."""
    yield from _jump_claims(fleet, steps, "position", "m", POSITION_JUMP)
    if any(rate.order == 2 for rate in asked.rates):
        yield from _jump_claims(fleet, jumps(fleet, 1), "velocity", "m/s", asked.velocity_jump)
    for drone, what, end, gap in home_jumps(fleet):
        if gap > POSITION_JUMP:
            name, time = fleet.names[drone], float(fleet.end) if end else 0.0
            sentence = f"{name}: its {what} is {gap:.4g} m from where its path {'ends' if end else 'begins'}; {POSITION_JUMP:g} m are allowed."
            yield claim_of(
                "continuity", "fails", sentence, robot=name, unit="m", bound=gap, limit=POSITION_JUMP, margin=POSITION_JUMP - gap,
                time=time, what=what,
            )  # fmt: skip


def _jump_claims(fleet: Fleet, found: Joints, what: str, unit: str, limit: float) -> Iterator[Claim]:
    def of(drone: int, outcome: Outcome, sentence: str) -> Claim:
        size = float(found.jumps[drone])
        return claim_of(
            "continuity", outcome, sentence, robot=fleet.names[drone], unit=unit, bound=size, limit=limit, margin=limit - size,
            time=float(found.times[drone]), what=what,
        )  # fmt: skip

    most = int(np.argmax(found.jumps))
    if found.jumps[most] <= limit:
        allowed = f"more than {found.jumps[most]:.3g} {unit} between pieces; {limit:g} {unit} are allowed."
        yield of(most, "holds", f"{all_of(fleet)}: no {what} jumps by {allowed}")
        return
    for drone in np.flatnonzero(~(found.jumps <= limit)).tolist():
        when = f"by {found.jumps[drone]:.4g} {unit} at {found.times[drone]:.4f} s; {limit:g} {unit} are allowed."
        outcome = "fails" if found.sure[drone] > limit else "undecided"
        yield of(drone, outcome, f"{fleet.names[drone]}: its {what} jumps {when}")


def _separation(fleet: Fleet, asked: Asked, steps: Joints, progress: Progress) -> tuple[list[Claim], list[Instant]]:
    assert asked.least is not None
    stretched: Floats = steps.jumps * (max(1.0, float(asked.weight)) * (1 + 2.0**-40))
    pairs = Separation(asked.least, asked.most, asked.weight, stretched)
    closest = Closest()

    def told(share: float) -> None:
        progress("distances", 0.5 + 0.5 * share)

    nearest, breaches = judge_distances(fleet, pairs, near_pieces(fleet, pairs, closest, told), closest)
    if breaches:
        instants = [Instant(fleet.names[b.one], fleet.names[b.other], b.distance, b.limit, b.time) for b in breaches[:TIGHTEST]]
        return [_breach(fleet, breach) for breach in breaches], instants
    one, other = fleet.names[nearest.one], fleet.names[nearest.other]
    limit = float(asked.least(np.array([nearest.one]), np.array([nearest.other]))[0])
    bound = nearest.low
    sentence = (
        f"{all_of(fleet)} stay {bound:.4f} m apart at all times, in all {len(fleet) * (len(fleet) - 1) // 2} pairs; {one} and {other} are nearest, "
        f"with {nearest.high:.4f} m at {nearest.time:.3f} s ({limit:.4f} m are asked)."
    )
    claim = claim_of(
        "separation",
        "holds",
        sentence,
        robot=one,
        other=other,
        unit="m",
        bound=bound,
        limit=limit,
        margin=bound - limit,
        time=nearest.time,
    )
    return [claim], [Instant(one, other, nearest.high, limit, nearest.time)]


def _breach(fleet: Fleet, breach: Breach) -> Claim:
    one, other = fleet.names[breach.one], fleet.names[breach.other]
    sentence = (
        f"{one} and {other} are nearer than {breach.limit:.4f} m from {breach.start:.4f} s to {breach.stop:.4f} s: "
        f"{breach.distance:.4f} m at {breach.time:.4f} s."
    )
    if not breach.sure:
        sentence = (
            f"{one} and {other} cannot be shown to keep {breach.limit:.4f} m: they come within {breach.distance:.4f} m at {breach.time:.4f} s, "
            "not counting what their paths jump between pieces."
        )
    return claim_of(
        "separation", "fails" if breach.sure else "undecided", sentence, robot=one, other=other, unit="m", bound=breach.distance,
        limit=breach.limit, margin=breach.distance - breach.limit, time=breach.time,
    )  # fmt: skip
