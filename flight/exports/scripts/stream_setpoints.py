#!/usr/bin/env python3
"""Streams a certified flight's setpoints to PX4 vehicles that hover at their starts. Copied into every PX4 export.

    python3 stream_setpoints.py quad0=udpin:0.0.0.0:14540 quad1=udpin:0.0.0.0:14541

Needs pymavlink. It neither arms, nor takes off, nor lands where all goes well: bring every robot to its start first (position flight), keep the
remote control in hand, and land them yourself: at the end all hold where they are. How they come to their starts is not certified; README.txt says
whether straight down below the ends was proved clear.

Before anything is asked of them it looks whether each robot is the system that it should be, armed, within half a margin of its start,
turned as the plan begins, seen often and quietly, with an estimator that has settled and enough battery; and it sets, and reads back, that
a robot lands by itself 1 s after its last setpoint (COM_OF_LOSS_T and COM_OBL_RC_ACT, which stay set). What a vehicle does not tell is
"not checked": nothing is asked of anybody then, unless `--unchecked` names the check. A ground station's heartbeat is sent once a second.
It streams each robot's first setpoint, asks for offboard flight, looks again, and sends the setpoints in real time, all robots by one
clock. If a robot leaves offboard flight, may have left the margin or the workspace, comes too near to another one, goes silent or is nearly
out of battery, or sending falls behind, and on Ctrl-C, SIGTERM or any other error, all robots are told to hold until each has confirmed it;
those that do not are told to land, and so are all on a second Ctrl-C. It says "flown", and ends with 0, only where every robot stayed
within the margin and holds. What happened is written beside this file, into a new folder each time.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
from pathlib import Path

from flying.checks import NAMES
from flying.px4 import Vehicle
from flying.record import Record
from flying.streaming import Stream
from flying.watch import Refused, Team

FOLDER = Path(__file__).resolve().parent


def flown(stream: Stream, unchecked: frozenset[str]) -> str:
    """Fly, and have all hold whatever happens; return why it did not end as planned, or nothing.

    Args:
        stream: What flies.
        unchecked: Checks without which the operator flies.
    """
    reason = ""
    try:
        stream.check(unchecked)
        stream.begin()
        stream.say(f"streaming {stream.team.data['duration']:.1f} s")
        stream.fly()
    except Refused as refused:
        reason = str(refused)
    except KeyboardInterrupt:
        reason = "interrupted"
    except Exception as error:  # whatever it was: robots are in the air
        reason = f"{type(error).__name__}: {error}"
    if reason:
        stream.say(f"it does not go on: {reason}", "alarm")
    unsafe = stream.make_safe()
    for sentence in unsafe:
        stream.say(sentence, "reaction")
    return reason or ("not every robot holds" if unsafe else "")


def main(arguments: list[str] | None = None) -> int:
    """Fly; return 0 where all setpoints were sent, and every robot stayed within the margin and holds."""
    parser = argparse.ArgumentParser(
        description="Stream a certified flight's setpoints to PX4 vehicles that hover at their starts."
    )
    parser.add_argument("addresses", nargs="+", metavar="ROBOT=ADDRESS", help="such as quad0=udpin:0.0.0.0:14540")
    parser.add_argument("--unchecked", action="append", choices=NAMES, default=[], help="fly though this cannot be checked")
    told = parser.parse_args(arguments)
    given = dict(text.partition("=")[::2] for text in told.addresses)
    team = Team(json.loads((FOLDER / "flight.json").read_text(encoding="utf-8")))
    if set(given) != set(team.names) or not all(given.values()):
        parser.error(f"give an address for each of {', '.join(team.names)}")
    if len(set(given.values())) < len(given):
        parser.error("two robots have one address")
    os.environ["MAVLINK20"] = "1"  # before pymavlink is imported: it decides there
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # as Ctrl-C
    vehicles: list[Vehicle] = []
    try:
        team.require_margin()
        origin = tuple(team.data["origin"])
        vehicles += (Vehicle(name, row, FOLDER, given[name], origin) for name, row in team.data["robots"].items())
        record = Record(FOLDER, {key: team.data[key] for key in ("mission", "certificate", "margin")})
    except (Refused, KeyboardInterrupt) as error:
        print(f"stopped: {str(error) or 'interrupted'}")
        return 1
    stream = Stream(team, vehicles, record)
    stream.say(f"certificate {team.data['certificate']}, margin {team.margin:g} m", "check")
    reason = flown(stream, frozenset(told.unchecked))
    record.close(reason)
    for vehicle in vehicles:
        print(f"{vehicle.name}: at most {vehicle.worst:.3f} m from its setpoint, by its own estimate")
    print(f"written to {record.folder}")
    print(f"stopped: {reason}" if reason else "flown; every robot holds: land them")
    return 1 if reason else 0


if __name__ == "__main__":
    sys.exit(main())
