"""crazyswarm2's own simulator (`backend:=sim`), which has tf and /clock, and neither /pose, /status nor parameters.

Its controller cannot be told a mass (firmware: 29 g) and its vehicle weighs 34 g, so robots hover some centimetres low. The mass is taken from how low
they hover: all heights are asked that much higher there, which adds the force that the controller lacks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from flying.checks import Pose
from flying.watch import Refused

ROUNDS = 20  # s that heights have to come right: the controller's integral takes seven
QUIET = 0.005  # m by which a height may be off
LARGEST = 0.15  # m that are added at the most


class Transforms:
    """Robots as tf shows them.

    Attributes:
        poses: The last of each robot, by its stamp.
    """

    def __init__(self, names: list[str]) -> None:
        """Know nobody yet.

        Args:
            names: The robots'.
        """
        self.poses: dict[str, Pose] = {}
        self._names = frozenset(names)

    def take(self, message: Any) -> None:
        """Take in a message.

        Args:
            message: `tf2_msgs/msg/TFMessage`.
        """
        for each in message.transforms:
            if each.child_frame_id in self._names:
                stamp, at, turned = each.header.stamp, each.transform.translation, each.transform.rotation
                place = float(at.x), float(at.y), float(at.z)
                self.poses[each.child_frame_id] = Pose(stamp.sec + 1e-9 * stamp.nanosec, place, heading_of(turned))


def by_simulated_clock(node: Any) -> bool:
    """Tell whether a ROS node goes by /clock, as it has to with the simulator, and as nobody does with real robots.

    Args:
        node: crazyswarm2's; ROS has no types.
    """
    return hasattr(node, "get_parameter") and bool(node.get_parameter("use_sim_time").value)


def heading_of(turned: Any) -> float:
    """Return a quaternion's heading, rad.

    Args:
        turned: Has x, y, z and w.
    """
    x, y, z, w = turned.x, turned.y, turned.z, turned.w
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def trimmed(starts: Mapping[str, tuple[float, ...]], pose: Callable[[str], Pose | None]) -> Iterator[dict[str, float]]:
    """Yield by how much higher heights are to be asked, m by robot, until robots hover at their starts.

    Args:
        starts: Where each has to hover; z in m is the third number.
        pose: Returns where a robot is.

    Raises:
        Refused: They do not come to hover there.
    """
    trims, settled = dict.fromkeys(starts, 0.0), 0
    for _ in range(ROUNDS):
        yield dict(trims)
        seen = {name: pose(name) for name in starts}
        low = {name: starts[name][2] - at.position[2] for name, at in seen.items() if at is not None}
        settled = settled + 1 if all(abs(off) <= QUIET for off in low.values()) else 0
        if settled == 3:
            return
        trims = {name: min(max(trims[name] + low.get(name, 0.0), -LARGEST), LARGEST) for name in trims}
    raise Refused(f"robots do not come to hover at their starts in the simulator: {trims}")
