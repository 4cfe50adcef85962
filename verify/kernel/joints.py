"""Joints of pieces, of parts and of laps, and how long a flight lasts; each jump is the exact difference of two derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

from .bodies import ZERO
from .bounds import PI
from .flights import Path, Piece, Team
from .refused import Refused
from .statement import Statement

JUMPS = (Fraction(1, 10_000), Fraction(1, 1_000), Fraction(1, 100), Fraction(1, 10))
"""Greatest jumps in position (m), velocity, acceleration and jerk, and the same in rad for heading, its rate and its acceleration."""
PAUSE, CLIMB_AND_LANDING = 60, 11
"""s that an endurance counts for a pause between parts, and beside the flight."""


def _ends(piece: Piece, order: int) -> tuple[list[Fraction], list[Fraction]]:
    """Return a derivative of x, y, z and heading where a piece begins, and where it ends."""
    return [row.at(0) for row in piece.derivatives[order]], [row.at(piece.length) for row in piece.derivatives[order]]


def _require(order: int, one: Sequence[Fraction], other: Sequence[Fraction], where: str, turns: bool = False) -> None:
    """Refuse a jump that is too large; `turns` leaves full turns of the heading aside."""
    x, y, z, yaw = (b - a for a, b in zip(one, other, strict=True))
    full = 2 * PI * round(yaw / (2 * PI)) if turns else ZERO
    # pi is off by so little that a million turns are off by less than 1e-30
    if x * x + y * y + z * z > JUMPS[order] ** 2 or (order < 3 and abs(yaw - full) > JUMPS[order] - abs(full) / 10**30):
        raise Refused(f"derivative {order} of place or heading jumps {where} by more than {float(JUMPS[order]):g}")


def check_continuity(path: Path, team: Team) -> None:
    """Check all jumps of a robot, from rest at its start on to rest at its end, or to where its lap begins.

    Laps of several robots begin and end at rest.

    Raises:
        Refused: One is too large.
    """
    robot, zero = path.robot, [ZERO] * 4
    for order in range(4):
        ends = [_ends(piece, order) for piece in path.pieces]
        _require(order, zero if order else [*robot.start, robot.yaw], ends[0][0], "at the start", turns=not order)
        for number, ((_, before), (after, _)) in enumerate(pairwise(ends)):
            _require(order, before, after, f"between pieces {number} and {number + 1}")
        last = ends[-1][1]
        if robot.cycle is None:
            _require(order, last, zero if order else [*(robot.end or last[:3]), last[3]], "at the end")
        elif not order or len(team.paths) == 1:
            _require(order, last, ends[robot.cycle][0], "where the lap ends", turns=not order)
        else:
            _require(order, last, zero, "where the lap ends")
            _require(order, ends[robot.cycle][0], zero, "where the lap begins")


def check_parts(path: Path, team: Team) -> None:
    """Check that a flight in parts is cut where all are, and rests at each cut, and that its vehicle holds each part.

    Raises:
        Refused: That is not so.
    """
    robot, cuts = path.robot, list(path.robot.cuts)
    in_order = cuts == sorted(set(cuts)) and all(cut < len(path.pieces) for cut in cuts)
    if not in_order or (robot.cycle is not None and robot.cycle not in cuts):
        raise Refused("its cuts are no pieces in order, or its lap begins with none of them")
    if (
        len({tuple(other.knots[cut] for cut in other.robot.cuts if cut < len(other.pieces)) for other in team.paths.values()})
        > 1
    ):
        raise Refused("robots are cut at different instants")
    longest = max(b - a for a, b in pairwise(sorted({0, *cuts, len(path.pieces)})))
    if robot.limits.pieces is not None and longest > robot.limits.pieces:
        raise Refused(f"a part has {longest} pieces; its vehicle holds {robot.limits.pieces}")
    joints = [(cut - 1, cut) for cut in cuts if cut] + ([] if robot.cycle is None else [(len(path.pieces) - 1, robot.cycle)])
    for before, after in joints:
        for order in range(4):
            end, begin = _ends(path.pieces[before], order)[1], _ends(path.pieces[after], order)[0]
            if order == 0:
                _require(0, end, [*begin[:3], end[3]], f"at the cut before piece {after}")
            elif max(*map(abs, end[3:]), *map(abs, begin[3:])) > JUMPS[order]:
                raise Refused(f"its heading turns at the cut before piece {after}")
            else:
                for side in (end, begin):
                    _require(order, side, [ZERO, ZERO, ZERO, side[3]], f"at the cut before piece {after}")


def check_endurance(statement: Statement, team: Team, path: Path) -> Fraction:
    """Return how long a robot is in the air, all laps and pauses counted, s.

    Args:
        statement: Says how many laps are flown.
        team: All robots; each waits for those that pause.
        path: Whose endurance.

    Raises:
        Refused: That is longer than its endurance.
    """
    total = team.end + CLIMB_AND_LANDING + (0 if path.lap is None else (statement.repeat - 1) * (team.end - path.lap))
    pauses = [0]
    for other in (path.robot for path in team.paths.values()):
        first = 0 if other.cycle is None else other.cycle
        begins = {0, *other.cuts} if other.cuts else set[int]()
        later = sum(begin >= first for begin in begins) * (statement.repeat if other.cycle is not None else 1)
        pauses.append(sum(begin < first for begin in begins) + later - 1)
    total += max(pauses) * PAUSE
    if path.robot.limits.endurance is None or total > path.robot.limits.endurance:
        raise Refused(f"it is in the air for {float(total):.1f} s, longer than its endurance")
    return total
