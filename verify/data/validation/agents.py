"""Rules for a mission's agents: starts and ends clear of walls, borders, rims, openings and each other, and histories that fit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from verify.data.errors import did_you_mean
from verify.data.sections import Agent, Robot, Spec
from verify.data.shapes.inequalities import Point
from verify.data.shapes.region import Hoop, Region
from verify.data.validation.faults import Finding
from verify.data.validation.spacing import ROUNDING, crowded, needed, spacing
from verify.data.vehicle import Vehicle


def broken_by_agents(
    values: Mapping[str, Any],  # of any type: each section has its own
    systems: Mapping[str | None, Robot],
    regions: list[str],
    *,
    to_plan: bool = True,
) -> Iterator[Finding]:
    """Yield what is wrong with a mission's agents.

    Args:
        values: The sections that are sound by themselves, by key, as the schema's types.
        systems: The internal states that are sound: of the tables of `robots` by name, and those of `robot` by None.
        regions: Names of all regions, of those that are not sound as well.
        to_plan: Whether starts and ends must leave room, as planning needs it.
    """
    yield from _histories(values, systems, regions)
    if not to_plan:
        return
    agents: Mapping[str, Agent] = values.get("agents", {})
    spec: Spec | None = values.get("spec")
    for name, agent in agents.items():
        if agent.end is not None and spec is not None and spec.trace == "infinite":
            yield (
                ("agents", name, "end"),
                "an infinite trace never ends, so there is nowhere to finish; leave `end` out, or set `spec.trace: finite`.",
            )
        for key, point in (("start", agent.start), ("end", agent.end)):
            if point is not None:
                for sentence in misplaced(point, values, agent.vehicle or values.get("vehicle")):
                    yield ("agents", name, key), sentence
    yield from _separation(values, agents)


def misplaced(point: Point, values: Mapping[str, Any], vehicle: Vehicle | None) -> Iterator[str]:
    """Yield what a robot that hovers at a point would be too near to.

    Args:
        point: x, y, z in m.
        values: A mission's `workspace`, `margin`, `hoops` and `regions`, as far as they are sound.
        vehicle: Which flies there; None where it is not known.
    """
    workspace = values.get("workspace")
    margin = values.get("margin", 0.05)
    shown = f"({', '.join(f'{x:g}' for x in point)})"
    if workspace is not None and not workspace.holds(point):
        low, high = (", ".join(f"{x:g}" for x in corner) for corner in (workspace.min, workspace.max))
        yield f"{shown} lies outside the workspace [{low}] to [{high}]."
    elif workspace is not None and _wall(point, workspace) < margin + ROUNDING:
        yield (
            f"{shown} is {_wall(point, workspace):.4f} m from the workspace's wall; {margin + ROUNDING:g} m is needed: the margin "
            f"and {ROUNDING:g} m for rounding."
        )
    for name, region in {**values.get("hoops", {}), **values.get("regions", {})}.items():
        if _on_edge(point, region, margin + ROUNDING):
            thin = region.inner_radius <= margin + ROUNDING
            where = f"outside: its middle is only {region.inner_radius:.4g} m inside" if thin else "inside or outside"
            yield f"{shown} is within the margin {margin:g} m of the edge of '{name}'; be clearly {where}."
        if not isinstance(region, Hoop):
            continue
        rim, opening = _ring_distances(point, region)
        if vehicle is not None and rim < vehicle.radius + margin + ROUNDING:
            yield f"{shown} is {rim:.3f} m from the rim of '{name}'; vehicle radius and margin need {vehicle.radius + margin:.3f} m."
        elif opening < margin + ROUNDING:
            yield (
                f"{shown} is {opening:.3f} m from the opening of '{name}', which robots only fly through: the margin needs "
                f"{margin:g} m. Hover in front of it."
            )


def _separation(values: Mapping[str, Any], agents: Mapping[str, Agent]) -> Iterator[Finding]:
    """Yield what lets robots touch, and robots that start or end too near each other."""
    separation, separation_z = values.get("separation", 0.3), values.get("separation_z")
    asked = {"separation": separation, "separation_z": separation_z}
    if separation_z == 0:
        yield ("separation_z",), "must be above 0 m; leave it out for the same clearance in all directions."
        del asked["separation_z"]
    if len(agents) < 2:
        return
    for key, value in asked.items():
        if value is not None and (widest := _widest(values, agents)) is not None and value < widest[0]:
            where = " above each other" if key == "separation_z" else ""
            yield (key,), f"{value:g} m between centres lets robots{where} touch: {widest[1]} need {widest[0]:g} m."
    margin = values.get("margin", 0.05)
    kept = spacing(separation, separation_z, margin)
    for pair in crowded(agents, kept):
        yield (
            ("agents", pair.second, pair.what),
            f"is {pair.distance:.4f} m from {pair.first}'s {pair.what}; {needed(kept, separation, margin)}.",
        )


def _widest(values: Mapping[str, Any], agents: Mapping[str, Agent]) -> tuple[float, str] | None:
    """Return the greatest sum of two robots' radii, in m, and what it is the sum of; None where a vehicle is not known."""
    flown = [(name, agent.vehicle or values.get("vehicle")) for name, agent in agents.items()]
    known = sorted(((vehicle.radius, name, vehicle) for name, vehicle in flown if vehicle is not None), key=lambda v: -v[0])
    if len(known) < len(flown):
        return None
    (one, first, its), (other, second, others) = known[:2]
    if its == others:
        return 2 * one, f"two radii of {one:g} m ({its.name})"
    return one + other, f"the radii of {first} ({its.name}, {one:g} m) and {second} ({others.name}, {other:g} m) together"


def _histories(values: Mapping[str, Any], systems: Mapping[str | None, Robot], regions: list[str]) -> Iterator[Finding]:
    """Yield faults in what agents bring from before time 0: an internal state, and the region visited last."""
    agents: Mapping[str, Agent] = values.get("agents", {})
    tables: dict[str, Region] = {**values.get("hoops", {}), **values.get("regions", {})}
    for name, agent in agents.items():
        robot = systems.get(agent.robot)
        if agent.internal is not None and robot is not None and agent.internal not in robot.states:
            hint = did_you_mean(agent.internal, robot.states)
            yield (
                ("agents", name, "internal"),
                f"'{agent.internal}' is not a state of the robot.{hint} States: {', '.join(robot.states)}.",
            )
        for key, point in (("start", agent.start), ("end", agent.end)):
            for place, region in tables.items() if point is not None else ():
                if region.only is not None and agent.robot not in region.only and float(region.level(np.array(point))) <= 1:
                    yield ("agents", name, key), f"lies inside '{place}', which is open to {' and '.join(region.only)} only."
        if agent.visited is None:
            continue
        inside = [r for r, region in tables.items() if float(region.level(np.array(agent.start))) <= 1]
        if agent.visited not in regions:
            yield ("agents", name, "visited"), unknown_region(agent.visited, regions)
        elif inside and agent.visited not in inside:
            yield (
                ("agents", name, "visited"),
                f"{name} starts inside {', '.join(inside)}, which it has therefore visited after '{agent.visited}'; leave it out.",
            )


def unknown_region(name: str, known: list[str]) -> str:
    """Return the sentence about a name that is no region's."""
    return f"'{name}' is not a region of this mission.{did_you_mean(name, known)} Regions: {', '.join(known) or '(none)'}."


def _wall(point: Point, workspace: Any) -> float:
    """Distance from a point inside the box to its nearest wall, in m."""
    return min(min(x - low, high - x) for low, x, high in zip(workspace.min, point, workspace.max, strict=True))


def _on_edge(point: Point, region: Region, near: float) -> bool:
    """Return whether a point is so near a region's boundary that, within so many m, it may be in or out."""
    level = math.sqrt(float(region.level(np.array(point))))
    slack = near / region.inner_radius
    return 1 - slack <= level <= 1 + slack


def _ring_distances(point: Point, hoop: Hoop) -> tuple[float, float]:
    """Return how far a point is from the solid ring (an annulus of thickness `rim` along the normal) and from its opening, in m."""
    offset, normal = np.array(point) - np.array(hoop.center), np.array(hoop.normal)
    along = abs(float(offset @ normal))
    across = float(np.linalg.norm(offset - (offset @ normal) * normal))
    inner, outer = hoop.opening, hoop.opening + hoop.rim
    rim = math.hypot(max(inner - across, across - outer, 0.0), max(along - hoop.rim / 2, 0.0))
    return rim, math.hypot(max(across - inner, 0.0), along)
