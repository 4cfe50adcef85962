"""Events that are told on a ROS 2 topic: each message a `std_msgs/msg/String` with a line, or several. The one door to DDS.

ROS 2 need not be installed. Its messages travel by DDS, the topic `/NAME` as `rt/NAME` and the type under a name of its own, and Cyclone DDS
reads them by itself. What we ask of publishers (quality of service): reliable, any durability, any history. `ros2 topic pub` and the default of
`rclpy` and `rclcpp` are reliable; a publisher of best effort is not heard, and that is said. So it is of one whose type is another, or who
sends a description of the type along that is not ours: Cyclone DDS of ROS 2 sends none. Whoever publishes must have found us: messages
from before are not sent again (volatile), as they may be of another flight. From then on none is lost: `MOST` are kept until they are asked
for, and then publishers wait.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ltlplan.online.event_sources.lines import events_told
from verify.data import BadInput, MissingEngine

if TYPE_CHECKING:
    from verify.data.events import WorldEvent

PREFIX = "ros2:"
"""How a topic is told from a file."""
DOMAIN = "ROS_DOMAIN_ID"
"""The environment's variable that says which domain, as for all of ROS 2."""
MOST = 1000
"""Messages that are kept before they are asked for."""

_TYPE = "std_msgs::msg::dds_::String_"
_NAME = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")
_AT_A_TIME = 100
_SETTLES = 1.0
"""s that it may take until a publisher that was found is heard."""


class FollowedTopic:
    """Messages as they come; asking for them never waits."""

    def __init__(self, name: str) -> None:
        """Begin to follow.

        Args:
            name: The topic's, as ROS 2 has it, such as `/ltlplan/events`.

        Raises:
            BadInput: It is no topic's name, or there is no such domain or no network to follow it on.
            MissingEngine: Cyclone DDS is not installed.
        """
        if not _NAME.fullmatch(name):
            raise BadInput(f"'{name}' is no topic of ROS 2; one is written {PREFIX}/ltlplan/events.")
        self._name = name
        self._reader: Any  # Cyclone DDS has no types for checkers
        self._publishers: Any
        self._reader, self._publishers = _readers(name, _domain())
        self._strange: dict[object, tuple[float, str]] = {}
        self._said: set[str] = set()

    def __call__(self) -> Sequence[WorldEvent | str]:
        """Return the events of messages that have come; a text where one is none, or where one was not heard."""
        found: list[WorldEvent | str] = [each for each in self._not_heard() if each not in self._said]
        self._said.update(map(str, found))
        for _ in range(_AT_A_TIME):
            try:  # one at a time: one that cannot be read takes no others with it
                taken = self._reader.take(N=1)
            except Exception as error:  # whatever a publisher sent
                found.append(f"Not done: a message of {self._name} cannot be read ({type(error).__name__}).")
                continue
            if not taken:
                break
            if isinstance(text := getattr(taken[0], "data", None), str):  # else a publisher says that it goes
                found += events_told(text.split("\n"))
        return found

    def close(self) -> None:
        """Let go of the topic."""
        self._reader = self._publishers = None

    def _not_heard(self) -> list[str]:
        """Say what is published and does not come here."""
        said: list[str] = []
        if self._reader.get_requested_incompatible_qos_status().total_count_change:
            said.append(f"{self._name}: a publisher is not heard, as it does not publish reliably (quality of service).")
        if lost := self._reader.get_sample_lost_status().total_count_change:
            said.append(f"{self._name}: messages were lost ({lost}).")
        return [*said, *self._strangers()]

    def _strangers(self) -> list[str]:
        """Say which publishers were found and are not heard, each once."""
        now = time.monotonic()
        for found in self._publishers.take(N=_AT_A_TIME):
            if getattr(found, "topic_name", None) == f"rt{self._name}" and _is_reliable(found):
                self._strange[found.key] = (now, str(found.type_name)[:100])
        if not self._strange:
            return []
        for heard in self._reader.get_matched_publications():
            self._strange.pop(getattr(self._reader.get_matched_publication_data(heard), "key", None), None)
        late = {key: kind for key, (since, kind) in self._strange.items() if now - since > _SETTLES}
        for key in late:
            del self._strange[key]
        return [
            f"{self._name}: a publisher is not heard, as it publishes {kind!r}"
            + (" and describes that type otherwise." if kind == _TYPE else ", not std_msgs/msg/String.")
            for kind in late.values()
        ]


def _domain() -> int:
    """Return the domain that ROS 2 would be on."""
    text = os.environ.get(DOMAIN, "").strip() or "0"
    if not (text.isascii() and text.isdecimal() and int(text) <= 232):
        raise BadInput(f"{DOMAIN} is '{text[:40]}'; it must be a number from 0 to 232.")
    return int(text)


def _is_reliable(publisher: Any) -> bool:
    """Return whether a publisher offers what we ask."""
    from cyclonedds.core import Policy

    return isinstance(publisher.qos[Policy.Reliability], Policy.Reliability.Reliable)


def _readers(name: str, domain: int) -> tuple[Any, Any]:
    """Return who reads the topic, and who reads which publishers there are."""
    try:
        from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
        from cyclonedds.core import DDSException, Policy, Qos
        from cyclonedds.domain import DomainParticipant
        from cyclonedds.idl import make_idl_struct
        from cyclonedds.idl.annotations import final
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic
        from cyclonedds.util import duration
    except ModuleNotFoundError as error:
        if str(error.name).partition(".")[0] != "cyclonedds":
            raise
        raise MissingEngine("Following a ROS 2 topic needs cyclonedds: pip install 'ltlplan[ros]'.") from None
    message: Any = final(make_idl_struct("String_", _TYPE, {"data": str}))
    asked = Qos(
        Policy.Reliability.Reliable(duration(seconds=1)),
        Policy.Durability.Volatile,
        Policy.History.KeepAll,
        Policy.ResourceLimits(max_samples=MOST, max_instances=-1, max_samples_per_instance=-1),
        Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),  # as ROS 2 writes
    )
    try:
        participant = DomainParticipant(domain)
        reader = DataReader(participant, Topic(participant, f"rt{name}", message), qos=asked)
        return reader, BuiltinDataReader(participant, BuiltinTopicDcpsPublication)
    except DDSException as error:
        raise BadInput(f"{PREFIX}{name} cannot be followed in domain {domain}: {error}") from None
