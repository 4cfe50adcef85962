"""The summary that fits a screen: what was asked, found, proved and flown, and what to do next."""

from collections.abc import Callable
from dataclasses import replace

from ltlplan import Result
from ltlplan.report.brief import brief_lines
from ltlplan.report.run_page import _claim_table
from ltlplan.report.summary import claim_rows, summary_lines, tracking_sentences


def test_a_screen_says_what_was_asked_found_proved_and_flown(shipped_run: Callable[[str], Result]) -> None:
    result = shipped_run("firefighting")
    lines = brief_lines(result)
    assert [line[:8].strip() for line in lines if line[0] != " "] == ["asked", "found", "proved", "flown", "next"]
    text = "\n".join(lines)
    assert result.mission.spec.formula is not None
    assert result.mission.spec.formula in text
    for line in summary_lines(result):
        if line.startswith(("Certified", "proof ")):
            assert line.removeprefix("proof").strip().partition(", the largest")[0] in text
    for name, robot in result.plan.robots.items():
        assert f"{name} {'flies' if robot.visits else 'stays'}" in text


def test_forty_robots_fit_a_screen(shipped_run: Callable[[str], Result]) -> None:
    result = shipped_run("firefighting")
    flies = result.plan.robots["quad0"]
    many = replace(result, plan=result.plan.model_copy(update={"robots": {f"quad{k}": flies for k in range(40)}}))
    lines = brief_lines(many)
    assert len(lines) <= 24
    assert "        and 34 more robots fly" in lines


def test_what_does_not_hold_is_said_whole(shipped_run: Callable[[str], Result]) -> None:
    result = shipped_run("firefighting")
    first, *others = result.certificate.claims
    refused = replace(first, outcome="undecided", sentence="a sentence " * 30 + "with an end.")
    text = "\n".join(brief_lines(replace(result, certificate=replace(result.certificate, claims=(refused, *others)))))
    assert f"not so: {refused.sentence}" in text
    assert f"the claim {first.name} undecided" in text
    assert "campaign" not in text


def test_tables_round_bounds_to_their_safe_side(shipped_run: Callable[[str], Result]) -> None:
    certificate = shipped_run("firefighting").certificate
    first = certificate.claims[0]
    least, most = (
        replace(first, unit="m", bound=bound, limit=limit, margin=abs(bound - limit))
        for bound, limit in ((1.02674, 0.3), (1.02621, 2.0))
    )
    rows = claim_rows(replace(certificate, claims=(least, most)))
    assert [row[3] for row in rows] == ["1.026 m", "1.027 m"]


def test_what_is_proved_of_tracking_is_said_of_the_robot_that_may_stray_farthest(shipped_run: Callable[[str], Result]) -> None:
    result = shipped_run("firefighting")
    assert tracking_sentences(result.certificate) == []
    first = replace(result.certificate.claims[0], name="tracking", outcome="holds", unit="m", limit=0.05)
    proved = [
        replace(first, robot=f"quad{k}", bound=bound, sentence=f"quad{k} stays within {bound} m. wind 1 mm. Assumed: rest.")
        for k, bound in enumerate((0.003, 0.004, 0.002))
    ]
    certificate = replace(result.certificate, claims=(*result.certificate.claims, *proved))
    whole = f"{proved[1].sentence} 2 other robots stray no farther."
    assert tracking_sentences(certificate) == [whole]
    told = replace(result, certificate=certificate)
    assert f"tracking  {whole}" in summary_lines(told)
    assert any(line.endswith("quad1 stays within 0.004 m. wind 1 mm.") for line in brief_lines(told))
    assert whole in _claim_table(certificate, "")
