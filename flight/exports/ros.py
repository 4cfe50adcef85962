"""ROS 2: a bag with every robot's set-points in time, and its whole trajectory in one message; written without ROS.

`ros2 bag play` publishes what stands at an instant at that instant. `/<robot>/command/trajectory` holds set-points, a
MultiDOFJointTrajectory of one point each, as controllers of multicopters take them; `/<robot>/trajectory` holds the whole
flight in one message at the bag's beginning. Points are samples of the certified path with velocities and accelerations, in
the frame `world` (ROS's REP 103: x east or forward, z up). The bag is an SQLite one of version 8, which Humble reads, too.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from flight.control.profiles import PROFILES
from flight.exports.target import ExportTarget, Product, Request
from verify.data import BadInput, MissingEngine, Trajectory
from verify.data.disturbance import StreamedSetpoints

RATE = 50.0
"""Points a second."""

_TYPE = "trajectory_msgs/msg/MultiDOFJointTrajectory"
_NAME = "bag"
_BILLION = 1_000_000_000


def _product(request: Request) -> Product:
    rate = float(request.options.get("rate", RATE))
    if not 1.0 <= rate <= 500.0:
        raise BadInput(f"rate must be 1 to 500 points a second, not {rate:g}.")
    rosbag2, store = _rosbags()
    duration = max(path.duration for path in request.flown.values())
    times = np.minimum(np.arange(math.ceil(round(duration * rate, 6)) + 1) / rate, duration)
    stamps = [round(_BILLION * time) for time in times.tolist()]
    with tempfile.TemporaryDirectory() as aside:
        place = Path(aside) / _NAME
        with rosbag2.Writer(place, version=8, storage_plugin=rosbag2.StoragePlugin.SQLITE3) as writer:
            writer.set_custom_data("certificate", request.digest)
            writer.set_custom_data("mission", request.mission.name)

            def write(connection: Any, stamp: int, name: str, points: list[Any]) -> None:  # rosbags makes its types as it runs
                header = _header(store, stamp)
                message = store.types[_TYPE](header=header, joint_names=[name], points=points)
                writer.write(connection, stamp, store.serialize_cdr(message, _TYPE))

            def topic(name: str) -> Any:
                return writer.add_connection(name, _TYPE, typestore=store)

            points = {name: list(_points(store, path, times)) for name, path in request.flown.items()}
            for name, own in points.items():
                for point, stamp in zip(own, stamps, strict=True):
                    point.time_from_start = _duration(store, stamp)
                write(topic(f"/{name}/trajectory"), 0, name, own)
            commands = {name: topic(f"/{name}/command/trajectory") for name in points}
            for index, stamp in enumerate(stamps):
                for name, connection in commands.items():
                    point = points[name][index]
                    point.time_from_start = _duration(store, 0)
                    write(connection, stamp, name, [point])
        files = {f"{_NAME}/{item.name}": item.read_bytes() for item in sorted(place.iterdir())}
    return Product(
        files,
        (
            f"The bag holds {rate:g} points a second, in the frame `world`: /<robot>/command/trajectory at their times, for "
            "`ros2 bag play`, and /<robot>/trajectory all in one message.",
            "The certificate is of the path that the points are samples of; what a controller does between them is its own.",
        ),
    )


def _points(store: Any, path: Trajectory, times: Any) -> Iterator[Any]:
    """Yield a MultiDOFJointTrajectoryPoint for each time; when it is due is still to be said."""
    kinds = store.types
    vector, quaternion = kinds["geometry_msgs/msg/Vector3"], kinds["geometry_msgs/msg/Quaternion"]
    transform, twist = kinds["geometry_msgs/msg/Transform"], kinds["geometry_msgs/msg/Twist"]
    point = kinds["trajectory_msgs/msg/MultiDOFJointTrajectoryPoint"]
    flat = [path.evaluate(times, order).tolist() for order in range(3)]
    for place, speed, push in zip(*flat, strict=True):
        half = 0.5 * place[3]
        yield point(
            transforms=[
                transform(translation=vector(*place[:3]), rotation=quaternion(0.0, 0.0, math.sin(half), math.cos(half)))
            ],
            velocities=[twist(linear=vector(*speed[:3]), angular=vector(0.0, 0.0, speed[3]))],
            accelerations=[twist(linear=vector(*push[:3]), angular=vector(0.0, 0.0, push[3]))],
            time_from_start=_duration(store, 0),
        )


def _duration(store: Any, stamp: int) -> Any:
    return store.types["builtin_interfaces/msg/Duration"](sec=stamp // _BILLION, nanosec=stamp % _BILLION)


def _header(store: Any, stamp: int) -> Any:
    time = store.types["builtin_interfaces/msg/Time"](sec=stamp // _BILLION, nanosec=stamp % _BILLION)
    return store.types["std_msgs/msg/Header"](stamp=time, frame_id="world")


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
    controllers=(PROFILES,),  # a bag goes with no vehicle in particular
    rate=RATE,
    orders=2,
    sent=StreamedSetpoints(orders=2),  # floats of 64 bits
)
