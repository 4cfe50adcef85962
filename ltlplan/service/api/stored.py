"""Stored missions: versions, differences, tags and search; any version planned again."""

from __future__ import annotations

import asyncio
from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response

from ltlplan.service.api.answers import MissionChange, MissionSave, MissionStore
from ltlplan.service.api.request_parsing import JSON, json_answer, json_list, principal_of, read_json, service_of
from ltlplan.service.api.schema import content, json_body, problems
from ltlplan.service.models import Job
from ltlplan.service.people_models import MissionVersion, StoredMission

router = APIRouter(prefix="/api/stored", tags=["missions"])

Id = Annotated[int, Path(description="the mission's id", ge=1, le=2**62)]


@router.get("", response_model=tuple[StoredMission, ...], responses=problems())
async def list_stored(
    request: Request,
    search: Annotated[str, Query(description="letters that its name, owner, project, tags or text has", max_length=200)] = "",
    tag: Annotated[str | None, Query(description="only those with this tag", max_length=30)] = None,
    project: Annotated[str | None, Query(description="only those of this project", max_length=60)] = None,
) -> Response:
    """List your stored missions and those of shared projects, the ones that were changed last first."""
    missions, who = service_of(request).people.missions, principal_of(request)
    return json_list(await asyncio.to_thread(lambda: missions.listed(who, search=search, tag=tag, project=project)))


@router.post(
    "",
    response_model=StoredMission,
    status_code=201,
    responses=problems(404, 409, body=True),
    openapi_extra=json_body("MissionStore", "The mission."),
)
async def store_mission(request: Request) -> Response:
    """Store a mission, as its first version; it may have faults."""
    asked, missions, who = await read_json(request, MissionStore), service_of(request).people.missions, principal_of(request)
    made = await asyncio.to_thread(lambda: missions.store(who, asked.name, asked.text, project=asked.project, tags=asked.tags))
    return json_answer(made, 201)


@router.get("/{mission}", response_model=StoredMission, responses=problems(404))
async def get_stored(request: Request, mission: Id) -> Response:
    """Return a stored mission, without its text."""
    return json_answer(await asyncio.to_thread(service_of(request).people.missions.get, principal_of(request), mission))


@router.put(
    "/{mission}",
    response_model=StoredMission,
    responses=problems(404, 409, body=True),
    openapi_extra=json_body("MissionSave", "Its text."),
)
async def save_mission(request: Request, mission: Id) -> Response:
    """Save another version. It names the version that it was made of; where that is not the newest, somebody else saved meanwhile: 409."""
    asked, missions, who = await read_json(request, MissionSave), service_of(request).people.missions, principal_of(request)
    return json_answer(await asyncio.to_thread(lambda: missions.save(who, mission, asked.text, after=asked.after)))


@router.patch(
    "/{mission}",
    response_model=StoredMission,
    responses=problems(404, body=True),
    openapi_extra=json_body("MissionChange", "What changes."),
)
async def change_stored(request: Request, mission: Id) -> Response:
    """Put a stored mission of yours into another project, or give it other tags."""
    asked, missions, who = await read_json(request, MissionChange), service_of(request).people.missions, principal_of(request)
    return json_answer(await asyncio.to_thread(lambda: missions.change(who, mission, project=asked.project, tags=asked.tags)))


@router.delete("/{mission}", status_code=204, responses=problems(404, changing=True))
async def delete_stored(request: Request, mission: Id) -> Response:
    """Delete a stored mission of yours with all its versions; jobs that were made of it stay."""
    await asyncio.to_thread(service_of(request).people.missions.delete, principal_of(request), mission)
    return Response(status_code=204)


@router.get("/{mission}/versions", response_model=tuple[MissionVersion, ...], responses=problems(404))
async def list_versions(request: Request, mission: Id) -> Response:
    """List who stored which version when, the newest first."""
    return json_list(await asyncio.to_thread(service_of(request).people.missions.versions, principal_of(request), mission))


@router.get("/{mission}/versions/{number}", response_model=MissionVersion, responses=problems(404))
async def get_version(
    request: Request, mission: Id, number: Annotated[int, Path(description="the version's number", ge=1, le=10**6)]
) -> Response:
    """Return a version with its text."""
    return json_answer(
        await asyncio.to_thread(service_of(request).people.missions.version, principal_of(request), mission, number)
    )


@router.get(
    "/{mission}/difference",
    responses={**content("text/plain", "A unified diff; empty where nothing changed.", {"type": "string"}), **problems(404)},
    response_class=Response,
)
async def get_difference(
    request: Request,
    mission: Id,
    before: Annotated[int, Query(description="number of the one version; 0 for nothing", ge=0, le=10**6)],
    after: Annotated[int, Query(description="of the other", ge=1, le=10**6)],
) -> Response:
    """Say what changed from one version to another."""
    told = await asyncio.to_thread(
        service_of(request).people.missions.difference, principal_of(request), mission, before, after
    )
    return Response(told, media_type="text/plain; charset=utf-8")


@router.post(
    "/{mission}/versions/{number}/plan",
    response_model=Job,
    responses={201: {"description": "Accepted.", "model": Job}, **problems(404, 507, changing=True)},
)
async def plan_version(
    request: Request,
    mission: Id,
    number: Annotated[int, Path(description="the version's number", ge=1, le=10**6)],
    seed: Annotated[
        int | None, Query(description="source of every draw, instead of the mission's own", ge=0, le=2**63 - 1)
    ] = None,
) -> Response:
    """Submit any version, in the mission's project."""
    job = await service_of(request).plan_stored(principal_of(request), mission, number, seed=seed)
    return Response(job.model_dump_json(), 200 if job.found else 201, {"location": f"/api/jobs/{job.id}"}, JSON)
