"""How far robots keep apart, and how that is told."""

import pytest

from verify.data.validation.spacing import needed, spacing


@pytest.mark.parametrize(
    ("separation_z", "stretch", "says"),
    [
        (None, 1.0, "twice the margin 0.05 m and 0.001 m for rounding"),
        (0.8, 1.0, "twice the margin 0.05 m and 0.001 m for rounding, where a distance in z counts 0.5 times"),
        (0.2, 2.0, "4 times the margin 0.05 m and 0.001 m for rounding, where a distance in z counts 2 times"),
    ],
)
def test_the_margin_counts_twice_or_more_often_where_z_is_stretched(separation_z, stretch, says):
    kept = spacing(0.4, separation_z, 0.05)
    assert kept.at_rest == pytest.approx(0.4 + 2 * stretch * 0.05 + 1e-3)
    assert needed(kept, 0.4, 0.05) == f"{kept.at_rest:g} m is needed: separation 0.4 m, {says}"
