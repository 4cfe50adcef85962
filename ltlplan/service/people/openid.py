"""Login by OpenID Connect: authorization code with PKCE; the one door to authlib and joserfc.

Issuer and subject identify a person. An e-mail address never does: who chooses one at a provider would become somebody else. A login that was begun in one browser is
finished in that browser only (a cookie says which), once, within ten minutes.
"""

from __future__ import annotations

import asyncio
import hmac
import re
import secrets
import time
from collections import OrderedDict
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode, urlsplit

from ltlplan.service.people.accounts import Account
from ltlplan.service.people.people import People
from ltlplan.service.problems import Busy, NotAuthenticated
from ltlplan.service.security.origins import is_loopback
from ltlplan.service.settings import OpenIdSettings
from verify.data.errors import BadInput, MissingEngine

if TYPE_CHECKING:
    import httpx

BEGUN_SECONDS = 600
"""s within which a login that was begun is to be finished."""
_MOST_BEGUN = 2000
_KNOWN_SECONDS = 3600.0
"""s for which what a provider says of itself is remembered."""
_ANSWER_BYTES = 1_000_000
_ALGORITHMS = ("RS256", "RS384", "RS512", "PS256", "PS384", "PS512", "ES256", "ES384", "ES512", "Ed25519", "EdDSA")
"""Signatures that are taken: by a provider's own key, never by the client's secret, and never none."""
_LEEWAY = 60
_LONGEST_SUBJECT = 255


@dataclass(frozen=True, slots=True)
class _Begun:
    browser: str
    verifier: str
    nonce: str
    back: str
    ends: float


@dataclass
class OpenId:
    """Login by one provider.

    Attributes:
        settings: Which, and as whom we come to it.
        transport: What requests go over; the network by default.
    """

    settings: OpenIdSettings
    transport: httpx.AsyncBaseTransport | None = None
    _begun: OrderedDict[str, _Begun] = field(default_factory=OrderedDict[str, _Begun], init=False, repr=False)
    _known: dict[str, tuple[float, dict[str, Any]]] = field(
        default_factory=dict[str, tuple[float, dict[str, Any]]], init=False, repr=False
    )
    _entering: asyncio.Lock = field(default_factory=asyncio.Lock, init=False, repr=False)

    def __post_init__(self) -> None:
        if find_spec("authlib") is None:
            raise MissingEngine("Login by OpenID Connect needs authlib: pip install 'ltlplan[openid]'.")
        _require_safe(self.settings.issuer, "--openid")

    async def begin(self, back: str) -> tuple[str, str]:
        """Return where a browser is sent to log in, and a secret for its cookie, by which it is known when it comes back.

        Args:
            back: Our address that the provider sends it back to.

        Raises:
            Busy: The provider does not answer.
            BadInput: It is none.
        """
        from authlib.oauth2.rfc7636 import create_s256_code_challenge

        place = (await self._provider())["authorization_endpoint"]
        state, browser, verifier, nonce = (secrets.token_urlsafe(48) for _ in range(4))
        now = time.monotonic()
        for each in [each for each, begun in self._begun.items() if begun.ends < now]:
            del self._begun[each]
        while len(self._begun) >= _MOST_BEGUN:
            self._begun.popitem(last=False)
        self._begun[state] = _Begun(browser, verifier, nonce, back, now + BEGUN_SECONDS)
        asked = {
            "response_type": "code", "client_id": self.settings.client, "redirect_uri": back, "scope": "openid profile", "state": state, "nonce": nonce,
            "code_challenge": create_s256_code_challenge(verifier), "code_challenge_method": "S256",
        }  # fmt: skip
        return f"{place}{'&' if urlsplit(place).query else '?'}{urlencode(asked)}", browser

    async def finish(self, told: dict[str, str], browser: str, people: People) -> Account:
        """Return the account of who comes back; one who never came before has a new one.

        Args:
            told: Parameters that the browser brings.
            browser: The secret in its cookie.
            people: The people.

        Raises:
            NotAuthenticated: The login is none that was begun in this browser, the provider refused, or what it says is not sound.
            Busy: The provider does not answer.
        """
        begun = self._begun.pop(told.get("state", ""), None)
        if (
            begun is None
            or begun.ends < time.monotonic()
            or not hmac.compare_digest(begun.browser.encode(), browser.encode("utf-8", "replace"))
        ):
            raise NotAuthenticated("This login was not begun in this browser, or too long ago; begin again.")
        if told.get("iss", self.settings.issuer) != self.settings.issuer:
            raise NotAuthenticated("This login comes from another provider than it was begun with.")
        if "error" in told or not told.get("code"):
            raise NotAuthenticated(
                f"The login was refused: {_shown(told.get('error_description') or told.get('error') or 'no code')}."
            )
        claims = await self._claims(await self._token(told["code"], begun), begun)
        async with self._entering:
            return await asyncio.to_thread(self._account, claims, people)

    def _account(self, claims: dict[str, Any], people: People) -> Account:
        known = people.accounts.by_openid(self.settings.issuer, claims["sub"])
        if known is None:
            wanted = str(claims.get("preferred_username") or claims.get("name") or "").partition("@")[0]
            name = people.free_name(wanted)
            known = people.accounts.add_by_openid(name, self.settings.role, self.settings.issuer, claims["sub"])
            people.log.write(None, "add account", name, f"{self.settings.role.name}, by {self.settings.issuer}")
        if known.disabled is not None:
            raise NotAuthenticated(f"The account '{known.name}' is disabled; ask an admin of this service.")
        return known

    async def _token(self, code: str, begun: _Begun) -> dict[str, Any]:
        """Exchange a code for tokens."""
        from authlib.oauth2.auth import ClientAuth

        provider = await self._provider()
        body = {"grant_type": "authorization_code", "code": code, "redirect_uri": begun.back, "code_verifier": begun.verifier}
        methods = provider.get("token_endpoint_auth_methods_supported") or ["client_secret_basic"]
        way = (
            "none"
            if not self.settings.secret
            else "client_secret_basic"
            if "client_secret_basic" in methods
            else "client_secret_post"
        )
        auth = ClientAuth(self.settings.client, self.settings.secret, way)
        headers = {"content-type": "application/x-www-form-urlencoded", "accept": "application/json"}
        url, headers, sent = auth.prepare("POST", provider["token_endpoint"], headers, urlencode(body))
        told = await self._fetched("POST", url, content=sent, headers=dict(headers))
        if not isinstance(told.get("id_token"), str):
            raise NotAuthenticated(
                f"The login was refused: {_shown(told.get('error_description') or told.get('error') or 'no identity')}."
            )
        return told

    async def _claims(self, told: dict[str, Any], begun: _Begun) -> dict[str, Any]:
        """Return what the provider says of a person, once its signature and all else is as it must be."""
        from authlib.oidc.core import CodeIDToken
        from joserfc import jwt
        from joserfc.errors import JoseError
        from joserfc.jwk import KeySet

        provider = await self._provider()
        for fresh in (False, True):  # a provider may have new keys
            keys = await self._remembered(provider["jwks_uri"], fresh=fresh)
            try:
                token = jwt.decode(told["id_token"], KeySet.import_key_set(keys), algorithms=_ALGORITHMS)  # type: ignore[arg-type]
                must = {
                    "iss": {"essential": True, "value": self.settings.issuer},
                    "aud": {"essential": True, "value": self.settings.client},
                }
                params = {"nonce": begun.nonce, "client_id": self.settings.client, "access_token": told.get("access_token")}
                claims: Any = CodeIDToken(token.claims, token.header, must, params)
                claims.validate(leeway=_LEEWAY)
                subject = claims["sub"]
                if not isinstance(subject, str) or not 0 < len(subject) <= _LONGEST_SUBJECT:
                    raise ValueError("the subject is no name")
                return dict(claims)
            except (JoseError, ValueError, KeyError, TypeError) as error:
                if fresh:
                    raise NotAuthenticated(f"The provider's word is not sound: {_shown(type(error).__name__)}.") from None
        raise AssertionError("the second try returns or raises")

    async def _provider(self) -> dict[str, Any]:
        """Return what the provider says of itself."""
        told = await self._remembered(self.settings.issuer.rstrip("/") + "/.well-known/openid-configuration")
        if told.get("issuer") != self.settings.issuer:
            raise BadInput(f"{self.settings.issuer} calls itself {_shown(told.get('issuer'))}; name it as it calls itself.")
        for name in ("authorization_endpoint", "token_endpoint", "jwks_uri"):
            _require_safe(told.get(name), f"The provider's {name}")
        return told

    async def _remembered(self, url: str, *, fresh: bool = False) -> dict[str, Any]:
        known = self._known.get(url)
        now = time.monotonic()
        if known is None or fresh or known[0] < now:
            known = (now + _KNOWN_SECONDS, await self._fetched("GET", url))
            self._known[url] = known
        return known[1]

    async def _fetched(self, method: str, url: str, **given: Any) -> dict[str, Any]:
        """Return the table that an address of the provider answers; no redirect is followed."""
        import httpx

        try:
            async with (
                httpx.AsyncClient(timeout=10.0, transport=self.transport) as client,
                client.stream(method, url, **given) as answer,
            ):
                content = bytearray()
                async for part in answer.aiter_bytes():
                    content += part
                    if len(content) > _ANSWER_BYTES:
                        raise ValueError("too much")
                told = httpx.Response(answer.status_code, content=bytes(content)).json()
        except httpx.HTTPError as error:
            raise Busy(
                f"{urlsplit(url).netloc} does not answer, so nobody can log in by it: {type(error).__name__}.", 10.0
            ) from None
        except ValueError:
            raise Busy(f"{urlsplit(url).netloc} answers something that cannot be read.", 10.0) from None
        if not isinstance(told, dict):
            raise Busy(f"{urlsplit(url).netloc} answers something that cannot be read.", 10.0)
        return told


def _require_safe(url: object, what: str) -> None:
    """Require an address that nobody on the way can read, or change: TLS, or this machine's own.

    Raises:
        BadInput: It is none.
    """
    parts = urlsplit(url if isinstance(url, str) else "")
    if (parts.scheme == "https" and parts.netloc) or (parts.scheme == "http" and is_loopback(parts.hostname or "")):
        return
    raise BadInput(f"{what} is an https:// address, not {_shown(url)}.")


def _shown(text: object) -> str:
    """Return what somebody else said, short and printable."""
    return re.sub(r"[^\x20-\x7e]", "?", str(text))[:200].rstrip(".")
