"""The page of an audit: its verdict, its tables, and pictures of the tightest instants."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import verify
from ltlplan.report.audit_report.audit_page import MOST_PICTURES, audit_html
from tests.helpers.motion.fleets import sampled, show_of, trajectory_of, wandering, write_show
from tests.helpers.pages import MOST_BYTES, data_of

CROSSING = trajectory_of([[0, [0, 0, 1]], [4, [8, 0, 1]]])
BESIDE = trajectory_of([[0, [0, 3, 1]], [4, [8, -3, 1]]])
FAR = trajectory_of([[0, [0, 40, 1]], [4, [8, 40, 1]]])
FENCE = {"version": 1, "polygons": [{"isInclusion": True, "points": [[-1, -9, 0], [7, -9, 0], [7, 60, 0], [-1, 60, 0]]}]}


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> verify.Audit:
    show = show_of(
        [("a", CROSSING), ("b", BESIDE), ("far", FAR)], settings={"geofence": FENCE, "validation": {"minDistance": 1}}
    )
    return verify.audit(write_show(tmp_path_factory.mktemp("show") / "show.skyc", show))


def test_the_page_has_the_answer_and_fits_a_letter(found: verify.Audit) -> None:
    page = audit_html(found)
    assert page == audit_html(found)
    assert len(page) < MOST_BYTES
    assert "4 of 6 claims are not proved: geofence, separation." in page
    for words in (
        "a and b are nearer than 1.0000 m",
        "settings.validation.minDistance",
        "does not stay inside polygon 1",
        found.digest,
    ):
        assert words in page


def test_pictures_are_of_the_tightest_instants(found: verify.Audit) -> None:
    figures: dict[str, Any] = data_of(audit_html(found))["figures"]
    assert len(figures) <= 1 + MOST_PICTURES
    traces = figures["instant0"]["data"]
    assert {trace["name"] for trace in traces} == {"a", "b", "0 m"}  # the third is out of the picture
    place = next(trace for trace in traces if trace["mode"] == "markers" and trace["name"] == "a")
    assert [place[axis][0] for axis in "xyz"] == pytest.approx([4.0, 0.0, 1.0], abs=1e-3)
    others = next(trace for trace in figures["overview"]["data"] if trace["name"] == "other drones")
    assert others["hovertext"] == ["far"]
    assert any(trace["name"] == "border" for trace in figures["overview"]["data"])


def test_places_over_time_are_those_of_the_pieces() -> None:
    fleet = wandering(3, 4, np.random.default_rng(1), common=False)
    times = np.linspace(0.0, float(fleet.end), 50)
    for drone in range(3):
        assert fleet.along(np.full(50, drone), times) == pytest.approx(sampled(fleet, drone, times), abs=1e-9)
