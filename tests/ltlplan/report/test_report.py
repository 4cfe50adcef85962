"""The report as text: what its first screen says, and what it draws of a cycle. How it looks is for the browser's tests."""

import dataclasses
import re
from collections.abc import Callable

import pytest

import ltlplan
from ltlplan.report.run_page import report_html
from ltlplan.report.summary import holds, visits_text
from tests.conftest import Once
from tests.helpers.pages import bars_of, data_of
from verify.checked_claims import checked_certificate, with_words
from verify.data.plan import RobotPlan


@pytest.fixture(scope="module")
def lasso(once: Once) -> tuple[ltlplan.Result, str]:
    result = once("run of hoops-published at nominal pace", lambda _folder: ltlplan.run("hoops-published", pace="nominal"))
    return result, report_html(result)


def test_the_first_screen_is_the_answer(lasso) -> None:
    result, page = lasso
    (trajectory,) = result.team.values()
    begins, ends = float(trajectory.knots[trajectory.cycle]), float(trajectory.knots[-1])
    header = page[page.index("<header>") : page.index("</header>")]
    text = re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", header))
    cycle = f"[0, {begins:.2f} s] and a cycle of {ends - begins:.2f} s that repeats for ever"
    assert f"Certified for all t in {cycle}, at margin 0.05 m" in text
    assert "Holds only vacuously" in text, "a warning that must not be found only at the end of the page"
    assert "flies exactly hoop1F (hoop2F)*" in text
    assert "Margin 50 mm" in text
    assert "laps" in text


def test_the_page_says_who_proved_each_claim(shipped_run: Callable[[str], ltlplan.Result]) -> None:
    result = shipped_run("firefighting")
    without = report_html(dataclasses.replace(result, certificate=with_words(result.certificate, None)))
    assert "by the checker; there is none for the kernel" in without
    assert "all claims are judged: there is no proof for the kernel" in without
    certificate = checked_certificate(result.plan, result.team, result.certificate).certificate
    one = dataclasses.replace(certificate.claims[5], proof="judged", missing="no marks are named so")
    partly = dataclasses.replace(certificate, claims=(*certificate.claims[:5], one, *certificate.claims[6:]))
    page = report_html(dataclasses.replace(result, certificate=partly))
    count = len(certificate.claims)
    text = re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", page[page.index("<header>") : page.index("</header>")]))
    assert f"Proof {count - 1} of {count} claims checked by the kernel" in text
    claims = page[page.index(">Claims<") :]
    assert "no marks are named so" in claims
    every = claims[claims.index("<details>") :]
    assert (every.count("<td>checked</td>"), every.count("<td>judged</td>")) == (count - 1, 1)
    assert "(judged, not covered by the kernel)" in claims, "braking to a hover"


def test_labels_are_drawn_for_every_lap_that_is_flown(lasso) -> None:
    result, page = lasso
    end = data_of(page)["player"]["step"] * (len(data_of(page)["player"]["paths"][0]) - 1)
    _, bars = bars_of(page, "labels")
    must = sorted(
        (end * bar.start, end * (bar.start + bar.length)) for bar in bars if bar.row == "quad0 hoop2" and "must" in bar.title
    )
    laps = result.mission.spec.repeat
    assert len(must) == laps
    (trajectory,) = result.team.values()
    lap = trajectory.duration - trajectory.knots[trajectory.cycle]
    for index, (start, end) in enumerate(must):
        assert start == pytest.approx(must[0][0] + index * lap, abs=2e-3)
        assert end - start == pytest.approx(must[0][1] - must[0][0], abs=2e-3)
    flown = trajectory.flattened(laps)
    region = result.mission.all_regions["hoop2"]
    for start, end in must:
        assert region.level(flown.evaluate([(start + end) / 2])[:, :3])[0] < 1.0


def test_a_cycle_does_not_seem_to_stop_at_the_end_of_its_last_lap(lasso) -> None:
    result, _ = lasso
    error = result.log.error[:, 0]
    assert error[-1] < 2 * error[-20:-1].max(), "the robot flies on into the next lap, and so does what it is held against"


def test_a_flight_that_left_its_tube_is_told_with_its_figures(lasso) -> None:
    result, _ = lasso
    error = result.log.error.copy()
    error[100, 0] = 0.0612
    strayed = dataclasses.replace(result, log=dataclasses.replace(result.log, error=error, peak=error.max(axis=0)))
    assert not holds(strayed)
    page = report_html(strayed)
    verdict = re.search(r'<p class="verdict fails">(.*?)</p>', page)
    assert verdict is not None
    assert "quad0 strayed 61.2 mm from its certified path, the margin is 50 mm" in verdict.group(1)


def test_every_figure_says_what_it_is_to_those_who_cannot_see_it(lasso) -> None:
    _, page = lasso
    figures = re.findall(r'<div id="(\w+)" class="(?:figure|figure scene|bars)"([^>]*)>', page)
    assert {name for name, _ in figures} == {*data_of(page)["figures"], "labels", "truth"}
    for _, attributes in figures:
        assert re.search(r'role="(img|group)"', attributes)  # a scene, which keys turn, is a group
        assert re.search(r'aria-label="[^"]{20,}"', attributes)


def test_visits_name_actions_and_cycles(lasso) -> None:
    result, _ = lasso
    assert visits_text(result.plan.robots["quad0"]) == "hoop1F (hoop2F)*"
    plan = ltlplan.plan(ltlplan.load_mission("firefighting"))
    assert visits_text(plan.robots["quad0"]) == "waterF [no_water -> carrying] smokeF loc2F"
    idle = next(robot for robot in plan.robots.values() if not robot.visits)
    assert isinstance(idle, RobotPlan)
    assert visits_text(idle) == "stays at its start"
