"""Words and flights that others bring: held against a formula, or against what was asked of them."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, File, Form, Request, Response, UploadFile

from ltlplan.service import questions as asked
from ltlplan.service.api.answers import FlightAnswer, WordsCheck, WordsRequest
from ltlplan.service.api.reading import JSON, read_json, service_of
from ltlplan.service.api.schema import json_body, problems
from ltlplan.service.service import places
from verify.data.errors import BadInput

router = APIRouter(prefix="/api", tags=["judge"])

_MOST_FILES = 1100


@router.post(
    "/words/check",
    response_model=WordsCheck,
    response_model_exclude_unset=True,
    responses=problems(501, body=True),
    openapi_extra=json_body("WordsRequest", "A formula and words."),
)
async def check_words(request: Request) -> Response:
    """Hold a word, or the words of a team, against a formula.

    One word is answered by `word`. A team's words are judged one after another (`sequential`) and interleaved (`parallel`).
    """
    given = await read_json(request, WordsRequest)
    told = await service_of(request).questions.ask(asked.check_words, given.formula, given.words, given.reading)
    return Response(told, media_type=JSON)


@router.post("/flights/judge", response_model=FlightAnswer, responses=problems(404, 409, body=True))
async def judge_flight(  # each parameter is a field of the form
    request: Request,
    recording: Annotated[UploadFile, File(description="the flight: a table (CSV) of motion capture, or a log of ours")],
    job: Annotated[str | None, Form(description="id of the job whose flight it was", max_length=100)] = None,
    files: Annotated[
        list[UploadFile] | None,
        File(description="instead of a job: mission.yaml, and of a run's folder plan.json, certificate.json and <robot>.csv"),
    ] = None,
    max_speed: Annotated[float | None, Form(description="bound on every robot's speed, m/s", gt=0)] = None,
    error: Annotated[float, Form(description="bound on a position's error, m", ge=0)] = 0.0,
    start: Annotated[float | None, Form(description="when the flight began on the recording's clock, s")] = None,
) -> Response:
    """Judge a recorded flight, claim by claim, for all times between its samples too."""
    service = service_of(request)
    if (job is None) == (not files):
        raise BadInput("Say what the flight was to do: either `job`, or `files` of a run's folder.")
    bounds = {"max_speed": max_speed, "error": error, "start": start}
    what = await places(service.jobs, job) if job is not None else await _sent(files or [])
    told = await service.questions.ask_in_folder(asked.judge_flight, what, await recording.read(), bounds)
    return Response(told, media_type=JSON)


async def _sent(files: list[UploadFile]) -> dict[str, bytes]:
    """Return files as they were sent, by the last part of their names."""
    if len(files) > _MOST_FILES:
        raise BadInput(f"{len(files)} files; {_MOST_FILES} are the most.")
    found: dict[str, bytes] = {}
    for file in files:
        name = (file.filename or "").replace("\\", "/").rpartition("/")[2]
        if name in found:
            raise BadInput(f"'{name[:100]}' was sent twice; send one folder's files.")
        found[name] = await file.read()
    return found
