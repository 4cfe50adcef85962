"""Login by OpenID Connect: who comes back sound has an account, and nothing else lets anybody in."""

from __future__ import annotations

import asyncio
import base64
import json
import time
from collections.abc import Callable
from urllib.parse import parse_qs, urlsplit

import httpx
import pytest
from joserfc.jwk import ECKey

from ltlplan.service.people.accounts import Account
from ltlplan.service.people.openid import OpenId
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Role
from ltlplan.service.problems import Busy, NotAuthenticated
from ltlplan.service.settings import OpenIdSettings
from tests.helpers.serving.openid_provider import CLIENT, SECRET, Provider
from verify.data import BadInput

ISSUER = "https://id.lab.example"
BACK = "https://plan.lab.example/login/openid/back"


@pytest.fixture
def provider() -> Provider:
    return Provider(ISSUER, sub="17", preferred_username="alice@lab.example", email="root@lab.example", email_verified=True)


@pytest.fixture
def openid(provider: Provider) -> OpenId:
    return OpenId(OpenIdSettings(ISSUER, CLIENT, SECRET, Role.planner), provider.transport)


def _come(openid: OpenId, provider: Provider, people: People) -> Account:
    """Log in as a browser does."""

    async def come() -> Account:
        place, browser = await openid.begin(BACK)
        return await openid.finish(_told(provider.approved(place)), browser, people)

    return asyncio.run(come())


def _told(back: str) -> dict[str, str]:
    return {name: values[0] for name, values in parse_qs(urlsplit(back).query).items()}


def test_who_comes_first_has_an_account_and_the_same_one_ever_after(openid: OpenId, provider: Provider, people: People) -> None:
    people.accounts.add("root@lab.example".partition("@")[0], Role.admin)
    account = _come(openid, provider, people)
    assert (account.name, account.role, account.issuer, account.subject) == ("alice", Role.planner, ISSUER, "17")
    assert provider.asked["code_challenge_method"] == "S256"
    assert provider.asked["scope"] == "openid profile"
    provider.person |= {"preferred_username": "root", "email": "other@lab.example"}
    assert _come(openid, provider, people) == account, "neither name nor address says who it is"
    provider.person["sub"] = "18"
    assert _come(openid, provider, people).name == "root-2", "and none leads to an account that is there"
    people.accounts.set_disabled("alice", True)
    provider.person["sub"] = "17"
    with pytest.raises(NotAuthenticated, match="'alice' is disabled"):
        _come(openid, provider, people)
    assert SECRET not in repr(openid)


def test_a_login_is_finished_once_in_the_browser_that_began_it(openid: OpenId, provider: Provider, people: People) -> None:
    async def check() -> None:
        place, browser = await openid.begin(BACK)
        back = _told(provider.approved(place))
        other, others = await openid.begin(BACK)
        for told, cookie in (
            (back, others),
            (back, browser),
            ({"code": "x"}, browser),
            ({**_told(provider.approved(other)), "iss": "https://evil"}, others),
        ):
            with pytest.raises(NotAuthenticated):
                await openid.finish(told, cookie, people)
        place, browser = await openid.begin(BACK)
        with pytest.raises(NotAuthenticated, match=r"refused: no, \?script\?"):
            await openid.finish(
                {"state": parse_qs(urlsplit(place).query)["state"][0], "error": "x", "error_description": "no, éscripté"},
                browser,
                people,
            )
        place, browser = await openid.begin(BACK)
        told = _told(provider.approved(place))
        assert (await openid.finish(told, browser, people)).name == "alice"
        with pytest.raises(NotAuthenticated, match="begin again"):
            await openid.finish(told, browser, people)

    asyncio.run(check())
    assert [each.name for each in people.accounts.all()] == ["alice"]


@pytest.mark.parametrize(
    "changes",
    [
        {"iss": "https://evil.example"}, {"iss": None}, {"aud": "another client"}, {"aud": ["another", CLIENT]}, {"aud": None}, {"nonce": "another"}, {"nonce": None},
        {"exp": int(time.time()) - 600}, {"exp": None}, {"iat": int(time.time()) + 6000}, {"sub": ""}, {"sub": None}, {"sub": 17}, {"sub": "x" * 256}, {"azp": "another"},
    ],
)  # fmt: skip
def test_what_is_said_of_somebody_else_or_some_other_time_lets_nobody_in(
    changes: dict[str, object], openid: OpenId, provider: Provider, people: People
) -> None:
    provider.changes = changes
    with pytest.raises(NotAuthenticated, match="not sound"):
        _come(openid, provider, people)
    assert people.accounts.all() == []


def _unsigned(provider: Provider, nonce: str) -> str:
    head, body, _ = Provider.signed(provider, nonce).split(".")
    del head
    none = base64.urlsafe_b64encode(json.dumps({"alg": "none"}).encode()).rstrip(b"=").decode()
    return f"{none}.{body}."


def _by_secret(provider: Provider, nonce: str) -> str:
    from joserfc import jwt
    from joserfc.jwk import OctKey

    now = int(time.time())
    claims = {"iss": ISSUER, "aud": CLIENT, "iat": now, "exp": now + 60, "nonce": nonce, **provider.person}
    return jwt.encode({"alg": "HS256", "kid": "1"}, claims, OctKey.import_key(SECRET))


def _by_another_key(provider: Provider, nonce: str) -> str:
    forger = Provider(ISSUER, **provider.person)
    forger.key = ECKey.generate_key("P-256", {"kid": "1", "use": "sig"})
    return forger.signed(nonce)


@pytest.mark.parametrize("forge", [_unsigned, _by_secret, _by_another_key, lambda _, __: "nonsense", lambda _, __: "a.b.c"])
def test_what_the_provider_did_not_sign_lets_nobody_in(
    forge: Callable[[Provider, str], str], openid: OpenId, provider: Provider, people: People, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(provider, "signed", lambda nonce: forge(provider, nonce))
    with pytest.raises(NotAuthenticated, match="not sound"):
        _come(openid, provider, people)
    assert people.accounts.all() == []


def test_a_provider_s_new_key_is_fetched(openid: OpenId, provider: Provider, people: People) -> None:
    _come(openid, provider, people)
    provider.key = ECKey.generate_key("P-256", {"kid": "2", "use": "sig"})
    assert _come(openid, provider, people).name == "alice"


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (httpx.Response(200, text="nonsense"), "cannot be read"),
        (httpx.Response(200, json=[1]), "cannot be read"),
        (httpx.Response(302, headers={"location": "http://127.0.0.1/"}), "cannot be read"),
        (httpx.Response(200, json={"issuer": "https://evil"}), "calls itself"),
        (httpx.Response(200, json={"issuer": ISSUER, "authorization_endpoint": "http://evil/"}), "is an https:// address"),
        (
            httpx.Response(200, json={"issuer": ISSUER, "authorization_endpoint": "javascript:alert(1)"}),
            "is an https:// address",
        ),
        (httpx.Response(200, content=b" " * 2_000_000), "cannot be read"),
        (httpx.ConnectError("no"), "does not answer"),
    ],
)
def test_a_provider_that_is_none_is_said_in_words(answer: httpx.Response | Exception, words: str) -> None:
    def told(_: httpx.Request) -> httpx.Response:
        if isinstance(answer, Exception):
            raise answer
        return answer

    openid = OpenId(OpenIdSettings(ISSUER, CLIENT), httpx.MockTransport(told))
    with pytest.raises((Busy, BadInput), match=words):
        asyncio.run(openid.begin(BACK))


@pytest.mark.parametrize("issuer", ["", "http://id.lab.example", "ftp://x", "id.lab.example"])
def test_a_provider_is_asked_over_tls(issuer: str) -> None:
    with pytest.raises(BadInput, match="https://"):
        OpenId(OpenIdSettings(issuer, CLIENT))
