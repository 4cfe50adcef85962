"""Returns that one robot's laps cannot make in time, known before anything is planned: the straight way to another place and back takes longer."""

from __future__ import annotations

from collections.abc import Iterator

from ltlplan.systems.gaps import straight_travel
from verify.data import Mission
from verify.data.language.formula import Formula
from verify.logic.explanation import show


def impossible_returns(mission: Mission) -> str:
    """Return which places cannot be shown again in time, as sentences; empty where that is not proved.

    Of `G F[a,b] p & G F q`, whatever bounds q has, one robot leaves p again and again, for at least the way to q and back.

    Args:
        mission: Its formula is bounded in seconds.
    """
    if len(mission.agents) > 1:
        return ""
    travel, (robot,) = straight_travel(mission), mission.agents
    places = {region for part in (*mission.timed_parts, *mission.formula.conjuncts()) for region, _ in _returns(mission, part)}
    said: list[str] = []
    for part in mission.timed_parts:
        for region, most in _returns(mission, part):
            if most is None:
                continue
            way, other = max(
                ((2 * travel(robot, region, other), other) for other in sorted(places - {region})), default=(0.0, "")
            )
            if way > most + 1e-6:
                said.append(
                    f"`{show(part)}` cannot hold: by straight ways, at the greatest speed, {other} and back take {way:.3g} s, {way - most:.3g} s more."
                )
    return " ".join(said)


def _returns(mission: Mission, part: Formula) -> Iterator[tuple[str, float | None]]:
    """Yield a region that a conjunct asks for again and again, with the longest time between, s; None for any."""
    reached = part.arguments[0] if part.operator == "G" and part.window is None else None
    if reached is None or reached.operator != "F":
        return
    shown = reached.arguments[0]
    if shown.operator == "G" and (shown.window is None or shown.window[0] == 0):
        shown = shown.arguments[0]  # a dwell
    if shown.operator == "name" and shown.name in mission.all_regions:
        high = None if reached.window is None else reached.window[1]
        yield shown.name, None if high is None else float(high)
