"""Flights in the air as they are seen: two sockets, one from the flight and one for each viewer; the order to stop; and replays."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncGenerator, Coroutine
from contextlib import asynccontextmanager, suppress
from typing import Annotated, Any

from fastapi import APIRouter, Path, Query, Request, Response, WebSocket, WebSocketDisconnect
from pydantic import ValidationError

from ltlplan.service.api.live import Name
from ltlplan.service.api.request_parsing import JSON, json_answer, principal_of, read_text, service_of, who_of
from ltlplan.service.api.schema import problems
from ltlplan.service.event_inbox.names import FLIGHT
from ltlplan.service.live_view.flight_recorder import replay
from ltlplan.service.live_view.hub import Feed, Viewer
from ltlplan.service.live_view.messages import MOST_FRAME, Sent
from ltlplan.service.live_view.pictures import live_picture
from ltlplan.service.log import note
from ltlplan.service.models import StopLevel, StopReceipt
from ltlplan.service.problems import TooManyRequests
from ltlplan.service.security.rates import Rates
from ltlplan.service.service import Service
from ltlplan.service.settings import Rate
from verify.data.errors import LtlplanError

router = APIRouter(prefix="/api/live", tags=["live"])

FRAMES = Rate(15.0, 30)
"""Frames of one connection that are handed on; others are left out."""
PICTURES = Rate(1.0, 20)
"""Pictures that one connection may ask for; with more it is closed."""
_PICTURE = '{"shown":'
_NOT_TAKEN = 1008


@router.websocket("/{name}/feed")
async def feed_flight(
    socket: WebSocket, name: Name, flight: Annotated[str, Query(description="the flight's own name for itself", pattern=FLIGHT)]
) -> None:
    """Take a flight's frames and pictures, and send it orders to stop."""
    service: Service = socket.app.state.service
    listening = await service.live.listening(name, flight)
    await socket.accept()
    feed = service.live.hub.join(listening)
    try:
        async with _beside(_send_orders(socket, feed)), _closed_at(service.stopping, socket):
            await _take_all(socket, service, feed)
    except WebSocketDisconnect:
        pass
    finally:
        service.live.hub.leave(feed)


async def _take_all(socket: WebSocket, service: Service, feed: Feed) -> None:
    """Take messages until the socket closes."""
    frames, pictures, drawing = Rates(FRAMES), Rates(PICTURES), _Drawing(service, feed, str(socket.state.client))
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            return
        text: str = message.get("text") or ""  # bytes are no frame either
        if text.startswith(_PICTURE):
            try:
                pictures.take("")
            except TooManyRequests:
                await socket.close(_NOT_TAKEN, "too many pictures")
                return
            drawing.draw(text[len(_PICTURE) : -1])
            continue
        with suppress(TooManyRequests):
            frames.take("")
            if len(text) > MOST_FRAME or not _take_frame(service, feed, text):
                await socket.close(_NOT_TAKEN, "this is no frame of a flight")
                return


def _take_frame(service: Service, feed: Feed, text: str) -> bool:
    """Hand a frame on; return whether it is one."""
    try:
        frame = Sent.model_validate_json(text).frame
    except ValidationError:
        return False
    if frame is None:
        return False
    inner = frame.model_dump_json()
    service.live.hub.show(feed, frame, f'{{"kind":"frame","frame":{inner}}}')
    service.live.recorder.add(feed.flight.run, f'{{"frame":{inner}}}')
    return True


class _Drawing:
    """Pictures of one connection, drawn one after the other; the newest goes before those that wait."""

    def __init__(self, service: Service, feed: Feed, who: str) -> None:
        self._service, self._feed, self._who = service, feed, who
        self._next: str | None = None
        self._task: asyncio.Task[None] | None = None

    def draw(self, text: str) -> None:
        """Draw a picture, soon."""
        self._next = text
        if self._task is None or self._task.done():
            self._task = asyncio.get_running_loop().create_task(self._draw())

    async def _draw(self) -> None:
        while (text := self._next) is not None:
            self._next = None
            try:
                made = await self._service.questions.ask(live_picture, text, who=self._who)
            except (LtlplanError, ValidationError) as error:
                note("no picture of a flight", flight=self._feed.flight.name, reason=str(error)[:200])
                continue
            self._feed.shown = text
            self._service.live.hub.draw(self._feed, f'{{"kind":"picture","picture":{made}}}')
            self._service.live.recorder.add(self._feed.flight.run, f'{{"picture":{made}}}')


async def _send_orders(socket: WebSocket, feed: Feed) -> None:
    while True:
        await socket.send_text((await feed.next_order()).model_dump_json())


@router.websocket("/{name}/watch")
async def watch_flight(socket: WebSocket, name: Name) -> None:
    """Send what there is to see of a flight: its state, the last picture, and frames as they come, the newest where one reads slowly."""
    service: Service = socket.app.state.service
    streams, client = socket.app.state.streams, str(socket.state.client)
    streams.require_room(client)
    await socket.accept()
    viewer = service.live.hub.look(name)
    try:
        with streams.counted(client):
            async with _beside(_send_news(socket, service, viewer)), _closed_at(service.stopping, socket):
                while True:
                    await socket.receive()
                    if socket.client_state.name == "DISCONNECTED":
                        return
    except WebSocketDisconnect:
        pass
    finally:
        service.live.hub.look_away(viewer)


async def _send_news(socket: WebSocket, service: Service, viewer: Viewer) -> None:
    while True:
        await viewer.changed.wait()
        state, picture, frame = viewer.take()
        if state:
            await socket.send_text(await _state(service, viewer.name))
        for text in (picture, frame):
            if text is not None:
                await socket.send_text(text)


async def _state(service: Service, name: str) -> str:
    try:
        flight = (await service.live.flight(name)).model_dump_json()
    except LtlplanError:
        flight = "null"
    return f'{{"kind":"state","flight":{flight}}}'


@asynccontextmanager
async def _beside(work: Coroutine[Any, Any, None]) -> AsyncGenerator[None]:
    """Do something else meanwhile; that its reader went away ends it."""
    task = asyncio.get_running_loop().create_task(work)
    try:
        yield
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError, WebSocketDisconnect, OSError, RuntimeError):
            await task


@asynccontextmanager
async def _closed_at(stopping: asyncio.Event, socket: WebSocket) -> AsyncGenerator[None]:
    """Close a socket when the service is about to stop."""

    async def close() -> None:
        await stopping.wait()
        await socket.close(1001)

    async with _beside(close()):
        yield


@router.post(
    "/{name}/stop",
    response_model=StopReceipt,
    status_code=202,
    responses={
        202: {"description": "The order is on the line to the flight; frames say what became of it."},
        **problems(404, 409),
    },
)
async def stop_flight(
    request: Request,
    name: Name,
    run: Annotated[
        int, Query(description="the flight's number, as its state has it: no other flight of this name is meant", ge=0)
    ],
    level: Annotated[
        StopLevel,
        Query(
            description="`hold`: all hold where they can stop, for as long as that can last, then land; `land`; `motors`: all motors stop at once, which only who ordered a stop before may order"
        ),
    ] = "hold",
) -> Response:
    """Order all robots of a flight to hold, to land, or to stop their motors; orders only escalate.

    It passes limits, queues and a full disk, and is not heeded 2 s later any more. It is no safety function: terminal and kill switch come first.
    """
    return json_answer(service_of(request).stop_flight(principal_of(request), name, run, level), 202)


@router.post(
    "/{name}/foretell",
    response_model=tuple[str, ...],
    responses=problems(404, 409, body=True),
    openapi_extra={
        "requestBody": {
            "required": True,
            "description": "One event, as `ltlplan online --follow` has them.",
            "content": {"text/plain": {"schema": {"type": "string"}, "example": "quad1 fails"}},
        }
    },
)
async def foretell_event(request: Request, name: Name) -> Response:
    """Say what an event would do to a flight as it is now, without sending it."""
    line = await read_text(request)
    found = await service_of(request).foretell(name, line, who=who_of(request))
    return Response(json.dumps(found), media_type=JSON)


@router.get(
    "/{name}/replays/{run}",
    response_class=Response,
    responses={200: {"content": {JSON: {}}, "description": "Pictures and frames."}, **problems(404)},
)
async def replay_flight(
    request: Request, name: Name, run: Annotated[int, Path(description="the flight's number", ge=0, le=2**62)]
) -> Response:
    """Return what was seen of a flight, as viewers were sent it."""
    service = service_of(request)
    await service.live.require_run(name, run)
    made = await service.questions.ask(replay, str(service.live.recorder.path(run)), who=who_of(request))
    return Response(made, media_type=JSON, headers={"content-encoding": "gzip"})
