"""Bounds in seconds: the times at which a formula surely holds, on a reference clock, whatever the team does in the tube and clocks show.

`f U[a,b] g` holds at t if g does at some t' from t + a to t + b, and f from t until then. It also holds there if g does just after some t' before t +
b, and f until t' with it. Regions are closed, so what holds outside of one begins at no first instant. All else comes to that (`formulas`).

Of each part of a formula two sets are computed, of times at which it surely holds and at which its negation does; of other times nothing is known. A
letter may be shown while its place allows, earlier and later by the clock error: the reference clock is one more clock. (Coq: `windows_shown`, `windows_close`)

After the flight robots hold their last letters. No bound counts on that: operators with bounds see nothing after the flight, so nobody wins by landing.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from itertools import chain, groupby
from operator import itemgetter
from typing import Any

from .formulas import Proposition, Tree, show, window
from .statement import ZERO, Statement, few, require
from .team import Claim, places_of
from .timelines import Course

Cut = tuple[Any, bool]  # just before a time, which may be infinite, or just after it
Times = list[tuple[Cut, Cut]]  # a set of times: spans between cuts, in order and apart
BEGIN, FOREVER = (ZERO, False), (math.inf, False)


def within(spans: Iterable[tuple[Cut, Cut]], least: int = 1) -> Times:
    """Return the times that are in so many spans, at least (Coq: `within_exact`, `within_apart`)."""
    found, count = [BEGIN] if least <= 0 else list[Cut](), 0
    for cut, steps in groupby(sorted((cut, 1 - 2 * k) for span in spans for k, cut in enumerate(span)), key=itemgetter(0)):
        count += sum(step for _, step in steps)
        if (count >= least) != len(found) % 2:
            found.append(cut)
    return list(zip(found[::2], [*found[1::2], FOREVER], strict=False))


def without(times: Times) -> Times:
    """Return all other times (Coq: `without_exact`)."""
    cuts = [BEGIN, *chain.from_iterable(times), FOREVER]
    return [(low, high) for low, high in zip(cuts[::2], cuts[1::2], strict=True) if low != high]


def until(sets: Iterable[Times], bounds: tuple[Fraction, Fraction | float]) -> Times:
    """Return when something is held until another thing is reached, so many seconds from then (Coq: `until_exact`)."""
    (held, reached), (low, high) = sets, bounds
    few(len(held) * len(reached), "spans of time within bounds")
    found = [] if low else [*reached]
    for begin, end in held:
        for start, stop in reached:
            since, last = max(begin, start), min(stop, (end[0], True))  # it may be reached just where the first ends
            if since <= end and since < stop:
                found.append((max(begin, (since[0] - high, since[1])), (last[0] - low, last[1])))
    return within(span for span in found if span[0] < span[1])


def _shown(claim: Claim, asked: Proposition, error: Fraction) -> Iterator[Times]:
    """Yield when a proposition surely holds, and when its negation does: enough robots show it, or too few (Coq: `counted_between`)."""
    places = [claim.places(name, claim.names) for name in claim.robots if asked.robot in ("", name)]
    for wanted, least in ((True, asked.least), (False, len(places) - asked.least + 1)):
        sure: Times = []
        for one in places:
            others = [k for k, letter in enumerate(one.letters) if claim.counted[asked.counted].is_true(letter) != wanted]
            stops = [FOREVER if k in one.final else (one.windows[k][1] + error, True) for k in others]
            starts = [(max(one.windows[k][0] - error, ZERO), False) for k in others]
            sure += without(within(zip(starts, stops, strict=True)))
        yield within(sure, least)


def surely(claim: Claim, flight: tuple[Fraction, Fraction]) -> Times:
    """Return when a formula surely holds, by when a flight ends on clocks that are off by an error (Coq: `surely_sound`, `surely_lasts`)."""
    landing = flight[0] - flight[1]  # from when on a clock may show that it has ended
    found, propositions = list[Times](), [*claim.table.propositions]
    for sign, parts in claim.table.nodes:
        name, low, high = window(sign)
        for negated in (False, True) if name != "holds" else ():
            sets = [found[part ^ negated] for part in parts]
            if name == "and":
                found.append(within(chain.from_iterable(sets), 1 if negated else len(sets)))
                continue
            sets = [within([*one, (BEGIN, (landing, True))], 2) if high < math.inf else one for one in sets]
            times = without(until(map(without, sets), (low, high))) if negated else until(sets, (low, high))
            if sign != name:  # what holds when the flight ends holds from then on
                flown = within([*times, (BEGIN, (landing - low, True))], 2)
                times = [(start, FOREVER if stop == (landing, True) else stop) for start, stop in flown]
            found.append(times)
        if name == "holds":
            found += _shown(claim, propositions[parts[0]], flight[1])
    return found[claim.table.root ^ 1]


def check_timing(asked: tuple[Statement, Tree], courses: Mapping[str, Course]) -> str:
    """Check that a formula with bounds holds at time 0 of every flight that the robots' timelines leave possible."""
    statement, tree = asked
    require(not statement.lasso, "bounds in seconds are not followed through laps")
    require(not any(one.cuts for one in statement.robots.values()), "a pause between parts is time that bounds would count")
    require(statement.joint or len(statement.robots) == 1, "robots that are read one by one show no letter at a time")
    claim = Claim(statement, tree, lambda robot, names: places_of(courses[robot].timeline, names))
    times = surely(claim, (max(course.end for course in courses.values()), statement.clock_error))
    since = f"from {float(times[0][0][0]):.4f} s on" if times else "at no time"
    require(times and times[0][0] == BEGIN, f"{show(tree)} is proved {since}, not at 0")
    return f"At time 0 of every flight {show(tree)} holds."
