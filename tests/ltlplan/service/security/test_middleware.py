"""The gate of the service around a small application: tokens, sessions, open requests and their places."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import httpx
import pytest

from ltlplan.service.people.people import People
from ltlplan.service.security import open_requests
from ltlplan.service.security.admission import Rules
from ltlplan.service.security.asker import COOKIE, is_open
from ltlplan.service.security.middleware import Gate
from ltlplan.service.security.origins import own_names
from ltlplan.service.security.tokens import Tokens
from ltlplan.service.settings import Limits, Rate


async def _application(scope: Any, receive: Any, send: Any) -> None:
    """Answer with what the body holds; fail where that is asked."""
    if scope["path"] == "/bug":
        raise RuntimeError("secret words")
    body = b""
    while True:
        message = await receive()
        body += message.get("body", b"")
        if not message.get("more_body"):
            break
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-type", b"text/plain")]})
    await send({"type": "http.response.body", "body": body + str(scope["state"]["client"]).encode()})


def _gate(folder: Path, *, closed: bool = False, inner: Any = _application, **limits: Any) -> Gate:
    rules = Rules(People(Tokens(folder)), own_names("127.0.0.1"), everywhere=False, closed=closed, limits=Limits(**limits))
    return Gate(inner, rules)


def _asked(gate: Gate, method: str, path: str, **given: Any) -> httpx.Response:
    async def ask() -> httpx.Response:
        transport = httpx.ASGITransport(gate, client=("10.1.1.1", 1))  # type: ignore[arg-type]  # as the gate declares it
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            return await client.request(method, path, **given)

    return asyncio.run(ask())


def test_without_tokens_this_machine_may_ask(tmp_path: Path) -> None:
    answer = _asked(_gate(tmp_path), "POST", "/api/x", content=b"hello ")
    assert answer.text == "hello 10.1.1.1"
    assert answer.headers["x-content-type-options"] == "nosniff"


def test_with_tokens_everybody_needs_one_and_it_stands_in_no_log(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    gate = _gate(tmp_path)
    token = gate.rules.people.tokens.new("alice")
    caplog.set_level("INFO")
    refused = _asked(gate, "GET", "/api/x")
    assert refused.status_code == 401
    assert refused.headers["www-authenticate"] == "Bearer"
    assert refused.json()["type"] == "/problems/not-authenticated"
    assert _asked(gate, "GET", "/api/x?token=" + token).status_code == 401
    assert _asked(gate, "GET", "/api/x", headers={"authorization": "Bearer nonsense"}).status_code == 401
    assert _asked(gate, "GET", "/api/x", headers={"authorization": f"Bearer {token}"}).text == "alice"
    assert (
        _asked(gate, "GET", "/api/x", headers={"cookie": f"{COOKIE}={gate.rules.people.sessions.begin('alice')}"}).text
        == "alice"
    )
    assert _asked(gate, "GET", "/health").status_code == 200
    to_login = _asked(gate, "GET", "/jobs/1", headers={"accept": "text/html"})
    assert (to_login.status_code, to_login.headers["location"]) == (303, "/login")
    noted = [record.__dict__["said"] for record in caplog.records if "said" in record.__dict__]
    assert len(noted) == 7
    assert token not in json.dumps(noted)


def test_a_service_that_answered_to_tokens_does_not_open_when_the_last_one_is_revoked(tmp_path: Path) -> None:
    gate = _gate(tmp_path)
    assert _asked(gate, "GET", "/api/x").status_code == 200
    token = gate.rules.people.tokens.new("alice")
    assert _asked(gate, "GET", "/api/x", headers={"authorization": f"Bearer {token}"}).text == "alice"
    gate.rules.people.tokens.revoke("alice")
    assert _asked(gate, "GET", "/api/x", headers={"authorization": f"Bearer {token}"}).status_code == 401
    refused = _asked(gate, "GET", "/api/x")
    assert (refused.status_code, "no tokens left" in refused.text) == (401, True)


def test_a_network_s_service_stays_closed_when_its_last_token_is_revoked(tmp_path: Path) -> None:
    gate = _gate(tmp_path, closed=True)
    assert _asked(gate, "GET", "/api/x").status_code == 401
    assert _asked(gate, "GET", "/docs").status_code == 200


def test_wrong_tokens_run_out_and_right_ones_pass_behind_the_same_address(tmp_path: Path) -> None:
    gate = _gate(tmp_path, strangers=Rate(0.001, 3))
    token = gate.rules.people.tokens.new("alice")
    statuses = [_asked(gate, "GET", "/api/x", headers={"authorization": f"Bearer {i}"}).status_code for i in range(25)]
    assert statuses == [401] * 3 + [429] * 22
    assert _asked(gate, "GET", "/api/x", headers={"authorization": f"Bearer {token}"}).text == "alice"
    session = gate.rules.people.sessions.begin("alice")
    assert _asked(gate, "GET", "/api/x", headers={"cookie": f"{COOKIE}={session}"}).text == "alice"
    limited = _asked(gate, "GET", "/api/x", headers={"authorization": "Bearer 26"})
    assert (limited.status_code, int(limited.headers["retry-after"]) > 1) == (429, True)


@pytest.mark.parametrize("path", ["/login", "/health", "/docs", "/docs/start.js", "/problems/busy", "/openapi.json"])
def test_what_is_open_to_strangers(path: str) -> None:
    assert is_open(path)


@pytest.mark.parametrize(
    "path",
    [
        "/",
        "/login/x",
        "/login/",
        "/logout/x",
        "/health/x",
        "/docs/",
        "/docs/a/b",
        "/problems",
        "/problems/x/y",
        "/favicon.ico/x",
        "//docs/x",
        "/openapi.json/x",
    ],
)
def test_what_is_below_an_open_path_is_not_open(path: str) -> None:
    assert not is_open(path)


def test_people_are_refused_by_a_page_and_programs_by_a_problem(tmp_path: Path) -> None:
    gate = _gate(tmp_path)
    browser = {"accept": "text/html,application/xhtml+xml,*/*;q=0.8", "origin": "http://evil.example"}
    page = _asked(gate, "POST", "/<b>x", headers=browser)
    assert (page.status_code, page.headers["content-type"]) == (403, "text/html; charset=utf-8")
    assert "<h1>Forbidden</h1>" in page.text
    assert "script-src" not in page.headers["content-security-policy"]
    assert "default-src 'none'" in page.headers["content-security-policy"]
    problem = _asked(gate, "POST", "/x", headers={**browser, "accept": "*/*"})
    assert (problem.status_code, problem.headers["content-type"]) == (403, "application/problem+json")
    evil = _asked(gate, "GET", "/", headers={"host": "<script>.example", "accept": "text/html"})
    assert (evil.status_code, "<script>" in evil.text) == (421, False)


def test_our_own_forms_say_where_they_are_from(tmp_path: Path) -> None:
    assert _asked(_gate(tmp_path), "GET", "/x").headers["referrer-policy"] == "same-origin"


async def _endless(scope: Any, receive: Any, send: Any) -> None:
    """Answer with a stream that never says anything more, or a socket that only listens."""
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept"})
        while (await receive())["type"] != "websocket.disconnect":
            await send({"type": "websocket.send", "text": "heard"})
        return
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-type", b"text/event-stream")]})
    await send({"type": "http.response.body", "body": b"first", "more_body": True})
    await asyncio.Event().wait()


class _Caller:
    """One request that stays open, and what came of it."""

    def __init__(self, gate: Gate, kind: str, method: str = "GET", **headers: str) -> None:
        self.told: list[dict[str, Any]] = []
        self.saying: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        listed = [(b"host", b"localhost"), *((name.encode(), value.encode()) for name, value in headers.items())]
        scope = {"type": kind, "method": method, "path": "/api/x", "headers": listed, "client": ("10.1.1.1", 1)}
        self.task = asyncio.ensure_future(gate(scope, self.saying.get, self._hear))

    async def _hear(self, message: Any) -> None:
        self.told.append(message)

    async def hears(self, count: int) -> None:
        """Wait until it was told so many messages."""
        async with asyncio.timeout(30):
            while len(self.told) < count:
                await asyncio.sleep(0.01)


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize("way", ["token", "session", "logout"])
def test_what_is_open_ends_with_its_token_or_session_though_nothing_happens_in_it(
    kind: str, way: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(open_requests, "LOOK", 0.02)
    gate = _gate(tmp_path, inner=_endless)
    people = gate.rules.people
    token = people.tokens.new("alice")
    bobs = people.tokens.new("bob")
    session = people.sessions.begin("alice")

    async def ask() -> None:
        headers = {"authorization": f"Bearer {token}"} if way == "token" else {"cookie": f"{COOKIE}={session}"}
        ours, others = _Caller(gate, kind, **headers), _Caller(gate, kind, authorization=f"Bearer {bobs}")
        await ours.hears(1)
        await others.hears(1)
        if way == "logout":
            people.sessions.end(session)
        else:
            Tokens(tmp_path).revoke("alice")
        async with asyncio.timeout(30):
            await ours.task
        assert not others.task.done()
        if kind == "http":
            assert ours.told[-1] == {"type": "http.response.body", "body": b""}
        else:
            assert (ours.told[-1]["type"], ours.told[-1]["code"]) == ("websocket.close", 1008)
        others.task.cancel()

    asyncio.run(ask())


def test_nothing_said_in_a_socket_is_heard_after_its_session_has_ended(tmp_path: Path) -> None:
    heard: list[str] = []

    async def listening(scope: Any, receive: Any, send: Any) -> None:
        del scope
        await send({"type": "websocket.accept"})
        while (message := await receive())["type"] == "websocket.receive":
            heard.append(message["text"])
            await send({"type": "websocket.send", "text": "heard"})

    gate = _gate(tmp_path, inner=listening)
    people = gate.rules.people
    people.tokens.new("alice")
    session = people.sessions.begin("alice")

    async def ask() -> None:
        caller = _Caller(gate, "websocket", cookie=f"{COOKIE}={session}")
        await caller.saying.put({"type": "websocket.receive", "text": "before"})
        await caller.hears(2)
        people.sessions.end(session)
        await caller.saying.put(
            {"type": "websocket.receive", "text": "after"}
        )  # at once: no look from time to time would see it
        async with asyncio.timeout(30):
            await caller.task

    asyncio.run(ask())
    assert heard == ["before"]


def test_an_answer_that_was_computed_meanwhile_is_not_given(tmp_path: Path) -> None:
    gate = _gate(tmp_path)
    token = gate.rules.people.tokens.new("alice")

    async def revoking(scope: Any, receive: Any, send: Any) -> None:
        Tokens(tmp_path).revoke("alice")
        await _application(scope, receive, send)

    gate.inner = revoking
    answer = _asked(gate, "GET", "/api/x", headers={"authorization": f"Bearer {token}"})
    assert (answer.status_code, answer.json()["type"]) == (401, "/problems/not-authenticated")


def test_one_client_has_only_some_requests_open_and_others_have_theirs(tmp_path: Path) -> None:
    gate = _gate(tmp_path, inner=_endless, open_of_one=3)
    alice, bob = (gate.rules.people.tokens.new(name) for name in ("alice", "bob"))

    async def ask() -> None:
        held = [_Caller(gate, "http", authorization=f"Bearer {alice}") for _ in range(4)]
        others = _Caller(gate, "http", authorization=f"Bearer {bob}")
        for each in (*held, others):
            await each.hears(1)
        assert [each.told[0]["status"] for each in (*held, others)] == [200, 200, 200, 503, 200]
        for each in (*held, others):
            each.task.cancel()

    asyncio.run(ask())


def test_a_body_that_does_not_come_gives_its_place_to_a_request_that_does(tmp_path: Path) -> None:
    gate = _gate(tmp_path, open_of_one=2)

    async def ask() -> None:
        slow = [_Caller(gate, "http", "POST", **{"content-length": "5"}) for _ in range(2)]
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        quick = _Caller(gate, "http", "POST")
        await quick.saying.put({"type": "http.request", "body": b"all", "more_body": False})
        async with asyncio.timeout(30):
            await quick.task
            await slow[0].task
        assert (quick.told[0]["status"], slow[0].told[0]["status"], slow[1].told) == (200, 408, [])
        slow[1].task.cancel()

    asyncio.run(ask())


def test_the_gate_refuses_in_the_order_of_its_rules(tmp_path: Path) -> None:
    gate = _gate(tmp_path, body_bytes=10, reads=Rate(0.001, 2))
    assert _asked(gate, "GET", "/x", headers={"host": "evil.example"}).status_code == 421
    assert _asked(gate, "POST", "/x", headers={"origin": "http://evil.example"}).status_code == 403
    assert _asked(gate, "POST", "/x", content=b"x" * 11).status_code == 413
    assert [_asked(gate, "GET", "/x").status_code for _ in range(3)] == [200, 200, 429]
    limited = _asked(gate, "GET", "/x")
    assert int(limited.headers["retry-after"]) > 1


def test_a_bug_ends_its_own_request_without_its_words(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    answer = _asked(_gate(tmp_path), "GET", "/bug")
    assert answer.status_code == 500
    assert answer.json()["exit_code"] == 1
    assert "secret words" not in answer.text
    assert "secret words" in str(caplog.records[0].exc_info)


def test_a_body_that_does_not_come_ends_its_request(tmp_path: Path) -> None:
    messages: list[dict[str, Any]] = []

    async def ask() -> None:
        first = [{"type": "http.request", "body": b"x", "more_body": True}]

        async def receive() -> dict[str, Any]:
            if first:
                return first.pop()
            await asyncio.sleep(30)
            raise AssertionError

        async def send(message: Any) -> None:
            messages.append(message)

        scope = {"type": "http", "method": "POST", "path": "/x", "headers": [(b"host", b"localhost")], "client": ("1.1.1.1", 1)}
        await _gate(tmp_path, body_seconds=0.05)(scope, receive, send)

    asyncio.run(ask())
    assert messages[0]["status"] == 408
