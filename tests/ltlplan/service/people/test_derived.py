"""Campaigns, rehearsals and kept recordings: jobs of a job's flight, done once, listed with it and deleted with it."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path

import httpx
import pytest

import flight
from flight.condition_options import Said
from ltlplan import Client
from ltlplan.service.client_parts.job_handle import Submitted
from ltlplan.service.problems import NotFound
from ltlplan.service.recordings import kept_name
from tests.helpers.serving.services import ONE_HOOP
from verify.data import BadInput
from verify.run_folder import proved_run


@pytest.fixture
def flown(client: Client) -> Submitted:
    """Return a job with a certified flight."""
    return client.submit_text(ONE_HOOP).wait()


def test_a_campaign_is_the_command_s_own_and_done_once(client: Client, flown: Submitted, tmp_path: Path) -> None:
    made = client.campaign(flown, runs=30, noise="0.001", seed=3).wait()
    assert (made.job.kind, made.job.of) == ("campaign", flown.id)
    assert made.job.title == "campaign: runs 30, seed 3, noise 0.001"
    told = json.loads(made.file("campaign.json"))
    run = proved_run(flown.download(tmp_path / "run"))
    conditions = Said(noise="0.001").conditions(run.plan.mission)
    own = flight.campaign(run.plan, run.team, run.certificate, runs=30, seed=3, conditions=conditions)
    assert told == json.loads(json.dumps(own.to_dict()))
    found = made.job.stages[-1].found
    assert found["sentences"][: len(own.sentences)] == list(own.sentences)
    assert client.campaign(flown, runs=30, noise="0.001", seed=3).id == made.id
    assert client.campaign(flown, runs=31, noise="0.001", seed=3).id != made.id
    assert [each.id for each in client.derived(flown, "campaign")][-1] == made.id
    assert made.id not in [each.id for each in client.jobs(limit=500)]


def test_a_rehearsal_is_the_command_s_own(client: Client, http: httpx.Client, flown: Submitted) -> None:
    few = {"controllers": ["geometric"], "masses": [1.0], "latencies": [0.015], "winds": ["0"], "corners": False, "runs": 2}
    made = client.rehearse(flown, **few).wait()
    told = json.loads(made.file("rehearsal.json"))
    assert told["runs"] == 2
    assert len(made.job.stages[-1].found["rows"]) == 2
    page = http.get(f"/api/jobs/{made.id}/report")
    assert page.headers["content-type"].startswith("text/html")
    assert "sandbox" in page.headers["content-security-policy"]


def test_what_makes_no_sense_is_refused_before_it_is_accepted(client: Client, http: httpx.Client, flown: Submitted) -> None:
    with pytest.raises(BadInput, match="controller"):
        client.campaign(flown, controller="geometrical")
    with pytest.raises(BadInput, match="mass"):
        client.rehearse(flown, masses=[7.0])
    with pytest.raises(BadInput, match="runs"):
        client.campaign(flown, runs=0)
    with pytest.raises(NotFound):
        client.campaign("no-such-job")
    campaign = client.campaign(flown, runs=2)
    assert http.post(f"/api/jobs/{campaign.id}/campaigns", json={}).status_code == 409
    assert "is a campaign" in http.post(f"/api/jobs/{campaign.id}/rehearsals", json={}).json()["detail"]


def test_a_recording_is_kept_with_its_verdict(client: Client, flown: Submitted, tmp_path: Path) -> None:
    recording = tmp_path / "lab 7.csv"
    recording.write_bytes(flown.file("flight.csv"))
    kept = client.keep_recording(flown, recording, max_speed=2.0).wait()
    assert {file.name for file in kept.files} == {"lab 7.csv", "shown.json", "verdict.json"}
    assert kept.file("lab 7.csv") == recording.read_bytes()
    assert json.loads(kept.file("verdict.json")) == client.judge_flight(flown, recording, max_speed=2.0)
    found = kept.job.stages[-1].found
    assert found["said"] == ["max speed: 2.0"]
    assert client.keep_recording(flown, recording, max_speed=2.0).id == kept.id
    assert client.keep_recording(flown, recording, max_speed=2.5).id != kept.id, "another assumption is another verdict"
    folder = tmp_path / "bag"
    folder.mkdir()
    (folder / "quad0.csv").write_text("t,x,y,z\n" + "".join(f"{0.01 * i},0,0,1\n" for i in range(400)))
    whole = client.keep_recording(flown, folder)
    for _ in whole.events():
        pass
    if whole.state == "done":
        with zipfile.ZipFile(io.BytesIO(whole.file("bag.zip"))) as archive:
            assert archive.namelist() == ["quad0.csv"]
    bad = tmp_path / "none.csv"
    bad.write_text("a,b\n1,2\n")
    with pytest.raises(BadInput):
        client.keep_recording(flown, bad).wait()


@pytest.mark.slow  # an export goes with its flight, too
def test_with_its_flight_goes_what_was_made_of_it(client: Client) -> None:
    flown = client.submit_text(ONE_HOOP.replace("1.0, 0.0, 1.2", "0.9, 0.1, 1.2")).wait()
    kept = client.campaign(flown, runs=2).wait()
    client.delete(flown)
    with pytest.raises(NotFound):
        client.job(kept.id)


@pytest.mark.parametrize(
    ("name", "data", "kept"),
    [
        ("lab.csv", b"t,x", "lab.csv"),
        ("LAB.TSV", b"t\tx", "LAB.TSV"),
        ("lab.csv", b"PK\x03\x04", "recording.zip"),
        ("a/../../b.zip", b"PK\x03\x04", "b.zip"),
        ("..\\..\\x.csv", b"t", "x.csv"),
        ("verdict.json", b"t", "recording.csv"),
        ("", b"t", "recording.csv"),
        (".hidden.csv", b"t", "recording.csv"),
        ("log.ulg", b"ULog\x01\x12\x35", "log.ulg"),
        ("x" * 300 + ".csv", b"t", "recording.csv"),
    ],
)
def test_recordings_are_kept_under_plain_names(name: str, data: bytes, kept: str) -> None:
    assert kept_name(name, data) == kept
