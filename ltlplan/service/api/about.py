"""The service itself: whether it works, and what it can be asked."""

from __future__ import annotations

import asyncio
import json
from importlib.util import find_spec
from pathlib import Path

from fastapi import APIRouter, FastAPI, Request, Response
from fastapi.responses import FileResponse, HTMLResponse

from ltlplan.service.api.answers import HealthAnswer
from ltlplan.service.api.request_parsing import JSON, service_of
from ltlplan.service.api.schema import content, problems
from ltlplan.service.limits_file import limits_told
from ltlplan.service.problems import NotFound, kinds
from verify.data.errors import MissingEngine

router = APIRouter(tags=["service"])

_SWAGGER = ("swagger-ui-bundle.js", "swagger-ui.css", "favicon.png")


@router.get("/health", response_model=HealthAnswer, responses=problems())
async def get_health(request: Request) -> Response:
    """Return whether the service works. Strangers, where tokens are needed, learn no more than that."""
    found = await service_of(request).jobs.health()
    if found.ok and (trouble := service_of(request).questions.trouble) is not None:
        found = found.model_copy(update={"ok": False, "computing": trouble})
    told = found.model_dump_json() if request.state.principal is not None else f'{{"ok":{str(found.ok).lower()}}}'
    return Response(told, 200 if found.ok else 503, media_type=JSON)


@router.get(
    "/metrics",
    responses={**content("text/plain", "Prometheus' text format.", {"type": "string"}), **problems(501)},
    response_class=Response,
)
async def get_metrics(request: Request) -> Response:
    """Return counts of requests, jobs, processes and people, for Prometheus; by a token of any role."""
    service = service_of(request)
    health = await service.jobs.health()
    text = await asyncio.to_thread(service.metrics.text, service, health)
    return Response(text, media_type=service.metrics.media_type)


@router.get(
    "/api/limits",
    responses={**content(JSON, "All limits by their names.", {"type": "object"}), **problems()},
    response_class=Response,
)
async def get_limits(request: Request) -> Response:
    """Return the limits on time, memory, sizes and rates that everybody's jobs and questions meet."""
    return Response(json.dumps(limits_told(service_of(request).settings.limits)), media_type=JSON)


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
