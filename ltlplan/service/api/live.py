"""Flights in the air: what operators tell them, and what they answer."""

from __future__ import annotations

from contextlib import nullcontext
from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response

from ltlplan.service.api.answers import LiveAnswers, LiveBegin, LiveEnd
from ltlplan.service.api.request_parsing import JSON, json_answer, json_list, principal_of, read_json, read_text, service_of
from ltlplan.service.api.schema import json_body, problems
from ltlplan.service.event_inbox.control import Act
from ltlplan.service.event_inbox.names import FLIGHT, NAME
from ltlplan.service.models import EventsAccepted, LiveEvent, LiveFlight

router = APIRouter(prefix="/api/live", tags=["live"])

LONGEST_WAIT = 25.0
"""s that a question for events may wait for one."""

Name = Annotated[str, Path(description="what the flight listens as", pattern=NAME, max_length=60)]


@router.get("", response_model=tuple[LiveFlight, ...], responses=problems())
async def list_flights(request: Request) -> Response:
    """List the flights that listen, or did: the newest of each name."""
    return json_list(await service_of(request).live.flights())


@router.get("/{name}", response_model=LiveFlight, responses=problems(404))
async def get_flight(request: Request, name: Name) -> Response:
    """Return whether a flight listens, and when it asked last."""
    return Response((await service_of(request).live.flight(name)).model_dump_json(), media_type=JSON)


@router.get("/{name}/runs", response_model=tuple[LiveFlight, ...], responses=problems())
async def list_runs(request: Request, name: Name) -> Response:
    """List all flights that are known of a name, the newest first; those that were recorded can be replayed."""
    return json_list(await service_of(request).live.runs(name))


@router.put(
    "/{name}",
    response_model=LiveFlight,
    responses={201: {"description": "It listens from now on.", "model": LiveFlight}, **problems(409, 507, body=True)},
    openapi_extra=json_body("LiveBegin", "The flight."),
)
async def begin_flight(request: Request, name: Name) -> Response:
    """Begin to listen; what `ltlplan online --follow http://.../live/NAME` does. The same flight may ask again."""
    asked = await read_json(request, LiveBegin)
    flight, new = await service_of(request).live.begin(name, asked.flight, asked.mission)
    return Response(flight.model_dump_json(), 201 if new else 200, media_type=JSON)


@router.post(
    "/{name}/events",
    response_model=EventsAccepted,
    status_code=201,
    responses={201: {"description": "They are kept, and the flight hears them."}, **problems(404, 409, 507, body=True)},
    openapi_extra={
        "requestBody": {
            "required": True,
            "description": "An event a line, as `ltlplan online --follow` has them (docs/live.md); all are taken, or none.",
            "content": {"text/plain": {"schema": {"type": "string"}, "example": "quad1 fails\nwater moves 0.3,-0.7,0.9"}},
        }
    },
)
async def tell_flight(request: Request, name: Name) -> Response:
    """Tell a flight events. When this answers they are on the disk; what the flight did with each is told by its list of events."""
    text = await read_text(request)
    told = await service_of(request).tell(principal_of(request), name, text)
    return Response(told.model_dump_json(), 201, media_type=JSON)


@router.post("/{name}/control", response_model=LiveFlight, responses=problems(404, 409))
async def control_flight(
    request: Request,
    name: Name,
    act: Annotated[Act, Query(description="take control that nobody has; offer it; accept or decline an offer; release it")],
    to: Annotated[str, Query(description="to whom control is offered", max_length=60)] = "",
) -> Response:
    """Change who is in control of a flight, and tells it events: handed on by an offer that the other pilot accepts. An admin may release it."""
    return json_answer(await service_of(request).control(principal_of(request), name, act, to))


@router.get("/{name}/events", response_model=tuple[LiveEvent, ...], responses=problems(404, 409))
async def list_events(
    request: Request,
    name: Name,
    after: Annotated[int, Query(description="only events of greater numbers", ge=0, le=2**31)] = 0,
    wait: Annotated[float, Query(description="s to wait for one, where there is none", ge=0, le=LONGEST_WAIT)] = 0.0,
    flight: Annotated[
        str | None, Query(description="the flight's own name for itself, where it is the flight that asks", pattern=FLIGHT)
    ] = None,
) -> Response:
    """List what a flight was told, with what it answered: a hundred events at most."""
    service = service_of(request)
    streams, client = request.app.state.streams, request.state.client
    if wait:
        streams.require_room(client)
    with streams.counted(client) if wait else nullcontext():
        found = await service.live.events(name, flight=flight, after=after, wait=wait, stopping=service.stopping)
    return json_list(found)


@router.post(
    "/{name}/answers",
    status_code=204,
    responses=problems(404, 409, body=True),
    openapi_extra=json_body("LiveAnswers", "What the flight did."),
)
async def answer_events(request: Request, name: Name) -> Response:
    """Return what a flight did with events; what was answered before stays."""
    asked = await read_json(request, LiveAnswers)
    await service_of(request).live.answer(name, asked.flight, asked.answers)
    return Response(status_code=204)


@router.post(
    "/{name}/end", status_code=204, responses=problems(404, 409, body=True), openapi_extra=json_body("LiveEnd", "The flight.")
)
async def end_flight(request: Request, name: Name) -> Response:
    """Stop listening; what was not heard is answered so."""
    await service_of(request).live.end(name, (await read_json(request, LiveEnd)).flight)
    return Response(status_code=204)
