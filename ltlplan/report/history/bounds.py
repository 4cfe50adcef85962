"""Parts of a formula that are bounded in seconds, over a sampled flight: when each holds, how each stands, and from when on it is too late.

For pictures only, but for what is read from the certificate's timelines. Claims come from the certificate.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from flight.monitoring.timed_state import TimedState
from ltlplan.report.bars import Bar
from ltlplan.report.history.letters import LetterInterval
from ltlplan.systems.due_visits import DueVisit, due_visits
from ltlplan.systems.gaps import straight_travel
from verify import Certificate
from verify.data import Formula, Letter, Mission
from verify.data.language.counting import atoms
from verify.logic.team_letters import TeamLetters
from verify.model_checking.timeline import Timeline
from verify.model_checking.timing.instants import intervals
from verify.model_checking.timing.team_instants import TeamInstants, ticks_per_second
from verify.model_checking.timing.timed_formula import TimedFormula, bounds_of

Letters = Mapping[str, Sequence[LetterInterval]]
"""Each robot's letters over time."""
_GRAIN = 10_000
"""Parts of a second to which sampled times are rounded."""
_WINDOW = "#b4530966"
_ROOM = "#b45309"
_LAST = "#7f1d1d"
_MARK = 0.006
"""Width of a mark for an instant, as a share of the axis."""
_STANDS = {"satisfied": "done", "violated": "broken"}


def timed_truth(formula: Formula, letters: Letters, end: float) -> dict[str, list[LetterInterval]]:
    """Return, for each sub-formula that is more than a name, when it is true: intervals with a letter {"true"}.

    Args:
        formula: With its bounds, written out for the team.
        letters: Each robot's letters over time; the last one is held after the flight.
        end: End of the flight, s.
    """
    reading = TeamLetters.of(formula, atoms(formula))
    times = sorted({Fraction(round(interval.start * _GRAIN), _GRAIN) for mine in letters.values() for interval in mine})
    scale = ticks_per_second([*times, *bounds_of(formula)])
    shown = tuple(frozenset({reading.letter(_at(letters, float(time)))}) for time in times)
    evaluated = TimedFormula(TeamInstants(tuple(2 * int(time * scale) for time in times), shown), int(end * scale), scale)
    result: dict[str, list[LetterInterval]] = {}
    nodes = [formula]
    while nodes:
        node = nodes.pop()
        if node.operator in ("name", "true", "false") or str(node) in result:
            continue
        if node.operator != "count":  # what is counted is each robot's own
            nodes.extend(reversed(node.arguments))
        spans = [
            (a / 2 / scale, end if b is None else min(b / 2 / scale, end)) for a, b in intervals(evaluated.sure(node).held)
        ]
        result[str(node)] = [LetterInterval(a, b, frozenset({"true"})) for a, b in spans if b > a]
    return result


def timed_stands(parts: Sequence[Formula], letters: Letters, times: Sequence[float]) -> list[list[tuple[str, str]]]:
    """Return how each part stands at some times: (part, how).

    Args:
        parts: Bounded in seconds, written out for the team.
        letters: Each robot's letters over time.
        times: s, in order.
    """
    states = [TimedState([part]) for part in parts]
    rows: list[list[tuple[str, str]]] = []
    for time in times:
        held = _at(letters, time)
        verdicts = [state.see(time, held) for state in states]
        rows.append([(str(part), _STANDS.get(verdict, "open")) for part, verdict in zip(parts, verdicts, strict=True)])
    return rows


def times_of_bounds(parts: Sequence[Formula], end: float) -> list[float]:
    """Return the times within a flight at which windows that are asked from its start begin and end, s.

    Args:
        parts: Bounded in seconds.
        end: End of the flight, s.
    """
    bounds = (float(bound) for part in parts if part.window is not None for bound in part.window if bound is not None)
    return sorted({bound for bound in bounds if 0.0 < bound <= end})


def _at(letters: Letters, time: float) -> dict[str, Letter]:
    """Return what each robot shows at a time."""
    grain = 0.5 / _GRAIN
    return {
        robot: next((interval.letter for interval in reversed(mine) if interval.start <= time + grain), mine[0].letter)
        for robot, mine in letters.items()
    }


@dataclass(frozen=True, slots=True)
class Serving:
    """Stay by which a visit that is due is made.

    Attributes:
        robot: Who makes it.
        region: Where.
        begin: When it is there for sure, within the window, s.
        left: Region that it came from; None for its start.
        latest: After this time no way from there is quick enough any more, s.
    """

    robot: str
    region: str
    begin: float
    left: str | None
    latest: float


def serving(mission: Mission, timelines: Mapping[str, Timeline], visit: DueVisit) -> Serving | None:
    """Return the stay that makes a visit first; None where none does for sure.

    Args:
        mission: Gives regions and limits.
        timelines: Of a certificate, one for each robot.
        visit: What is due.
    """
    travel, found = straight_travel(mission), list[Serving]()
    for robot, region in visit.places:
        before: list[tuple[float, str]] = []
        for begin, end, place in sorted(_sure(timelines[robot])):
            time = max(begin, visit.begin)
            if place == region and time <= visit.end and time + visit.lasts <= end:
                left = max((each for each in before if each[1] != region), default=(0.0, None))[1]
                found.append(Serving(robot, region, time, left, visit.end - travel(robot, left, region)))
                break
            before.append((end, place))
    return min(found, key=lambda each: each.begin, default=None)


def _sure(timeline: Timeline) -> Iterator[tuple[float, float, str]]:
    """Yield when a robot surely is in which region, s."""
    for region, initial in timeline.initial.items():
        since = 0.0 if initial == "must" else math.nan
        for change in timeline.changes:
            if change.region != region:
                continue
            if change.status == "must":
                since = float(change.time.high)
            elif not math.isnan(since):
                yield since, float(change.time.low), region
                since = math.nan
        if not math.isnan(since):
            yield since, math.inf, region


def timed_bars(certificate: Certificate, end: float) -> tuple[list[str], list[Bar]]:
    """Return a row for each conjunct that is bounded in seconds, and its bars: its window, what may still come later, and the points of no return.

    Args:
        certificate: With the claims `timing`.
        end: s, when the drawn flight ends.
    """
    mission = certificate.mission
    claims = [claim for claim in certificate.claims if claim.name == "timing"]
    due = [] if mission.spec.trace == "infinite" else due_visits(mission)
    rows, bars = list[str](), list[Bar]()
    for part, claim in zip(mission.timed_parts, claims, strict=True):
        row, (low, high) = str(part), (Fraction(0), None) if part.window is None else part.window
        rows.append(row)
        bars.append(Bar(row, float(low), end if high is None else min(float(high), end), _WINDOW, claim.sentence))
        for visit in due:
            stay = serving(mission, certificate.timelines, visit) if visit.asked == part and visit.end < math.inf else None
            if stay is None or stay.begin >= end:
                continue
            if claim.outcome == "holds" and claim.bound:
                until = min(stay.begin + claim.bound, end)
                text = f"{stay.robot} is in {stay.region} for sure; all may come {claim.bound:.3f} s later"
                bars.append(Bar(row, stay.begin, until, _ROOM, text))
            if 0.0 <= stay.latest < end:
                place = "its start" if stay.left is None else stay.left
                text = f"point of no return: at {stay.latest:.2f} s no way of {stay.robot} from {place} to {stay.region} is quick enough any more"
                bars.append(Bar(row, stay.latest, min(stay.latest + _MARK * end, end), _LAST, text))
    return rows, bars
