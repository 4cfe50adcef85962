"""Regions of several parts: bodies across faces, which must lie in the region."""

import random
from fractions import Fraction
from types import SimpleNamespace

import pytest

from verify.data.shapes.covers import covers
from verify.data.shapes.inequalities import Inequality as Stored
from verify.kernel.refused import Refused
from verify.kernel.statement import Inequality, Shape
from verify.kernel.zones import asked, bodies, terms_of
from verify.proofs.bridges import bridges

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


def proposed(shape):
    return bridges(SimpleNamespace(regions={"a": shape})).get("bridges/a", [])


def keeps(inequality, point):
    return sum(a * b for a, b in zip(inequality.linear, point, strict=True)) <= inequality.bound


def test_opposite_faces_of_one_box_make_no_body_of_it():
    shape = union(((0, 0, 0), (1, 1, 1)))
    _, _, covers = bodies(shape, [(0, 0, 0, 1)])
    assert all(set(cover) == set(range(6)) for cover in covers)


@pytest.mark.parametrize("bridge", [[0, 1, 0, 0], [0, 9, 0, 1], [0, 1, 2, 1], [0, 1, 0, 99]])
def test_what_is_no_bridge_is_refused(bridge):
    shape = union(((0, 0, 0), (1, 1, 1)), ((2, 0, 0), (3, 1, 1)))
    with pytest.raises(Refused):
        bodies(shape, [bridge])


def test_bodies_lie_in_the_region_whatever_bridges_are_named():
    rng = random.Random(1)
    made = 0
    for _ in range(80):
        corners = [[rng.randrange(4) for _ in range(3)] for _ in range(rng.randrange(2, 4))]
        shape = union(*((low, [x + rng.randrange(1, 3) for x in low]) for low in corners))
        every = list(dict.fromkeys(one for part in shape.parts for one in part))
        named = [[rng.randrange(3), rng.randrange(3), rng.randrange(len(every)), rng.randrange(len(every))] for _ in range(60)]
        good = []
        for bridge in [*proposed(shape), *named]:
            try:
                bodies(shape, [*good, bridge])
            except Refused:
                continue
            good.append(bridge)
        _, _, found = bodies(shape, good)
        made += len(good)
        for _ in range(40):
            point = [Fraction(rng.randrange(-1, 13), 2) for _ in range(3)]
            if any(all(keeps(every[k], point) for k in cover) for cover in found):
                assert any(all(keeps(one, point) for one in part) for part in shape.parts), (shape, good)
    assert made > 30


def test_as_many_bodies_are_found_as_the_judge_finds():
    shape = union(((0, 0, 0), (2, 1, 1)), ((2, 0, 0), (3, 1, 1)), ((0, 1, 0), (3, 2, 1)))
    parts = tuple(
        tuple(Stored(linear=tuple(map(float, one.linear)), bound=float(one.bound)) for one in part) for part in shape.parts
    )
    _, _, found = bodies(shape, proposed(shape))
    assert len(found) == len(covers(parts))


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
