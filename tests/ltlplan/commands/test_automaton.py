from __future__ import annotations

import json

import pytest
import typer
from typer.testing import CliRunner

from ltlplan.commands.automaton import command
from ltlplan.logic.small_automata import read_hoa
from verify.data import BadInput, MissingEngine, Word

app = typer.Typer()
app.command()(command)
FIRE = "firefighting"


def run(*arguments: str) -> str:
    result = CliRunner().invoke(app, list(arguments))
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.output


def test_hoa_of_a_formula_and_of_a_mission() -> None:
    assert read_hoa(run("F a & F b"), trace="finite").accepts(Word.of([["a"], ["b"]]))
    assert "States: 4" in run(FIRE)
    assert 'name: "infinite-words"' in run("hoops-ltl")
    assert 'name: "infinite-words"' in run("G F a", "--trace", "infinite")
    assert "deterministic" not in run("F(a & X b)", "--form", "small")


def test_operators_without_spaces_are_refused() -> None:
    with pytest.raises(BadInput, match="write `G F a`"):
        run("GFa", "--trace", "infinite")
    assert run("FG(a)", "--trace", "infinite") == run("F G a", "--trace", "infinite")


def test_json_says_which_states_decompose() -> None:
    data = json.loads(run(FIRE, "--json"))
    assert data["decomposition"] == data["states"] == [0, 1, 2, 3]
    assert len(data["accepting"]) == 1
    assert "decomposition" not in json.loads(run("G F a", "--trace", "infinite", "--format", "json"))


def test_conjunctions_made_on_demand_are_written_down_when_asked() -> None:
    from ltlplan.logic.conjunction import Conjunction
    from ltlplan.logic.translation import translate

    parts = [translate(f"F {name}") for name in "abcd"]
    assert len(Conjunction(parts).multiplied().states) == 16  # type: ignore[arg-type]


@pytest.mark.parametrize("view", ["robot", "environment", "agent", "planning"])
def test_the_systems_of_a_mission(view: str) -> None:
    assert run(FIRE, "--show", view, "--format", "dot").startswith("digraph")
    graph = json.loads(run(FIRE, "--show", view, "--json"))
    assert graph["nodes"]
    assert graph["edges"]


def test_systems_need_a_mission() -> None:
    with pytest.raises(BadInput, match="needs a mission"):
        run("F a", "--show", "agent")


def test_a_drawing_needs_graphviz(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.which", lambda _name: None)
    with pytest.raises(MissingEngine, match="Graphviz"):
        run("F a", "--format", "svg")


def test_a_drawing_where_graphviz_is_installed() -> None:
    import shutil

    if shutil.which("dot") is None:
        pytest.skip("Graphviz is not installed")
    assert "</svg>" in run(FIRE, "--format", "svg")
