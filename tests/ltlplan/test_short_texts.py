"""What prints of a run's values: a few readable lines, without arrays."""

from __future__ import annotations


def test_a_result_and_all_that_is_in_it_print_shortly(shipped_run) -> None:
    run = shipped_run("firefighting")
    for value in (run.plan, run.certificate, run.log, *run.team.values()):
        assert str(value) == repr(value)
        assert "array" not in repr(value)
        assert len(repr(value)) < 400
    said = str(run)
    assert "array" not in said
    assert len(said.splitlines()) < 12
    assert f"cost {run.plan.cost:.3f}" in said
    assert f"{len(run.certificate.claims)} of {len(run.certificate.claims)} claims proved" in said
