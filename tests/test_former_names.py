"""Former names of what users type: each goes on, with a warning or a note, and means the same as the present one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

import flight
import verify
from ltlplan.cli import app
from ltlplan.commands.support.old_spellings import spelled_now
from ltlplan.missions import load_mission
from ltlplan.service import models
from ltlplan.service.client import Client
from verify.data import BadInput, Mission, MissionError, mission_to_yaml, parse_mission
from verify.data.sections import Planner

KINDS = """\
format: 1
name: kinds
spec: {formula: F a}
vehicle: crazyflie-2.1
workspace: {min: [-3, -3, 0], max: [3, 3, 3]}
regions:
  a: {center: [1, 0, 1], radii: [0.3, 0.3, 0.3]}
planner: {objective: longest}
robot: {initial: empty, states: {empty: [], full: [loaded]}, actions: [{from: empty, to: full, at: a}]}
robots:
  carrier: {initial: empty, states: {empty: []}}
agents:
  quad0: {start: [0, 0, 1], robot: carrier}
  quad1: {start: [0, 2, 1]}
"""
PRESENT = (
    KINDS.replace("robots:", "capabilities:")
    .replace("\nrobot:", "\ncapability:")
    .replace(", robot:", ", capability:")
    .replace("longest", "max")
)


@pytest.mark.parametrize(
    ("module", "former", "present"),
    [
        (verify, "Asked", "FlightReference"),
        (verify, "asked_of", "load_reference"),
        (flight, "Told", "RecordingOptions"),
        (flight, "Share", "Proportion"),
        (models, "LiveTold", "EventsAccepted"),
    ],
    ids=lambda each: each if isinstance(each, str) else "",
)
def test_a_name_is_found_by_its_former_one_with_a_warning(module: object, former: str, present: str) -> None:
    with pytest.warns(DeprecationWarning, match=rf"\.{former} is .*\.{present} now") as said:
        assert getattr(module, former) is getattr(module, present)
    assert said[0].filename == __file__, "the warning shows the line that is to be changed"
    assert former not in getattr(module, "__all__", ())


def test_a_name_that_never_was_is_none() -> None:
    with pytest.raises(AttributeError, match="no attribute 'Heard'"):
        models.Heard  # noqa: B018


WORDS = {"one": [{"a"}, {"b"}], "two": [{"b"}]}


@pytest.mark.parametrize(
    ("call", "former", "present"),
    [
        (lambda **given: verify.check_team("G !(a & b)", WORDS, **given), {"reading": "joint"}, {"team": "joint"}),
        (lambda **given: verify.check_ordered("G !(a & b)", WORDS, [], **given), {"reading": "joint"}, {"team": "joint"}),
        (verify.AuditLimits, {"own_limits": False}, {"file_limits": False}),
        (flight.RecordingOptions, {"called": {"quad0": "cf1"}}, {"rename": {"quad0": "cf1"}}),
    ],
)
def test_an_argument_is_given_by_its_former_name_with_a_warning(
    call: Callable[..., object], former: dict[str, object], present: dict[str, object]
) -> None:
    with pytest.warns(DeprecationWarning, match=f"`{next(iter(former))}` is `{next(iter(present))}` now"):
        found = call(**former)
    assert found == call(**present)
    with pytest.raises(TypeError, match=f"give `{next(iter(present))}` alone"):
        call(**former, **present)


def test_attributes_go_on_by_their_former_names() -> None:
    with pytest.warns(DeprecationWarning, match="`rename`"):
        assert flight.RecordingOptions(rename={"quad0": "cf1"}).called == {"quad0": "cf1"}
    with pytest.warns(DeprecationWarning, match="`file_limits`"):
        assert verify.AuditLimits(file_limits=False).own_limits is False


@pytest.mark.parametrize("export", [flight.export, Client.export])
def test_exports_are_forced_by_the_former_name_with_a_warning(export: Callable[..., object]) -> None:
    with pytest.warns(DeprecationWarning, match="`anyway` is `force` now"), pytest.raises((TypeError, AttributeError)):
        export(anyway=True)
    with pytest.raises(TypeError, match="give `force` alone"):
        export(anyway=True, force=True)


def test_a_client_sends_and_lists_events_by_former_names(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Client, "send_events", lambda self, flight, *events: (flight, events))
    monkeypatch.setattr(Client, "events", lambda self, flight, after=0: (flight, after))
    with Client("http://127.0.0.1:1") as client:
        with pytest.warns(DeprecationWarning, match=r"`Client.send_events`"):
            assert client.tell("lab", "one fails", "two leaves") == ("lab", ("one fails", "two leaves"))
        with pytest.warns(DeprecationWarning, match=r"`Client.events`"):
            assert client.told("lab", after=3) == ("lab", 3)


@pytest.mark.parametrize(
    ("former", "present"),
    [
        ("check F\\ a a --reading joint", "check F\\ a a --team joint"),
        ("check F\\ a a --reading=joint", "check F\\ a a --team=joint"),
        ("export run --anyway", "export run --force"),
        ("certify run --flight x --called a=b --called c=d", "certify run --flight x --rename a=b --rename c=d"),
        ("audit show.skyc --no-own-limits", "audit show.skyc --no-file-limits"),
        ("audit show.skyc --own-limits", "audit show.skyc --file-limits"),
    ],
)
def test_a_command_takes_former_options_with_a_note(former: str, present: str) -> None:
    words, note = spelled_now(former.split())
    assert words == present.split()
    assert note is not None
    assert " now." in note


def test_an_option_by_both_names_is_refused() -> None:
    with pytest.raises(BadInput, match=r"`--reading` is the former name of `--team`; give `--team` alone"):
        spelled_now(["check", "F a", "a", "--reading", "own", "--team=joint"])
    assert spelled_now(["check", "F a", "--", "--reading"]) == (["check", "F a", "--", "--reading"], None)


def test_a_former_option_does_the_same_and_help_shows_the_present_one() -> None:
    words = ["check", "G !(a & b)", "1; a; 1", "1; b; 1", "--json"]
    former, present = (CliRunner().invoke(app, [*words, option, "joint"]) for option in ("--reading", "--team"))
    assert former.exit_code == present.exit_code == 5
    assert former.stdout == present.stdout
    assert former.stderr == "note: `--reading` is `--team` now.\n"
    shown = CliRunner().invoke(app, ["check", "--help"]).stdout
    assert "--team" in shown
    assert "--reading" not in shown


def test_missions_are_the_same_by_either_keys() -> None:
    former, present = parse_mission(KINDS), parse_mission(PRESENT)
    assert PRESENT.count("capabilit") == 3
    assert present == former
    assert present.digest() == former.digest()
    assert mission_to_yaml(present) == mission_to_yaml(former)
    assert present.planner.objective == Planner(objective="max").objective == "longest"


@pytest.mark.parametrize("alone", [True, False])
def test_mission_files_are_read_by_either_keys(tmp_path: Path, alone: bool) -> None:
    file = tmp_path / "kinds.yaml"
    file.write_text(PRESENT if alone else f"{PRESENT}include: rooms.yaml\n")
    (tmp_path / "rooms.yaml").write_text("format: 1\n")
    found: Mission = load_mission(file)
    assert found == parse_mission(KINDS)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (PRESENT.replace("capability: carrier", "capability: carier"), r"mission:13: agents.quad0.capability: 'carier' is no table"),
        (PRESENT.replace("quad1: {", "quad1: {robot: carrier, capability: carrier, "), r"mission:14: agents.quad1.capability: .*one of them"),
        (f"{PRESENT}robot: {{}}\n", r"mission:9: capability: `capability` says the same as `robot`; give one of them"),
        (PRESENT.replace("capability: carrier", "capabilities: carrier"), r"mission:13: agents.quad0.capabilities: unknown key"),
        (KINDS.replace("longest", "least"), "'sum', 'longest' or 'max'"),
    ],
)  # fmt: skip
def test_faults_name_keys_as_they_are_written(text: str, says: str) -> None:
    with pytest.raises(MissionError, match=says):
        parse_mission(text)
