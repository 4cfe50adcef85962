"""Shapes of regions: the worked example of docs/extending.md from file to certificate, and what is refused."""

from __future__ import annotations

import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import ltlplan
import verify
from flight.shapes import region_shapes, surface_points
from tests.helpers.packages import install
from verify.data import BadInput, MissionError, check_mission, load_mission_file, load_plan, mission_to_yaml, parse_mission
from verify.data.events import HoopMoves
from verify.data.mission import Mission
from verify.data.shapes.inequalities import Inequality, quadratic_form, turned
from verify.data.shapes.region import Region
from verify.data.shapes.region_shapes import REGION_SHAPES
from verify.motion.regions import Ellipsoid, extent
from verify.testing import assert_satisfies

PAGE = Path(__file__).parents[4] / "docs" / "extending.md"
GROUP = "ltlplan.region_shapes"
SECTION = PAGE.read_text().partition("## A region shape\n")[2].partition("\n## ")[0]
MODULE, MISSION = (re.findall(rf"```{language} \S+\n(.*?)```", SECTION, re.DOTALL)[0] for language in ("python", "yaml"))
POINTS = {"spheroid": "round_shapes:SPHEROID"}

MORE = """
from verify.data.shapes.inequalities import Inequality, quadratic_form
from verify.data.shapes.region_shapes import RegionShape
from verify.data.vehicle import Positive

slab = RegionShape(float, lambda half, yaw: [[Inequality(linear=(0.0, 0.0, s), bound=half) for s in (1.0, -1.0)]], "m")
wall = RegionShape(float, lambda half, yaw: [[Inequality(linear=(0.0, 0.0, 1.0), bound=half)]], "m")
beside = RegionShape(Positive, lambda r, yaw: [[Inequality(quadratic=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), linear=(-4.0, 0.0, 0.0), bound=-3.0)]], "m")
askew = RegionShape(Positive, lambda r, yaw: [[Inequality(quadratic=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.0)), linear=(0.0, 0.0, 1.0))]], "m")
pipe = RegionShape(Positive, lambda r, yaw: quadratic_form([[r**-2, 0, 0], [0, r**-2, 0], [0, 0, 0.0]]), "m")
saddle = RegionShape(Positive, lambda r, yaw: quadratic_form([[r**-2, 0, 0], [0, r**-2, 0], [0, 0, -1.0]]), "m")
skew = RegionShape(Positive, lambda r, yaw: [[{"quadratic": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}]], "m")
empty = RegionShape(Positive, lambda r, yaw: [], "m")
broken = RegionShape(Positive, lambda r, yaw: 1 / 0, "m")
"""
REFUSED = {
    "slab": "no end",
    "wall": "no end",
    "beside": "centre must lie inside",
    "pipe": "nan where it is no ellipsoid",
    "saddle": "nan where it is no ellipsoid",
    "askew": "none that is understood",
    "skew": "it gives dict for an Inequality",
    "broken": "ZeroDivisionError",
}


@pytest.fixture
def spheroid(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Install the page's package; undoing what is returned takes it away again."""
    (tmp_path / "package").mkdir()
    install(tmp_path / "package", monkeypatch, "round_shapes", MODULE, {GROUP: POINTS})
    return monkeypatch


@pytest.mark.slow
def test_the_worked_example_is_planned_flown_and_proved_again_without_its_package(
    spheroid: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    mission = parse_mission(MISSION)
    assert REGION_SHAPES.names() == ("radii", "size", "cylinder", "prism", "union", "spheroid")
    result = ltlplan.run(mission, tmp_path / "run")
    assert result.certificate.holds
    assert {visit.region for visit in result.plan.robots["quad0"].visits} == {"a", "b"}
    spheroid.undo()
    with pytest.raises(MissionError, match="unknown key"):
        parse_mission(MISSION)
    assert "spheroid" not in (tmp_path / "run" / "mission.yaml").read_text()
    again = verify.recheck(tmp_path / "run")
    assert again.holds
    assert again.mission_digest == mission.digest()
    plan = load_plan(tmp_path / "run" / "plan.json", load_mission_file(tmp_path / "run" / "mission.yaml"))
    assert check_mission(plan.mission) == mission
    words = {name: robot.word for name, robot in ltlplan.plan(plan.mission).robots.items()}
    assert words == {name: robot.word for name, robot in plan.robots.items()}


def test_it_is_the_ellipsoid_of_the_same_radii(spheroid: pytest.MonkeyPatch) -> None:
    own = parse_mission(MISSION).regions["b"]
    ours = Region(center=own.center, radii=(0.3, 0.3, 0.2))
    assert own.radii is None
    assert np.allclose(own.shape, ours.shape, rtol=1e-15)
    assert np.allclose(sorted(own.semi_axes), sorted(ours.semi_axes))
    assert np.allclose(own.half_lengths, ours.half_lengths)
    assert (own.inner_radius, own.outer_radius) == (pytest.approx(0.2), pytest.approx(0.3))
    assert extent(Ellipsoid.of(own)).scale >= Fraction(5)  # proved: 1 / 0.2
    for region in (own, ours):
        drawn = region_shapes("b", region, "red")[0]
        assert np.allclose(region.level(np.stack([drawn["x"], drawn["y"], drawn["z"]], axis=1)), 1.0, atol=2e-3)


def test_the_judge_reads_letters_off_it(spheroid: pytest.MonkeyPatch) -> None:
    times = np.linspace(0, 4, 81)
    positions = np.stack([np.linspace(-1.5, 0.5, 81), np.full(81, 0.3), np.full(81, 1.0)], axis=1)
    region = parse_mission(MISSION).regions["b"]
    for body in (region, Region(center=region.center, radii=(0.3, 0.3, 0.2))):
        assert_satisfies((times, positions), "!b U (b U !b)", {"b": body}, max_speed=0.51)


@pytest.mark.parametrize("key", REFUSED)
def test_bodies_that_are_no_region_are_refused(key: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(tmp_path, monkeypatch, "more_shapes", MORE, {GROUP: {name: f"more_shapes:{name}" for name in REFUSED}})
    text = MISSION.replace("spheroid: {radius: 0.3, height: 0.4}", f"{key}: 0.5")
    text = text.replace("spheroid: {radius: 0.25, height: 0.4}", "radii: [0.2, 0.2, 0.2]")
    with pytest.raises(MissionError) as refused:
        parse_mission(text)
    (fault,) = refused.value.faults
    assert fault.keys[:2] == ("regions", "b")
    assert REFUSED[key] in fault.reason


@pytest.mark.parametrize(
    ("shape", "keys", "says"),
    [
        ("spheroid: {radius: 0.3, height: -0.4}", ("spheroid", "height"), "greater than 0, not -0.4"),
        ("spheroid: {radius: 0.3}", ("spheroid", "height"), "missing"),
        ("spheroid: {radius: 0.3, heigth: 0.4, height: 1.0}", ("spheroid", "heigth"), "Did you mean 'height'?"),
        ("spheroid: 0.3", ("spheroid",), "must be"),
        ("spheroid: {radius: 1.0e-9, height: 0.4}", (), "between 1e-06 m and 1e+06 m"),
        ("speroid: {radius: 0.3, height: 0.4}", ("speroid",), "Did you mean 'spheroid'?"),
        ("spheroid: {radius: 0.3, height: 0.4}, radii: [1, 1, 1]", ("spheroid",), "has one shape, but `radii` and `spheroid`"),
        ("yaw_deg: 3", ("radii",), "missing: a region needs its shape"),
        ("parts: []", ("parts",), "at least 1 entry"),
        ("parts: [[{quadratic: [[1, 0, 0], [1, 1, 0], [0, 0, 1]]}]]", ("parts", 0, 0), "symmetric"),
    ],
)
def test_each_fault_has_its_key(spheroid: pytest.MonkeyPatch, shape: str, keys: tuple[str, ...], says: str) -> None:
    text = MISSION.replace("spheroid: {radius: 0.3, height: 0.4}}", shape + "}")
    with pytest.raises(MissionError) as refused:
        parse_mission(text)
    found = {fault.keys: fault.reason for fault in refused.value.faults}
    assert says in found["regions", "b", *keys]
    assert all(fault.line == 7 for fault in refused.value.faults)


def test_a_resolved_region_moves_and_turns_without_the_package() -> None:
    long = Region.model_validate(
        {"center": (1.0, 0.0, 1.0), "parts": quadratic_form([[4.0, 0, 0], [0, 25.0, 0], [0, 0, 25.0]])}
    )
    assert long.changed(center=(0.0, 0.0, 1.0)).body == long.body
    turned_region = long.changed(yaw_deg=90.0)
    assert np.allclose(turned_region.shape, np.diag([25.0, 4.0, 25.0]), atol=1e-12)
    mission = parse_mission(
        "format: 1\nname: m\nspec: {formula: F b}\nagents: {q: {start: [0, -0.9, 1]}}\nvehicle: crazyflie-2.1\n"
        "workspace: {min: [-2, -2, 0.2], max: [2, 2, 2]}\nregions:\n"
        "  b: {center: [1, 0, 1], parts: [[{quadratic: [[4, 0, 0], [0, 25, 0], [0, 0, 25]]}]]}\n"
    )
    after = HoopMoves(time=1.0, region="b", center=(0.5, 0.0, 1.0), yaw_deg=90.0).apply(mission)
    assert after.regions["b"].body == turned_region.body
    assert isinstance(check_mission(after), Mission)
    assert parse_mission(mission_to_yaml(after)).digest() == after.digest()


def test_what_was_not_validated_is_not_judged() -> None:
    flat = (Inequality(linear=(0.0, 0.0, 0.0), bound=4.0),)
    for parts in ((flat,), ()):
        region = Region(center=(0.0, 0.0, 1.0), radii=(0.5, 0.5, 0.5)).model_copy(
            update={"radii": None, "matrix": None, "parts": parts}
        )
        with pytest.raises(BadInput, match="Only ellipsoids are known here"):
            Ellipsoid.of(region)
        with pytest.raises(BadInput):
            region.level(np.zeros(3))


def test_rays_leave_half_spaces_and_quadratics_where_their_inequalities_end() -> None:
    box = tuple(
        Inequality(linear=tuple(sign * float(k == axis) for k in range(3)), bound=0.1 * (axis + 1))
        for axis in range(3)
        for sign in (1.0, -1.0)
    )
    points = surface_points((box,), np.concatenate([np.eye(3), -np.eye(3)]))
    assert np.allclose(points, np.concatenate([np.diag([0.1, 0.2, 0.3]), -np.diag([0.1, 0.2, 0.3])]))
    shifted = (Inequality(quadratic=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), linear=(-1.0, 0.0, 0.0), bound=0.75),)
    assert np.allclose(surface_points((shifted,), np.array([[1.0, 0, 0], [-1.0, 0, 0]])), [[1.5, 0, 0], [-0.5, 0, 0]])
    assert np.allclose(surface_points(turned((shifted,), np.pi / 2), np.array([[0.0, 1.0, 0]])), [[0, 1.5, 0]])
