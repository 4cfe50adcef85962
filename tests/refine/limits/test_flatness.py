"""Flatness: against a worked example, against numeric integration of the attitude, and against the judge."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flight.control.flatness import feed_forward, lifted
from refine import Limits, heading_spline, minimum_snap
from refine.limits.flatness import flat_samples
from refine.limits.limits import rotors_of
from refine.limits.stretching import stretch_to_limits
from refine.limits.usage import peaks
from tests.helpers.missions.refinement_courses import HOOP6, HOOP6_LIMITS, flown, hoop6_vehicle, limit_verdicts
from verify.data import GRAVITY, BadInput, Infeasible, load_vehicle

ZERO = np.zeros(())


def test_rates_of_a_worked_example() -> None:
    """At constant yaw, f = (8, 8, 10) and j = (60, -40, 0): rates (3.56, 3.10, 1.94)."""
    state = flat_samples(np.array([8.0, 8.0, 10.0 - GRAVITY]), np.array([60.0, -40.0, 0.0]), np.zeros(3), ZERO, ZERO, ZERO)
    np.testing.assert_allclose(state.rates, [3.56, 3.10, 1.94], atol=6e-3)
    assert np.hypot(*state.rates[:2]) == pytest.approx(4.72, abs=5e-3)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_rates_and_accelerations_are_derivatives_of_the_attitude(seed: int) -> None:
    """Along a smooth motion R' = R [rates], and the angular accelerations are the rates' own derivatives."""
    rng = np.random.default_rng(seed)
    curve, turn = rng.normal(size=(3, 6)) * 2.0, rng.normal(size=4)

    def at(t: float):
        powers = np.array([t**k for k in range(6)])
        slopes = np.array([k * t ** max(k - 1, 0) for k in range(6)])
        bends = np.array([k * (k - 1) * t ** max(k - 2, 0) for k in range(6)])
        yaw = turn @ [1, t, t**2, t**3], turn @ [0, 1, 2 * t, 3 * t**2], turn @ [0, 0, 2, 6 * t]
        return flat_samples(curve @ powers, curve @ slopes, curve @ bends, *(np.asarray(y) for y in yaw))

    h = 1e-5
    here, before, after = at(0.1), at(0.1 - h), at(0.1 + h)
    if (
        abs(np.dot(here.axes[1], [-np.sin(turn @ [1, 0.1, 0.01, 0.001]), np.cos(turn @ [1, 0.1, 0.01, 0.001]), 0])) < 0.2
        or here.thrust < 2
    ):
        return  # near the singularity of the heading, differences say little
    attitude = np.array(here.axes).T
    rate = attitude.T @ (np.array(after.axes).T - np.array(before.axes).T) / (2 * h)
    np.testing.assert_allclose([rate[2, 1], rate[0, 2], rate[1, 0]], here.rates, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(np.subtract(after.rates, before.rates) / (2 * h), here.accelerations, rtol=1e-3, atol=1e-3)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=50, deadline=None)
def test_the_controllers_flatness_was_derived_apart_and_agrees(seed: int) -> None:
    rng = np.random.default_rng(seed)
    acceleration, jerk, snap = rng.normal(size=(3, 20, 3)) * np.array([3.0, 10.0, 40.0])[:, None, None]
    yaw = rng.normal(size=(3, 20))
    ours, theirs = flat_samples(acceleration, jerk, snap, *yaw), feed_forward(lifted(acceleration.T), jerk.T, snap.T, *yaw)
    axes, rates, accelerations = np.moveaxis(np.array(ours.axes), 2, 0), np.array(ours.rates).T, np.array(ours.accelerations).T
    clear = (ours.thrust > 2.0) & (
        np.abs(np.sum(axes[:, 1] * np.stack([-np.sin(yaw[0]), np.cos(yaw[0]), 0 * yaw[0]], 1), 1)) > 0.2
    )
    np.testing.assert_allclose(theirs.thrust[clear], ours.thrust[clear], rtol=1e-12)
    np.testing.assert_allclose(theirs.turn.transpose(2, 1, 0)[clear], axes[clear], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(theirs.rates.T[clear], rates[clear], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(theirs.rates_change.T[clear], accelerations[clear], rtol=1e-8, atol=1e-7)


def test_hovering_needs_a_quarter_of_the_weight_from_each_rotor() -> None:
    vehicle = load_vehicle("crazyflie-2.1")
    state = flat_samples(np.zeros(3), np.zeros(3), np.zeros(3), ZERO, ZERO, ZERO)
    np.testing.assert_allclose(state.rotor_thrusts(rotors_of(vehicle)), vehicle.weight / 4)
    assert state.tilt == 0.0


def test_peaks_are_what_the_judge_proves() -> None:
    """Sampled extremes lie below the proved bounds and close to them."""
    vehicle = load_vehicle("crazyflie-2.1-thrust-upgrade")
    times = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(HOOP6, axis=0), axis=1))])
    path = minimum_snap(HOOP6, times)
    yaw = minimum_snap(np.linspace(0.0, 2.0, len(HOOP6))[:, None], times)
    limits = Limits(
        speed=vehicle.speed, acceleration=vehicle.acceleration, thrust_min=1.0, thrust_max=30.0, tilt=1.0, body_rate=9.0,
        yaw_rate=9.0, rotors=rotors_of(vehicle),
    )  # fmt: skip
    proved = limit_verdicts(flown(path, yaw), vehicle)
    for peak in peaks(path, yaw, limits, 400):
        mass = vehicle.mass if peak.name in ("thrust_min", "thrust_max") else 1.0
        # The judge stops early on what is far from its limit, so its bounds are a little wide there.
        assert peak.value * mass == pytest.approx(proved[peak.name].bound, rel=1e-2)


def test_rotors_carry_with_a_fixed_heading_what_they_carry_on_the_path_turned_the_other_way() -> None:
    angle, limits = 0.7, Limits(rotors=rotors_of(load_vehicle("crazyflie-2.1")))
    turn = np.array([[np.cos(angle), np.sin(angle), 0.0], [-np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    path, turned = (minimum_snap(points, np.linspace(0.0, 3.0, len(HOOP6))) for points in (HOOP6, HOOP6 @ turn.T))
    found = peaks(path, heading_spline(path, "fixed", angle), limits)
    wanted = peaks(turned, heading_spline(turned, "fixed", 0.0), limits)
    assert [peak.value for peak in found] == pytest.approx([peak.value for peak in wanted])


def test_stretching_keeps_limits_and_wastes_nothing() -> None:
    path = minimum_snap(HOOP6, np.linspace(0.0, 3.0, len(HOOP6)))
    factor = stretch_to_limits(path, None, HOOP6_LIMITS, safety=1e-4)
    assert factor > 1
    claims = limit_verdicts(flown(path.stretched(factor)), hoop6_vehicle())
    assert all(claim.outcome == "holds" for claim in claims.values())
    quick = limit_verdicts(flown(path.stretched(0.999 * factor)), hoop6_vehicle())
    assert any(claim.outcome == "fails" for claim in quick.values())


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"thrust_max": 9.0}, "does not lift"),
        ({"thrust_min": 12.0}, "no hover"),
        ({"speed": 0.0}, "speed is 0"),
        ({"tilt": float("nan")}, "tilt is nan"),
        ({"body_rate": -1.0}, "body_rate is -1"),
    ],
)
def test_limits_that_no_vehicle_can_keep_are_refused(values: dict[str, float], words: str) -> None:
    with pytest.raises(BadInput, match=words):
        Limits(**values)


def test_a_limit_broken_at_rest_cannot_be_stretched_away() -> None:
    still = minimum_snap([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0]], [0.0, 2.0])
    spinning = minimum_snap([[0.0], [1.0]], [0.0, 2.0], velocity=[[5.0], [5.0]])
    with pytest.raises(Infeasible, match="yaw_rate") as caught:
        stretch_to_limits(still, spinning, Limits(yaw_rate=1e-5))
    assert caught.value.witness is not None
    assert caught.value.witness.claim == "limits.yaw_rate"
