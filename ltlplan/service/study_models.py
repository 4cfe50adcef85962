"""Values of studies and comparisons: HTTP answers them and the client returns them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from ltlplan.service.models import State, Told

Scalar = bool | int | float | str
Varied = Scalar | tuple[Scalar, ...]
"""A value of a mission's key: one as YAML has it, or a list of such."""
Figure = Literal["cost", "duration", "largest_margin", "worst_error", "seconds"]


class ClaimFigure(Told):
    """A claim of a result, as its figures.

    Attributes:
        name: Names the claim.
        robot: Robot or robots that it is about; empty for the team.
        verdict: "holds", "fails" or "undecided".
        proof: Whether the kernel "checked" it, or the checker alone "judged" it.
        bound: Proved bound.
        limit: Its limit.
        room: What is left between them, where both are known.
        unit: Of these.
    """

    name: str
    robot: str = ""
    verdict: str = ""
    proof: str = ""
    bound: float | None = None
    limit: float | None = None
    room: float | None = None
    unit: str = ""


class Figures(Told):
    """Figures of a job: what one compares of two results, or tabulates of many.

    Attributes:
        job: The job's id.
        mission: The mission's name.
        seed: Source of every draw.
        state: How far the job is; "deleted" where it is not there any more.
        problem: Why it failed; empty where it did not.
        cost: The plan's cost; of laps the first counts, and what leads to it.
        lower_bound: No assignment costs less, wherever regions are touched.
        duration: The flight's, s.
        margin: Margin that is proved, m.
        largest_margin: Largest margin that holds, m.
        worst_error: Worst tracking error of the simulated flight, m.
        rounds: Rounds of refinement.
        seconds: From its first stage to its end, s on the clock.
        words: Each robot's word; empty in tables.
        claims: All claims; empty in tables.
    """

    job: str
    mission: str = ""
    seed: int = 0
    state: State | Literal["deleted"]
    problem: str = ""
    cost: float | None = None
    lower_bound: float | None = None
    duration: float | None = None
    margin: float | None = None
    largest_margin: float | None = None
    worst_error: float | None = None
    rounds: int = 0
    seconds: float | None = None
    words: dict[str, str] = Field(default_factory=dict)
    claims: tuple[ClaimFigure, ...] = ()


class Comparison(Told):
    """Two results side by side.

    Attributes:
        first: The one.
        second: The other, with its claims in the same order as far as both have them.
        difference: What changed from the first's resolved mission to the second's, as a unified diff; empty where nothing did.
    """

    first: Figures
    second: Figures
    difference: str


class StudyMember(Told):
    """One job of a study.

    Attributes:
        value: Its value of the key that is varied.
        figures: What was found, without words and claims.
    """

    value: Varied
    figures: Figures


class Study(Told):
    """The same mission over values of one key. Its members are jobs as any other.

    Attributes:
        id: Names it.
        name: What it is called.
        key: Key of the mission that is varied, such as planner.seed.
        owner: User who made it.
        project: Its project and its jobs'; empty for none.
        made: When it was made, UTC, ISO 8601.
        size: How many members it has.
        members: All of them, in the order of their values; empty in lists.
    """

    id: int
    name: str
    key: str
    owner: str
    project: str = ""
    made: str
    size: int
    members: tuple[StudyMember, ...] = ()
