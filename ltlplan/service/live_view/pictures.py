"""Picture of a flight in the air: the world as it is now, and the tubes that are flown. A worker draws it, never the process that serves."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from flight.monitoring.letters import RegionMasks, region_letters
from flight.pictures import robot_colour, scene
from ltlplan.service.live_view.messages import Shown
from ltlplan.service.views.watching import drawn, radii
from verify.data import BadInput, parse_mission

if TYPE_CHECKING:
    from verify.data import Mission
    from verify.data.progress import Progress

MOST_PLANNED = 500
"""Planned entries into regions that are listed."""


def live_picture(shown: str, report: Progress) -> str:
    """Return a picture as JSON.

    Args:
        shown: What it is made of (`Shown`), as JSON.
        report: Receives what is done.

    Raises:
        BadInput: It is no such JSON.
        MissionError: Its mission has faults.
    """
    report("drawing the flight", 0.0)
    try:
        what = Shown.model_validate_json(shown)
    except ValidationError as error:
        raise BadInput(f"What a flight shows was not understood: {error.errors()[0]['msg']}.") from error
    mission = parse_mission(what.mission)
    tracks = {name: track for name, track in what.tracks.items() if name in mission.agents}
    data: dict[str, Any] = {  # of any type: JSON nests
        "number": what.number,
        "mission": mission.name,
        "formula": mission.spec.formula or mission.sequence,
        **drawn(scene(mission, {})),
        "robots": list(mission.agents),
        "radii": radii(mission),
        "colours": [robot_colour(index) for index, _ in enumerate(mission.agents)],
        "margin": what.margin,
        "tracks": {name: {"step": track.step, "points": [list(p) for p in track.points]} for name, track in tracks.items()},
        "bodies": _bodies(mission),
        "planned": _planned(mission, {name: (track.step, np.array(track.points)) for name, track in tracks.items()}),
    }
    return json.dumps(data, allow_nan=False, separators=(",", ":"))


def _bodies(mission: Mission) -> dict[str, dict[str, Any]]:  # of any type: JSON nests
    """Return what may be told to move: its kind, and its centre in m."""
    return {
        name: {"kind": kind, "center": list(body.center)}
        for kind in ("regions", "hoops", "obstacles")
        for name, body in getattr(mission, kind).items()
    }


def _planned(mission: Mission, tracks: Mapping[str, tuple[float, np.ndarray[Any, np.dtype[np.float64]]]]) -> list[list[Any]]:
    """Return when each robot is to enter which regions: s since what is flown began, the robot, and the names; sampled, not proved."""
    masks, letters = RegionMasks(mission), region_letters(mission)
    found: list[list[Any]] = []
    for name, (step, points) in tracks.items():
        before = frozenset[str]()
        for index, mask in enumerate(masks.of(points.T).tolist()):
            now = letters[mask]
            if (new := now - before) and index:
                found.append([round(index * step, 2), name, ", ".join(sorted(new))])
            before = now
    return sorted(found)[:MOST_PLANNED]
