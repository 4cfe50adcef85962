"""Separation of fleets: the broad phase against the plain judge, the plain judge against a dense sampler, and planted breaches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.motion.fleets import sampled, wandering
from tests.helpers.motion.flights import legs, small_mission
from verify.arithmetic.balls import Floats
from verify.motion.paths import read_team
from verify.motion.separation import minimum_distances, pairwise_distances
from verify.third_party import near_pieces
from verify.third_party.crazyswarm_folders import flight_of
from verify.third_party.distances import Breach, Closest, Nearest, Separation, judge_distances
from verify.third_party.fleet import Fleet, Flight, Indices, assemble, two_floats
from verify.third_party.joints import jumps


def asking(limit: float, fleet: Fleet, weight: Fraction = Fraction(1)) -> Separation:
    def limits(one: Indices, other: Indices) -> Floats:
        return np.full(np.broadcast(one, other).shape, limit)

    return Separation(limits, limit, weight, np.zeros(len(fleet)), limit)


def plainly(fleet: Fleet, asked: Separation) -> tuple[Nearest, list[Breach]]:
    return judge_distances(fleet, asked, near_pieces.all_pieces(fleet), Closest())


def quickly(fleet: Fleet, asked: Separation, monkeypatch: pytest.MonkeyPatch) -> tuple[Nearest, list[Breach]]:
    monkeypatch.setattr(near_pieces, "FEW", 0)
    closest = Closest()
    return judge_distances(fleet, asked, near_pieces.near_pieces(fleet, asked, closest), closest)


def spans(breaches: list[Breach]) -> list[tuple[int, int, float, float]]:
    return sorted((b.one, b.other, round(b.start, 6), round(b.stop, 6)) for b in breaches)


def same(one: tuple[Nearest, list[Breach]], other: tuple[Nearest, list[Breach]]) -> bool:
    """Tell whether two judges see the same breaches, or where there are none the same least distance."""
    if one[1] or other[1]:
        return spans(one[1]) == spans(other[1])
    pairs = ((one[0].low, other[0].low), (one[0].high, other[0].high))  # told to a millionth of a metre, or of its square
    return all(min(abs(a - b), abs(a * a - b * b)) < 2e-6 for a, b in pairs)


@few_of(1, "common", [True, False])
@few_of(1, "seed", range(4))
def test_the_broad_phase_leaves_nothing_out(seed: int, common: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(seed)
    fleet = wandering(int(rng.integers(2, 8)), 4, rng, common=common, size=float(rng.uniform(3, 9)))
    weight = Fraction(1) if seed % 2 else Fraction(float(rng.uniform(0.3, 1.5)))
    for limit in (0.05, 0.3, 0.8):
        asked = asking(limit, fleet, weight)
        assert same(plainly(fleet, asked), quickly(fleet, asked, monkeypatch))


@few_of(1, "seed", [80, 237, 353])
def test_pairs_are_kept_of_which_one_drone_changes_pieces_meanwhile(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 400 teams those in which a breach is near a joint of one drone's path alone."""
    rng = np.random.default_rng(seed)
    pieces = {"drones": int(rng.integers(2, 9)), "pieces": int(rng.integers(1, 3))}
    fleet = wandering(**pieces, rng=rng, common=False, size=float(rng.uniform(2, 12)))
    asked = asking(float(rng.uniform(0.01, 1.0)), fleet)
    assert same(plainly(fleet, asked), quickly(fleet, asked, monkeypatch))


@pytest.mark.slow
def test_the_broad_phase_leaves_nothing_out_of_many_teams(monkeypatch: pytest.MonkeyPatch) -> None:
    """Random teams, of few pieces and of many, whose clocks agree or do not."""
    rng = np.random.default_rng(7)
    for _ in range(300):
        fleet = wandering(
            int(rng.integers(2, 9)), int(rng.integers(1, 6)), rng, common=bool(rng.integers(2)), size=float(rng.uniform(2, 12))
        )
        asked = asking(float(rng.uniform(0.01, 1.0)), fleet)
        assert same(plainly(fleet, asked), quickly(fleet, asked, monkeypatch))


@few_of(1, "seed", range(3))
def test_the_judge_agrees_with_a_dense_sampler(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    fleet = wandering(3, 3, rng, common=seed != 1, size=4.0)
    times = np.linspace(0.0, float(fleet.end), 2001)
    paths = [sampled(fleet, drone, times) for drone in range(3)]
    seen = {(a, b): np.linalg.norm(paths[a] - paths[b], axis=1) for a in range(3) for b in range(a + 1, 3)}
    nearest, breaches = plainly(fleet, asking(0.7, fleet))
    for pair, distances in seen.items():
        for time in times[distances < 0.7 - 1e-9]:
            assert any((b.one, b.other) == pair and b.start - 1e-9 <= time <= b.stop + 1e-9 for b in breaches)
        for breach in breaches:
            if (breach.one, breach.other) == pair:
                assert breach.distance <= distances[(times >= breach.start) & (times <= breach.stop)].min(initial=np.inf) + 1e-6
    nearest, breaches = plainly(fleet, asking(0.0, fleet))
    assert not breaches
    least = min(distances.min() for distances in seen.values())
    assert nearest.low <= least
    assert least - 0.02 < nearest.low


def passing(offset: float, seconds: float = 1.0) -> Fleet:
    """Return two drones that fly 10 m past each other in some seconds, at that distance at the nearest, half-way."""
    knots = np.array([[0.0, 0.0], [seconds, 0.0]])
    straight = [np.array([[[-5.0, 5.0], [0.0, 0.0], [1.0, 1.0]]]), np.array([[[5.0, -5.0], [offset, offset], [1.0, 1.0]]])]
    return assemble("show", "bernstein", [Flight(f"d{i}", knots, v, np.ones(1, np.int8)) for i, v in enumerate(straight)])


def test_ties_are_decided_exactly(monkeypatch: pytest.MonkeyPatch) -> None:
    fleet = passing(0.25)
    for judge in (plainly, lambda f, a: quickly(f, a, monkeypatch)):
        nearest, breaches = judge(fleet, asking(0.25, fleet))
        assert not breaches
        assert nearest.low <= 0.25 <= nearest.high + 1e-9
        _, breaches = judge(fleet, asking(float(np.nextafter(0.25, 1)), fleet))
        assert [(b.one, b.other) for b in breaches] == [(0, 1)]


def test_a_flight_may_be_over_in_a_hundredth_of_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    fleet = passing(0.25, seconds=0.01)
    _, breaches = quickly(fleet, asking(0.3, fleet), monkeypatch)
    assert [(b.one, b.other) for b in breaches] == [(0, 1)]


def test_a_breach_says_when_it_begins_and_ends() -> None:
    fleet = passing(0.3)
    _, (breach,) = plainly(fleet, asking(0.5, fleet))
    assert (breach.start, breach.stop) == (pytest.approx(0.48, abs=1e-6), pytest.approx(0.52, abs=1e-6))
    assert breach.distance == pytest.approx(0.3, abs=1e-6)
    assert breach.sure


def formation(side: int, seconds: int) -> np.ndarray:
    """Return control points of drones on a grid of 2 m that drift together. Shape (drones, seconds, 3, 4)."""
    grid = 2.0 * np.stack(np.meshgrid(np.arange(side), np.arange(side), [0.0]), -1).reshape(-1, 3)
    times = np.arange(seconds + 1.0)
    drift = np.stack([3 * np.sin(times / 4), 2 * np.cos(times / 5), 5 + 0 * times], -1)
    slope = np.stack([0.75 * np.cos(times / 4), -0.4 * np.sin(times / 5), 0 * times], -1)
    cubic = np.stack([drift[:-1], drift[:-1] + slope[:-1] / 3, drift[1:] - slope[1:] / 3, drift[1:]], -1)
    return grid[:, None, :, None] + cubic[None]


def test_every_planted_breach_is_found() -> None:
    rng = np.random.default_rng(3)
    side, seconds, depth = 12, 20, 0.01
    values = formation(side, seconds)
    planted: set[tuple[int, int, int]] = set()
    knots = np.stack([np.arange(seconds + 1.0), np.zeros(seconds + 1)], -1)
    while (
        len(planted) < 30
    ):  # a drone's one second is bent towards its neighbour by as much as brings it 1 cm nearer than 1.6 m
        drone, piece = int(rng.integers(side * side)), int(rng.integers(1, seconds - 1))
        if drone % side == side - 1 or any(abs(drone - a) < 2 * side + 2 and abs(piece - p) < 2 for a, _, p in planted):
            continue
        values[drone, piece, 0, 1:3] += (0.4 + depth) * 4 / 3
        planted.add((drone, drone + 1, piece))
    degrees = np.full(seconds, 3, np.int8)
    fleet = assemble("show", "bernstein", [Flight(f"d{i}", knots, v, degrees) for i, v in enumerate(values)])
    asked, closest = asking(1.6, fleet), Closest()
    _, breaches = judge_distances(fleet, asked, near_pieces.near_pieces(fleet, asked, closest), closest)
    assert {(b.one, b.other, int(b.time)) for b in breaches} == planted
    assert all(b.distance == pytest.approx(1.59, abs=1e-6) for b in breaches)


def test_a_swift_drone_is_held_against_all(monkeypatch: pytest.MonkeyPatch) -> None:
    values = formation(5, 3)
    values[7, 1, :, 1:3] += np.array([[400.0, -400.0], [90.0, 10.0], [0.0, 30.0]])
    fleet = grid_fleet(values, np.zeros(25))
    asked = asking(1.5, fleet)
    assert same(plainly(fleet, asked), quickly(fleet, asked, monkeypatch))


def test_clocks_that_differ_by_roundings_leave_nothing_out(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(11)
    values = formation(4, 4)
    values[:, :, :, 1:3] += rng.uniform(-2.0, 2.0, (16, 4, 3, 2))
    fleet = grid_fleet(values, rng.choice([0.1, 0.1 + 2.0**-52, 0.1 - 2.0**-54, 0.1 + 1e-9], 16))
    for limit in (0.6, 1.3):
        asked = asking(limit, fleet)
        assert same(plainly(fleet, asked), quickly(fleet, asked, monkeypatch))


def grid_fleet(values: np.ndarray, starts: Floats) -> Fleet:
    """Return drones of one-second pieces, each of which begins at its own time; two-sums keep the times exact."""
    drones, seconds = values.shape[:2]
    flights: list[Flight] = []
    for i in range(drones):
        times = [Fraction(float(starts[i])) + k for k in range(seconds + 1)]
        flights.append(Flight(f"d{i}", two_floats(times, f"d{i}"), values[i], np.full(seconds, 3, np.int8)))
    return assemble("show", "bernstein", flights)


@few_of(1, "seed", range(3))
def test_folders_of_csv_files_are_judged_as_certificates_are(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(seed)
    starts = [tuple(row) for row in rng.uniform(0, 2, (7, 3)).tolist()]
    team = {
        f"r{i}": legs([start, *rng.uniform(0, 2, (2, 3)).tolist()], speed=float(rng.uniform(0.3, 0.6)))
        for i, start in enumerate(starts)
    }
    first = [tuple(t.coefficients[0, :3, 0].tolist()) for t in team.values()]
    paths = read_team(small_mission(starts=first), team)
    least = {(n.robot, n.other): n for n in minimum_distances(pairwise_distances(paths))}
    nearest = min(least.values(), key=lambda n: n.high)
    fleet = assemble("flights", "power", [flight_of(name, trajectory) for name, trajectory in team.items()])
    judged, _ = quickly(fleet, asking(0.0, fleet), monkeypatch)
    assert (fleet.names[judged.one], fleet.names[judged.other]) == (nearest.robot, nearest.other)
    assert judged.high == pytest.approx(nearest.high, abs=1e-5)
    limit = float(np.mean(sorted(n.high for n in least.values())[9:11]))  # between two pairs'
    _, breaches = quickly(fleet, asking(limit, fleet), monkeypatch)
    assert {(fleet.names[b.one], fleet.names[b.other]) for b in breaches} == {k for k, n in least.items() if n.high < limit}


def hovering(*places: tuple[float, float, float], step: float, steps: Sequence[int]) -> Fleet:
    """Drones that hover for 2 s; those in `steps` are moved aside by so much in the middle, all at once."""
    flights: list[Flight] = []
    for index, place in enumerate(places):
        values = np.repeat(np.array(place, dtype=np.float64)[None, :, None], 2, 0).repeat(2, -1)
        values[1, 1] += step * (index in steps)
        times = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
        flights.append(Flight(f"d{index}", times, values, np.ones(2, dtype=np.int8)))
    return assemble("show", "bernstein", flights)


def test_steps_between_pieces_are_taken_off_their_own_pairs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Far drones that step aside by 0.4 mm take nothing off the distance of two near ones, which is exactly what is asked."""
    fleet = hovering((0, 0, 1), (0.5, 0, 1), (9, 0, 1), (18, 0, 1), step=4e-4, steps=(2, 3))
    asked = replace(asking(0.5, fleet), steps=jumps(fleet, 0).jumps)
    for judge in (plainly, lambda f, a: quickly(f, a, monkeypatch)):
        nearest, breaches = judge(fleet, asked)
        assert not breaches
        assert 0.5 <= nearest.low <= nearest.high <= 0.5 + 1e-6
    near = hovering((0, 0, 1), (0.5, 0, 1), (0.5, 0.501, 1), step=4e-4, steps=(2,))
    nearest, breaches = plainly(near, replace(asking(0.5, near), steps=jumps(near, 0).jumps))
    assert not breaches
    assert nearest.low == 0.5
