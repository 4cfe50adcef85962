"""What is said of a mission while it is typed."""

import json
from typing import Any

import pytest

from ltlplan import parse_mission
from ltlplan.missions import shipped_mission_text, shipped_missions
from ltlplan.service.page.missions.checking import add_edges, change_formula, change_margin, check_text, leave_out
from tests.helpers.few import few_of
from verify.data import BadInput

FIRE = shipped_mission_text("firefighting")


def _silent(_sentence: str, _share: float) -> None:
    pass


def _underlined(text: str) -> list[tuple[str, str]]:
    return [(fault["keys"], text[fault["from"] : fault["to"]]) for fault in check_text(text, _silent)["faults"]]


@few_of(3, "name", shipped_missions())
def test_shipped_missions_have_no_faults_and_are_shown(name: str) -> None:
    told = check_text(shipped_mission_text(name), _silent)
    assert told["faults"] == []
    assert told["name"] == name
    assert told["world"]["robots"] == list(parse_mission(shipped_mission_text(name)).agents)
    assert json.loads(json.dumps(told)) == told


@pytest.mark.parametrize(
    ("old", "new", "keys", "underlined"),
    [
        ("F loc1 &", "F lok1 &", "spec.formula", "lok1"),
        ("F loc1 &", "F loc1 & &", "spec.formula", "&"),
        ("margin: 0.05", "margin: -1", "margin", "-1"),
        ("quad1: {start", "quad1: {strat", "agents.quad1.strat", "strat"),
        ("name: firefighting", "name: <script>alert(1)</script>", "name", "<script>alert(1)</script>"),
    ],
)
def test_a_fault_stands_where_it_was_made(old: str, new: str, keys: str, underlined: str) -> None:
    assert (keys, underlined) in _underlined(FIRE.replace(old, new))


def test_the_formulas_own_faults_stand_in_it() -> None:
    (fault,) = check_text(FIRE.replace("F loc1 &", "F lok1 &"), _silent)["faults"]
    assert fault["in_formula"] == [2, 6]
    assert "Did you mean 'loc1'?" in fault["message"]
    assert "\n" not in fault["message"]


@pytest.mark.parametrize("text", ["", "\n\n", "a: [1", "- 1\n", "\x00", "a: !b c", "😀: 1", "{" * 300])
def test_any_text_is_answered(text: str) -> None:
    told = check_text(text, _silent)
    assert told["faults"]
    for fault in told["faults"]:
        assert 0 <= fault["from"] <= fault["to"] <= len(text)


def test_a_formula_is_written_into_the_mission() -> None:
    changed = change_formula(FIRE, "F loc2", _silent)
    assert parse_mission(changed).spec.formula == "F loc2"


def test_offers_change_the_mission() -> None:
    assert parse_mission(change_margin(FIRE, 0.03, _silent)).margin == 0.03
    edges: Any = parse_mission(add_edges(FIRE, [("loc1", "loc2")], _silent)).environment
    assert ("loc1", "loc2") in edges.edges
    left = parse_mission(leave_out(FIRE, "G(smoke -> carrying)", _silent))
    assert left.spec.formula == "F loc1 & F loc2"
    with pytest.raises(BadInput, match="no part of the formula"):
        leave_out(FIRE, "F water", _silent)
