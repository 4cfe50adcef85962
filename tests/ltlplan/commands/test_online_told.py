"""Fire fighting over a link, told events by a ROS 2 topic and through a planning service, each from a process of its own."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from ltlplan import Client
from tests.helpers.serving.services import start
from tests.helpers.vehicles.ros_peer import here, publishing

ROOT = Path(__file__).parents[3]
DOMAIN = 88
TOPIC = "/ltlplan/events"


def until(process, beginning):
    """Return what a process printed, up to the first line that begins so."""
    printed = ""
    for line in process.stdout:
        printed += line
        if line.startswith(beginning):
            return printed
    raise AssertionError(printed)


@pytest.mark.slow
def test_a_team_at_fire_fighting_hears_a_topic_and_a_service_that_is_killed_meanwhile(ltlplan, tmp_path):
    pytest.importorskip("cyclonedds", reason="needs the extra ros")
    process, served = start(tmp_path / "data")
    port = int(served.url.rpartition(":")[2])
    command = [
        sys.executable,
        "-m",
        "ltlplan",
        "online",
        "firefighting",
        "--certified",
        "--link",
        "simulated",
        "--noise",
        "0.001",
    ]
    flight = subprocess.Popen(
        [*command, "--follow", f"{served.url}/live/lab", "--follow", f"ros2:{TOPIC}", "--out", "out"], cwd=tmp_path,
        env={**os.environ, **here(DOMAIN), "PYTHONPATH": str(ROOT)}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    until(flight, "flight")
    with (
        Client(served.url) as client,
        publishing(DOMAIN, TOPIC, "reliable", "formula F loc1 & F loc2 & F water & G(smoke -> carrying)"),
    ):
        client.send_events("lab", "quad7 fails", "5 quad1 fails")
        process.send_signal(signal.SIGKILL)
        process.wait(30)
        process, served = start(tmp_path / "data", port=port)
        printed, _ = flight.communicate(timeout=180)
        assert flight.returncode == 0, printed
        assert client.flights()[0].ended
        wrong, failed = client.events("lab")
    assert (wrong.heard, wrong.answer) == (False, "quad7 fails and lands: it is not in the air.")
    assert failed.heard
    assert failed.answer.startswith("quad1 fails and lands, from ")
    live = json.loads((tmp_path / "out" / "live.json").read_text())
    assert {answer["event"] for answer in live["answers"]} == {
        "the formula is now F loc1 & F loc2 & F water & G(smoke -> carrying)", "quad1 fails and lands",
    }  # fmt: skip
    last = live["answers"][-1]  # the other one may have come just before it
    assert 0 < last["stop"] < last["proved"] < last["begun"]
    said = " ".join(event["sentence"] for event in live["events"])
    assert "it cannot be heard" in said
    assert "it is heard again" in said
    judged = ltlplan(
        "certify", "out", "--flight", "out/flight.csv", "--max-speed", "1.5", "--error", "0.006", "--start", "0", cwd=tmp_path
    )
    assert judged.returncode == 0, judged.stdout
    process.send_signal(signal.SIGTERM)
    process.wait(30)
