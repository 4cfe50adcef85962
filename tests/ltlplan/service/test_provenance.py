"""What findings rest on: told in full, compared entry by entry, and part of the key by which results are found."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import metadata

import ltlplan
from ltlplan.service import provenance


def test_all_engines_are_named_with_their_versions() -> None:
    found = provenance.software()
    assert found["ltlplan"] == metadata.version("ltlplan")
    assert found["numpy"] == metadata.version("numpy")
    assert found["python"] == f"{sys.version_info.major}.{sys.version_info.minor}"
    shown_only = {"packaging", "rich", "typer"}
    required = {
        line.split(";")[0].split("<")[0].split(">")[0] for line in metadata.requires("ltlplan") or () if "extra ==" not in line
    }
    assert {name.replace("-", ".") for name in required - shown_only} <= {name.replace("-", ".") for name in found}


def test_another_process_of_this_machine_says_the_same() -> None:
    code = "import json; from ltlplan.service.provenance import here; print(json.dumps(here()))"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert json.loads(told) == provenance.here()
    assert provenance.differences(provenance.here(), json.loads(told)) == []


def test_the_instructions_that_numpy_may_use_are_part_of_it() -> None:
    assert provenance.machine()["BLAS kernels"] != "unknown"
    assert provenance.machine()["instructions"]


def test_differences_name_both_sides() -> None:
    ours, theirs = {"numpy": "2.4", "scipy": "1.15", "osqp": "1.0"}, {"numpy": "2.1", "scipy": "1.15", "extra": "3"}
    assert provenance.differences(ours, theirs) == [
        "extra 3 there, missing here", "numpy 2.1 there, 2.4 here", "osqp missing there, 1.0 here",
    ]  # fmt: skip


def test_a_key_is_of_all_that_was_asked_and_of_who_answers(monkeypatch) -> None:
    mission = ltlplan.load_mission("firefighting")
    key = provenance.key_of(mission)
    assert key == provenance.key_of(ltlplan.load_mission("firefighting"))
    planner = mission.planner.model_copy(update={"seed": mission.planner.seed + 1})
    assert provenance.key_of(mission.model_copy(update={"planner": planner})) != key
    monkeypatch.setattr(provenance, "software", lambda: {"ltlplan": "0"})
    assert provenance.key_of(mission) != key
