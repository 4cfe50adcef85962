"""The API as OpenAPI: the mission's own models as the schema of what is submitted, and every error said at every route."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel

from ltlplan.service.models import Problem
from ltlplan.service.problems import MEDIA_TYPE
from verify.data.files.key_synonyms import SYNONYMS
from verify.data.mission import Mission
from verify.data.shapes.region_shapes import REGION_SHAPES

_REF = "#/components/schemas/{model}"
_WHY = {
    400: "The request is not even HTTP, or its parts are broken.",
    401: "A token is needed, or this one is none of ours.",
    403: "The role is not enough, or a page of another site asked.",
    404: "There is nothing of that name.",
    405: "The path has other methods.",
    408: "The body did not come in time.",
    409: "That cannot be done as things stand.",
    413: "The body is larger than is read.",
    415: "The body is of a kind that is not read.",
    421: "The name in `Host` is not this service's.",
    422: "What was sent is wrong: the detail says what, where, and what would be right.",
    429: "Too many requests, or too many jobs wait; `Retry-After` says when to try again.",
    500: "A bug of ours.",
    501: "A library that is needed is not installed; the detail names it.",
    503: "Too much is being asked at the moment.",
    507: "The disk is full.",
}
_ALWAYS = (400, 401, 403, 421, 422, 429, 500, 503)
_CHANGING = (408, 413)
_WITH_BODY = (415,)

Responses = dict[int | str, dict[str, Any]]  # of any type: OpenAPI nests

MISSION_EXAMPLE = """\
format: 1
name: one-hoop
spec: {formula: F hoop0}
hoops:
  hoop0: {center: [1.5, 0.0, 1.2], radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}
agents:
  quad0: {start: [0.0, 0.0, 1.0]}
vehicle: crazyflie-2.1
workspace: {min: [-3, -3, 0.2], max: [3, 3, 2.5]}
"""


def problems(*statuses: int, changing: bool = False, body: bool = False) -> Responses:
    """Return what a route can answer besides its value, as problem details.

    Args:
        statuses: Its own.
        changing: Whether it is no mere reading.
        body: Whether it takes a body.
    """
    every = sorted({*_ALWAYS, *statuses, *(_CHANGING if changing or body else ()), *(_WITH_BODY if body else ())})
    return {
        status: {"description": _WHY[status], "content": {MEDIA_TYPE: {"schema": {"$ref": _REF.format(model="Problem")}}}}
        for status in every
    }


def content(media_type: str, description: str, schema: dict[str, Any] | None = None, status: int = 200) -> Responses:
    """Return what a route answers that is no value of a model.

    Args:
        media_type: Kind of content.
        description: What it is.
        schema: Of it; bytes by default.
        status: HTTP status.
    """
    given = {"type": "string", "format": "binary"} if schema is None else schema
    return {status: {"description": description, "content": {media_type: {"schema": given}}}}


def mission_body() -> dict[str, Any]:
    """Return how a mission is sent: as YAML text or as JSON, of one schema."""
    return {
        "requestBody": {
            "required": True,
            "description": "A mission, as its file holds it (docs/missions.md).",
            "content": {
                "application/yaml": {"schema": {"type": "string"}, "example": MISSION_EXAMPLE},
                "application/json": {"schema": {"$ref": _REF.format(model="Mission")}, "example": _example()},
            },
        }
    }


@cache
def _example() -> dict[str, Any]:
    from ruamel.yaml import YAML

    return YAML(typ="safe", pure=True).load(MISSION_EXAMPLE)


def json_body(model: str, description: str) -> dict[str, Any]:
    """Return how a value is sent.

    Args:
        model: Name of its schema.
        description: What it is.
    """
    schema = {"$ref": _REF.format(model=model)}
    return {"requestBody": {"required": True, "description": description, "content": {"application/json": {"schema": schema}}}}


def mission_schemas() -> dict[str, Any]:
    """Return the schemas of a mission and its parts; a vehicle may be a name there."""
    whole = Mission.model_json_schema(ref_template=_REF)
    parts = whole.pop("$defs")
    vehicle = whole["properties"]["vehicle"]
    whole["properties"]["vehicle"] = {
        "description": vehicle["description"],
        "anyOf": [{"type": "string", "examples": ["crazyflie-2.1"]}, {"$ref": _REF.format(model="Vehicle")}],
    }
    for made in (whole, parts["Agent"]):
        given = made["properties"]
        given |= {synonym: given[key] for synonym, key in SYNONYMS.items() if key in given}
    for name in REGION_SHAPES.names():  # a region has one of them; other packages' too
        shape = REGION_SHAPES.find(name)
        made = shape.adapter.json_schema(ref_template=_REF)
        parts |= made.pop("$defs", {})
        for place in ("Region", "Hoop", "Obstacle"):
            parts[place]["properties"].setdefault(name, {**made, "description": shape.meaning})
            parts[place]["required"] = [
                key for key in parts[place]["required"] if key != "center"
            ]  # some shapes say where they are
    return {"Mission": whole, **parts}


def with_schema(app: FastAPI, more: Iterable[type[BaseModel]]) -> None:
    """Let an app describe itself so, once it is asked to.

    Args:
        app: The app.
        more: What routes read by themselves.
    """

    def described() -> dict[str, Any]:
        if app.openapi_schema is None:
            made = get_openapi(
                title=app.title,
                version=app.version,
                description=app.description,
                routes=app.routes,
                tags=app.openapi_tags,
                summary=app.summary,
            )
            parts = made.setdefault("components", {})
            given = parts.setdefault("schemas", {})
            for unused in ("HTTPValidationError", "ValidationError"):
                given.pop(unused, None)
            for model in (Problem, *more):
                schema = model.model_json_schema(ref_template=_REF)
                given |= schema.pop("$defs", {})
                given[model.__name__] = schema
            given |= mission_schemas()
            parts["securitySchemes"] = {
                "token": {"type": "http", "scheme": "bearer", "description": "`ltlplan serve --new-token NAME` makes one."}
            }
            made["security"] = [{}, {"token": []}]
            app.openapi_schema = made
        return app.openapi_schema

    app.openapi = described
