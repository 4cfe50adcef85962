"""Regions of several parts: what a path has to keep across the faces of parts."""

import random
from fractions import Fraction

import pytest

from verify.data.shapes.covers import covers
from verify.data.shapes.inequalities import Inequality as Stored
from verify.kernel.flights import Segment
from verify.kernel.statement import Inequality, Shape
from verify.kernel.trees import Cell, Polynomial
from verify.kernel.zones import _meet, asked, choices, region, terms_of

ORIGIN = (Fraction(0), Fraction(0), Fraction(0))


def box(low, high):
    """A box as six half-spaces around the origin."""
    rows = []
    for axis in range(3):
        for sign, bound in ((1, high[axis]), (-1, -low[axis])):
            x, y, z = (Fraction(sign * (k == axis)) for k in range(3))
            rows.append(Inequality(Fraction(bound), (x, y, z)))
    return tuple(rows)


def union(*boxes):
    return Shape(ORIGIN, tuple(box(low, high) for low, high in boxes))


def rows(shape):
    return [[terms_of(one, shape.center) for one in part] for part in shape.parts]


def keeps(terms, point):
    x, y, z = point
    powers = x * x, x * y, x * z, y * y, y * z, z * z, x, y, z, 1
    return sum(a * b for a, b in zip(terms, powers, strict=True)) <= 0


def random_union(rng):
    corners = [[rng.randrange(4) for _ in range(3)] for _ in range(rng.randrange(2, 4))]
    return union(*((low, [x + rng.randrange(1, 3) for x in low]) for low in corners))


@pytest.mark.parametrize("number", [12, pytest.param(200, marks=pytest.mark.slow)])
def test_a_point_that_keeps_one_of_each_choice_is_in_a_part(number):
    rng = random.Random(1)
    made = {True: 0, False: 0}
    for _ in range(number):
        shape = random_union(rng)
        parts, found = rows(shape), choices(rows(shape))
        assert found
        for _ in range(40):
            point = [Fraction(rng.randrange(-1, 13), 2) for _ in range(3)]
            inside = any(all(keeps(one, point) for one in part) for part in parts)
            assert inside == all(any(keeps(one, point) for one in choice) for choice in found), shape
            made[inside] += 1
    assert min(made.values()) > number * 5 // 4


def test_faces_meet_where_every_point_keeps_one_of_them():
    one = terms_of(Inequality(Fraction(1), (Fraction(2), Fraction(0), Fraction(0))), ORIGIN)
    for x, bound, met in ((-1, 0, True), (-4, -2, True), (-4, -3, False), (1, 5, False), (0, 5, False)):
        other = terms_of(Inequality(Fraction(bound), (Fraction(x), Fraction(0), Fraction(0))), ORIGIN)
        assert _meet(one, other) == _meet(other, one) == met
    ball = Inequality(Fraction(1), None, tuple(tuple(Fraction(i == k) for k in range(3)) for i in range(3)))
    assert not _meet(terms_of(ball, ORIGIN), terms_of(ball, ORIGIN))


def test_a_path_through_a_face_is_inside_and_one_through_a_gap_is_not():
    for gap, held in ((0, True), (Fraction(1, 64), False)):
        rules = region(union(((0, 0, 0), (1, 1, 1)), ((1 + gap, 0, 0), (2, 1, 1))), Fraction(1, 16))
        line = [Polynomial.of([Fraction(1, 2), Fraction(1)]), *[Polynomial.of([Fraction(1, 2)])] * 2]
        assert Cell(Segment(Fraction(0), Fraction(1), line).sum, rules).holds("m") == held


def test_parts_with_too_many_choices_are_taken_one_by_one():
    shape = union(*(((3 * k, 7 * k, 11 * k), (3 * k + 1, 7 * k + 1, 11 * k + 1)) for k in range(4)))
    assert choices(rows(shape)) == []
    assert len(region(shape, Fraction(0))["m"]) == 4


def test_what_the_judge_finds_across_faces_is_found():
    shape = union(((0, 0, 0), (2, 1, 1)), ((2, 0, 0), (3, 1, 1)), ((0, 1, 0), (3, 2, 1)))
    parts = tuple(
        tuple(Stored(linear=tuple(map(float, one.linear)), bound=float(one.bound)) for one in part) for part in shape.parts
    )
    for body in covers(parts):
        own = [terms_of(Inequality(Fraction(one.bound), tuple(map(Fraction, one.linear))), ORIGIN) for one in body]
        held = [face for part in rows(shape) for face in part if any(k[:9] == face[:9] and k[9] >= face[9] for k in own)]
        assert all(choice & set(held) for choice in choices(rows(shape)))


def form(terms, p):
    a, b, c, off = terms
    return a * p[0] ** 2 + b * p[1] ** 2 + c * p[2] ** 2 + 2 * off * (p[0] * p[1] + p[1] * p[2])


def test_a_quadric_moves_to_the_safe_side():
    rng = random.Random(2)
    for _ in range(50):
        a, b, c = (Fraction(rng.randrange(1, 30), 4) for _ in range(3))
        off = Fraction(rng.randrange(-3, 4), 16)
        one = Inequality(Fraction(1), None, ((a, off, Fraction(0)), (off, b, off), (Fraction(0), off, c)))
        margin = Fraction(rng.randrange(0, 20), 64)
        keeps, (_, _, outside) = asked(terms_of(one, ORIGIN), margin)
        terms = (a, b, c, off)
        for _ in range(50):
            point = [Fraction(rng.randrange(-64, 65), 64) for _ in range(3)]
            step = [Fraction(rng.randrange(-64, 65), 64) for _ in range(3)]
            size = sum(x * x for x in step)
            if not size:
                continue
            share = margin / (1 + size)  # a step no longer than the margin, as sqrt(s) <= 1 + s
            near = [p + share * s for p, s in zip(point, step, strict=True)]
            if keeps and form(terms, point) - 1 <= keeps[0][2]:
                assert form(terms, near) <= 1
            if form(terms, point) - 1 > outside:
                assert form(terms, near) > 1
