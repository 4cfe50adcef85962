"""An export on the service's page: a job is submitted, and its archive comes as a download when it is written."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from ltlplan import Client
from tests.browser.devtools import CHROMIUM
from tests.helpers.services import ONE_HOOP, serving

pytest.importorskip("nicegui", reason="needs the service's extra")
playwright = pytest.importorskip("playwright.sync_api", reason="needs Playwright to drive a browser")

pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium to look at the page"),
]

LIMIT = 240_000
"""ms that anything may take: many times what an idle machine needs."""


def test_an_export_is_downloaded_when_it_is_written(tmp_path: Path) -> None:
    with serving(tmp_path / "data", page=True) as served, Client(served.url) as client, playwright.sync_playwright() as driver:
        job = client.submit_text(ONE_HOOP).wait()
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_context(accept_downloads=True).new_page()
        page.set_default_timeout(LIMIT)
        page.goto(f"{served.url}/jobs/{job.id}/take-away")
        with page.expect_download(timeout=LIMIT) as download:
            page.get_by_role("button", name="crazyflie", exact=True).click()
        download.value.save_as(tmp_path / "export.zip")
        assert download.value.suggested_filename == f"{job.id}-crazyflie.zip"
        told = page.locator(".away [role=status]")
        assert told.inner_text() == "crazyflie is written."
        assert told.bounding_box()["y"] < page.get_by_role("heading", name="Files", exact=True).bounding_box()["y"], (
            "seen at once"
        )
        with zipfile.ZipFile(tmp_path / "export.zip") as archive:
            assert "README.txt" in archive.namelist()
        browser.close()
