"""Controllers are stable under every shipped profile: responses to steps, to wind and to a sagging battery."""

from __future__ import annotations

import numpy as np
import pytest

from flight.closed_loop import Setup, steps
from flight.conditions import Conditions
from flight.control.paper import discrete_chain
from flight.model.airframe import airframe_of, shipped_airframes
from flight.model.attitude import euler
from flight.model.disturbances import BatteryState, Wind
from flight.model.reference import Reference, sample_reference
from flight.model.timing import CONTROL_STEP, STEP, SUBSTEPS
from tests.helpers.few import few_of
from tests.helpers.motion.stand_ins import hoop6
from verify.data import load_vehicle

STEPS = (((0.3, 0.0, 0.0), 0.0), ((0.0, 0.2, 0.2), 0.0), ((0.0, 0.0, 0.0), 0.6))
"""m and rad: what the reference jumps by, one vehicle each."""


def hover_then(steps_of, seconds):
    """References that hover at (0, 0, 1) for one instant and then at another place and heading, one vehicle each."""
    ticks = round(seconds / CONTROL_STEP)
    flat = np.zeros((ticks + 1, 5, 4, len(steps_of)))
    fine = np.zeros((ticks * SUBSTEPS + 1, 3, len(steps_of)))
    flat[:, 0, 2], fine[:, 2] = 1.0, 1.0
    for k, (jump, yaw) in enumerate(steps_of):
        flat[1:, 0, :3, k] += jump
        flat[1:, 0, 3, k] = yaw
        fine[1:, :, k] += jump
    return Reference(
        tuple(f"quad{k}" for k in range(len(steps_of))), np.arange(ticks + 1) * CONTROL_STEP, flat, fine, seconds, 1.0
    )


def response(name, steps_of=(((0.0, 0.0, 0.0), 0.0),), seconds=2.5, **options):
    """Times, positions from the start (samples, 3, vehicles) and headings."""
    setup = Setup((airframe_of(load_vehicle(name)),), hover_then(steps_of, seconds), Conditions(**options))
    entries = list(steps(setup, [0]))
    times = np.array([entry.step for entry in entries]) * STEP
    place = np.array([entry.position for entry in entries]) - np.array([0.0, 0.0, 1.0])[:, None]
    return times, place, np.array([euler(entry.attitude)[2] for entry in entries])


@few_of(1, "name", shipped_airframes())
def test_the_geometric_controllers_step_responses_overshoot_little_and_settle(name):
    times, place, yaw = response(name, STEPS)
    for k, (jump, _) in enumerate(STEPS[:2]):
        away = np.linalg.norm(place[:, :, k] - np.array(jump), axis=1) / np.linalg.norm(jump)
        along = place[:, :, k] @ np.array(jump) / np.dot(jump, jump)
        assert np.max(along) < 1.2
        assert np.all(away[times > 1.2] < 0.2)
        assert away[-1] < 0.08
    assert np.all(np.abs(yaw[times > 1.5, 2] - 0.6) < 0.06)
    assert np.max(np.abs(place[:, :, 2])) < 0.02


@few_of(1, "name", shipped_airframes())
def test_the_papers_controllers_step_responses_settle_on_the_papers_model(name):
    cases = (((0.2, 0.0, 0.1), 0.0), STEPS[2])
    times, place, yaw = response(name, cases, model="paper", controller="paper", seconds=2.0)
    away = np.linalg.norm(place[:, :, 0] - np.array([0.2, 0.0, 0.1]), axis=1)
    assert np.all(away[times > 1.5] < 0.02)
    assert np.all(np.abs(yaw[times > 1.5, 1] - 0.6) < 0.06)


@few_of(
    2,
    ("name", "controller"),
    [
        *((name, "geometric") for name in shipped_airframes()),
        ("crazyflie-2.1", "paper"),
        *(pytest.param(name, "paper", marks=pytest.mark.slow) for name in shipped_airframes() if name != "crazyflie-2.1"),
    ],
)
def test_a_steady_wind_is_integrated_away(name, controller):
    times, place, _ = response(name, controller=controller, wind=Wind((1.0, 0.0, 0.0)), seconds=3.5)
    away = np.linalg.norm(place[:, :, 0], axis=1)
    assert np.max(away) < 0.08
    assert np.all(away[times > 3.0] < 0.02)


def test_jerk_and_snap_make_the_difference_on_hoop6():
    """Two vehicles fly the course, one of them with a reference that keeps jerk and snap to itself."""
    course = hoop6()
    reference = sample_reference({"quad0": course, "quad1": course}, CONTROL_STEP, SUBSTEPS)
    reference.flat[:, 3:, :, 1] = 0.0
    airframe = airframe_of(load_vehicle("crazyflie-2.1"))
    error = np.array(
        [np.linalg.norm(s.position - reference.fine[s.step], axis=0) for s in steps(Setup((airframe,), reference), [0])]
    )
    with_them, without = np.sqrt(np.mean(error**2, axis=0))
    assert with_them < 0.003
    assert without > 3 * with_them


def test_the_chain_of_integrators_has_its_poles_where_they_were_put():
    step, push, gains = discrete_chain(18.0)
    poles = np.linalg.eigvals(step - np.outer(push, gains))
    assert np.allclose(poles, np.exp(-18.0 * CONTROL_STEP), atol=2e-3)
    exact = CONTROL_STEP ** np.arange(4) / np.array([1, 1, 2, 6])
    assert np.allclose(step[0], exact)


def test_a_battery_sags_with_time_and_with_thrust():
    airframe = airframe_of(load_vehicle("crazyflie-2.1"))
    battery = BatteryState(airframe, 2)
    hover = airframe.vehicle.weight / 4
    battery.draw(np.array([[hover, 1.3 * hover]] * 4), 0.02)
    assert battery.share[0] > battery.share[1]
    first = battery.share.copy()
    for _ in range(60):
        battery.draw(np.full((4, 2), hover), 1.0)
    assert np.all(battery.share < first)
    assert np.all(battery.ceiling <= 1.0)
    assert np.all((battery.strength > battery.share) & (battery.strength < 1.0))
    assert np.allclose(battery.drained[0], 60.02 * airframe.battery.hover_current)
