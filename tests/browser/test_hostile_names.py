"""Names that mean harm, or are only strange, wherever the page shows them: text, never markup, and nothing wider than the window."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import httpx
import pytest

from ltlplan import Client
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Role
from ltlplan.service.security.asker import COOKIE
from ltlplan.service.security.tokens import Tokens
from tests.browser.visitor import OF_THE_PAGE, Visitor, served
from tests.helpers.serving.services import ONE_HOOP

pytestmark = OF_THE_PAGE

MARKUP = "<img src=x onerror=owned=1>"
SCRIPT = "{{owned=1}}'\"`<script>owned=1</script>"
RIGHT_TO_LEFT = "משימה 12 مهمة"
WIDE = "W" * 60
TURNED = "gnp\u202eexe."
"""A name that turns the direction of what follows it."""
HARMLESS = """() => window.owned === undefined && !document.querySelector("img[src=x]")
  && document.documentElement.scrollWidth <= innerWidth"""


def test_hostile_names_are_text_wherever_they_are_shown(tmp_path: Path, chromium: Any) -> None:
    data = tmp_path / "data"
    data.mkdir(mode=0o700)
    people = People(Tokens(data))
    people.accounts.add("root", Role.admin)
    token = people.tokens.new("root.program", account="root")
    with served(data, words=["--webhook-host", "hooks.lab.example"]) as address, Client(address, token=token) as client:
        job = client.submit_text(ONE_HOOP).wait()
        for name in (MARKUP, SCRIPT, RIGHT_TO_LEFT, WIDE):
            client.share_project(name[:50])
            client.store_mission(name, ONE_HOOP, project=name[:50], tags=(name.replace(" ", "")[:30],))
            client.study(client.check_mission(ONE_HOOP), "seed", [1], name=name)
            client.keep_draft(f"draft-{len(name)}", f"name: {name}\n")
        client.keep_draft("turned", f"name: {TURNED}\n")
        headers = {"authorization": f"Bearer {token}"}
        url = "https://hooks.lab.example/<img/src=x/onerror=owned=1>?" + "w" * 300
        added = httpx.post(address + "/api/webhooks", headers=headers, json={"url": url})
        assert added.status_code in (201, 422)
        for name in (
            "x" * 10_000,
            TURNED,
            "\u2066a",
            "a\x00b",
            "\ud800".encode("utf-16", "surrogatepass").decode("utf-16", "replace") + "\n",
        ):
            with pytest.raises(Exception, match=r"cannot name|cannot be|at most|letters"):
                client.store_mission(name, ONE_HOOP)
        visitor = Visitor(chromium, address, width=900)
        session = people.sessions.begin_of_account("root")
        visitor.context.add_cookies([{"name": COOKIE, "value": session, "url": address}])
        page = visitor.page
        visitor.open("/")
        page.locator(".fault-line").first.wait_for()  # of the draft that was kept last
        visitor.wait("window.socket?.connected")
        page.locator(".stored summary").click()
        page.locator(".stored .drop li").nth(3).wait_for()
        for name in (MARKUP, SCRIPT, RIGHT_TO_LEFT, WIDE):
            page.locator(".stored .drop b").get_by_text(name, exact=True).wait_for()
        assert page.evaluate(HARMLESS)
        page.get_by_role("button", name=f"Open {MARKUP}", exact=True).click()
        page.locator(".drafts summary").click()
        page.locator(".drafts li").nth(2).wait_for()
        assert page.evaluate(HARMLESS)
        page.keyboard.press("Escape")
        page.get_by_role("button", name="History").click()
        page.locator("h2").get_by_text(MARKUP, exact=True).wait_for()
        page.get_by_role("button", name="Changes of version 1").click()
        page.locator(".difference").wait_for()
        assert page.evaluate(HARMLESS)
        for path, shown in (
            ("/compare", ".job-list .entry b"),
            ("/people", ".projects td"),
            (f"/jobs/{job.id}/plan", ".job .name"),
        ):
            visitor.open(path)
            page.locator(f"{shown}:visible").first.wait_for()
            page.wait_for_timeout(500)
            assert page.evaluate(HARMLESS), path
        visitor.open(f"/jobs/{job.id}/judge")
        page.locator(".judging input[type=file]").wait_for(state="attached")
        visitor.wait("window.socket?.connected")
        for name in (f"{MARKUP}{'w' * 200}.csv", f"{TURNED}csv"):
            page.locator(".judging input[type=file]").set_input_files(
                {"name": name, "mimeType": "text/csv", "buffer": b"nothing,of,a,flight\n"}
            )
            visitor.wait(f"document.querySelector('.judging .sentence').textContent.includes({name[:12]!r})")
            page.get_by_text("is not judged").first.wait_for()
            assert page.evaluate(HARMLESS), name
        visitor.end()
    people.close()
