"""The API by HTTP, against a service in a process of its own: every route, and what each refuses."""

from __future__ import annotations

import io
import json
import re
import zipfile
from pathlib import Path

import httpx
import pytest

import verify
from ltlplan.missions import shipped_mission_text, shipped_missions
from ltlplan.service.api.schema import MISSION_EXAMPLE
from ltlplan.service.client_parts.job_handle import Submitted
from tests.helpers.few import few_of
from tests.helpers.serving.services import ONE_HOOP
from verify.data import parse_mission
from verify.data.shapes.region_shapes import REGION_SHAPES
from verify.kernel import VERSION

YAML = {"content-type": "application/yaml"}
JSON = {"content-type": "application/json"}


def assert_refused(answer: httpx.Response, status: int, kind: str) -> dict[str, object]:
    """Return the problem of an answer that refuses, after a look at its form."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    told = answer.json()
    assert (told["type"], told["status"]) == (f"/problems/{kind}", status)
    return told


def test_shipped_missions_come_with_their_texts(http: httpx.Client) -> None:
    told = http.get("/api/missions").json()
    assert {each["name"]: each["text"] for each in told} == {name: shipped_mission_text(name) for name in shipped_missions()}


def test_a_mission_is_checked_as_it_is_typed(http: httpx.Client) -> None:
    text = ONE_HOOP.replace("F hoop0", "F hoop1").replace("vehicle:", "  vehicel:")
    told = http.post("/api/missions/check", content=text.replace("  vehicel:", "vehicel:"), headers=YAML).json()
    assert told["sound"] is False
    unknown = next(fault for fault in told["faults"] if fault["keys"] == ["vehicel"])
    assert (unknown["line"], unknown["column"]) == (8, 1)
    assert "Did you mean 'vehicle'?" in unknown["message"]
    sound = http.post("/api/missions/check", content=ONE_HOOP, headers=YAML).json()
    assert sound["sound"]
    assert sound["faults"] == []
    assert sound["formula"] == "F hoop0"
    assert sound["sentences"] == ["At some time in hoop0."]
    assert sound["digest"] == parse_mission(ONE_HOOP).digest()
    as_json = http.post("/api/missions/check", json=parse_mission(ONE_HOOP).resolved()).json()
    assert as_json["digest"] == sound["digest"]
    escaped = http.post(
        "/api/missions/check", content=b'{"vehicle": "\\ud83d\\ude81", "a\\\\ud83d\\\\ude81": 1}', headers=JSON
    ).json()
    said = " ".join(fault["message"] for fault in escaped["faults"])
    assert "\U0001f681" in said
    assert ["a\\ud83d\\ude81"] in [fault["keys"] for fault in escaped["faults"]]
    half = http.post("/api/missions/check", content=b'{"name": "\\ud83d"}', headers=JSON).json()
    assert "half of a surrogate pair" in half["faults"][0]["message"]


@pytest.mark.parametrize(
    "text", ["", "[", "- 1\n", "a: &x [*x]", "!!python/object/apply:os.system [ls]", "a: 1\na: 2\n", "\t: {"]
)
def test_what_is_no_mission_is_told_with_its_line(text: str, http: httpx.Client) -> None:
    told = http.post("/api/missions/check", content=text, headers=YAML).json()
    assert told["sound"] is False
    assert told["faults"][0]["message"]
    refused = http.post("/api/jobs", content=text, headers=YAML)
    assert refused.status_code == 422
    assert refused.json()["exit_code"] == 2


def test_a_body_that_is_no_text_or_of_another_kind_is_refused(http: httpx.Client) -> None:
    assert "not UTF-8" in str(
        assert_refused(http.post("/api/jobs", content=b"\xff\xfe\x00", headers=YAML), 422, "bad-input")["detail"]
    )
    assert_refused(http.post("/api/jobs", content=b"<a/>", headers={"content-type": "text/xml"}), 415, "unsupported-media")
    assert_refused(http.post("/api/words/check", content=b"{}", headers=YAML), 415, "unsupported-media")
    assert_refused(http.post("/api/jobs", content=b"x" * 2_000_000, headers=YAML), 413, "body-too-large")


def test_faults_of_what_is_submitted_are_those_that_the_library_finds(http: httpx.Client) -> None:
    text = ONE_HOOP.replace("radii: [0.2, 0.2, 0.2]", "radii: [0.2, -1]")
    told = assert_refused(http.post("/api/jobs", content=text, headers=YAML), 422, "mission-error")
    with pytest.raises(verify.data.MissionError) as found:
        parse_mission(text)
    assert told["detail"] == str(found.value)
    assert [fault["line"] for fault in told["faults"]] == [fault.line for fault in found.value.faults]  # type: ignore[attr-defined]


def test_a_job_is_done_once_and_found_again(done: Submitted, http: httpx.Client) -> None:
    again = http.post("/api/jobs", content=ONE_HOOP, headers=YAML)
    assert again.status_code == 200
    assert again.json()["id"] == done.id
    assert again.json()["found"]
    told = http.get(f"/api/jobs/{done.id}").json()
    assert told["state"] == "done"
    assert told["problem"] is None
    assert [stage["name"] for stage in told["stages"]] == ["plan", "round 1", "flight", "files"]
    assert told["stages"][0]["found"]["words"]["quad0"]
    assert all(claim["outcome"] == "holds" for claim in told["stages"][1]["found"]["claims"])
    assert told["summary"]["mission"] == "one-hoop"
    proof = told["stages"][3]["found"]["proof"]
    assert proof["checked"] == proof["claims"] == len(told["summary"]["claims"])
    assert proof["sentences"][-1] == f"{proof['claims']} of {proof['claims']} claims checked by the kernel"
    assert {claim["proof"] for claim in told["stages"][1]["found"]["claims"]} == {"judged"}, (
        "the proof is written with the files"
    )
    listed = http.get("/api/jobs", params={"state": "done", "limit": 500}).json()
    assert [job["stages"][0]["found"] for job in listed if job["id"] == done.id] == [{}]


def test_events_are_told_again_from_where_they_were_left(done: Submitted, http: httpx.Client) -> None:
    text = http.get(f"/api/jobs/{done.id}/events").text
    ids = [int(found) for found in re.findall(r"^id: (\d+)$", text, re.MULTILINE)]
    kinds = re.findall(r"^event: (\w+)$", text, re.MULTILINE)
    data = [json.loads(found) for found in re.findall(r"^data: (.*)$", text, re.MULTILINE)]
    assert ids == sorted(set(ids))
    assert len(ids) == len(data) == len(kinds)
    assert kinds[0] == "state"
    assert kinds[-1] == "state"
    assert {"stage", "claim"} <= set(kinds)
    later = http.get(f"/api/jobs/{done.id}/events", headers={"last-event-id": str(ids[3])}).text
    assert [int(found) for found in re.findall(r"^id: (\d+)$", later, re.MULTILINE)] == ids[4:]
    assert http.get(f"/api/jobs/{done.id}/events", params={"after": ids[-1]}).status_code == 204


def test_files_are_fetched_by_job_and_name(done: Submitted, http: httpx.Client, tmp_path: Path) -> None:
    place = f"/api/jobs/{done.id}"
    listed = {entry["name"]: entry for entry in http.get(f"{place}/files").json()}
    assert {"mission.yaml", "plan.json", "quad0.csv", "certificate.json", "flight.csv", "report.html"} <= set(listed)
    csv = http.get(f"{place}/files/quad0.csv")
    assert csv.headers["content-disposition"] == 'attachment; filename="quad0.csv"'
    assert len(csv.content) == listed["quad0.csv"]["size"]
    tag = csv.headers["etag"]
    assert tag == f'"{listed["quad0.csv"]["sha256"]}"'
    assert http.get(f"{place}/files/quad0.csv", headers={"if-none-match": tag}).status_code == 304
    assert http.get(f"{place}/files/crazyswarm2/quad0.csv").status_code == 200
    assert http.get(f"{place}/certificate").json()["digest"] == json.loads(done.file("certificate.json"))["digest"]
    assert http.get(f"{place}/plan").json()["plan"]["cost"] == json.loads(done.file("plan.json"))["cost"]
    page = http.get(f"{place}/report")
    assert len(page.content) <= 2_000_000
    assert "sandbox" in page.headers["content-security-policy"]
    with zipfile.ZipFile(io.BytesIO(http.get(f"{place}/archive").content)) as packed:
        packed.extractall(tmp_path)
    assert verify.recheck(tmp_path).holds
    again = http.post(f"{place}/recheck").json()
    assert again["digest"] == verify.recheck(tmp_path).digest()
    for certificate in (http.get(f"{place}/certificate").json(), again):
        assert certificate["kernel"] == VERSION
        assert {claim["proof"] for claim in certificate["claims"]} == {"checked"}
    with zipfile.ZipFile(io.BytesIO(http.get(f"{place}/proof").content)) as packed:
        assert sorted(packed.namelist()) == ["check.pyz", "proof.json", "quad0.csv", "statement.json"]
        assert packed.read("proof.json") == http.get(f"{place}/files/proof.json").content


@few_of(4, "name", ["nope.csv", "../../jobs.sqlite", "..%2f..%2ftokens.json", "/etc/passwd", "%00", "quad0.csv/", "Quad0.csv"])
def test_no_path_of_a_request_is_opened(name: str, done: Submitted, http: httpx.Client) -> None:
    answer = http.get(f"/api/jobs/{done.id}/files/{name}")
    assert answer.status_code in (404, 405)
    assert answer.headers["content-type"] == "application/problem+json"


def test_flights_are_written_for_vehicles(done: Submitted, http: httpx.Client) -> None:
    names = [each["name"] for each in http.get("/api/exports").json()]
    assert names[:2] == ["crazyswarm2", "crazyflie"]
    assert_refused(http.get(f"/api/jobs/{done.id}/exports/px4", params={"rate": 20}), 422, "not-certified")
    assert_refused(http.get(f"/api/jobs/{done.id}/exports/ros2", params={"rate": 20}), 422, "not-certified")
    for form, asked in (("crazyswarm2", {}), ("px4", {"rate": 20, "anyway": True})):
        packed = http.get(f"/api/jobs/{done.id}/exports/{form}", params=asked)
        with zipfile.ZipFile(io.BytesIO(packed.content)) as archive:
            note = archive.read("README.txt").decode()
        assert ("not rehearsed with this vehicle's controller" in note) == (form != "crazyswarm2")
    told = assert_refused(http.get(f"/api/jobs/{done.id}/exports/px5"), 422, "bad-input")
    assert "Did you mean 'px4'?" in str(told["detail"])
    assert_refused(http.get(f"/api/jobs/{done.id}/exports/crazyflie", params={"vehicle": "other"}), 422, "not-certified")
    assert_refused(http.get(f"/api/jobs/{done.id}/exports/crazyflie", params={"rate": 20}), 422, "bad-input")
    assert_refused(http.get(f"/api/jobs/{done.id}/exports/crazyflie", params={"robots": "nobody"}), 422, "bad-input")


def test_an_export_is_a_job_to_follow(done: Submitted, http: httpx.Client) -> None:
    asked = f"/api/jobs/{done.id}/exports/ros2"
    accepted = http.post(asked, params={"rate": 17, "anyway": True})
    assert accepted.status_code == 201
    job = accepted.json()
    assert (accepted.headers["location"], job["of"]) == (f"/api/jobs/{job['id']}", done.id)
    at_once = http.get(asked, params={"rate": 17, "anyway": True, "wait": 0})
    if at_once.status_code == 202:  # it may be written by now
        assert at_once.json()["id"] == job["id"]
        assert at_once.headers["location"] == accepted.headers["location"]
    http.get(f"/api/jobs/{job['id']}/events")
    assert http.get(accepted.headers["location"]).json()["state"] == "done"
    assert http.post(asked, params={"rate": 17, "anyway": True}).status_code == 200
    again = http.get(asked, params={"rate": 17, "anyway": True})
    assert again.headers["content-disposition"] == f'attachment; filename="{done.id}-ros2.zip"'
    assert again.content == http.get(f"/api/jobs/{job['id']}/files/ros2.zip").content
    assert job["id"] not in [each["id"] for each in http.get("/api/jobs").json()]
    assert_refused(http.get(asked, params={"wait": -1}), 422, "bad-input")
    assert_refused(http.get(asked, headers={"sec-fetch-site": "cross-site"}), 403, "forbidden")
    assert_refused(http.post(f"/api/jobs/{job['id']}/exports/px4"), 409, "conflict")


def test_a_recorded_flight_is_judged_by_its_job_or_by_its_files(done: Submitted, http: httpx.Client) -> None:
    flown = {"recording": ("flight.csv", done.file("flight.csv"), "text/csv")}
    told = http.post("/api/flights/judge", files=flown, data={"job": done.id, "max_speed": "2"}).json()
    assert told["mission"] == "one-hoop"
    assert told["outcome"] == "holds"
    assert told["claims"]
    names = ("mission.yaml", "plan.json", "certificate.json", "quad0.csv")
    sent = [("files", (f"run/{name}", done.file(name), "text/plain")) for name in names]
    by_files = http.post("/api/flights/judge", files=[*flown.items(), *sent], data={"max_speed": "2"}).json()
    assert by_files == told
    flawed = [*sent[:-1], ("files", ("quad0.csv", done.file("quad0.csv").replace(b"0.1", b"0.2", 1), "text/plain"))]
    refused = http.post("/api/flights/judge", files=[*flown.items(), *flawed], data={"max_speed": "2"})
    assert refused.status_code == 422
    assert "scratch" not in refused.text
    assert "either" in str(assert_refused(http.post("/api/flights/judge", files=flown), 422, "bad-input")["detail"])
    assert_refused(http.post("/api/flights/judge", files=flown, data={"job": "nope"}), 404, "not-found")
    assert_refused(http.post("/api/flights/judge", files=flown, data={"job": done.id, "max_speed": "fast"}), 422, "bad-input")
    assert http.post(
        "/api/flights/judge", content=b"--x\r\nbad", headers={"content-type": "multipart/form-data"}
    ).status_code in (400, 422)


def test_words_are_held_against_a_formula(http: httpx.Client) -> None:
    def checked(**asked: object) -> dict[str, object]:
        return http.post("/api/words/check", json=asked).json()

    assert checked(formula="F a", words=["1; a"])["word"]["outcome"] == "holds"  # type: ignore[index]
    team = checked(formula="F a & F b", words={"r": "a", "s": "b"}, reading="joint")
    assert team["sequential"]["outcome"] == team["parallel"]["outcome"] == "holds"  # type: ignore[index]
    for asked, kind in (
        ({"formula": "F (", "words": ["a"]}, "formula-error"),
        ({"formula": "F a", "words": ["a;;"]}, "bad-input"),
        ({"formula": "F a", "words": []}, "bad-input"),
        ({"formula": "F a", "words": ["a"], "readin": "own"}, "bad-input"),
    ):
        told = assert_refused(http.post("/api/words/check", json=asked), 422, kind)
        assert told["detail"]
    twice = http.post("/api/words/check", content=b'{"formula": "a", "formula": "b", "words": ["a"]}', headers=JSON)
    assert "twice" in str(assert_refused(twice, 422, "bad-input")["detail"])


@pytest.mark.parametrize(
    "path", ["", "/events", "/files", "/files/plan.json", "/report", "/certificate", "/plan", "/archive", "/exports/px4"]
)
def test_a_job_that_is_not_there(path: str, http: httpx.Client) -> None:
    assert_refused(http.get(f"/api/jobs/0123456789abcdef-1{path}"), 404, "not-found")


def test_what_changes_a_job_that_is_not_there(http: httpx.Client) -> None:
    assert_refused(http.post("/api/jobs/nope/cancel"), 404, "not-found")
    assert_refused(http.post("/api/jobs/nope/recheck"), 404, "not-found")
    assert_refused(http.delete("/api/jobs/nope"), 404, "not-found")


def test_a_job_is_cancelled_and_deleted(http: httpx.Client) -> None:
    job = http.post("/api/jobs", content=shipped_mission_text("firefighting"), headers=YAML, params={"seed": 987}).json()
    assert_refused(http.delete(f"/api/jobs/{job['id']}"), 409, "conflict")
    assert_refused(http.get(f"/api/jobs/{job['id']}/archive"), 409, "conflict")
    assert http.post(f"/api/jobs/{job['id']}/cancel").json()["state"] == "cancelled"
    assert http.post(f"/api/jobs/{job['id']}/cancel").json()["state"] == "cancelled"
    assert http.delete(f"/api/jobs/{job['id']}").status_code == 204
    assert_refused(http.get(f"/api/jobs/{job['id']}"), 404, "not-found")


def test_a_job_has_the_pace_that_is_asked(http: httpx.Client) -> None:
    def asked(text: str, **params: object) -> dict[str, object]:
        job = http.post("/api/jobs", content=text, headers=YAML, params={"seed": 988, **params}).json()
        http.post(f"/api/jobs/{job['id']}/cancel")
        return job

    fast, written = asked(ONE_HOOP, pace="1"), asked(ONE_HOOP.replace("pace: nominal", "pace: 1"))
    assert fast["id"].split("-")[0] == written["id"].split("-")[0]
    assert fast["id"].split("-")[0] != asked(ONE_HOOP)["id"].split("-")[0]
    assert asked(ONE_HOOP.replace("pace: nominal", "pace: 0.5"), pace="nominal")["state"] == "queued"


@pytest.mark.parametrize("pace", ["0", "2", "nan", "fast", "true", ""])
def test_a_job_of_what_is_no_pace_is_refused(pace: str, http: httpx.Client) -> None:
    told = http.post("/api/jobs", content=ONE_HOOP, headers=YAML, params={"pace": pace})
    assert "A pace is a share of the fastest flight" in str(assert_refused(told, 422, "bad-input")["detail"])


def test_a_formula_that_cannot_be_met_is_told_as_the_command_line_tells_it(http: httpx.Client) -> None:
    text = ONE_HOOP.replace("F hoop0", "F hoop0 & G !hoop0")
    job = http.post("/api/jobs", content=text, headers=YAML).json()
    http.get(f"/api/jobs/{job['id']}/events")
    told = http.get(f"/api/jobs/{job['id']}").json()
    assert told["state"] == "failed"
    assert told["problem"]["type"] == "/problems/no-plan"
    assert told["problem"]["exit_code"] == 3
    assert told["problem"]["core"]
    assert "No plan satisfies the formula" in told["problem"]["detail"]


@pytest.mark.parametrize("asked", [{"limit": 0}, {"limit": "x"}, {"state": "asleep"}])
def test_questions_that_make_no_sense(asked: dict[str, str], http: httpx.Client) -> None:
    told = assert_refused(http.get("/api/jobs", params=asked), 422, "bad-input")
    assert next(iter(asked)) in str(told["detail"])


def test_paths_and_methods_that_are_not_there(http: httpx.Client) -> None:
    assert_refused(http.get("/api/nothing"), 404, "not-found")
    assert "/docs" in str(assert_refused(http.put("/api/jobs"), 405, "method-not-allowed")["detail"])
    assert http.get("/problems/not-certified").text.startswith("The checker could not prove")
    assert_refused(http.get("/problems/nothing"), 404, "not-found")


def test_the_documentation_needs_nothing_from_elsewhere(http: httpx.Client) -> None:
    page = http.get("/docs").text
    assets = re.findall(r'(?:src|href)="([^"]+)"', page)
    assert assets
    assert all(each.startswith("/docs/") for each in assets)
    assert all(http.get(each).status_code == 200 for each in assets)
    described = http.get("/openapi.json").json()
    assert described["openapi"].startswith("3.1")
    mission = described["components"]["schemas"]["Mission"]
    assert mission["additionalProperties"] is False
    assert "workspace" in mission["required"]
    assert set(REGION_SHAPES.names()) <= set(described["components"]["schemas"]["Region"]["properties"])
    for path, methods in described["paths"].items():
        for method, route in methods.items():
            assert route["summary"], (method, path)
            assert route["tags"], (method, path)
            assert {"401", "422", "429", "500"} <= set(route["responses"]), (method, path)
            for status, answer in route["responses"].items():
                if int(status) >= 400 and path != "/health":
                    assert "application/problem+json" in answer.get("content", {}) or status == "416", (method, path, status)


def test_the_documentation_s_example_can_be_submitted(http: httpx.Client) -> None:
    assert http.post("/api/missions/check", content=MISSION_EXAMPLE, headers=YAML).json()["sound"]


def test_it_says_whether_it_works_and_how_pages_may_behave(http: httpx.Client) -> None:
    answer = http.get("/health")
    assert answer.json()["ok"]
    assert answer.json()["versions"]["ltlplan"]
    assert "server" not in answer.headers
    for name, value in {
        "x-content-type-options": "nosniff",
        "x-frame-options": "DENY",
        "referrer-policy": "same-origin",
    }.items():
        assert answer.headers[name] == value
    assert "default-src 'none'" in answer.headers["content-security-policy"]
    assert "default-src 'self'" in http.get("/docs").headers["content-security-policy"]
