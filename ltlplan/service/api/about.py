"""The service itself: whether it works, what it can be asked, and how a browser says who asks."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import parse_qs

from fastapi import APIRouter, FastAPI, Request, Response
from fastapi.responses import FileResponse, HTMLResponse, RedirectResponse

from ltlplan.service.api.answers import HealthAnswer
from ltlplan.service.api.request_parsing import JSON, service_of
from ltlplan.service.api.schema import content, problems
from ltlplan.service.problems import NotAuthenticated, NotFound, TooManyRequests, kinds
from ltlplan.service.security.asker import COOKIE, LOGIN
from ltlplan.service.security.plain_pages import PLAIN_POLICY, login_page
from ltlplan.service.security.refusals import refusal
from ltlplan.service.security.sessions import SESSION_SECONDS
from verify.data.errors import MissingEngine

router = APIRouter(tags=["service"])

_SWAGGER = ("swagger-ui-bundle.js", "swagger-ui.css", "favicon.png")
_MOST_LOGIN = 4096


@router.get("/health", response_model=HealthAnswer, responses=problems())
async def get_health(request: Request) -> Response:
    """Return whether the service works. Strangers, where tokens are needed, learn no more than that."""
    found = await service_of(request).jobs.health()
    if found.ok and (trouble := service_of(request).questions.trouble) is not None:
        found = found.model_copy(update={"ok": False, "computing": trouble})
    told = found.model_dump_json() if request.scope["state"].get("known") else f'{{"ok":{str(found.ok).lower()}}}'
    return Response(told, 200 if found.ok else 503, media_type=JSON)


@router.get("/problems/{kind}", responses={**content("text/plain", "A sentence.", {"type": "string"}), **problems(404)})
async def get_problem(kind: str) -> Response:
    """Say what a kind of problem is: where `type` of a problem leads to."""
    return Response(_sentence(kind) + "\n", media_type="text/plain; charset=utf-8")


def _sentence(kind: str) -> str:
    known = kinds()
    if kind not in known:
        raise NotFound(f"'{kind[:60]}' is no kind of problem. Kinds: {', '.join(sorted(known))}.")
    return known[kind]


def add_documentation(app: FastAPI) -> None:
    """Give an app its documentation to try out, from files that are installed: nothing is fetched from elsewhere."""

    @app.get("/docs", include_in_schema=False)
    async def _page() -> Response:
        return HTMLResponse(_DOCS)

    @app.get("/docs/start.js", include_in_schema=False)
    async def _start() -> Response:
        return Response(_START, media_type="text/javascript")

    @app.get("/docs/{name}", include_in_schema=False)
    async def _asset(name: str) -> Response:
        if name not in _SWAGGER:
            raise NotFound(f"There is no '{name[:60]}' here.")
        return FileResponse(_assets() / name, headers={"cache-control": "max-age=86400"})


def _assets() -> Path:
    """Return the folder of the documentation's script; the package that brings it is not loaded."""
    spec = find_spec("fastapi_offline")
    if spec is None or spec.origin is None:
        raise MissingEngine("The documentation's page needs fastapi-offline: pip install 'ltlplan[service]'.")
    return Path(spec.origin).parent / "static"


_DOCS = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>ltlplan: the HTTP API</title><link rel="stylesheet" href="/docs/swagger-ui.css">
<link rel="icon" href="/docs/favicon.png"></head>
<body><main id="docs"></main><script src="/docs/swagger-ui-bundle.js"></script><script src="/docs/start.js"></script></body></html>
"""
_START = """SwaggerUIBundle({url: "/openapi.json", dom_id: "#docs", deepLinking: true, displayRequestDuration: true,
  defaultModelsExpandDepth: 0, validatorUrl: null, persistAuthorization: false, tryItOutEnabled: true});
"""


@router.get(LOGIN, include_in_schema=False)
async def login_form() -> Response:
    """Ask for a token."""
    return _login()


def _login(said: str = "", status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    return HTMLResponse(login_page(said), status, {"content-security-policy": PLAIN_POLICY, **(headers or {})})


@router.post(LOGIN, include_in_schema=False)
async def log_in(request: Request) -> Response:
    """Give a browser a session, for a token. The cookie holds no token, and no script can read it."""
    body = await request.body()
    given = parse_qs(body[:_MOST_LOGIN].decode("latin-1")).get("token", [""])[0].strip()
    try:
        owner = request.state.admission.owner_of(given, request.state.asker.address)
        session = await asyncio.to_thread(service_of(request).sessions.begin, owner)
    except (NotAuthenticated, TooManyRequests) as error:
        told = refusal(error, {})
        return _login(str(error), told.status, {name: value for name, value in told.headers.items() if name == "retry-after"})
    answer = RedirectResponse("/", status_code=303)
    answer.set_cookie(
        COOKIE, session, max_age=SESSION_SECONDS, httponly=True, samesite="strict", secure=request.url.scheme == "https"
    )
    return answer


@router.post("/logout", include_in_schema=False)
async def log_out(request: Request) -> Response:
    """End a browser's session, and all pages that are open in it."""
    await asyncio.to_thread(service_of(request).sessions.end, request.state.asker.session)
    answer = RedirectResponse(LOGIN, status_code=303)
    answer.delete_cookie(COOKIE, httponly=True, samesite="strict")
    return answer
