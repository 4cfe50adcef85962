"""Errors as problems of HTTP, and back."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from ltlplan.service.problems import (
    TooManyRequests,
    error_of,
    kinds,
    problem_of,
)
from verify.data import BadInput, Infeasible, LtlplanError, MissionError, NotCertified, Witness, parse_mission


@pytest.mark.parametrize(
    "error",
    [
        BadInput("one\ntwo"),
        NotCertified(
            "no",
            [
                Witness(
                    claim="formula",
                    sentence="s",
                    robot="r",
                    time=1.5,
                    word=(("r", frozenset({"b", "a"})),),
                    times=((0.0, 1.0),),
                    order=((("r", 1), ("s", 2)),),
                )
            ],
        ),
        Infeasible("too tight", Witness(claim="limits.speed", sentence="s", bound=2.0, limit=1.0)),
        TooManyRequests("wait", 3.0),
    ],
)
def test_errors_come_back_as_themselves(error: LtlplanError) -> None:
    again = error_of(type(problem_of(error)).model_validate_json(problem_of(error).model_dump_json()))
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert again.exit_code == error.exit_code
    for name in ("witness", "witnesses"):
        assert getattr(again, name, None) == getattr(error, name, None)


def test_a_missions_faults_come_back(tmp_path: Path) -> None:
    with pytest.raises(MissionError) as found:
        parse_mission("name: 3\nfoo: 1\n")
    again = error_of(problem_of(found.value))
    assert isinstance(again, MissionError)
    assert (str(again), again.faults) == (str(found.value), found.value.faults)


def test_a_witness_that_lasts_for_ever_is_told_in_plain_json_and_comes_back_as_it_was() -> None:
    witness = Witness(claim="formula", sentence="x", bound=0.5, word=(("quad0", frozenset({"a"})),), times=((1.0, math.inf),))
    told = problem_of(NotCertified("It breaks.", [witness])).model_dump_json()
    assert json.loads(told, parse_constant=pytest.fail)["witnesses"][0]["times"] == [[1.0, None]]
    again = error_of(type(problem_of(NotCertified("x", ()))).model_validate_json(told))
    assert isinstance(again, NotCertified)
    assert again.witnesses == (witness,)


def test_what_is_no_error_of_ours_is_told_without_its_words() -> None:
    told = problem_of(ValueError("secret"))
    assert (told.type, told.status) == ("/problems/internal-error", 500)
    assert "secret" not in told.detail


def test_every_kind_of_problem_has_a_sentence_and_a_class() -> None:
    for kind, sentence in kinds().items():
        assert sentence.endswith(".")
        base = problem_of(BadInput("x")).model_copy(update={"type": f"/problems/{kind}"})
        assert problem_of(error_of(base)).type == f"/problems/{kind}"
