#!/usr/bin/env python3
"""Flies a certified mission with crazyswarm2: checks, climb, the flight, landing. Copied into every crazyswarm2 export.

    python3 fly_mission.py

Nothing spins before every robot stands below its own start, looks where it has to, is seen often and at rest, has its parameters, and has the
battery for it all. What this version of crazyswarm2 does not tell is "not checked": nothing spins then, unless `--unchecked` names the check.
Then all climb straight up, each within the margin of the upright line through its start, which is certified where README.txt says so; without
that nobody climbs (`--hovering` begins with robots that a flight of your own has brought to hover at their starts). The flight begins where each is within half a margin
of its start, and within what a proof of tracking assumes.

All the time measured poses are held against what is flown. A robot that may be outside of its margin, too near to another one, outside of the
workspace, not seen, nearly out of battery or blocked by its supervisor ends the flight for all, and so do Ctrl-C, SIGTERM and any error: all
brake to a hover while all are seen, then land, told until they sink. A second Ctrl-C stops all motors. Braking and landing from there are not
certified. What happened is written beside this file, into a new folder each time. Where this script is killed, vehicles fly what was started to
its end, and hover there.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from flying.before import checked, require_certified
from flying.checks import NAMES, refusals
from flying.crazyswarm import Swarm
from flying.ending import AGAIN, insisted
from flying.record import FLIGHT, Record
from flying.stages import TIMES, Flight
from flying.watch import Refused, Team

FOLDER = Path(__file__).resolve().parent


def fly(flight: Flight, *, hovering: bool, unchecked: frozenset[str]) -> None:
    """Look at all, bring them to their starts, fly, and land.

    Args:
        flight: What flies.
        hovering: Whether robots hover at their starts already.
        unchecked: Checks without which the operator flies.

    Raises:
        Refused: Something is wrong; before `flight.flying` nothing spins.
    """
    swarm, record = flight.swarm, flight.record
    checks, flight.grounds = checked(flight.team, swarm, hovering=hovering)
    record.said["parameters"] = swarm.parameters
    record.said["batteries"] = {
        name: {"share": swarm.level(name), "volt": swarm.status(name).get("battery")} for name in flight.team.names
    }
    for check in checks:
        if check.passed is None:
            record.event(swarm.now(), check.sentence, "check")
    if faults := refusals(checks, unchecked):
        raise Refused("; ".join(faults))
    flight.load(FOLDER, flight.team.data["order"][0])
    if not hovering:
        flight.climb()
        if swarm.trims:
            flight.load(FOLDER, flight.team.data["order"][0])
    flight.go_to_starts()
    flight.fly(FOLDER)
    if up := flight.ending.set_down(flight.team.names):
        raise Refused(f"{', '.join(up)} is not known to stand")
    record.ended("landing", swarm.now())
    flight.flying = False
    landing: dict[str, float] = record.said["worst"].get("landing", {})
    if astray := [fault for name, off in landing.items() if (fault := flight.team.margin_fault(name, off))]:
        raise Refused(f"all have landed, but in landing {'; '.join(astray)}")


def flown(flight: Flight, *, hovering: bool, unchecked: frozenset[str]) -> str:
    """Fly, and bring all to the ground whatever happens; return why it did not end as planned, or nothing.

    Args:
        flight: What flies.
        hovering: Whether robots hover at their starts already.
        unchecked: Checks without which the operator flies.
    """
    try:
        fly(flight, hovering=hovering, unchecked=unchecked)
        return ""
    except Refused as refused:
        reason = str(refused)
    except BaseException as error:  # whatever it was: robots may be in the air
        reason = f"{type(error).__name__} {error}".strip()
    if flight.flying:
        flight.record.event(flight.swarm.now(), f"it does not go on: {reason}", "alarm")
        insisted(lambda: bring_down(flight), flight.team.names)
    return reason


def bring_down(flight: Flight) -> list[str]:
    """Have all hold, and land; return the robots that are not known to stand.

    Args:
        flight: What flies.
    """
    if flight.up:
        return flight.ending.end_safely(flight.team.names)
    for name in TIMES * flight.team.names:
        flight.swarm.disarm(name)
        flight.swarm.sleep(AGAIN)
    return []


def main(arguments: list[str] | None = None) -> int:
    """Fly; return 0 where all flew within the margin to the end and landed."""
    parser = argparse.ArgumentParser(description="Fly a certified mission with crazyswarm2.")
    parser.add_argument("--hovering", action="store_true", help="robots hover at their starts already")
    parser.add_argument("--watch-landing", action="store_true", help="land straight down where that is not certified")
    parser.add_argument("--unchecked", action="append", choices=NAMES, default=[], help="fly though this cannot be checked")
    given, _ = parser.parse_known_args(sys.argv[1:] if arguments is None else arguments)  # ROS adds its own
    team = Team(json.loads((FOLDER / "flight.json").read_text(encoding="utf-8")))
    try:
        team.require_margin()
        require_certified(team, hovering=given.hovering, landing=given.watch_landing)
        swarm = Swarm(team)
        record = Record(FOLDER, {key: team.data[key] for key in ("mission", "certificate", "margin")})
    except Refused as refused:
        print(f"stopped: {refused}")
        return 1
    record.event(swarm.now(), f"certificate {team.data['certificate']}, margin {team.margin:g} m", "check")
    for word in ("climb", "landing"):
        why = team.data[word]
        record.event(swarm.now(), f"{word} {'not certified: ' + why if why else 'certified'}", "check")
    reason = flown(Flight(team, swarm, record), hovering=given.hovering, unchecked=frozenset(given.unchecked))
    record.close(reason)
    for name, off in record.said["worst"].get(FLIGHT, {}).items():
        print(f"{name}: at most {off:.3f} m from its plan")
    print(f"written to {record.folder}")
    print(f"stopped: {reason}" if reason else "flown and landed")
    return 1 if reason else 0


if __name__ == "__main__":
    raise SystemExit(main())
