"""Stays that serve what a formula asks for, in chains: at each time of a span one of them has begun, and not ended yet, within a window."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ltlplan.replanning.timing.presence import Presence, Stay
from verify.data.language.formula import Formula

_LATER = 3
"""Stays of laps that are tried, from the first one on, where something is to be reached no sooner than some time from now."""


def dwell_of(node: Formula) -> tuple[float, Formula | None]:
    """Return for how long something is to last, s, and that; None where it is asked for later than at once.

    Args:
        node: What is to be reached.
    """
    if node.operator != "G":
        return 0.0, node
    if node.window is None or node.window[0] > 0 or node.window[1] is None:
        return 0.0, None
    return float(node.window[1]), node.arguments[0]


def names_of(node: Formula) -> tuple[Formula, ...]:
    """Return the propositions of which a formula asks for one; none where it asks for anything else.

    Args:
        node: The formula.
    """
    if node.operator == "!":
        return names_of(node.arguments[0].arguments[0]) if node.arguments[0].operator == "!" else ()
    if node.operator == "name":
        return (node,)
    if node.operator != "|":
        return ()
    parts = [names_of(part) for part in node.arguments]
    return tuple(name for part in parts for name in part) if all(parts) else ()


def serving(node: Formula, flight: Mapping[str, Presence], *, laps: bool) -> tuple[tuple[Stay, ...], ...]:
    """Return stays that serve a formula, in order: a row for each robot, or of laps, in which no hover changes robots' order, one of all.

    Args:
        node: Propositions, joined by `|`, or of laps a count of them, too.
        flight: What each robot shows when.
        laps: Whether they fly laps.

    Returns:
        None where the formula asks for anything else.
    """
    least = 1
    if laps and node.operator == "count":
        assert node.bound is not None
        node, least = node.arguments[0], node.bound[1]
    names = names_of(node)
    if not names:
        return ()
    found = (
        {id(stay): stay for name in names if name.robot in ("", robot) for stay in presence.sure.get(name.name, ())}
        for robot, presence in flight.items()
    )
    rows = tuple(tuple(sorted(stays.values(), key=_begins)) for stays in found)
    return (_in_common(rows, least),) if laps else rows


def all_chains(row: Sequence[Stay]) -> list[tuple[Stay, ...]]:
    """Return all stretches of a row.

    Args:
        row: Stays of one robot.
    """
    return [tuple(row[i:j]) for i in range(len(row)) for j in range(i + 1, len(row) + 1)]


def lap_chains(row: Sequence[Stay], span: tuple[float, float], *, later: bool) -> list[tuple[Stay, ...]]:
    """Return stretches of a row that may serve a span.

    Args:
        row: Stays in common; each ends after the one before.
        span: Begin and end, s of flight without hovers.
        later: Whether what is asked for may be reached no sooner than some time from now.
    """
    begin, end = (next((i for i, stay in enumerate(row) if _ends(stay) >= time), len(row)) for time in span)
    more = _LATER if later else 1
    return [tuple(row[i : j + 1]) for i in range(begin, begin + more) for j in range(max(i, end), end + more) if j < len(row)]


def _in_common(rows: Sequence[Sequence[Stay]], least: int) -> tuple[Stay, ...]:
    """Return when so many robots stay at once, of flights that are slowed as a whole."""
    events = sorted(
        [(_begins(stay), 0, stay.begin) for row in rows for stay in _united(row)]
        + [(_ends(stay), 1, stay.end) for row in rows for stay in _united(row)],
        key=lambda event: event[:2],
    )
    found: list[Stay] = []
    depth, begun = 0, None
    for _, ends, instant in events:
        if ends:
            if depth == least:
                found.append(Stay(begun, instant))
            depth -= 1
        else:
            depth += 1
            begun = instant if depth == least else begun
    return tuple(found)


def _united(row: Sequence[Stay]) -> list[Stay]:
    """Return the stays of one robot, overlapping ones joined."""
    found: list[Stay] = []
    for stay in row:
        if found and _begins(stay) <= _ends(found[-1]):
            longest = max(found[-1], stay, key=_ends)
            found[-1] = Stay(found[-1].begin, longest.end)
        else:
            found.append(stay)
    return found


def _begins(stay: Stay) -> float:
    return -1.0 if stay.begin is None else stay.begin.moving


def _ends(stay: Stay) -> float:
    return float("inf") if stay.end is None else stay.end.moving
