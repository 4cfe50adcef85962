"""crazyflies.yaml: who flies, where each stands before the climb, how positions are known, and what firmware has to be told.

The firmware assumes a mass, and trusts motion capture by its parameters; where they are left as they are, vehicles follow worse
than their margin promises. So the file sets what a certificate's margin assumes: the controller of the vehicle's profile, the
mass as it flies, the motors' scale, and the noise of external poses.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.scalarstring import DoubleQuotedScalarString

from flight.exports.crazyflies.inventory import Item, checked_weight
from flight.exports.crazyflies.parameters import firmware_parameters
from flight.exports.target import Request

_ESTIMATOR = ("kalman.varX", "kalman.varY", "kalman.varZ", "pm.batteryLevel")
"""What `flying/crazyswarm.py` reads of the topic `estimator`, in this order."""


_FEW = 5
"""Robots that one radio hears 50 times a second, beside what motion capture says to them."""


def _pose_rate(request: Request) -> int:
    """Return how often a second poses are reported: as often as recordings are best checked, or as a radio has room for."""
    return 50 if len(request.team) <= _FEW * (request.mission.radios or 1) else 20


def configuration(request: Request, starts: Mapping[str, tuple[float, ...]], items: Mapping[str, Item]) -> str:
    """Return the text of crazyflies.yaml.

    Args:
        request: The export.
        starts: x, y, z in m and heading in rad of each robot at time 0.
        items: What is known of robots.

    Raises:
        DoesNotFit: A robot weighs much more or less than what it was certified for.
    """
    robots: dict[str, Any] = {}
    for index, (name, start) in enumerate(starts.items()):
        item = items.get(name, Item())
        robots[DoubleQuotedScalarString(name)] = {  # unquoted, YAML 1.1 readers take a robot named `no` or `on` for a Boolean
            "enabled": True,
            "uri": item.uri or f"radio://0/80/2M/E7E7E7E7{index + 1:02X}",
            "initial_position": [round(start[0], 6), round(start[1], 6), 0.0],
            "type": "ltlplan",
            "firmware_params": firmware_parameters(
                request.mission.vehicle_of(name), checked_weight(name, request.mission.vehicle_of(name), item.mass)
            ),
        }
    content = {
        "fileversion": 3,
        "robots": robots,
        "robot_types": {
            "ltlplan": {
                "motion_capture": {"tracking": "librigidbodytracker", "marker": "default", "dynamics": "default"},
                "big_quad": False,
                "battery": {"voltage_warning": 3.8, "voltage_critical": 3.7},
            }
        },
        "all": {
            "firmware_logging": {
                "enabled": True,
                "default_topics": {"pose": {"frequency": _pose_rate(request)}, "status": {"frequency": 2}},
                "custom_topics": {"estimator": {"frequency": 20, "vars": list(_ESTIMATOR)}},
            },
            "firmware_params": {"commander": {"enHighLevel": 1}},
            "broadcasts": {"num_repeats": 15, "delay_between_repeats_ms": 1},
        },
    }
    buffer = io.StringIO()
    yaml = YAML(pure=True)
    yaml.default_flow_style = None
    yaml.width = 200
    yaml.dump(content, buffer)
    given = sum(items.get(name, Item()).uri is not None for name in starts)
    said = "The radio addresses are the ones that were passed." if given == len(starts) else "Put your own radio addresses in."
    return f"# Mission '{request.mission.name}', certificate {request.digest}. {said}\n{buffer.getvalue()}"


def weights_said(request: Request, items: Mapping[str, Item]) -> tuple[str, ...]:
    """Return sentences on robots whose weight is not the one that was certified."""
    said: list[str] = []
    for name in request.team:
        mass, certified = items.get(name, Item()).mass, request.mission.vehicle_of(name).mass
        if mass is not None and mass != certified:
            said.append(f"{name} weighs {1000 * mass:.1f} g, its limits are certified for {1000 * certified:.1f} g.")
    return tuple(said)
