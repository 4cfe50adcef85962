"""A job's stages, each from bytes to bytes: what they make is what `ltlplan run` makes, to the last bit."""

from __future__ import annotations

import functools
import json
import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

import ltlplan
import refine
import verify
from ltlplan import pipeline
from ltlplan.replanning import cuts
from ltlplan.service.execution.serialization import from_bytes, to_bytes
from ltlplan.service.execution.stages import Outcome, mission_bytes, plan_of, run_stage, share_after
from tests.helpers.few import few_of
from tests.helpers.motion.flights import small_mission
from verify.data import InternalError, Mission, Trajectory, load_vehicle, parse_mission
from verify.data.files.mission_file import mission_to_yaml
from verify.data.progress import silent


def staged(mission: Mission) -> list[tuple[str, Outcome]]:
    """Do all stages of a mission, one after the other."""
    name: str | None = "plan"
    value = mission_bytes(mission)
    outcomes: list[tuple[str, Outcome]] = []
    while name is not None:
        outcome = run_stage(name, value, silent)
        outcomes.append((name, outcome))
        name, value = outcome.following, outcome.value
    return outcomes


def with_margin(formula: str = "F a", pace: str = "nominal") -> Mission:
    return small_mission(formula, margin=0.05, extra=f"planner: {{pace: {pace}}}")


@functools.cache
def done() -> tuple[tuple[str, Outcome], ...]:
    """Do all stages of the mission of one region."""
    return tuple(staged(with_margin()))


@pytest.mark.slow
def test_a_jobs_files_are_those_of_the_command(tmp_path: Path) -> None:
    mission = with_margin()
    outcomes = done()
    assert [name for name, _ in outcomes] == ["plan", "round 1", "flight", "files"]
    ltlplan.run(mission, tmp_path / "run")
    written = {
        str(path.relative_to(tmp_path / "run")): path.read_bytes() for path in (tmp_path / "run").rglob("*") if path.is_file()
    }
    made = dict(outcomes[-1][1].files)
    assert made.keys() == {*written, "watch.json"}
    assert [name for name in written if made[name] != written[name]] == []


@pytest.mark.slow
def test_soft_parts_go_through_the_stages_as_through_the_library() -> None:
    plain = with_margin()
    mission = plain.changed(spec={**plain.spec.model_dump(), "soft": [{"formula": "F a"}, {"formula": "G !a", "weight": 0.5}]})
    outcomes = dict(staged(mission))
    assert outcomes["round 1"].found["soft"][-1] == "Weight 1 of 1.5 is certified (judged, not covered by the kernel)."
    made = dict(outcomes["files"].files)
    assert [part["verdict"] for part in json.loads(made["certificate.json"])["soft"]] == ["holds", "fails"]


@pytest.mark.slow
def test_what_is_refused_to_the_last_can_be_watched(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = verify.judge
    monkeypatch.setattr(verify, "judge", lambda plan, team, margin=None: judge(plan, team, margin=0.5))
    monkeypatch.setattr(cuts, "MAX_ROUNDS", 1)
    *_, (name, last) = staged(with_margin(pace="0.7"))
    assert name == "round 2"  # at the plan's own times
    assert last.following is None
    assert last.problem is not None
    assert last.problem.exit_code == 5
    assert last.problem.witnesses
    assert not json.loads(dict(last.files)["watch.json"])["holds"]
    assert not last.found["certified"]


def test_what_a_refused_round_found_goes_into_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = verify.judge
    monkeypatch.setattr(verify, "judge", lambda plan, team, margin=None: judge(plan, team, margin=0.5))
    planned = run_stage("plan", mission_bytes(with_margin()), silent)
    refused = run_stage("round 1", planned.value, silent)
    assert refused.following == "round 2"
    monkeypatch.setattr(verify, "judge", judge)
    again = run_stage("round 2", refused.value, silent)
    tried: list[pipeline.Flight | pipeline.Conflict] = [pipeline.Flight(ltlplan.plan(with_margin()), *_refused(with_margin()))]
    first = pipeline.Candidate(ltlplan.plan(with_margin()))
    *_, second = pipeline.candidates(first, tried)
    assert second.rounds == 1
    expected = second.better_of(pipeline.attempted(second))
    assert expected is not None
    assert again.value == to_bytes(expected)


def _refused(mission: Mission) -> tuple[dict[str, Trajectory], verify.Certificate]:
    """Refine once and judge at a margin that the flight cannot have."""
    plan = ltlplan.plan(mission)
    team = refine.refine(plan)
    return team, verify.judge(plan, team, margin=0.5)


def test_what_stages_find_is_plain_data_for_people() -> None:
    outcomes = dict(done())
    found = {name: json.loads(json.dumps(outcome.found, allow_nan=False)) for name, outcome in outcomes.items()}
    assert found["plan"]["visits"] == {"r0": "a"}
    assert found["round 1"]["certified"]
    assert {claim["outcome"] for claim in found["round 1"]["claims"]} == {"holds"}
    assert found["flight"]["tracking"]["r0"]["worst"] < 0.05
    assert "certificate.json" in found["files"]["files"]
    summary = outcomes["files"].summary
    assert summary is not None
    assert summary["holds"]
    assert outcomes["files"].problem is None


@few_of(1, "stage", ["plan", "round 1", "flight"])
def test_a_stages_value_survives_to_the_last_bit(stage: str) -> None:
    value = dict(done())[stage].value
    again = from_bytes(value)
    assert to_bytes(again) == value
    assert to_bytes(from_bytes(to_bytes(again))) == value


def test_the_plan_can_be_read_from_what_planning_made() -> None:
    outcomes = dict(done())
    plan = ltlplan.plan(with_margin())
    assert plan_of(outcomes["plan"].value) == plan
    assert plan_of(outcomes["round 1"].value).digest() == plan.digest()


def test_shares_grow_from_stage_to_stage() -> None:
    shares = [share_after(name) for name in ("plan", *(f"round {i}" for i in range(1, 7)), "flight", "files")]
    assert shares == sorted(set(shares))
    assert shares[-1] == 1.0


def test_a_stage_that_there_is_not_is_refused() -> None:
    with pytest.raises(InternalError, match="no stage 'landing'"):
        run_stage("landing", mission_bytes(with_margin()), silent)


def test_numbers_survive_to_the_last_bit() -> None:
    numbers = (0.1 + 0.2, -0.0, float("inf"), 1e-310, 2**70, np.float64(1 / 3), True, None, "ä")
    again = from_bytes(to_bytes(numbers))
    assert repr(again) == repr((*numbers[:5], 1 / 3, *numbers[6:]))


def test_what_has_no_written_form_is_refused() -> None:
    with pytest.raises(InternalError, match="has no written form"):
        to_bytes(object())


@pytest.mark.parametrize(
    "text", ['{"$": "os.system", "fields": {"command": "true"}}', '{"no": "kind"}', "[", '{"$": "array", "index": 7}']
)
def test_only_known_kinds_are_read(text: str) -> None:
    buffer = BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("value.json", text)
    with pytest.raises(InternalError, match=r"unknown kind|cannot be read"):
        from_bytes(buffer.getvalue())


def test_bytes_that_are_no_value_are_refused() -> None:
    with pytest.raises(InternalError, match="cannot be read"):
        from_bytes(b"PK nothing")


def test_a_margin_that_fits_its_proof_is_the_commands() -> None:
    """A margin that is taken from the proof goes through the stages as through the library, and the page is told what is proved."""
    vehicle = load_vehicle("crazyflie-2.1").changed(controller="geometric")
    slow = with_margin().changed(vehicle=vehicle, limits={"speed": 0.2, "acceleration": 0.2})
    text = mission_to_yaml(slow)
    told = "margin: auto\ndisturbance: {airframe: crazyflie-2.1, wind: 0.02}\n"
    mission = parse_mission(text.replace("margin: 0.05\n", told))
    round_1 = run_stage("round 1", run_stage("plan", mission_bytes(mission), silent).value, silent)
    result = ltlplan.run(mission)
    assert round_1.following == "flight"
    assert round_1.found["margin"] == result.certificate.margin < 0.05
    assert round_1.found["tube"] == "proved"
    assert round_1.found["fitted"].endswith(f"{1000 * result.certificate.margin:g} mm: cost {result.plan.cost_text}.")
    (sentence,) = round_1.found["tracking_proved"]
    assert sentence in [claim.sentence for claim in result.certificate.claims]


@pytest.mark.slow
def test_a_mission_with_such_a_margin_makes_the_same_files(tmp_path: Path) -> None:
    ltlplan.run("proved-inspection", tmp_path / "run")
    made = dict(staged(ltlplan.load_mission("proved-inspection"))[-1][1].files)
    for name in ("certificate.json", "mission.yaml", "quad0.csv"):
        assert made[name] == (tmp_path / "run" / name).read_bytes()
