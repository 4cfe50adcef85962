"""ROS 2 bags: poses that motion capture, a server or an estimator published of each robot.

A topic belongs to the robot whose name is a part of it (`/quad0/pose`), or is an array of poses with names (`/poses`). Where two topics
could be meant, none is chosen. Times are the messages' own stamps, which is when they were measured, not when they were recorded.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flight.logs.chunks import require_small
from flight.logs.clocks import Seen, on_one_clock
from flight.logs.import_options import RecordingOptions
from flight.logs.recordings import Recording
from verify.data import BadInput, MissingEngine
from verify.data.errors import did_you_mean

POSES = {
    "geometry_msgs/msg/PoseStamped": "pose",
    "geometry_msgs/msg/PoseWithCovarianceStamped": "pose.pose",
    "nav_msgs/msg/Odometry": "pose.pose",
    "geometry_msgs/msg/PointStamped": "",
    "geometry_msgs/msg/TransformStamped": "transform",
}
"""Messages of one robot, and where in them its pose is."""

NAMED = "motion_capture_tracking_interfaces/msg/NamedPoseArray"
"""Poses of several robots, each with its name."""

_NAMED_TEXT = {
    "motion_capture_tracking_interfaces/msg/NamedPose": "string name\ngeometry_msgs/Pose pose\n",
    NAMED: "std_msgs/Header header\nmotion_capture_tracking_interfaces/NamedPose[] poses\n",
}
MAX_MESSAGES = 4_000_000
_NANOSECONDS = -9


@dataclass
class _Samples:
    """Samples of one robot read so far."""

    counts: list[int]
    places: list[tuple[float, float, float]]
    frames: set[str]


@dataclass
class _Clock:
    """Stamps of the messages read so far, ns.

    Attributes:
        first: The earliest stamp, of whatever the topics hold.
        last: The latest.
        late: How long after its stamp a message was received at the least: how far the receiver's clock is ahead.
    """

    first: int
    last: int
    late: int

    def see(self, stamp: int, received: int) -> None:
        """Take in one message."""
        self.first, self.last = min(self.first, stamp), max(self.last, stamp)
        self.late = min(self.late, received - stamp)

    def covers(self, spans: Iterable[tuple[int, int]]) -> tuple[int, int]:
        """Return from when to when a bag goes on the clock of the stamps: from its first to its last message of any topic as received."""
        ends = [end - self.late for start, stop in spans if start < stop for end in (start, stop - 1)]
        return min([self.first, *ends]), max([self.last, *ends])


def is_bag(path: Path) -> bool:
    """Return whether a path is a ROS 2 bag, or one of its files."""
    return (path / "metadata.yaml").is_file() if path.is_dir() else path.suffix in (".mcap", ".db3")


def read_bag(path: Path, robots: Sequence[str], told: RecordingOptions) -> Recording:
    """Read a bag: its folder, or its one file of sqlite3 or MCAP.

    Args:
        path: The bag.
        robots: Names in the mission.
        told: What is told of the recording; `rename` gives topics, or names in arrays of poses.

    Raises:
        BadInput: It is no bag, is compressed as a whole, too large, damaged, lacks a robot, or holds two topics that could be one's pose.
        MissingEngine: rosbags is not installed.
    """
    source = str(path)
    told.no_columns(robots, "a bag")
    require_small(path)
    reader_of, store = _rosbags()
    try:
        with reader_of(path) as reader:
            topics = {connection.topic: str(connection.msgtype) for connection in reader.connections}
            chosen = _topics(topics, dict(zip(robots, told.names(robots), strict=True)), source)
            connections = [connection for connection in reader.connections if connection.topic in set(chosen.values())]
            found, clock = _read(reader.messages(connections), store, chosen, told, robots, source)
            # what the bag says of itself, and where metadata.yaml says it, what its files say
            files = getattr(getattr(reader, "storage", None), "storages", ())
            spans = [(reader.start_time, reader.end_time)]
            spans += [(each.metadata.start_time, each.metadata.end_time) for each in files]
    except BadInput:
        raise
    except Exception as error:  # whatever a damaged file leads to in rosbags and what it reads with
        said = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise BadInput(f"{source} is no bag that can be read: {said[:160]}.") from None
    for robot, one in found.items():
        if not one.counts:
            raise BadInput(f"{source}: {chosen[robot]} holds no pose of {robot} ({told.rename.get(robot, robot)}).")
    frames = sorted(set[str]().union(*(one.frames for one in found.values())))
    if len(frames) > 1:
        raise BadInput(f"{source} holds poses in several frames ({', '.join(frames)[:160]}); a recording is in one.")
    covers = clock.covers(spans)
    seen = {robot: Seen(one.counts, _NANOSECONDS, np.array(one.places), (1e-9, 0.0), covers) for robot, one in found.items()}
    listed = ", ".join(f"{robot} from {topic}" for robot, topic in chosen.items())
    notes = (
        f"Poses are of the topics: {listed}; times are the messages' own stamps, taken for those of one clock.",
        *([f"Positions are in the frame '{frames[0]}'."] if frames[0] else []),
    )
    return on_one_clock(seen, told, source, shared=True).noted(*notes)


def _topics(topics: Mapping[str, str], names: Mapping[str, str], source: str) -> dict[str, str]:
    """Return the one topic that holds each robot's pose."""
    arrays = sorted(topic for topic, kind in topics.items() if kind == NAMED)
    chosen: dict[str, str] = {}
    for robot, name in names.items():
        if name.startswith("/"):
            if topics.get(name) == NAMED:
                raise BadInput(
                    f"{source}: {name} holds poses with names; say what {robot} is called there: --rename {robot}=NAME."
                )
            if topics.get(name) not in POSES:
                what = f"is a {topics[name]}" if name in topics else "is not there"
                near = "" if name in topics else did_you_mean(name, topics)
                raise BadInput(f"{source}: the topic {name} {what}; poses are {', '.join(sorted(POSES))}.{near}")
            chosen[robot] = name
            continue
        own = sorted(topic for topic, kind in topics.items() if kind in POSES and name in topic.split("/"))
        found = [*own, *arrays]
        if len(found) > 1:
            raise BadInput(
                f"{source} holds several topics that could be {robot}'s pose: {', '.join(found)[:200]}. Say which it is: "
                f"--rename {robot}={found[0]}" + (" (of an array's topics only one may be in the bag)." if arrays else ".")
            )
        if not found:
            there = sorted(topic for topic, kind in topics.items() if kind in POSES)
            listed = ", ".join(there)[:200] or f"none of {len(topics)}"
            raise BadInput(
                f"{source} holds no topic of {robot}'s pose, such as /{name}/pose. Topics of poses: {listed}. Say which it is: "
                f"--rename {robot}=/TOPIC."
            )
        chosen[robot] = found[0]
    return chosen


# six parameters: what is read, how it is decoded, and who is looked for
def _read(
    messages: Iterator[Any], store: Any, chosen: Mapping[str, str], told: RecordingOptions, robots: Sequence[str], source: str
) -> tuple[dict[str, _Samples], _Clock]:
    """Return what the messages say of each robot, and what their stamps say of the bag's clock."""
    found, clock = {robot: _Samples([], [], set()) for robot in robots}, _Clock(1 << 63, 0, 1 << 63)
    whose: dict[str, list[str]] = {}
    for robot, topic in chosen.items():
        whose.setdefault(topic, []).append(robot)
    for count, (connection, received, data) in enumerate(messages):
        if count == MAX_MESSAGES:
            raise BadInput(f"{source} holds more than {MAX_MESSAGES} poses; cut the recording.")
        message: Any = store.deserialize_cdr(data, connection.msgtype)
        stamp = int(message.header.stamp.sec) * 10**9 + int(message.header.stamp.nanosec)
        if stamp == 0:
            raise BadInput(
                f"{source}: a message of {connection.topic} has no time stamp (0), so when it was measured is not known."
            )
        clock.see(stamp, received)
        for robot in whose[connection.topic]:
            place = _place(message, connection.msgtype, told.rename.get(robot, robot), source)
            if place is not None:
                one = found[robot]
                one.counts.append(stamp)
                one.places.append(place)
                one.frames.add(str(message.header.frame_id))
    for robot, one in found.items():
        _sort(one, robot, source)
    return found, clock


def _place(message: Any, kind: str, name: str, source: str) -> tuple[float, float, float] | None:
    """Return the position in a message, m; None where it does not hold that robot, or nobody saw it (NaN)."""
    if kind == NAMED:
        own = [each.pose.position for each in message.poses if each.name == name]
        if len(own) > 1:
            raise BadInput(f"{source}: '{name}' stands twice in one array of poses; a robot is in one place.")
        if not own:
            return None
        (point,) = own
    elif kind == "geometry_msgs/msg/PointStamped":
        point = message.point
    elif kind == "geometry_msgs/msg/TransformStamped":
        point = message.transform.translation
    else:
        point = message.pose.position if POSES[kind] == "pose" else message.pose.pose.position
    place = (float(point.x), float(point.y), float(point.z))
    if any(value != value for value in place):
        return None
    if any(abs(value) == float("inf") for value in place):
        raise BadInput(f"{source}: a position of '{name}' is infinite; it must be a finite number.")
    return place


def _sort(one: _Samples, robot: str, source: str) -> None:
    """Reject stamps that stand still or go back: messages of one publisher come in order."""
    for k in range(1, len(one.counts)):
        if one.counts[k] <= one.counts[k - 1]:
            how = "is the same as" if one.counts[k] == one.counts[k - 1] else "lies before"
            raise BadInput(
                f"{source}: {robot}'s stamps must go forward, but that of pose {k + 1} ({one.counts[k] / 1e9:.6f} s) {how} the one before."
            )


def _rosbags() -> tuple[Any, Any]:
    """Return rosbags' reader, and the types of a current ROS 2 with motion capture's."""
    try:
        from rosbags.rosbag2 import Reader
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    except ImportError:
        raise MissingEngine("ROS 2 bags need rosbags: pip install 'ltlplan[logs]'.") from None
    store: Any = get_typestore(Stores.LATEST)
    for name, text in _NAMED_TEXT.items():
        store.register(get_types_from_msg(text, name))
    return Reader, store
