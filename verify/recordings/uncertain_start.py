"""Claims of a recording that leaves open when its flight began: each must be so for every start, and every end, that may be meant.

What happens between the earliest and the latest start may belong to the flight or to the climb before it; so it is at its end. A claim
about the flight's words (formula, transitions, visits, passages) is checked over all of the time that may be meant. While nothing changes
there that it speaks of, each start gives the same words: a status that stays what it is, *may* included, allows the robot to hold whatever
it shows then. Where something changes, or may, the claim cannot be told. What is broken at one instant, such as a distance, is broken only
where that instant is the flight's whatever its start. What the robot never came to in all of the recording it did not visit in the flight.
Tube and planned actions move with the start, and are checked so by themselves.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from verify.claims.claim import Claim, Outcome
from verify.data.witness import Witness
from verify.recordings.flight_log import Samples
from verify.recordings.flight_reference import World
from verify.recordings.geometric_claims import recorded_claim
from verify.recordings.reachable_sets import Track
from verify.recordings.recorded_visits import crossings
from verify.recordings.temporal_claims import Row, statuses_within

_WORDS = frozenset({"formula", "transitions", "visits", "passages", "actions"})
"""Claims about what follows what."""


_HANGS = "It hangs on when the flight began"
_SAY = "A start that is known better would tell (`--start`, `--start-error`)."


@dataclass(frozen=True, slots=True)
class OpenEnds:
    """Times that may or may not be the flight's, s of the recording.

    Attributes:
        start: From its earliest to its latest start.
        stop: From its earliest to its latest end; None where its end is the recording's.
        recorded: Whether the recording is as long as the flight, so that what never happens in it, or always holds in it, is taken to be so of the flight.
        logged: Whether actions are read of the recording; planned ones are checked for every start by themselves, as the tube is.
    """

    start: tuple[float, float]
    stop: tuple[float, float] | None
    recorded: bool = True
    logged: bool = False

    @property
    def spans(self) -> tuple[tuple[float, float], ...]:
        """Both, as far as there are any."""
        return (self.start,) if self.stop is None else (self.start, self.stop)

    def surely_holds(self, time: float) -> bool:
        """Return whether an instant is the flight's, whenever it began."""
        return time >= self.start[1] and (self.stop is None or time <= self.stop[0])


def for_every_start(
    claims: Iterable[Claim], ends: OpenEnds, changes: Mapping[str, str], rows: Mapping[str, Mapping[str, Row]]
) -> list[Claim]:
    """Return claims as they are for every start that is left open.

    Args:
        claims: Judged over all of the time that may be the flight's.
        ends: What of it may not be.
        changes: What of each robot changes, or may, within `ends`, as `change_within` says it; empty where nothing does.
        rows: Each robot's regions.
    """
    anything = next((change for change in changes.values() if change), "")
    return [
        _told(claim, ends, anything if claim.robot is None else changes[claim.robot], rows.get(claim.robot or "", {}))
        if claim.name != "formula"
        else _told(claim, ends, anything, {})
        for claim in claims
    ]


def _told(claim: Claim, ends: OpenEnds, change: str, rows: Mapping[str, Row]) -> Claim:
    """Return one claim as it is for every start, where this changes within the times that may not be the flight's."""
    if claim.outcome == "undecided" or claim.name == "tube" or (claim.name == "actions" and not ends.logged):
        return claim
    if claim.outcome == "holds" and not ends.recorded:
        return _untold(claim, "The recording is shorter than the flight, of which it is not known when it began.")
    if claim.name in _WORDS:
        missed = None if claim.witness is None or claim.time is not None else claim.witness.region
        never = claim.outcome == "fails" and {status for _, status in rows.get(missed or "", ())} == {"no"}
        if ends.recorded and (never or not change):
            return claim
        if claim.outcome == "holds":
            return _untold(claim, f"{_HANGS}: {change}. {_SAY}")
    elif claim.outcome == "holds" or (claim.time is not None and ends.surely_holds(claim.time)):
        return claim
    return _untold(claim, f"{claim.sentence} Whether that was during the flight cannot be told: when it began is not known.")


def _untold(claim: Claim, sentence: str) -> Claim:
    outcome: Outcome = "undecided"
    if claim.witness is None:
        return recorded_claim(claim.name, outcome, sentence, robot=claim.robot, other=claim.other, time=claim.time)
    witness: Witness = replace(claim.witness, sentence=sentence)
    return replace(claim, outcome=outcome, sentence=sentence, witness=witness)


# six parameters: where a robot was, what it showed, and when that is asked
def change_within(
    ends: OpenEnds, track: Track, rows: Mapping[str, Row], worlds: Sequence[World], samples: Samples, margin: float
) -> str:
    """Say what of one robot changes, or may, within the times that may or may not be the flight's; empty where nothing does.

    Args:
        ends: Those times.
        track: Where the robot was.
        rows: Its regions.
        worlds: In order of time.
        samples: With the internal propositions of a log that shows them.
        margin: How near to the plane of an opening counts as being in it, m.
    """
    robot = track.robot
    for low, high in ends.spans:
        when = f"from {low:.4f} to {high:.4f} s"
        for region, row in rows.items():
            if len(statuses_within(row, Fraction(low), Fraction(high))) > 1:
                return f"{robot} may come into '{region}' or leave it {when}"
        if worlds[0].mission.hoops:
            part = track.over(low, high)
            found = crossings(part, worlds, margin) if part.start <= part.stop else []
            if found:
                return f"{robot} may pass '{found[0].hoop}' {when}"
        if samples.internal is not None:
            times, known = samples.times, worlds[0].mission.internal_propositions
            shown = [letter & known for letter in samples.internal[robot]]
            first = max(int(np.searchsorted(times, low, side="right")) - 1, 0)
            last = min(int(np.searchsorted(times, high, side="left")), len(times) - 1)
            if any(shown[k] != shown[first] for k in range(first, last + 1)):
                return f"{robot}'s internal state changes {when}"
    return ""
