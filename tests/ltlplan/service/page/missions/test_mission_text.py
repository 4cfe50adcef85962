"""A mission's text, with one value changed and all else as it was."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ltlplan import parse_mission
from ltlplan.missions import shipped_mission_text, shipped_missions
from ltlplan.service.page.missions.mission_text import span_of, with_edges, with_value
from tests.helpers.few import few_of
from verify.data import BadInput

FIRE = shipped_mission_text("firefighting")


@few_of(3, "name", shipped_missions())
def test_only_the_value_changes(name: str) -> None:
    text = shipped_mission_text(name)
    changed = with_value(text, ("margin",), 0.031)
    stated = text.replace("margin: auto", "margin: 0.1")  # a stated margin is not fitted
    assert parse_mission(changed) == parse_mission(stated).changed(margin=0.031)
    different = [line for line in changed.splitlines() if line not in text.splitlines()]
    assert different == ["margin: 0.031"]


@pytest.mark.parametrize(
    "formula",
    ["!smoke U carrying", "F loc1", "true", "F loc1 | (F loc2 & !water)", "G(smoke -> carrying) <-> F loc1", "[]loc1"],
)
def test_a_formula_reads_back_as_it_was_written(formula: str) -> None:
    assert parse_mission(with_value(FIRE, ("spec", "formula"), formula)).spec.formula == formula


@given(st.text(st.characters(codec="utf-8", exclude_categories=("Cs", "Cc")), max_size=40))
def test_any_text_stays_one_value(value: str) -> None:
    from ruamel.yaml import YAML

    changed = with_value("name: a\nspec:\n  formula: F b # why\nmargin: 0.1\n", ("spec", "formula"), value)
    read = YAML(typ="safe", pure=True).load(changed)
    assert read == {"name": "a", "spec": {"formula": value}, "margin": 0.1}


def test_what_is_missing_is_added() -> None:
    assert with_value("name: a\n", ("margin",), 0.2) == "name: a\nmargin: 0.2\n"
    assert with_value("spec:\n  trace: finite\n", ("spec", "formula"), "F a") == "spec:\n  formula: F a\n  trace: finite\n"
    assert with_value("spec: {trace: finite}\n", ("spec", "formula"), "F a") == "spec: {formula: F a, trace: finite}\n"


def test_edges_are_added_to_either_kind_of_list() -> None:
    changed = parse_mission(with_edges(FIRE, [("loc1", "loc2")]))
    assert changed.environment is not None
    assert changed.environment.edges[-1] == ("loc1", "loc2")
    block = "environment:\n  edges:\n    - [a, b]\nrobot: 1\n"
    assert (
        with_edges(block, [("c", "d"), ("e", "f")])
        == "environment:\n  edges:\n    - [a, b]\n    - [c, d]\n    - [e, f]\nrobot: 1\n"
    )


@pytest.mark.parametrize("text", ["", "- a\n", "a: [1\n", "name: x\n"])
def test_a_text_without_the_section_is_refused_in_words(text: str) -> None:
    with pytest.raises(BadInput, match=r"."):
        with_value(text, ("spec", "formula"), "F a")
    with pytest.raises(BadInput, match=r"environment\.edges"):
        with_edges(text, [("a", "b")])


def test_a_place_is_the_value_or_the_nearest_key_above() -> None:
    start, end = span_of(FIRE, ("hoops", "smoke", "yaw_deg")) or (0, 0)
    assert FIRE[start:end] == "150"
    start, end = span_of(FIRE, ("hoops", "smoke", "colour")) or (0, 0)
    assert FIRE[start:end] == "smoke"
    assert span_of("a: [1", ("a",)) is None
