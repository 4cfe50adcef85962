"""Drawings of automata: sound markup, every state in it, and labels that can be read."""

from __future__ import annotations

from itertools import combinations
from xml.etree import ElementTree

import pytest

from ltlplan.logic.translation import translate
from ltlplan.service.views.drawings import automaton_svg
from verify.data import parse_formula
from verify.data.sections import Trace

FORMULAS = [
    "F loc1 & F loc2",
    "!unloading_dock U loading_station & F charging",
    "F (alpha_station & X F (beta_station & X F gamma_station))",
    "G F survey_north & G F survey_south",
    "(a U b) & (c U d)",
    "false",
]
Box = tuple[float, float, float, float]


def overlap(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


@pytest.mark.parametrize("trace", ["finite", "infinite"])
@pytest.mark.parametrize("formula", FORMULAS)
def test_a_drawing_names_every_state_and_its_labels_can_be_read(formula: str, trace: Trace) -> None:
    automaton = translate(parse_formula(formula), trace)
    drawn = ElementTree.fromstring(automaton_svg(automaton))
    nodes = [element for element in drawn.iter("g") if element.get("data-state") is not None]
    assert [node.get("data-state") for node in nodes] == [str(state) for state in automaton.states]
    left, top, width, height = map(float, drawn.get("viewBox", "").split())
    taken: list[Box] = []
    for node in nodes:
        x, y = map(float, node.get("transform", "").removeprefix("translate(").removesuffix(")").split())
        taken.append((x - 14, y - 14, x + 14, y + 14))
    for label in drawn.iter("text"):
        if label.get("class") == "guard":
            x, y = float(label.get("x", "")), float(label.get("y", "")) - 4
            half = 3.3 * len((label[0].tail or "").strip())
            taken.append((x - half, y - 6, x + half, y + 6))
            assert left <= x - half
            assert x + half <= left + width
            assert top <= y - 6
            assert y + 6 <= top + height
    assert [pair for pair in combinations(taken, 2) if overlap(*pair)] == []
