"""The service, put together and run: one process that serves and never computes, and processes that compute.

What can be rejected is rejected first, before anything heavy is loaded: a port in use, a folder that is not ours, a network without
tokens. Ctrl-C and SIGTERM end it in order: no new requests, streams end, workers end, and the next start goes on with the jobs.
"""

from __future__ import annotations

import asyncio
import errno
import gc
import logging
import os
import signal
import socket
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

from ltlplan.service.execution.scratch import drop_scratch, fresh_scratch
from ltlplan.service.log import begin_log, note
from ltlplan.service.people.people import People
from ltlplan.service.security.origins import is_loopback, own_names
from ltlplan.service.security.tokens import Tokens
from ltlplan.service.settings import Settings
from ltlplan.service.storage.data_folder import own_folder
from ltlplan.service.systemd import Manager
from verify.data.errors import BadInput, MissingEngine

if TYPE_CHECKING:
    from fastapi import FastAPI

    from ltlplan.service.security.middleware import Gate
    from ltlplan.service.service import Service

GRACE = 5
"""s that open requests are given when the service stops."""

SWITCH = 0.0005
"""s after which a thread that computes lets others go on; readers wait for at most a few such times, not for Python's 5 ms each."""

Announce = Callable[[str], None]


def serve(settings: Settings, *, page: bool = True, announce: Announce = print) -> None:
    """Serve until Ctrl-C or SIGTERM.

    Args:
        settings: What is served, and to whom.
        page: Whether the page is served besides the API.
        announce: Told, a sentence each, where the service is and what to know of it.

    Raises:
        BadInput: The port, the address, the data folder, the database or the Dask scheduler cannot be used, or a network is to be
            served without tokens.
        MissingEngine: The extra `service` is not installed.
    """
    with own_folder(settings.data), _listening(settings) as listener, _keeping_all():
        try:
            sys.setswitchinterval(SWITCH)
            tokens = Tokens(settings.data)
            _require_tokens(settings, tokens)
            _load_beside()
            begin_log()
            gate, service = put_together(settings, tokens, page=page)
            host, port = listener.getsockname()[:2]
            shown = f"[{host}]" if ":" in host else host
            ready = f"ltlplan serves at http://{shown}:{port}/ (API: /docs); Ctrl-C ends it. Data: {settings.data}"
            sentences = [ready] if is_loopback(settings.host) else [ready, _TLS]
            _run(gate, service, listener, lambda: [announce(sentence) for sentence in sentences])
        finally:
            drop_scratch(settings.data)
    note("stopped")


_TLS = "note: this can be reached from other machines, and tokens and passwords travel as they are: put a proxy with TLS in front (docs/service.md)."


def put_together(settings: Settings, tokens: Tokens, *, page: bool) -> tuple[Gate, Service]:
    """Return the application behind its gate, and its parts.

    Args:
        settings: What is served, and to whom.
        tokens: Who may ask.
        page: Whether the page is served besides the API.

    Raises:
        BadInput: The database or the Dask scheduler cannot be used.
        MissingEngine: The extra `service` is not installed.
    """
    try:
        from ltlplan.service.api.application import application, end_routes
        from ltlplan.service.event_inbox.flights import LiveFlights
        from ltlplan.service.execution.turns import SharedPool
        from ltlplan.service.execution.workers import LocalWorkers
        from ltlplan.service.job_queue.jobs import Jobs
        from ltlplan.service.query_pool import Questions
        from ltlplan.service.security.admission import Rules
        from ltlplan.service.security.middleware import Gate
        from ltlplan.service.service import Service
    except ModuleNotFoundError as error:
        if str(error.name).startswith("ltlplan"):
            raise
        raise MissingEngine(f"`ltlplan serve` needs {error.name}: pip install 'ltlplan[service]'.") from None
    limits = settings.limits
    scratch = fresh_scratch(settings.data)
    short = LocalWorkers(
        limits.questions,
        seconds=limits.question_seconds,
        megabytes=limits.question_megabytes,
        wall=4 * limits.question_seconds,
        scratch=scratch,
    )
    long = LocalWorkers(
        limits.errands,
        seconds=limits.errand_seconds,
        megabytes=limits.errand_megabytes,
        wall=4 * limits.errand_seconds,
        scratch=scratch,
    )
    errands = SharedPool(long)
    questions = Questions(
        SharedPool(short), errands, settings.data / "scratch", most=limits.waiting_questions, each=limits.waiting_each
    )
    jobs, people = Jobs(settings, _workers(settings, scratch), errands), People(tokens, openid=settings.openid is not None)
    service = Service(settings, jobs, questions, people, LiveFlights(settings.data, limits))
    app = application(service)
    end_routes(app, page=page)
    if page:
        _add_page(app, service)  # last: it answers every path that nothing before it has
    rules = Rules(
        people=people,
        names=own_names(settings.host, settings.names),
        everywhere=not is_loopback(settings.host),
        closed=_is_closed(settings),
        limits=limits,
        metrics=service.metrics,
    )
    return Gate(app, rules), service


def _workers(settings: Settings, scratch: Path | None) -> Any:  # what has the surface of `LocalWorkers`
    """Return where stages are computed: on a Dask cluster, or here."""
    limits = settings.limits
    if settings.dask is not None:
        from ltlplan.service.execution.clusters import Cluster

        return Cluster(settings.dask, patient=True, seconds=limits.stage_seconds, megabytes=limits.stage_megabytes)
    from ltlplan.service.execution.workers import LocalWorkers

    processors = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count()
    count = settings.workers or processors
    return LocalWorkers(count or 1, seconds=limits.stage_seconds, megabytes=limits.stage_megabytes, scratch=scratch)


def _add_page(app: FastAPI, service: Service) -> None:
    from ltlplan.service.page import add_pages

    add_pages(app, service)


def _is_closed(settings: Settings) -> bool:
    """Return whether only tokens are answered: others than this machine can ask, by themselves or through a proxy."""
    return bool(settings.names) or not is_loopback(settings.host)


def _require_tokens(settings: Settings, tokens: Tokens) -> None:
    people = People(tokens, openid=settings.openid is not None)
    needed = people.needed
    people.close()
    if _is_closed(settings) and not needed:
        why = f"--host {settings.host}" if not is_loopback(settings.host) else f"--name {settings.names[0]}"
        data = f" --data {settings.data}"
        raise BadInput(
            f"With {why} others can reach this service, so it answers to accounts and tokens only, and there are none. "
            f"Make one first: ltlplan accounts add NAME --role admin{data}, or ltlplan serve --new-token NAME{data}"
        )


def _load_beside() -> None:
    """Begin to load what workers are forked from, where a processor has nothing else to do; where none has, the first page comes first."""
    processors = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    if processors > 1 and os.getloadavg()[0] < processors / 2:
        from ltlplan.service.execution.worker_process import warm_up

        warm_up()


@contextmanager
def _keeping_all() -> Generator[None]:
    """Look for no garbage while modules are loaded: nearly all that they make stays, and looking took a sixth of the start."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


@contextmanager
def _listening(settings: Settings) -> Generator[socket.socket]:
    """Have the port before anything else is done.

    Raises:
        BadInput: It is in use, not allowed, or no address of this machine's.
    """
    host, port = settings.host, settings.port
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
        listener = socket.socket(family, kind, protocol)
    except (OSError, UnicodeError, OverflowError) as error:
        raise BadInput(
            f"--host {host}: {getattr(error, 'strerror', None) or error}; name an address of this machine."
        ) from None
    with listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind(address)
            listener.listen(1024)
        except OSError as error:
            raise BadInput(_no_port(host, port, error)) from None
        listener.setblocking(False)
        yield listener


def _no_port(host: str, port: int, error: OSError) -> str:
    if error.errno == errno.EADDRINUSE:
        return f"Port {port} of {host} is in use, perhaps by another `ltlplan serve`; name another with --port (0 takes a free one)."
    if error.errno in (errno.EACCES, errno.EPERM):
        return f"Port {port} is not allowed to you; ports from 1024 on are. Name another with --port."
    return f"{host}:{port} cannot be listened to: {(error.strerror or str(error)).lower()}."


@dataclass
class _Ended:
    """End of a server."""

    error: BaseException | None = None


def _run(gate: Gate, service: Service, listener: socket.socket, ready: Callable[[], object]) -> None:
    """Serve until a signal comes."""
    import uvicorn

    from ltlplan.service.security.connections import Waiting, with_head_clock

    limits, manager = service.settings.limits, Manager.of(os.environ)

    class Server(uvicorn.Server):
        """Stops on a signal in its own way: streams are told, the signal is not raised again."""

        @contextmanager
        def capture_signals(self) -> Generator[None, None, None]:
            kept = {number: signal.signal(number, self.handle_exit) for number in (signal.SIGINT, signal.SIGTERM)}
            try:
                yield
            finally:
                for number, handler in kept.items():
                    signal.signal(number, handler)

        def handle_exit(self, sig: int, frame: FrameType | None) -> None:
            manager.notify("STOPPING=1")
            loop.call_soon_threadsafe(service.stopping.set)
            super().handle_exit(sig, frame)

        async def startup(self, sockets: list[socket.socket] | None = None) -> None:
            await super().startup(sockets)
            if self.started:
                errors.setLevel(logging.WARNING)
                gc.freeze()
                gc.enable()
                ready()
                manager.notify("READY=1", f"STATUS=serves {service.settings.data}")

    config = uvicorn.Config(
        gate,
        http=with_head_clock(limits.head_seconds, Waiting(limits.waiting, limits.waiting_of_one), limits.connections),
        log_config=None,
        access_log=False,
        server_header=False,
        proxy_headers=bool(service.settings.names),
        timeout_keep_alive=15,
        timeout_graceful_shutdown=GRACE,
        ws_max_size=limits.body_bytes,
        lifespan="on",
    )
    errors = logging.getLogger("uvicorn.error")
    errors.setLevel(logging.CRITICAL)  # what the start fails of is told by who called
    server = Server(config)
    failed = _Ended()

    async def run() -> None:
        nonlocal loop
        loop = asyncio.get_running_loop()
        life = asyncio.create_task(manager.live())
        await server.serve(sockets=[listener])
        life.cancel()

    loop: asyncio.AbstractEventLoop
    lifespan = gate.inner

    async def noting(scope: Any, receive: Any, send: Any) -> None:
        """Keep what a start failed of, which the server itself would only note."""
        if scope["type"] != "lifespan":
            await lifespan(scope, receive, send)
            return
        try:
            await lifespan(scope, receive, send)
        except BaseException as error:
            failed.error = error
            raise

    gate.inner = noting
    try:
        asyncio.run(run())
    except SystemExit:  # its own word for a start that failed
        if failed.error is None:
            raise
    if failed.error is not None and not server.started:
        raise failed.error
