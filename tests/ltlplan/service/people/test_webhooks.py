"""Webhooks: only to hosts that are listed, at the very address that was looked at, signed, and until they were received."""

from __future__ import annotations

import asyncio
import base64
import hmac
import ipaddress
import json
import ssl
import threading
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from ltlplan import Client
from ltlplan.service.job_queue.job_index import Register
from ltlplan.service.job_queue.job_records import Entry
from ltlplan.service.models import Job, State
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Principal, Role
from ltlplan.service.people.webhooks import KEY, TRIES
from ltlplan.service.problems import Forbidden, NotFound
from ltlplan.service.storage.backups import DATABASES
from ltlplan.service.webhook_sender import Allowed, Sender
from tests.helpers.serving.services import serving
from verify.data import BadInput

ALICE, EVE = Principal("alice", Role.planner), Principal("eve", Role.viewer)
HOST = "hooks.lab.example"


class Receiver:
    """A receiver over TLS on this machine, whose certificate is of HOST.

    Attributes:
        got: Headers and bodies that it received.
        status: What it answers.
    """

    def __init__(self, folder: Path) -> None:
        self.got: list[tuple[dict[str, str], bytes]] = []
        self.status, self.location = 204, ""
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["content-length"]))
                outer.got.append(({name.lower(): value for name, value in self.headers.items()} | {":path": self.path}, body))
                self.send_response(outer.status)
                if outer.location:
                    self.send_header("location", outer.location)
                self.send_header("content-length", "0")
                self.end_headers()

            def log_message(self, format: str, *args: Any) -> None:  # noqa: A002  # its base's name
                del format, args

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        certificate = _certificate(folder)
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(certificate)
        self._server.socket = context.wrap_socket(self._server.socket, server_side=True)
        self.trusted = ssl.create_default_context(cafile=str(certificate))
        self.port = self._server.server_port
        threading.Thread(target=self._server.serve_forever, args=(0.01,), daemon=True).start()

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()


def _certificate(folder: Path) -> Path:
    key, name = ec.generate_private_key(ec.SECP256R1()), x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, HOST)])
    now = datetime.now(UTC)
    made = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(now - timedelta(days=1))
        .not_valid_after(now + timedelta(days=1))
        .add_extension(x509.SubjectAlternativeName([x509.DNSName(HOST)]), critical=False)
        .add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True)
        .sign(key, hashes.SHA256())
    )
    path = folder / "certificate.pem"
    form = serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    path.write_bytes(made.public_bytes(serialization.Encoding.PEM) + key.private_bytes(serialization.Encoding.PEM, *form))
    return path


@pytest.fixture
def receiver(tmp_path: Path) -> Iterator[Receiver]:
    made = Receiver(tmp_path)
    yield made
    made.close()


def ended(register: Register, job: str, state: State) -> None:
    register.add(Entry(Job(id=job, mission="m", state=state, submitted="", key=job), {"who": "alice"}))


def sender(
    people: People, receiver: Receiver, *, networks: tuple[str, ...] = ("127.0.0.0/8",), at: str = "127.0.0.1"
) -> Sender:
    async def resolve(_host: str, _port: int) -> list[str]:
        return [at]

    allowed = Allowed.read((f"{HOST}:{receiver.port}", *networks))
    return Sender(people.webhooks, Register(), allowed, resolve, receiver.trusted)


def test_the_end_of_a_job_is_sent_signed_with_id_and_state_only(people: People, receiver: Receiver) -> None:
    made = sender(people, receiver)
    webhook, secret = people.webhooks.add(ALICE, f"https://{HOST}:{receiver.port}/ci?x=1", made.allowed.hosts)
    people.webhooks.expect("alice", "job-1")
    people.webhooks.expect("bob", "job-1")
    ended(made.register, "job-1", "running")
    assert asyncio.run(made.send_due()) == 0, "it has not ended"
    made.register.drop(made.register.entry("job-1"))
    ended(made.register, "job-1", "failed")
    assert asyncio.run(made.send_due()) == 1
    ((headers, body),) = receiver.got
    assert json.loads(body) == {"id": "job-1", "state": "failed"}
    assert (headers["host"], headers[":path"]) == (f"{HOST}:{receiver.port}", "/ci?x=1")
    key = base64.b64decode(secret.removeprefix("whsec_"))
    signed = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
    assert headers["webhook-signature"] == "v1," + base64.b64encode(hmac.digest(key, signed, "sha256")).decode()
    assert people.webhooks.listed(ALICE)[0].said == "received"
    assert asyncio.run(made.send_due()) == 0, "once"
    other, another = people.webhooks.add(ALICE, webhook.url, made.allowed.hosts)
    assert another != secret
    assert other.id != webhook.id


@pytest.mark.parametrize(
    ("at", "networks"),
    [
        ("127.0.0.1", ()),
        ("10.0.0.1", ("127.0.0.0/8",)),
        ("169.254.169.254", ()),
        ("::1", ()),
        ("::ffff:127.0.0.1", ()),
        ("0.0.0.0", ()),
        ("224.0.0.1", ()),
    ],
)
def test_nothing_is_sent_to_private_addresses(people: People, receiver: Receiver, at: str, networks: tuple[str, ...]) -> None:
    made = sender(people, receiver, networks=networks, at=at)
    people.webhooks.add(ALICE, f"https://{HOST}:{receiver.port}/", made.allowed.hosts)
    people.webhooks.expect("alice", "job-1")
    ended(made.register, "job-1", "done")
    asyncio.run(made.send_due())
    assert receiver.got == []
    assert "to which nothing is sent" in people.webhooks.listed(ALICE)[0].said


def test_redirects_are_not_followed_and_what_fails_is_tried_again(people: People, receiver: Receiver) -> None:
    made = sender(people, receiver)
    people.webhooks.add(ALICE, f"https://{HOST}:{receiver.port}/", made.allowed.hosts)
    people.webhooks.expect("alice", "job-1")
    ended(made.register, "job-1", "done")
    receiver.status, receiver.location = 302, f"https://{HOST}:{receiver.port}/elsewhere"
    for tries in range(1, TRIES + 1):
        assert asyncio.run(made.send_due()) == 1
        assert len(receiver.got) == tries
        assert "status 302" in people.webhooks.listed(ALICE)[0].said
        with people.database.changing() as run:
            (due,) = run.execute("SELECT max(due) FROM webhook_calls").fetchone()
            assert (due is None) == (tries == TRIES)
            run.execute("UPDATE webhook_calls SET due = 0")
    assert people.webhooks.listed(ALICE)[0].said.startswith("given up")
    assert asyncio.run(made.send_due()) == 0
    assert {headers[":path"] for headers, _ in receiver.got} == {"/"}
    assert len({headers["webhook-id"] for headers, _ in receiver.got}) == 1


def test_another_s_certificate_is_no_receiver(people: People, receiver: Receiver) -> None:
    made = sender(people, receiver)
    made.context = ssl.create_default_context()
    people.webhooks.add(ALICE, f"https://{HOST}:{receiver.port}/", made.allowed.hosts)
    people.webhooks.expect("alice", "job-1")
    ended(made.register, "job-1", "done")
    asyncio.run(made.send_due())
    assert receiver.got == []
    assert "cannot be reached" in people.webhooks.listed(ALICE)[0].said


@pytest.mark.parametrize(
    ("url", "kind"),
    [
        (f"http://{HOST}/", BadInput),
        (f"https://a:b@{HOST}/", BadInput),
        (f"https://{HOST}/#x", BadInput),
        (f"https://{HOST}/ x", BadInput),
        ("https:///x", BadInput),
        (f"https://{HOST}:99999/", BadInput),
        (f"https://{HOST}/" + "x" * 500, BadInput),
        (f"https://{HOST}\\@evil.example/", BadInput),
        ("https://evil.example/", Forbidden),
        (f"https://{HOST}.evil.example/", Forbidden),
        (f"https://{HOST}:8443/", Forbidden),
        ("https://127.0.0.1/", Forbidden),
    ],
)
def test_only_listed_hosts_over_https_can_be_named(people: People, url: str, kind: type[Exception]) -> None:
    with pytest.raises(kind):
        people.webhooks.add(ALICE, url, (HOST,))
    assert people.webhooks.listed(ALICE) == ()


def test_a_webhook_is_its_owner_s(people: People) -> None:
    webhook, _ = people.webhooks.add(ALICE, f"https://{HOST.upper()}/", (HOST,))
    people.webhooks.expect("alice", "job-1")
    assert people.webhooks.listed(EVE) == ()
    with pytest.raises(Forbidden):
        people.webhooks.add(EVE, f"https://{HOST}/", (HOST,))
    with pytest.raises(NotFound):
        people.webhooks.delete(Principal("bob", Role.planner), webhook.id)
    people.webhooks.delete(ALICE, webhook.id)
    assert people.webhooks.due() == ()
    assert (people.database.folder / KEY).stat().st_mode & 0o777 == 0o600
    assert KEY not in DATABASES, "no backup has it"


def test_networks_are_read_and_what_is_neither_is_refused() -> None:
    assert Allowed.read(("a.example:8443", "10.1.0.0/16")).networks == (ipaddress.ip_network("10.1.0.0/16"),)
    for wrong in ("10.1.0.1/16", "a b", "https://a.example", ""):
        with pytest.raises(BadInput):
            Allowed.read((wrong,))


def test_over_http_a_webhook_is_added_listed_and_deleted(tmp_path: Path) -> None:
    with serving(tmp_path / "data", webhook_hosts=[HOST]) as served, Client(served.url) as client:
        made = client.add_webhook(f"https://{HOST}/ci")
        assert made.secret.startswith("whsec_")
        assert [each.url for each in client.webhooks()] == [f"https://{HOST}/ci"]
        with pytest.raises(Forbidden, match=r"hooks\.lab\.example"):
            client.add_webhook("https://evil.example/")
        client.delete_webhook(made.name)
        assert client.webhooks() == ()
