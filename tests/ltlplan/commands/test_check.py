import json

import pytest
from typer import Typer
from typer.testing import CliRunner

from ltlplan.commands import check
from verify.data import BadInput

app = Typer()
app.command("check")(check.command)


def run(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


def test_a_word_that_holds():
    done = run("F a & G(b -> c)", "1; a; b & c")
    assert done.exit_code == 0
    assert done.output.startswith("word: holds.")


def test_a_lasso():
    assert run("G F a", "1; cycle{a; 1}").exit_code == 0
    assert run("F G a", "1; cycle{a; 1}").exit_code == 5


def test_a_team_with_its_counterexample():
    done = run("!F(a & F(b & F a))", "1; a; 1", "1; b; 1")
    assert done.exit_code == 5
    assert "sequential: holds." in done.output
    assert "parallel: fails." in done.output
    assert "counterexample: quad0 {}, {a}" in done.output


def test_joint_letters():
    assert run("G !(a & b)", "1; a; 1", "1; b; 1").exit_code == 0
    assert run("G !(a & b)", "1; a; 1", "1; b; 1", "--team", "joint").exit_code == 5


def test_for_machines():
    done = run("F a", "1", "--json")
    data = json.loads(done.output)
    assert done.exit_code == 5
    assert data["word"]["outcome"] == "fails"
    assert data["word"]["counterexample"] == [["", []]]


def test_mistakes_are_bad_input():
    for arguments in (("F a &", "a"), ("F a", "a;;b"), ("F a", "cycle{a}", "b"), ("GFa", "a"), ("GFa", "a", "1")):
        done = run(*arguments)
        assert isinstance(done.exception, BadInput)


@pytest.mark.parametrize("arguments", [(), ("F a",)])
def test_a_formula_and_a_word_are_needed(arguments):
    assert run(*arguments).exit_code == 2
