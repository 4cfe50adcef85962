"""Claims on take-offs and landings outside of paths: distances of others to them, their lowest points, and what is not checked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction

from verify.claims.claim import Claim, claim_of
from verify.data.mission import Mission
from verify.third_party.columns import TooNear
from verify.third_party.distances import Separation
from verify.third_party.extremes import Extreme
from verify.third_party.fleet import Column, Fleet
from verify.third_party.instants import TIGHTEST, Instant


def column_claims(fleet: Fleet, pairs: Separation, found: Sequence[TooNear]) -> tuple[list[Claim], list[Instant]]:
    """Word how near drones come to others' take-offs and landings: one claim where all keep apart, else one for each column and drone.

    Args:
        fleet: The drones, some with columns.
        pairs: How far apart they must be.
        found: What is too near.

    Returns:
        The claims, and the instants of those that do not hold.
    """
    if found:
        names = fleet.names
        instants = [
            Instant(names[met.column.drone], names[met.other], met.distance, met.limit, met.time) for met in found[:TIGHTEST]
        ]
        return [_met(fleet, met, pairs.above) for met in found], instants
    ups, downs = (len({c.drone for c in fleet.columns if c.kind == kind}) for kind in ("take-off", "landing"))
    limit = pairs.fewest
    where = "" if pairs.above is None else f", above z = {pairs.above:g} m"
    sentence = (
        f"Wherever {ups} drones are straight below the beginnings of their paths before these begin, and {downs} straight below the ends after "
        f"these, and however fast they climb and land, all drones stay as far from them as is asked, {limit:.4f} m or more{where}."
    )
    return [claim_of("separation", "holds", sentence, unit="m", bound=limit, limit=limit, margin=0.0)], []


def _met(fleet: Fleet, met: TooNear, above: float | None) -> Claim:
    column, robot, other = met.column, fleet.names[met.column.drone], fleet.names[met.other]
    if met.beside is not None:
        doing = f"{other} where it {'climbs' if met.beside.kind == 'take-off' else 'lands'} at {_place(met.beside)}"
    else:
        doing = f"{other} on its path"
    verb = "climbs to its path" if column.kind == "take-off" else "lands"
    where = "" if above is None else f" above z = {above:g} m"
    come = f"{robot}, which {verb} at {_place(column)}, and {doing}"
    if met.sure:
        sentence = f"{come} come nearer than {met.limit:.4f} m{where}, however fast they are: {met.distance:.4f} m, as at {met.time:.4f} s."
    else:
        sentence = (
            f"{come} cannot be shown to keep {met.limit:.4f} m{where}: they may come within {met.distance:.4f} m at {met.time:.4f} s, as the file "
            "does not say how fast drones climb and land."
        )
    return claim_of(
        "separation", "fails" if met.sure else "undecided", sentence, robot=robot, other=other, unit="m", bound=met.distance,
        limit=met.limit, margin=met.distance - met.limit, time=met.time, what=column.kind,
    )  # fmt: skip


def _place(column: Column) -> str:
    x, y = (float(value) for value in column.place)
    return f"({x:.4g}, {y:.4g}) between z = {column.low:.4g} m and {column.high:.4g} m"


def columns_lowest(fleet: Fleet, found: Sequence[Extreme], least: Fraction) -> list[Extreme]:
    """Return how near drones come to the floor, take-offs and landings outside of their paths included.

    Args:
        fleet: The drones.
        found: The same of their paths, drone by drone.
        least: The floor, exact, in m.
    """
    result = list(found)
    for column in fleet.columns:
        known = result[column.drone]
        if column.low >= known.bound:
            continue
        time = column.since if column.since is not None else Fraction(0)
        outcome = "holds" if Fraction(column.low) >= least else "fails"
        result[column.drone] = replace(known, bound=column.low, reached=column.low, time=float(time), outcome=outcome)
    return result


def unknown_claims(mission: Mission, fleet: Fleet) -> Iterator[Claim]:
    """Yield that nothing is proved of a mission's obstacles, hoops and formula where drones take off and land outside their paths.

    Args:
        mission: Whose agents the drones are.
        fleet: The drones.
    """
    if fleet.columns and (mission.obstacles or mission.hoops or mission.spec.formula is not None):
        robot = fleet.names[fleet.columns[0].drone]
        sentence = (
            f"{len({column.drone for column in fleet.columns})} drones, {robot} the first, take off or land outside their paths; of obstacles, rims "
            "and the formula nothing is proved there. Let the paths begin and end on the ground."
        )
        yield claim_of("continuity", "undecided", sentence, robot=robot)
