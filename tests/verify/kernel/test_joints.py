"""Joints of pieces, rests at cuts and times in the air, just within what is allowed and just beyond."""

from __future__ import annotations

from fractions import Fraction
from math import comb
from types import SimpleNamespace
from typing import Any

import pytest

from verify.kernel.flights import Path, Segment, Team
from verify.kernel.limits import PI, check_continuity, check_endurance, check_parts
from verify.kernel.statement import Refused
from verify.kernel.trees import Polynomial

ZERO = Fraction(0)
JUMPS = (Fraction(1, 10_000), Fraction(1, 1_000), Fraction(1, 100), Fraction(1, 10))
"""Of position, velocity, acceleration and jerk."""
LITTLE = Fraction(1, 1 << 40)
FACTORIAL = (1, 1, 2, 6)


def near(value: Fraction, above: bool) -> Fraction:
    """Return a binary fraction next to a value, above it or not."""
    return Fraction(int(value * (1 << 40)) + above, 1 << 40)


def robot(**more: Any) -> Any:
    usual = {"start": (ZERO,) * 3, "yaw": ZERO, "end": None, "cycle": None, "cuts": (), "endurance": Fraction(100), "pieces": 2}
    return SimpleNamespace(**{**usual, **more})


def piece(begin: Fraction, *axes: list[Fraction | int], length: int = 1) -> Segment:
    """Return a piece, of one second if not said otherwise; axes that are not given rest at zero."""
    rows = [Polynomial.of([*map(Fraction, axis), ZERO][:8]) for axis in (*axes, *[[0]] * (4 - len(axes)))]
    return Segment(
        begin, begin + length, [Polynomial([*row.numbers, *[0] * (8 - len(row.numbers))], row.shift) for row in rows]
    )


def path(own: Any, *pieces: Segment) -> Path:
    return Path("r", own, list(pieces), list(pieces), None if own.cycle is None else pieces[own.cycle].start)


def team(*paths: Path, repeat: int = 1) -> Team:
    return Team({f"r{k}": one for k, one in enumerate(paths)}, paths[0].pieces[-1].stop, repeat)


def says_yes(check: Any, *given: Any) -> bool:
    try:
        check(*given)
    except Refused:
        return False
    return True


@pytest.mark.parametrize("axis", range(4))
def test_places_and_headings_may_jump_by_a_tenth_of_a_millimetre(axis: int) -> None:
    for above, accepted in ((False, True), (True, False)):
        by = near(JUMPS[0], above)
        rows: list[list[Fraction | int]] = [[0], [0], [0], [0]]
        rows[axis] = [by]
        moved = [piece(ZERO), piece(Fraction(1), *rows)]
        assert says_yes(check_continuity, path(robot(), *moved), team(path(robot(), *moved))) == accepted


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("axis", range(4))
def test_derivatives_may_jump_by_so_much(order: int, axis: int) -> None:
    """A piece begins with a jump of one derivative and ends at rest; of heading all but the jerk counts."""
    for above, accepted in ((False, True), (True, order == 3 and axis == 3)):
        first = near(JUMPS[order] / FACTORIAL[order], above)
        rows: list[list[Fraction | int]] = [[0], [0], [0], [0]]
        rows[axis] = [0] * order + [first * c / (1 << 4 * k) for k, c in enumerate((1, -4, 6, -4, 1))]  # t^order (1 - t / 16)^4
        pieces = [piece(ZERO, *rows, length=16)]
        assert says_yes(check_continuity, path(robot(), *pieces), team(path(robot(), *pieces))) == accepted
        later = [piece(ZERO), *(Segment(Fraction(1), Fraction(17), one.axes) for one in pieces)]
        assert says_yes(check_continuity, path(robot(), *later), team(path(robot(), *later))) == accepted


@pytest.mark.parametrize("above", [False, True])
def test_jumps_in_several_axes_count_together(above: bool) -> None:
    by = near(JUMPS[0] * Fraction(577, 1000), False) + (LITTLE * (1 << 16) if above else 0)
    pieces = [piece(ZERO, [by], [by], [by])]
    assert says_yes(check_continuity, path(robot(), *pieces), team(path(robot(), *pieces))) == (3 * by * by <= JUMPS[0] ** 2)


def test_full_turns_are_left_aside_at_the_start_alone() -> None:
    turned = near(2 * PI, False)
    pieces = [piece(ZERO, [0], [0], [0], [turned]), piece(Fraction(1), [0], [0], [0], [turned])]
    assert says_yes(check_continuity, path(robot(), *pieces), team(path(robot(), *pieces)))
    off = [piece(ZERO, [0], [0], [0], [turned + Fraction(1, 1 << 12)]), piece(Fraction(1), [0], [0], [0], [turned])]
    assert not says_yes(check_continuity, path(robot(), *off), team(path(robot(), *off)))
    between = [piece(ZERO), piece(Fraction(1), [0], [0], [0], [turned])]
    assert not says_yes(check_continuity, path(robot(), *between), team(path(robot(), *between)))


def test_a_flight_ends_where_it_shall() -> None:
    there = robot(end=(Fraction(1), ZERO, ZERO))
    assert not says_yes(check_continuity, path(there, piece(ZERO)), team(path(there, piece(ZERO))))
    here = robot(end=(near(JUMPS[0], False), ZERO, ZERO))
    assert says_yes(check_continuity, path(here, piece(ZERO)), team(path(here, piece(ZERO))))


@pytest.mark.parametrize("robots", [1, 2])
def test_laps_of_several_robots_begin_and_end_at_rest(robots: int) -> None:
    """A lap in full flight: at its seam it flies on as it began."""
    way = piece(ZERO, [0, 0, 0, 0, 35, -84, 70, -20])
    middle = [
        piece(Fraction(1), [0, 1, 0, -1]),  # from 0 with speed 1 to 0 with speed -2
        piece(Fraction(2), [0, -2, -3, 0, 0]),
    ]
    own = robot(cycle=1, start=(ZERO,) * 3)
    assert not says_yes(check_continuity, path(own, way, *middle), team(*[path(own, way, *middle)] * robots))
    rests = path(robot(cycle=1), piece(ZERO), piece(Fraction(1)))
    assert says_yes(check_continuity, rests, team(*[rests] * robots))
    speed = near(JUMPS[1], True)
    moves = [piece(ZERO, [0, speed]), piece(Fraction(1), [speed, speed])]
    smooth = path(robot(cycle=0, start=(ZERO,) * 3), *moves)
    assert not says_yes(check_continuity, smooth, team(*[smooth] * robots)), "it does not come back"


def test_laps_of_several_robots_begin_at_rest() -> None:
    """A lap begins in full flight, as the piece before it ends, and ends at rest where it began."""
    later: list[Fraction | int] = [0, 1, 0, 0, -20, 45, -36, 10]  # t (1 - t)^4 (1 + 4 t + 10 t^2)
    backwards = [sum(c * comb(k, i) * (-1) ** i for k, c in enumerate(later) if k >= i) for i in range(8)]
    way = piece(ZERO, [-c for c in backwards])
    flown = path(robot(cycle=1), way, piece(Fraction(1), later))
    with pytest.raises(Refused, match="where the lap begins"):
        check_continuity(flown, team(flown, flown))


def test_parts_begin_where_all_rest() -> None:
    own = robot(cuts=(1,))
    still = path(own, piece(ZERO), piece(Fraction(1)), piece(Fraction(2)))
    assert says_yes(check_parts, still, team(still))
    for order in range(4):
        for axis in range(3 if order in (0, 3) else 4):
            for above in (False, True):
                rows: list[list[Fraction | int]] = [[0], [0], [0], [0]]
                rows[axis] = [0] * order + [near(JUMPS[order] / FACTORIAL[order], above)]
                begins = path(own, piece(ZERO), piece(Fraction(1), *rows), piece(Fraction(2)))
                assert says_yes(check_parts, begins, team(begins)) != above, (order, axis)


@pytest.mark.parametrize(
    ("cuts", "cycle", "accepted"),
    [((1,), None, True), ((2,), None, True), ((), None, False), ((2, 1), None, False), ((1, 1), None, False), ((1, 3), None, False),
     ((1,), 1, True), ((2,), 1, False), ((0, 2), 0, True)],
)  # fmt: skip
def test_cuts_are_pieces_in_order_and_parts_fit(cuts: tuple[int, ...], cycle: int | None, accepted: bool) -> None:
    own = robot(cuts=cuts, cycle=cycle)
    still = path(own, piece(ZERO), piece(Fraction(1)), piece(Fraction(2)))
    assert says_yes(check_parts, still, team(still)) == accepted


def test_all_robots_are_cut_at_one_instant() -> None:
    one = path(robot(cuts=(1,)), piece(ZERO), piece(Fraction(1)), piece(Fraction(2)))
    other = path(robot(cuts=(2,)), piece(ZERO), piece(Fraction(1)), piece(Fraction(2)))
    assert not says_yes(check_parts, one, team(one, other))


@pytest.mark.parametrize(
    ("cuts", "cycle", "repeat", "seconds"),
    [((), None, 1, 3 + 11), ((1, 2), None, 1, 3 + 11 + 2 * 60), ((1, 2), 1, 1, 3 + 11 + 2 * 60), ((1, 2), 1, 3, 3 + 2 * 2 + 11 + 6 * 60),
     ((0, 1), 0, 2, 3 + 3 + 11 + 3 * 60), ((), 1, 3, 3 + 2 * 2 + 11)],
)  # fmt: skip
def test_laps_and_pauses_count_as_time_in_the_air(cuts: tuple[int, ...], cycle: int | None, repeat: int, seconds: int) -> None:
    """Parts begin with the flight, and with each cut, in each lap; a pause lies between two of them."""
    for more, accepted in ((0, True), (-LITTLE, False)):
        own = robot(cuts=cuts, cycle=cycle, endurance=Fraction(seconds) + more, pieces=None)
        still = path(own, piece(ZERO), piece(Fraction(1)), piece(Fraction(2)))
        assert says_yes(check_endurance, team(still, repeat=repeat), still) == accepted
