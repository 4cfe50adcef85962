"""Joints of pieces, of parts and of laps, and how long a flight lasts; each jump is the exact difference of two derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

from .flights import Path, Team
from .limits import PI
from .refused import require
from .statement import ZERO

JUMPS = (Fraction(1, 10_000), Fraction(1, 1_000), Fraction(1, 100), Fraction(1, 10))
"""Greatest jumps in position (m), velocity, acceleration and jerk, and the same in rad for heading, its rate and its acceleration."""
PAUSE, CLIMB_AND_LANDING = 60, 11
"""s that an endurance counts for a pause between parts, and beside the flight."""


def _require(order: int, one: Sequence[Fraction], other: Sequence[Fraction], where: str, turns: bool = False) -> None:
    """Refuse a jump that is too large; `turns` leaves full turns of the heading aside."""
    x, y, z, yaw = (b - a for a, b in zip(one, other, strict=True))
    full = 2 * PI * round(yaw / (2 * PI)) if turns else ZERO
    # pi is off by so little that a million turns are off by less than 1e-30
    near = x * x + y * y + z * z <= JUMPS[order] ** 2 and (order == 3 or abs(yaw - full) <= JUMPS[order] - abs(full) / 10**30)
    require(near, f"derivative {order} of place or heading jumps {where} by more than {float(JUMPS[order]):g}")


def check_continuity(path: Path, team: Team) -> str:
    """Check all jumps, from rest at the start to rest at the end, or to where the lap begins; laps of several robots begin and end at rest."""
    robot, zero = path.robot, [ZERO] * 4
    for order in range(4):
        ends = [piece.ends(order) for piece in path.pieces]
        last = ends[-1][1]
        _require(order, zero if order else [*robot.start, robot.yaw], ends[0][0], "at the start", turns=not order)
        for number, ((_, before), (after, _)) in enumerate(pairwise(ends)):
            _require(order, before, after, f"between pieces {number} and {number + 1}")
        if robot.cycle is None:
            _require(order, last, zero if order else [*(robot.end or last[:3]), last[3]], "at the end")
        elif not order or len(team.paths) == 1:
            _require(order, last, ends[robot.cycle][0], "where the lap ends", turns=not order)
        else:
            _require(order, last, zero, "where the lap ends")
            _require(order, ends[robot.cycle][0], zero, "where the lap begins")
    return f"The pieces of {path.name} join, from rest at its start."


def check_parts(path: Path, team: Team) -> str:
    """Check that a flight in parts is cut where all are, and rests at each cut, and that its vehicle holds each part."""
    robot, cuts, size = path.robot, list(path.robot.cuts), len(path.pieces)
    in_order = cuts == sorted(set(cuts)) and all(cut < size for cut in cuts) and (robot.cycle is None or robot.cycle in cuts)
    require(in_order, "its cuts are no pieces in order, or its lap begins with none of them")
    instants = {tuple(one.pieces[cut].start for cut in one.robot.cuts if cut < len(one.pieces)) for one in team.paths.values()}
    require(len(instants) == 1, "robots are cut at different instants")
    longest = max(b - a for a, b in pairwise(sorted({0, *cuts, size})))
    fits = robot.limits.pieces is None or longest <= robot.limits.pieces
    require(fits, f"a part has {longest} pieces; its vehicle holds {robot.limits.pieces}")
    seam = [] if robot.cycle is None else [(size - 1, robot.cycle)]
    for before, after in [*((cut - 1, cut) for cut in cuts if cut), *seam]:
        where = f"at the cut before piece {after}"
        for order in range(4):
            end, begin = path.pieces[before].ends(order)[1], path.pieces[after].ends(order)[0]
            require(not order or max(abs(end[3]), abs(begin[3])) <= JUMPS[order], f"its heading turns {where}")
            for side in (end, begin):
                _require(order, side, [*(begin[:3] if not order else [ZERO] * 3), side[3]], where)
    return f"{path.name} rests at each of {len(cuts)} cuts."


def check_endurance(team: Team, path: Path) -> str:
    """Check that a robot lands in time, all laps counted, and all pauses of the robot that pauses most."""
    total = team.end + CLIMB_AND_LANDING + (0 if path.lap is None else (team.repeat - 1) * (team.end - path.lap))
    pauses = [0]
    for robot in (other.robot for other in team.paths.values()):
        begins, first = {0, *robot.cuts} if robot.cuts else set[int](), robot.cycle or 0
        again = sum(begin >= first for begin in begins) * (1 if robot.cycle is None else team.repeat)
        pauses.append(sum(begin < first for begin in begins) + again - 1)
    total += max(pauses) * PAUSE
    within = path.robot.limits.endurance is not None and total <= path.robot.limits.endurance
    require(within, f"it is in the air for {float(total):.1f} s, longer than its endurance")
    return f"{path.name} is in the air for {float(total):.5g} s."
