"""Flights of a team that slow down to common rests: the clock's laws, and what the pieces keep of paths, distances and limits."""

from __future__ import annotations

import numpy as np
import pytest

from ltlplan import load_mission
from refine.limits.limits import Limits
from refine.rest_to_rest import TICK
from refine.spline.least_snap import minimum_snap
from refine.spline.spline import Spline
from refine.team_pauses import Clock, resting
from verify.data import DoesNotFit, Mission

LIMITS = Limits(speed=3.0, acceleration=20.0)


@pytest.fixture(scope="module")
def mission() -> Mission:
    return load_mission("hoops-published")


def path(seed: int, pieces: int, seconds: float) -> Spline:
    """Return x, y, z and yaw through random points some decimetres apart."""
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.uniform(-0.4, 0.4, (pieces + 1, 4)), axis=0)
    times = np.append(0.0, np.cumsum(rng.uniform(0.6, 1.4, pieces)))
    return minimum_snap(points, times * seconds / times[-1])


def team(pieces: int = 60) -> dict[str, Spline]:
    return {f"q{seed}": path(seed, pieces, float(pieces)) for seed in range(3)}


def test_the_clock_is_what_its_inverse_says_and_smooth_to_jerk() -> None:
    clock = Clock(np.array([3.0, 8.0]), 2.0)
    plan = np.linspace(0.0, 12.0, 997)
    flown = clock.flown(plan)
    assert np.all(np.diff(flown) > 0)
    assert np.abs(clock.plan(flown)[0] - plan).max() < 1e-9
    assert clock.flown(np.array([0.0, 3.0, 8.0, 12.0])) == pytest.approx([0.0, 4.0, 11.0, 16.0])
    times, step = np.linspace(0.1, 15.9, 20011), 1e-5
    below, here, above = (clock.plan(times + shift) for shift in (-step, 0.0, step))
    for order in (0, 1, 2):
        slope = (above[order] - below[order]) / (2 * step)
        assert np.abs(slope - here[order + 1]).max() < 1e-3
    assert clock.plan(clock.pauses)[1:] == pytest.approx(np.zeros((3, 2)))


def test_every_part_is_held_and_every_robot_rests_where_it_begins(mission: Mission) -> None:
    paths = team()
    found = resting(paths, mission, dict.fromkeys(paths, LIMITS), {"q0": 31, "q1": 20, "q2": None})
    for name, most in (("q0", 31), ("q1", 20)):
        slow, cuts = found.paths[name], found.cuts[name]
        assert max(np.diff([0, *cuts, len(slow)])) <= most
        assert not slow.states[list(cuts), 1:].any()
    instants = {tuple(found.paths[name].knots[list(found.cuts[name])]) for name in paths}
    assert len(instants) == 1, "all rest at the same instants, to the last bit"
    assert all((np.round(slow.durations / TICK) * TICK == slow.durations).all() for slow in found.paths.values())


def test_robots_are_where_they_were_when_the_others_are_where_they_were(mission: Mission) -> None:
    paths = team()
    found = resting(paths, mission, dict.fromkeys(paths, LIMITS), dict.fromkeys(paths, 25))
    length = (found.paths["q0"].duration - 60.0) / len(found.cuts["q0"])
    rests = found.paths["q0"].knots[list(found.cuts["q0"])] - length * (np.arange(len(found.cuts["q0"])) + 0.5)
    clock = Clock(rests, length)
    shares = np.linspace(0.0, 1.0, 13)
    for name, slow in found.paths.items():
        times = slow.knots[:-1, None] + slow.durations[:, None] * shares
        at = clock.plan(times.ravel())[0]
        piece = np.clip(np.searchsorted(paths[name].knots, at, side="right") - 1, 0, len(paths[name]) - 1)
        local = at - paths[name].knots[piece]
        wanted = np.einsum("nak,nk->na", paths[name].coefficients[piece], local[:, None] ** np.arange(8))
        assert np.abs(slow.sample(shares).reshape(-1, 4) - wanted).max() < 5e-4


def test_slowing_down_takes_as_long_as_limits_ask_for(mission: Mission) -> None:
    paths = {"q0": path(0, 40, 40.0)}
    eager = resting(paths, mission, {"q0": LIMITS}, {"q0": 25})
    gentle = Limits(
        speed=3.0,
        acceleration=float(1.001 * np.linalg.norm(paths["q0"].sample(np.linspace(0, 1, 99), 2)[..., :3], axis=-1).max()),
    )
    slow = resting(paths, mission, {"q0": gentle}, {"q0": 25})
    assert slow.paths["q0"].duration >= eager.paths["q0"].duration
    assert np.linalg.norm(slow.paths["q0"].sample(np.linspace(0, 1, 99), 2)[..., :3], axis=-1).max() <= gentle.acceleration


def test_a_handful_of_pieces_is_too_few(mission: Mission) -> None:
    paths = team(12)
    with pytest.raises(DoesNotFit, match="the 2 pieces that q1's holds are too few"):
        resting(paths, mission, dict.fromkeys(paths, LIMITS), {"q0": 31, "q1": 2, "q2": None})


def test_a_flight_that_is_too_fast_to_rest_within_a_second_rests_sooner(mission: Mission) -> None:
    fast = {"q0": path(1, 14, 6.0)}
    found = resting(fast, mission, {"q0": LIMITS}, {"q0": 5})
    slow, cuts = found.paths["q0"], found.cuts["q0"]
    assert max(np.diff([0, *cuts, len(slow)])) <= 5
    assert slow.duration < 30.0


def test_nobody_rests_in_a_hoop_where_that_can_be_helped(mission: Mission) -> None:
    """A way that goes through a hoop at each node but a few."""
    hoop = next(iter(mission.hoops.values()))
    points = np.repeat(np.append(np.array(hoop.center), 0.0)[None], 41, axis=0)
    points[::8, 0] += 0.8
    way = minimum_snap(points, np.arange(41.0))
    found = resting({"q0": way}, mission, {"q0": LIMITS}, {"q0": 20})
    places = found.paths["q0"].nodes[list(found.cuts["q0"]), :3]
    assert len(places) > 1
    assert (hoop.level(places) > 1.0).all()
