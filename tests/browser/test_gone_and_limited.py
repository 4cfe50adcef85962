"""What becomes of a page whose job, mission, study or person goes away while it is open; limits as those read them whom they meet; double clicks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from ltlplan import Client
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Role
from ltlplan.service.security.tokens import Tokens
from tests.browser.visitor import LIMIT, OF_THE_PAGE, Visitor, served
from tests.helpers.serving.services import ONE_HOOP

pytestmark = OF_THE_PAGE

PASSWORD = "twelve letters"
LONG = ONE_HOOP.replace("samples: 20, iterations: 2", "samples: 4000, iterations: 400")
"""A mission whose first stage takes minutes."""


@pytest.fixture(scope="module")
def people(tmp_path_factory: pytest.TempPathFactory) -> Iterator[People]:
    """Yield a lab of three."""
    folder = tmp_path_factory.mktemp("service") / "data"
    folder.mkdir()
    made = People(Tokens(folder))
    for name, role in (("root", Role.admin), ("alice", Role.planner), ("bob", Role.planner)):
        made.accounts.change_password(name, made.accounts.add(name, role), PASSWORD)
    yield made
    made.close()


@pytest.fixture(scope="module")
def address(people: People) -> Iterator[str]:
    """Start the lab's service, of which a stage may take 6 s."""
    limits = people.database.folder.parent / "limits.yaml"
    limits.write_text("stage_seconds: 6\n")
    with served(people.database.folder, words=("--limits", str(limits))) as found:
        yield found


def _entered(chromium: Any, address: str, name: str) -> Visitor:
    visitor = Visitor(chromium, address)
    visitor.open("/login")
    visitor.page.get_by_label("Name").fill(name)
    visitor.page.get_by_label("Password", exact=True).fill(PASSWORD)
    visitor.page.get_by_role("button", name="Log in", exact=True).dblclick()
    visitor.wait("location.pathname === '/'")
    visitor.checked()
    return visitor


def _client(people: People, address: str, name: str, label: str) -> Client:
    return Client(address, token=people.tokens.new(f"{name}.{label}", account=name))


def _asks(visitor: Visitor) -> int:
    """Return how many requests and messages a page sends in 4 s."""
    sent: list[str] = []
    visitor.page.on("request", lambda request: sent.append(request.url))
    session = visitor.context.new_cdp_session(visitor.page)
    session.on("Network.webSocketFrameSent", lambda frame: sent.append(frame["response"]["payloadData"]))
    session.send("Network.enable")
    visitor.page.wait_for_timeout(4000)
    session.detach()
    return len(sent)


def test_a_job_that_another_deletes_is_said_to_be_gone(address: str, people: People, chromium: Any) -> None:
    visitor = _entered(chromium, address, "alice")
    with _client(people, address, "alice", "gone") as client:
        for tab in ("plan", "watch", "judge", "compare"):
            job = client.submit_text(ONE_HOOP, seed=11).wait()
            visitor.open(f"/jobs/{job.id}/{tab}")
            visitor.page.locator(".current").get_by_text("one-hoop: done").wait_for()
            if tab == "judge":
                visitor.page.fill("input[name=max_speed]", "1.25")
            client.delete(job)
            visitor.page.get_by_text("The job of one-hoop was deleted, or is no longer shared with you.").wait_for()
            visitor.wait(f"location.pathname === '/{tab}'")
            assert visitor.page.locator(".q-notification").count() == 1
            assert visitor.page.locator("input[name=max_speed]").input_value() == ("1.25" if tab == "judge" else "")
            assert _asks(visitor) <= 2, "its own heartbeat"
        running = client.submit_text(LONG, seed=12)
        visitor.open(f"/jobs/{running.id}/plan")
        visitor.page.wait_for_selector('[role=status][data-state="running"]')
        client.cancel(running)
        client.delete(running)
        visitor.page.get_by_text("The job of one-hoop was deleted").wait_for()
        visitor.page.get_by_text("Choose a job beside this, or write a mission.").wait_for()
    visitor.end()


def test_a_stored_mission_and_a_study_that_are_deleted_are_said_to_be_gone(address: str, people: People, chromium: Any) -> None:
    visitor = _entered(chromium, address, "alice")
    visitor.write(ONE_HOOP.replace("one-hoop", "kept-text"))
    visitor.wait("document.querySelector('.state').textContent.includes('kept-text')")
    visitor.page.get_by_label("stored as").fill("soon gone")
    visitor.page.get_by_role("button", name="Save", exact=True).dblclick()
    visitor.page.get_by_text("version 1 by alice", exact=True).wait_for()
    with _client(people, address, "alice", "stored") as client:
        (mission,) = client.stored_missions(search="soon gone")
        assert mission.version == 1, "saved once"
        client.delete_mission(mission)
        visitor.page.get_by_text("It is no longer stored, or no longer shared with you").wait_for()
        assert "kept-text" in visitor.written()
        assert visitor.page.get_by_label("stored as").input_value() == "soon gone"
        visitor.page.get_by_role("button", name="Save", exact=True).click()
        visitor.page.get_by_text("version 1 by alice", exact=True).wait_for()
        assert [each.name for each in client.stored_missions(search="soon gone")] == ["soon gone"]
        study = client.study(client.check_mission(ONE_HOOP), "seed", [1, 2])
        visitor.open(f"/studies/{study.id}")
        visitor.page.locator(".study-table tbody tr").nth(1).wait_for()
        client.delete_study(study)
        visitor.page.locator("[role=alert]").get_by_text("There is no study").wait_for()
        assert visitor.page.locator(".study-table tbody tr").count() == 0
    assert visitor.page.locator(".q-notification").count() == 0
    visitor.end()


def test_what_somebody_wrote_whose_account_is_disabled_is_there_when_they_are_back(
    address: str, people: People, chromium: Any
) -> None:
    visitor = _entered(chromium, address, "bob")
    visitor.write(ONE_HOOP.replace("one-hoop", "bobs-own"))
    visitor.wait("document.querySelector('.state').textContent.includes('bobs-own')")
    people.accounts.set_disabled("bob", True)
    visitor.page.wait_for_url(address + "/login", timeout=LIMIT)
    assert _asks(visitor) == 0
    people.accounts.set_disabled("bob", False)
    visitor.complaints.clear()  # of the line that was cut
    visitor.page.get_by_label("Name").fill("bob")
    visitor.page.get_by_label("Password", exact=True).fill(PASSWORD)
    visitor.page.get_by_role("button", name="Log in", exact=True).click()
    visitor.page.wait_for_url(address + "/", timeout=LIMIT)
    visitor.wait("document.querySelector('.state')?.textContent.includes('bobs-own')")
    visitor.end()


def test_a_limit_is_read_before_and_after_it_is_met(address: str, chromium: Any) -> None:
    visitor = _entered(chromium, address, "bob")
    visitor.write(LONG)
    visitor.wait("document.querySelector('.state').textContent.includes('one-hoop')")
    visitor.page.get_by_role("button", name="Plan it").dblclick()
    visitor.page.get_by_text("a stage may take 6 s of processor time and 4096 MB").wait_for()
    visitor.page.wait_for_selector('[role=status][data-state="failed"]')
    said = "This took more than the 6 s of processor time that a stage may take; ask for less, or run it yourself with `ltlplan run`."
    assert said in visitor.said(".job .words-of-command")
    assert visitor.page.locator("#plan-panel .entry").count() == 1
    visitor.tab("Trust")
    visitor.page.locator(".refusal").get_by_text(said).wait_for()
    visitor.end()


def test_a_double_click_does_one_thing(address: str, people: People, chromium: Any) -> None:
    visitor = _entered(chromium, address, "root")
    page = visitor.page
    visitor.write(ONE_HOOP)
    visitor.wait("document.querySelector('.state').textContent.includes('one-hoop')")
    with _client(people, address, "root", "clicks") as client:
        before = len(client.jobs())  # an admin sees those of others
        page.get_by_role("button", name="Study this mission").dblclick()
        page.locator("input[name=key]").fill("limits.speed")
        page.locator("textarea[name=values]").fill("0.3, 0.4")
        page.get_by_role("button", name="Study it").dblclick()
        visitor.wait("location.pathname.startsWith('/studies/')")
        visitor.wait("document.querySelector('.job .head .chip')?.textContent === 'all ended'")
        assert len(client.studies()) == 1
        assert len(client.jobs()) == before + 2
        visitor.tab("Plan")
        page.locator("#plan-panel .entry").first.dblclick()
        page.locator(".job .name h2").wait_for()
        visitor.tab("Simulate")
        page.locator("form[aria-label=Campaign]").get_by_label("Flights").fill("2")
        page.get_by_role("button", name="Begin a campaign").dblclick()
        page.locator(".derived .stage.done").wait_for()
        assert page.locator(".derived .stage").count() == 1
        page.get_by_role("button", name="Delete", exact=False).and_(page.locator(".derived button")).dblclick()
        visitor.wait("document.querySelectorAll('.derived .stage').length === 0")
        visitor.tab("Take away")
        with page.expect_download() as coming:
            page.get_by_role("button", name="crazyswarm2", exact=True).dblclick()
        assert coming.value.suggested_filename.endswith(".zip")
        visitor.tab("Plan")
        page.get_by_role("button", name="Delete", exact=True).dblclick()
        assert page.get_by_role("button", name="Delete it").count() == 1
        page.get_by_role("button", name="Delete it").dblclick()
        visitor.wait("document.querySelectorAll('#plan-panel .entry').length === " + str(before + 1))
        assert len(client.jobs()) == before + 1
        visitor.tab("People")
        page.locator("input[name=account]").fill("carol")
        page.locator(".accounts").get_by_role("button", name="Make it").dblclick()
        page.locator(".revealed").wait_for()
        drawn = visitor.said(".revealed")
        page.wait_for_timeout(500)
        assert visitor.said(".revealed") == drawn
        assert people.accounts.check("carol", drawn).temporary
        page.get_by_role("button", name="Reset password of carol").dblclick()
        visitor.wait(f"document.querySelector('.revealed').textContent !== {drawn!r}")
        page.wait_for_timeout(500)
        people.accounts.check("carol", visitor.said(".revealed"))
        page.get_by_role("button", name="Disable carol").dblclick()
        page.get_by_role("button", name="Enable carol").wait_for()
        page.wait_for_timeout(500)
        assert page.get_by_role("button", name="Enable carol").count() == 1
        page.locator("input[name=label]").fill("laptop")
        page.locator(".own").get_by_role("button", name="Make it").dblclick()
        page.get_by_role("button", name="Revoke root.laptop").dblclick()
        visitor.wait("![...document.querySelectorAll('.own code')].some((each) => each.textContent === 'root.laptop')")
        page.locator("input[name=project]").fill("show")
        page.locator(".projects").get_by_role("button", name="Make it").dblclick()
        page.get_by_role("button", name="Share: show").dblclick()
        page.get_by_role("button", name="Make private: show").wait_for()
        page.wait_for_timeout(500)
        assert page.get_by_role("button", name="Make private: show").count() == 1
        done = [entry.action for entry in people.log.entries() if entry.object in ("carol", "root.laptop", "show")]
        assert len(done) == len(set(done)), done
    assert page.locator(".q-notification.bg-negative").count() == 0
    visitor.end()
