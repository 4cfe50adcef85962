"""Settings of a service: its data folder, its clients, and every limit that it keeps."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ltlplan.service.people.roles import Role

LOOPBACK = "127.0.0.1"
PORT = 8000
FOR_EVER = 36_500.0
"""Days after which nothing is deleted by its age: nobody waits for these."""


@dataclass(frozen=True, slots=True)
class Rate:
    """Rate at which one client may send requests.

    Attributes:
        per_second: Requests that are regained each second.
        burst: Requests that may come at once.
    """

    per_second: float
    burst: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Bounds of a service; `docs/service.md` lists them.

    Attributes:
        queued: Jobs that may wait.
        queued_each: Of one user.
        stage_seconds: s of processor time that one stage of a job may take.
        stage_megabytes: MB of memory that one stage of a job may take.
        question_seconds: s of processor time that a short question may take, such as a check of a mission or a word.
        question_megabytes: MB of memory that a short question may take.
        questions: Short questions that are answered at the same time.
        errand_seconds: s of processor time that an errand may take: judging a recording, a recheck, an export.
        errand_megabytes: MB of memory that an errand may take.
        errands: Errands that are done at the same time.
        waiting_questions: Short questions that may wait, and as many errands.
        waiting_each: Of either, how many of one user.
        body_bytes: Bytes of a request's body.
        upload_bytes: Bytes of a body that carries files.
        held_bytes: Bytes of bodies that are held at the same time, of all clients together.
        body_seconds: s within which a whole body must have come.
        head_seconds: s within which a request's head must have come.
        send_seconds: s that a client may take to read what it was sent, before more of it follows.
        connections: Connections at the same time.
        waiting: Connections that may wait for a request at the same time; of more, those go that have waited longest.
        waiting_of_one: Of these, how many of one address.
        open_of_one: Requests and pages that one client may have open.
        streams: Streams of events at the same time.
        streams_of_one: Of these, how many of one client.
        live_flights: Flights that may listen at the same time; twice as many are kept.
        live_events: Events that one flight may be told.
        live_letters: Letters that these may have, together.
        keep_jobs_days: Days for which a job that has ended is kept where no project and no study has it.
        keep_log_days: Days for which an entry of the log is kept.
        keep_recordings_days: Days for which a flight's recording, as it was seen, is kept.
        keep_deleted_days: Days for which a job is kept that nobody refers to any more; the same mission, submitted again, finds it.
        reads: How often one client may read.
        questions_asked: How often one client may ask what is computed at once, or submit.
        strangers: How often one address may come with a wrong token; right ones always may.
        guesses: How often one address may try a password, right or wrong.
        guesses_of_account: How often a password of one account may be tried, from all addresses together.
    """

    queued: int = 1000
    queued_each: int = 500
    stage_seconds: float = 3600.0
    stage_megabytes: int = 4096
    question_seconds: float = 20.0
    question_megabytes: int = 1536
    questions: int = 2
    errand_seconds: float = 600.0
    errand_megabytes: int = 4096
    errands: int = 2
    waiting_questions: int = 100
    waiting_each: int = 50
    body_bytes: int = 1_200_000
    upload_bytes: int = 50_000_000
    held_bytes: int = 200_000_000
    body_seconds: float = 30.0
    head_seconds: float = 10.0
    send_seconds: float = 60.0
    connections: int = 500
    waiting: int = 200
    waiting_of_one: int = 100
    open_of_one: int = 200
    streams: int = 200
    streams_of_one: int = 100
    live_flights: int = 50
    live_events: int = 1000
    live_letters: int = 1_000_000
    keep_jobs_days: float = FOR_EVER
    keep_log_days: float = FOR_EVER
    keep_recordings_days: float = FOR_EVER
    keep_deleted_days: float = 0.0
    reads: Rate = Rate(100.0, 1000)
    questions_asked: Rate = Rate(20.0, 500)
    strangers: Rate = Rate(0.5, 20)
    guesses: Rate = Rate(0.2, 20)
    guesses_of_account: Rate = Rate(0.1, 20)


@dataclass(frozen=True, slots=True)
class OpenIdSettings:
    """Provider of OpenID Connect by which people log in.

    Attributes:
        issuer: Its address, as it calls itself.
        client: What it calls this service.
        secret: What it knows this service by; None where PKCE alone is enough for it.
        role: Role of those who come for the first time.
    """

    issuer: str
    client: str
    secret: str | None = field(default=None, repr=False)
    role: Role = Role.viewer


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Settings that a service is started with.

    Attributes:
        data: Folder of everything that it keeps; it is the service's own.
        host: Address that it listens on.
        port: Port that it listens on; 0 takes a free one.
        names: Names by which it may be asked besides its address, such as a proxy's; with them, tokens are needed.
        database: PostgreSQL URL of the jobs' table; None keeps it in the data folder (SQLite).
        dask: Address of a Dask scheduler; None computes on this machine.
        workers: Stages that are computed at the same time; None takes the number of processors.
        openid: How people log in by OpenID Connect; None where they do not.
        webhook_hosts: Hosts that webhooks may go to, and networks that are not public.
        limits: All bounds.
    """

    data: Path
    host: str = LOOPBACK
    port: int = PORT
    names: tuple[str, ...] = ()
    database: str | None = field(default=None, repr=False)
    dask: str | None = None
    workers: int | None = None
    openid: OpenIdSettings | None = None
    webhook_hosts: tuple[str, ...] = ()
    limits: Limits = field(default_factory=Limits)
