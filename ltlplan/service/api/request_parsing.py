"""Answers in JSON, and requests taken apart: text that is a mission, JSON with one meaning; what is of another kind is rejected by name."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TypeVar

from fastapi import Request, Response
from pydantic import BaseModel, ValidationError

from ltlplan.service.people.roles import Principal
from ltlplan.service.people.user_jobs import UserJobs
from ltlplan.service.problems import NotAuthenticated, UnsupportedMedia
from ltlplan.service.service import Service
from verify.data.errors import BadInput
from verify.data.storage.safe_reading import decoded, parse_json
from verify.data.value import faults_of

Model = TypeVar("Model", bound=BaseModel)

JSON = "application/json"
TEXTS = ("application/yaml", "application/x-yaml", "text/yaml", "text/x-yaml", "text/plain", JSON)
"""Kinds of content that a mission may come as. A page of another site could send `text/plain` unasked: `origins` refuses it."""


def json_answer(value: BaseModel, status: int = 200) -> Response:
    """Return a value as an answer in JSON."""
    return Response(value.model_dump_json(), status, media_type=JSON)


def json_list(values: Iterable[BaseModel]) -> Response:
    """Return values as an answer in JSON."""
    return Response("[" + ",".join(value.model_dump_json() for value in values) + "]", media_type=JSON)


def service_of(request: Request) -> Service:
    """Return the service that a request is put to."""
    return request.app.state.service


def who_of(request: Request) -> str:
    """Return the name under which a request is counted, as the gate knows it: a user's, or an address."""
    return str(getattr(request.state, "client", ""))


def principal_of(request: Request) -> Principal:
    """Return who asks, as the gate knows it.

    Raises:
        NotAuthenticated: A stranger does.
    """
    found: Principal | None = request.state.principal
    if found is None:
        raise NotAuthenticated("Log in first.")
    return found


def jobs_of(request: Request) -> UserJobs:
    """Return the jobs as who asks has them."""
    return service_of(request).jobs_of(principal_of(request))


def _kind(request: Request) -> str:
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


async def read_mission_text(request: Request) -> str:
    """Return the text of a mission, YAML or JSON.

    Raises:
        UnsupportedMedia: The body is of another kind.
        BadInput: It is no UTF-8 text.
    """
    kind = _kind(request)
    if kind not in ("", *TEXTS):
        raise UnsupportedMedia(f"A mission is sent as application/yaml or {JSON}, not as {kind[:60]}.")
    text = decoded(await request.body(), "The body", "mission")
    return _PAIR.sub(_joined, text) if kind == JSON else text


_PAIR = re.compile(r"(?<!\\)((?:\\\\)*)\\u(d[89ab][0-9a-f]{2})\\u(d[c-f][0-9a-f]{2})", re.IGNORECASE)
"""A character beyond 16 bits, as JSON may write it; YAML, which JSON is read as, writes it otherwise."""


def _joined(found: re.Match[str]) -> str:
    return found[1] + chr(0x10000 + ((int(found[2], 16) - 0xD800) << 10) + int(found[3], 16) - 0xDC00)


async def read_text(request: Request) -> str:
    """Return a text of lines.

    Raises:
        UnsupportedMedia: The body is of another kind.
        BadInput: It is no UTF-8 text.
    """
    kind = _kind(request)
    if kind not in ("", "text/plain"):
        raise UnsupportedMedia(f"Events are sent as text/plain, one a line, not as {kind[:60]}.")
    return decoded(await request.body(), "The body", "text")


async def read_json(request: Request, model: type[Model]) -> Model:
    """Return a body as a value.

    Args:
        request: Carries the body.
        model: What it is to be.

    Raises:
        UnsupportedMedia: The body is of another kind.
        BadInput: It is no JSON, or says something else; all faults are listed.
    """
    kind = _kind(request)
    if kind not in ("", JSON):
        raise UnsupportedMedia(f"This is sent as {JSON}, not as {kind[:60]}.")
    data = parse_json(await request.body(), "The body")
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise BadInput("\n".join(faults_of(error, "body"))) from None
