"""Missions: those that are shipped, and one that is being typed."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from ltlplan.service import queries as asked
from ltlplan.service.api.answers import MissionCheck, ShippedMission
from ltlplan.service.api.request_parsing import JSON, read_mission_text, service_of, who_of
from ltlplan.service.api.schema import mission_body, problems

router = APIRouter(prefix="/api/missions", tags=["missions"])


@router.get("", response_model=list[ShippedMission], responses=problems())
async def list_shipped_missions(request: Request) -> Response:
    """List the shipped missions, with their files to start from."""
    return Response(await service_of(request).shipped_missions(), media_type=JSON)


@router.post("/check", response_model=MissionCheck, responses=problems(body=True), openapi_extra=mission_body())
async def check_mission(request: Request) -> Response:
    """Check a mission as it is typed: all faults with line and keys, or what it asks, in words.

    A mission with faults is no error here: `sound` is false, and `faults` lists them.
    """
    text = await read_mission_text(request)
    return Response(await service_of(request).questions.ask(asked.check_mission, text, who=who_of(request)), media_type=JSON)
