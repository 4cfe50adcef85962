"""Values of the service's jobs and of flights that listen to it: HTTP answers them and the client returns them."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

from verify.data.names.former_names import former_names

State = Literal["queued", "running", "done", "failed", "cancelled"]
ENDED: frozenset[State] = frozenset({"done", "failed", "cancelled"})

Whose = Literal["visible", "mine", "all"]
"""Which jobs are listed: the own ones and those of shared projects, the own ones, or for an admin everybody's."""

SEARCHING = ("plan", "round")
"""Stages that may search, rounds by their first word."""

Kind = Literal["state", "stage", "progress", "claim"]

DerivedKind = Literal["export", "campaign", "rehearsal", "recording"]
"""What is made of a job's flight, by jobs of their own."""

ONLY_OF_JOBS = ("manifest.json", "watch.json")
"""Files of a job that are none of the run's folder: a folder gets a manifest of its own when it is written."""


class Told(BaseModel):
    """A frozen value that is told to others. Keys that are not known are left out, so that older clients read newer services."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class ProblemFault(Told):
    """One mistake in a mission.

    Attributes:
        line: Line of the text, from 1, where it is known.
        column: Column, from 1, where it is known.
        keys: Where it stands, as keys and indices.
        message: What is wrong and what would be right.
    """

    line: int | None = None
    column: int | None = None
    keys: tuple[str | int, ...] = ()
    message: str


class Problem(Told):
    """Problem details, as in RFC 9457.

    Attributes:
        type: Which kind, as a path: "/problems/unsatisfiable".
        title: The kind in words.
        status: HTTP status.
        detail: What the command line would print.
        exit_code: What the command line would end with.
        faults: All mistakes of a mission.
        witnesses: Where and why claims failed, as plain data.
        core: Requirements that cannot hold together; no proper part of them is impossible by itself.
        reasons: What stands in their way, a sentence each.
        edges: Edges of the environment that would make them possible, where some would.
    """

    type: str
    title: str
    status: int
    detail: str
    exit_code: int = 1
    faults: tuple[ProblemFault, ...] = ()
    witnesses: tuple[dict[str, Any], ...] = ()  # of any type: what a witness holds
    core: tuple[str, ...] = ()
    reasons: tuple[str, ...] = ()
    edges: tuple[tuple[str, str], ...] = ()


class FileEntry(Told):
    """One file of a job.

    Attributes:
        name: Its name, as in the folder that `ltlplan run` writes; "crazyswarm2/..." for what is in that folder.
        size: Bytes.
        media_type: What kind of content it is.
        sha256: Digest of its bytes, in hexadecimal.
    """

    name: str
    size: int
    media_type: str
    sha256: str


class Stage(Told):
    """One part of a job's work.

    Attributes:
        name: "plan", "round 1" to "round 6", "flight" or "files"; of what is made of a flight its kind.
        state: How far it is.
        started: When a worker took it first, UTC, ISO 8601.
        ended: When what it found was stored.
        found: What it found, as plain data; left out of lists.
    """

    name: str
    state: State = "queued"
    started: str | None = None
    ended: str | None = None
    found: dict[str, Any] = Field(default_factory=dict)  # of any type: JSON nests


class Job(Told):
    """A mission that was accepted, or what is made of its flight, and how far it has come.

    Attributes:
        id: Names it.
        kind: "mission", or what is made of a flight: "export", "campaign", "rehearsal", "recording".
        mission: The mission's name.
        title: Its formula or sequence, shortened; of what is made of a flight what that is.
        of: Of what is made of a flight: id of the flight's job.
        seed: Source of every draw.
        state: How far it is.
        submitted: When it was accepted, UTC, ISO 8601.
        started: When its first stage began.
        ended: When it ended.
        stages: Its stages so far, in order.
        problem: Why it failed.
        files: What it made.
        key: SHA-256 of what was asked and of the versions that answer; jobs of one key have one answer.
        summary: What `ltlplan run --json` prints, when it is done.
        found: Whether the answer was there already when it was asked for.
        sentence: What is being done at the moment.
        share: How much of the work is done, 0 to 1.
        stopped: Whether its search was ended with the best plan so far, on request: an attempt of its own, which answers nobody else.
        owner: User whose reference to it is seen: one's own, else one of a shared project.
        project: The project that this user put it into; empty for none.
    """

    id: str
    kind: Literal["mission"] | DerivedKind = "mission"
    mission: str
    title: str = ""
    of: str | None = None
    seed: int = 0
    state: State = "queued"
    submitted: str
    started: str | None = None
    ended: str | None = None
    stages: tuple[Stage, ...] = ()
    problem: Problem | None = None
    files: tuple[FileEntry, ...] = ()
    key: str = ""
    summary: dict[str, Any] | None = None  # of any type: JSON nests
    found: bool = False
    sentence: str = ""
    share: float = 0.0
    stopped: bool = False
    owner: str = ""
    project: str = ""

    @property
    def searches(self) -> bool:
        """True if a stage is at work that may search, whose search can be stopped at the best plan so far."""
        stage = self.stages[-1] if self.stages and self.ended is None else None
        return stage is not None and stage.state == "running" and stage.name.partition(" ")[0] in SEARCHING


class Event(Told):
    """Something that happened to a job.

    Attributes:
        id: Grows from event to event of one job.
        kind: A change of the job's state, a change of a stage's, progress within a stage, or one claim that was checked.
        job: The job's id.
        stage: Which stage, if any.
        sentence: For a person.
        share: How much of the job's work is done, 0 to 1.
        data: More, as plain data: a stage's state and findings, a claim.
    """

    id: int
    kind: Kind
    job: str
    stage: str | None = None
    sentence: str = ""
    share: float = 0.0
    data: dict[str, Any] = Field(default_factory=dict)  # of any type: JSON nests


class Health(Told):
    """Health of the service.

    Attributes:
        ok: Database and workers answer, every job goes on, and there is room to write.
        database: "answers", or what is wrong with it.
        computing: "answers", or why no stage is computed at the moment.
        interrupted: Jobs whose work was given up and has not come further since, by their ids: how often, and why.
        workers: How many stages may run at once.
        alive: How many processes are running.
        running: Jobs that have begun.
        queued: Jobs that wait.
        room: Bytes that are free where the data is.
        versions: Of what a verdict rests on.
    """

    ok: bool
    database: str
    workers: int
    alive: int
    running: int
    queued: int
    room: int
    versions: dict[str, str]
    computing: str = "answers"
    interrupted: dict[str, str] = Field(default_factory=dict)


class LiveFlight(Told):
    """A flight that listens to what it is told, or did.

    Attributes:
        name: What it listens as.
        mission: What it flies.
        opened: When it began to listen, UTC, ISO 8601.
        ended: When it ended.
        silent: s since it asked last, or since the service was started; None where it has ended.
        events: How many events it was told.
        open: How many of them it has not answered.
        run: Its number among all flights.
        connected: Whether it is seen live, and hears an order to stop.
        recorded: Whether it can be replayed.
        pilot: Who is in control of it, and tells it events; None while nobody is.
        offered: To whom control is offered; None where it is not.
    """

    name: str
    mission: str
    opened: str
    ended: str | None = None
    silent: float | None = None
    events: int = 0
    open: int = 0
    run: int = 0
    connected: bool = False
    recorded: bool = False
    pilot: str | None = None
    offered: str | None = None


StopLevel = Literal["hold", "land", "motors"]
"""Level of an order to stop; each goes beyond the one before."""


class StopReceipt(Told):
    """The service's receipt for an order to stop: it was put on the line to the flight. What the flight and each vehicle did, frames say.

    Attributes:
        order: Names the order; frames say what became of it.
        name: What the flight listens as.
        run: Its number among all flights.
        level: `hold`: all hold where they can stop, for as long as that can last. `land`: all land. `motors`: all motors stop.
        who: Who ordered it.
        expires: s after which the flight does not heed it any more.
    """

    order: str
    name: str
    run: int
    level: StopLevel
    who: str
    expires: float


class LiveEvent(Told):
    """An event that a flight was told.

    Attributes:
        number: From 1 on, in the order in which the flight was told.
        line: The event, as a line of `ltlplan online --follow`.
        who: Who told it: a token's name, or an address.
        told: When, UTC, ISO 8601.
        heard: Whether the flight does it; None while it has not answered.
        answer: What it did, or why not, as a sentence.
    """

    number: int
    line: str
    who: str
    told: str
    heard: bool | None = None
    answer: str = ""


class EventsAccepted(Told):
    """Events that the service has stored for a flight just now.

    Attributes:
        flight: The flight.
        events: The events, with their numbers.
    """

    flight: LiveFlight
    events: tuple[LiveEvent, ...]


class FlightAnswered(Told):
    """A flight's answer to one event.

    Attributes:
        number: The event's.
        heard: Whether it does it.
        sentence: What it did, or why not.
    """

    number: int = Field(ge=1, le=2**31)
    heard: bool
    sentence: str = Field(max_length=2000)

    @field_validator("sentence")
    @classmethod
    def _can_be_shown(cls, sentence: str) -> str:
        if not sentence.isprintable():
            raise ValueError("must be letters that can be shown")
        return sentence


__getattr__ = former_names(__name__, LiveTold="EventsAccepted")
