"""One browser for all tests of a module, and the pages that they look at."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ltlplan.report.recorded_page import recorded_html
from ltlplan.reproduction.elements import chosen
from ltlplan.reproduction.page import reproduction_html
from ltlplan.reproduction.running import Rerun
from tests.browser.devtools import CHROMIUM, Browser, Tab
from tests.helpers.live.recordings import aside, asked, fires, judged, recorded
from verify import Samples


def recorded_page() -> str:
    """Return the page of a recording by hand: all climb, a robot leaves its tube, another one is not seen for a second."""
    flight = recorded(fires(), aside([0.0, 0.0, 0.09], 4.0), end=11.0)
    climb = np.arange(-100, 0) * 0.01
    times = np.concatenate([climb, flight.times])
    places = {name: np.concatenate([path[0] + climb[:, None] * [0, 0, 0.8], path]) for name, path in flight.positions.items()}
    places["quad1"] = np.where(((times > 7) & (times < 8))[:, None], np.nan, places["quad1"])
    hidden = Samples(times, places)
    verdict = judged(fires(), hidden)
    assert verdict.outcome == "fails"
    return recorded_html(asked(fires()), hidden, verdict, source="flown.csv")


def reproduction_page() -> str:
    """Return the page of the reproduction with elements that have lines, bars of numbers, clouds and hoops."""
    return reproduction_html(
        [
            Rerun(element, element.compute(), 0.1)
            for element in chosen(["2019-fig-2", "2022-fig-11", "2022-fig-12", "2022-fig-13"])
        ]
    )


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Start a browser for the tests of a module; it draws, and takes its time for it, until it is closed."""
    if CHROMIUM is None:
        pytest.skip("needs Chromium to look at pages")
    started = Browser(tmp_path_factory.mktemp("profile"))
    yield started
    started.close()


@pytest.fixture(scope="module")
def driver() -> Iterator[Any]:
    """Start what drives browsers for the tests of a module that look at the service's page."""
    from playwright.sync_api import sync_playwright  # tests of other pages do without it

    with sync_playwright() as started:
        yield started


@pytest.fixture(scope="module")
def chromium(driver: Any) -> Iterator[Any]:
    """Start Chromium for visitors of the service's page; each has a window of their own."""
    from tests.browser.visitor import OPTIONS

    started = driver.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
    yield started
    started.close()


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Start a service without tokens on a free port of this machine, and return where it is."""
    from tests.browser.visitor import served

    with served(tmp_path_factory.mktemp("service") / "data") as found:
        yield found


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Start a service that people have worked with, and have a flight in the air."""
    from tests.browser.states import worked_with

    with worked_with(tmp_path_factory.mktemp("lab") / "data") as found:
        yield found


@pytest.fixture(scope="session")
def page(tmp_path_factory: pytest.TempPathFactory, shipped_page: Callable[[str], str]) -> Callable[[str], Path]:
    """Return the file of a page by its name: `report`, `show`, `campaign`, `online` or `recorded`, of the firefighting mission; or `reproduction`."""
    folder = tmp_path_factory.mktemp("pages")

    @functools.cache
    def written(name: str) -> Path:
        path = folder / f"{name}.html"
        ours = {"recorded": recorded_page, "reproduction": reproduction_page}
        path.write_text(ours[name]() if name in ours else shipped_page(name), encoding="utf-8")
        return path

    return written


@pytest.fixture(scope="module")
def desk(browser: Browser, page: Callable[[str], Path]) -> Callable[[str], Tab]:
    """Return a page as it is seen on a desk, at the time 0; it is opened once and left as it was found."""
    opened = functools.cache(lambda name: browser.open(page(name)))

    def at_the_beginning(name: str) -> Tab:
        tab = opened(name).to_front()
        tab.run("scrollTo(0, 0)")
        tab.move_clock("0")
        return tab

    return at_the_beginning


@pytest.fixture(scope="module")
def narrow(browser: Browser, page: Callable[[str], Path]) -> Callable[[str, bool], Tab]:
    """Return a page in dark colours as it is seen on a phone or in a narrow window; it is opened once and left as it was found."""
    opened = functools.cache(lambda name, phone: browser.open(page(name), width=390, phone=phone, dark=True))
    return lambda name, phone: opened(name, phone).to_front()
