"""Watching a piece of which no words are proved yet: the tubes of those who fly it, and that nobody comes too near."""

from __future__ import annotations

from collections.abc import Collection

from flight.link.link import Link
from flight.link.phases import FLIGHT, Watched
from flight.link.record import Record
from flight.link.tracking_monitor import Watch
from flight.monitoring.monitor import Monitor
from verify.flight_segments import Piece
from verify.recordings.planned_paths import planned_paths


def watch_on(link: Link, record: Record, piece: Piece, began: float, *, without: Collection[str]) -> Watch:
    """Return who watches what is flown, from now on.

    Args:
        link: To the robots.
        record: Takes in what is seen.
        piece: What is flown.
        began: When the flight began, s of the link's clock.
        without: Robots that have left.
    """
    begin, now = began + float(piece.start), link.now()
    flown = {name: path for name, path in piece.team.items() if name not in without}
    begun = {name: piece.mission.agents[name] for name in flown}
    planned = planned_paths(piece.mission.model_copy(update={"agents": begun}), flown)
    here = {  # where they are: at their starts there may be something by now
        name: agent.model_copy(update={"start": tuple(flown[name].evaluate(max(now - begin, 0.0))[:3].tolist())})
        for name, agent in begun.items()
    }
    spec = piece.mission.spec.model_copy(update={"formula": "true", "soft": None})
    world = piece.mission.model_copy(update={"agents": here, "spec": spec, "obstacles": {}})
    monitor = Monitor(
        world, (), margin=world.margin, measurement=link.accuracy,
        planned_acceleration=max(path.acceleration for path in planned.values()),
    )  # fmt: skip
    watch = Watch(link, Watched(FLIGHT, flown, world.margin, monitor), begin, record, since=max(now, begin))
    watch.see_before([link.pose(name) for name in flown])
    return watch
