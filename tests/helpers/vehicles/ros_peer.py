"""A publisher of a ROS 2 topic in a process of its own: `python ros_peer.py TOPIC KIND LINE ...` publishes each line once somebody listens.

KIND is "reliable", "best effort", or "number" for messages of another type. Traffic stays on this machine (`here`).
"""

import os
import subprocess
import sys
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

ONE = "<Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces><AllowMulticast>false</AllowMulticast>"
PEERS = "<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address='127.0.0.1'/></Peers>"
CONFIGURATION = f"<CycloneDDS><Domain><General>{ONE}</General><Discovery>{PEERS}</Discovery></Domain></CycloneDDS>"


def here(domain: int) -> dict[str, str]:
    """Return the environment's variables by which DDS stays on this machine, in a domain of its own."""
    return {"CYCLONEDDS_URI": CONFIGURATION, "ROS_DOMAIN_ID": str(domain)}


@contextmanager
def publishing(domain: int, topic: str, kind: str, *lines: str) -> Generator[subprocess.Popen[str]]:
    """Publish lines from another process, which is there meanwhile."""
    command = [sys.executable, str(Path(__file__).resolve()), topic, kind, *lines]
    with subprocess.Popen(command, env={**os.environ, **here(domain)}, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def _main(topic: str, kind: str, *lines: str) -> None:
    from dataclasses import dataclass

    from cyclonedds.core import Policy, Qos
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.idl import IdlStruct
    from cyclonedds.idl.types import uint8
    from cyclonedds.pub import DataWriter
    from cyclonedds.topic import Topic
    from cyclonedds.util import duration

    @dataclass
    class Text(IdlStruct, typename="std_msgs::msg::dds_::String_"):
        data: str

    @dataclass
    class Number(IdlStruct, typename="std_msgs::msg::dds_::UInt8_"):
        data: uint8

    sure = Policy.Reliability.BestEffort if kind == "best effort" else Policy.Reliability.Reliable(duration(seconds=10))
    asked = Qos(sure, Policy.Durability.TransientLocal, Policy.History.KeepAll)
    participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
    writer = DataWriter(participant, Topic(participant, f"rt{topic}", Number if kind == "number" else Text), qos=asked)
    end = time.monotonic() + 10
    while kind == "reliable" and not writer.get_matched_subscriptions() and time.monotonic() < end:
        time.sleep(0.01)
    for line in lines:
        writer.write(Number(1) if kind == "number" else Text(line))
    print("published", flush=True)
    time.sleep(30)


if __name__ == "__main__":
    _main(*sys.argv[1:])
