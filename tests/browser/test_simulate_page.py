"""Campaigns, rehearsals and kept recordings on the page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ltlplan import Client
from tests.browser.visitor import OF_THE_PAGE, Visitor
from tests.helpers.serving.services import ONE_HOOP

pytestmark = OF_THE_PAGE


def test_simulations_are_begun_followed_and_deleted(chromium: Any, address: str) -> None:
    with Client(address) as client:
        job = client.submit_text(ONE_HOOP).wait()
    visitor = Visitor(chromium, address)
    visitor.open(f"/jobs/{job.id}/simulate")
    page = visitor.page
    form = page.get_by_role("form", name="Campaign")
    form.get_by_label("Controller").fill("geometrical")
    form.get_by_role("button").click()
    page.get_by_text("Did you mean").wait_for()
    form.get_by_label("Controller").fill("")
    form.get_by_label("Flights").fill("5")
    form.get_by_label("Noise").fill("0.001")
    form.get_by_role("button").click()
    page.get_by_text("5 of 5").first.wait_for()
    assert "campaign: runs 5, noise 0.001" in visitor.said(".derived")
    report = page.get_by_role("link", name="Open the report").get_attribute("href")
    assert page.request.get(address + report).ok
    page.get_by_role("button", name="Delete campaign").click()
    page.get_by_text("None yet.").wait_for()
    visitor.end()


def test_a_recording_is_kept_and_shown_again(chromium: Any, address: str, tmp_path: Path) -> None:
    with Client(address) as client:
        job = client.submit_text(ONE_HOOP).wait()
        (tmp_path / "lab.csv").write_bytes(job.file("flight.csv"))
    visitor = Visitor(chromium, address)
    visitor.open(f"/jobs/{job.id}/judge")
    page = visitor.page
    page.fill("input[name=max_speed]", "2")
    page.locator(".judging input[type=file]").set_input_files(tmp_path / "lab.csv")
    page.get_by_role("button", name="Keep it with the job").click()
    page.get_by_role("link", name="verdict.json").wait_for()
    visitor.open(f"/jobs/{job.id}/judge")
    page.get_by_role("button", name="Show recording lab.csv").click()
    page.get_by_text("What the recording shows").wait_for()
    assert "lab.csv" in visitor.said(".flight .file")
    visitor.end()
