"""A service that answers to tokens, in a real browser: in, out, and out at once when the token is revoked."""

from __future__ import annotations

import threading
import urllib.parse
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from ltlplan.service.security.tokens import Tokens
from tests.browser.visitor import LIMIT, OF_THE_PAGE, Visitor, served

pytestmark = OF_THE_PAGE


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a data folder with a token that nobody has."""
    folder = tmp_path_factory.mktemp("service") / "data"
    folder.mkdir()
    Tokens(folder).new("keeper")
    return folder


@pytest.fixture(scope="module")
def address(data: Path) -> Iterator[str]:
    """Start a service that answers to tokens."""
    with served(data) as found:
        yield found


def _give(visitor: Visitor, token: str) -> int:
    """Type a token, and return the status that the form was answered with."""
    visitor.page.get_by_label("Token").fill(token)
    with visitor.page.expect_response(
        lambda answer: answer.request.method == "POST" and answer.url.endswith("/login")
    ) as coming:
        visitor.page.get_by_role("button", name="Log in").click()
    return coming.value.status


@contextmanager
def _guessing(address: str) -> Generator[None]:
    """Have somebody else of this machine guess all the time."""
    over = threading.Event()

    def guess() -> None:
        while not over.wait(0.1):
            httpx.post(address + "/login", data={"token": "guess"}, timeout=60)

    guesser = threading.Thread(target=guess)
    guesser.start()
    try:
        yield
    finally:
        over.set()
        guesser.join()


def _is_at(visitor: Visitor, path: str) -> None:
    visitor.page.wait_for_url(visitor.address + path, timeout=LIMIT)


def test_somebody_logs_in_plans_and_logs_out_in_all_windows(address: str, data: Path, chromium: Any) -> None:
    token = Tokens(data).new("alice")
    visitor = Visitor(chromium, address)
    visitor.open("/plan")
    _is_at(visitor, "/login")
    assert _give(visitor, "nonsense") == 401
    assert visitor.said("[role=alert]") == "This is no token of this service, or it was revoked."
    visitor.complaints.clear()  # Chromium complains of the status
    assert _give(visitor, token) == 303
    _is_at(visitor, "/")
    visitor.checked()
    other = visitor.context.new_page()
    other.goto(address + "/plan")
    visitor.page.get_by_role("button", name="Plan it").click()
    visitor.page.wait_for_selector('[data-stage="plan"].done')
    visitor.page.wait_for_selector('[role=status][data-state="done"]')  # too soon to be cancelled by hand
    cookies = {each["name"]: each for each in visitor.context.cookies()}
    visitor.page.get_by_role("button", name="Log out").click()
    _is_at(visitor, "/login")
    other.wait_for_url(address + "/login", timeout=LIMIT)  # by itself
    kept = {"cookie": f"ltlplan_session={cookies['ltlplan_session']['value']}"}
    assert httpx.get(address + "/api/jobs", headers=kept).status_code == 401, "the session has ended, not only the cookie"
    visitor.open("/plan")
    _is_at(visitor, "/login")
    visitor.context.close()
    assert visitor.elsewhere == []


def test_what_a_page_asks_is_not_done_once_its_token_is_revoked_and_the_page_leaves(
    address: str, data: Path, chromium: Any
) -> None:
    keeper = {"authorization": f"Bearer {Tokens(data).new('auditor')}"}
    token = Tokens(data).new("mallory")
    visitor = Visitor(chromium, address)
    visitor.open("/login")
    _give(visitor, token)
    visitor.checked()
    before = httpx.get(address + "/api/jobs", headers=keeper).json()
    Tokens(data).revoke("mallory")
    visitor.page.evaluate("document.querySelector('.submit button').click()")  # at once
    _is_at(visitor, "/login")
    assert httpx.get(address + "/api/jobs", headers=keeper).json() == before
    visitor.context.close()


def test_wrong_tokens_are_slowed_down_and_the_right_one_still_comes_in(address: str, data: Path, chromium: Any) -> None:
    token = Tokens(data).new("bob")
    wrong = [httpx.post(address + "/login", data={"token": f"guess {i}"}).status_code for i in range(25)]
    assert (wrong[0], wrong[-1]) == (401, 429)
    visitor = Visitor(chromium, address)
    visitor.open("/login")
    with _guessing(address):
        while (status := _give(visitor, "another guess")) == 401:  # one in two seconds is looked at
            continue
        assert status == 429
        assert "Too many wrong tokens from this address." in visitor.said("[role=alert]")
        assert _give(visitor, token) == 303
    visitor.checked()
    visitor.context.close()


def test_another_site_s_form_is_refused_in_words(address: str, data: Path, chromium: Any) -> None:
    token = Tokens(data).new("carol")
    visitor = Visitor(chromium, address)
    form = f'<form method="post" action="{address}/login"><input name="token" value="{token}"></form><script>document.forms[0].submit()</script>'
    with visitor.page.expect_response(lambda answer: answer.url.endswith("/login")) as coming:
        visitor.page.goto("data:text/html," + urllib.parse.quote(form))
    assert coming.value.status == 403
    assert coming.value.request.headers["origin"] == "null"
    assert visitor.said("h1") == "Forbidden"
    assert visitor.page.locator("main").count() == 1
    assert visitor.context.cookies() == []
    visitor.context.close()


@pytest.mark.parametrize("path", ["/login/x", "/logout/x", "/docs/x/y", "/problems/x/y", "/health/x", "/nothing"])
def test_strangers_are_shown_nothing_below_what_is_open(address: str, path: str) -> None:
    browser = httpx.get(address + path, headers={"accept": "text/html"})
    assert (browser.status_code, browser.headers["location"], browser.content) == (303, "/login", b"")
    program = httpx.get(address + path)
    assert (program.status_code, program.headers["content-type"]) == (401, "application/problem+json")
