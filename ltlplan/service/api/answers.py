"""Requests and responses of the API that are no values of `ltlplan.service.models`: for its schema, and for checking requests."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from ltlplan.service.event_inbox.names import FLIGHT
from ltlplan.service.models import FlightAnswered, ProblemFault
from ltlplan.service.study_models import Varied
from verify.data.sections import TeamReading, Trace

_WORD = Annotated[str, Field(min_length=1, max_length=100_000)]
FlightId = Annotated[str, Field(pattern=FLIGHT, description="the flight's own name for itself, drawn by chance")]


class _Answer(BaseModel):
    model_config = ConfigDict(frozen=True)


class MissionCheck(_Answer):
    """A mission as it was typed: its faults, or what it asks."""

    sound: bool = Field(description="whether it could be submitted")
    faults: tuple[ProblemFault, ...] = Field(description="every fault, with its line, column and keys")
    name: str | None = Field(description="the mission's name")
    formula: str | None = Field(description="its formula")
    sequence: str | None = Field(description="its sequence of hoops")
    trace: Trace | None = Field(description="whether the flight ends")
    sentences: tuple[str, ...] = Field(description="its formula in words, a sentence for each part that must hold")
    notes: tuple[str, ...] = Field(default=(), description="what is allowed and may yet not be meant")
    robots: tuple[str, ...]
    propositions: tuple[str, ...] = Field(description="names that the formula may use")
    digest: str | None = Field(description="SHA-256 of the resolved mission")


class ShippedMission(_Answer):
    """A mission that comes with the service."""

    name: str
    robots: int
    trace: Trace
    asks: str = Field(description="its formula, or its sequence")
    text: str = Field(description="the file, to start from")


class WordsRequest(BaseModel):
    """Words to be checked against a formula."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    formula: Annotated[str, Field(min_length=1, max_length=100_000)] = Field(
        description="LTL in Spot's syntax", examples=["F a & G(b -> c)"]
    )
    words: (
        Annotated[list[_WORD], Field(min_length=1, max_length=1000)]
        | Annotated[dict[str, _WORD], Field(min_length=1, max_length=1000)]
    ) = Field(
        description="One word in Spot's notation, or a team's: in order, or by robot. What is not named is false.",
        examples=[["1; a; b & c"]],
    )
    reading: TeamReading = Field(default="own", description="team letters: each robot's own, or the union of all")


class VerdictAnswer(_Answer):
    """The checker's answer to one question."""

    outcome: Literal["holds", "fails", "undecided"]
    sentence: str
    claim: str
    robot: str | None
    visit: int | None = Field(description="the letter or visit that decides")
    region: str | None
    time: float | None
    counterexample: tuple[tuple[str, tuple[str, ...]], ...] | None = Field(description="robot and letter, in order")
    cycle_length: int | None = Field(description="how many letters at the counterexample's end repeat for ever")
    times: tuple[tuple[float, float], ...]
    order: tuple[tuple[tuple[str, int], tuple[str, int]], ...]
    vacuous: tuple[str, ...] = Field(description="parts that hold only because they are never put to the test")


class WordsCheck(_Answer):
    """Words, checked against a formula: `word` of one, `sequential` and `parallel` of a team."""

    formula: str
    words: dict[str, str]
    word: VerdictAnswer | None = None
    sequential: VerdictAnswer | None = None
    parallel: VerdictAnswer | None = None


class FlightClaim(_Answer):
    """One claim of a recorded flight."""

    model_config = ConfigDict(frozen=True, extra="allow")

    name: str
    verdict: Literal["holds", "fails", "undecided"]
    sentence: str


class FlightAnswer(_Answer):
    """Verdict on a recorded flight."""

    mission: str
    outcome: Literal["holds", "fails", "undecided"]
    sentence: str
    claims: tuple[FlightClaim, ...]
    assumptions: tuple[str, ...]
    start: dict[str, Any] = Field(description="when the flight began on the recording's clock, s")


class ExportFormat(_Answer):
    """Something that flights are written for."""

    name: str
    options: dict[str, str] = Field(description="what can be asked of it")
    voids: tuple[str, ...] = Field(description="what voids the certificate there")
    controllers: tuple[str, ...] = Field(
        description="controllers that its vehicles run; empty where none of them is modelled, so that exports need `anyway`"
    )


class PlanAnswer(_Answer):
    """A plan with its mission, as files hold them."""

    mission: str = Field(description="mission.yaml, resolved")
    plan: dict[str, Any] = Field(description="plan.json")


class HealthAnswer(_Answer):
    """Health of the service; more of it for clients that may see it."""

    model_config = ConfigDict(frozen=True, extra="allow")

    ok: bool


class LiveBegin(BaseModel):
    """A flight that begins to listen."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    flight: FlightId
    mission: Annotated[str, Field(max_length=200, pattern=r"^[\w .+-]*$")] = Field(
        description="name of the mission that it flies"
    )


class LiveAnswers(BaseModel):
    """A flight's answers to events that it was sent."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    flight: FlightId
    answers: Annotated[tuple[FlightAnswered, ...], Field(max_length=1000)]


class LiveEnd(BaseModel):
    """A flight that listens no more."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    flight: FlightId


class StudyAsked(BaseModel):
    """A study, to be made."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    mission: str = Field(description="the mission, YAML or JSON")
    key: Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[\w-]+(\.[\w-]+)*$")] = Field(
        description="the key that is varied, with its sections; `seed` for `planner.seed`", examples=["seed", "limits.speed"]
    )
    values: Annotated[tuple[Varied, ...], Field(min_length=1, max_length=200)] = Field(
        description="a job each", examples=[[0, 1, 2]]
    )
    name: Annotated[str, Field(max_length=120)] = Field(default="", description="by default the mission with the key")
    project: Annotated[str, Field(max_length=60)] = Field(default="", description="of the study and its jobs")
    pace: Annotated[str | None, Field(max_length=30)] = Field(default=None, description="instead of `planner.pace`")


_Listed = Annotated[tuple[Annotated[float, Field(gt=0, allow_inf_nan=False)], ...], Field(min_length=1, max_length=10)]
_Names = Annotated[tuple[Annotated[str, Field(min_length=1, max_length=100)], ...], Field(min_length=1, max_length=10)]
_Seed = Annotated[int | None, Field(ge=0, le=2**62)]


class CampaignAsked(BaseModel):
    """A campaign: a flight many times in simulation. Options are those of `ltlplan campaign`."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    runs: Annotated[int, Field(ge=1, le=100_000)] = Field(default=100, description="number of flights")
    seed: _Seed = Field(default=None, description="of the first; by default the plan's")
    wind: Annotated[str | None, Field(max_length=100)] = Field(
        default=None, description="m/s: 1.5, 1,0.5,0, or with gusts 1.5+0.4"
    )
    noise: Annotated[str | None, Field(max_length=100)] = Field(
        default=None, description="motion capture's standard deviation, m"
    )
    model: Annotated[str | None, Field(max_length=100)] = Field(default=None, description="model of the vehicles")
    controller: Annotated[str | None, Field(max_length=100)] = Field(
        default=None, description="controller that follows the plan"
    )
    estimator: Literal["ekf", "kalman"] | None = Field(default=None, description="state estimator")
    latency: Annotated[float | None, Field(ge=0, le=10)] = Field(default=None, description="s from a frame to its use")
    mass: Annotated[float | None, Field(gt=0, le=1000)] = Field(default=None, description="kg that the controller assumes")


class RehearsalAsked(BaseModel):
    """A rehearsal: a flight by several controllers, masses, latencies and winds. Options are those of `ltlplan rehearse`."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    runs: Annotated[int, Field(ge=1, le=1000)] = Field(default=20, description="flights of each combination")
    seed: _Seed = Field(default=None, description="of the first; by default the plan's")
    controllers: _Names | None = Field(default=None, description="by default all that all vehicles run")
    masses: _Listed | None = Field(default=None, description="shares of the profile's mass")
    latencies: Annotated[tuple[Annotated[float, Field(ge=0, le=10)], ...] | None, Field(max_length=10)] = Field(
        default=None, description="s from a frame of motion capture to its use"
    )
    winds: _Names | None = Field(default=None, description="m/s, as a campaign's")
    drags: Annotated[tuple[Literal["profile", "least", "most"], ...] | None, Field(max_length=3)] = Field(
        default=None, description="of vehicles whose drag is a guess"
    )
    corners: bool = Field(default=True, description="whether the corners of what is not known are flown, too")
    hunt: Annotated[float | None, Field(gt=0, le=100)] = Field(default=None, description="m/s of winds that are aimed")
    noise: Annotated[str, Field(max_length=100)] = Field(default="0.001", description="motion capture's standard deviation, m")


RoleName = Literal["viewer", "planner", "pilot", "admin"]


class TokenAdded(BaseModel):
    """A token of one's own account, to be made."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    label: Annotated[str, Field(max_length=60)] = Field(description="its name becomes USER.LABEL")


class WebhookAdded(BaseModel):
    """An address that is to hear of the ends of one's jobs."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    url: Annotated[str, Field(max_length=500)] = Field(description="https://HOST/PATH, of a host that an admin lists")


class AccountAdded(BaseModel):
    """An account, to be made."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: Annotated[str, Field(max_length=100)]
    role: RoleName = "planner"


class AccountChange(BaseModel):
    """Changes of an account."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    role: RoleName | None = None
    disabled: bool | None = None


class ProjectChange(BaseModel):
    """Changes of a project."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    shared: bool = Field(description="whether everybody sees its jobs")


class MissionStore(BaseModel):
    """A mission, to be stored."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: Annotated[str, Field(max_length=100)]
    text: str = Field(description="YAML; it may have faults")
    project: Annotated[str, Field(max_length=60)] = ""
    tags: Annotated[tuple[str, ...], Field(max_length=20)] = ()


class MissionSave(BaseModel):
    """A version of a stored mission, to be saved."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    text: str = Field(description="YAML; it may have faults")
    after: int = Field(description="number of the version that it was made of", ge=1)


class MissionChange(BaseModel):
    """Changes of a stored mission that are none of its text."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    project: Annotated[str | None, Field(max_length=60)] = None
    tags: Annotated[tuple[str, ...] | None, Field(max_length=20)] = None
