"""Parts of a team's flights that are uploaded at once: all of it, or part after part while robots hover."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flight.exports.target import Request
from verify.data import Trajectory
from verify.data.trajectory import HOVER, PAUSE


@dataclass(frozen=True, slots=True)
class Part:
    """Part of a flight that is uploaded at once.

    Attributes:
        ending: What its files are called behind a robot's name; nothing for a flight that is whole.
        paths: What each robot flies.
        starts: Where each robot begins it: x, y, z in m and heading in rad.
        duration: s until the last robot has finished; a hover that was put behind it is a pause already.
    """

    ending: str
    paths: Mapping[str, Trajectory]
    starts: Mapping[str, tuple[float, ...]]
    duration: float


def parts_of(request: Request) -> tuple[Part, ...]:
    """Return what is uploaded, in the order in which it is flown for the first time; a lap once.

    A part of one piece, which some readers refuse, is followed by a hover where the next part begins: a pause, which
    the certificate covers.

    Args:
        request: The export.
    """
    team = request.team
    if not any(path.cuts for path in team.values()):
        return (_part("", request.flown, max(path.duration for path in request.flown.values())),)
    ranges = {name: path.parts for name, path in team.items()}
    found: list[Part] = []
    for number in range(min(map(len, ranges.values()))):
        paths = {name: _with_two_pieces(path, *ranges[name][number]) for name, path in team.items()}
        spans = [(path.knots, *ranges[name][number]) for name, path in team.items()]
        lengths = [float(knots[end] - knots[begin]) for knots, begin, end in spans]
        found.append(_part(f"-part{number + 1}", paths, max(lengths)))
    return tuple(found)


def order_of(request: Request) -> tuple[int, ...]:
    """Return which of the parts are flown one after another, from 0: a lap as often as laps are flown.

    Args:
        request: The export.
    """
    cut = [path for path in request.team.values() if path.cuts]
    return cut[0].flown_parts(request.laps) if cut else (0,)


def _part(ending: str, paths: Mapping[str, Trajectory], duration: float) -> Part:
    starts = {name: tuple(map(float, path.evaluate(0.0))) for name, path in paths.items()}
    return Part(ending, paths, starts, duration)


def _with_two_pieces(path: Trajectory, begin: int, end: int) -> Trajectory:
    part = path.part(begin, end)
    if len(part) > 1:
        return part
    after = path.cycle if end == len(path) else end
    hover = np.zeros((1, 4, 8))
    last = part.evaluate(part.duration).astype(np.float32) if after is None else path.coefficients[after, :, 0]
    hover[0, :, 0] = last
    return Trajectory(np.append(part.durations, HOVER), np.concatenate([part.coefficients, hover]))


def notes_on(request: Request, parts: tuple[Part, ...]) -> tuple[str, ...]:
    """Return what a person has to know of parts; nothing where the flight is whole.

    Args:
        request: The export.
        parts: What is uploaded.
    """
    if len(parts) == 1:
        return ()
    flown = ", ".join(str(part + 1) for part in order_of(request))
    others = [name for name in request.mission.agents if name not in request.team]
    also = (f"{', '.join(others)} pause with them, and start each part at the same instant.",) if others else ()
    return (
        *also,
        f"The vehicles do not hold this flight at once: it is in {len(parts)} parts, uploaded one after another while all robots hover. They are "
        f"flown in this order: {flown}.",
        "Each part is started by all robots at the same instant, once each has its part and is within half a margin of where the part begins. Pauses "
        f"between parts are certified for any length; in an endurance each counts {PAUSE:g} s.",
        "Before the memory is written anew, robots have to hold by a go-to where they are: at the end of a trajectory the firmware still reads it.",
    )
