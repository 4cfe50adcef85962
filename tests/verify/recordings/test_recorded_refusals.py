"""Recorded flights that break a claim are refused with the right witness, and nothing that is broken is said to hold."""

from __future__ import annotations

import itertools
from dataclasses import replace
from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.helpers.live.recordings import aside, asked, claims, darting, dense, fires, gates, judged, recorded, refused
from tests.helpers.motion.flights import small_mission
from verify import FlightReference, Samples, check_flight
from verify.data import BadInput, Word
from verify.logic.semantics import satisfies

TWO = """a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}
b: {center: [2.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}"""


def moved(by, robot="quad0", when=(-np.inf, np.inf)):
    """Return a change of a recording: one robot is elsewhere for some time."""

    def change(name, times, places):
        late = (times >= when[0]) & (times <= when[1])
        return places + np.where(late, 1.0, 0.0)[:, None] * np.array(by) if name == robot else places

    return change


def test_a_robot_that_is_parked_on_the_floor_satisfies_no_sequence():
    parked = recorded(gates(), lambda _, __, places: np.tile([places[0, 0], places[0, 1], 0.0], (len(places), 1)))
    verdict = judged(gates(), parked)
    assert verdict.outcome == "fails"
    assert refused(verdict, "passages").region == "gate0"
    assert refused(verdict, "workspace").what == "wall z min"
    assert refused(verdict, "workspace").bound == pytest.approx(-0.2)
    assert refused(verdict, "tube").robot == "quad0"
    assert refused(verdict, "visits").region == "gate0"
    alone = check_flight(parked, FlightReference.of_mission(gates()[0].mission), max_speed=1.2)
    assert refused(alone, "passages").region == "gate0"


def test_a_sphere_inside_a_rim_is_refused():
    """Off the axis by opening less radius and 25 mm more, the vehicle's sphere is 25 mm inside the rim."""
    mission = gates()[0].mission
    by = mission.hoops["gate0"].opening - mission.vehicle.radius + 0.025
    crossing = float(np.argmax(gates()[1]["quad0"].evaluate(np.arange(0, 8, 0.001))[:, 0] >= 0)) / 1000
    verdict = judged(gates(), recorded(gates(), aside([0, 0, by], crossing)))
    witness = refused(verdict, "rims")
    assert (witness.robot, witness.region) == ("quad0", "gate0")
    assert witness.time == pytest.approx(crossing, abs=0.1)
    assert witness.bound == pytest.approx(mission.vehicle.radius - 0.025, abs=2e-3)


def test_a_robot_outside_the_workspace_is_refused():
    verdict = judged(fires(), recorded(fires(), moved([0, 0, 3.0], "quad2")))
    witness = refused(verdict, "workspace")
    assert (witness.robot, witness.what) == ("quad2", "wall z max")
    height = fires()[0].mission.agents["quad2"].start[2]
    assert witness.bound == pytest.approx(1.8 - 3.0 - height, abs=1e-6)


def test_a_flight_off_its_plan_is_refused_with_the_distance():
    verdict = judged(fires(), recorded(fires(), aside([0, 0, 0.491], 4.0, robot="quad1")), max_speed=2.0)
    witness = refused(verdict, "tube")
    assert (witness.robot, witness.limit) == ("quad1", fires()[2].margin)
    assert witness.bound == pytest.approx(0.491, abs=1e-3)
    assert witness.time == pytest.approx(4.0, abs=0.02)


def test_robots_that_come_too_near_are_refused():
    path = fires()[1]["quad0"]
    verdict = judged(
        fires(), recorded(fires(), lambda name, t, p: path.evaluate(t)[:, :3] + [0, 0, 0.2] if name == "quad2" else p)
    )
    witness = refused(verdict, "separation")
    assert (witness.robot, witness.other) == ("quad0", "quad2")
    assert witness.bound == pytest.approx(0.2, abs=1e-6)


def test_carrying_without_ever_having_been_at_the_water_does_not_count():
    """Planned actions are taken over only where the samples allow them at their place."""

    def around_the_water(name, times, places):
        water = np.array(fires()[0].mission.hoops["water"].center)
        near = np.exp(-(np.linalg.norm(places - water, axis=1) ** 2) / 0.3)
        return places + near[:, None] * np.array([0, 0, 0.45]) if name == "quad0" else places

    verdict = judged(fires(), recorded(fires(), around_the_water), max_speed=2.0)
    witness = refused(verdict, "actions")
    assert (witness.robot, witness.region, witness.visit) == ("quad0", "water", 0)
    assert claims(verdict)["formula"] == {"fails"}
    assert refused(verdict, "visits").region == "water"
    log = recorded(fires(), around_the_water)
    instant = fires()[2].actions[0].time
    letters = {
        name: [frozenset({"carrying"} if name == "quad0" and t > instant else ()) for t in log.times] for name in log.positions
    }
    written = judged(fires(), replace(log, internal=letters), max_speed=2.0)
    assert refused(written, "actions").region == "water"


def test_a_log_that_misses_a_planned_action_or_makes_another_is_refused():
    samples = recorded(fires())
    never = {name: [frozenset[str]() for _ in samples.times] for name in samples.positions}
    assert "is not made" in refused(judged(fires(), replace(samples, internal=never)), "actions").sentence
    early = {**never, "quad1": [frozenset({"carrying"} if t > 0.5 else ()) for t in samples.times]}
    witness = next(
        claim.witness for claim in judged(fires(), replace(samples, internal=early)).claims
        if claim.name == "actions" and claim.robot == "quad1"
    )  # fmt: skip
    assert witness.region == "water"
    assert witness.time == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("formula", ["G !a", "!a U b"])
def test_times_of_a_broken_formula_are_those_of_the_recording(formula):
    mission = small_mission(formula, regions=TWO)
    times = np.arange(0.0, 4.005, 0.01)
    across = np.stack([times / 2, np.zeros_like(times), np.ones_like(times)], axis=1)
    found = []
    for begin in (0.0, 7.0):
        verdict = check_flight(Samples(times + begin, {"r0": across}), FlightReference.of_mission(mission), max_speed=0.8)
        (claim,) = (claim for claim in verdict.claims if claim.name == "formula")
        assert claim.outcome == "fails"
        found.append(claim)
    first, later = found
    assert later.time == later.witness.time == pytest.approx(first.time + 7.0)
    assert np.array(later.witness.times) == pytest.approx(np.array(first.witness.times) + 7.0)
    assert later.sentence == later.witness.sentence == f"{first.sentence} (Times from 7.0000 s of the recording on.)"


@pytest.mark.parametrize(
    ("change", "options", "says"),
    [
        (lambda s: s, {"max_speed": None}, "without a speed bound"),
        (lambda s: s, {"max_speed": 0.1}, "allow"),
        (lambda s: s, {"error": -1.0}, "error must be"),
        (lambda s: s, {"start": float("nan")}, "start must be"),
        (lambda s: s, {"start": True}, "start must be"),
        (lambda s: s, {"max_acceleration": True}, "max_acceleration must be"),
        (lambda s: None, {}, "Give Samples"),
        (lambda s: replace(s, times=s.times.astype(str)), {}, "array of numbers"),
        (lambda s: replace(s, times=s.times.astype(complex)), {}, "array of numbers"),
        (lambda s: replace(s, positions=None), {}, "positions must be a table"),
        (lambda s: replace(s, internal={n: ["carrying"] * len(s.times) for n in s.positions}), {}, "sets of names"),
        (lambda s: replace(s, times=s.times[::-1]), {}, "increase"),
        (lambda s: replace(s, positions={"quad0": s.positions["quad0"]}), {}, "robots"),
        (lambda s: replace(s, positions={n: p[:-1] for n, p in s.positions.items()}), {}, "shape"),
        (lambda s: replace(s, positions={n: p * np.nan for n, p in s.positions.items()}), {}, "no sample"),
        (lambda s: replace(s, positions={n: p + np.inf for n, p in s.positions.items()}), {}, "finite"),
    ],
)
def test_bad_input(change, options, says):
    with pytest.raises(BadInput, match=says):
        check_flight(change(recorded(fires())), asked(fires()), **{"max_speed": 1.2, "start": 0.0, **options})


def rim_distance(places, hoop):
    offset = places - np.array(hoop.center)
    along = offset @ np.array(hoop.normal)
    across = np.linalg.norm(offset - along[:, None] * np.array(hoop.normal), axis=1)
    radial = np.maximum.reduce([hoop.opening - across, across - hoop.opening - hoop.rim, 0 * across])
    return np.hypot(radial, np.maximum(np.abs(along) - hoop.rim / 2, 0))


def passed(places, mission):
    """Return the openings that a dense path passes, in order, to and fro within the margin taken as once."""
    found = []
    for name, hoop in mission.hoops.items():
        offset = places - np.array(hoop.center)
        along = offset @ np.array(hoop.normal)
        across = np.linalg.norm(offset - along[:, None] * np.array(hoop.normal), axis=1)
        beyond = np.flatnonzero(np.abs(along) > mission.margin)
        turned = np.flatnonzero(np.diff(along[beyond] > 0))
        for before, after in zip(beyond[turned], beyond[turned + 1], strict=True):
            crossed = before + np.flatnonzero(np.diff(along[before : after + 1] > 0))[-1]
            if across[crossed] <= hoop.opening:
                found.append((crossed, name + ("F" if along[after] > 0 else "R")))
    return [name for _, name in sorted(found)]


def truths(made, times, paths):
    """Say of a dense path which claims it surely keeps or breaks: the least room of each, negative where it is broken."""
    plan, team, certificate = made
    mission = plan.mission
    rooms = {}
    for robot, places in paths.items():
        off = np.linalg.norm(places - team[robot].evaluate(times)[:, :3], axis=1)
        rooms["tube", robot, None] = certificate.margin - off.max()
        low, high = np.array(mission.workspace.min), np.array(mission.workspace.max)
        rooms["workspace", robot, None] = min((places - low).min(), (high - places).min())
        rooms["rims", robot, None] = min(rim_distance(places, h).min() for h in mission.hoops.values()) - mission.vehicle.radius
        wanted = [v.region + v.direction for v in plan.robots[robot].visits]
        rooms["passages", robot, None] = 1.0 if passed(places, mission) == wanted else -1.0
    for a, b in itertools.combinations(paths, 2):
        rooms["separation", a, b] = np.linalg.norm(paths[a] - paths[b], axis=1).min() - mission.separation
    if mission.spec.formula is not None:
        rooms["formula", None, None] = 1.0 if holds_of_some(made, times, paths, Random(0)) else -1.0
    return rooms


def holds_of_some(made, times, paths, rng):
    """Tell whether readings of a dense path satisfy the formula; the letters change between samples that are near each other."""
    plan, _, certificate = made
    mission = plan.mission
    letters = []
    for robot, places in paths.items():
        inside = {name: region.level(places) <= 1 for name, region in mission.all_regions.items()}
        filled = [a.time for a in certificate.actions if a.robot == robot and inside["water"][np.searchsorted(times, a.time)]]
        bits = sum(row.astype(int) << k for k, row in enumerate(inside.values()))
        bits = bits + (np.searchsorted(filled, times, side="right") << len(inside))
        names = [*inside, "carrying"]
        for i in np.flatnonzero(np.r_[True, np.diff(bits) != 0]):
            letter = frozenset(name for k, name in enumerate(names) if bits[i] >> k & 1)
            letters.append((times[i], rng.random(), letter))
    word = [letter for _, _, letter in sorted(letters, key=lambda entry: entry[:2])]
    return satisfies(mission.formula, Word(tuple(letter for letter, _ in itertools.groupby(word))))


@pytest.mark.parametrize("made", [fires, gates])
@settings(max_examples=6, deadline=None)
@given(data=st.data())
def test_nothing_that_is_broken_is_said_to_hold(made, data):
    """Random recordings of perturbed flights, held against continuous paths that go as far aside as the speed allows."""
    seed = data.draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    plan, _, certificate = made()
    size = data.draw(st.sampled_from([0.0, 0.02, 0.045, 0.1, 0.3]))
    rate = data.draw(st.sampled_from([15.0, 40.0, 100.0]))
    error = data.draw(st.sampled_from([0.0, 0.005]))
    quick = data.draw(st.sampled_from([1.02, 1.3, 2.0]))
    waves = {name: (rng.normal(size=3), rng.uniform(0.2, 2.0), rng.uniform(0, 6)) for name in plan.mission.agents}

    def perturbed(name, times, places):
        direction, frequency, phase = waves[name]
        return places + size * np.sin(frequency * times + phase)[:, None] * direction / np.linalg.norm(direction)

    exact = recorded(made(), perturbed, rate=rate)
    steps = [np.linalg.norm(np.diff(p, axis=0), axis=1).max() * rate for p in exact.positions.values()]
    speed = float(max(steps) * quick + 1e-3)
    noise = {name: rng.normal(size=p.shape) for name, p in exact.positions.items()}
    noise = {name: error * 0.999 * n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-9) for name, n in noise.items()}
    measured = Samples(exact.times, {name: p + noise[name] for name, p in exact.positions.items()})
    verdict = judged(made(), measured, max_speed=speed, error=error)
    times = np.arange(0, certificate.duration, 1e-3)
    paths = {}
    for name, places in exact.positions.items():
        at, corners = darting(exact.times, places, speed, rng)
        fine = np.unique(np.r_[times, at[at <= certificate.duration]])
        paths[name] = fine, at, corners
    shared = np.unique(np.concatenate([fine for fine, _, _ in paths.values()]))
    rooms = truths(made(), shared, {name: dense(shared, at, corners) for name, (_, at, corners) in paths.items()})
    for claim in verdict.claims:
        room = rooms.get((claim.name, claim.robot, claim.other)) if claim.name != "formula" else rooms["formula", None, None]
        if room is None:
            continue
        assert not (claim.outcome == "holds" and room < -1e-7), (claim, room)
        assert not (claim.outcome == "fails" and room > 2e-3), (claim, room)
