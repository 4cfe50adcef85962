"""People over HTTP: every route and role, logins, and a folder of version 0.2.0 that three people go on with."""

from __future__ import annotations

import asyncio
import itertools
import json
import tarfile
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
from fastapi import FastAPI, Request
from fastapi.routing import APIRoute, APIWebSocketRoute

from ltlplan import Client
from ltlplan.service.api.route_actions import ACTIONS, REST, decide
from ltlplan.service.people.audit_log import LogQuery
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import LEAST, Action, Principal, Role
from ltlplan.service.problems import Forbidden, NotAuthenticated, NotFound
from ltlplan.service.security.asker import COOKIE, is_open
from ltlplan.service.security.middleware import Gate
from ltlplan.service.security.tokens import Tokens
from ltlplan.service.server import put_together
from ltlplan.service.settings import Limits, OpenIdSettings, Rate, Settings
from tests.helpers.few import few_of
from tests.helpers.serving.openid_provider import CLIENT, SECRET, Provider
from tests.helpers.serving.services import ONE_HOOP, serving
from verify.data import Unsatisfiable, parse_mission

STORED = Path(__file__).parent.parent / "stored" / "data-0.2.0.tar.xz"
PASSWORD = "twelve letters"
IMPOSSIBLE = ONE_HOOP.replace("F hoop0", "F hoop0 & G !hoop0")
"""A mission whose job ends soon."""


@pytest.fixture
def gate(tmp_path: Path) -> Iterator[Gate]:
    """Yield a service's application that is not running, behind its gate."""
    limits = Limits(guesses=Rate(0.001, 6), guesses_of_account=Rate(0.001, 4))
    made, service = put_together(Settings(data=tmp_path, limits=limits, workers=1), Tokens(tmp_path), page=False)
    service.live.open()
    service.people.references.load()
    yield made
    service.live.close()
    service.close()


class _Browser:
    """A client of the gate that keeps cookies."""

    def __init__(self, gate: Gate, address: str = "10.1.1.1") -> None:
        self.gate, self.address, self.cookies = gate, address, httpx.Cookies()

    def ask(self, method: str, path: str, **given: Any) -> httpx.Response:
        async def asked() -> httpx.Response:
            transport = httpx.ASGITransport(self.gate, client=(self.address, 1), raise_app_exceptions=False)  # type: ignore[arg-type]
            async with httpx.AsyncClient(transport=transport, base_url="http://localhost", cookies=self.cookies) as client:
                answer = await client.request(method, path, **given)
                self.cookies = client.cookies
                return answer

        return asyncio.run(asked())

    def log_in(self, name: str, password: str, **given: Any) -> httpx.Response:
        return self.ask("POST", "/login", data={"name": name, "password": password}, **given)


def _routes(app: FastAPI) -> set[tuple[str, str]]:
    """Return every method and path that the application answers."""
    found: set[tuple[str, str]] = set()
    for method, path in (
        (method, route.path)
        for route in _all(app.router.routes)
        for method in getattr(route, "methods", None) or ("WEBSOCKET",)
    ):
        if path not in (REST, "/openapi.json"):
            found.add((method, path))
    return found


def _all(routes: Any, prefix: str = "") -> Iterator[APIRoute | APIWebSocketRoute]:
    for route in routes:
        if isinstance(route, APIRoute | APIWebSocketRoute):
            yield route
        elif hasattr(route, "original_router"):
            yield from _all(route.original_router.routes)


def test_every_route_asks_for_an_action_and_no_action_is_of_a_route_that_is_gone(gate: Gate) -> None:
    assert isinstance(gate.inner, FastAPI)
    assert _routes(gate.inner) == set(ACTIONS)
    for (_, path), action in ACTIONS.items():
        assert (action is Action.OPEN) == is_open(path.replace("{", "").replace("}", "")), path


def test_every_route_is_answered_to_its_roles_and_no_others(gate: Gate) -> None:
    people: People = gate.rules.people
    roles: list[Role | None] = [None, *Role]
    headers = {
        role: {} if role is None else {"authorization": f"Bearer {people.tokens.new(role.name, role=role.name)}"}
        for role in roles
    }
    for ((method, path), action), role in itertools.product(ACTIONS.items(), roles):
        least = LEAST[action]
        if least is None or (role is not None and role >= least):
            asyncio.run(decide(_asked(method, path, role)))
            continue
        plain = path.replace("{name:path}", "x").replace("{", "").replace("}", "")
        if method == "WEBSOCKET":
            assert _first_of_socket(gate, plain, headers[role])["type"] == "websocket.close", (path, role)
            continue
        answer = _Browser(gate).ask(method, plain, headers=headers[role])
        refused = (401, "not-authenticated") if role is None else (403, "forbidden")
        assert (answer.status_code, answer.json()["type"].rpartition("/")[2]) == refused, (method, path, role)


def _first_of_socket(gate: Gate, path: str, headers: dict[str, str]) -> dict[str, Any]:
    """Ask for a socket, and return what comes first."""
    came: list[dict[str, Any]] = []

    async def receive() -> dict[str, Any]:
        return {"type": "websocket.connect"}

    async def send(message: Any) -> None:
        came.append(dict(message))

    named = [(name.encode(), value.encode()) for name, value in {"host": "localhost", **headers}.items()]
    scope = {
        "type": "websocket",
        "path": path,
        "headers": named,
        "client": ("127.0.0.1", 1),
        "query_string": b"",
        "subprotocols": [],
    }
    asyncio.run(gate(scope, receive, send))
    return came[0]


def _asked(method: str, path: str, role: Role | None) -> Request:
    """Return a request as the gate passes it on."""
    principal = None if role is None else Principal("somebody", role)
    route = SimpleNamespace(path=path)
    return Request({"type": "http", "method": method, "route": route, "headers": [], "state": {"principal": principal}})


def test_a_route_that_was_forgotten_is_answered_to_nobody(gate: Gate) -> None:
    assert isinstance(gate.inner, FastAPI)
    routes = gate.inner.router.routes
    rest = next(route for route in routes if getattr(route, "path", "") == REST)
    routes.remove(rest)
    gate.inner.add_api_route("/api/forgotten", lambda: "secret")
    answer = _Browser(gate, "127.0.0.1").ask("GET", "/api/forgotten")
    assert (answer.status_code, answer.json()["detail"]) == (403, "No role may do this.")


def test_somebody_logs_in_by_a_temporary_password_and_chooses_another(gate: Gate) -> None:
    people: People = gate.rules.people
    password = people.accounts.add("alice", Role.planner)
    browser = _Browser(gate)
    assert 'name="password"' in browser.ask("GET", "/login").text
    asked = browser.log_in("alice", password)
    assert (asked.status_code, "drawn for you" in asked.text, dict(browser.cookies)) == (200, True, {})
    assert browser.ask("GET", "/api/account").status_code == 401
    fields = {"name": "alice", "password": password, "new": PASSWORD, "again": PASSWORD}
    assert browser.ask("POST", "/password", data={**fields, "again": "x"}).status_code == 422
    changed = browser.ask("POST", "/password", data=fields)
    cookie = changed.headers["set-cookie"]
    assert (changed.status_code, changed.headers["location"]) == (303, "/")
    assert {"HttpOnly", "SameSite=strict"} <= set(cookie.split("; "))
    assert browser.ask("GET", "/api/account").json() == {"user": "alice", "role": "planner", "token": "", "tokens": []}
    second = _Browser(gate)
    over_tls = second.ask("POST", "https://localhost/login", data={"name": "alice", "password": PASSWORD})
    assert "Secure" in over_tls.headers["set-cookie"]
    browser.ask("POST", "/logout")
    assert browser.ask("GET", "/api/account").status_code == 401
    assert [entry.action for entry in people.log.entries()] == ["log out", "log in", "log in", "change password"]


def test_guesses_run_out_for_an_address_and_for_an_account(gate: Gate) -> None:
    people: People = gate.rules.people
    people.accounts.change_password("alice", people.accounts.add("alice", Role.planner), PASSWORD)
    people.accounts.add("bob", Role.planner)
    browser = _Browser(gate)
    statuses = [browser.log_in("alice", f"guess number {i}").status_code for i in range(5)]
    assert statuses == [401] * 4 + [429]
    limited = browser.log_in("alice", PASSWORD)
    assert (limited.status_code, int(limited.headers["retry-after"]) > 1) == (429, True)
    assert [browser.log_in(f"other{i}", "a guess of it").status_code for i in range(2)] == [429] * 2, (
        "this address has asked enough"
    )
    elsewhere = _Browser(gate, "10.1.1.2")
    assert elsewhere.log_in("ALICE", "another guess").status_code == 429, "and this account, by other addresses and letters"
    assert elsewhere.log_in("bob", "another guess").status_code == 401
    assert [(entry.action, entry.object) for entry in people.log.entries(LogQuery(limit=2))] == [
        ("log in refused", "bob"),
        ("log in refused", "alice"),
    ]


@few_of(
    4,
    "body",
    [b"", b"name", b"name=&password=", b"&" * 4000, b"name=%ff%00&password=%00", b"\xff" * 100, b"name=" + b"a" * 5000],
)
def test_hostile_forms_are_no_logins_and_no_bugs(body: bytes, gate: Gate) -> None:
    people: People = gate.rules.people
    people.accounts.add("alice", Role.planner)
    form = {"content-type": "application/x-www-form-urlencoded"}
    for path in ("/login", "/password"):
        assert _Browser(gate).ask("POST", path, content=body, headers=form).status_code in (401, 422)


@pytest.mark.parametrize(
    "headers",
    [{"origin": "http://evil.example"}, {"origin": "null"}, {"sec-fetch-site": "cross-site"}, {"sec-fetch-site": "same-site"}],
)
def test_another_site_s_page_changes_nothing_in_somebody_s_name(headers: dict[str, str], gate: Gate) -> None:
    people: People = gate.rules.people
    people.accounts.change_password("root", people.accounts.add("root", Role.admin), PASSWORD)
    browser = _Browser(gate)
    assert browser.log_in("root", PASSWORD, headers=headers).status_code == 403
    browser.cookies.set(COOKIE, people.sessions.begin_of_account("root"))
    for method, path in ((method, path) for method, path in ACTIONS if method not in ("GET", "WEBSOCKET")):
        asked = browser.ask(method, path.replace("{name}", "root").replace("{", "").replace("}", ""), headers=headers)
        assert (asked.status_code, "another site" in asked.text) == (403, True), (method, path)


def test_an_admin_s_work_over_http(gate: Gate) -> None:
    people: People = gate.rules.people
    people.accounts.add("root", Role.admin)
    browser = _Browser(gate)
    browser.cookies.set(COOKIE, people.sessions.begin_of_account("root"))
    made = browser.ask("POST", "/api/accounts", json={"name": "eve", "role": "viewer"})
    assert (made.status_code, made.json()["name"]) == (201, "eve")
    assert browser.ask("POST", "/api/accounts", json={"name": "eve"}).status_code == 409
    assert browser.ask("POST", "/api/accounts", json={"name": "x", "role": "god"}).status_code == 422
    session = people.sessions.begin_of_account("eve")
    assert browser.ask("PATCH", "/api/accounts/eve", json={"role": "pilot", "disabled": True}).json()["role"] == "pilot"
    assert people.of_session(session) is None
    assert browser.ask("POST", "/api/accounts/eve/password").json()["secret"] != made.json()["secret"]
    assert browser.ask("DELETE", "/api/accounts/eve/sessions").status_code == 204
    assert browser.ask("PATCH", "/api/accounts/root", json={"disabled": True}).status_code == 409
    assert [each["name"] for each in browser.ask("GET", "/api/accounts").json()] == ["eve", "root"]
    token = browser.ask("POST", "/api/account/tokens", json={"label": "ci"}).json()
    program = {"authorization": f"Bearer {token['secret']}"}
    assert _Browser(gate).ask("GET", "/api/account", headers=program).json()["token"] == "root.ci"
    assert _Browser(gate).ask("POST", "/api/account/tokens", headers=program, json={"label": "more"}).status_code == 403
    assert browser.ask("DELETE", "/api/account/tokens/root.ci").status_code == 204
    assert _Browser(gate).ask("GET", "/api/account", headers=program).status_code == 401
    assert browser.ask("PUT", "/api/projects/show", json={"shared": True}).json()["shared"]
    logged = browser.ask("GET", "/api/log?limit=1").json()
    assert (logged[0]["action"], logged[0]["object"], logged[0]["user"]) == ("share", "show", "root")
    others = people.sessions.begin_of_account("root")
    assert browser.ask("DELETE", "/api/account/sessions").status_code == 204
    assert people.of_session(others) is None
    assert browser.ask("GET", "/api/account").status_code == 200, "who logs out elsewhere stays"


def test_a_browser_comes_back_from_the_lab_s_own_login(tmp_path: Path) -> None:
    provider = Provider("https://id.lab.example", sub="17", name="Alice")
    settings = Settings(data=tmp_path, openid=OpenIdSettings(provider.issuer, CLIENT, SECRET), workers=1)
    gate, service = put_together(settings, Tokens(tmp_path), page=False)
    assert service.openid is not None
    service.openid.transport = provider.transport
    browser = _Browser(gate)
    assert browser.ask("GET", "/api/account").status_code == 401, "a service with such a login is open to nobody else"
    assert 'href="/login/openid"' in browser.ask("GET", "/login").text
    begun = browser.ask("GET", "/login/openid")
    assert {"HttpOnly", "SameSite=lax", "Path=/login/openid/back"} <= set(begun.headers["set-cookie"].split("; "))
    assert begun.headers["location"].startswith("https://id.lab.example/authorize?")
    back = provider.approved(begun.headers["location"]).removeprefix("http://localhost")
    elsewhere = _Browser(gate).ask("GET", back)
    assert (elsewhere.status_code, "begin again" in elsewhere.text) == (401, True)
    assert browser.ask("GET", back).status_code == 401, "a login is tried once"
    begun = browser.ask("GET", "/login/openid")
    entered = browser.ask("GET", provider.approved(begun.headers["location"]).removeprefix("http://localhost"))
    assert (entered.status_code, "url=/" in entered.text) == (200, True)
    assert any("SameSite=strict" in each and "HttpOnly" in each for each in entered.headers.get_list("set-cookie"))
    assert browser.ask("GET", "/api/account").json()["user"] == "Alice"
    for path in ("/login/openid/back", "/login/openid/back?state=x&code=y", "/login/openid/back?error=%3Cscript%3E&state=x"):
        refused = browser.ask("GET", path)
        assert (refused.status_code, "<script>" in refused.text) == (401, False)
    service.close()
    (tmp_path / "plain").mkdir()
    plain, other = put_together(Settings(data=tmp_path / "plain", workers=1), Tokens(tmp_path / "plain"), page=False)
    assert _Browser(plain, "127.0.0.1").ask("GET", "/login/openid").status_code == 404
    other.close()


@pytest.mark.slow  # older databases are brought to this version in test_full_disks
def test_a_folder_of_version_0_2_0_goes_on_and_three_people_share_it(tmp_path: Path) -> None:
    data = tmp_path / "data"
    with tarfile.open(STORED) as packed:
        packed.extractall(data, filter="data")
    kept = json.loads((data / "secrets.json").read_text())
    lasting = json.loads((data / "sessions.json").read_text())
    for session in lasting["sessions"].values():
        session["ends"] = time.time() + 1000
    (data / "sessions.json").write_text(json.dumps(lasting))
    carols = Tokens(data).new("carol", role="viewer")
    with serving(data) as served, ExitStack() as clients:
        cookie = {"cookie": f"{COOKIE}={kept['session']}"}
        assert httpx.get(served.url + "/api/account", headers=cookie).json()["user"] == "bob", "who was logged in still is"
        alice, bob, carol = (
            clients.enter_context(Client(served.url, token=token)) for token in (kept["alice"], kept["bob"], carols)
        )
        assert bob.whoami().role == "pilot"
        before = {kept["done"]: "done", kept["failed"]: "failed", kept["cancelled"]: "cancelled"}
        seen = {job.id: job.job for job in carol.jobs()}
        assert {job: seen[job].state for job in before} == before
        assert {job: seen[job].owner for job in before} == {
            kept["done"]: "alice",
            kept["failed"]: "bob",
            kept["cancelled"]: "alice",
        }
        assert {job.project for job in seen.values()} == {"earlier"}
        assert json.loads(carol.job(kept["done"]).file("certificate.json"))["claims"]
        assert alice.job(kept["waiting"]).state in ("queued", "running", "done"), "it goes on"
        assert alice.cancel(kept["waiting"]).state in ("cancelled", "done")
        assert [event.line for event in bob.events("lab")] == ["quad0 fails"]
        for forbidden in (
            lambda: carol.submit_text(ONE_HOOP),
            lambda: carol.delete(kept["done"]),
            lambda: bob.delete(kept["done"]),
        ):
            with pytest.raises(Forbidden):
                forbidden()
        mine = bob.submit_text(IMPOSSIBLE, seed=9, project="bob's")
        for ask in (lambda: alice.job(mine.id), lambda: alice.cancel(mine.id), lambda: alice.delete(mine.id)):
            with pytest.raises(NotFound):
                ask()
        with pytest.raises(Unsatisfiable):
            mine.wait()
        assert mine.job.project == "bob's"
        also = alice.submit_text(IMPOSSIBLE, seed=9)
        assert (also.id, also.job.owner) == (mine.id, "alice")
        bob.delete(mine)
        assert also.refreshed().state == "failed"
        bob.share_project("bob's")
        bob.submit_text(IMPOSSIBLE, seed=9, project="bob's")
        alice.delete(also)
        assert carol.job(mine.id).job.owner == "bob"
        for i in range(20):
            assert httpx.request(
                f"M{i}", f"{served.url}/nothing/{i}", headers={"authorization": f"Bearer {carols}"}
            ).status_code in (404, 405)
        counted = {
            line.rpartition(" ")[0]: float(line.rpartition(" ")[2])
            for line in carol.metrics().splitlines()
            if not line.startswith("#")
        }
        assert counted['ltlplan_jobs{state="failed"}'] == 2
        assert counted["ltlplan_healthy"] == counted["ltlplan_workers"] == 1
        assert counted['ltlplan_requests_total{method="DELETE",route="/api/jobs/{job}",status="403"}'] == 2
        assert counted['ltlplan_requests_total{method="other",route="other",status="404"}'] == 20, (
            "nobody makes counts by what they ask"
        )
        assert counted['ltlplan_request_seconds_count{method="GET",route="/api/jobs"}'] >= 1
        assert not any(secret in " ".join(counted) for secret in (carols, mine.id, "alice", "bob"))
        assert httpx.get(served.url + "/metrics").status_code == 401
        bob.send_events("lab", "quad1 fails")
        stored = alice.store_mission("patrol", IMPOSSIBLE, project="earlier")
        assert carol.stored_missions("patrol")[0].owner == "alice", "what came after 0.2.0 is there, too"
        study = alice.study(parse_mission(IMPOSSIBLE), "seed", [1, 2], project="earlier")
        assert [member.value for member in carol.wait_study(study).members] == [1, 2]
        assert alice.keep_draft("patrol", stored.name) in alice.drafts()
        assert carol.drafts() == ()
        Tokens(data).revoke("carol")
        with pytest.raises(NotAuthenticated):
            carol.jobs()
    people = People(Tokens(data))
    assert [(each.user, each.action) for each in people.log.entries() if each.action != "cancel"] == [
        ("alice", "study"), ("alice", "submit"), ("alice", "submit"), ("alice", "store"), ("bob", "tell"),
        ("alice", "delete"), ("bob", "submit"), ("bob", "share"), ("bob", "delete"), ("alice", "submit"), ("bob", "submit"),
    ]  # fmt: skip
    people.close()
