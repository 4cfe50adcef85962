"""Three people of a lab at once, each in a real browser: private and shared jobs, roles, an admin's work, and sessions that end while pages are open."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from ltlplan import Client
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Role
from ltlplan.service.security.tokens import Tokens
from tests.browser.visitor import LIMIT, OF_THE_PAGE, Visitor, served
from tests.helpers.serving.openid_provider import CLIENT, SECRET, providing
from tests.helpers.serving.services import ONE_HOOP

pytestmark = OF_THE_PAGE

PASSWORD = "twelve letters"


@pytest.fixture(scope="module")
def people(tmp_path_factory: pytest.TempPathFactory) -> Iterator[People]:
    """Yield a lab of three, as the command line has it."""
    folder = tmp_path_factory.mktemp("service") / "data"
    folder.mkdir()
    made = People(Tokens(folder))
    for name, role in (("root", Role.admin), ("alice", Role.planner), ("bob", Role.planner), ("eve", Role.viewer)):
        made.accounts.change_password(name, made.accounts.add(name, role), PASSWORD)
    yield made
    made.close()


@pytest.fixture(scope="module")
def address(people: People) -> Iterator[str]:
    """Start the lab's service."""
    with served(people.database.folder) as found:
        yield found


def _entered(chromium: Any, address: str, name: str, password: str = PASSWORD) -> Visitor:
    """Return somebody's window, logged in and looking at the missions."""
    visitor = Visitor(chromium, address)
    visitor.open("/")
    visitor.page.get_by_label("Name").fill(name)
    visitor.page.get_by_label("Password", exact=True).fill(password)
    visitor.page.get_by_role("button", name="Log in", exact=True).click()
    visitor.page.wait_for_url(address + "/", timeout=LIMIT)
    visitor.page.wait_for_selector("[role=tab]")
    return visitor


def _planned(visitor: Visitor, seed: int) -> str:
    """Submit a mission as by hand, and return its job's id."""
    visitor.tab("Write")
    visitor.checked()
    visitor.write_named(ONE_HOOP, "one-hoop")
    visitor.page.locator("input.seed").first.fill(str(seed))
    visitor.page.get_by_role("button", name="Plan it").click()
    visitor.page.wait_for_url("**/jobs/*/**", timeout=LIMIT)  # a job that is found at once may be seen before it is the address
    visitor.page.wait_for_selector('[role=status][data-state="done"]')
    return visitor.page.url.split("/jobs/")[1].split("/")[0]


def _entries(visitor: Visitor) -> list[str]:
    visitor.tab("Plan")
    return visitor.page.locator(".job-list .entry").all_inner_texts()


def test_three_people_at_once_have_their_own_jobs_and_what_others_need_stays(
    address: str, people: People, chromium: Any
) -> None:
    alice, bob, eve = (_entered(chromium, address, name) for name in ("alice", "bob", "eve"))
    job = _planned(alice, 3)
    assert _planned(bob, 3) == job, "one computation"
    eve.open(f"/jobs/{job}/watch")
    eve.page.get_by_text(f"There is no job '{job}'.").wait_for()
    eve.complaints.clear()
    assert eve.page.get_by_role("tab", name="People").count() == 1
    alice.page.get_by_role("button", name="Delete").click()
    alice.page.get_by_text("Others who have it keep it").wait_for()
    alice.page.get_by_role("button", name="Delete it").click()
    alice.page.get_by_text("None yet: write a mission and plan it.").wait_for()
    bob.tab("Watch")
    bob.page.reload()
    bob.wait("document.querySelector('.flight canvas') !== null")
    assert len(_entries(bob)) == 1
    bob.tab("People")
    bob.page.locator("input[name=project]").fill("show")
    bob.page.get_by_role("button", name="Make it").last.click()
    bob.page.get_by_role("button", name="Share: show").click()
    bob.page.get_by_role("button", name="Make private: show").wait_for()
    bob.open(f"/jobs/{job}")
    bob.wait("window.socket?.connected")
    bob.page.get_by_role("textbox", name="Project").fill("show")
    bob.page.get_by_role("textbox", name="Project").press("Enter")
    bob.page.get_by_text("It is in the project show now.").wait_for()
    eve.open("/plan")
    eve.page.get_by_text("bob's, in show").first.wait_for()
    eve.page.locator(".job-list .entry").click()
    eve.page.get_by_role("button", name="Edit and plan again").wait_for()
    assert eve.page.get_by_role("button", name="Delete").count() == 0
    for tab, words in (("Take away", "crazyswarm2"), ("Write", "Plan it")):
        eve.tab(tab)
        eve.page.wait_for_timeout(500)
        assert not eve.page.get_by_role("button", name=words).is_visible(), "what a viewer may not do is not offered"
    for visitor in (alice, bob, eve):
        visitor.end()


def test_an_admin_s_page_makes_accounts_and_ends_sessions_while_pages_are_open(
    address: str, people: People, chromium: Any
) -> None:
    root, eve = _entered(chromium, address, "root"), _entered(chromium, address, "eve")
    root.tab("People")
    root.page.locator("input[name=account]").fill("dora")
    root.page.get_by_label("Its role").select_option("pilot")
    root.page.locator(".accounts").get_by_role("button", name="Make it").click()
    password = root.said(".revealed")
    eve.tab("Live")
    root.page.get_by_label("Role of eve").select_option("pilot")
    eve.page.wait_for_url(address + "/login", timeout=LIMIT)  # by itself: another role ends the session
    dora = Visitor(chromium, address)
    dora.open("/login")
    dora.page.get_by_label("Name").fill("dora")
    dora.page.get_by_label("Password", exact=True).fill(password)
    dora.page.get_by_role("button", name="Log in", exact=True).click()
    dora.page.get_by_label("Present password").fill(password)
    dora.page.get_by_label("New password (12 letters or more)").fill(PASSWORD)
    dora.page.get_by_label("New password, once more").fill(PASSWORD)
    dora.page.get_by_role("button", name="Change it").click()
    dora.page.wait_for_url(address + "/", timeout=LIMIT)
    dora.tab("People")
    dora.page.locator("input[name=label]").fill("laptop")
    dora.page.locator(".own").get_by_role("button", name="Make it").click()
    token = dora.said(".revealed")
    with Client(address, token=token) as client:
        assert (client.whoami().user, client.whoami().role) == ("dora", "pilot")
    assert dora.page.locator(".accounts").inner_text() == ""
    root.page.reload()
    root.page.get_by_role("button", name="Disable dora").click()
    dora.page.wait_for_url(address + "/login", timeout=LIMIT)
    assert httpx.get(address + "/api/account", headers={"authorization": f"Bearer {token}"}).status_code == 401
    root.page.reload()
    root.page.locator(".log").get_by_text("disable account").wait_for()
    root.end()
    for visitor in (eve, dora):
        visitor.context.close()


def test_a_stream_ends_with_the_role_of_who_reads_it(address: str, people: People) -> None:
    people.accounts.add("zoe", Role.planner)
    session = people.sessions.begin_of_account("zoe")
    with Client(address, token=Tokens(people.database.folder).new("robot")) as robot:
        robot.submit_text(ONE_HOOP.replace("samples: 20, iterations: 2", "samples: 4000, iterations: 40"), project="open")
        job = robot.jobs()[0]
        robot.share_project("open")
        cookie = {"cookie": f"ltlplan_session={session}"}
        with httpx.stream("GET", f"{address}/api/jobs/{job.id}/events", headers=cookie, timeout=60) as stream:
            assert stream.status_code == 200
            lines = stream.iter_lines()
            next(lines)
            people.accounts.set_disabled("zoe", True)
            rest = list(lines)
        assert robot.job(job.id).state in ("queued", "running"), "the stream ends before its job does"
        assert not any(line.startswith("event: done") for line in rest)
        assert httpx.get(f"{address}/api/jobs/{job.id}", headers=cookie).status_code == 401
        robot.cancel(job)


def test_somebody_comes_in_by_the_lab_s_own_login_and_goes_at_once_when_disabled(tmp_path: Path, chromium: Any) -> None:
    secret = tmp_path / "secret"
    secret.write_text(SECRET)
    data = tmp_path / "data"
    data.mkdir()
    lab = People(Tokens(data))
    with providing(sub="17", preferred_username="alice") as provider:
        words = (
            "--openid",
            provider.issuer,
            "--openid-client",
            CLIENT,
            "--openid-secret-file",
            str(secret),
            "--openid-role",
            "planner",
        )
        with served(data, words=words) as address:
            visitor = Visitor(chromium, address)
            visitor.open("/plan")
            visitor.page.wait_for_url(address + "/login", timeout=LIMIT)
            visitor.page.get_by_role("link", name="Log in by the lab's own login").click()
            visitor.page.get_by_role("link", name="Approve").click()
            visitor.page.wait_for_url(address + "/", timeout=LIMIT)
            visitor.tab("People")
            visitor.page.get_by_text("You are alice, planner").wait_for()
            visitor.wait("window.socket?.connected")
            (cookie,) = (each for each in visitor.context.cookies() if each["name"] == "ltlplan_session")
            kept = {"cookie": f"ltlplan_session={cookie['value']}"}
            assert httpx.get(address + "/api/account", headers=kept).json()["user"] == "alice"
            lab.accounts.set_disabled("alice", True)
            visitor.page.wait_for_url(address + "/login", timeout=LIMIT)
            visitor.page.get_by_role("link", name="Log in by the lab's own login").click()
            visitor.page.get_by_role("link", name="Approve").click()
            visitor.page.get_by_text("The account 'alice' is disabled").wait_for()
            assert visitor.page.url.startswith(address + "/login/openid/back?")
            assert httpx.get(address + "/api/account", headers=kept).status_code == 401, "the session has ended"
            visitor.context.close()
    lab.close()


def test_two_windows_write_one_mission_and_nothing_is_lost(address: str, people: People, chromium: Any) -> None:
    alice, bob = _entered(chromium, address, "alice"), _entered(chromium, address, "bob")
    alice.checked()
    alice.write_named(ONE_HOOP, "one-hoop")
    alice.page.get_by_label("stored as").fill("together")
    alice.save()
    alice.page.get_by_text("version 1 by alice", exact=True).wait_for()
    alice.page.get_by_role("button", name="History").click()
    alice.page.locator(".history").get_by_label("Project").fill("both")
    alice.page.evaluate(
        "document.querySelector('[aria-label=\"Changes of version 1\"]').click()"
    )  # the page changes as she types
    alice.page.locator(".difference").wait_for()
    alice.page.locator(".history").get_by_label("Project").press("Enter")
    alice.page.get_by_text("version 1 by alice, in both", exact=True).wait_for()
    alice.page.locator(".dialog").get_by_role("button", name="Close", exact=True).click()
    with Client(address, token=people.tokens.new("alice.window", account="alice")) as client:
        client.share_project("both")
    bob.checked()
    bob.page.locator(".stored summary").click()
    bob.page.get_by_label("Search stored missions").fill("TOGETHER")
    bob.page.get_by_role("button", name="Open together").click()
    bob.wait("document.querySelector('.state').textContent.includes('one-hoop')")
    bob.write_named(ONE_HOOP.replace("one-hoop", "bobs-hoop"), "bobs-hoop")
    bob.save()
    bob.page.get_by_text("version 2 by bob, in both", exact=True).wait_for()
    alice.write_named(ONE_HOOP.replace("one-hoop", "alices-hoop"), "alices-hoop")
    alice.save()
    alice.page.get_by_text("bob saved version 2 meanwhile").first.wait_for()
    alice.page.get_by_role("button", name="History").click()
    alice.page.get_by_role("button", name="Changes of version 2").click()
    alice.page.locator(".difference .added").get_by_text("+name: bobs-hoop").wait_for()
    alice.page.locator(".dialog").get_by_role("button", name="Close", exact=True).click()
    alice.save()
    alice.page.get_by_text("version 3 by alice, in both", exact=True).wait_for()
    bob.page.get_by_role("button", name="History").click()
    bob.page.get_by_role("button", name="Plan version 1").click()
    bob.page.wait_for_selector('[role=status][data-state="done"]')
    bob.page.locator(".job .name").get_by_text("one-hoop").wait_for()
    for visitor in (alice, bob):
        visitor.end()
