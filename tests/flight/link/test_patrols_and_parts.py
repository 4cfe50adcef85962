"""Patrols that brake behind their last lap, and flights in parts, over the simulated link: as certified, watched, and ended safely."""

from __future__ import annotations

import json

import numpy as np
import pytest

import flight
from flight.exports.scripts.flying.checks import Check
from flight.link import live_executive
from flight.link.live_executive import PATIENCE, SETTLE, LiveFlight, Operator, fly_live
from flight.link.phases import Stage
from flight.link.preflight_checks import at_start
from flight.link.simulated import Faults, SimulatedLink
from tests.helpers.few import few_of
from tests.helpers.live.live_failures import KINDS, disturb, on_the_ground, require_whole_logs
from tests.helpers.live.live_stages import laps_stages, parts_stages, patrol_stages, places_of
from verify import check_flight
from verify.data import BadInput, NotCertified, Trajectory
from verify.recordings.flight_log import Samples
from verify.recordings.flight_reference import FlightReference


@pytest.fixture(scope="module")
def patrol() -> tuple[Stage, ...]:
    return patrol_stages()


@pytest.fixture(scope="module")
def parts() -> tuple[Stage, ...]:
    return parts_stages()


@pytest.fixture(scope="module")
def laps() -> tuple[Stage, ...]:
    return laps_stages()


def link_to(stages: tuple[Stage, ...], faults: Faults | None = None, **conditions) -> SimulatedLink:
    mission = next(stage for stage in stages if stage.name == "flight").plan.mission
    return SimulatedLink(mission, places_of(stages), faults=faults, conditions=flight.Conditions(**conditions))


def flown_over(link: SimulatedLink, stages: tuple[Stage, ...], **more) -> LiveFlight:
    return fly_live(link, stages, grounds=dict.fromkeys(places_of(stages), 0.0), **more)


def samples_of(done: LiveFlight) -> Samples:
    """What `live.csv` holds, as the judge of recordings takes it."""
    rows = [line.split(",") for line in done.record.files()["live.csv"].splitlines()[1:]]
    times = sorted({float(row[0]) for row in rows})
    places = {name: np.full((len(times), 3), np.nan) for name in dict.fromkeys(row[1] for row in rows)}
    for time, name, *place in rows:
        places[name][times.index(float(time))] = [float(value) for value in place]
    return Samples(np.array(times), places)


def outcomes(done: LiveFlight, asked: FlightReference, **more) -> dict[str, set[str]]:
    verdict = check_flight(samples_of(done), asked, max_speed=1.5, start=0.0, **more)
    found: dict[str, set[str]] = {}
    for claim in verdict.claims:
        found.setdefault(claim.name, set()).add(claim.outcome)
    return found


@pytest.mark.slow
def test_a_patrol_brakes_to_rest_behind_its_laps_and_lands(patrol) -> None:
    link, looks = link_to(patrol), []
    done = flown_over(link, patrol, operator=Operator(looks.append))
    assert done.flown, done.reason
    assert link.spinning == ()
    stage, record = patrol[1], done.record
    assert list(record.starts) == ["climb", "flight", "braking", "landing"]
    laps = stage.claimed["r0"].duration
    assert stage.duration > laps + 0.4
    assert record.starts["braking"] - record.starts["flight"] == pytest.approx(laps, abs=0.03)
    assert record.starts["landing"] - record.starts["flight"] == pytest.approx(stage.duration + SETTLE, abs=0.05)
    assert {look.stage for look in looks} == set(record.starts)
    rows = [row for row in record.poses if row[1] == "r0"]
    assert len({row[0] for row in rows}) == len(rows), "nothing is recorded twice where braking begins"
    speeds = {look.stage: look.duration for look in looks}
    assert speeds["flight"] == pytest.approx(laps)
    covered = [event.sentence for event in record.events if event.kind == "tube"]
    assert [sentence.endswith("the certificate covers this flight.") for sentence in covered] == [True, True, False, True]
    assert "it was proved for such a flight" in covered[2]


@pytest.mark.slow
def test_of_a_patrols_recording_its_laps_are_judged(patrol) -> None:
    done = flown_over(link_to(patrol), patrol)
    stage = patrol[1]
    asked = FlightReference.of_certificate(stage.certificate, stage.team, stage.plan)
    found = outcomes(done, asked, error=1e-6)
    assert set(found) >= {"formula", "tube", "visits", "workspace"}
    assert set().union(*found.values()) == {"holds"}, found
    last = float(done.record.files()["live.csv"].splitlines()[-1].split(",")[0])
    assert 0.0 <= last - stage.claimed["r0"].duration < 0.05, "braking is not part of it"


@pytest.mark.slow
@few_of(
    1,
    ("name", "looks", "waits"),
    [("place", 100, 2.0), ("place", 10_000, PATIENCE), ("heading", 100, 2.0), ("pose", 10_000, 0.0)],
)
def test_robots_that_swing_come_to_rest_before_they_go_on(
    patrol, monkeypatch: pytest.MonkeyPatch, name: str, looks: int, waits: float
) -> None:
    """As for as many looks; a robot that is not seen at all is waited for no longer."""
    times: list[float] = []

    def swinging(link: SimulatedLink, part: Stage) -> tuple[Check, ...]:
        if part.name != "landing" or len(times) >= looks:
            return at_start(link, part)
        times.append(link.now())
        return (Check(name, "r0", False, "r0 swings"),)

    monkeypatch.setattr(live_executive, "at_start", swinging)
    done = flown_over(link_to(patrol), patrol)
    assert times[-1] - times[0] == pytest.approx(waits, abs=0.05)
    assert (done.flown, done.reason) == ((True, "") if looks == 100 else (False, "r0 swings"))
    assert not done.unsafe


def test_a_braking_that_is_not_proved_is_no_stage(patrol) -> None:
    stage = patrol[1]
    path = stage.paths["r0"]
    coefficients = path.coefficients.copy()
    coefficients[-1, 0, 5] += 0.2
    for wrong, says in (
        (Trajectory(path.durations, coefficients), "how r0 brakes behind its last lap is not proved"),
        (Trajectory(path.durations[:-1], path.coefficients[:-1]), "it does not brake"),
        (Trajectory(path.durations[1:], path.coefficients[1:]), "is not proved"),
    ):
        with pytest.raises(NotCertified, match=says):
            Stage("flight", stage.plan, stage.team, stage.certificate, {"r0": wrong})
    with pytest.raises(BadInput, match="r7 brakes behind laps of r0"):
        Stage("flight", stage.plan, stage.team, stage.certificate, {"r7": path})


def test_a_flight_in_parts_pauses_between_them_and_is_judged_whole(parts) -> None:
    link, looks = link_to(parts, noise=0.0005), []
    done = flown_over(link, parts, operator=Operator(looks.append))
    assert done.flown, done.reason
    assert link.spinning == ()
    pauses, stage = done.record.pauses("flight"), parts[1]
    assert len(pauses) == 2
    assert all(SETTLE <= pause < SETTLE + 0.1 for pause in pauses)
    assert [name for name in dict.fromkeys(look.stage for look in looks) if "part" in name] == [
        "flight part 1",
        "flight part 2",
        "flight part 3",
    ]
    data = json.loads(done.record.files()["live.json"])
    lengths = [end - begin for begin, end in data["parts"]["flight"]]
    assert sum(lengths) == pytest.approx(stage.duration)
    assert data["ends"]["flight"] - data["starts"]["flight"] == pytest.approx(stage.duration + sum(pauses), abs=0.05)
    paused = {name: path.paused(pauses) for name, path in stage.team.items()}
    certificate = flight_of(stage, paused)
    found = outcomes(done, FlightReference.of_certificate(certificate, paused, stage.plan), error=0.0035)
    assert set().union(*found.values()) == {"holds"}, found
    whole = FlightReference.of_certificate(stage.certificate, stage.team, stage.plan)
    assert outcomes(done, whole, error=0.0035)["tube"] != {"holds"}, "without its pauses it is another flight"


def flight_of(stage: Stage, team):
    from verify import certify

    return certify(stage.plan, team, margin=stage.certificate.margin)


@pytest.mark.slow
def test_laps_in_parts_are_stored_once_and_begun_again(laps) -> None:
    stage = laps[1]
    assert len(stage.stored) == 2
    assert [part.stored for part in stage.parts] == [0, 1, 1, 1]
    done = flown_over(link_to(laps), laps)
    assert done.flown, done.reason
    pauses = done.record.pauses("flight")
    assert len(pauses) == 3
    team = {name: path.flattened(3).paused(pauses) for name, path in stage.team.items()}
    found = outcomes(done, FlightReference.of_certificate(stage.certificate, team, stage.plan), error=1e-6)
    assert found.pop("formula") == {"undecided"}
    assert set().union(*found.values()) == {"holds"}, found


class SlowLink(SimulatedLink):
    """Takes so many seconds to bring each part on board, and tells who asks meanwhile."""

    slow = 0.0

    def bring(self, number: int, meanwhile) -> None:
        end = self.now() + self.slow
        while self.now() < end:
            self.sleep(0.02)
            meanwhile()


def slow_link(stages, seconds: float, faults: Faults | None = None) -> SlowLink:
    link = SlowLink(stages[1].plan.mission, places_of(stages), faults=faults, conditions=flight.Conditions())
    link.slow = seconds
    return link


@pytest.mark.slow
def test_pauses_may_be_of_any_length_and_are_watched(parts) -> None:
    link = slow_link(parts, 7.0)
    done = flown_over(link, parts)
    assert done.flown, done.reason
    pauses, stage = done.record.pauses("flight"), parts[1]
    assert all(pause == pytest.approx(7.0 + SETTLE, abs=0.1) for pause in pauses)
    times = [row[0] for row in done.record.poses if done.record.starts["flight"] < row[0] < done.record.ends["flight"]]
    assert max(np.diff(sorted(set(times)))) < 0.05, "nobody is out of sight while parts are brought"
    paused = {name: path.paused(pauses) for name, path in stage.team.items()}
    found = outcomes(done, FlightReference.of_certificate(flight_of(stage, paused), paused, stage.plan), error=1e-6)
    assert set().union(*found.values()) == {"holds"}, found


@pytest.mark.slow
def test_a_pause_that_an_endurance_does_not_count_lands_the_team() -> None:
    stages = parts_stages(extra="limits: {endurance: 400}")
    link = slow_link(stages, 61.0)
    done = flown_over(link, stages)
    assert "flight part 2 has not begun within 60 s" in done.reason
    assert link.spinning == ()
    assert done.unsafe == ()


def pause_of(stages: tuple[Stage, ...]) -> float:
    """When the team hovers between the first two parts of an undisturbed flight, s."""
    return 0.52 + stages[0].duration + 1.02 + stages[1].parts[0].duration + 0.5


@few_of(1, "kind", ["unseen", "pushed", "lost"])
@pytest.mark.slow
def test_what_fails_between_parts_ends_on_the_ground(parts, kind) -> None:
    when = pause_of(parts)
    faults = {"unseen": Faults(unseen={"r1": when}), "pushed": Faults(pushed={"r1": (when, 0.08)}), "lost": Faults(lost=when)}
    link = link_to(parts, faults[kind])
    done = flown_over(link, parts)
    assert not done.flown
    assert len(done.record.parts["flight"]) == 1, "no other part was begun"
    link.sleep(20.0)
    assert link.spinning == ()


@pytest.mark.slow
def test_who_does_not_begin_the_next_part_ends_it_for_all(parts) -> None:
    link = link_to(parts, Faults(deaf={"r1": pause_of(parts)}))
    done = flown_over(link, parts)
    assert "r1" in done.reason
    assert "from its plan" in done.reason or "apart" in done.reason
    link.sleep(20.0)
    assert link.spinning == ()


@pytest.mark.slow
@few_of(1, "seconds", [0.1, 0.4])
def test_a_patrol_that_is_interrupted_while_it_brakes_lands(patrol, seconds) -> None:
    link = link_to(patrol)
    when = 0.52 + patrol[0].duration + 1.02 + patrol[1].claimed["r0"].duration + seconds
    slept = link.sleep

    def sleep(seconds: float) -> None:
        if link.now() >= when and link.sleep is not slept:
            link.sleep = slept
            raise KeyboardInterrupt
        slept(seconds)

    link.sleep = sleep
    done = flown_over(link, patrol)
    assert done.reason == "interrupted"
    assert list(done.record.starts)[-1] == "braking"
    assert link.spinning == ()
    assert done.unsafe == ()


@pytest.mark.slow
@pytest.mark.parametrize("which", ["patrol", "parts", "laps"])
def test_random_failures_of_patrols_and_parts_end_on_the_ground(request, which) -> None:
    stages = request.getfixturevalue(which)
    rng, robots = np.random.default_rng(7), tuple(places_of(stages))
    undisturbed = flown_over(link_to(stages, noise=0.001, wind="0.2+0.1"), stages)
    assert undisturbed.flown, undisturbed.reason
    record, kinds = undisturbed.record, (*KINDS, "hangs", "interrupted", "error")
    begins = [begin for begin, _ in record.parts.get("flight", ())][1:] or [record.starts["braking"] + 0.5]
    for turn in range(45):
        kind, robot = kinds[turn % len(kinds)], robots[rng.integers(len(robots))]
        when = float(begins[rng.integers(len(begins))] + rng.uniform(-1.6, 0.6))
        lasts, link = float(rng.uniform(0.05, 4.0)), link_to(stages, noise=0.001, wind="0.2+0.1")
        disturb(link, kind, robot, when, lasts)
        done, case = flown_over(link, stages), (kind, robot, when, lasts)
        assert on_the_ground(link), case
        assert done.flown is (not done.reason and not done.unsafe), case
        assert not done.unsafe or kind in ("deaf", "lost", "both"), case
        assert all(link.pose(name).position[2] < 0.2 for name in robots if kind in ("flat", "hangs", "interrupted", "error")), (
            case
        )
        require_whole_logs(done, ("climb", "flight", "braking", "landing"))
