"""One browser for all tests, and the pages that they look at."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import ltlplan
from flight.campaigns import campaign
from ltlplan.online.flight import fly_online
from ltlplan.report.campaign import campaign_html
from ltlplan.report.online import online_html
from ltlplan.report.pictures import pictures_html
from ltlplan.report.run_page import report_html
from tests.browser.devtools import CHROMIUM, Browser, Tab
from verify.data.events import HoopMoves


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    if CHROMIUM is None:
        pytest.skip("needs Chromium to look at pages")
    started = Browser(tmp_path_factory.mktemp("profile"))
    yield started
    started.close()


@pytest.fixture(scope="session")
def page(tmp_path_factory: pytest.TempPathFactory, shipped_run: Callable[[str], ltlplan.Result]) -> Callable[[str], Path]:
    """Return the file of a page by its name: `report`, `show`, `campaign` or `online`, of the firefighting mission."""
    folder = tmp_path_factory.mktemp("pages")
    mission = ltlplan.load_mission("firefighting")

    def made(name: str) -> str:
        if name == "report":
            return report_html(shipped_run("firefighting"))
        if name == "show":
            return pictures_html(mission)
        if name == "online":
            moves = HoopMoves(time=3.0, region="water", center=(0.3, -0.7, 0.9))
            return online_html(fly_online(mission, seed=0, events=[moves]))
        run = shipped_run("firefighting")
        return campaign_html(campaign(run.plan, run.team, run.certificate, runs=2, seed=0))

    @functools.cache
    def written(name: str) -> Path:
        path = folder / f"{name}.html"
        path.write_text(made(name), encoding="utf-8")
        return path

    return written


@pytest.fixture(scope="session")
def desk(browser: Browser, page: Callable[[str], Path]) -> Callable[[str], Tab]:
    """Return a page as it is seen on a desk, at the time 0; it is opened once and left as it was found."""
    opened = functools.cache(lambda name: browser.open(page(name)))

    def at_the_beginning(name: str) -> Tab:
        tab = opened(name).to_front()
        tab.run("scrollTo(0, 0)")
        tab.move_clock("0")
        return tab

    return at_the_beginning
