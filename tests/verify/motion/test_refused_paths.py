"""Paths torn, retimed and swapped: refused with the joint, the derivative and the amount of the jump."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.kernel.witnesses import PLAN, TEAM, Right, around, assert_refused, judged
from tests.helpers.motion.flights import changed, legs, plan_of, quantised, small_mission
from verify.data.plan import Visit
from verify.data.trajectory import Trajectory
from verify.motion.continuity import HEADINGS, JUMPS, QUANTITIES

# Paths torn and retimed: the joint, the derivative and the amount.

MOVED = [(robot, piece, offset) for robot, n in (("quad0", 6), ("quad1", 4)) for piece in range(n)
         for offset in ((0.0, 0.0, 0.9), (0.5, -0.5, 0.3), (1e-3, 0.0, 0.0))]  # fmt: skip


@few_of(3, ("robot", "piece", "offset"), MOVED)
def test_a_waypoint_moved_tears_the_path_at_both_ends_of_its_piece(robot, piece, offset):
    values = TEAM[robot].coefficients.copy()
    values[piece, :3, 0] += offset
    broken = quantised(changed(TEAM[robot], coefficients=values))
    size = float(np.linalg.norm(offset))
    (claim,) = assert_refused(
        judged(PLAN, {**TEAM, robot: broken}),
        Right("continuity", robot, what="position", off=(size - 1.1e-4, size)),
    )
    assert min(abs(claim.time - broken.knots[i]) for i in (piece, piece + 1)) < 1e-9


@few_of(3, ("robot", "piece"), [*(("quad0", i) for i in range(5)), *(("quad1", i) for i in range(1, 3))])
def test_a_piece_dropped_leaves_a_gap_as_long_as_it(robot, piece):
    path = TEAM[robot]
    keep = [i for i in range(len(path)) if i != piece]
    broken = Trajectory(path.durations[keep], path.coefficients[keep])
    gap = float(np.linalg.norm(path.evaluate(path.knots[piece + 1])[:3] - path.evaluate(path.knots[piece])[:3]))
    assert_refused(
        judged(PLAN, {**TEAM, robot: broken}),
        Right("continuity", robot, time=around(path.knots[piece], 1e-6), off=around(gap, 2e-4), what="position"),
    )


@pytest.mark.parametrize(("robot", "hoop", "visit"), [("quad0", "loc2", 2), ("quad1", "loc1", 0)])
def test_a_last_piece_dropped_leaves_out_the_last_visit(robot, hoop, visit):
    path = TEAM[robot]
    broken = Trajectory(path.durations[:-1], path.coefficients[:-1])
    _, _, formula = assert_refused(
        judged(PLAN, {**TEAM, robot: broken}),
        Right("visits", robot, hoop, visit, None, says=f"visit {visit} of '{hoop}' does not happen"),
        Right("passages", robot, hoop, visit, None, says=f"{hoop}F does not happen"),
        Right("formula", robot, hoop, visit, None, says=f"`{hoop}` never happens"),
    )
    assert not any(hoop in letter for _, letter in formula.witness.word)


@pytest.mark.parametrize("robot", ["quad0", "quad1"])
@few_of(2, "index", range(5))
def test_two_pieces_swapped_tear_the_path_where_they_meet(robot, index):
    path, order = TEAM[robot], list(range(len(TEAM[robot])))
    a, b = index % len(order), (index + 1) % len(order)
    order[a], order[b] = order[b], order[a]
    broken = Trajectory(path.durations[order], path.coefficients[order])
    (claim,) = assert_refused(judged(PLAN, {**TEAM, robot: broken}), Right("continuity", robot, what="position"))
    before = np.array([PLAN.mission.agents[robot].start, *(broken.evaluate(k - 1e-9)[:3] for k in broken.knots[1:-1])])
    sizes = np.linalg.norm(broken.coefficients[:, :3, 0] - before, axis=1)
    assert claim.time == pytest.approx(broken.knots[int(np.argmax(sizes))], abs=1e-9)
    assert claim.bound == pytest.approx(sizes.max(), abs=1e-4)


@few_of(3, "factor", [0.5, *(pytest.param(factor, marks=pytest.mark.slow) for factor in (0.9, 1.01, 1.2)), 0.99, 2.0])
@few_of(2, "index", range(6))
def test_one_duration_changed_tears_the_path_behind_it(index, factor):
    durations = TEAM["quad0"].durations.copy()
    durations[index] *= factor
    broken = quantised(changed(TEAM["quad0"], durations=durations))
    where = "at the end" if index == 5 else f"between pieces {index} and {index + 1}"
    assert_refused(
        judged(PLAN, {**TEAM, "quad0": broken}),
        Right("continuity", "quad0", time=around(broken.knots[index + 1], 1e-6), what=where),
    )


@few_of(2, "axis", range(3))
@few_of(3, "power", range(8))
@pytest.mark.parametrize("piece", [pytest.param(0, marks=pytest.mark.slow), 3])
def test_a_coefficient_changed_by_much_tears_the_path_by_as_much(axis, power, piece):
    values, path = TEAM["quad0"].coefficients.copy(), TEAM["quad0"]
    values[piece, axis, power] += 0.5 / float(path.durations[piece]) ** power
    (claim,) = assert_refused(
        judged(PLAN, {**TEAM, "quad0": changed(path, coefficients=values)}), Right("continuity", "quad0", off=(0.499, 0.501))
    )
    ends = [path.knots[piece + 1]] if power else path.knots[[piece, piece + 1]]
    assert min(abs(claim.time - end) for end in ends) < 1e-6


@few_of(1, "axis", range(4))
@pytest.mark.parametrize("order", range(4))
def test_a_jump_of_any_derivative_is_named(axis, order):
    """Bent by delta t^k (1 - t / T)^4, a piece begins with a jump of that derivative and ends as it did."""
    values, path = TEAM["quad0"].coefficients.copy(), TEAM["quad0"]
    for j in range(5):
        bend = math.comb(4, j) * (-1 / path.durations[3]) ** j
        values[3, axis, order + j] += 3 * JUMPS[order] / math.factorial(order) * bend
    certificate = judged(PLAN, {**TEAM, "quad0": changed(path, coefficients=values)})
    if (axis, order) == (3, 3):  # of the heading's third derivative nothing is asked
        assert all(c.outcome == "holds" for c in certificate.claims if c.name == "continuity")
        return
    names = QUANTITIES if axis < 3 else HEADINGS
    what = f"{names[order]} between pieces 2 and 3"
    off = around(2 * JUMPS[order], 0.6 * JUMPS[order])
    assert_refused(certificate, Right("continuity", "quad0", time=around(path.knots[3], 1e-6), what=what, off=off))


@few_of(2, "yaw", [1e-3, 0.5, math.pi, -2.0])
def test_a_heading_that_is_not_the_agents_is_refused_at_the_start(yaw):
    broken = changed(TEAM["quad1"], coefficients=_turned(TEAM["quad1"], yaw))
    size = abs(yaw)
    assert_refused(
        judged(PLAN, {**TEAM, "quad1": broken}),
        Right("continuity", "quad1", time=(0, 0), what="heading at the start", off=around(size, 2e-4)),
    )
    turns = changed(TEAM["quad1"], coefficients=_turned(TEAM["quad1"], 4 * math.pi))
    assert judged(PLAN, {**TEAM, "quad1": turns}).holds


def _turned(path: Trajectory, yaw: float) -> np.ndarray:
    values = path.coefficients.copy()
    values[:, 3, 0] += yaw
    return values


@pytest.mark.parametrize("end", [0.2, 1e-3])
def test_a_lap_that_does_not_close_is_refused_at_its_end(end):
    mission = small_mission("G F a", trace="infinite")
    plan = plan_of(mission, {"r0": [Visit(region="a")]})
    plan = plan.model_copy(
        update={"robots": {"r0": plan.robots["r0"].model_copy(update={"cycle_visit": 0, "cycle_waypoint": 0})}}
    )
    lap = legs([[0, 0, 1], [1, 0, 1], [end, 0, 1]], cycle=0)
    assert_refused(
        judged(plan, {"r0": lap}),
        Right("continuity", "r0", time=around(lap.duration, 1e-6), what="position at the end", off=around(end, 2e-4)),
    )


# Robots swapped.


def wrong_visits(robot: str, planned: tuple[Visit, ...], flown: tuple[Visit, ...]) -> Right:
    """Return the witness of a robot that flies another's visits: it comes to the other's first region, or nowhere."""
    if flown:
        return Right("visits", robot, flown[0].region, 0 if planned else None, says=f"'{flown[0].region}'")
    return Right("visits", robot, planned[0].region, 0, None, says="does not happen")


@few_of(1, "pair", [("quad0", "quad1"), ("quad0", "quad2"), ("quad1", "quad2")])
def test_two_robots_swapped(pair):
    a, b = pair
    first, second = PLAN.robots[a].visits, PLAN.robots[b].visits
    apart = math.dist(PLAN.mission.agents[a].start, PLAN.mission.agents[b].start)
    assert_refused(
        judged(PLAN, {**TEAM, a: TEAM[b], b: TEAM[a]}),
        *(Right("continuity", r, time=(0, 0), what="position at the start", off=around(apart, 2e-4)) for r in pair),
        wrong_visits(a, first, second),
        wrong_visits(b, second, first),
    )
    visits = {**PLAN.robots, a: PLAN.robots[b], b: PLAN.robots[a]}
    swapped = PLAN.model_copy(update={"robots": visits})
    assert_refused(judged(swapped, TEAM), wrong_visits(a, second, first), wrong_visits(b, first, second))
