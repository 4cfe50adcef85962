"""Openings through obstacles, held against points of what is proved to stay clear of their edges."""

import numpy as np

from verify.arithmetic.balls import Floats
from verify.data.shapes.region import Hoop
from verify.data.shapes.solid_parts import SolidPart
from verify.data.shapes.solids import box
from verify.motion.obstacles.half_spaces import Hulls
from verify.motion.obstacles.openings import Opening


def test_hulls_of_boxes_stay_as_far_from_an_edge_as_the_nearest_of_their_points() -> None:
    """Before, behind and within an opening whose axis is oblique: never farther; points by themselves exactly as far."""
    rng = np.random.default_rng(5)
    hoop = Hoop(center=(0.3, -0.2, 1.0), radii=(0.5, 0.5, 0.5), yaw_deg=40, pitch_deg=20, opening=0.3, rim=0.02)
    (inequalities,) = box((0.6, 2.0, 1.9), 0.0)
    part = SolidPart("wall", 0, (0.2, -0.1, 1.1), tuple(inequalities), (("door", hoop),))
    opening, normal, middle = Opening.of(part, hoop), np.array(hoop.normal), np.array(hoop.center)
    places = middle + rng.uniform(-2.5, 2.5, (400, 1)) * normal + rng.uniform(-0.2, 0.2, (400, 3))
    corners = places[..., None] + rng.uniform(-0.1, 0.1, (400, 3, 4))
    rad = rng.uniform(0.0, 0.02, (400, 3))

    def distances(points: Floats) -> Floats:
        offset = points - middle
        along = offset @ normal
        inside = hoop.opening - np.linalg.norm(offset - along[..., None] * normal, axis=-1)
        beside = np.maximum(np.maximum(along - opening.ahead, -along - opening.behind), 0.0)
        return np.where(inside > 0, np.hypot(inside, beside), inside)

    sampled = (corners + rad[..., None] * rng.uniform(-1.0, 1.0, (100, *corners.shape))).transpose(0, 1, 3, 2)
    low = opening.distances(Hulls(corners, rad), places).low
    assert np.all(low <= distances(sampled).min(axis=(0, 2)) + 1e-12)
    assert np.count_nonzero(low > 0.4) > 80
    found = opening.distances(Hulls.points(places), places)
    np.testing.assert_allclose(found.low, distances(places), atol=1e-12)
    np.testing.assert_allclose(found.near, distances(places), atol=1e-12)
