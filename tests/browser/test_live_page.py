"""The live page in a real browser: a flight is seen, told events by click, and stopped; what each role may do; replays."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from flight.link.stop_orders import Level
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Role
from ltlplan.service.security.asker import COOKIE
from ltlplan.service.security.tokens import Tokens
from tests.browser.visitor import LIMIT, OF_THE_PAGE, Visitor, served
from tests.helpers.live.live_feeds import FedFlight, fed
from tests.helpers.serving.waiting import until

pytestmark = OF_THE_PAGE

PASSWORD = "twelve letters"
ROLES = {"vera": Role.viewer, "paul": Role.pilot, "root": Role.admin}


@pytest.fixture(scope="module")
def people(tmp_path_factory: pytest.TempPathFactory) -> Iterator[People]:
    folder = tmp_path_factory.mktemp("service") / "data"
    folder.mkdir()
    made = People(Tokens(folder))
    for name, role in ROLES.items():
        made.accounts.change_password(name, made.accounts.add(name, role), PASSWORD)
    yield made
    made.close()


@pytest.fixture(scope="module")
def address(people: People) -> Iterator[str]:
    with served(people.database.folder) as found:
        yield found


@pytest.fixture
def flying(address: str, people: People) -> Iterator[FedFlight]:
    people.tokens.revoke("robots") if "robots" in people.tokens.entries() else None
    with fed(f"{address}/live/lab", token=people.tokens.new("robots", role="pilot")) as flight:
        yield flight


def _entered(chromium: Any, address: str, people: People, name: str, **more: Any) -> Visitor:
    visitor = Visitor(chromium, address, **more)
    session = people.sessions.begin_of_account(name)
    visitor.context.add_cookies([{"name": COOKIE, "value": session, "url": address}])
    return visitor


def test_a_flight_is_seen_and_stopped_from_every_tab(chromium: Any, address: str, people: People, flying: FedFlight) -> None:
    visitor = _entered(chromium, address, people, "paul")
    visitor.open("/live/lab")
    visitor.wait("document.querySelector('.live-robots tbody tr')")
    assert re.findall(r"\d+ mm", visitor.said(".live-robots tbody tr")) == ["12 mm", "33 mm"]
    assert "5:00" in visitor.said(".live-robots tbody tr")
    assert "F left done" in visitor.said(".live .todo").replace("\n", " ")
    visitor.wait("document.querySelectorAll('.live-scenes .holder[data-drawn=yes]').length === 2")
    visitor.tab("Write")
    assert "terminal and the kill switch come first" in visitor.said(".no-safety")
    visitor.page.get_by_role("button", name="Stop lab").click()
    assert until(lambda: flying.orders.level is Level.HOLD, 5.0)
    visitor.wait("document.querySelector('.receipts').textContent.includes('one: not confirmed')")
    flying.acknowledged = "hold"
    visitor.wait("/one: holds, [0-9]+ ms/.test(document.querySelector('.receipts').textContent)")
    visitor.page.get_by_role("button", name="Land lab").click()
    assert until(lambda: flying.orders.level is Level.LAND, 5.0)
    visitor.wait("document.querySelector('.receipts').textContent.includes('one: not confirmed')")
    flying.acknowledged = "land"
    visitor.wait("/one: lands, [0-9]+ ms/.test(document.querySelector('.receipts').textContent)")
    visitor.page.get_by_role("button", name="Motors off").dblclick()
    assert flying.orders.level is Level.LAND, "the second press is asked for"
    visitor.page.get_by_role("button", name="Press again").click()
    assert until(lambda: flying.orders.level is Level.MOTORS, 5.0)
    visitor.end()


def test_viewers_see_and_cannot_stop(chromium: Any, address: str, people: People, flying: FedFlight) -> None:
    visitor = _entered(chromium, address, people, "vera", width=390, height=800)
    visitor.open("/live/lab")
    visitor.wait("document.querySelector('.live-robots tbody tr')")
    assert visitor.page.locator("button.stop").count() == 0
    assert visitor.page.locator(".handle").count() == 0
    assert not visitor.page.locator("input[name=event]").is_visible()
    wide = visitor.page.evaluate("document.documentElement.scrollWidth")
    assert wide <= 390
    visitor.end()


def test_an_event_is_made_by_dragging_said_before_it_is_sent_and_sent_by_a_click(
    chromium: Any, address: str, people: People, flying: FedFlight
) -> None:
    visitor = _entered(chromium, address, people, "paul")
    visitor.open("/live/lab")
    visitor.wait("document.querySelectorAll('.live-scenes .holder[data-drawn=yes]').length === 2")
    handle = visitor.page.get_by_role("button", name="Move right by dragging")
    found: list[Any] = []
    assert until(lambda: found.append(handle.bounding_box()) or found[-1] is not None, 60.0)
    box = found[-1]
    visitor.page.mouse.move(box["x"] + 12, box["y"] + 12)
    visitor.page.mouse.down()
    visitor.page.mouse.move(box["x"] + 12, box["y"] + 42, steps=3)
    visitor.page.mouse.up()
    visitor.wait("/from where it was/.test(document.querySelector('.foretold').textContent)")
    line = visitor.page.locator("input[name=event]").input_value()
    assert re.fullmatch(r"right moves [-\d.]+,[-\d.]+,1\.4", line)
    assert flying.listener() == []
    visitor.page.get_by_role("button", name="Tell", exact=True).click()
    heard: list[Any] = []
    assert until(lambda: heard.extend(flying.listener()) or bool(heard), 5.0)
    assert heard[0].event.region == "right"
    visitor.page.get_by_role("button", name="two failed").click()
    visitor.wait("/two lands where it is/.test(document.querySelector('.foretold').textContent)")
    visitor.page.locator("input[name=event]").fill("nobody fails")
    visitor.wait("/Nothing: .*nobody/.test(document.querySelector('.foretold').textContent)")
    visitor.end()


def test_control_is_handed_from_one_pilot_to_another_by_both(
    chromium: Any, address: str, people: People, flying: FedFlight
) -> None:
    paul, root = (_entered(chromium, address, people, name) for name in ("paul", "root"))
    for visitor in (paul, root):
        visitor.open("/live/lab")
    paul.page.get_by_role("button", name="Take control").click()
    root.wait("document.querySelector('.control').textContent.includes('paul is in control')")
    assert not root.page.locator("input[name=event]").is_visible()
    assert root.page.locator("button.stop").is_visible()
    paul.page.get_by_label("Pilot to hand control to").fill("root")
    paul.page.get_by_role("button", name="Hand over").click()
    root.page.get_by_role("button", name="Accept control").click()
    paul.wait("document.querySelector('.control').textContent.includes('root is in control')")
    assert root.page.locator("input[name=event]").is_visible()
    paul.wait("!document.querySelector('input[name=event]').checkVisibility()")
    for visitor in (paul, root):
        visitor.end()


def test_three_people_at_one_flight_of_whom_one_is_disabled_while_their_page_is_open(
    chromium: Any, address: str, people: People, flying: FedFlight
) -> None:
    people.accounts.change_password("pia", people.accounts.add("pia", Role.pilot), PASSWORD)
    pia = Visitor(chromium, address)
    pia.open("/login")
    pia.page.get_by_label("Name").fill("pia")
    pia.page.get_by_label("Password", exact=True).fill(PASSWORD)
    pia.page.get_by_role("button", name="Log in", exact=True).click()
    pia.page.wait_for_url(address + "/", timeout=LIMIT)
    vera, root = (_entered(chromium, address, people, name) for name in ("vera", "root"))
    for visitor in (pia, vera, root):
        visitor.open("/live/lab")
        visitor.wait("document.querySelector('.live-robots tbody tr')")
    pia.page.get_by_role("button", name="Take control").click()
    root.wait("document.querySelector('.control').textContent.includes('pia is in control')")
    kept = {each["name"]: each["value"] for each in pia.context.cookies()}
    run = httpx.get(f"{address}/api/live/lab", cookies=kept).json()["run"]
    stop = {"url": f"{address}/api/live/lab/stop", "params": {"run": run}, "cookies": kept, "headers": {"origin": address}}
    people.accounts.set_disabled("pia", True)
    pia.page.wait_for_url(address + "/login", timeout=LIMIT)
    assert httpx.post(**stop).status_code == 401
    assert flying.orders.level is Level.NONE
    root.page.get_by_role("button", name="Release").click()
    root.page.get_by_role("button", name="Take control").click()
    vera.wait("document.querySelector('.control').textContent.includes('root is in control')")
    root.page.get_by_role("button", name="Stop lab").click()
    assert until(lambda: flying.orders.level is Level.HOLD, 5.0)
    root.page.get_by_role("button", name="Land lab").wait_for()
    assert vera.page.locator("button.stop").count() == 0
    people.tokens.revoke("robots")  # the flight's own: it is not seen any more, and nobody takes it for one that hears
    root.page.get_by_role("button", name="Land lab").click()
    root.wait("document.querySelector('.receipts').textContent.includes('Not confirmed')")
    assert flying.orders.level is Level.HOLD
    for visitor in (pia, vera, root):
        visitor.context.close()


def test_an_earlier_flight_is_replayed_in_the_same_view(chromium: Any, address: str, people: People) -> None:
    with fed(f"{address}/live/yard", token=people.tokens.new("yard", role="pilot")):
        time.sleep(3.0)
    visitor = _entered(chromium, address, people, "vera")
    visitor.open("/live/yard")
    visitor.page.locator(".runs button").first.click()
    visitor.wait("document.querySelector('.live .player')")
    visitor.page.locator(".live .play").click()
    visitor.wait("Number(document.querySelector('.live .clock').value) > 10")
    assert "12 mm" in visitor.said(".live-robots tbody tr")
    visitor.end()


def test_a_real_flight_is_stopped_and_lands_while_its_viewer_s_browser_is_killed(
    chromium: Any, address: str, people: People, tmp_path: Path
) -> None:
    import os

    token = people.tokens.new("hangar", role="pilot")
    command = [
        sys.executable,
        "-m",
        "ltlplan",
        "online",
        "firefighting",
        "--certified",
        "--link",
        "simulated",
        "--noise",
        "0.001",
    ]
    with (tmp_path / "said").open("w") as said:
        flight = subprocess.Popen(
            [*command, "--follow", f"{address}/live/hangar"],
            stdout=said,
            stderr=said,
            env={**os.environ, "LTLPLAN_TOKEN": token},
        )
        other = _entered(chromium, address, people, "vera")
        other.open("/live/hangar")
        visitor = _entered(chromium, address, people, "root")
        visitor.open("/live/hangar")
        visitor.page.wait_for_function("() => document.querySelector('.live .todo li')", timeout=LIMIT)
        other.context.close()
        visitor.page.get_by_role("button", name="Stop hangar").click()
        visitor.wait("/quad[0-2]: holds, [0-9]+ ms/.test(document.querySelector('.receipts').textContent)")
        visitor.page.get_by_role("button", name="Land hangar").click()
        visitor.wait("/quad[0-2]: (lands|motors off), [0-9]+ ms/.test(document.querySelector('.receipts').textContent)")
        assert flight.wait(60) == 5
    assert "stopped by root through the service" in (tmp_path / "said").read_text()
    visitor.end()
