"""Everything on one application: the routes, errors as problem details, documentation, and the page where it is wanted."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncGenerator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager

from fastapi import Depends, FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import RedirectResponse
from starlette.exceptions import HTTPException
from starlette.routing import Match

import ltlplan
from ltlplan.service.api import about, derived, drafts, flights, jobs, live, live_view, login, missions, people, stored, studies
from ltlplan.service.api.answers import (
    AccountAdded,
    AccountChange,
    CampaignAsked,
    LiveAnswers,
    LiveBegin,
    LiveEnd,
    MissionChange,
    MissionSave,
    MissionStore,
    ProjectChange,
    RehearsalAsked,
    StudyAsked,
    TokenAdded,
    WebhookAdded,
    WordsRequest,
)
from ltlplan.service.api.events import Streams
from ltlplan.service.api.route_actions import decide
from ltlplan.service.api.schema import with_schema
from ltlplan.service.log import note, note_bug
from ltlplan.service.models import Event
from ltlplan.service.problems import BodyTooLarge, Forbidden, MethodNotAllowed, NotFound, UnsupportedMedia
from ltlplan.service.provenance import software
from ltlplan.service.security.plain_pages import PLAIN_POLICY
from ltlplan.service.security.refusals import HTML, refusal
from ltlplan.service.service import Service
from verify.data.errors import BadInput, InternalError, LtlplanError

_TAGS = [
    {"name": "missions", "description": "Missions to start from, and a mission as it is typed."},
    {"name": "jobs", "description": "Submit a mission and follow it until it is certified and flown in simulation."},
    {"name": "studies", "description": "The same mission over values of one key, and two results side by side."},
    {"name": "files", "description": "Take away what a job made."},
    {"name": "exports", "description": "Certified flights, written for vehicles."},
    {"name": "simulate", "description": "Campaigns and rehearsals of a job's flight, as jobs."},
    {"name": "judge", "description": "Words, recorded flights and certificates, judged."},
    {"name": "live", "description": "Flights in the air: tell them events, and see what they did."},
    {"name": "people", "description": "Accounts, projects, and the log of who did what."},
    {"name": "service", "description": "The service itself."},
]
_DESCRIPTION = """\
From a sentence in temporal logic to certified quadcopter flights, as a service.

1. `GET /api/missions` has missions to start from; `POST /api/missions/check` tells all faults of yours, and its formula in words.
2. `POST /api/jobs` accepts a mission, as YAML or JSON; what was accepted is finished, also after a restart.
3. `GET /api/jobs/{job}` tells how far it is, `GET /api/jobs/{job}/events` follows it live.
4. `GET /api/jobs/{job}/report`, `/certificate`, `/files/{name}`, `/archive` and `/exports/{target}` are what it made.

Errors are problem details (RFC 9457): `detail` is what the command line prints, `exit_code` what it ends with, `faults` are all mistakes
of a mission. Where the service needs tokens, press Authorize.
"""
_OF_STATUS: dict[int, type[LtlplanError]] = {
    403: Forbidden,
    404: NotFound,
    405: MethodNotAllowed,
    413: BodyTooLarge,
    415: UnsupportedMedia,
    500: InternalError,
}

_READ = (
    WordsRequest,
    LiveBegin,
    LiveAnswers,
    LiveEnd,
    TokenAdded,
    AccountAdded,
    AccountChange,
    ProjectChange,
    MissionStore,
    MissionSave,
    MissionChange,
    StudyAsked,
    CampaignAsked,
    RehearsalAsked,
    WebhookAdded,
)
"""Values that routes read by themselves."""
_FIRST_PAGE = 0.5
"""s that the first page has to itself, before other things are loaded."""

Lifespan = Callable[[FastAPI], AbstractAsyncContextManager[None]]


def application(service: Service) -> FastAPI:
    """Return the app of a service, without its page.

    Args:
        service: The service; its jobs are started and stopped with the app.
    """

    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncGenerator[None]:
        await service.start()
        warming = asyncio.create_task(_warm(service, _app))
        try:
            yield
        finally:
            warming.cancel()
            await service.stop()
            service.live.close()
            await asyncio.to_thread(service.close)

    app = FastAPI(
        title="ltlplan",
        version=ltlplan.__version__,
        summary="Missions in, certified flights out.",
        description=_DESCRIPTION,
        openapi_tags=_TAGS,
        docs_url=None,
        redoc_url=None,
        lifespan=lifespan,
        dependencies=[Depends(decide)],
    )
    app.state.service, app.state.streams = service, Streams(service.settings.limits)
    for routes in (missions, stored, drafts, jobs, derived, studies, flights, live, live_view, people, login, about):
        app.include_router(routes.router)
    about.add_documentation(app)
    with_schema(app, (*_READ, Event))
    _tell_errors(app)
    return app


async def _warm(service: Service, app: FastAPI) -> None:
    """Have ready what the next who asks would wait for: processes to fork from, versions, the documentation. The first page goes first."""
    await asyncio.sleep(_FIRST_PAGE)
    try:
        await service.shipped_missions()
        await asyncio.to_thread(software)
        await asyncio.to_thread(app.openapi)
    except LtlplanError as error:  # whoever asks next is told
        note("not ready yet", level=logging.WARNING, reason=str(error))


def end_routes(app: FastAPI, *, page: bool) -> None:
    """Add what answers where nothing else does.

    Args:
        app: All other routes are on it.
        page: Whether a page answers at `/`.
    """

    @app.api_route("/api/{rest:path}", methods=["GET", "HEAD", "POST", "PUT", "PATCH", "DELETE"], include_in_schema=False)
    async def _nothing(request: Request, rest: str) -> Response:
        for route in app.router.routes:
            if route.matches(request.scope)[0] == Match.PARTIAL:
                raise MethodNotAllowed(
                    f"/api/{rest[:100]} does not have the method {request.method[:20]}; /docs lists what it has."
                )
        raise NotFound(f"There is no /api/{rest[:100]}; /docs lists all there is.")

    if not page:

        @app.get("/", include_in_schema=False)
        async def _first() -> Response:
            return RedirectResponse("/docs")


def _tell_errors(app: FastAPI) -> None:
    """Let every error be told as problem details."""

    async def tell(request: Request, error: Exception) -> Response:
        if request.scope["type"] == "websocket":  # the gate closes it, with the reason
            raise error
        return answer_of(request, error)

    async def tell_validation(request: Request, error: Exception) -> Response:
        assert isinstance(error, RequestValidationError)
        sentences: list[str] = []
        for item in error.errors():
            where = ".".join(str(part) for part in item["loc"])
            sentences.append(f"{where}: {str(item['msg']).rstrip('.')}, not {item.get('input')!r:.60}.")
        return answer_of(request, BadInput("\n".join(sentences)))

    async def tell_http(request: Request, error: Exception) -> Response:
        assert isinstance(error, HTTPException)
        cause = error.__cause__
        if isinstance(cause, LtlplanError):
            return answer_of(request, cause)
        kind = _OF_STATUS.get(error.status_code, BadInput)
        answer = answer_of(request, kind(str(error.detail)), error.status_code)
        answer.headers.update(error.headers or {})
        return answer

    app.add_exception_handler(LtlplanError, tell)
    app.add_exception_handler(RequestValidationError, tell_validation)
    app.add_exception_handler(HTTPException, tell_http)
    app.add_exception_handler(Exception, answer_bug)


async def answer_bug(request: Request, error: Exception) -> Response:
    """Answer what nobody expected, and note it.

    Args:
        request: Which was not answered.
        error: The bug.
    """
    note_bug(error, method=request.method, path=request.url.path[:200])
    return answer_of(request, error)


def answer_of(request: Request, error: BaseException, status: int | None = None) -> Response:
    """Return an error as an answer: a problem, or a page for people.

    Args:
        request: What was asked.
        error: What was raised.
        status: HTTP status, instead of the error's own.
    """
    told = refusal(error, request.headers, status)
    headers = (
        {**told.headers, "content-security-policy": PLAIN_POLICY} if told.headers["content-type"] == HTML else told.headers
    )
    return Response(told.content, told.status, headers)
