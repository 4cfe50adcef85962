"""`ltlplan doctor`: libraries that are missing or too old, engines, and links that somebody answers on."""

import importlib.metadata
import json
import socket
from typing import Any

import pytest
from typer.testing import CliRunner

from ltlplan.cli import app
from ltlplan.commands.support import installation
from ltlplan.commands.support.installation import Probe, libraries, links

ASKED = [
    "numpy>=1.26,<3",
    "scipy>=999",
    "pymavlink>=2; extra == 'px4'",
    "no-such-library>=1; extra == 'px4'",
    "pytest; extra == 'test'",
]


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.metadata, "requires", lambda _name: ASKED)
    monkeypatch.setattr(installation, "links", lambda: (Probe("Crazyradio", False, "none"),))


def doctor(*options: str) -> Any:
    return CliRunner().invoke(app, ["doctor", *options])


def test_libraries_are_found_missing_or_in_another_version(asked: None) -> None:
    assert [(item.name, item.state) for item in libraries() or ()] == [("numpy", "ok"), ("scipy", "old")]
    assert [(item.name, item.state) for item in libraries("px4") or ()] == [("pymavlink", "ok"), ("no-such-library", "missing")]


def test_a_core_that_is_at_fault_ends_with_what_to_do(asked: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(installation, "engines", lambda: (Probe("planning", False, "RuntimeError: no"),))
    done = doctor("--json")
    found = json.loads(done.output)
    assert done.exit_code == 2
    version = importlib.metadata.version("scipy")
    assert found["faults"] == [f"scipy {version} is not >=999", "planning: RuntimeError: no"]
    assert [item["state"] for item in found["extras"]["px4"]] == ["ok", "missing"]


def test_a_missing_extra_is_no_fault_and_says_what_it_would_add(asked: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.metadata, "requires", lambda _name: [text for text in ASKED if "scipy" not in text])
    monkeypatch.setattr(installation, "engines", lambda: (Probe("planning", True, "works"),))
    done = doctor()
    assert done.exit_code == 0
    assert "px4        no-such-library is missing; pip install 'ltlplan[px4]' to fly PX4 vehicles" in done.output


def test_sources_that_are_not_installed_are_told_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> list[str]:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "requires", absent)
    assert libraries() is None


def test_links_are_found_by_who_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(installation, "_radio", lambda: "Crazyradio version 0.99")
    monkeypatch.setattr(installation, "LISTEN", 0.05)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free, socket.create_server(("127.0.0.1", 0)) as service:
        free.bind(("127.0.0.1", 0))
        monkeypatch.setattr(installation, "MAVLINK", free.getsockname()[1])
        monkeypatch.setattr("ltlplan.service.settings.PORT", service.getsockname()[1])
        taken = links()
    silent = links()
    assert [probe.answers for probe in taken] == [True, False, True]
    assert "cannot listen" in taken[1].sentence
    assert [probe.answers for probe in silent] == [True, False, False]
    assert "nobody sent anything" in silent[1].sentence


def test_every_extra_for_users_is_described() -> None:
    given = set(importlib.metadata.metadata("ltlplan").get_all("Provides-Extra") or ())
    assert given - {"test", "docs", "dev", "benchmark"} == set(installation.EXTRAS)


@pytest.mark.slow
def test_this_machine_plans() -> None:
    assert [probe.answers for probe in installation.engines()] == [True, True]
