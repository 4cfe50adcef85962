"""The service behind nginx, and behind Caddy, with TLS, by the configurations that docs/how-to/lab-server.md gives: logins, streams, sockets and other sites."""

from __future__ import annotations

import os
import re
import shutil
import socket
import ssl
import subprocess
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Role
from ltlplan.service.security.asker import COOKIE
from ltlplan.service.security.tokens import Tokens
from tests.helpers.serving.services import ONE_HOOP, serving
from tests.helpers.serving.waiting import until

pytestmark = pytest.mark.xdist_group("service")

PAGE = Path(__file__).parents[4] / "docs" / "how-to" / "lab-server.md"
PASSWORD = "twelve letters"
AROUND_NGINX = """
daemon off; pid {folder}/pid; worker_processes 1; error_log {folder}/errors; {user}
events {{ }}
http {{
access_log off; client_body_temp_path {folder}/body; proxy_temp_path {folder}/proxy; fastcgi_temp_path {folder}/f; uwsgi_temp_path {folder}/u;
scgi_temp_path {folder}/s;
{written}
}}
"""
AROUND_CADDY = """
{{
admin off
auto_https disable_redirects
}}
{written}
"""


@dataclass(frozen=True)
class Proxied:
    """A service behind a proxy.

    Attributes:
        url: Where it is reached.
        people: Its people.
        trusted: Trusts the proxy's certificate alone.
    """

    url: str
    people: People
    trusted: ssl.SSLContext

    def browser(self) -> httpx.Client:
        """Return a client that keeps cookies."""
        return httpx.Client(base_url=self.url, verify=self.trusted, headers={"origin": self.url})

    @contextmanager
    def logged_in(self, name: str) -> Generator[httpx.Client]:
        """Have a client of somebody who logged in by the page's form."""
        with self.browser() as browser:
            answer = browser.post("/login", data={"name": name, "password": PASSWORD})
            assert answer.status_code == 303, answer.text[:300]
            yield browser


def _free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def _exchanged(beginning: str, *exchanged: tuple[str, str]) -> str:
    """Return the block of the page that begins so, with words of a test's own for the page's."""
    (block,) = re.findall(rf"```\n({beginning}.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    for there, here in exchanged:
        assert block.count(there) == 1, there
        block = block.replace(there, here)
    return block


def _nginx(folder: Path, port: int, service: str) -> list[str]:
    """Write nginx's configuration, and return the command."""
    written = _exchanged(
        r"map \$http_upgrade",
        ("listen 443 ssl", f"listen 127.0.0.1:{port} ssl"),
        ("plan.lab.example;", "localhost;"),
        ("/etc/ssl/plan.lab.example.pem", f"{folder}/own.pem"),
        ("/etc/ssl/plan.lab.example.key", f"{folder}/own.key"),
        ("http://127.0.0.1:8000", service),
    )
    user = "user root;" if Path("/proc/self").stat().st_uid == 0 else ""
    (folder / "nginx.conf").write_text(AROUND_NGINX.format(folder=folder, user=user, written=written))
    return ["nginx", "-p", str(folder), "-c", str(folder / "nginx.conf")]


def _caddy(folder: Path, port: int, service: str) -> list[str]:
    """Write Caddy's configuration with a certificate of ours, which it has no network to fetch, and return the command."""
    own = f"tls {folder}/own.pem {folder}/own.key"
    written = _exchanged(
        r"plan\.lab\.example \{",
        ("plan.lab.example {", f"localhost:{port} {{\n    bind 127.0.0.1\n    {own}"),
        ("127.0.0.1:8000", service),
    )
    (folder / "Caddyfile").write_text(AROUND_CADDY.format(written=written))
    return ["caddy", "run", "--adapter", "caddyfile", "--config", str(folder / "Caddyfile")]


PROXIES = {"nginx": _nginx, "caddy": _caddy}


@pytest.fixture(scope="module", params=PROXIES)
def proxied(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Iterator[Proxied]:
    openssl = shutil.which("openssl")
    if shutil.which(request.param) is None or openssl is None:
        pytest.skip(f"there is no {request.param}, or no openssl (Debian's packages of these names)")
    folder = tmp_path_factory.mktemp(request.param)
    asked = [
        "req",
        "-x509",
        "-newkey",
        "ec",
        "-pkeyopt",
        "ec_paramgen_curve:prime256v1",
        "-nodes",
        "-days",
        "2",
        "-subj",
        "/CN=localhost",
        "-addext",
        "subjectAltName=DNS:localhost",
    ]
    made = [openssl, *asked, "-keyout", str(folder / "own.key"), "-out", str(folder / "own.pem")]
    subprocess.run(made, check=True, capture_output=True)
    data = tmp_path_factory.mktemp("service") / "data"
    data.mkdir(mode=0o700)
    people = People(Tokens(data))
    for name in ("alice", "eve"):
        people.accounts.change_password(name, people.accounts.add(name, Role.planner), PASSWORD)
    port = _free_port()
    with serving(data, names=["localhost"]) as served:
        command = PROXIES[request.param](folder, port, served.url)
        surroundings = {**os.environ, "HOME": str(folder), "XDG_DATA_HOME": str(folder), "XDG_CONFIG_HOME": str(folder)}
        with (folder / "said").open("wb") as said:
            proxy = subprocess.Popen(command, stderr=said, env=surroundings)
        trusted = ssl.create_default_context(cafile=folder / "own.pem")
        found = Proxied(f"https://localhost:{port}", people, trusted)
        try:
            assert until(lambda: _answers(found), 20.0), (folder / "said").read_text()
            yield found
        finally:
            proxy.terminate()
            proxy.wait(20)
            people.close()


def _answers(proxied: Proxied) -> bool:
    try:
        with proxied.browser() as browser:
            return browser.get("/health").status_code == 200
    except httpx.HTTPError:
        return False


def test_a_form_of_this_name_logs_in_and_one_of_another_site_does_not(proxied: Proxied) -> None:
    with proxied.logged_in("alice") as browser:
        (cookie,) = [each for each in browser.cookies.jar if each.name == COOKIE]
        assert cookie.secure
        assert browser.get("/api/account").json()["user"] == "alice"
        for origin in ("https://evil.example", "null", "https://localhost"):
            answer = browser.post("/api/jobs", content=ONE_HOOP, headers={"origin": origin, "content-type": "application/yaml"})
            assert answer.status_code == 403, origin
    with proxied.browser() as stranger:
        assert stranger.get("/api/jobs").status_code == 401
        other = stranger.get("/health", headers={"host": "evil.example"})
        assert other.status_code == 421 or other.content == b"", "nginx passes other names on; Caddy answers them with nothing"


@pytest.mark.slow
def test_a_stream_of_events_comes_as_it_is_sent(proxied: Proxied) -> None:
    with proxied.logged_in("alice") as browser:
        made = browser.post("/api/jobs", content=ONE_HOOP, headers={"content-type": "application/yaml"}).json()
        first, state = None, ""
        with browser.stream("GET", f"/api/jobs/{made['id']}/events", timeout=120.0) as stream:
            for line in stream.iter_lines():
                if line.startswith("data:"):
                    first = first or browser.get(f"/api/jobs/{made['id']}").json()["state"]
                    state = line
        assert first in ("queued", "running"), "the first event came before the job had ended"
        assert '"state":"done"' in state.replace(" ", "")


def test_a_revoked_account_s_stream_and_socket_end_within_seconds(proxied: Proxied) -> None:
    with proxied.logged_in("eve") as browser:
        browser.post("/api/jobs", content=ONE_HOOP, params={"seed": 7}, headers={"content-type": "application/yaml"})
        cookies = "; ".join(f"{each.name}={each.value}" for each in browser.cookies.jar)
        with _watching(proxied, cookies, proxied.url) as held:
            assert '"kind":"state"' in str(held.recv(timeout=10.0))
            with pytest.raises(InvalidStatus, match="403"), _watching(proxied, cookies, "https://evil.example"):
                pass
            with pytest.raises(InvalidStatus, match="403"), _watching(proxied, "", proxied.url):
                pass
            proxied.people.accounts.set_disabled("eve", disabled=True)
            began = time.monotonic()
            assert until(lambda: _is_closed(held), 20.0)
            assert time.monotonic() - began < 5.0
        assert browser.get("/api/account").status_code == 401


def _is_closed(held: ClientConnection) -> bool:
    try:
        held.recv(timeout=0.1)
    except TimeoutError:
        return False
    except ConnectionClosed:
        return True
    return False


@contextmanager
def _watching(proxied: Proxied, cookies: str, origin: str) -> Generator[ClientConnection]:
    """Have a socket that watches flights."""
    url, headers = proxied.url.replace("https", "wss"), {"cookie": cookies}
    with connect(f"{url}/api/live/lab/watch", ssl=proxied.trusted, origin=Origin(origin), additional_headers=headers) as held:
        yield held
