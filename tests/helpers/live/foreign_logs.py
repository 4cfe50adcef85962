"""A flight as others would have recorded it: the same positions in every format that is read."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

Places = Mapping[str, np.ndarray]
"""m, by robot; NaN where it was not seen. Shape (n, 3) each."""

NAMED_POSES = {
    "motion_capture_tracking_interfaces/msg/NamedPose": "string name\ngeometry_msgs/Pose pose\n",
    "motion_capture_tracking_interfaces/msg/NamedPoseArray": (
        "std_msgs/Header header\nmotion_capture_tracking_interfaces/NamedPose[] poses\n"
    ),
}


def vicon(times: np.ndarray, places: Places, *, rate: int = 100, frame: int = 1) -> str:
    """Return Vicon's export of objects in mm, with rotations; frame numbers begin anywhere."""
    names = list(places)
    lines = ["Objects", str(rate), ",," + "".join(f"{name}:{name},,,,,," for name in names)]
    lines.append("Frame,Sub Frame," + ",".join(["RX,RY,RZ,TX,TY,TZ"] * len(names)))
    lines.append(",," + ",".join(["rad,rad,rad,mm,mm,mm"] * len(names)))
    for k in range(len(times)):
        lines.append(f"{frame + k},0," + ",".join("0,0,0," + _cells(1000 * places[name][k], 4) for name in names))
    return "\n".join(lines) + "\n"


def motive(times: np.ndarray, places: Places, *, unit: str = "Meters", promised: int | None = None, frame: int = 0) -> str:
    """Return OptiTrack Motive's export: y points up, bodies with their markers; its header promises as many frames as there are, or others."""
    names, scale = list(places), {"Meters": 1.0, "Millimeters": 1000.0, "Centimeters": 100.0}[unit]
    about = (
        "Format Version,1.23,Take Name,Take 1,Capture Frame Rate,100.000000,Export Frame Rate,100.000000,Total Frames in Take,"
    )
    count = len(times) if promised is None else promised
    about += f"{count},Total Exported Frames,{count}"
    lines = [f"{about},Rotation Type,Quaternion,Length Units,{unit},Coordinate Space,Global", ""]
    body, marker = ["Rigid Body"] * 8, ["Rigid Body Marker"] * 4
    lines.append(",Type," + ",".join([*body, *marker] * len(names)))
    lines.append(",Name," + ",".join(",".join([name] * 8 + [f"{name}:Marker1"] * 4) for name in names))
    lines.append(",ID," + ",".join(["1"] * 12 * len(names)))
    kinds = [*["Rotation"] * 4, *["Position"] * 3, "Mean Marker Error", *["Position"] * 3, "Marker Quality"]
    lines.append(",," + ",".join(kinds * len(names)))
    lines.append("Frame,Time (Seconds)," + ",".join(["X,Y,Z,W,X,Y,Z,,X,Y,Z,"] * len(names)))
    for k, time in enumerate(times):
        cells = []
        for name in names:
            x, y, z = scale * places[name][k]
            at = _cells(np.array([x, z, -y]), 6)
            cells.append(f"0,0,0,1,{at},0.0001,{at},1")
        lines.append(f"{frame + k},{time:.6f}," + ",".join(cells))
    return "\n".join(lines) + "\n"


def qualisys(times: np.ndarray, places: Places, *, promised: int | None = None, frame: int = 1) -> str:
    """Return Qualisys' export of bodies: tabs, mm, zeros where a body was not seen; its header promises as many frames as there are, or others."""
    names = list(places)
    lines = [
        f"NO_OF_FRAMES\t{len(times) if promised is None else promised}",
        "NO_OF_CAMERAS\t8",
        f"NO_OF_BODIES\t{len(names)}",
        "FREQUENCY\t100",
        "DATA_INCLUDED\t6D",
    ]
    lines.append("BODY_NAMES\t" + "\t".join(names))
    rest = "Roll\tPitch\tYaw\tResidual\t" + "\t".join(f"Rot[{k}]" for k in range(9))
    lines.append("Frame\tTime\t" + "\t".join(f"{name} X\tY\tZ\t{rest}" for name in names) + "\t")
    for k, time in enumerate(times):
        cells = []
        for name in names:
            place = 1000 * places[name][k]
            lost = bool(np.isnan(place).any())
            turn = ["0.00000"] * 9 if lost else ["1.00000", "0", "0", "0", "1.00000", "0", "0", "0", "1.00000"]
            cells += [*(f"{0.0 if lost else value:.5f}" for value in place), "0", "0", "0", "0.1", *turn]
        lines.append(f"{frame + k}\t{time:.5f}\t" + "\t".join(cells) + "\t")
    return "\r\n".join(lines) + "\r\n"


def crazyflie(times: np.ndarray, places: np.ndarray, *, booted: float) -> str:
    """Return a Crazyflie's own log as cflib's client writes it; its clock began so many s before the flight."""
    lines = ["Timestamp,stateEstimate.x,stateEstimate.y,stateEstimate.z,pm.vbat"]
    for time, place in zip(times, places, strict=True):
        if not np.isnan(place).any():
            lines.append(f"{int(1000 * (time + booted) + 1e-6)},{_cells(place, 6)},3.9")
    return "\n".join(lines) + "\n"


# five parameters: what was recorded, and what was lost of it
def ulog(
    times: np.ndarray,
    places: np.ndarray,
    *,
    booted: float,
    valid: np.ndarray | None = None,
    began: float | None = None,
    lost: Mapping[int, float] | None = None,
) -> bytes:
    """Return a PX4 log with local positions in north, east, down.

    Args:
        times: s. Shape (n,).
        places: m. Shape (n, 3).
        booted: How long before time 0 the vehicle was switched on, s.
        valid: Which of the positions the vehicle says are valid. Shape (n,).
        began: When the log begins, s; with its first position where None is given.
        lost: How long nothing was logged, s, by the index of the sample before which that is; n for the end.
    """
    fields = "uint64_t timestamp;uint64_t timestamp_sample;float x;float y;float z;bool xy_valid;bool z_valid;uint8_t xy_reset_counter;"
    logged = began if began is not None else float(times[0]) if len(times) else 0.0
    out = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", round(1e6 * (booted + logged)))
    out += _message("B", bytes(40)) + _message("F", b"vehicle_local_position:" + fields.encode())
    out += _message("A", struct.pack("<BH", 0, 1) + b"vehicle_local_position")
    for k, (time, (x, y, z)) in enumerate(zip(times, places, strict=True)):
        out += _dropout(lost, k)
        good = 1 if valid is None else int(valid[k])
        stamp = round(1e6 * (time + booted))
        out += _message("D", struct.pack("<HQQfffBBB", 1, stamp + 400, stamp, y, x, -z, good, good, 0))
    return out + _dropout(lost, len(times))


def _dropout(lost: Mapping[int, float] | None, index: int) -> bytes:
    return _message("O", struct.pack("<H", round(1000 * lost[index]))) if lost and index in lost else b""


def our_mcap(path: Path, times: np.ndarray, places: Places) -> None:
    """Write a log of ours as MCAP: poses where robots were seen, states at all times."""
    from mcap.writer import Writer

    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="", library="ltlplan")
        schema = writer.register_schema(name="foxglove.PoseInFrame", encoding="jsonschema", data=b"{}")
        channels = {
            f"/{name}/{what}": writer.register_channel(topic=f"/{name}/{what}", message_encoding="json", schema_id=schema)
            for name in places
            for what in ("pose", "state")
        }
        for k, time in enumerate(times.tolist()):
            moment = round(1e9 * time)
            for name, row in places.items():
                seen = not np.isnan(row[k]).any()
                sent = {"state": {"error": 0.0}, **({"pose": _pose_in_frame(moment, row[k])} if seen else {})}
                for what, message in sent.items():
                    data = json.dumps(message).encode()
                    writer.add_message(channel_id=channels[f"/{name}/{what}"], log_time=moment, publish_time=moment, data=data)
        writer.finish()


def _pose_in_frame(moment: int, place: np.ndarray) -> dict[str, object]:
    position = dict(zip("xyz", place.tolist(), strict=True))
    stamp = {"sec": moment // 10**9, "nsec": moment % 10**9}
    return {
        "timestamp": stamp,
        "frame_id": "world",
        "pose": {"position": position, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}},
    }


def _message(kind: str, data: bytes) -> bytes:
    return struct.pack("<HB", len(data), ord(kind)) + data


# five parameters: what was recorded, how, and as what
def bag(path: Path, times: np.ndarray, places: Places, *, kind: str, mcap: bool, zero: int = 1_700_000_000) -> None:
    """Write a ROS 2 bag: a topic a robot (`PoseStamped`, `PointStamped`, `TransformStamped`, `PoseWithCovarianceStamped`, `Odometry`), or one
    array of named poses (`NamedPoseArray`).
    """
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in NAMED_POSES.items():
        store.register(get_types_from_msg(text, name))
    kinds = store.types
    point, turn = kinds["geometry_msgs/msg/Point"], kinds["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    pose = kinds["geometry_msgs/msg/Pose"]
    package = {"Odometry": "nav_msgs", "NamedPoseArray": "motion_capture_tracking_interfaces"}.get(kind, "geometry_msgs")
    name_of_kind = f"{package}/msg/{kind}"
    message = kinds[name_of_kind]
    plugin = StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        topics = (
            ["/poses"]
            if kind == "NamedPoseArray"
            else [f"/{name}/{'odom' if kind == 'Odometry' else 'pose'}" for name in places]
        )
        connections = {topic: writer.add_connection(topic, name_of_kind, typestore=store) for topic in topics}
        for k, time in enumerate(times):
            stamp = zero * 10**9 + round(1e9 * time)
            at = kinds["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
            header = kinds["std_msgs/msg/Header"](stamp=at, frame_id="world")
            seen = {name: pose(point(*map(float, row[k])), turn) for name, row in places.items() if not np.isnan(row[k]).any()}
            if kind == "NamedPoseArray":
                one = kinds["motion_capture_tracking_interfaces/msg/NamedPose"]
                sent = {"/poses": message(header, [one(name, where) for name, where in seen.items()])}
            else:
                topic = "odom" if kind == "Odometry" else "pose"
                sent = {f"/{name}/{topic}": _message_of(kind, kinds, header, name, where) for name, where in seen.items()}
            for topic, value in sent.items():
                writer.write(connections[topic], stamp + 2_000_000, store.serialize_cdr(value, value.__msgtype__))


# five parameters: the message's kind with all others, and what it holds
def _message_of(kind: str, kinds: Any, header: Any, name: str, where: Any) -> Any:
    """Return a message of one robot's pose."""
    made, at = kinds[f"{'nav_msgs' if kind == 'Odometry' else 'geometry_msgs'}/msg/{kind}"], where.position
    zeros, vector = np.zeros(36), kinds["geometry_msgs/msg/Vector3"]
    if kind == "PointStamped":
        return made(header, at)
    if kind == "TransformStamped":
        moved = kinds["geometry_msgs/msg/Transform"](vector(at.x, at.y, at.z), where.orientation)
        return made(header, name, moved)
    if kind == "PoseStamped":
        return made(header, where)
    spread = kinds["geometry_msgs/msg/PoseWithCovariance"](where, zeros)
    if kind == "PoseWithCovarianceStamped":
        return made(header, spread)
    still = kinds["geometry_msgs/msg/Twist"](vector(0.0, 0.0, 0.0), vector(0.0, 0.0, 0.0))
    return made(header, name, spread, kinds["geometry_msgs/msg/TwistWithCovariance"](still, zeros))


def _cells(place: np.ndarray, digits: int) -> str:
    return ",".join("" if np.isnan(value) else f"{value:.{digits}f}" for value in place)
