"""Limits out of a file, and told to those whom they meet."""

from __future__ import annotations

from pathlib import Path

import pytest

from ltlplan import Client
from ltlplan.service.limits_file import limits_told, read_limits
from ltlplan.service.settings import Limits, Rate
from verify.data import BadInput


def test_what_a_file_leaves_out_is_as_usual(tmp_path: Path) -> None:
    path = tmp_path / "limits.yaml"
    path.write_text("stage_seconds: 7200\nquestions: 4\nreads: {per_second: 1, burst: 2}\n")
    found = read_limits(path)
    assert (found.stage_seconds, found.questions, found.reads) == (7200.0, 4, Rate(1.0, 2))
    assert found.stage_megabytes == Limits().stage_megabytes
    path.write_text("")
    assert read_limits(path) == Limits()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("stage_second: 1", "Did you mean 'stage_seconds'"),
        ("stage_seconds: 0", "above 0"),
        ("stage_seconds: .inf", "above 0"),
        ("stage_seconds: yes", "above 0"),
        ("questions: 1.5", "whole number"),
        ("reads: 3", "is a rate"),
        ("reads: {per_second: 1, burst: 0}", "reads.burst"),
        ("- 1", "no table"),
        ("{", "no YAML"),
        ("!!python/object/apply:os.system [ls]", "no YAML"),
    ],
)
def test_what_is_no_limit_is_told(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "limits.yaml"
    path.write_text(text)
    with pytest.raises(BadInput, match=said):
        read_limits(path)


def test_a_service_tells_its_limits(client: Client) -> None:
    told = client.limits()
    assert told.keys() == limits_told(Limits()).keys()
    assert (told["body_seconds"], told["stage_megabytes"]) == (1.5, 4096)
