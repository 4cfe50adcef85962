"""The client gives what the library gives: the same values, the same errors with the same words."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

import ltlplan
import verify
from flight import RecordingOptions
from flight.exports.flown import WARNING
from ltlplan import Client
from ltlplan.missions import shipped_mission_text
from ltlplan.service.client_parts.exported import exported
from ltlplan.service.client_parts.job_handle import Submitted
from ltlplan.service.client_parts.transport import Wire, require_success, unpacked
from ltlplan.service.problems import Conflict, NotFound, Unreachable
from ltlplan.service.queries import zipped
from tests.helpers.few import few_of
from tests.helpers.live import foreign_logs
from tests.helpers.serving.services import ONE_HOOP
from verify.data import BadInput, DoesNotFit, FormulaError, MissionError, NotCertified, Unsatisfiable, parse_mission
from verify.run_folder import read_folder


def test_a_run_from_afar_is_the_library_s_own(client: Client, done: Submitted, tmp_path: Path) -> None:
    told: list[float] = []
    ours = ltlplan.run(parse_mission(ONE_HOOP), tmp_path / "ours")
    theirs = client.run(parse_mission(ONE_HOOP), tmp_path / "theirs", progress=lambda _, share: told.append(share))
    assert theirs.plan == ours.plan == client.plan(parse_mission(ONE_HOOP))
    assert theirs.certificate.digest() == ours.certificate.digest() == client.recheck(done).digest()
    assert theirs.rounds == ours.rounds == 1
    # the file holds one sample in ten of the simulation's steps, over all of which ours is the worst
    assert theirs.log.worst_error() == pytest.approx(ours.log.worst_error(), abs=1e-5)
    for path in ours.files:
        name = path.relative_to(tmp_path / "ours")
        assert (tmp_path / "theirs" / name).read_bytes() == path.read_bytes(), name
    assert verify.recheck(tmp_path / "theirs").holds
    assert theirs.files


def test_a_proof_is_fetched_and_checked_here(client: Client, done: Submitted, tmp_path: Path) -> None:
    verdict = client.check_proof(done)
    assert verdict
    assert verdict.sentence == f"{len(verdict.claims)} of {len(verdict.claims)} claims checked by the kernel"
    folder = done.download_proof(tmp_path / "proof")
    assert {"statement.json", "proof.json", "check.pyz"} < {path.name for path in folder.iterdir()}
    by_itself = subprocess.run([sys.executable, "-I", folder / "check.pyz", folder], capture_output=True, text=True, check=True)
    assert by_itself.stdout.splitlines()[-1] == verdict.sentence
    certificate = client.recheck(done)
    assert certificate.checked == len(certificate.claims)
    summary = done.refreshed().job.summary
    assert summary is not None
    assert {claim["proof"] for claim in summary["claims"]} == {"checked"}
    assert done.file("statement.json") == (folder / "statement.json").read_bytes()


def test_a_job_without_a_proof_says_so(client: Client) -> None:
    with pytest.raises(NotFound):
        client.check_proof("no-such-job")
    impossible = client.submit_text(ONE_HOOP.replace("F hoop0", "F hoop0 & G !hoop0"))
    with pytest.raises(Unsatisfiable):
        impossible.wait()
    with pytest.raises(Conflict, match="has no files"):
        client.check_proof(impossible)


def test_verdicts_are_the_judge_s_own(client: Client) -> None:
    words = {"quad0": [set(), {"a"}], "quad1": [{"b"}]}
    for formula in ("F a & F b", "F c", "G !a"):
        assert client.check_team(formula, words) == verify.check_team(formula, words)
        assert client.check_word(formula, [{"a"}, set()]) == verify.check_word(formula, [{"a"}, set()])
        assert client.check_word(formula, [set()], [{"b"}]) == verify.check_word(formula, [set()], [{"b"}])
    assert client.check_word("F a", "1; a").outcome == "holds"


def test_recordings_are_judged(client: Client, done: Submitted, tmp_path: Path) -> None:
    folder = done.download(tmp_path / "run")
    (tmp_path / "flown.csv").write_bytes(done.file("flight.csv"))
    ours = ltlplan.judge_flight(folder, tmp_path / "flown.csv", max_speed=2.0)
    expected = {"mission": ours.mission, **ours.verdict.to_dict()}
    assert client.judge_flight(done, tmp_path / "flown.csv", max_speed=2.0) == expected
    assert client.judge_flight(folder, tmp_path / "flown.csv", max_speed=2.0) == expected
    with pytest.raises(BadInput, match="--max-speed"):
        client.judge_flight(done.id, tmp_path / "flown.csv")


@few_of(1, "kind", ["ulog", "bag", "motive", "crazyflie folder"])
def test_recordings_of_every_kind_are_judged_as_here(client: Client, done: Submitted, tmp_path: Path, kind: str) -> None:
    folder, flown = done.download(tmp_path / "run"), tmp_path / "flown"
    (path,) = read_folder(folder)[1].values()
    times = np.arange(0.0, path.duration, 0.01)
    places = path.evaluate(times)[:, :3]
    if kind == "ulog":
        pytest.importorskip("pyulog", reason="pyulog is not installed")
        flown, told = flown.with_suffix(".ulg"), RecordingOptions(start=3.0)
        flown.write_bytes(foreign_logs.ulog(times, places, booted=3.0))
    elif kind == "bag":
        pytest.importorskip("rosbags", reason="rosbags is not installed")
        told = RecordingOptions(start=1_700_000_000.0, start_error=0.001)
        foreign_logs.bag(flown, times, {"quad0": places}, kind="PoseStamped", mcap=False)
    elif kind == "motive":
        flown, told = flown.with_suffix(".csv"), RecordingOptions(start=0.0, axes="x,-z,y", origin={"": (0.0, 0.0, 0.0)})
        flown.write_text(foreign_logs.motive(times, {"quad0": places}))
    else:
        flown.mkdir()
        told = RecordingOptions(start={"quad0": 2.5}, rename={"quad0": "cf231"})
        (flown / "cf231.csv").write_text(foreign_logs.crazyflie(times, places, booted=2.5))
        (flown / "cf232.csv").write_text(foreign_logs.crazyflie(times, places, booted=9.0))
    ours = ltlplan.judge_flight(folder, flown, max_speed=2.0, error=0.001, told=told).verdict.to_dict()
    theirs = client.judge_flight(done, flown, max_speed=2.0, error=0.001, told=told)
    assert [theirs[key] for key in ("outcome", "claims", "start")] == [ours[key] for key in ("outcome", "claims", "start")]
    assert theirs["outcome"] == "holds"


@pytest.mark.slow
def test_exports_are_written_as_the_library_writes_them(client: Client, done: Submitted, tmp_path: Path) -> None:
    assert "px4" in client.exports()
    written = client.export(done, tmp_path / "out", "crazyflie")
    assert (tmp_path / "out" / "README.txt") in written
    client.export(done, tmp_path / "anyway", "crazyflie", force=True)
    assert WARNING in (tmp_path / "anyway" / "README.txt").read_text()
    assert WARNING not in (tmp_path / "out" / "README.txt").read_text()
    assert client.export(done, tmp_path / "some", "crazyflie", robots=list(parse_mission(ONE_HOOP).agents))
    with pytest.raises(NotCertified):
        client.export(done, tmp_path / "other", "crazyflie", vehicle="another")
    with pytest.raises(BadInput, match="Did you mean 'px4'"):
        client.export(done, tmp_path / "other", "px5")
    assert not (tmp_path / "other").exists()


def test_errors_are_the_library_s_with_the_same_words(client: Client) -> None:
    with pytest.raises(MissionError) as theirs:
        client.submit_text("name: 3\nfoo: 1\n")
    with pytest.raises(MissionError) as ours:
        parse_mission("name: 3\nfoo: 1\n")
    assert str(theirs.value) == str(ours.value)
    assert theirs.value.faults == ours.value.faults
    with pytest.raises(FormulaError):
        client.check_word("F (", [set()])
    impossible = parse_mission(ONE_HOOP.replace("F hoop0", "F hoop0 & G !hoop0"))
    with pytest.raises(Unsatisfiable) as far:
        client.plan(impossible)
    with pytest.raises(Unsatisfiable) as near:
        ltlplan.plan(impossible)
    assert (type(far.value), str(far.value)) == (type(near.value), str(near.value))
    assert far.value.core == near.value.core  # type: ignore[attr-defined]
    with pytest.raises(NotFound, match="There is no job 'nope'"):
        client.job("nope")
    job = client.submit_text(ONE_HOOP).wait()
    for name in ("../jobs.sqlite", "nope.csv", "", "crazyswarm2/../plan.json"):
        with pytest.raises(NotFound):
            job.file(name)


def test_missions_are_found_by_name(client: Client) -> None:
    assert client.load_mission("firefighting") == ltlplan.load_mission("firefighting")
    with pytest.raises(BadInput, match="shipped"):
        client.load_mission("firefightin")
    assert client.check_mission(ONE_HOOP).name == "one-hoop"
    with pytest.raises(MissionError):
        client.check_mission("name: 3\n")


def test_jobs_are_listed_cancelled_and_deleted(client: Client, done: Submitted) -> None:
    assert done.id in {job.id for job in client.jobs(state="done", limit=500)}
    job = client.submit("firefighting", seed=31337)
    assert client.cancel(job).state == "cancelled"
    with pytest.raises(BadInput, match="was cancelled"):
        job.wait()
    with pytest.raises(Conflict, match="does not search at the moment: it is cancelled"):
        client.stop_search(job)
    client.delete(job)
    with pytest.raises(NotFound):
        job.refreshed()
    with pytest.raises(NotFound):
        client.cancel(job)


@pytest.mark.slow
def test_jobs_have_the_pace_that_is_asked(client: Client) -> None:
    plan = client.plan(ltlplan.parse_mission(ONE_HOOP), seed=4713, pace=1)
    assert plan.mission.planner.pace == 1.0
    job = client.submit_text(ONE_HOOP, seed=4713, pace="nominal")
    client.cancel(job)
    for wrong in (0, 1.5, True, float("nan"), "fast"):
        for door in (client.submit, client.plan, client.run):
            with pytest.raises(BadInput, match="A pace is a share of the fastest flight"):
                door(ltlplan.parse_mission(ONE_HOOP), pace=wrong)


def test_a_service_that_is_not_there() -> None:
    with Client("http://127.0.0.1:9") as client, pytest.raises(Unreachable, match="`ltlplan serve` starts a service"):
        client.health()
    with pytest.raises(BadInput, match="looks like http"):
        Client("localhost:8000")


def test_what_is_no_service_of_ours_is_not_believed() -> None:
    for media, content in (("text/html", b"<h1>"), ("application/problem+json", b"{}")):
        with pytest.raises(Unreachable, match="status 502"):
            require_success(502, media, content, "http://x")
    for name in ("../x", "/x", "a/../../x", "a\\..\\x", "C:/x", "a//b", "."):
        with pytest.raises(BadInput, match="rejected"):
            unpacked(zipped({name: b""}))
    with pytest.raises(ltlplan.InternalError):
        unpacked(b"no archive")
    assert issubclass(DoesNotFit, ltlplan.LtlplanError)


def test_a_job_that_was_submitted_says_how_it_is_now(client: Client) -> None:
    job = client.submit_text(ONE_HOOP, seed=4711)
    before = job.id
    assert job.wait() is job
    assert (job.id, job.state, job.job.state) == (before, "done", "done")
    assert {file.name for file in job.files} >= {"plan.json", "certificate.json"}
    assert client.submit_text(ONE_HOOP, seed=4711).state == "done"


def test_a_job_that_is_cancelled_by_others_says_so(client: Client) -> None:
    job = client.submit_text(shipped_mission_text("office"), seed=4712)
    client.cancel(job.id)
    assert job.job.state == "cancelled"
    with pytest.raises(BadInput, match="was cancelled"):
        job.wait()


def test_an_export_that_takes_long_is_followed(client: Client, done: Submitted, tmp_path: Path) -> None:
    answers: list[int] = []

    class Hasty(Wire):
        """Waits for nothing, so that every export takes long."""

        def ask(self, method: str, path: str, *, also: tuple[int, ...] = (), **given: Any) -> httpx.Response:
            if "wait" in given.get("params", {}):
                given["params"] = {**given["params"], "wait": 0}
            answer = super().ask(method, path, also=also, **given)
            answers.append(answer.status_code)
            return answer

    wire = Hasty(client.url, None, 60.0)
    packed = exported(wire, done.id, "ros2", {"rate": 23.0, "anyway": True})
    wire.close()
    assert answers[0] == 202
    client.export(done, tmp_path / "out", "ros2", rate=23.0, force=True)
    assert all((tmp_path / "out" / name).read_bytes() == data for name, data in unpacked(packed).items())


def test_any_job_s_mission_is_changed_and_submitted_again(client: Client) -> None:
    refused = client.submit_text(ONE_HOOP.replace("F hoop0", "F hoop0 & G !hoop0"))
    with pytest.raises(Unsatisfiable):
        refused.wait()
    text = refused.mission()
    again = client.submit_text(text.replace(" & G !hoop0", ""))
    client.cancel(again)
    assert client.submit_text(text).id == refused.id


def test_drafts_from_afar(client: Client) -> None:
    kept = client.keep_draft("afar", "name: 3\n: fault")
    assert kept in client.drafts()
    assert client.keep_draft("afar", "name: late", changed=kept.changed - 1) == kept
    newer = client.keep_draft("afar", "name: newer")
    assert client.drafts()[0] == newer
    with pytest.raises(BadInput, match="Input should be"):
        client.keep_draft("afar", "", changed=-1.0)


def test_stored_missions_from_afar(client: Client) -> None:
    first = client.store_mission("afar", ONE_HOOP, tags=("test",))
    second = client.save_mission(first, ONE_HOOP.replace("one-hoop", "two-hoops"))
    assert (second.version, client.mission_text(second, 1), len(client.mission_history(second))) == (2, ONE_HOOP, 2)
    assert "+name: two-hoops" in client.mission_difference(second, 1, 2)
    with pytest.raises(Conflict, match="saved version 2 meanwhile"):
        client.save_mission(first, "name: lost")
    changed = client.change_mission(second, tags=("test", "race"))
    assert client.stored_missions("two-hoops", tag="race") == (changed,)
    assert client.plan_version(changed, 1).wait().id == client.submit_text(ONE_HOOP).id
    client.delete_mission(changed)
    with pytest.raises(NotFound):
        client.mission_text(changed)
