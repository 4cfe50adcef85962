"""What somebody writes and judges in the page: nothing written is lost, and no verdict stands over what it is not of."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import httpx
import pytest

from ltlplan import Client
from ltlplan.service.security.tokens import Tokens
from tests.browser.devtools import CHROMIUM
from tests.browser.visitor import LIMIT, OF_THE_PAGE, OPTIONS, Visitor, served
from tests.helpers.serving.services import ONE_HOOP

pytestmark = OF_THE_PAGE

MINE = "# mine\n" + ONE_HOOP
LAST = MINE + "# done\n"
OTHER = "# other\nname: [half a mission"


def _port(address: str) -> int:
    return int(address.rpartition(":")[2])


def _drafts(visitor: Visitor) -> list[str]:
    """Return the names of the drafts that are listed."""
    if visitor.page.locator(".drafts summary").count() == 0:
        return []
    return [each.partition(",")[0] for each in visitor.page.locator(".drafts li").all_text_contents()]


def test_what_was_written_survives_another_mission_a_job_and_a_reload(address: str, chromium: Any) -> None:
    visitor = Visitor(chromium, address)
    visitor.open("/")
    visitor.checked()
    assert _drafts(visitor) == [], "what nobody has written is no draft"
    visitor.write(MINE)
    visitor.page.reload()  # before the service was told of it
    visitor.checked()
    assert visitor.written() == MINE
    visitor.page.get_by_role("button", name="office", exact=True).click()
    visitor.wait("document.querySelector('.state').textContent.includes('No faults: office')")
    visitor.page.wait_for_selector(".drafts summary")
    assert _drafts(visitor) == ["one-hoop"]
    visitor.page.reload()  # what was only looked at is looked at again
    visitor.wait("document.querySelector('.state')?.textContent.includes('No faults: office')")
    assert _drafts(visitor) == ["one-hoop"]
    visitor.write(OTHER)
    visitor.page.wait_for_selector(".fault-line")
    visitor.page.locator(".drafts summary").click()
    visitor.page.locator(".drafts li button").click()
    visitor.wait("document.querySelector('.state').textContent.includes('No faults: one-hoop')")
    assert (visitor.written(), _drafts(visitor)) == (MINE, ["[half a mission"])
    visitor.write(LAST)
    visitor.page.get_by_role("button", name="Plan it").click()  # before the service was told of the last letters
    visitor.page.wait_for_selector("[role=status][data-state=done]")
    visitor.page.reload()
    visitor.page.wait_for_selector("[role=status][data-state=done]")
    visitor.page.get_by_role("button", name="Edit and plan again").click()
    visitor.checked()
    assert visitor.written() == LAST, "as it was written, with its comment, not as it was resolved"
    visitor.wait("document.querySelectorAll('.drafts li').length === 2")
    assert sorted(_drafts(visitor)) == ["[half a mission", "one-hoop"]
    visitor.end()


def test_a_formula_is_not_written_over_by_an_older_one_that_was_checked(address: str, chromium: Any) -> None:
    visitor = Visitor(chromium, address)
    visitor.open("/")
    visitor.checked()
    for number in range(60):  # after each one the page tells the service, which answers while the next is written
        formula = f"F loc{1 + number % 2}{' & F loc1' * (number % 3)}"
        visitor.write_formula(formula)
        visitor.page.wait_for_timeout(100 + 4 * number)
        assert visitor.page.locator(".editor.line .cm-content").inner_text() == formula
    visitor.wait("document.querySelector('.state')?.textContent.includes('No faults')")
    assert f"formula: {formula}" in visitor.written()
    visitor.end()


def test_two_windows_write_two_drafts(address: str, chromium: Any) -> None:
    first = Visitor(chromium, address)
    first.open("/")
    first.checked()
    second = Visitor(chromium, address, context=first.context)
    second.open("/")
    second.checked()
    first.write(MINE)
    second.write(MINE.replace("one-hoop", "two-hoops"))
    for each, name in ((second, "two-hoops"), (first, "one-hoop")):
        each.page.reload()
        each.wait(f"document.querySelector('.state')?.textContent.includes('No faults: {name}')")
    first.end()


def test_what_was_written_while_the_service_was_down_survives_it_and_the_browser(driver: Any, tmp_path: Path) -> None:
    with served(tmp_path / "data") as address:
        port = _port(address)
        profile = driver.chromium.launch_persistent_context(tmp_path / "profile", executable_path=CHROMIUM, args=OPTIONS)
        visitor = Visitor(None, address, context=profile)
        visitor.open("/")
        visitor.checked()
    visitor.write(MINE)
    visitor.page.close()  # as a person closes a window; a browser that is ended at once may not have written down what it keeps
    profile.close()
    with served(tmp_path / "data", port) as address:
        profile = driver.chromium.launch_persistent_context(tmp_path / "profile", executable_path=CHROMIUM, args=OPTIONS)
        visitor = Visitor(None, address, context=profile)
        visitor.open("/")
        visitor.checked()
        assert visitor.written() == MINE
        visitor.end()


def test_a_user_finds_what_they_wrote_in_another_browser_and_others_do_not(chromium: Any, tmp_path: Path) -> None:
    data = tmp_path / "data"
    data.mkdir()
    alice, bob = (Tokens(data).new(name) for name in ("alice", "bob"))

    def inside(address: str, token: str) -> Visitor:
        visitor = Visitor(chromium, address)
        visitor.open("/login")
        visitor.page.get_by_label("Token").fill(token)
        visitor.page.get_by_role("button", name="Log in").click()
        visitor.page.wait_for_url(address + "/", timeout=LIMIT)
        visitor.checked()
        return visitor

    with served(data) as address:
        first = inside(address, alice)
        first.write(MINE)
        first.wait("document.querySelector('.state').textContent.includes('No faults: one-hoop')")
        first.end()
    with served(data) as address:
        assert inside(address, alice).written() == MINE
        other = inside(address, bob)
        assert "one-hoop" not in other.written()
        other.write(MINE.replace("one-hoop", "bobs"))
        other.wait("document.querySelector('.state').textContent.includes('No faults: bobs')")
        assert inside(address, alice).written() == MINE


def _verdict(visitor: Visitor) -> str:
    """Return the verdict that is seen, or nothing."""
    return visitor.said(".flight .verdict") if visitor.page.locator(".flight .verdict").count() else ""


def _drop(visitor: Visitor, path: Path) -> None:
    visitor.page.locator(".judging input[type=file]").set_input_files(path)


def _wait_for_words(visitor: Visitor, words: str) -> None:
    visitor.page.wait_for_selector(f".judging .sentence:has-text('{words}')")


@pytest.fixture(scope="module")
def flown(address: str, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """Return a job that is done, and the log of its simulated flight."""
    with Client(address) as client:
        job = client.submit_text(ONE_HOOP).wait()
    log = tmp_path_factory.mktemp("recorded") / "flight.csv"
    log.write_bytes(httpx.get(f"{address}/api/jobs/{job.id}/files/flight.csv").content)
    return job.id, log


def test_a_verdict_goes_with_its_file_its_assumptions_and_its_job(address: str, chromium: Any, flown: tuple[str, Path]) -> None:
    job, log = flown
    visitor = Visitor(chromium, address)
    visitor.open(f"/jobs/{job}/judge")
    visitor.page.wait_for_selector(".flight[data-ready=yes]")
    fields = visitor.page.locator(".judging .bounds input")
    names = ["max_speed", "error", "start", "start_error", "pauses", "called", "axes", "origin"]
    assert fields.evaluate_all("all => all.map((each) => each.name)") == names
    assert fields.evaluate_all("all => all.map((each) => each.value)") == [""] * len(names), "nobody has said anything yet"
    _drop(visitor, log)
    _wait_for_words(visitor, "flight.csv is not judged: ")  # no speed was told, and none is made up
    assert _verdict(visitor) == ""
    visitor.page.fill("input[name=max_speed]", "1.5")
    visitor.page.get_by_role("button", name="Judge it again").click()
    _wait_for_words(visitor, "flight.csv: satisfied")
    visitor.page.wait_for_selector(".flight .verdict")
    assert visitor.said(".flight .file") == "Of flight.csv"
    assert visitor.page.locator(".assumed ul").first.locator("li").all_inner_texts() == ["No robot was faster than: 1.5 m/s"]
    assert "No robot is ever faster than 1.5 m/s." in visitor.said(".assumed")
    for name, text in (("max_speed", "0.1"), ("error", "0.3"), ("start", "1")):
        before = visitor.page.locator(f"input[name={name}]").input_value()
        visitor.page.fill(f"input[name={name}]", text)
        visitor.page.wait_for_selector(".flight .verdict", state="detached")
        visitor.page.fill(f"input[name={name}]", before)
        visitor.page.get_by_role("button", name="Judge it again").click()
        visitor.page.wait_for_selector(".flight .verdict:has-text('Satisfied')")
    table = log.with_name("nonsense.csv")
    table.write_text("this is no table of motion capture\n")
    _drop(visitor, table)
    _wait_for_words(visitor, "nonsense.csv is not judged: ")
    assert _verdict(visitor) == ""
    _drop(visitor, Path(shutil.copy(log, log.with_name("again.csv"))))
    _wait_for_words(visitor, "again.csv: satisfied")
    _drop(visitor, Path(shutil.copy(log, log.with_name("picture.png"))))
    _wait_for_words(visitor, "This file was not taken")
    visitor.page.wait_for_selector(".flight .verdict", state="detached")
    visitor.end()


def test_a_verdict_that_comes_after_an_assumption_was_changed_is_not_shown(
    address: str, chromium: Any, flown: tuple[str, Path]
) -> None:
    job, log = flown
    visitor = Visitor(chromium, address)
    visitor.open(f"/jobs/{job}/judge")
    visitor.page.wait_for_selector(".flight[data-ready=yes]")
    visitor.page.fill("input[name=max_speed]", "1.5")
    _drop(visitor, log)
    _wait_for_words(visitor, "judging flight.csv")
    visitor.page.fill("input[name=max_speed]", "1.6")
    _wait_for_words(visitor, "was judged with other words")
    visitor.page.get_by_role("button", name="Judge it again").click()  # it waits behind the first
    _wait_for_words(visitor, "flight.csv: satisfied")
    visitor.page.wait_for_selector(".assumed li")
    assert "1.6 m/s" in visitor.page.inner_text(".assumed")
    visitor.end()
