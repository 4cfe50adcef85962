"""Who may ask, from where, how often and how much: each rule by itself, and the gate around a small application."""

from __future__ import annotations

import asyncio
import json
import math
import stat
import threading
from pathlib import Path
from typing import Any

import httpx
import pytest

from ltlplan.service.problems import (
    BodyTooLarge,
    Busy,
    Forbidden,
    TooManyRequests,
    WrongHost,
    error_of,
    kinds,
    problem_of,
)
from ltlplan.service.security import sessions as session_module
from ltlplan.service.security.admission import Rules
from ltlplan.service.security.asker import COOKIE, is_open
from ltlplan.service.security.body_limits import Bodies, Body
from ltlplan.service.security.middleware import Gate
from ltlplan.service.security.origins import own_names, require_own_host, require_own_page
from ltlplan.service.security.rates import MOST_CLIENTS, Rates
from ltlplan.service.security.sessions import FILE as SESSIONS
from ltlplan.service.security.sessions import MOST_OF_ONE, Sessions
from ltlplan.service.security.tokens import FILE, Tokens
from ltlplan.service.settings import Limits, Rate
from verify.data import BadInput, Infeasible, LtlplanError, MissionError, NotCertified, Witness, parse_mission

# tokens


def test_a_token_is_known_until_it_is_revoked_and_stands_in_no_file(tmp_path: Path) -> None:
    tokens = Tokens(tmp_path)
    assert not tokens.needed
    token = tokens.new("alice")
    assert tokens.needed
    assert tokens.owner(token) == Tokens(tmp_path).owner(token) == "alice"
    assert tokens.owner(token[:-1]) is tokens.owner("") is tokens.owner("\udcff") is None
    for path in tmp_path.iterdir():
        assert token not in path.read_text(errors="replace")
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    tokens.revoke("alice")
    assert tokens.owner(token) is None


def test_what_another_process_changes_counts_at_once(tmp_path: Path) -> None:
    ours, theirs = Tokens(tmp_path), Tokens(tmp_path)
    token = theirs.new("bob")
    assert ours.owner(token) == "bob"
    theirs.revoke("bob")
    assert ours.owner(token) is None


def test_tokens_made_at_the_same_time_are_all_kept(tmp_path: Path) -> None:
    threads = [threading.Thread(target=Tokens(tmp_path).new, args=(f"robot-{i}",)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(Tokens(tmp_path).names()) == [f"robot-{i}" for i in range(8)]


@pytest.mark.parametrize("name", ["", "a b", "../x", "a:b", "x" * 61, "é"])
def test_names_of_tokens(name: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="cannot name a token"):
        Tokens(tmp_path).new(name)


def test_a_name_that_is_taken_and_one_that_is_not_there(tmp_path: Path) -> None:
    tokens = Tokens(tmp_path)
    tokens.new("alice")
    with pytest.raises(BadInput, match="already"):
        tokens.new("alice")
    with pytest.raises(BadInput, match="Did you mean 'alice'"):
        tokens.revoke("alise")


@pytest.mark.parametrize("text", ["", "{}", '{"format": 2, "tokens": []}', '{"format": 1, "tokens": [{"name": 1}]}', "[1]"])
def test_a_file_of_tokens_that_is_none_opens_nothing(text: str, tmp_path: Path) -> None:
    (tmp_path / FILE).write_text(text)
    with pytest.raises(BadInput):
        Tokens(tmp_path).owner("x")


def test_a_session_holds_no_token_outlives_a_restart_and_lapses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tokens = Tokens(tmp_path)
    token = tokens.new("alice")
    sessions = Sessions(tokens)
    session = sessions.begin("alice")
    kept = (tmp_path / SESSIONS).read_text()
    assert token not in session
    assert session not in kept
    assert stat.S_IMODE((tmp_path / SESSIONS).stat().st_mode) == 0o600
    assert sessions.owner(session) == Sessions(Tokens(tmp_path)).owner(session) == "alice"
    for forged in ("", "alice", session[:-1], f"{session}x", "\udcff", json.loads(kept)["sessions"].popitem()[0]):
        assert sessions.owner(forged) is None
    now = session_module.time.time()
    monkeypatch.setattr(session_module.time, "time", lambda: now + session_module.SESSION_SECONDS + 1)
    assert sessions.owner(session) is None


def test_a_session_ends_by_itself_and_with_its_token(tmp_path: Path) -> None:
    tokens = Tokens(tmp_path)
    tokens.new("alice")
    sessions = Sessions(tokens)
    first, second = sessions.begin("alice"), sessions.begin("alice")
    sessions.end(first)
    sessions.end("nonsense")
    assert (sessions.owner(first), sessions.owner(second)) == (None, "alice")
    Tokens(tmp_path).revoke("alice")  # by another process
    assert sessions.owner(second) is None
    with pytest.raises(BadInput, match="no token 'alice'"):
        sessions.begin("alice")
    tokens.new("alice")
    assert sessions.owner(second) is None, "a new token of an old name takes no old session up again"


def test_of_an_owner_with_many_sessions_the_first_ends(tmp_path: Path) -> None:
    tokens = Tokens(tmp_path)
    tokens.new("alice")
    tokens.new("bob")
    sessions = Sessions(tokens)
    bobs = sessions.begin("bob")
    begun = [sessions.begin("alice") for _ in range(MOST_OF_ONE + 1)]
    assert [sessions.owner(each) for each in (begun[0], begun[1], begun[-1], bobs)] == [None, "alice", "alice", "bob"]


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"format": 1, "sessions": {"x": 1}}', '{"format": 1, "sessions": [1]}'])
def test_a_damaged_file_of_sessions_lets_nobody_in_and_is_replaced(text: str, tmp_path: Path) -> None:
    tokens = Tokens(tmp_path)
    tokens.new("alice")
    (tmp_path / SESSIONS).write_text(text)
    sessions = Sessions(tokens)
    assert sessions.owner("x") is None
    assert Sessions(tokens).owner(sessions.begin("alice")) == "alice"


# origins


@pytest.mark.parametrize("host", ["localhost", "localhost:8000", "127.0.0.1:8000", "[::1]:8000", "LOCALHOST.", "127.5.5.5"])
def test_names_of_this_machine(host: str) -> None:
    assert require_own_host(host, own_names("127.0.0.1"), everywhere=False) is None


@pytest.mark.parametrize(
    "host", ["", "evil.example", "localhost.evil.example", "10.0.0.1", "127.0.0.1.evil.example", "[", "a b", "0x7f.1"]
)
def test_names_that_lead_here_but_are_not_ours(host: str) -> None:
    with pytest.raises(WrongHost):
        require_own_host(host, own_names("127.0.0.1"), everywhere=False)


def test_names_on_a_network() -> None:
    names = own_names("0.0.0.0", ("Plan.Lab",))
    for host in ("10.0.0.7:8000", "plan.lab", "localhost"):
        assert require_own_host(host, names, everywhere=True) is None
    with pytest.raises(WrongHost, match=r"--name evil\.example"):
        require_own_host("evil.example", names, everywhere=True)


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": "http://localhost:9000"},
        {"origin": "http://["},
        {"sec-fetch-site": "cross-site"},
        {"sec-fetch-site": "same-site"},
    ],
)
def test_pages_of_other_sites_change_nothing(headers: dict[str, str]) -> None:
    given = {"host": "localhost:8000", **headers}
    for method in ("POST", "DELETE", "WEBSOCKET", "PUT"):
        with pytest.raises(Forbidden):
            require_own_page(method, given)
    assert require_own_page("GET", given) is None


def test_our_own_pages_and_programs_may_ask() -> None:
    ours = {"host": "localhost:8000", "origin": "http://localhost:8000", "sec-fetch-site": "same-origin"}
    assert require_own_page("POST", {"host": "localhost:8000"}) is None
    assert require_own_page("WEBSOCKET", ours) is None


# rates and bodies


def test_a_client_that_asks_too_often_waits_and_others_do_not() -> None:
    now = [0.0]
    rates = Rates(Rate(2.0, 3), clock=lambda: now[0])
    for _ in range(3):
        rates.take("a")
    with pytest.raises(TooManyRequests) as found:
        rates.take("a")
    assert found.value.seconds == pytest.approx(0.5)
    rates.take("b")
    now[0] = 0.5
    rates.take("a")
    with pytest.raises(TooManyRequests):
        rates.take("a")


def test_clients_that_never_come_back_are_forgotten() -> None:
    rates = Rates(Rate(1.0, 1), clock=lambda: 0.0)
    for client in range(MOST_CLIENTS + 5):
        rates.take(str(client))
    rates.take("0")  # long forgotten, so its bucket is full again
    with pytest.raises(TooManyRequests):
        rates.take(str(MOST_CLIENTS))


def _receiving(*parts: bytes) -> Any:
    messages = [{"type": "http.request", "body": part, "more_body": i + 1 < len(parts)} for i, part in enumerate(parts)]

    async def receive() -> dict[str, Any]:
        return messages.pop(0)

    return receive


def test_bodies_are_counted_as_they_come() -> None:
    async def read(most: int, held: int, *parts: bytes, announced: str | None = None) -> Bodies:
        bodies = Bodies(held, 1.0)
        body = Body(_receiving(*parts), bodies, most, announced)
        try:
            for _ in parts:
                await body.receive()
        finally:
            body.release()
        return bodies

    assert asyncio.run(read(10, 100, b"12345", b"67890")).held == 0
    with pytest.raises(BodyTooLarge):
        asyncio.run(read(9, 100, b"12345", b"67890"))
    with pytest.raises(BodyTooLarge):
        asyncio.run(read(9, 100, b"", announced="10"))
    with pytest.raises(BodyTooLarge):
        asyncio.run(read(9, 100, b"", announced="9" * 5000))
    with pytest.raises(Busy):
        asyncio.run(read(100, 9, b"12345", b"67890"))


# the gate


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
    rules = Rules(Sessions(Tokens(folder)), own_names("127.0.0.1"), everywhere=False, closed=closed, limits=Limits(**limits))
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
    token = gate.rules.sessions.tokens.new("alice")
    caplog.set_level("INFO")
    refused = _asked(gate, "GET", "/api/x")
    assert refused.status_code == 401
    assert refused.headers["www-authenticate"] == "Bearer"
    assert refused.json()["type"] == "/problems/not-authenticated"
    assert _asked(gate, "GET", "/api/x?token=" + token).status_code == 401
    assert _asked(gate, "GET", "/api/x", headers={"authorization": "Bearer nonsense"}).status_code == 401
    assert _asked(gate, "GET", "/api/x", headers={"authorization": f"Bearer {token}"}).text == "alice"
    assert _asked(gate, "GET", "/api/x", headers={"cookie": f"{COOKIE}={gate.rules.sessions.begin('alice')}"}).text == "alice"
    assert _asked(gate, "GET", "/health").status_code == 200
    to_login = _asked(gate, "GET", "/jobs/1", headers={"accept": "text/html"})
    assert (to_login.status_code, to_login.headers["location"]) == (303, "/login")
    noted = [record.__dict__["said"] for record in caplog.records if "said" in record.__dict__]
    assert len(noted) == 7
    assert token not in json.dumps(noted)


def test_a_service_that_answered_to_tokens_does_not_open_when_the_last_one_is_revoked(tmp_path: Path) -> None:
    gate = _gate(tmp_path)
    assert _asked(gate, "GET", "/api/x").status_code == 200
    token = gate.rules.sessions.tokens.new("alice")
    assert _asked(gate, "GET", "/api/x", headers={"authorization": f"Bearer {token}"}).text == "alice"
    gate.rules.sessions.tokens.revoke("alice")
    assert _asked(gate, "GET", "/api/x", headers={"authorization": f"Bearer {token}"}).status_code == 401
    refused = _asked(gate, "GET", "/api/x")
    assert (refused.status_code, "no tokens left" in refused.text) == (401, True)


def test_a_network_s_service_stays_closed_when_its_last_token_is_revoked(tmp_path: Path) -> None:
    gate = _gate(tmp_path, closed=True)
    assert _asked(gate, "GET", "/api/x").status_code == 401
    assert _asked(gate, "GET", "/docs").status_code == 200


def test_wrong_tokens_run_out_and_right_ones_pass_behind_the_same_address(tmp_path: Path) -> None:
    gate = _gate(tmp_path, strangers=Rate(0.001, 3))
    token = gate.rules.sessions.tokens.new("alice")
    statuses = [_asked(gate, "GET", "/api/x", headers={"authorization": f"Bearer {i}"}).status_code for i in range(25)]
    assert statuses == [401] * 3 + [429] * 22
    assert _asked(gate, "GET", "/api/x", headers={"authorization": f"Bearer {token}"}).text == "alice"
    session = gate.rules.sessions.begin("alice")
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
def test_what_is_open_ends_with_its_token_or_session_though_nothing_happens_in_it(kind: str, way: str, tmp_path: Path) -> None:
    gate = _gate(tmp_path, inner=_endless)
    sessions = gate.rules.sessions
    token = sessions.tokens.new("alice")
    bobs = sessions.tokens.new("bob")
    session = sessions.begin("alice")

    async def ask() -> None:
        headers = {"authorization": f"Bearer {token}"} if way == "token" else {"cookie": f"{COOKIE}={session}"}
        ours, others = _Caller(gate, kind, **headers), _Caller(gate, kind, authorization=f"Bearer {bobs}")
        await ours.hears(1)
        await others.hears(1)
        if way == "logout":
            sessions.end(session)
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
    sessions = gate.rules.sessions
    sessions.tokens.new("alice")
    session = sessions.begin("alice")

    async def ask() -> None:
        caller = _Caller(gate, "websocket", cookie=f"{COOKIE}={session}")
        await caller.saying.put({"type": "websocket.receive", "text": "before"})
        await caller.hears(2)
        sessions.end(session)
        await caller.saying.put(
            {"type": "websocket.receive", "text": "after"}
        )  # at once: no look from time to time would see it
        async with asyncio.timeout(30):
            await caller.task

    asyncio.run(ask())
    assert heard == ["before"]


def test_an_answer_that_was_computed_meanwhile_is_not_given(tmp_path: Path) -> None:
    gate = _gate(tmp_path)
    token = gate.rules.sessions.tokens.new("alice")

    async def revoking(scope: Any, receive: Any, send: Any) -> None:
        Tokens(tmp_path).revoke("alice")
        await _application(scope, receive, send)

    gate.inner = revoking
    answer = _asked(gate, "GET", "/api/x", headers={"authorization": f"Bearer {token}"})
    assert (answer.status_code, answer.json()["type"]) == (401, "/problems/not-authenticated")


def test_one_client_has_only_some_requests_open_and_others_have_theirs(tmp_path: Path) -> None:
    gate = _gate(tmp_path, inner=_endless, open_of_one=3)
    alice, bob = (gate.rules.sessions.tokens.new(name) for name in ("alice", "bob"))

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


# errors as problems and back


@pytest.mark.parametrize(
    "error",
    [
        BadInput("one\ntwo"),
        NotCertified(
            "no",
            [
                Witness(
                    claim="formula",
                    sentence="s",
                    robot="r",
                    time=1.5,
                    word=(("r", frozenset({"b", "a"})),),
                    times=((0.0, 1.0),),
                    order=((("r", 1), ("s", 2)),),
                )
            ],
        ),
        Infeasible("too tight", Witness(claim="limits.speed", sentence="s", bound=2.0, limit=1.0)),
        TooManyRequests("wait", 3.0),
    ],
)
def test_errors_come_back_as_themselves(error: LtlplanError) -> None:
    again = error_of(type(problem_of(error)).model_validate_json(problem_of(error).model_dump_json()))
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert again.exit_code == error.exit_code
    for name in ("witness", "witnesses"):
        assert getattr(again, name, None) == getattr(error, name, None)


def test_a_missions_faults_come_back(tmp_path: Path) -> None:
    with pytest.raises(MissionError) as found:
        parse_mission("name: 3\nfoo: 1\n")
    again = error_of(problem_of(found.value))
    assert isinstance(again, MissionError)
    assert (str(again), again.faults) == (str(found.value), found.value.faults)


def test_a_witness_that_lasts_for_ever_is_told_in_plain_json_and_comes_back_as_it_was() -> None:
    witness = Witness(claim="formula", sentence="x", bound=0.5, word=(("quad0", frozenset({"a"})),), times=((1.0, math.inf),))
    told = problem_of(NotCertified("It breaks.", [witness])).model_dump_json()
    assert json.loads(told, parse_constant=pytest.fail)["witnesses"][0]["times"] == [[1.0, None]]
    again = error_of(type(problem_of(NotCertified("x", ()))).model_validate_json(told))
    assert isinstance(again, NotCertified)
    assert again.witnesses == (witness,)


def test_what_is_no_error_of_ours_is_told_without_its_words() -> None:
    told = problem_of(ValueError("secret"))
    assert (told.type, told.status) == ("/problems/internal-error", 500)
    assert "secret" not in told.detail


def test_every_kind_of_problem_has_a_sentence_and_a_class() -> None:
    for kind, sentence in kinds().items():
        assert sentence.endswith(".")
        base = problem_of(BadInput("x")).model_copy(update={"type": f"/problems/{kind}"})
        assert problem_of(error_of(base)).type == f"/problems/{kind}"
