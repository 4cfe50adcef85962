"""ROS 2: one MultiDOFJointTrajectory a robot in a bag, written without ROS.

Topics are `/<robot>/trajectory`; a message's points are samples of the certified path with velocities and
accelerations, in the frame `world` (ROS's REP 103: x east or forward, z up).
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from flight.exports.target import ExportTarget, Product, Request
from verify.data import BadInput, MissingEngine, Trajectory

RATE = 50.0
"""Points a second."""

_TYPE = "trajectory_msgs/msg/MultiDOFJointTrajectory"
_NAME = "bag"


def _product(request: Request) -> Product:
    rate = float(request.options.get("rate", RATE))
    if not 1.0 <= rate <= 500.0:
        raise BadInput(f"rate must be 1 to 500 points a second, not {rate:g}.")
    rosbag2, store = _rosbags()
    duration = max(path.duration for path in request.flown.values())
    with tempfile.TemporaryDirectory() as aside:
        place = Path(aside) / _NAME
        with rosbag2.Writer(place, version=9, storage_plugin=rosbag2.StoragePlugin.MCAP) as writer:
            writer.set_custom_data("certificate", request.digest)
            writer.set_custom_data("mission", request.mission.name)
            for name, path in request.flown.items():
                connection = writer.add_connection(f"/{name}/trajectory", _TYPE, typestore=store)
                writer.write(connection, 0, store.serialize_cdr(message(store, name, path, rate, duration), _TYPE))
        files = {f"{_NAME}/{item.name}": item.read_bytes() for item in sorted(place.iterdir())}
    return Product(
        files,
        (
            f"The bag's messages hold {rate:g} points a second, in the frame `world`.",
            "The certificate is of the path that the points are samples of; what a controller does between them is its own.",
        ),
    )


def message(store: Any, name: str, path: Trajectory, rate: float, duration: float) -> Any:  # rosbags makes its types as it runs
    """Return one robot's MultiDOFJointTrajectory as rosbags builds it, until the whole team has finished at `duration` s.

    Args:
        store: Types of a ROS 2, as rosbags has them.
        name: The robot's.
        path: Its finite flight.
        rate: Points a second.
        duration: s.
    """
    kinds = store.types
    vector, quaternion = kinds["geometry_msgs/msg/Vector3"], kinds["geometry_msgs/msg/Quaternion"]
    transform, twist = kinds["geometry_msgs/msg/Transform"], kinds["geometry_msgs/msg/Twist"]
    time_type = kinds["builtin_interfaces/msg/Duration"]
    point = kinds["trajectory_msgs/msg/MultiDOFJointTrajectoryPoint"]
    times = np.minimum(np.arange(math.ceil(round(duration * rate, 6)) + 1) / rate, duration)
    flat = [path.evaluate(times, order).tolist() for order in range(3)]
    points = []
    for time, place, speed, push in zip(times.tolist(), *flat, strict=True):
        seconds = int(time)
        half = 0.5 * place[3]
        points.append(
            point(
                transforms=[
                    transform(translation=vector(*place[:3]), rotation=quaternion(0.0, 0.0, math.sin(half), math.cos(half)))
                ],
                velocities=[twist(linear=vector(*speed[:3]), angular=vector(0.0, 0.0, speed[3]))],
                accelerations=[twist(linear=vector(*push[:3]), angular=vector(0.0, 0.0, push[3]))],
                time_from_start=time_type(sec=seconds, nanosec=min(round(1e9 * (time - seconds)), 999_999_999)),
            )
        )
    header = kinds["std_msgs/msg/Header"](stamp=kinds["builtin_interfaces/msg/Time"](sec=0, nanosec=0), frame_id="world")
    return kinds[_TYPE](header=header, joint_names=[name], points=points)


def _rosbags() -> tuple[Any, Any]:
    """Return rosbags' rosbag2 module and the types of a current ROS 2."""
    try:
        from rosbags import rosbag2
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise MissingEngine("ROS 2 export needs rosbags: pip install 'ltlplan[ros]'.") from None
    return rosbag2, get_typestore(Stores.ROS2_JAZZY)


ROS2 = ExportTarget(
    name="ros2",
    make=_product,
    options={"rate": "points a second"},
    voids=("replaying the bag at another rate, or following it with a controller that interpolates differently",),
)
