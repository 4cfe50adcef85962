"""The service's page in a real browser, as somebody uses it who has never seen it: one server and one browser for the whole story."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest

from ltlplan.online.event_queue import Told
from ltlplan.service.client_parts.long_polling import FollowedService
from ltlplan.service.views.watching import watch_json
from tests.browser.visitor import OF_THE_PAGE, Visitor
from verify import judge
from verify.run_folder import read_folder

pytestmark = OF_THE_PAGE

FORMULA = "F loc1 & F loc2 & G(smoke -> carrying)"


def test_a_mission_from_its_first_mistake_to_a_file_that_is_certified(address: str, chromium: Any, tmp_path: Path) -> None:
    visitor = Visitor(chromium, address)
    _a_mistake_is_underlined_and_mended(visitor)
    _what_is_written_is_never_markup(visitor)
    job = _stages_are_seen_as_they_go(visitor)
    assert re.fullmatch(r"[0-9a-f]+-\d+", job)
    _the_flight_plays(visitor)
    _the_tightest_claim_is_shown_where_it_is(visitor, job)
    _the_kernel_s_word_is_seen_and_its_proof_taken_away(visitor, job, tmp_path / "proof")
    _a_recorded_flight_is_judged(visitor, job, tmp_path)
    _files_are_taken_away_and_certified_again(visitor, job, tmp_path / "away")
    _a_counterexample_plays(visitor, job, tmp_path / "away")
    _what_is_only_judged_says_so(visitor, job)
    _a_refusal_says_what_would_mend_it(visitor)
    visitor.end()
    _it_is_read_on_a_phone_in_the_dark(Visitor(chromium, address, width=390, height=844, dark=True), job)


def _a_mistake_is_underlined_and_mended(visitor: Visitor) -> None:
    visitor.open("/")
    visitor.wait("document.querySelector('.state')?.textContent.includes('No faults')")
    assert visitor.page.locator(".words li").all_inner_texts()[2] == "Always: if in smoke, then in state carrying."
    assert visitor.page.locator("svg.automaton").count() == 3
    visitor.write_formula("F lok1 & F loc2 & G(smoke -> carrying)")
    visitor.page.keyboard.press("ArrowLeft")
    assert visitor.at() == "Write"
    visitor.wait("document.querySelectorAll('.fault').length === 2")
    assert visitor.page.locator(".fault").all_inner_texts() == ["lok1", "lok1"], "in the mission and in the formula"
    assert "Did you mean 'loc1'?" in visitor.said(".fault-line")
    assert visitor.page.get_by_role("button", name="Plan it").is_disabled()
    visitor.write_formula("F lo")
    visitor.page.keyboard.type("c")
    visitor.page.wait_for_selector(".cm-tooltip-autocomplete")
    assert "loc1hoop" in visitor.said(".cm-tooltip-autocomplete").replace("\n", "")
    visitor.page.keyboard.press("Escape")
    visitor.write_formula(FORMULA)
    visitor.wait("document.querySelector('.state').textContent.includes('No faults') && !document.querySelector('.fault')")


def _what_is_written_is_never_markup(visitor: Visitor) -> None:
    visitor.page.evaluate(
        """() => {
          const view = document.querySelector(".editor:not(.line)").editorView, text = view.state.doc.toString();
          const at = text.indexOf("name: firefighting") + 6;
          view.dispatch({ changes: { from: at, to: at + 12, insert: "<script>document.title = 'mine'</script><img src=x onerror=alert(1)>" } });
        }"""
    )
    visitor.page.wait_for_selector(".fault-line")
    assert "<script>" in visitor.said(".fault-line")
    assert visitor.page.locator(".page img, .page script").count() == 0
    assert visitor.page.title() == "ltlplan"
    visitor.page.get_by_role("button", name="firefighting", exact=True).click()
    visitor.wait("document.querySelector('.state').textContent.includes('No faults: firefighting')")


def _stages_are_seen_as_they_go(visitor: Visitor) -> str:
    visitor.page.get_by_role("button", name="Plan it").click()
    visitor.page.wait_for_selector('[data-stage="plan"]')
    for stage in ("plan", "round 1", "flight", "files"):
        visitor.page.wait_for_selector(f'[data-stage="{stage}"].done')
    assert "waterF [no_water -> carrying] smokeF loc2F" in visitor.said('[data-stage="plan"]')
    assert "All 49 claims are proved" in visitor.said('[data-stage="round 1"]')
    assert "49 of 49 claims checked by the kernel" in visitor.said('[data-stage="files"]')
    visitor.page.wait_for_selector('[role=status][data-state="done"]')
    found = re.search(r"/jobs/([^/]+)/plan$", visitor.page.url)
    assert found, visitor.page.url
    return found[1]


def _the_flight_plays(visitor: Visitor) -> None:
    visitor.page.get_by_role("button", name="Watch it").click()
    visitor.page.wait_for_selector(".flight[data-ready=yes] .holder[data-drawn=yes]")
    now = "Number(document.querySelector('.flight .clock').value)"
    assert visitor.page.locator(".todo b").all_inner_texts() == ["open", "open", "kept so far"]
    visitor.page.keyboard.press("+")
    assert visitor.page.locator(".speed").input_value() == "2"
    for _ in range(3):
        visitor.page.keyboard.press("-")
    assert visitor.page.locator(".speed").input_value() == "0.25", "a flight that is over before it is stopped begins anew"
    visitor.page.keyboard.press("Space")
    visitor.wait(f"{now} > 0.05")
    visitor.page.keyboard.press("Space")
    stopped = visitor.page.evaluate(now)
    visitor.page.keyboard.press("ArrowRight")
    assert visitor.at() == "Watch"
    assert visitor.page.evaluate(now) == pytest.approx(stopped + 0.25, abs=0.02)
    visitor.page.keyboard.press("End")
    visitor.wait(
        "document.querySelector('.flight .todo').textContent.includes('done') && !document.querySelector('.flight .todo .open')"
    )
    assert visitor.page.locator(".automata .node.accepting.here").count() == 3
    visitor.page.keyboard.press("Home")
    assert visitor.page.evaluate(now) == 0


def _the_tightest_claim_is_shown_where_it_is(visitor: Visitor, job: str) -> None:
    claims = visitor.page.request.get(f"{visitor.address}/api/jobs/{job}/files/watch.json").json()["claims"]
    tightest = min((claim for claim in claims if claim["name"] == "rims"), key=lambda claim: claim["room"])
    visitor.tab("Trust")
    visitor.page.locator(".claim", has_text="rims").click()
    assert tightest["sentence"] in visitor.said(".claims .sentence")
    clock = float(visitor.page.locator(".flight .clock").input_value())
    assert clock == pytest.approx(tightest["time"], abs=0.01)
    visitor.page.wait_for_selector(".tag3d.callout")
    assert visitor.page.locator(".tag3d.ring").count() == 1


def _the_kernel_s_word_is_seen_and_its_proof_taken_away(visitor: Visitor, job: str, folder: Path) -> None:
    assert set(visitor.page.locator(".claim .proof").all_inner_texts()) == {"checked"}
    assert "Checked by the kernel." in visitor.said(".claims .sentence")
    assert "49 of 49 claims checked by the kernel" in visitor.said(".kernel")
    for name in ("statement.json", "proof.json", "check.pyz"):
        with visitor.page.expect_download() as coming:
            visitor.page.locator(".kernel").get_by_role("link", name=name, exact=True).click()
        kept = visitor.page.request.get(f"{visitor.address}/api/jobs/{job}/files/{name}").body()
        assert Path(coming.value.path()).read_bytes() == kept
    with visitor.page.expect_download() as coming:
        visitor.page.locator(".kernel").get_by_role("link", name="all of it").click()
    with zipfile.ZipFile(coming.value.path()) as packed:
        packed.extractall(folder)
    done = subprocess.run([sys.executable, "-I", folder / "check.pyz", folder], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.splitlines()[-1]) == (0, "49 of 49 claims checked by the kernel")
    visitor.tab("Take away")
    visitor.page.get_by_role("link", name="The proof and its checker").wait_for()


def _what_is_only_judged_says_so(visitor: Visitor, job: str) -> None:
    watched = visitor.page.request.get(f"{visitor.address}/api/jobs/{job}/files/watch.json").json()
    for claim in watched["claims"]:
        claim.update({"proof": "judged", "missing": "no marks are there"} if claim["name"] == "rims" else {})
    visitor.page.route("**/watch.json", lambda route: route.fulfill(body=json.dumps(watched), content_type="application/json"))
    visitor.open(f"/jobs/{job}/trust")
    visitor.page.locator(".claim", has_text="rims").click()
    assert visitor.said(".claim.chosen .proof") == "judged"
    assert "Not checked by the kernel: no marks are there." in visitor.said(".claims .sentence")
    visitor.page.unroute("**/watch.json")


def _a_recorded_flight_is_judged(visitor: Visitor, job: str, folder: Path) -> None:
    log = folder / "flight.csv"
    visitor.tab("Judge")
    visitor.page.fill("input[name=max_speed]", "1.5")
    log.write_bytes(visitor.page.request.get(f"{visitor.address}/api/jobs/{job}/files/flight.csv").body())
    visitor.page.locator(".judging input[type=file]").set_input_files(log)
    visitor.wait("document.querySelector('.judging .sentence').textContent.startsWith('flight.csv: ')")
    assert visitor.said(".judging .sentence").startswith("flight.csv: "), visitor.said(".judging .sentence")
    visitor.page.wait_for_selector(".flight[data-view=judge] .claim")
    assert visitor.page.locator(".flight .verdict").first.is_visible()


def _files_are_taken_away_and_certified_again(visitor: Visitor, job: str, folder: Path) -> None:
    folder.mkdir()
    visitor.tab("Take away")
    for name in ("mission.yaml", "plan.json", "quad0.csv", "quad1.csv", "quad2.csv"):
        with visitor.page.expect_download() as coming:
            visitor.page.get_by_role("link", name=name, exact=True).click()
        coming.value.save_as(folder / name)
    done = subprocess.run(
        [sys.executable, "-m", "ltlplan", "certify", str(folder), "--json"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    certificate = visitor.page.request.get(f"{visitor.address}/api/jobs/{job}/certificate").json()
    assert json.loads(done.stdout)["trajectories"] == certificate["trajectories"]
    report = visitor.page.request.get(f"{visitor.address}/api/jobs/{job}/report")
    assert len(report.body()) <= 2_000_000
    assert visitor.page.get_by_role("link", name=f"/jobs/{job}").is_visible()


def _a_counterexample_plays(visitor: Visitor, job: str, folder: Path) -> None:
    """See the same flight with a tube in which the formula can be broken."""
    plan, team = read_folder(folder)
    judged = judge(plan, team, margin=0.13)
    refused = watch_json(plan, team, judged)
    bad = [claim for claim in judged.claims if claim.outcome != "holds"]
    (witness,) = (claim.witness for claim in bad if claim.name == "formula")
    assert witness is not None
    visitor.page.route("**/watch.json", lambda route: route.fulfill(body=refused, content_type="application/json"))
    visitor.open(f"/jobs/{job}/trust")
    visitor.page.locator(".claim.fails", has_text="formula").click()
    assert visitor.said(".flight .verdict") == f"{len(bad)} of 49 claims are not proved at a margin of 130 mm."
    letters = visitor.page.locator(".counterexample li")
    assert letters.count() == len(witness.word) > 1
    visitor.page.get_by_role("button", name="Play the counterexample").click()
    visitor.wait("Number(document.querySelector('.flight .clock').value) > 1.7")
    visitor.wait("document.querySelectorAll('.counterexample li.now').length > 0")
    visitor.page.unroute("**/watch.json")


def _a_refusal_says_what_would_mend_it(visitor: Visitor) -> None:
    visitor.tab("Write")
    visitor.write_formula("F loc2 & G !smoke")
    visitor.wait("document.querySelector('.words').textContent.includes('not in smoke')")
    visitor.page.get_by_role("button", name="Plan it").click()
    visitor.page.wait_for_selector('[role=status][data-state="failed"]')
    assert "`F loc2` and `G !smoke` cannot hold together." in visitor.said(".job .words-of-command")
    visitor.page.get_by_role("button", name="What would mend it").click()
    visitor.page.wait_for_selector("[role=tab][aria-selected=true]:text-is('Trust')")
    assert visitor.page.locator(".conflict code").all_inner_texts() == ["F loc2", "G !smoke"]
    visitor.page.get_by_role("button", name="Leave out G !smoke").click()
    visitor.wait("document.querySelector('.words').textContent === 'At some time in loc2.'")
    visitor.wait("document.querySelector('.editor.line').editorView.state.doc.toString() === 'F loc2'")


def _it_is_read_on_a_phone_in_the_dark(visitor: Visitor, job: str) -> None:
    visitor.open(f"/jobs/{job}/watch")
    visitor.page.wait_for_selector(".flight[data-ready=yes] .holder[data-drawn=yes]")
    for name in ("Watch", "Plan", "Trust", "Judge", "Take away", "Live", "Write"):
        visitor.tab(name)
        visitor.page.wait_for_selector(f"[role=tab][aria-selected=true]:text-is('{name}')")
        visitor.wait("document.documentElement.scrollWidth <= 390")  # once it is drawn at its new size
    ink, paper = visitor.page.evaluate(
        "[getComputedStyle(document.body).color, getComputedStyle(document.body).backgroundColor]"
    )
    assert sum(map(int, re.findall(r"\d+", ink)[:3])) > sum(map(int, re.findall(r"\d+", paper)[:3])) + 300
    visitor.end()


def test_a_flight_in_the_air_is_told_an_event_and_answers(address: str, chromium: Any) -> None:
    flight = FollowedService(f"{address}/live/lab", "firefighting")
    visitor = Visitor(chromium, address, width=390)
    visitor.open("/live/lab")
    visitor.page.wait_for_selector("text=lab listens")
    visitor.page.fill("input[name=event]", "quad1 fails")
    visitor.page.keyboard.press("Enter")
    visitor.page.wait_for_selector("td:text-is('not answered yet')")
    visitor.wait("document.querySelector('input[name=event]').value === ''")
    while not (told := flight()):
        visitor.page.wait_for_timeout(50)
    (event,) = told
    assert isinstance(event, Told)
    assert str(event.event) == "quad1 fails and lands"
    event.answer(True, "<b>quad1</b> lands.")
    visitor.page.wait_for_selector("td:text-is('done: <b>quad1</b> lands.')")
    visitor.page.fill("input[name=event]", "<i>quad1</i> flies")
    visitor.page.get_by_role("button", name="Tell").click()
    visitor.page.wait_for_selector(".q-notification:has-text(\"'<i>quad1</i> flies' is no event\")")
    assert visitor.page.locator("td i, td b, .q-notification i.x").count() == 0
    visitor.wait("document.documentElement.scrollWidth <= 390")
    flight.close()
    visitor.page.wait_for_selector("text=lab has ended.")
    visitor.end()
