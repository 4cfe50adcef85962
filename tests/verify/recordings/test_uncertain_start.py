"""Recordings that leave open when their flight began: nothing is said that is not so for each start that is left."""

import numpy as np
import pytest

from tests.helpers.motion.flights import legs, plan_of, small_mission
from verify import FlightReference, FlightVerdict, Samples, certify, check_flight
from verify.data.plan import Visit

REGIONS = """a: {center: [1.6, 0.0, 1.0], radii: [0.15, 0.15, 0.15]}
b: {center: [-0.1, 0.8, 1.0], radii: [0.15, 0.15, 0.15]}
c: {center: [0.0, -0.6, 1.0], radii: [0.15, 0.15, 0.15]}"""
BEGIN, HOVER = 4.0, 3.0
"""s, when the flight begins, and since when its robot has hovered at its start."""


def climbed(
    formula: str, *, then: tuple[float, float, float] | None = None
) -> tuple[FlightReference, FlightReference, Samples]:
    """Return a flight to a, asked with its plan and of its mission alone, and a recording of it in which its robot was in c for 2 s before."""
    mission = small_mission(formula, regions=REGIONS, starts=((0.0, 0.0, 1.0),), margin=0.05)
    plan, team = plan_of(mission, {"r0": (Visit(region="a"),)}), {"r0": legs([(0.0, 0.0, 1.0), (1.6, 0.0, 1.0)])}
    certificate, end = certify(plan, team), team["r0"].duration
    times = np.arange(0.0, BEGIN + end + 4.0, 0.02)
    places = team["r0"].evaluate(np.clip(times - BEGIN, 0.0, end))[:, :3]
    before = times < BEGIN
    places[before, 1] = np.interp(times[before], [0.0, 2.0, HOVER], [-0.6, -0.6, 0.0])
    if then is not None:  # behind its end
        leaves, arrives = BEGIN + end + 1.0, BEGIN + end + 3.5
        after = times > leaves
        places[after] = np.stack(
            [np.interp(times[after], [leaves, arrives], [(1.6, 0.0, 1.0)[k], then[k]]) for k in range(3)], axis=1
        )
    samples = Samples(times, {"r0": places})
    return FlightReference.of_certificate(certificate, team, plan), FlightReference.of_mission(mission), samples


def outcomes(verdict: FlightVerdict) -> dict[str, str]:
    return {claim.name: claim.outcome for claim in verdict.claims}


def test_what_was_visited_before_some_of_the_starts_is_not_taken_for_the_flight() -> None:
    _, alone, samples = climbed("F a")
    seen = {"F c": "holds", "G !c": "fails"}
    for formula, outcome in seen.items():
        asked = FlightReference.of_mission(alone.mission.asking(formula))
        found = {
            "whole": check_flight(samples, asked, max_speed=1.5, start=0.0),
            "late": check_flight(samples, asked, max_speed=1.5, start=BEGIN),
            "open": check_flight(samples, asked, max_speed=1.5, start=(0.0, BEGIN)),
        }
        assert [outcomes(found[which])["formula"] for which in ("whole", "late")] == [
            outcome,
            "holds" if outcome == "fails" else "fails",
        ]
        assert outcomes(found["open"])["formula"] == "undecided"
        assert "cannot tell" in found["open"].sentence


@pytest.mark.parametrize("start", [(HOVER + 0.2, BEGIN), (BEGIN - 0.05, BEGIN + 0.05)])
def test_while_nothing_changes_every_start_tells_the_same(start: tuple[float, float]) -> None:
    _, alone, samples = climbed("F a & (F c -> F b)")
    assert outcomes(check_flight(samples, alone, max_speed=1.5, start=start))["formula"] == "holds"
    never = FlightReference.of_mission(alone.mission.asking("F b"))
    assert outcomes(check_flight(samples, never, max_speed=1.5, start=start))["formula"] == "fails"


def test_a_climb_or_landing_through_other_regions_breaks_nothing_where_the_start_is_not_known() -> None:
    planned, _, samples = climbed("F(a & G !b)", then=(-0.1, 0.8, 1.0))
    told = check_flight(samples, planned, max_speed=1.5, start=BEGIN)
    assert told.outcome == "holds"
    found = check_flight(samples, planned, max_speed=1.5)
    assert not found.alignment.trusted
    assert found.outcome == "undecided"
    assert outcomes(found)["formula"] == "undecided"  # in all of the recording it is broken: b is visited at its end


def test_where_the_start_is_not_known_nothing_holds_that_the_climb_alone_may_have_done() -> None:
    planned, _, samples = climbed("F a")
    found = check_flight(samples, planned, max_speed=1.5)
    assert outcomes(found)["formula"] == "undecided"
    assert outcomes(found)["workspace"] == "holds"


def test_a_visit_that_is_nowhere_in_the_recording_was_not_made() -> None:
    planned, _, samples = climbed("F a")
    stays = samples.positions["r0"].copy()
    stays[:, 0] = np.minimum(stays[:, 0], 1.0)
    found = outcomes(check_flight(Samples(samples.times, {"r0": stays}), planned, max_speed=1.5))
    assert found["visits"] == "fails"


def test_walls_are_met_in_flight_only_where_every_start_says_so() -> None:
    _, alone, samples = climbed("F a")
    low = samples.positions["r0"].copy()
    sinks = samples.times < 2.5  # below the workspace, ever deeper
    low[sinks, 2] = -5.5 - 0.1 * samples.times[sinks]
    rising = (samples.times >= 2.5) & (samples.times < 3.5)
    low[rising, 2] = np.linspace(-5.75, 1.0, int(rising.sum()))
    climbing = Samples(samples.times, {"r0": low})
    assert outcomes(check_flight(climbing, alone, max_speed=9.0, start=(2.0, BEGIN)))["workspace"] == "undecided"
    assert outcomes(check_flight(climbing, alone, max_speed=9.0, start=(1.0, 2.0)))["workspace"] == "fails"


def test_a_start_that_may_lie_behind_the_recording_tells_nothing() -> None:
    _, alone, samples = climbed("F a")
    found = check_flight(samples, alone, max_speed=1.5, start=(BEGIN, 1000.0))
    assert found.outcome == "undecided"


def test_of_a_flight_that_was_recorded_in_part_nothing_holds_where_its_start_is_not_known() -> None:
    planned, _, samples = climbed("F a")
    part = (samples.times > BEGIN + 1.0) & (samples.times < BEGIN + 2.0)
    found = check_flight(Samples(samples.times[part], {"r0": samples.positions["r0"][part]}), planned, max_speed=1.5)
    assert not found.alignment.trusted
    assert set(outcomes(found).values()) == {"undecided"}
    assert any("shorter than the flight" in claim.sentence for claim in found.claims if claim.name == "workspace")
