"""Jobs: submit a mission, follow it, take away what it made."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Header, Path, Query, Request, Response
from fastapi.responses import FileResponse, StreamingResponse

from ltlplan.service import queries as asked
from ltlplan.service.api import events
from ltlplan.service.api.answers import ExportFormat, PlanAnswer
from ltlplan.service.api.request_parsing import JSON, jobs_of, read_mission_text, service_of, who_of
from ltlplan.service.api.schema import content, mission_body, problems
from ltlplan.service.execution.exporting import ExportAsked
from ltlplan.service.models import FileEntry, Job, State, Whose
from ltlplan.service.problems import Conflict, error_of
from ltlplan.service.security.origins import require_own_page
from ltlplan.service.service import places, planned, proof_places

router = APIRouter(prefix="/api", tags=["jobs"])

ZIP, YAML = "application/zip", "application/yaml"
WAIT = 30.0
"""s that the answer to an export may wait for it: less than clients wait."""
PAGES = {"campaign": "campaign.html", "rehearsal": "rehearsal.html"}
"""Reports of what is made of a flight."""
REPORT_POLICY = (
    "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob: data:; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; connect-src data: blob:; worker-src blob:; "
    "frame-ancestors 'self'"
)
"""What the report may do: run its own script as nobody in particular, and fetch nothing."""

Project = Annotated[
    str | None,
    Query(description="name of a project; it is made where there is none, and private until it is shared", max_length=60),
]
JobId = Annotated[str, Path(description="the job's id", max_length=100)]


def _told(job: Job, status: int = 200) -> Response:
    headers = {"location": f"/api/jobs/{job.id}"} if status in (201, 202) else {}
    if status == 202:
        headers["retry-after"] = "1"
    return Response(job.model_dump_json(), status, headers, JSON)


@router.post(
    "/jobs",
    response_model=Job,
    responses={
        200: {"description": "There is a job for just this already; here it is.", "model": Job},
        201: {"description": "Accepted: it will be finished, whatever happens to this service meanwhile."},
        **problems(507, body=True),
    },
    status_code=201,
    openapi_extra=mission_body(),
)
async def submit_job(
    request: Request,
    seed: Annotated[
        int | None, Query(description="source of every draw, instead of the mission's own", ge=0, le=2**63 - 1)
    ] = None,
    pace: Annotated[
        str | None,
        Query(
            description="instead of the mission's: a share of the fastest flight, above 0 up to 1, or `nominal`", max_length=30
        ),
    ] = None,
    project: Project = None,
) -> Response:
    """Submit a mission: it is planned, refined, proved, flown in simulation, and its files are written.

    The same mission, seed and version are computed once: who asks again is given the same job, and so is everybody else. It is listed for those who submitted it,
    and in shared projects.
    """
    from ltlplan.planner import pace_of, with_pace

    service = service_of(request)
    mission = await service.mission(await read_mission_text(request), who=who_of(request))
    mission = await asyncio.to_thread(with_pace, mission, pace_of(pace))
    job = await jobs_of(request).submit(mission, seed=seed, project=project)
    return _told(job, 200 if job.found else 201)


@router.get("/jobs", response_model=list[Job], responses=problems())
async def list_jobs(
    request: Request,
    state: Annotated[State | None, Query(description="only jobs in this state")] = None,
    limit: Annotated[int, Query(description="at most so many", ge=1, le=500)] = 50,
    before: Annotated[
        str | None, Query(description="only jobs that were submitted before the job of this id", max_length=100)
    ] = None,
    whose: Annotated[
        Whose, Query(description="yours and those of shared projects, yours alone, or for an admin everybody's")
    ] = "visible",
    project: Project = None,
    search: Annotated[str, Query(description="letters that name, formula, id, owner or project has", max_length=200)] = "",
) -> Response:
    """List jobs, the newest first, without what their stages found."""
    found = await jobs_of(request).jobs(state=state, limit=limit, before=before, whose=whose, project=project, search=search)
    return Response("[" + ",".join(job.model_dump_json() for job in found) + "]", media_type=JSON)


@router.get("/jobs/{job}", response_model=Job, responses=problems(404))
async def get_job(request: Request, job: JobId) -> Response:
    """Return how far a job has come, with what each stage found."""
    return _told(await jobs_of(request).job(job))


@router.delete("/jobs/{job}", status_code=204, responses=problems(404, 409, changing=True))
async def delete_job(request: Request, job: JobId) -> Response:
    """Take a job off your list. One that nobody else has is deleted with its files, once it has ended."""
    await jobs_of(request).delete(job)
    return Response(status_code=204)


@router.post("/jobs/{job}/project", response_model=Job, responses=problems(404, 409, changing=True))
async def move_job(
    request: Request,
    job: JobId,
    project: Annotated[str, Query(description="the project's name; empty for none", max_length=60)],
) -> Response:
    """Put a job of yours into a project, or into none."""
    return _told(await jobs_of(request).move(job, project))


@router.post("/jobs/{job}/cancel", response_model=Job, responses=problems(404, changing=True))
async def cancel_job(request: Request, job: JobId) -> Response:
    """End a job at once; one that has ended stays as it is, and one that others have too goes on."""
    return _told(await jobs_of(request).cancel(job))


@router.post("/jobs/{job}/stop", response_model=Job, responses=problems(404, 409, changing=True))
async def stop_search(request: Request, job: JobId) -> Response:
    """End a job's search with the best plan so far, which is refined and certified; the job is then an attempt that answers nobody else."""
    return _told(await jobs_of(request).stop_search(job))


@router.get(
    "/jobs/{job}/events",
    response_class=StreamingResponse,
    responses={
        **content(events.MEDIA_TYPE, "One event a change, until the job has ended; `data` is an `Event`.", events.SCHEMA),
        204: {"description": "The job has ended, and nothing came after that event."},
        **problems(404),
    },
)
async def follow_job(
    request: Request,
    job: JobId,
    after: Annotated[int, Query(description="only events after this one", ge=0)] = 0,
    last_event_id: Annotated[int | None, Header(description="the same, as browsers send it", ge=0)] = None,
) -> Response:
    """Follow a job by server-sent events: stages, rounds, costs, claim by claim. What was missed is told again."""
    service, streams = service_of(request), request.app.state.streams
    streams.require_room(request.state.client)
    found = jobs_of(request).events((await jobs_of(request).job(job)).id, after=max(after, last_event_id or 0))
    first = await anext(found, None)
    if first is None:
        return Response(status_code=204)
    return StreamingResponse(
        _counted(streams, request.state.client, events.stream(first, found, service.stopping)),
        media_type=events.MEDIA_TYPE,
        headers={"x-accel-buffering": "no"},
    )


async def _counted(streams: events.Streams, client: str, chunks: AsyncIterator[bytes]) -> AsyncIterator[bytes]:
    """Pass a stream on, and count it while it is open."""
    with streams.counted(client):
        async for chunk in chunks:
            yield chunk


@router.get("/jobs/{job}/files", response_model=tuple[FileEntry, ...], responses=problems(404), tags=["files"])
async def list_files(request: Request, job: JobId) -> Response:
    """List what a job has made."""
    found = await jobs_of(request).job(job)
    return Response("[" + ",".join(entry.model_dump_json() for entry in found.files) + "]", media_type=JSON)


@router.get(
    "/jobs/{job}/files/{name:path}",
    response_class=FileResponse,
    responses={
        **content("*/*", "The file."),
        206: {"description": "The part of it that was asked for."},
        304: {"description": "It is what was fetched before."},
        416: {"description": "It has no such part."},
        **problems(404),
    },
    tags=["files"],
)
async def get_file(
    request: Request, job: JobId, name: Annotated[str, Path(description="its name in the job's list", max_length=300)]
) -> Response:
    """Fetch one of a job's files by its name: the plan, the certificate, a robot's trajectory (CSV) and so on."""
    return await _file(request, job, name)


async def _file(request: Request, job: str, name: str, *, inline: bool = False, leaf: str | None = None) -> Response:
    found = await jobs_of(request).file(job, name)
    tag = f'"{found.sha256}"'
    if request.headers.get("if-none-match") == tag:
        return Response(status_code=304, headers={"etag": tag})
    headers = {"etag": tag, "cache-control": "private, no-cache"}
    if inline:
        headers["content-security-policy"] = REPORT_POLICY
    kind: Literal["inline", "attachment"] = "inline" if inline else "attachment"
    leaf = leaf or name.rpartition("/")[2]
    return FileResponse(found.path, media_type=found.media_type, filename=leaf, content_disposition_type=kind, headers=headers)


@router.get(
    "/jobs/{job}/report",
    responses={**content("text/html", "The page."), **problems(404)},
    response_class=Response,
    tags=["files"],
)
async def get_report(request: Request, job: JobId) -> Response:
    """Open the report: one page that needs nothing else, of at most 2 MB."""
    name = PAGES.get((await jobs_of(request).job(job)).kind, "report.html")
    return await _file(request, job, name, inline=True)


@router.get(
    "/jobs/{job}/certificate",
    responses={**content(JSON, "certificate.json", {"type": "object"}), **problems(404)},
    response_class=Response,
    tags=["files"],
)
async def get_certificate(request: Request, job: JobId) -> Response:
    """Fetch the certificate: every claim with its bound, limit and margin, and whether the kernel `checked` it (`proof`)."""
    return await _file(request, job, "certificate.json", inline=True)


@router.get(
    "/jobs/{job}/mission",
    responses={**content(YAML, "The mission, resolved."), **problems(404, 409)},
    response_class=Response,
    tags=["files"],
)
async def get_mission(request: Request, job: JobId) -> Response:
    """Fetch the mission of a job, however far it came, to change and submit it."""
    return Response((await jobs_of(request).mission(job)).encode(), media_type=YAML)


@router.get("/jobs/{job}/plan", response_model=PlanAnswer, responses=problems(404, 409), tags=["files"])
async def get_plan(request: Request, job: JobId) -> Response:
    """Fetch the plan, as soon as there is one."""
    mission, plan = await planned(jobs_of(request), job)
    return Response(b'{"mission":' + asked.as_json(mission) + b',"plan":' + plan.encode() + b"}", media_type=JSON)


@router.get(
    "/jobs/{job}/archive",
    responses={**content(ZIP, "All files as one archive."), **problems(404, 409)},
    response_class=Response,
    tags=["files"],
)
async def get_archive(request: Request, job: JobId) -> Response:
    """Fetch all files at once; unpacked, they are a folder that `ltlplan recheck` proves again."""
    service = service_of(request)
    packed = await service.questions.ask(asked.archive, await places(jobs_of(request), job), who=who_of(request))
    return _zip(packed, f"{job}.zip")


@router.get(
    "/jobs/{job}/proof",
    responses={**content(ZIP, "statement.json, proof.json, check.pyz and the trajectories."), **problems(404, 409)},
    response_class=Response,
    tags=["files"],
)
async def get_proof(request: Request, job: JobId) -> Response:
    """Fetch the proof with its checker: unpacked, `python check.pyz FOLDER` checks it with nothing but Python."""
    service = service_of(request)
    packed = await service.questions.ask(asked.archive, await proof_places(jobs_of(request), job), who=who_of(request))
    return _zip(packed, f"{job}-proof.zip")


@router.post(
    "/jobs/{job}/recheck",
    responses={**content(JSON, "certificate.json, proved now", {"type": "object"}), **problems(404, 409, changing=True)},
    response_class=Response,
    tags=["judge"],
)
async def recheck_job(request: Request, job: JobId) -> Response:
    """Prove a job's certificate again, from its files alone, and have the kernel check its proof again: each claim's `proof` says so."""
    service = service_of(request)
    files = await places(jobs_of(request), job)
    proved = await service.questions.ask_in_folder(asked.recheck, files, who=who_of(request))
    return Response(proved, media_type=JSON)


@router.get("/exports", response_model=tuple[ExportFormat, ...], responses=problems(), tags=["exports"])
async def list_exports(request: Request) -> Response:
    """List what certified flights can be written for."""
    return Response(await service_of(request).questions.ask(asked.export_formats, who=who_of(request)), media_type=JSON)


def _wanted(
    target: Annotated[str, Path(description="one of `/api/exports`", max_length=100)],
    vehicle: Annotated[
        str | None, Query(description="airframe that will fly, to be held against the certificate's", max_length=100)
    ] = None,
    rate: Annotated[float | None, Query(description="px4, ros2: setpoints a second", ge=1, le=1000)] = None,
    robots: Annotated[
        str | None,
        Query(description="robots to write, such as quad0,quad1, where others fly from another export", max_length=10_000),
    ] = None,
    anyway: Annotated[
        bool, Query(description="write without a simulated flight that stayed in its tube, with a warning in the files")
    ] = False,
) -> ExportAsked:
    names = None if robots is None else tuple(name.strip() for name in robots.split(","))
    return ExportAsked(target, vehicle, names, {} if rate is None else {"rate": rate}, anyway)


@router.get(
    "/jobs/{job}/exports/{target}",
    responses={
        **content(ZIP, "The export's files."),
        202: {"description": "It is being written; ask again, or follow the job that writes it.", "model": Job},
        **problems(403, 404, 409, 501, 507),
    },
    response_class=Response,
    tags=["exports"],
)
async def export_job(
    request: Request,
    job: JobId,
    wanted: Annotated[ExportAsked, Depends(_wanted)],
    wait: Annotated[float, Query(description="s to wait for it at most", ge=0, le=WAIT)] = WAIT,
) -> Response:
    """Write a certified flight for a vehicle, after proving its certificate again and flying it in simulation.

    That is a job of its own, done once. This waits for it, or answers 202 with where to look: the job's `location`, whose only file is
    the archive.
    """
    require_own_page("POST", request.headers)  # it may begin a job
    jobs = jobs_of(request)
    made = await jobs.waited((await jobs.derive(job, wanted)).id, wait)
    if made.problem is not None:
        raise error_of(made.problem)
    if made.state == "cancelled":
        raise Conflict(f"The export of job {job} for {wanted.target} was cancelled; ask for it again.")
    if made.state != "done":
        return _told(made, 202)
    (file,) = made.files
    return await _file(request, made.id, file.name, leaf=f"{job}-{file.name}")


@router.post(
    "/jobs/{job}/exports/{target}",
    response_model=Job,
    responses={
        200: {"description": "There is a job for just this already; here it is.", "model": Job},
        **problems(404, 409, 507, changing=True),
    },
    status_code=201,
    tags=["exports"],
)
async def submit_export(request: Request, job: JobId, wanted: Annotated[ExportAsked, Depends(_wanted)]) -> Response:
    """Submit an export, to be followed as any job; its only file is the archive."""
    made = await jobs_of(request).derive(job, wanted)
    return _told(made, 200 if made.found else 201)


def _zip(data: bytes, name: str) -> Response:
    return Response(data, media_type=ZIP, headers={"content-disposition": f'attachment; filename="{name}"'})
