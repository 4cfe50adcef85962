"""Rules for a mission with several robot types: tables of `robots` that are known and used, and limits that only tighten."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from verify.data.errors import did_you_mean
from verify.data.sections import Agent, Edge, Environment, Limits, Robot, limits_under
from verify.data.validation.faults import Finding, KeyPath
from verify.data.vehicle import CLIMB_AND_LANDING, Vehicle


def broken_by_kinds(
    values: Mapping[str, Any],  # of any type: each section has its own
    data: Mapping[str, Any],  # of any type: what a mission file may hold
) -> Iterator[Finding]:
    """Yield what is wrong with the names of `robots` tables.

    Args:
        values: The sections that are sound by themselves, by key, as the schema's types.
        data: The whole mission as plain data, for the names of entries that are not sound.
    """
    tables = data.get("robots")
    known = tuple(str(name) for name in tables) if isinstance(tables, dict) else ()
    if isinstance(tables, dict) and not known:
        yield ("robots",), "is empty; leave it out, or name a table such as `carrier: {initial: empty, states: {empty: []}}`."
    agents: Mapping[str, Agent] = values.get("agents", {})
    for name, agent in agents.items():
        if agent.robot is not None and agent.robot not in known:
            yield ("agents", name, "robot"), _unknown(agent.robot, known)
    for keys, only in _closed(values):
        for kind in dict.fromkeys(only):
            if kind not in known:
                yield (*keys, "only"), _unknown(kind, known)


def unused_tables(values: Mapping[str, Any]) -> Iterator[Finding]:  # of any type: each section has its own
    """Yield the tables of a mission file that no agent's kind names; while robots leave in flight, nothing is wrong with those.

    Args:
        values: The sections that are sound by themselves, by key, as the schema's types.
    """
    tables: Mapping[str, Robot] = values.get("robots") or {}
    used = {agent.robot for agent in values.get("agents", {}).values()}
    for kind in tables:
        if used and kind not in used:
            yield (
                ("robots", kind),
                f"no agent is of this kind; name it in one (`agents.NAME.robot: {kind}`), or remove the table.",
            )
    if tables and used and None not in used and values.get("robot", Robot()) != Robot():
        yield (
            ("robot",),
            "every agent names a table of `robots`, so that no robot has these states; remove `robot`, or name it there.",
        )


def _closed(values: Mapping[str, Any]) -> Iterator[tuple[KeyPath, tuple[str, ...]]]:
    """Yield what is closed to some kinds: where it stands, and who may go there."""
    for table in ("hoops", "regions"):
        for name, region in values.get(table, {}).items():
            if region.only is not None:
                yield (table, name), region.only
    environment: Environment | None = values.get("environment")
    for index, edge in enumerate(() if environment is None else environment.edges):
        if isinstance(edge, Edge):
            yield ("environment", "edges", index), edge.only


def _unknown(kind: str, known: tuple[str, ...]) -> str:
    if not known:
        return f"'{kind}' is no kind of robot: the mission has no `robots`, whose tables are named here."
    return f"'{kind}' is no table of `robots`.{did_you_mean(kind, known)} Tables: {', '.join(known)}."


def flown(values: Mapping[str, Any]) -> dict[str, Vehicle]:  # of any type: each section has its own
    """Return the vehicle that each agent flies, by agent; the mission's own under no name where it has no agent that is sound.

    Args:
        values: The sections that are sound by themselves, by key, as the schema's types.
    """
    shared: Vehicle | None = values.get("vehicle")
    agents: Mapping[str, Agent] = values.get("agents", {})
    found = {name: agent.vehicle or shared for name, agent in agents.items()} or {"": shared}
    return {name: vehicle for name, vehicle in found.items() if vehicle is not None}


def limit_faults(values: Mapping[str, Any]) -> Iterator[Finding]:  # of any type: each section has its own
    """Yield limits that do not tighten the vehicle's own, or under which it cannot hover.

    What all robots share tightens nobody's where it is above the limit of every vehicle that is flown.

    Args:
        values: The sections that are sound by themselves, by key, as the schema's types.
    """
    vehicles = flown(values)
    agents: Mapping[str, Agent] = values.get("agents", {})
    shared: Limits | None = values.get("limits")
    if shared is not None and vehicles:
        yield from _loose(shared, list(dict.fromkeys(vehicles.values(), None)), ("limits",))
        for vehicle in dict.fromkeys(vehicles.values(), None):
            yield from _cannot_hover(shared, vehicle, ("limits",))
    for name, agent in agents.items():
        if agent.limits is not None and name in vehicles:
            keys: KeyPath = ("agents", name, "limits")
            yield from _loose(agent.limits, [vehicles[name]], keys)
            yield from _cannot_hover(agent.limits, vehicles[name], keys)
    for name, vehicle in vehicles.items():
        own = agents[name].limits if name in agents else None
        least = min(
            (e for e in (limits_under(vehicle, each or Limits()).endurance for each in (shared, own)) if e is not None),
            default=None,
        )
        if least is not None and least <= CLIMB_AND_LANDING:
            where: KeyPath = ("agents", name) if name else ("vehicle", "endurance")
            yield (
                where,
                (
                    f"an endurance of {least:g} s leaves no time to fly: climb, the way to the start and landing count {CLIMB_AND_LANDING:g} s."
                ),
            )


def _loose(limits: Limits, vehicles: list[Vehicle], keys: KeyPath) -> Iterator[Finding]:
    for name in ("speed", "acceleration", "thrust_max", "tilt_deg", "body_rate_deg", "yaw_rate_deg", "endurance", "pieces"):
        asked = getattr(limits, name)
        owns = [(v.held if name == "pieces" else getattr(v, name), v.name) for v in vehicles]
        bounds = [(float("inf") if own is None else own, whose) for own, whose in owns]
        most, whose = max(bounds)
        if asked is not None and asked > most:
            yield (*keys, name), f"{asked:g} is above the vehicle's own {most:g} ({whose}); limits only tighten."
    least, whose = min((v.thrust_min, v.name) for v in vehicles)
    if limits.thrust_min is not None and limits.thrust_min < least:
        yield (
            (*keys, "thrust_min"),
            f"{limits.thrust_min:g} N is below the vehicle's own {least:g} N; limits only tighten.",
        )


def _cannot_hover(limits: Limits, vehicle: Vehicle, keys: KeyPath) -> Iterator[Finding]:
    if limits.thrust_max is not None and limits.thrust_max <= vehicle.weight:
        yield (*keys, "thrust_max"), f"{limits.thrust_max:g} N cannot hold the vehicle's weight of {vehicle.weight:.4g} N."
    if limits.thrust_min is not None and limits.thrust_min >= vehicle.weight:
        yield (
            (*keys, "thrust_min"),
            f"{limits.thrust_min:g} N is not below the vehicle's weight of {vehicle.weight:.4g} N, so it cannot hover.",
        )
