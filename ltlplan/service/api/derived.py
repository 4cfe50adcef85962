"""Jobs that are made of a job's flight: campaigns, rehearsals, and recordings that are kept with their verdict."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, File, Path, Query, Request, Response, UploadFile

from ltlplan.service.api.answers import CampaignAsked, RehearsalAsked
from ltlplan.service.api.flights import recording_said
from ltlplan.service.api.request_parsing import JSON, jobs_of, json_list, principal_of, read_json, service_of
from ltlplan.service.api.schema import json_body, problems
from ltlplan.service.execution.derived import RecordingKept
from ltlplan.service.models import DerivedKind, Job
from ltlplan.service.recordings import RecordingAsked, kept_name

router = APIRouter(prefix="/api/jobs/{job}", tags=["simulate"])

JobId = Annotated[str, Path(description="id of the flight's job", max_length=100)]
_MADE = {200: {"description": "There is a job for just this already; here it is.", "model": Job}}


def _made(job: Job) -> Response:
    return Response(job.model_dump_json(), 200 if job.found else 201, {"location": f"/api/jobs/{job.id}"}, JSON)


async def _simulated(request: Request, job: str, kind: DerivedKind, form: type[CampaignAsked | RehearsalAsked]) -> Response:
    options = (await read_json(request, form)).model_dump(mode="json", exclude_none=True)
    return _made(await service_of(request).simulate(principal_of(request), job, kind, options))


@router.get("/derived", response_model=tuple[Job, ...], responses=problems(404))
async def list_derived(
    request: Request, job: JobId, kind: Annotated[DerivedKind | None, Query(description="only of this kind")] = None
) -> Response:
    """List the jobs of what was made of a flight, the newest first, with what they found: exports, campaigns, rehearsals, recordings."""
    return json_list(await jobs_of(request).derived(job, kind))


@router.post(
    "/campaigns",
    response_model=Job,
    status_code=201,
    responses={**_MADE, **problems(404, 409, 507, body=True)},
    openapi_extra=json_body("CampaignAsked", "What is flown."),
)
async def begin_campaign(request: Request, job: JobId) -> Response:
    """Fly a certified flight many times in simulation, as a job: what share stayed in the tube and satisfied the formula.

    Its files are those of `ltlplan campaign`; the certificate is proved again first.
    """
    return await _simulated(request, job, "campaign", CampaignAsked)


@router.post(
    "/rehearsals",
    response_model=Job,
    status_code=201,
    responses={**_MADE, **problems(404, 409, 507, body=True)},
    openapi_extra=json_body("RehearsalAsked", "What is flown."),
)
async def begin_rehearsal(request: Request, job: JobId) -> Response:
    """Rehearse a certified flight, as a job: which controllers stay in the tube, with what mass, latency and wind.

    Its files are those of `ltlplan rehearse`; the certificate is proved again first.
    """
    return await _simulated(request, job, "rehearsal", RehearsalAsked)


@router.post(
    "/recordings",
    response_model=Job,
    status_code=201,
    responses={**_MADE, **problems(404, 409, 507, body=True)},
    tags=["judge"],
)
async def keep_recording(
    request: Request,
    job: JobId,
    recording: Annotated[UploadFile, File(description="the flight, as `/api/flights/judge` takes it")],
    said: Annotated[RecordingAsked, Depends(recording_said)],
) -> Response:
    """Judge a recorded flight and keep it with the job, as a job: its files are `verdict.json` and the recording."""
    data = await recording.read()
    return _made(await jobs_of(request).derive(job, RecordingKept(kept_name(recording.filename or "", data), said, data)))
