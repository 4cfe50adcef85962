"""Studies: the same mission over values of one key, as a table and a plot; two results side by side."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response

from ltlplan.service.api.answers import StudyAsked
from ltlplan.service.api.request_parsing import JSON, json_answer, json_list, principal_of, read_json, service_of
from ltlplan.service.api.schema import content, json_body, problems
from ltlplan.service.people.user_studies import UserStudies, table_of
from ltlplan.service.study_models import Comparison, Figure, Study
from ltlplan.service.views.plots import study_plot

router = APIRouter(prefix="/api", tags=["studies"])

Id = Annotated[int, Path(description="the study's id", ge=1, le=2**62)]
JobId = Annotated[str, Path(description="a job's id", max_length=100)]


def _studies(request: Request) -> UserStudies:
    return service_of(request).studies_of(principal_of(request))


@router.get("/studies", response_model=tuple[Study, ...], responses=problems())
async def list_studies(
    request: Request,
    search: Annotated[str, Query(description="letters that name, key, owner or project has", max_length=200)] = "",
    project: Annotated[str | None, Query(description="only those of this project", max_length=60)] = None,
) -> Response:
    """List your studies and those of shared projects, the newest first, without their members."""
    return json_list(await _studies(request).listed(search=search, project=project))


@router.post(
    "/studies",
    response_model=Study,
    status_code=201,
    responses=problems(404, 507, body=True),
    openapi_extra=json_body("StudyAsked", "The mission, the key that is varied, and its values."),
)
async def make_study(request: Request) -> Response:
    """Submit a mission once for each value of one of its keys. Nothing is submitted where it has faults with one of them.

    Its members are jobs as any other, computed once for all who ask the same; plans of other users come before most of them.
    """
    asked = await read_json(request, StudyAsked)
    made = await _studies(request).make(
        asked.mission, asked.key, asked.values, name=asked.name, project=asked.project, pace=asked.pace
    )
    return Response(made.model_dump_json(), 201, {"location": f"/api/studies/{made.id}"}, JSON)


@router.get("/studies/{study}", response_model=Study, responses=problems(404))
async def get_study(request: Request, study: Id) -> Response:
    """Return a study with the figures of all its jobs so far."""
    return json_answer(await _studies(request).study(study))


@router.get(
    "/studies/{study}/table",
    responses={**content("text/csv", "A row for each value.", {"type": "string"}), **problems(404)},
    response_class=Response,
)
async def get_table(request: Request, study: Id) -> Response:
    """Return a study as a table, CSV."""
    headers = {"content-disposition": f'attachment; filename="study-{study}.csv"'}
    return Response(table_of(await _studies(request).study(study)), media_type="text/csv; charset=utf-8", headers=headers)


@router.get(
    "/studies/{study}/plot",
    responses={**content("image/svg+xml", "The plot.", {"type": "string"}), **problems(404)},
    response_class=Response,
)
async def get_plot(
    request: Request, study: Id, figure: Annotated[Figure, Query(description="figure over the values")] = "duration"
) -> Response:
    """Return a plot of one figure over a study's values, SVG."""
    return Response(study_plot(await _studies(request).study(study), figure), media_type="image/svg+xml")


@router.post("/studies/{study}/cancel", response_model=Study, responses=problems(404, changing=True))
async def cancel_study(request: Request, study: Id) -> Response:
    """Cancel all jobs of a study that have not ended, but those that others wait for."""
    return json_answer(await _studies(request).cancel(study))


@router.delete("/studies/{study}", status_code=204, responses=problems(404, changing=True))
async def delete_study(request: Request, study: Id) -> Response:
    """Delete a study; its jobs stay."""
    await _studies(request).delete(study)
    return Response(status_code=204)


@router.get("/jobs/{job}/compare/{other}", response_model=Comparison, responses=problems(404, 409))
async def compare_jobs(
    request: Request, job: JobId, other: Annotated[str, Path(description="another job's id", max_length=100)]
) -> Response:
    """Compare two results: cost, duration, margins, words, claim by claim, and what changed in the mission."""
    return json_answer(await _studies(request).compare(job, other))
