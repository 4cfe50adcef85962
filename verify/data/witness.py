"""Place and time at which a claim fails: the value that the checker returns to whoever can repair the flight."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Witness:
    """One refused claim, with all that is needed to see it or to mend it.

    Attributes:
        claim: Name of the claim, e.g. "formula", "passages", "limits.speed", "separation".
        sentence: One sentence for a person.
        robot: The robot concerned, or None for the team.
        other: The second robot, for claims about pairs.
        time: Mission time in s at which the claim fails or is tightest, where there is one.
        region: The region or hoop concerned.
        visit: Index of the planned visit concerned (into `RobotPlan.visits`).
        bound: The proved bound on the quantity, in the limit's unit.
        limit: The limit that it breaks, in the same unit.
        way: Unit vector along which the robot would have to be elsewhere at that time, where there is one.
        what: What `bound` and `limit` are of, where the claim's name does not say it: a wall, a derivative at a joint.
        word: A counterexample, as letters with the robot that holds each, for claims about words.
        times: For each letter of `word` the times, in s, from which and until which it can be read.
        order: Waits that would rule this counterexample out, for `refine.refine` to keep; the checker names none: pairs ((robot, visit), (robot, visit)), of which
            the first must be over before the second begins.
    """

    claim: str
    sentence: str
    robot: str | None = None
    other: str | None = None
    time: float | None = None
    region: str | None = None
    visit: int | None = None
    bound: float | None = None
    limit: float | None = None
    what: str = ""
    way: tuple[float, float, float] | None = None
    word: tuple[tuple[str, frozenset[str]], ...] = ()
    times: tuple[tuple[float, float], ...] = ()
    order: tuple[tuple[tuple[str, int], tuple[str, int]], ...] = ()
