"""An export on the service's page: a job is submitted, and its archive comes as a download when it is written."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

from ltlplan import Client
from tests.browser.visitor import LIMIT, OF_THE_PAGE
from tests.helpers.serving.services import ONE_HOOP, serving

pytestmark = OF_THE_PAGE


def test_an_export_is_downloaded_when_it_is_written(chromium: Any, tmp_path: Path) -> None:
    with serving(tmp_path / "data", page=True) as served, Client(served.url) as client:
        job = client.submit_text(ONE_HOOP).wait()
        page = chromium.new_context(accept_downloads=True).new_page()
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
