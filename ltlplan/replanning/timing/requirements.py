"""Mixed-integer programme for what a formula asks of the times of one flight; HiGHS solves it.

The order of what robots show is the flight's; chosen are how many times slower it is flown, how long robots hover where, and which stays
serve which operators. A choice is a binary variable, and what follows from it is switched off where the variable is 0.
Not all formulas are written exactly: some ask for more here (one stay for a whole window), and `U` under `G` for nothing. The judge decides.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_array

from ltlplan.replanning.timing.horizons import DUAL
from ltlplan.replanning.timing.presence import HoverPlace, Instant, Presence, Stay
from ltlplan.replanning.timing.stays import all_chains, dwell_of, lap_chains, names_of, serving
from verify.data.language.formula import Formula

_SECONDS = 3.0
"""For how long HiGHS looks for times."""
_SPARE = (0.001, 0.2)
"""s that are kept before each bound: at least, and up to what more is worth nothing."""
_WORTH = 1000.0, 500.0
"""What flying twice as slowly is worth, and a second before each bound, against a second of hovering."""

_REST = 0.001
"""s; the least hover."""

Guard = tuple[int, ...]
"""Binary variables that all have to be 1 for something to be asked."""


@dataclass(frozen=True, slots=True)
class Time:
    """A time that is linear in the variables: a constant and a share of each."""

    constant: float = 0.0
    shares: Mapping[int, float] = field(default_factory=dict)

    def __add__(self, seconds: float) -> Time:
        return Time(self.constant + seconds, self.shares)


@dataclass(frozen=True, slots=True)
class Times:
    """Times that were chosen.

    Attributes:
        stretch: How many times slower the team flies.
        hovers: For how long robots hover where, s; those that do.
        late: By how much deadlines are missed that may be, s; those that are.
    """

    stretch: float
    hovers: dict[HoverPlace, float]
    late: dict[Formula, float]


class Requirements:
    """A programme under construction: variables, rows, and what the formula asks.

    Args:
        flight: What each robot shows when.
        clock_error: How far two clocks may be apart, s.
        stretches: How many times slower the team flies at the least, below 1 for faster, and at most.
        reach: s by which nothing that is asked lies later, with all hovers that may help.
        resting: Where robots hover in this flight: they go on to rest there, as what they show else would be another flight's.
    """

    def __init__(
        self, flight: Mapping[str, Presence], clock_error: float, stretches: tuple[float, float], reach: float,
        resting: Collection[HoverPlace] = (),
    ) -> None:  # fmt: skip
        self._flight, self._error, self._reach = flight, clock_error, reach
        self._variables: list[tuple[float, float, bool, float]] = []  # least, greatest, whether whole, what 1 more costs
        self._rows: list[tuple[dict[int, float], float]] = []
        self._stretch = self._variable(*stretches, worth=-_WORTH[0])
        self._spare = self._variable(*_SPARE, worth=-_WORTH[1])
        self._late: int | None = None
        self._delays: dict[Formula, int] = {}
        self._hovers: dict[HoverPlace, int] = {}
        places = {place for presence in flight.values() for place in (*presence.end.hovers, *presence.again)}
        for place in sorted(places):
            self._hovers[place] = self._variable(_REST if place in resting else 0.0, reach, worth=1.0)
        hovered = [Time(0.0, {self._hovers[place]: 1.0 for place in presence.again}) for presence in flight.values()]
        self._longer = self._variable(0.0, reach, worth=1.0)  # a team's laps are, for their hovers: as who hovers longest
        self._equal_the_last(Time(0.0, {self._longer: 1.0}), hovered)
        ends = [self.time(presence.end) for presence in flight.values()]
        self._flown = max(presence.end.moving for presence in flight.values())
        laps = [self.time(presence.lap) for presence in flight.values() if presence.lap is not None]
        self._lap = laps[0] if laps else None  # those of a team end together
        self._end = Time(0.0, {self._variable(0.0, 4.0 * reach): 1.0})
        self._equal_the_last(self._end, ends)

    def time(self, instant: Instant) -> Time:
        """Return a time of the flight."""
        shares = {self._stretch: instant.moving}
        shares.update({self._hovers[place]: share for place, share in instant.hovers.items()})
        if instant.laps:
            shares[self._longer] = float(instant.laps)
        return Time(0.0, shares)

    def _equal_the_last(self, last: Time, times: Sequence[Time]) -> None:
        """Ask that a time is the last one of some."""
        for time, chosen in zip(times, self._alternatives((), len(times)), strict=True):
            self._before(time, last)
            self._before(last, time, chosen)

    def ask(self, formula: Formula, *, late: bool = False) -> None:
        """Ask that a formula holds of the flight.

        Args:
            formula: What is bounded in seconds.
            late: Whether its deadlines may be missed, by as little as can be.
        """
        start = Time()
        self._late = self._variable(0.0, self._reach, worth=1e5) if late else None
        if self._late is not None:
            self._delays[formula] = self._late
        self._during(formula, start, start, (), negated=False)

    def solve(self) -> Times | None:
        """Return times that keep what is asked, the gentlest, with the shortest hovers; None where none were found."""
        rows = [(i, j, share) for i, (shares, _) in enumerate(self._rows) for j, share in shares.items()]
        i, j, shares = (np.array(column) for column in zip(*rows, strict=True))
        matrix = csr_array((shares, (i, j)), shape=(len(self._rows), len(self._variables)))
        low, high, whole, worth = (np.array(column) for column in zip(*self._variables, strict=True))
        found = milp(
            c=worth,
            constraints=LinearConstraint(matrix, ub=[most for _, most in self._rows]),  # pyright: ignore[reportArgumentType]  # SciPy takes sequences
            bounds=Bounds(low, high),  # pyright: ignore[reportArgumentType]  # SciPy takes arrays
            integrality=whole.astype(int),
            options={"time_limit": _SECONDS},
        )
        if found.x is None:
            return None
        hovers = {place: float(found.x[index]) for place, index in self._hovers.items() if found.x[index] > 1e-4}
        late = {part: float(found.x[index]) for part, index in self._delays.items() if found.x[index] > 1e-3}
        return Times(float(found.x[self._stretch]), hovers, late)

    def _variable(self, low: float, high: float, *, whole: bool = False, worth: float = 0.0) -> int:
        self._variables.append((low, high, whole, worth))
        return len(self._variables) - 1

    def _choice(self) -> int:
        return self._variable(0.0, 1.0, whole=True)

    def _before(self, one: Time, other: Time, guard: Guard = (), *, spare: bool = False) -> None:
        """Ask that one time is no later than another; `spare`: with something to spare and for clocks that are apart."""
        shares = dict(one.shares)
        for index, share in other.shares.items():
            shares[index] = shares.get(index, 0.0) - share
        most = other.constant - one.constant
        if spare:
            shares[self._spare] = shares.get(self._spare, 0.0) + 1.0
            most -= self._error
        self._row(shares, most, guard)

    def _row(self, shares: dict[int, float], most: float, guard: Guard) -> None:
        large = 4.0 * self._reach
        for index in guard:
            shares[index] = shares.get(index, 0.0) + large
        self._rows.append((shares, most + large * len(guard)))

    def _one_of(self, choices: Sequence[int], guard: Guard, least: int = 1) -> None:
        self._row(dict.fromkeys(choices, -1.0), -float(least), guard)

    def _alternatives(self, guard: Guard, count: int) -> Iterator[Guard]:
        """Yield a guard for each of so many alternatives, of which one is to hold."""
        choices = [self._choice() for _ in range(count)]
        self._one_of(choices, guard)
        for chosen in choices:
            yield (*guard, chosen)

    def _during(self, node: Formula, begin: Time, end: Time, guard: Guard, *, negated: bool) -> None:
        """Ask that a formula, or its negation, holds from one time to another, both included."""
        parts = node.arguments
        match node.operator:
            case "true" | "false":
                if (node.operator == "true") == negated:
                    self._one_of((), guard)
            case "!":
                self._during(parts[0], begin, end, guard, negated=not negated)
            case "name":
                self._shown(node, begin, end, guard, negated=negated)
            case "count":
                assert node.bound is not None
                robots, least = list(self._flight), node.bound[1]
                choices = [self._choice() for _ in robots]
                self._one_of(choices, guard, len(robots) - least + 1 if negated else least)
                for robot, chosen in zip(robots, choices, strict=True):
                    self._during(parts[0].of(robot), begin, end, (*guard, chosen), negated=negated)
            case "&" | "|" | "->":
                signs = [negated != (node.operator == "->" and index == 0) for index in range(len(parts))]
                signed = list(zip(parts, signs, strict=True))
                if (node.operator == "&") != negated:
                    for part, sign in signed:
                        self._during(part, begin, end, guard, negated=sign)
                else:
                    self._either(signed, begin, end, guard)
            case "xor" | "<->":
                same = (node.operator == "<->") != negated
                for within, sign in zip(self._alternatives(guard, 2), (False, True), strict=True):
                    self._during(parts[0], begin, end, within, negated=sign)
                    self._during(parts[1], begin, end, within, negated=sign == same)
            case _:
                self._temporally(node, begin, end, guard, negated=negated)

    def _either(self, parts: Sequence[tuple[Formula, bool]], begin: Time, end: Time, guard: Guard) -> None:
        """Ask for one of several things all the time; where one is that something is not shown, for another only while it may be."""
        if begin is not end:
            absent = [part for part in parts if _is_absence(*part)]
            others = [part for part in parts if not _is_absence(*part)]
            if absent and others:
                for stay, first, last, within in self._while_shown(absent[0][0], begin, end, guard):
                    since = begin if stay.begin is None else first + -self._error
                    until = end if stay.end is None else last + self._error
                    self._either(others, since, until, within)
                return
        for within, (part, sign) in zip(self._alternatives(guard, len(parts)), parts, strict=True):
            self._during(part, begin, end, within, negated=sign)

    def _shown(self, name: Formula, begin: Time, end: Time, guard: Guard, *, negated: bool) -> None:
        """Ask that a robot, or none, shows a proposition all the time."""
        if not negated:
            stays = list(self._stays(name, sure=True))
            for stay, within in zip(stays, self._alternatives(guard, len(stays)), strict=True):
                first, last = self._ends(stay)
                if stay.begin is not None:
                    self._before(first, begin, within, spare=True)
                self._before(end, last, within, spare=stay.end is not None)
            return
        for stay in self._stays(name, sure=False):
            self._apart(stay, begin, end, self._alternatives(guard, 2))

    def _while_shown(self, absence: Formula, begin: Time, end: Time, guard: Guard) -> Iterator[tuple[Stay, Time, Time, Guard]]:
        """Yield each stay in which something may be shown that is to be absent, with its ends, and a guard for where it meets a span."""
        for name in names_of(absence.arguments[0] if absence.operator == "!" else absence):
            for stay in self._stays(name, sure=False):
                alternatives = self._alternatives(guard, 3)
                if self._apart(stay, begin, end, alternatives):
                    yield stay, *self._ends(stay), next(alternatives)

    def _apart(self, stay: Stay, begin: Time, end: Time, guards: Iterator[Guard]) -> bool:
        """Ask that a stay is over before a span begins, or begins after it has ended; False where it begins later whatever is chosen."""
        first, last = self._ends(stay)
        if end is self._lap and stay.begin is not None and stay.begin.moving >= self._moving(end):
            return False  # after the lap up to whose end something is asked
        self._before(last, begin, next(guards), spare=True)
        self._before(end, first, next(guards), spare=True)
        return True

    def _stays(self, name: Formula, *, sure: bool) -> Iterator[Stay]:
        for robot, presence in self._flight.items():
            if name.robot in ("", robot):
                yield from (presence.sure if sure else presence.possible).get(name.name, ())

    def _ends(self, stay: Stay) -> tuple[Time, Time]:
        first = Time(-self._error) if stay.begin is None else self.time(stay.begin)
        return first, self._end if stay.end is None else self.time(stay.end)

    def _temporally(self, node: Formula, begin: Time, end: Time, guard: Guard, *, negated: bool) -> None:
        """Ask for a temporal operator, from each time of a span on."""
        low, high = (Fraction(0), None) if node.window is None else node.window
        after, within = float(low), None if high is None else float(high)
        kind = DUAL[node.operator] if negated else node.operator
        *first, last = node.arguments
        if self._lap is not None and after >= self._flown:
            return  # many laps later; the judge decides
        if kind == "G":
            self._during(last, begin + after, self._last_asked(end, within, guard), guard, negated=negated)
            return
        held, reached = (last, node.arguments) if kind in ("R", "M") else (next(iter(first), None), (last,))
        if kind in ("R", "W") and held is not None:  # for ever, or until the other one too: `q M p` of R; of W, p until q
            always, guard = self._alternatives(guard, 2)
            self._during(Formula("F" if negated else "G", (held,), window=node.window), begin, end, always, negated=negated)
        self._until(held, reached, (begin, end), (after, within), guard, negated)

    def _last_asked(self, end: Time, within: float | None, guard: Guard) -> Time:
        """Return the time up to which something has to hold; for ever is the flight, or its first lap, which all others repeat."""
        if within is None:
            return self._end if self._lap is None else self._lap
        if self._lap is not None and within >= self._flown:
            return self._end
        self._before(end + within, self._end, guard, spare=True)
        return end + within

    def _moving(self, time: Time) -> float:
        """Return a time without all hovers at the pace that was flown, s."""
        return time.constant + time.shares.get(self._stretch, 0.0)

    def _deadline(self, begin: Time, within: float) -> Time:
        """Return the end of a window, later by what deadlines may be missed by."""
        deadline = begin + within
        return deadline if self._late is None else Time(deadline.constant, {**deadline.shares, self._late: 1.0})

    def _until(
        self, held: Formula | None, reached: Sequence[Formula], span: tuple[Time, Time], window: tuple[float, float | None],
        guard: Guard, negated: bool,
    ) -> None:  # fmt: skip
        """Ask that something is reached within a window of each time of a span, and something else held until then."""
        (begin, end), (after, within) = span, window
        if begin is not end:
            self._covered(reached, span, window, guard, negated)
            return
        then = Time(0.0, {self._variable(0.0, 4.0 * self._reach): 1.0})
        self._before(begin + after, then, guard)
        if within is not None:
            self._before(then, self._deadline(begin, within), guard)
        flown = self._end if after > 0 else self._end + -self._error  # what is asked for has to be flown on every clock
        self._before(then, flown, guard, spare=after > 0)
        for part in reached:
            self._during(part, then, then, guard, negated=negated)
        if held is not None and (held,) != tuple(Formula("!", (part,)) for part in reached):
            self._during(held, begin, then, guard, negated=negated)
        elif held is not None and after > 0:  # `!p U[a,b] p`: up to the first p there is none
            self._during(held, begin, begin + after, guard, negated=negated)

    def _covered(
        self, reached: Sequence[Formula], span: tuple[Time, Time], window: tuple[float, float | None], guard: Guard, negated: bool
    ) -> None:  # fmt: skip
        """Ask that at each time of a span a stay that serves it is within a window: a chain of stays, each long enough for a dwell."""
        if len(reached) == 1 and _is_absence(reached[0], negated) and window[0] == 0 and window[1] is not None:
            for _, first, last, short in self._while_shown(reached[0], *span, guard):
                self._before(last + self._error, first + window[1], short, spare=True)
            return
        dwell, served = dwell_of(reached[0]) if len(reached) == 1 and not negated else (0.0, None)
        rows = () if served is None else serving(served, self._flight, laps=self._lap is not None)
        if not rows:
            return  # asked for nothing here; the judge decides
        (begin, end), (after, within) = span, window
        if self._lap is None:
            chains = [chain for row in rows for chain in all_chains(row)]
        else:
            chains = lap_chains(rows[0], (self._moving(begin), self._moving(end)), later=after > 0)
        for chain, chosen in zip(chains, self._alternatives(guard, len(chains)), strict=True):
            since = begin
            for number, stay in enumerate(chain):
                first, last = self._ends(stay)
                last += -dwell
                if dwell:
                    self._before(first, last, chosen, spare=True)
                if within is not None and stay.begin is not None:
                    self._before(first, self._deadline(since, within), chosen, spare=True)
                if number == len(chain) - 1:
                    self._before(end + after, last, chosen, spare=stay.end is not None)
                since = last + -(after + self._error)


def _is_absence(node: Formula, negated: bool) -> bool:
    """Return whether a part says that none of some propositions are shown."""
    if node.operator == "!":
        node, negated = node.arguments[0], not negated
    return negated and bool(names_of(node))
