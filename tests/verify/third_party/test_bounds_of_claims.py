"""A law of every claim that holds: the bound that it prints satisfies the requirement that it prints."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

import verify
from tests.helpers.few import few_of
from tests.helpers.motion.fleets import show_of, trajectory_of, write_show
from tests.helpers.motion.flights import firefighting
from verify.claims.claim import Claim

_APART = re.compile(r"stay ([0-9.]+) m apart .* with ([0-9.]+) m at .*?([0-9.]+) m are asked")


def assert_bounds_satisfy_limits(claims: Iterable[Claim]) -> None:
    """Compare bounds with limits, as numbers and as they are printed."""
    for claim in claims:
        if claim.outcome != "holds":
            continue
        assert claim.margin is None or claim.margin >= 0, claim.sentence
        if claim.bound is not None and claim.limit is not None and claim.margin is not None:
            assert claim.margin == pytest.approx(abs(claim.bound - claim.limit), abs=1e-12), claim.sentence
        if found := _APART.search(claim.sentence):
            bound, reached, asked = map(float, found.groups())
            assert asked <= bound <= reached, claim.sentence


@few_of(4, "seed", range(12))
def test_audits_of_grids_print_what_they_keep(tmp_path: Path, seed: int) -> None:
    """Drones beside each other, at what is asked up to rounding."""
    rng = np.random.default_rng(seed)
    pitch = float(rng.choice([0.3, 0.5, 1.0, 1.7]))
    shows = []
    for k in range(int(rng.integers(3, 9))):
        y = pitch * k
        top = float(rng.uniform(2, 3))
        points = [[0, [0, y, 0]], [2, [0, y, 2]], [3, [1, y, top]], [5, [1, y, 0]]]
        shows.append((f"d{k}", trajectory_of(points)))
    path = write_show(tmp_path / "show.skyc", show_of(shows))
    limits = verify.AuditLimits(
        separation=pitch * (1 - 1e-14),
        workspace=(-1, -1, 0, 2, 20, 3),
        speed=4.0,
        acceleration=9.0,
        min_height=0.0,
        velocity_jump=9.0,
    )
    found = verify.audit(path, limits=limits)
    assert {claim.name for claim in found.claims if claim.outcome == "holds"} >= {"separation", "workspace", "limits.speed"}
    assert_bounds_satisfy_limits(found.claims)


def test_certificates_print_what_they_keep() -> None:
    plan, team = firefighting()
    certificate = verify.certify(plan, team)
    assert any(claim.name == "separation" for claim in certificate.claims)
    assert_bounds_satisfy_limits(certificate.claims)
