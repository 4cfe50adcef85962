"""Studies and comparisons over HTTP: one mission over values of a key, as ordinary jobs, a table and a plot."""

from __future__ import annotations

import csv
import io
import time
import xml.etree.ElementTree as ET
from pathlib import Path

import httpx
import pytest

from ltlplan import Client
from ltlplan.service.figures import claim_pairs, compared, figures_of
from ltlplan.service.models import Job
from ltlplan.service.queries import varied_missions
from ltlplan.service.study_models import Figures, Study, StudyMember
from ltlplan.service.views.plots import study_plot
from tests.helpers.serving.services import ONE_HOOP, serving, start
from verify.data import BadInput, MissionError
from verify.data.progress import silent


def test_a_study_is_one_mission_over_values_and_its_members_are_ordinary_jobs(client: Client, tmp_path: Path) -> None:
    before = client.submit_text(ONE_HOOP, seed=1).wait()
    (tmp_path / "hoop.yaml").write_text(ONE_HOOP)
    made = client.study(str(tmp_path / "hoop.yaml"), "seed", range(3), name="three seeds")
    assert (made.name, made.key, made.size, made.owner) == ("three seeds", "planner.seed", 3, "local")
    assert made.members[1].figures.job == before.id, "one that was computed already is not computed again"
    done = client.wait_study(made)
    assert [(member.value, member.figures.state, member.figures.seed) for member in done.members] == [
        (seed, "done", seed) for seed in range(3)
    ]
    figures = done.members[1].figures
    summary = before.job.summary
    assert summary is not None
    assert (figures.cost, figures.duration, figures.margin) == (summary["cost"], summary["duration"], summary["margin"])
    assert figures.claims == ()
    assert figures.seconds is not None
    rows = list(csv.reader(io.StringIO(client.study_table(made))))
    assert [row[0] for row in rows] == ["planner.seed", "0", "1", "2"]
    plot = ET.fromstring(client.study_plot(made))
    assert len([each for each in plot.iter() if each.tag.endswith("circle")]) == 3
    assert made.id in [each.id for each in client.studies("THREE")]
    client.delete_study(made)
    assert made.id not in [each.id for each in client.studies()]
    assert client.job(figures.job).state == "done", "its jobs stay"


def test_faults_are_told_before_anything_is_submitted(client: Client, http: httpx.Client) -> None:
    count = len(client.jobs(limit=500))
    asked = {"mission": ONE_HOOP, "key": "limits.speed", "values": [1.0, -1.0]}
    told = http.post("/api/studies", json=asked)
    assert told.status_code == 422
    assert "limits.speed = -1.0" in told.json()["detail"]
    assert told.json()["faults"][0]["keys"] == ["limits", "speed"]
    for wrong in ({"values": []}, {"values": [1, 1]}, {"key": "limits..speed"}, {"key": "limits.sped"}, {"values": [None]}):
        assert http.post("/api/studies", json={**asked, **wrong}).status_code == 422
    assert len(client.jobs(limit=500)) == count
    assert http.get("/api/studies/999").status_code == 404
    assert http.get("/api/studies/999/plot").status_code == 404


def test_a_deleted_job_is_a_row_that_says_so(client: Client) -> None:
    made = client.wait_study(client.study(client.check_mission(ONE_HOOP), "seed", [21, 1]))
    client.delete(made.members[0].figures.job)
    again = client.studied(made)
    assert [member.figures.state for member in again.members] == ["deleted", "done"]
    assert client.cancel_study(made).members[1].figures.state == "done", "what has ended stays"


def test_two_results_are_compared_claim_by_claim(client: Client) -> None:
    slow = client.submit_text(ONE_HOOP).wait()
    fast = client.submit_text(ONE_HOOP, pace=0.9).wait()
    found = client.compare(slow, fast)
    assert found.first.duration is not None
    assert found.second.duration is not None
    assert found.first.duration > found.second.duration
    assert found.first.words == found.second.words != {}
    assert [(each.name, each.robot) for each in found.first.claims] == [(each.name, each.robot) for each in found.second.claims]
    assert any(line.startswith("+") and "pace: 0.9" in line for line in found.difference.splitlines())
    assert client.compare(slow, slow).difference == ""
    speeds = next(pair for pair in claim_pairs(found) if pair[0] is not None and pair[0].name == "limits.speed")
    assert speeds[0] is not None
    assert speeds[1] is not None
    assert speeds[0].room is not None
    assert speeds[1].room is not None
    assert speeds[0].room > speeds[1].room


def test_claims_that_only_one_has_are_listed_after_the_others() -> None:
    def claimed(*names: str) -> Figures:
        stage = {"name": "round 1", "found": {"claims": [{"name": name, "outcome": "holds", "robot": None} for name in names]}}
        return figures_of(Job.model_validate({"id": "a", "mission": "m", "submitted": "", "stages": [stage]}))

    found = compared(claimed("a", "b"), claimed("c", "b"), "")
    assert [each.name for each in found.second.claims] == ["b", "c"]
    names = [tuple(None if each is None else each.name for each in pair) for pair in claim_pairs(found)]
    assert names == [("a", None), ("b", "b"), (None, "c")]


def test_sections_are_made_and_what_is_no_section_is_refused() -> None:
    text = ONE_HOOP.replace("planner: {pace: nominal, samples: 20, iterations: 2}\n", "")
    assert [each.planner.seed for each in varied_missions(text, "planner.seed", (3, 4), silent)] == [3, 4]
    starts = varied_missions(ONE_HOOP, "agents.quad0.start", ((0.0, 0.0, 1.1),), silent)
    assert starts[0].agents["quad0"].start[2] == 1.1
    assert varied_missions(ONE_HOOP, "agents.quad0.start.2", (1.2,), silent)[0].agents["quad0"].start[2] == 1.2
    with pytest.raises(BadInput, match="no section"):
        varied_missions(ONE_HOOP, "name.more", (1,), silent)
    with pytest.raises(MissionError, match="sed"):
        varied_missions(ONE_HOOP, "planner.sed", (1,), silent)


@pytest.mark.parametrize(
    "values", [(1,), (1, 2), (0.5, 0.5000001), ("F a", "<b>&\"'", "x" * 100), tuple(range(200)), (True, False)]
)
def test_any_values_are_plotted(values: tuple[object, ...]) -> None:
    members = tuple(
        StudyMember(
            value=value,  # type: ignore[arg-type]  # any of them
            figures=Figures(job="a", state="failed" if i % 3 == 2 else "done", duration=None if i % 3 == 2 else 1.0 * i),
        )
        for i, value in enumerate(values)
    )
    study = Study(id=1, name="s", key="spec.formula", owner="me", made="", size=len(values), members=members)
    plot = ET.fromstring(study_plot(study, "duration"))
    kinds = [each.tag.rpartition("}")[2] for each in plot.iter()]
    assert kinds.count("circle") == sum(i % 3 != 2 for i in range(len(values)))
    assert kinds.count("path") == sum(i % 3 == 2 for i in range(len(values)))


@pytest.mark.slow
def test_a_study_goes_on_after_kills(tmp_path: Path) -> None:
    made = None
    for seconds in (0.5, 3.0, 5.0):
        process, served = start(tmp_path / "data", workers=2)
        with Client(served.url) as client:
            if made is None:
                made = client.study(client.check_mission(ONE_HOOP), "seed", range(6))
            time.sleep(seconds)
        process.kill()
        process.wait()
    assert made is not None
    with serving(tmp_path / "data", workers=2) as served, Client(served.url) as client:
        done = client.wait_study(made)
        assert [(member.value, member.figures.state) for member in done.members] == [(seed, "done") for seed in range(6)]
        assert client.studies()[0].id == made.id
