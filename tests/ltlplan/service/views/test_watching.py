"""What the page shows of a flight, as one file."""

import json
from collections.abc import Callable
from typing import Any

import pytest

import ltlplan
from ltlplan.report.summary import claim_rows
from ltlplan.service.views.watching import watch_json
from refine import refine
from tests.helpers.motion.plans_by_hand import sequence_plan
from verify import judge
from verify.checked_claims import with_words


@pytest.fixture(scope="module")
def watched(shipped_run: Callable[[str], ltlplan.Result]) -> dict[str, Any]:
    run = shipped_run("firefighting")
    return json.loads(watch_json(run.plan, run.team, run.certificate, run.log))


def test_it_is_small_and_names_what_it_shows(watched: dict[str, Any]) -> None:
    assert watched["mission"] == "firefighting"
    assert watched["holds"] is True
    assert watched["player"]["robots"] == ["quad0", "quad1", "quad2"]
    assert len(json.dumps(watched)) < 1_000_000


def test_robots_are_the_last_traces(watched: dict[str, Any]) -> None:
    assert [trace["name"] for trace in watched["traces"][-3:]] == ["quad0", "quad1", "quad2"]


def test_all_claims_are_there_in_the_words_of_the_command(
    watched: dict[str, Any], shipped_run: Callable[[str], ltlplan.Result]
) -> None:
    certificate = shipped_run("firefighting").certificate
    assert [tuple(claim["row"]) for claim in watched["claims"]] == claim_rows(certificate)
    assert [claim["time"] for claim in watched["claims"]] == [claim.time for claim in certificate.claims]


def test_each_claim_says_whether_the_kernel_checked_it(
    watched: dict[str, Any], shipped_run: Callable[[str], ltlplan.Result]
) -> None:
    run = shipped_run("firefighting")
    count = len(watched["claims"])
    assert {claim["proof"] for claim in watched["claims"]} == {"checked"}
    assert watched["proof"][-1] == f"{count} of {count} claims checked by the kernel"
    judged = json.loads(watch_json(run.plan, run.team, with_words(run.certificate, None)))
    assert {claim["proof"] for claim in judged["claims"]} == {"judged"}
    assert judged["proof"] == ["all claims are judged: there is no proof for the kernel"]


def test_the_automata_end_where_they_accept(watched: dict[str, Any]) -> None:
    assert [part["part"] for part in watched["automata"]] == ["F loc1", "F loc2", "G (smoke -> carrying)"]
    for part in watched["automata"]:
        assert set(part["states"][-1][1]) & set(part["accepting"])


def test_a_refused_flight_is_shown_with_its_witnesses(shipped_run: Callable[[str], ltlplan.Result]) -> None:
    run = shipped_run("firefighting")
    refused = judge(run.plan, run.team, margin=0.2)
    shown = json.loads(watch_json(run.plan, run.team, refused))
    assert shown["holds"] is False
    assert shown["largest_margin"] == refused.largest_margin
    broken = [claim for claim in shown["claims"] if claim["outcome"] != "holds"]
    assert broken
    assert all(claim["witness"]["sentence"] for claim in broken if claim["witness"])


def test_a_sequence_has_no_automaton() -> None:
    plan = sequence_plan()
    team = refine(plan, pace="nominal")
    shown = json.loads(watch_json(plan, team, judge(plan, team, largest=False)))
    assert shown["automata"] == []
    assert shown["truth"] == ""
    assert shown["formula"] == plan.mission.sequence
