from fractions import Fraction

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.motion.flights import legs, plan_of, small_mission, through
from verify import judge
from verify.data.plan import Visit
from verify.motion.passages import OpeningPart, clearances, crossings, goes_back, hoop_frames
from verify.motion.paths import read_team

RING = "h: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2], opening: 0.3, rim: 0.05}"
TWO = RING + "\nk: {center: [1.0, 2.0, 1.0], yaw_deg: 90, radii: [0.2, 0.2, 0.2], opening: 0.3, rim: 0.05}"
RADIUS = 0.07


def ring_mission(margin=0.05, hoops=RING, **options):
    return small_mission(regions="", hoops=hoops, margin=margin, **options)


def starting_at(mission, point):
    agents = {"r0": mission.agents["r0"].model_copy(update={"start": tuple(float(x) for x in point)})}
    return mission.model_copy(update={"agents": agents})


def crossings_of(points, margin=0.05, mission=None):
    mission = starting_at(mission or ring_mission(margin), points[0])
    paths = read_team(mission, {"r0": legs(points)})
    return crossings(hoop_frames(paths), Fraction(margin))["r0"]


def claims(mission, visits, points, **options):
    certificate = judge(plan_of(mission, {"r0": visits}), {"r0": legs(points, **options)}, largest=False)
    return {claim.name: claim for claim in certificate.claims}


THROUGH = [[0, 0, 1], [2, 0, 1]]


@pytest.mark.parametrize("margin", [0.0, 0.01, 0.05, 0.09])
def test_a_flight_through_the_middle_is_one_passage(margin):
    (found,) = crossings_of(THROUGH, margin)
    assert (found.hoop, found.way, found.reason) == ("h", "F", "")
    assert found.off_axis < 1e-6
    (back,) = crossings_of(THROUGH[::-1], margin)
    assert back.way == "R"
    trajectory = legs(THROUGH)
    for time, sign in ((found.start, -1), (found.stop, 1)):
        assert sign * (trajectory.evaluate(float(time))[0] - 1) >= margin - 1e-9


def test_off_axis_there_is_room_for_vehicle_and_margin_and_not_more():
    room = 0.3 - RADIUS - 0.05
    (good,) = crossings_of([[0, room - 1e-6, 1], [2, room - 1e-6, 1]])
    assert not good.reason
    assert good.off_axis == pytest.approx(room - 1e-6, abs=1e-6)
    (bad,) = crossings_of([[0, room + 1e-6, 1], [2, room + 1e-6, 1]])
    assert "off the axis" in bad.reason


def test_beside_the_ring_is_no_passage():
    assert crossings_of([[0, 0.6, 1], [2, 0.6, 1]]) == ()
    assert crossings_of([[0, 0.0, 2], [2, 0.0, 2]]) == ()


def test_a_u_turn_in_the_opening_is_refused():
    (found,) = crossings_of([[0, 0, 1], [1.02, 0, 1], [0, 0, 1]])
    assert found.way is None
    assert "turns back" in found.reason


def test_a_u_turn_within_the_margin_of_the_opening_is_refused():
    (found,) = crossings_of([[0, 0, 1], [0.96, 0, 1], [0, 0, 1]])
    assert found.way is None
    assert crossings_of([[0, 0, 1], [0.94, 0, 1], [0, 0, 1]]) == ()


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(("stop", "why"), [([0.02, 0, 1], "turns back"), ([0.0, 0, 2], "leaves the opening sideways")])
def test_what_turns_back_and_what_leaves_sideways_is_told_from_either_side(side, stop, why):
    # from beyond the opening to within the margin of its plane, then back where it came from or along the plane over the rim
    def at(x, y, z):
        return [1 + side * x, y, z]

    points = [at(1, 0, 1), at(stop[0], 0, 1), at(1, 0, 1)] if why == "turns back" else [at(1, 0, 1), at(0, 0, 1), at(*stop)]
    (found,) = crossings_of(points)
    assert found.way is None
    assert why in found.reason


def test_there_and_back_are_two_passages():
    assert [c.way for c in crossings_of([[0, 0, 1], [2, 0, 1], [0, 0, 1]])] == ["F", "R"]


def test_leaving_sideways_through_the_plane_is_refused():
    (found,) = crossings_of([[0, 0, 1], [1.0, 0, 1], [1.0, 0, 2.0]])
    assert found.way is None
    assert "sideways" in found.reason


def test_a_start_and_an_end_in_the_opening_are_refused():
    (found,) = crossings_of([[0, 0, 1], [1.0, 0, 1]])
    assert "begins or ends" in found.reason
    (found,) = crossings_of([[1.0, 0, 1], [2, 0, 1]])
    assert "begins or ends" in found.reason


def test_a_path_in_the_plane_of_the_ring_does_not_take_for_ever():
    found = crossings_of([[1.0, -1, 1], [1.0, 1, 1]], 0.0)
    assert len(found) == 1
    assert found[0].way is None


def test_tilted_rings():
    hoops = "h: {center: [1.0, 0.0, 1.0], yaw_deg: 30, pitch_deg: 40, radii: [0.2, 0.2, 0.2], opening: 0.3, rim: 0.05}"
    mission = ring_mission(hoops=hoops)
    rear, front = through(mission, "h")
    assert [c.way for c in crossings_of([rear, front], mission=mission)] == ["F"]
    assert [c.way for c in crossings_of([front, rear], mission=mission)] == ["R"]


def rim_distance(point, hoop):
    offset = np.array(point) - np.array(hoop.center)
    along = float(offset @ np.array(hoop.normal))
    across = float(np.linalg.norm(offset - along * np.array(hoop.normal)))
    radial = max(hoop.opening - across, across - hoop.opening - hoop.rim, 0.0)
    return float(np.hypot(radial, max(abs(along) - hoop.rim / 2, 0.0)))


@few_of(1, "count", [3, 8])
def test_rim_clearance_against_samples(count):
    rng = np.random.default_rng(0)
    for _ in range(count):
        mission = ring_mission(hoops=TWO)
        points = [[0, 0, 1], *rng.uniform([0, -1, 0.3], [2, 3, 1.8], (3, 3))]
        trajectory = legs(points)
        for found in clearances(hoop_frames(read_team(mission, {"r0": trajectory}))):
            hoop = mission.hoops[found.hoop]
            values = [rim_distance(p, hoop) for p in trajectory.evaluate(np.linspace(0, trajectory.duration, 4000))[:, :3]]
            assert found.low <= min(values) + 1e-7
            assert found.low >= min(values) - 2e-3
            assert rim_distance(trajectory.evaluate(float(found.time))[:3], hoop) <= found.high + 1e-5  # at a joint
            assert found.high - found.low <= 1e-4


def test_the_room_of_an_opening_may_be_used_up_to_the_last_float():
    """The opening is as wide as way off the axis and radius together, exactly; one float less is too narrow."""
    points = [[0, 0.26, 1], [2, 0.26, 1]]
    mission = starting_at(ring_mission(0.0), points[0])
    vehicle = mission.vehicle.model_copy(update={"radius": 0.0625})

    def passing(opening):
        hoop = mission.hoops["h"].model_copy(update={"opening": opening})
        (found,) = crossings_of(points, 0.0, mission.model_copy(update={"hoops": {"h": hoop}, "vehicle": vehicle}))
        return found

    least = passing(0.35).off_axis + 0.0625
    assert Fraction(least) == Fraction(passing(least).off_axis) + Fraction(1, 16)
    assert passing(least).reason == ""
    assert "off the axis" in passing(float(np.nextafter(least, 0))).reason


VISIT = (Visit(region="h", direction="F"),)


def test_the_claims_of_a_planned_passage():
    found = claims(ring_mission(), VISIT, THROUGH)
    assert {c.outcome for c in found.values()} == {"holds"}
    assert found["passages"].bound == pytest.approx(0.3, abs=1e-5)
    assert found["rims"].bound == pytest.approx(0.3, abs=1e-4)


@few_of(
    5,
    ("visits", "points", "why"),
    [
        (VISIT, THROUGH[::-1], "planned is hF"),
        ((Visit(region="h", direction="R"),), THROUGH, "planned is hR"),
        ((Visit(region="h"),), THROUGH, "not planned"),
        (VISIT, [[0, 0, 1], [0.9, 0, 1], [0, 0, 1]], "does not happen"),
        (VISIT, [[0, 0, 1], [1.02, 0, 1], [0, 0, 1]], "turns back"),
        (VISIT, [[0, 0, 1], [2, 0, 1], [0, 0, 1]], "not planned"),
        (VISIT, [[0, 0.17, 1], [2, 0.17, 1]], "may not contain"),
        (VISIT, [[0, 0.19, 1], [2, 0.19, 1]], "off the axis"),
    ],
)
def test_wrong_passages_are_refused(visits, points, why):
    found = claims(starting_at(ring_mission(), points[0]), visits, points)["passages"]
    assert found.outcome == "fails"
    assert why in found.sentence
    assert found.witness is not None
    assert found.witness.region == "h"


def test_another_opening_may_not_be_entered():
    mission = ring_mission(hoops=TWO)
    points = [[0, 0, 1], [2, 0, 1], [2, 1, 1], [1, 1, 1], [1, 3, 1]]
    found = claims(mission, VISIT, points)
    assert found["passages"].outcome == "fails"
    assert found["passages"].witness.region == "k"
    both = (*VISIT, Visit(region="k", direction="F"))
    assert claims(mission, both, points)["passages"].outcome == "holds"


@pytest.mark.parametrize("gap", [1e-4, -1e-4])
def test_a_rim_is_met_by_the_vehicles_sphere(gap):
    # past the ring on the outside, with the sphere and the margin just clear of it or not
    offset = 0.3 + 0.05 + RADIUS + 0.05 + gap
    start = (0.0, offset, 1.0)
    found = claims(starting_at(ring_mission(), start), (), [start, [2, offset, 1]])["rims"]
    assert found.outcome == ("holds" if gap > 0 else "fails")
    assert found.time == pytest.approx(float(legs([start, [2, offset, 1]]).duration) / 2, abs=0.2)


@few_of(1, "aside", [0.1, 0.2, 0.3])
def test_a_rim_that_is_missed_by_less_than_the_first_look_tells_is_looked_at_closer(aside):
    mission, points = ring_mission(), [[0, 0.45, 1], [1.3, 0.45 + aside, 1.2]]
    mission = starting_at(mission, points[0])
    frames = hoop_frames(read_team(mission, {"r0": legs(points)}))
    (coarse,), (fine,) = clearances(frames), clearances(frames, 1e-9)
    assert coarse.low < fine.low - 1e-8
    for limit, verdict in ((fine.low - 1e-9, "holds"), (fine.high + 1e-9, "fails")):
        near = mission.model_copy(update={"margin": limit - RADIUS})
        assert claims(near, (), points)["rims"].outcome == verdict


def test_a_sequence_is_its_passages_in_order():
    def sequence_claims(text, visits, points):
        mission = small_mission(regions="", hoops=TWO, margin=0.05, extra=f"sequence: {text}")
        return claims(mission, visits, points)

    points = [[0, 0, 1], [2, 0, 1], [2, 1, 1], [1, 1, 1], [1, 3, 1]]
    both = (Visit(region="h", direction="F"), Visit(region="k", direction="F"))
    assert sequence_claims("hF kF", both, points)["passages"].outcome == "holds"
    assert sequence_claims("kF hF", both, points)["passages"].outcome == "fails"
    assert sequence_claims("hF", both, points)["passages"].outcome == "fails"
    twice = (Visit(region="h", direction="F"), Visit(region="h", direction="R"))
    assert sequence_claims("hF hR", twice, [[0, 0, 1], [2, 0, 1], [0, 0, 1]])["passages"].outcome == "holds"


def test_through_the_opening_thrice_is_two_passages_too_many():
    found = crossings_of([[0, 0, 1], [2, 0, 1], [0, 0, 1], [2, 0, 1]])
    assert [c.way for c in found] == ["F", "R", "F"]
    thrice = claims(ring_mission(), VISIT, [[0, 0, 1], [2, 0, 1], [0, 0, 1], [2, 0, 1]])["passages"]
    assert "not planned" in thrice.sentence


def test_parts_that_could_not_be_told_from_the_opening_hide_no_way_back():
    def part(first, last):
        return OpeningPart(0, 0.0, 1.0, (first, first), (last, last), 0.0)

    assert not goes_back([part(-0.1, 0.0), part(0.0, 0.04), part(0.04, 0.1)], 0.05)
    assert goes_back([part(-0.1, 0.1), part(0.1, -0.1), part(-0.1, 0.1)], 0.05)
    assert goes_back([part(0.1, -0.1), part(-0.1, 0.1), part(0.1, -0.1)], -0.05)
    assert not goes_back([part(0.1, 0.0), part(0.0, -0.1)], -0.05)
