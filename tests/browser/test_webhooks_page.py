"""Webhooks on the page of who logged in: added, their secret shown once, deleted."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ltlplan.service.security.tokens import Tokens
from tests.browser.visitor import OF_THE_PAGE, Visitor, served

pytestmark = OF_THE_PAGE


def test_a_webhook_is_added_and_deleted(chromium: Any, tmp_path: Path) -> None:
    data = tmp_path / "data"
    data.mkdir(mode=0o700)
    token = Tokens(data).new("alice", role="planner")
    with served(data, words=["--webhook-host", "hooks.lab.example"]) as address:
        visitor = Visitor(chromium, address)
        visitor.open("/login")
        page = visitor.page
        page.locator("input[name=token]").fill(token)
        page.locator("form:has(input[name=token]) button").first.click()
        visitor.wait("document.querySelector('[role=tab]')")
        visitor.open("/people")
        field = page.locator("input[name=webhook]")
        field.fill("https://evil.example/")
        page.get_by_role("button", name="Add it").click()
        page.get_by_text("Webhooks go to hosts that an admin lists").wait_for()
        field.fill("https://hooks.lab.example/ci")
        page.get_by_role("button", name="Add it").click()
        page.locator(".secret .revealed").wait_for()
        assert visitor.said(".secret .revealed").startswith("whsec_")
        page.get_by_role("button", name="Delete https://hooks.lab.example/ci").click()
        visitor.wait("!document.querySelector('.webhooks table tr')")
        visitor.end()
