"""Take-offs and landings of a show's drones outside their paths, by the homes, landing places and times in its file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from verify.arithmetic import exact
from verify.data.errors import BadInput
from verify.third_party.fleet import Column, Fleet, Home

FLAT = 1e-3
"""m; a path that begins or ends no higher than this above the ground does so on it."""
SAME_TIME = Fraction(1, 1000)
"""s; landing times are told from the ends of paths no more finely."""

Place = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Ends:
    """Settings of a drone beside its path.

    Attributes:
        home: Where it stands before take-off, in m.
        land: Where it lands, in m.
        landing: When the autopilot lands it, in s of the show.
    """

    home: Place | None
    land: Place | None
    landing: float | None


def columns_of(fleet: Fleet, ends: Sequence[Ends]) -> tuple[tuple[Column, ...], tuple[tuple[Home, ...], ...], tuple[str, ...]]:
    """Return where drones take off and land outside their paths, where paths must begin and end by the file, and what is assumed.

    The ground is the least height of all homes and of the paths' ends; where no drone has a home, of the show's zero, too.

    Args:
        fleet: The drones.
        ends: What is said of each.

    Raises:
        BadInput: A landing time is before its drone's path begins.
    """
    count = len(fleet)
    edges = [(_place(fleet, int(fleet.first[k]), 0), _place(fleet, int(fleet.first[k + 1]) - 1, 1)) for k in range(count)]
    heights = [float(place[2]) for pair in edges for place in pair]
    homes = [end.home[2] for end in ends if end.home is not None]
    ground = min([*heights, *(homes or [0.0])])
    columns: list[Column] = []
    stands: list[tuple[Home, ...]] = []
    early = 0
    for drone, (end, (first, last)) in enumerate(zip(ends, edges, strict=True)):
        begun, over = _path_times(fleet, drone)
        known: list[Home] = []
        foot = ground
        if end.home is not None:
            foot = min(end.home[2], float(first[2]))
            rises = float(first[2]) - end.home[2] > FLAT
            known.append(("home", 0, (*end.home[:2], float(first[2]) if rises else end.home[2])))
        if float(first[2]) - foot > FLAT:
            columns.append(Column(drone, "take-off", (first[0], first[1]), foot, float(first[2]), None, begun))
        foot = ground
        if end.land is not None:
            sinks = float(last[2]) - end.land[2] > FLAT
            foot = end.land[2] if sinks else ground
            known.append(("landing place", 1, (*end.land[:2], float(last[2]) if sinks else end.land[2])))
        landing = over if end.landing is None else Fraction(end.landing)
        if landing < begun:
            raise BadInput(
                f"{fleet.source}: {fleet.names[drone]}: its landingTime {float(landing):g} s is before its path begins at {float(begun):g} s; it "
                "counts from the show's start."
            )
        if landing < over - SAME_TIME:
            early += 1
            x, y, z = _at(fleet, drone, landing)
            columns.append(Column(drone, "landing", (x, y), min(foot, float(z)), float(z), landing, None))
        if float(last[2]) - foot > FLAT:
            columns.append(Column(drone, "landing", (last[0], last[1]), foot, float(last[2]), over, None))
        stands.append(tuple(known))
    return tuple(columns), tuple(stands), _assumed(columns, count, early)


def _assumed(columns: Sequence[Column], count: int, early: int) -> tuple[str, ...]:
    notes: list[str] = []
    for kind, verb, when in (
        ("take-off", "climb straight up to where their paths begin", "at any time before they begin"),
        ("landing", "land straight down from where their paths end", "at any time from then on"),
    ):
        own = [column for column in columns if column.kind == kind]
        if own:
            high, low = max(column.high for column in own), min(column.low for column in own)
            drones = len({column.drone for column in own})
            notes.append(
                f"{drones} of {count} drones are assumed to {verb}, between z = {low:.4g} m and {high:.4g} m, {when}: the file does not say how "
                "fast, and limits of speed and acceleration are not judged there."
            )
    if early:
        notes.append(
            f"{early} of {count} drones have a landingTime before their path ends: both the landing and the rest of the path are judged."
        )
    return tuple(notes)


def _path_times(fleet: Fleet, drone: int) -> tuple[Fraction, Fraction]:
    """Return from when until when a drone's own path lasts, without the rests that fill the show, in s."""
    first, last = int(fleet.first[drone]), int(fleet.first[drone + 1]) - 1
    rested = fleet.rests[drone]
    return fleet.stop(first) if rested[0] else fleet.start(first), fleet.start(last) if rested[1] else fleet.stop(last)


def _place(fleet: Fleet, row: int, end: int) -> tuple[Fraction, Fraction, Fraction]:
    index = int(fleet.degrees[row]) if end else 0
    x, y, z = (Fraction(value) for value in fleet.values[row, :, index].tolist())
    return x, y, z


def _at(fleet: Fleet, drone: int, time: Fraction) -> tuple[Fraction, Fraction, Fraction]:
    rows = np.arange(int(fleet.first[drone]), int(fleet.first[drone + 1]))
    starts = fleet.knots[fleet.knot[rows], 0]
    row = int(rows[max(int(np.searchsorted(starts, float(time), side="right")) - 1, 0)])
    if time < fleet.start(row):
        row -= 1
    share = exact.rational((time - fleet.start(row)) / (fleet.stop(row) - fleet.start(row)))
    x, y, z = (exact.fraction(p(share)) for p in fleet.exactly(row))
    return x, y, z
