"""A course that changes under a flying robot never jumps, and a clock that is told to wait stops where it said."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ltlplan
from ltlplan.online_mtac.path_blending import BRAKE, GLIDE, Clock, glide, gliding_path_of
from ltlplan.paths.hoops import route
from verify.data import Visit


@pytest.fixture(scope="module")
def course():
    mission = ltlplan.load_mission("firefighting")
    return gliding_path_of(route(mission, "quad0", [Visit(region=name) for name in ("water", "smoke", "loc2")]))


@given(st.lists(st.tuples(st.floats(0.001, 0.7), st.booleans()), min_size=1, max_size=12))
@settings(max_examples=50)
def test_the_clock_is_the_integral_of_its_rate_and_splits_into_steps(moves):
    clock, fine = Clock(), Clock()
    for dt, go in moves:
        clock = clock.after(dt, go)
        for _ in range(4):
            fine = fine.after(dt / 4, go)
        assert 0 <= clock.rate[0] <= 1 + 1e-9
    assert fine.time == pytest.approx(clock.time, abs=1e-9)
    assert fine.rate == pytest.approx(clock.rate, abs=1e-6)
    before, after = clock.after(1e-4, True), clock.after(3e-4, True)
    middle = clock.after(2e-4, True)
    assert (after.time - before.time) / 2e-4 == pytest.approx(middle.rate[0], abs=1e-5)


@given(st.lists(st.tuples(st.floats(0.001, 0.7), st.booleans()), min_size=1, max_size=6))
@settings(max_examples=50)
def test_a_clock_that_is_told_to_wait_stops_where_it_said(moves):
    clock = Clock()
    for dt, go in moves:
        clock = clock.after(dt, go)
    stop = clock.time + clock.run_on
    assert clock.run_on <= 3 / BRAKE + 1e-9
    for _ in range(40):
        clock = clock.after(0.1, False)
    assert clock.time == pytest.approx(stop, abs=1e-6)
    assert clock.resting


def test_the_glide_begins_and_ends_with_three_derivatives_zero():
    assert glide(0.0)[:4] == pytest.approx(np.zeros(4), abs=1e-12)
    assert glide(GLIDE)[:4] == pytest.approx([1, 0, 0, 0], abs=1e-9)
    steps = np.array([glide(t)[0] for t in np.linspace(0, GLIDE, 50)])
    assert np.all(np.diff(steps) > 0)


def test_what_is_desired_is_smooth_through_glides_and_waits(course):
    rng = np.random.default_rng(0)
    dt, now, clock, rows = 0.002, 0.0, Clock(), []
    for tick in range(3000):
        now = tick * dt
        if tick in (700, 1800):
            course = course.moved(course.new + rng.normal(scale=0.05, size=course.new.shape), now)
        rows.append(course.flat(clock, now))
        clock = clock.after(dt, not 1200 < tick < 1700)
    rows = np.array(rows)
    for order in range(4):
        slope = np.gradient(rows[:, order], dt, axis=0)[1:-1]
        jump = np.abs(np.diff(rows[:, order], axis=0)).max()
        assert jump < 5 * dt * max(np.abs(rows[:, order + 1]).max(), 1e-9)
        if order < 3:
            assert slope == pytest.approx(rows[1:-1, order + 1], abs=0.02 * np.abs(rows[:, order + 1]).max())


def test_a_course_begins_and_ends_at_rest_at_its_waypoints(course):
    clock = Clock()
    assert course.flat(clock, 0.0)[0] == pytest.approx(course.plan.waypoints[0].position)
    assert np.all(course.flat(clock, 0.0)[1:] == 0)
    end = Clock(course.duration + 1.0, (1.0, 0.0, 0.0, 0.0))
    assert course.flat(end, 0.0)[0] == pytest.approx(course.plan.waypoints[-1].position)
    assert np.all(course.flat(end, 0.0)[1:] == 0)


def test_a_course_knows_when_it_passes_centres(course):
    times = np.array([time for _, time in course.stops])
    places = np.array([course.flat(Clock(time), 0.0)[0] for time in times])
    planned = [w.position for w in course.plan.waypoints if w.role == "centre"]
    assert places == pytest.approx(np.array(planned), abs=1e-9)
    assert np.all(np.diff(times) > 0)


def test_a_robot_without_a_task_hovers():
    mission = ltlplan.load_mission("firefighting")
    idle = gliding_path_of(route(mission, "quad1", []))
    flat = idle.flat(Clock().after(1.0, True), 1.0)
    assert flat[0] == pytest.approx((1.0, 0.0, 0.8))
    assert np.all(flat[1:] == 0)
