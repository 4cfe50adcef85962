"""Three people at once on one service, who came in by a password, by the lab's own login, and by a token."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import httpx

from ltlplan import Client
from ltlplan.online.event_queue import Told
from ltlplan.service.client_parts.long_polling import FollowedService
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Role
from ltlplan.service.security.tokens import Tokens
from tests.browser.visitor import LIMIT, OF_THE_PAGE, Visitor, served
from tests.helpers.serving.openid_provider import CLIENT, SECRET, providing
from tests.helpers.serving.services import ONE_HOOP

pytestmark = OF_THE_PAGE

PASSWORD = "twelve letters"
LONG = ONE_HOOP.replace("samples: 20, iterations: 2", "samples: 4000, iterations: 400")
"""A mission that is planned for minutes."""


def _by_password(chromium: Any, address: str) -> Visitor:
    visitor = Visitor(chromium, address)
    visitor.open("/login")
    visitor.page.get_by_label("Name").fill("alice")
    visitor.page.get_by_label("Password", exact=True).fill(PASSWORD)
    visitor.page.get_by_role("button", name="Log in", exact=True).click()
    return _inside(visitor)


def _by_openid(chromium: Any, address: str) -> Visitor:
    visitor = Visitor(chromium, address)
    visitor.open("/login")
    visitor.page.get_by_role("link", name="Log in by the lab's own login").click()
    visitor.page.get_by_role("link", name="Approve").click()
    visitor.elsewhere.clear()  # the provider's pages
    return _inside(visitor)


def _by_token(chromium: Any, address: str, token: str) -> Visitor:
    visitor = Visitor(chromium, address)
    visitor.open("/login")
    visitor.page.get_by_text("By a token").click()
    visitor.page.get_by_label("Token").fill(token)
    visitor.page.get_by_role("button", name="Log in by token").click()
    return _inside(visitor)


def _inside(visitor: Visitor) -> Visitor:
    visitor.page.wait_for_url(visitor.address + "/", timeout=LIMIT)
    visitor.checked()
    return visitor


def test_three_people_by_three_logins_share_a_service(tmp_path: Path, chromium: Any) -> None:
    secret, data = tmp_path / "secret", tmp_path / "data"
    secret.write_text(SECRET)
    data.mkdir()
    people = People(Tokens(data))
    people.accounts.change_password("alice", people.accounts.add("alice", Role.planner), PASSWORD)
    people.accounts.add("vera", Role.viewer)
    token = people.tokens.new("vera.window", account="vera")
    with providing(sub="7", preferred_username="pia") as provider:
        words = (
            "--openid",
            provider.issuer,
            "--openid-client",
            CLIENT,
            "--openid-secret-file",
            str(secret),
            "--openid-role",
            "pilot",
        )
        with served(data, words=words) as address:
            alice, pia = _by_password(chromium, address), _by_openid(chromium, address)
            vera = _by_token(chromium, address, token)
            _write_one_mission(alice, pia, people)
            _delete_what_another_needs(alice, pia)
            _only_look(vera, address)
            _tell_a_flight(address, people, pia, alice, vera)
            _be_revoked(address, people, token, vera, pia)
            alice.end()
    people.close()


def _write_one_mission(alice: Visitor, pia: Visitor, people: People) -> None:
    """Two windows write one mission of a shared project: the second to save is told who was first."""
    alice.write_named(ONE_HOOP, "one-hoop")
    alice.page.get_by_label("stored as").fill("together")
    alice.save()
    alice.page.get_by_text("version 1 by alice", exact=True).wait_for()
    with Client(alice.address, token=people.tokens.new("alice.program", account="alice")) as client:
        (mission,) = client.stored_missions("together")
        client.share_project("hall")
        client.change_mission(mission, project="hall")
    pia.page.locator(".stored summary").click()
    pia.page.get_by_role("button", name="Open together").click()
    pia.wait("document.querySelector('.state').textContent.includes('one-hoop')")
    pia.write_named(ONE_HOOP.replace("one-hoop", "pias-hoop"), "pias-hoop")
    pia.save()
    pia.page.get_by_text("version 2 by pia, in hall", exact=True).wait_for()
    alice.write_named(ONE_HOOP.replace("one-hoop", "alices-hoop"), "alices-hoop")
    alice.save()
    alice.page.get_by_text("pia saved version 2 meanwhile").first.wait_for()
    alice.save()
    alice.page.get_by_text("version 3 by alice, in hall", exact=True).wait_for()


def _planned(visitor: Visitor) -> str:
    visitor.write_named(ONE_HOOP.replace("one-hoop", "shared-hoop"), "shared-hoop")
    visitor.page.get_by_role("button", name="Plan it").click()
    visitor.page.wait_for_url("**/jobs/*/plan", timeout=LIMIT)
    visitor.page.wait_for_selector('[role=status][data-state="done"]')
    return visitor.page.url.split("/jobs/")[1].split("/")[0]


def _delete_what_another_needs(alice: Visitor, pia: Visitor) -> None:
    """One computation of two people stays for the one when the other deletes it; the project shows it to all."""
    job = _planned(alice)
    assert _planned(pia) == job, "one computation"
    alice.page.get_by_role("button", name="Delete", exact=True).click()
    alice.page.get_by_role("button", name="Delete it").click()
    alice.wait("!location.pathname.startsWith('/jobs')")
    pia.page.get_by_role("textbox", name="Project").fill("hall")
    pia.page.get_by_role("textbox", name="Project").press("Enter")
    pia.page.get_by_text("It is in the project hall now.").wait_for()
    pia.tab("Watch")
    pia.page.wait_for_selector(".flight[data-ready=yes] .holder[data-drawn=yes]")


def _only_look(vera: Visitor, address: str) -> None:
    """A viewer sees what is shared, and is offered nothing that changes anything."""
    assert not vera.page.get_by_role("button", name="Plan it").is_visible()
    vera.tab("Plan")
    vera.page.locator("#plan-panel .entry").get_by_text("pia's, in hall").wait_for()
    vera.page.locator("#plan-panel .entry").click()
    vera.page.get_by_role("button", name="Edit and plan again").wait_for()
    assert vera.page.get_by_role("button", name="Delete").count() == 0
    (cookie,) = (each for each in vera.context.cookies() if each["name"] == "ltlplan_session")
    kept = {"cookie": f"ltlplan_session={cookie['value']}"}
    assert httpx.post(address + "/api/jobs", content=ONE_HOOP, headers=kept).status_code == 403


def _tell_a_flight(address: str, people: People, pia: Visitor, alice: Visitor, vera: Visitor) -> None:
    """The pilot tells a live flight an event; the planner and the viewer see it, and have no field for one."""
    flight = FollowedService(f"{address}/live/lab", "one-hoop", people.tokens.new("lab", role="pilot"))
    for visitor in (pia, alice, vera):
        visitor.tab("Live")
        visitor.page.get_by_text("lab listens.").wait_for()
    for visitor in (alice, vera):
        assert not visitor.page.locator("input[name=event]").is_visible()
        assert visitor.page.locator(".stops").count() == 0
    pia.page.fill("input[name=event]", "quad0 fails")
    pia.page.keyboard.press("Enter")
    while not (told := flight()):
        pia.page.wait_for_timeout(50)
    (event,) = told
    assert isinstance(event, Told)
    event.answer(True, "quad0 lands.")
    for visitor in (pia, alice, vera):
        visitor.page.locator("td:text-is('done: quad0 lands.')").wait_for()
    flight.close()
    for visitor in (pia, alice, vera):
        visitor.page.get_by_text("lab has ended.").wait_for()


def _be_revoked(address: str, people: People, token: str, vera: Visitor, pia: Visitor) -> None:
    """A token that is revoked, and an account that is disabled, end open pages and streams at once; others go on."""
    with Client(address, token=people.tokens.new("alice.other", account="alice")) as client:
        job = client.submit_text(LONG, project="hall")
        stream = httpx.stream(
            "GET", f"{address}/api/jobs/{job.id}/events", headers={"authorization": f"Bearer {token}"}, timeout=60
        )
        with stream as answer:
            assert answer.status_code == 200
            lines = answer.iter_lines()
            next(lines)
            people.tokens.revoke("vera.window")
            assert not any(line.startswith("event: done") for line in lines)
        assert client.job(job.id).state in ("queued", "running"), "the stream ends before its job does"
        vera.page.wait_for_url(address + "/login", timeout=LIMIT)
        people.accounts.set_disabled("pia", True)
        pia.page.wait_for_url(address + "/login", timeout=LIMIT)
        client.cancel(job)
    for visitor in (vera, pia):
        visitor.context.close()
