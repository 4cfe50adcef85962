"""Messages of a ROS 2 topic that another process publishes by DDS, over loopback."""

import builtins
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from ltlplan.online.event_sources import topics
from ltlplan.online.event_sources.topics import FollowedTopic
from tests.helpers.vehicles.ros_peer import here, publishing
from verify.data import BadInput, MissingEngine
from verify.data.events import NewFormula, RobotLeaves

DOMAIN = 87
TOPIC = "/ltlplan/events"
SOURCE = Path(__file__).parents[3] / "helpers" / "vehicles" / "fast_dds_publisher.cpp"


@pytest.fixture
def followed(monkeypatch):
    """Follow a topic on this machine alone."""
    pytest.importorskip("cyclonedds", reason="needs the extra ros, which has no wheels for this machine")
    for name, value in here(DOMAIN).items():
        monkeypatch.setenv(name, value)
    following = FollowedTopic(TOPIC)
    yield following
    following.close()


def heard(following, count, seconds=10.0):
    """Return what came, once there is so much of it."""
    found, end = [], time.monotonic() + seconds
    while len(found) < count and time.monotonic() < end:
        found += following()
        time.sleep(0.01)
    return found


def test_messages_from_before_they_were_asked_for_are_heard_in_order(followed):
    lines = ["one fails", "nonsense\n3 formula F left", *(f"r{i} leaves" for i in range(150))]
    with publishing(DOMAIN, TOPIC, "reliable", *lines) as peer:
        peer.stdout.readline()  # all is published, and nobody has asked yet
        first, wrong, asked, *others = heard(followed, 153)
    assert first == RobotLeaves(time=0.0, robot="one")
    assert "'nonsense' is no event" in wrong
    assert asked == NewFormula(time=3.0, formula="F left")
    assert [event.robot for event in others] == [f"r{i}" for i in range(150)]
    assert followed() == []


@pytest.mark.slow  # waits for a second
def test_who_is_not_heard_is_said(followed):
    with publishing(DOMAIN, TOPIC, "best effort", "one fails"), publishing(DOMAIN, TOPIC, "number", ""):
        said = " ".join(heard(followed, 2))
    assert "does not publish reliably" in said
    assert "publishes 'std_msgs::msg::dds_::UInt8_', not std_msgs/msg/String" in said
    assert followed() == []


def test_bytes_that_are_no_text_do_no_harm(monkeypatch):
    """As a reader may be handed them, whatever a publisher's process sends."""

    taken = [UnicodeDecodeError("utf-8", b"\xff", 0, 1, "no text"), [type("Text", (), {"data": "one fails"})()], []]

    class Reader:
        def take(self, N):
            first = taken.pop(0)
            if isinstance(first, Exception):
                raise first
            return first

        def status(self):
            return type("Status", (), {"total_count_change": 0})()

        get_requested_incompatible_qos_status = get_sample_lost_status = status

    class Publishers:
        def take(self, N):
            return []

    monkeypatch.setattr(topics, "_readers", lambda name, domain: (Reader(), Publishers()))
    said, event = FollowedTopic(TOPIC)()
    assert "cannot be read" in said
    assert event == RobotLeaves(time=0.0, robot="one")


def test_bytes_on_the_wire_are_those_of_ros():
    """Two libraries that share nothing read and write the same message."""
    idl = pytest.importorskip("cyclonedds.idl", reason="needs the extra ros")
    stores = pytest.importorskip("rosbags.typesys", reason="needs the extra ros")
    store = stores.get_typestore(stores.Stores.ROS2_HUMBLE)
    ours = idl.make_idl_struct("String_", "std_msgs::msg::dds_::String_", {"data": str})
    for text in ("", "one fails", "formula F läuft"):
        theirs = store.types["std_msgs/msg/String"](text)
        sent = bytes(store.serialize_cdr(theirs, "std_msgs/msg/String"))
        assert ours.deserialize(sent).data == text
        assert bytes(ours(text).serialize()) == sent


@pytest.mark.parametrize("name", ["", "events", "/", "/a//b", "/a/", "/1", "/a b", "/a\n", "/ä"])
def test_what_is_no_topic_is_refused(name):
    with pytest.raises(BadInput, match="is no topic of ROS 2"):
        FollowedTopic(name)


@pytest.mark.parametrize("domain", ["-1", "233", "lab", "1.5"])
def test_what_is_no_domain_is_refused(monkeypatch, domain):
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    with pytest.raises(BadInput, match="from 0 to 232"):
        FollowedTopic(TOPIC)


def test_without_the_library_its_extra_is_named(monkeypatch):
    real = builtins.__import__

    def without(name, *rest, **more):
        if name.startswith("cyclonedds"):
            raise ModuleNotFoundError(f"No module named '{name}'", name=name)
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(MissingEngine, match=r"ltlplan\[ros\]"):
        FollowedTopic(TOPIC)


@pytest.mark.slow
def test_a_publisher_of_another_dds_is_heard(monkeypatch, tmp_path):
    """Of Fast DDS, which ROS 2 comes with; both as they are where nothing is configured."""
    pytest.importorskip("cyclonedds", reason="needs the extra ros, which has no wheels for this machine")
    publisher = tmp_path / "publisher"
    built = ["g++", "-o", str(publisher), str(SOURCE), "-lfastrtps", "-lfastcdr"]
    if shutil.which("g++") is None or subprocess.run(built, check=False, capture_output=True).returncode:
        pytest.skip("needs g++, libfastrtps-dev and libfastcdr-dev")
    monkeypatch.delenv("CYCLONEDDS_URI", raising=False)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN + 1))
    following = FollowedTopic(TOPIC)
    lines = ["one fails", "2 formula F left\ntwo leaves", *(f"r{i} leaves" for i in range(150))]
    with subprocess.Popen([publisher, str(DOMAIN + 1), TOPIC, *lines], stdout=subprocess.PIPE, text=True) as peer:
        found = heard(following, 153, 20.0)
        said, _ = peer.communicate(timeout=30)
    following.close()
    assert found[0] == RobotLeaves(time=0.0, robot="one")
    assert found[1] == NewFormula(time=2.0, formula="F left")
    assert found[2] == RobotLeaves(time=0.0, robot="two", fails=False)
    assert [event.robot for event in found[3:]] == [f"r{i}" for i in range(150)]
    assert said == "heard\n"
