"""Reasons why refinement found no flight: the narrow place, the robots, what was tried, and what would help."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from refine.coordination.spacing import firm_pairs
from refine.obstacles.narrow_places import NarrowPlace, narrow_place
from verify.data import Infeasible, Plan, Witness
from verify.data.language.lasting import lasting_regions
from verify.data.obstruction import Obstruction
from verify.data.progress import Progress
from verify.data.validation.spacing import spacing_of

Found = TypeVar("Found")

_OWN = "smoothing the path of"
"""How sentences on one robot's own path begin, which is no means of keeping robots apart."""


def with_reasons(plan: Plan, find: Callable[[Progress], Found], tell: Progress) -> Found:
    """Return what is found; an error says what stands in the way, what was tried and what would help.

    Args:
        plan: What is refined.
        find: Looks for a flight, and tells what it tries.
        tell: Told the same.

    Raises:
        Infeasible: As `find` raises it, with its `obstruction`.
    """
    tried: dict[str, None] = {}

    def telling(sentence: str, share: float) -> None:
        if not sentence.startswith(_OWN):
            tried[sentence] = None
        tell(sentence, share)

    try:
        return find(telling)
    except Infeasible as error:
        if error.obstruction is None and error.witness is not None:
            error.because(_obstruction(plan, error, error.witness, tuple(tried)))
        raise


def _obstruction(plan: Plan, error: Infeasible, witness: Witness, tried: tuple[str, ...]) -> Obstruction:
    """Return what stands in the way of a plan's flight."""
    mission, what = plan.mission, str(error)
    pair = tuple(name for name in (witness.robot, witness.other) if name is not None)
    match witness.claim:
        case "separation" if len(pair) == 2 and witness.region is None:
            place = narrow_place(mission, [plan.robots[name] for name in pair], pair, spacing_of(mission))
            if place is None and (close := _close_regions(plan, pair)) is not None:
                one, other, far = close
                where = f"Robots in '{one}' and '{other}' at once are {far:.3g} m apart at the most, inside by the margin."
                return Obstruction(what, pair, where, tried, (f"'{one}' and '{other}' further apart, or larger", *_less(plan)))
            return Obstruction(what, pair, "" if place is None else place.sentence, tried, _helps_to_pass(plan, pair, place))
        case "separation":
            return Obstruction(
                what, pair, tried=tried, helps=(f"a larger '{witness.region}'", "fewer robots in it", *_less(plan))
            )
        case "formula":
            return Obstruction(what, pair or tuple(plan.robots), tried=tried, helps=("one more region to wait in",))
        case "visits" | "obstacles" | "workspace":
            where = f" around '{witness.region}'" if witness.region is not None else ""
            return Obstruction(what, pair, helps=(f"more room{where}", "a smaller `margin`"))
        case _:
            return Obstruction(what, pair)


def _close_regions(plan: Plan, pair: tuple[str, ...]) -> tuple[str, str, float] | None:
    """Return two regions that two robots visit, in which both are too near each other wherever they are, and how far apart at the most, m; else None."""
    mission, kept = plan.mission, spacing_of(plan.mission)
    visited = [{visit.region for visit in plan.robots[name].visits} for name in pair]
    for one, other in itertools.product(*map(sorted, visited)):
        a, b = mission.all_regions[one], mission.all_regions[other]
        reach = np.abs(np.subtract(a.center, b.center)) + a.half_lengths + b.half_lengths - 2.0 * mission.margin
        far = float(np.linalg.norm(reach * (1.0, 1.0, kept.z_scale)))
        if one != other and far < kept.at_rest:
            return one, other, far
    return None


def _helps_to_pass(plan: Plan, pair: tuple[str, ...], place: NarrowPlace | None) -> tuple[str, ...]:
    """Return what would let two robots pass each other."""
    if _rest_too_near(plan, pair):
        return ("starts and ends further apart", *_less(plan))
    if place is None:
        return ("a region to wait in off each other's ways", *_less(plan))
    rest = f"{'room' if place.borders else 'a region'} beside it in which one of them can wait"
    if place.ending:
        hovers = "hovers" if any(plan.robots[name].still for name in place.ending) else "ends"
        rest = f"an end or a last region elsewhere for {' and '.join(place.ending)}, as it {hovers} there"
        if len(place.ending) > 1:
            rest = f"ends or last regions elsewhere for {' and '.join(place.ending)}"
        kept = {name: sorted(lasting_regions(plan.mission, name, inside=True)) for name in place.ending}
        if all(kept[name] and plan.robots[name].still for name in place.ending):
            lets = [f"{name} leave {' and '.join(repr(region) for region in kept[name])}" for name in place.ending]
            rest = f"a formula that lets {' and '.join(lets)}"
    door = "a second door" if place.is_door else "a second way past it"
    borders = " or ".join(f"'{name}'" for name in dict.fromkeys(place.borders))
    crossed = [f"a formula that lets one of them cross the border of {borders}"] if borders else []
    return (rest, door, *crossed, f"{place.needed:.3g} m of width", *(_less(plan) if place.passed_without_margin else ()))


def _rest_too_near(plan: Plan, pair: tuple[str, ...]) -> bool:
    """Tell whether two robots start, or end where nothing can be moved, nearer to each other than they may."""
    kept = spacing_of(plan.mission)
    return any({name, other} == set(pair) and kept.between(a, b) < kept.at_rest for name, other, _, a, b in firm_pairs(plan))


def _less(plan: Plan) -> tuple[str, ...]:
    """Return what robots may keep less of: the separation, as far as their radii allow it, and the margin."""
    mission = plan.mission
    radii = sorted(mission.vehicle_of(name).radius for name in plan.robots)[-2:]
    smaller = ["a smaller `separation`"] if mission.separation > sum(radii) else []
    return (*smaller, *(["a smaller `margin`"] if mission.margin > 0.0 else []))
