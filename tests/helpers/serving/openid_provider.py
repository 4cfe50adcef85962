"""An OpenID Connect provider for tests: what it answers, and the same over a network."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Generator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, urlencode, urlsplit

import httpx
from authlib.oauth2.rfc7636 import create_s256_code_challenge
from joserfc import jwt
from joserfc.jwk import ECKey

CLIENT = "lab"
SECRET = "s3cret of the client"


class Provider:
    """A provider at which one person is logged in.

    Attributes:
        issuer: Its address.
        person: Claims of that person.
        changes: Claims of its tokens that are others than they should be; None leaves one out.
        key: What it signs with.
        asked: What it was asked for last.
    """

    def __init__(self, issuer: str, **person: Any) -> None:
        self.issuer, self.person = issuer, person
        self.changes: dict[str, Any] = {}
        self.key = ECKey.generate_key("P-256", {"kid": "1", "use": "sig"})
        self.asked: dict[str, str] = {}
        self.codes: dict[str, dict[str, str]] = {}

    def answer(self, method: str, path: str, body: str, authorization: str) -> tuple[int, dict[str, Any]]:
        """Return the status and what is answered to a service."""
        if path == "/.well-known/openid-configuration":
            own = {"authorization_endpoint": "/authorize", "token_endpoint": "/token", "jwks_uri": "/keys"}
            return 200, {"issuer": self.issuer, **{name: self.issuer + each for name, each in own.items()}}
        if path == "/keys":
            return 200, {"keys": [self.key.as_dict(private=False)]}
        asked = {name: values[0] for name, values in parse_qs(body).items()}
        begun = self.codes.pop(asked.get("code", ""), None)
        sound = begun is not None and begun["code_challenge"] == create_s256_code_challenge(asked["code_verifier"])
        if method != "POST" or path != "/token" or not sound or begun is None or begun["redirect_uri"] != asked["redirect_uri"]:
            return 400, {"error": "invalid_grant"}
        if authorization != httpx.BasicAuth(CLIENT, SECRET)._auth_header:  # pyright: ignore[reportPrivateUsage]
            return 401, {"error": "invalid_client"}
        return 200, {"access_token": "x", "token_type": "Bearer", "id_token": self.signed(begun["nonce"])}

    def signed(self, nonce: str) -> str:
        """Return an identity token."""
        now = int(time.time())
        claims = {"iss": self.issuer, "aud": CLIENT, "iat": now, "exp": now + 60, "nonce": nonce, **self.person, **self.changes}
        return jwt.encode(
            {"alg": "ES256", "kid": self.key.kid}, {name: each for name, each in claims.items() if each is not None}, self.key
        )

    def approved(self, place: str) -> str:
        """Return where a browser is sent back to that came here."""
        self.asked = {name: values[0] for name, values in parse_qs(urlsplit(place).query).items()}
        code = f"code-{len(self.codes)}-{self.asked['state'][:8]}"
        self.codes[code] = self.asked
        return f"{self.asked['redirect_uri']}?{urlencode({'code': code, 'state': self.asked['state'], 'iss': self.issuer})}"

    @property
    def transport(self) -> httpx.MockTransport:
        """The provider without a network."""

        def answer(request: httpx.Request) -> httpx.Response:
            status, told = self.answer(
                request.method, request.url.path, request.content.decode(), request.headers.get("authorization", "")
            )
            return httpx.Response(status, json=told)

        return httpx.MockTransport(answer)


@contextmanager
def providing(**person: Any) -> Generator[Provider]:
    """Have a provider on this machine; its page has one button, which approves."""
    provider = Provider("", **person)

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:  # http.server's name
            if self.path.startswith("/authorize"):
                back = provider.approved(self.path)
                self._send(200, f'<a id="approve" href="{back.replace("&", "&amp;")}">Approve</a>'.encode(), "text/html")
            else:
                self.do_POST()

        def do_POST(self) -> None:  # http.server's name
            body = self.rfile.read(int(self.headers.get("content-length", 0))).decode()
            status, told = provider.answer(self.command, self.path, body, self.headers.get("authorization", ""))
            self._send(status, json.dumps(told).encode(), "application/json")

        def _send(self, status: int, content: bytes, kind: str) -> None:
            self.send_response(status)
            self.send_header("content-type", kind)
            self.send_header("content-length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, format: str, *args: Any) -> None:  # noqa: A002  # http.server's name
            del format, args

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    provider.issuer = f"http://127.0.0.1:{server.server_address[1]}"
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield provider
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
