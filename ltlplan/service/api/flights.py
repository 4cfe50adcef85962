"""Words and flights that others bring: checked against a formula, or against a mission."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, File, Form, Request, Response, UploadFile

from ltlplan.service import queries as asked
from ltlplan.service.api.answers import FlightAnswer, WordsCheck, WordsRequest
from ltlplan.service.api.request_parsing import JSON, jobs_of, read_json, service_of, who_of
from ltlplan.service.api.schema import json_body, problems
from ltlplan.service.recordings import RecordingAsked
from ltlplan.service.service import places
from verify.data.errors import BadInput

router = APIRouter(prefix="/api", tags=["judge"])

_MOST_FILES = 1100
_LONG = 20_000
"""Characters of a field that names all robots."""


@router.post(
    "/words/check",
    response_model=WordsCheck,
    response_model_exclude_unset=True,
    responses=problems(501, body=True),
    openapi_extra=json_body("WordsRequest", "A formula and words."),
)
async def check_words(request: Request) -> Response:
    """Hold a word, or the words of a team, against a formula.

    One word is answered by `word`. A team's words are checked one after another (`sequential`) and interleaved (`parallel`).
    """
    given = await read_json(request, WordsRequest)
    told = await service_of(request).questions.ask(
        asked.check_words, given.formula, given.words, given.reading, who=who_of(request)
    )
    return Response(told, media_type=JSON)


async def recording_said(  # each parameter is a field of the form
    max_speed: Annotated[float | None, Form(description="bound on every robot's speed, m/s", gt=0)] = None,
    error: Annotated[float, Form(description="bound on a position's error, m", ge=0)] = 0.0,
    start: Annotated[
        str | None,
        Form(
            description="when the flight began, s of the recording's clock, or of each robot's own: quad0=3.2,quad1=5.7",
            max_length=_LONG,
        ),
    ] = None,
    start_error: Annotated[float, Form(description="how far start may be off, s", ge=0)] = 0.0,
    called: Annotated[
        list[str] | None,
        Form(description="what the recording calls a robot or a column: quad0=cf231; once for each", max_length=_MOST_FILES),
    ] = None,
    axes: Annotated[
        str | None, Form(description="the mission's x, y, z in the recording's axes: x,-z,y", max_length=100)
    ] = None,
    origin: Annotated[
        list[str] | None,
        Form(
            description="where the recording's origin lies in the mission, m: 1.5,0,0 or quad0=1.5,0,0", max_length=_MOST_FILES
        ),
    ] = None,
    pauses: Annotated[
        list[float] | None, Form(description="s that the team hovered between parts", max_length=_MOST_FILES)
    ] = None,
) -> RecordingAsked:
    """Return what a form says of a recording."""
    return RecordingAsked(
        max_speed,
        error,
        start or None,
        start_error,
        tuple(called or ()),
        axes or None,
        tuple(origin or ()),
        tuple(pauses or ()),
    )


@router.post("/flights/judge", response_model=FlightAnswer, responses=problems(404, 409, body=True))
async def judge_flight(
    request: Request,
    recording: Annotated[
        UploadFile,
        File(
            description="the flight: a table of motion capture (CSV, TSV), a Crazyflie's or PX4's log, a ROS 2 bag of one file (.mcap, .db3), a log of "
            "ours, or a ZIP archive of such files: one for each robot, named after it, or a bag's folder"
        ),
    ],
    said: Annotated[RecordingAsked, Depends(recording_said)],
    job: Annotated[str | None, Form(description="id of the job whose flight it was", max_length=100)] = None,
    files: Annotated[
        list[UploadFile] | None,
        File(description="instead of a job: mission.yaml, and of a run's folder plan.json, certificate.json and <robot>.csv"),
    ] = None,
) -> Response:
    """Check a recorded flight, claim by claim, for all times between its samples too."""
    service = service_of(request)
    if (job is None) == (not files):
        raise BadInput("Say what the flight was to do: either `job`, or `files` of a run's folder.")
    what = await places(jobs_of(request), job) if job is not None else await _sent(files or [])
    answer = await service.questions.ask_in_folder(asked.judge_flight, what, await recording.read(), said, who=who_of(request))
    return Response(answer, media_type=JSON)


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
