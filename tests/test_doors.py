"""The doors of the library: what skipped its validation, or was changed behind its back, is refused in words everywhere."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import flight
import ltlplan
import refine
import verify
from ltlplan.online.simulated_online_flight import fly_online
from ltlplan.pipeline import certified_team
from tests.helpers.few import few_of
from tests.helpers.motion.flights import legs, plan_of, small_mission
from verify.data import BadInput, Formula, Mission, Plan, Trajectory, Word, check_mission
from verify.data.language.formula import TRUE
from verify.data.plan import RobotPlan, Visit, Waypoint
from verify.data.sections import Limits
from verify.testing import assert_satisfies

REGIONS = "a: {center: [1.0, 0.0, 1.0], radii: [0.3, 0.3, 0.3]}"


def sound() -> tuple[Plan, dict[str, Trajectory]]:
    """Return a plan and a flight that are certified."""
    mission = small_mission("F a", regions=REGIONS, margin=0.05)
    plan = plan_of(mission, {"r0": (Visit(region="a"),)}, {"r0": Word.of([[], ["a"]])})
    start = mission.agents["r0"].start
    points = [Waypoint(position=start, role="start"), Waypoint(position=(1.0, 0.0, 1.0), role="centre", region="a", visit=0)]
    robot = plan.robots["r0"].model_copy(update={"waypoints": tuple(points), "times": (0.0, 5.0)})
    return plan.model_copy(update={"robots": {"r0": robot}}), {"r0": legs([start, (1.0, 0.0, 1.0)])}


PLAN, TEAM = sound()
MISSION = PLAN.mission
CERT = verify.certify(PLAN, TEAM)


SAMPLES = verify.Samples(np.array([0.0, 1.0]), {"r0": np.zeros((2, 3))})


def behind(value: Any, name: str, part: Any) -> Any:
    """Return a copy with a field set as nobody should."""
    copy = value.model_copy()
    object.__setattr__(copy, name, part)
    return copy


def with_agent(**fields: Any) -> Mission:
    return MISSION.model_copy(update={"agents": {"r0": MISSION.agents["r0"].model_copy(update=fields)}})


MISSIONS: dict[str, tuple[Callable[[], Any], str]] = {
    "negative separation": (lambda: MISSION.model_copy(update={"separation": -1.0}), "separation: .*-1.0"),
    "NaN margin": (lambda: MISSION.model_copy(update={"margin": math.nan}), "margin: .*nan"),
    "text for a number": (lambda: MISSION.model_copy(update={"separation": "wide"}), "separation: .*'wide'"),
    "agents of another kind": (lambda: MISSION.model_copy(update={"agents": {"r0": 3}}), "agents.r0: must be a table"),
    "no agents": (lambda: MISSION.model_copy(update={"agents": {}}), "at least one agent|agents: must have at least 1 entry"),
    "agents at two numbers": (lambda: with_agent(start=(0.0, 1.0)), r"agents.r0.start"),
    "an unknown state": (lambda: with_agent(internal="flying"), "'flying' is not a state of the robot"),
    "an unknown name": (
        lambda: MISSION.model_copy(update={"spec": MISSION.spec.model_copy(update={"formula": "F nowhere"})}),
        "'nowhere' is not a name of this mission",
    ),
    "another matrix": (
        lambda: MISSION.model_copy(
            update={"regions": {"a": MISSION.regions["a"].model_copy(update={"radii": (1.0, 1.0, 1.0)})}}
        ),
        "regions.a: matrix does not belong",
    ),
    "a mass of zero": (
        lambda: MISSION.model_copy(update={"vehicle": MISSION.vehicle.model_copy(update={"mass": 0.0})}),
        "vehicle.mass: .*0.0",
    ),
    "limits of text": (lambda: behind(MISSION, "limits", "none"), "limits: must be a table"),
    "a box inside out": (
        lambda: behind(MISSION, "workspace", MISSION.workspace.model_copy(update={"min": (9.0, 9.0, 9.0)})),
        "workspace: .*must be below",
    ),
    "never validated": (lambda: Mission.model_construct(name="x", margin=-1.0), "(?s)agents: missing.*margin: .*-1.0"),
    "nothing at all": (Mission.model_construct, "vehicle: missing"),
    "no mission": (lambda: 7, "not int"),
}

DOORS: dict[str, Callable[[Mission], Any]] = {
    "ltlplan.plan": ltlplan.plan,
    "ltlplan.run": ltlplan.run,
    "fly_online": fly_online,
    "check_mission": check_mission,
    "refine.refine": lambda mission: refine.refine(behind(PLAN, "mission", mission)),
    "certified_team": lambda mission: certified_team(behind(PLAN, "mission", mission)),
    "verify.certify": lambda mission: verify.certify(behind(PLAN, "mission", mission), TEAM),
    "verify.judge": lambda mission: verify.judge(behind(PLAN, "mission", mission), TEAM),
    "verify.check_samples": lambda mission: verify.check_samples([0, 1], [[0, 0, 1], [0, 0, 1]], mission, max_speed=1.0),
    "verify.check_flight": lambda mission: verify.check_flight(SAMPLES, verify.FlightReference.of_mission(mission), max_speed=1.0),
    "flight.fly": lambda mission: flight.fly(behind(PLAN, "mission", mission), TEAM),
    "flight.fly's certificate": lambda mission: flight.fly(PLAN, TEAM, dataclasses.replace(CERT, mission=mission)),
    "flight.campaign": lambda mission: flight.campaign(behind(PLAN, "mission", mission), TEAM, runs=1),
    "flight.export": lambda mission: flight.export(TEAM, dataclasses.replace(CERT, mission=mission), "unused"),
    "flight.Monitor": lambda mission: flight.Monitor(
        mission, (), margin=0.05, measurement=0.0, planned_acceleration=1.0
    ),
}  # fmt: skip


@pytest.mark.parametrize("door", DOORS)
@few_of(4, "kind", MISSIONS)
def test_missions_that_skipped_their_validation(kind: str, door: str, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    make, says = MISSIONS[kind]
    with pytest.raises(BadInput, match=says):
        DOORS[door](make())
    assert not list(tmp_path.iterdir())


def test_all_faults_are_told_at_once() -> None:
    bad = MISSION.model_copy(update={"separation": -1.0, "margin": math.inf, "workspace": None})
    with pytest.raises(BadInput) as caught:
        verify.certify(behind(PLAN, "mission", bad), TEAM)
    for says in ("separation: ", "margin: ", "workspace: "):
        assert says in str(caught.value)


def robot(**fields: Any) -> Plan:
    return PLAN.model_copy(update={"robots": {"r0": PLAN.robots["r0"].model_copy(update=fields)}})


PLANS: dict[str, tuple[Callable[[], Any], str]] = {
    "no plan": (lambda: "plan", "not str"),
    "robots of another kind": (lambda: PLAN.model_copy(update={"robots": {"r0": 3}}), "robots.r0: .*not 3"),
    "another robot": (lambda: PLAN.model_copy(update={"robots": {"r9": PLAN.robots["r0"]}}), "has robots r9"),
    "an unknown region": (lambda: robot(visits=(Visit(region="nowhere"),)), "'nowhere' is not a region"),
    "a visit that is a text": (lambda: robot(visits=("a",)), "robots.r0.visits.0: .*'a'"),
    "NaN for a time": (lambda: robot(times=(0.0, math.nan)), "robots.r0.times.1: .*nan"),
    "too few times": (lambda: robot(times=(0.0,)), "1 times for 2 waypoints"),
    "a word of texts": (lambda: robot(word=("a", "b")), "robots.r0.word"),
    "a cycle where there is none": (lambda: robot(cycle_visit=-3), "cycle_visit is -3"),
    "a waiting time of text": (lambda: robot(hold="long"), "robots.r0.hold: .*'long'"),
    "precedences of nothing": (lambda: behind(PLAN, "precedences", (("r0", 1),)), "precedences.0"),
    "never validated": (lambda: Plan.model_construct(mission=MISSION), "robots: Field required"),
    "robots never validated": (
        lambda: PLAN.model_copy(update={"robots": {"r0": RobotPlan.model_construct(hold=-1.0)}}),
        "(?s)robots.r0.word: .*robots.r0.hold",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", PLANS)
@pytest.mark.parametrize(
    "door", [refine.refine, certified_team, lambda plan: verify.certify(plan, TEAM), lambda plan: flight.fly(plan, TEAM)]
)
def test_plans_that_skipped_their_validation(kind: str, door: Callable[[Plan], Any]) -> None:
    make, says = PLANS[kind]
    with pytest.raises(BadInput, match=says):
        door(make())


def tampered(name: str, value: Any) -> Trajectory:
    path = Trajectory(TEAM["r0"].durations, TEAM["r0"].coefficients)
    object.__setattr__(path, name, value)
    return path


TEAMS: dict[str, tuple[Callable[[], Any], str]] = {
    "no team": (lambda: 3, "A team is a table"),
    "nobody": (dict, "A team is a table"),
    "no trajectory": (lambda: {"r0": np.zeros(3)}, "r0 must be given a Trajectory, not ndarray"),
    "durations below zero": (lambda: {"r0": tampered("durations", -TEAM["r0"].durations)}, r"r0: durations\[0\] is -"),
    "too few coefficients": (lambda: {"r0": tampered("coefficients", np.zeros((1, 2)))}, "r0: coefficients must have shape"),
    "NaN": (lambda: {"r0": tampered("coefficients", np.full((len(TEAM["r0"]), 4, 8), np.nan))}, "r0: coefficients.* is nan"),
    "a cycle of text": (lambda: {"r0": tampered("cycle", "first")}, "r0: cycle must be the index of a piece"),
    "never made": (lambda: {"r0": Trajectory.__new__(Trajectory)}, "r0: its Trajectory has no numbers"),
}  # fmt: skip


@pytest.mark.parametrize("kind", TEAMS)
@pytest.mark.parametrize(
    "door",
    [
        lambda team: verify.certify(PLAN, team),
        lambda team: verify.judge(PLAN, team),
        lambda team: flight.fly(PLAN, team),
        lambda team: flight.campaign(PLAN, team, runs=1),
        lambda team: flight.export(team, CERT, "unused"),
    ],
)
def test_trajectories_that_were_changed_behind_their_back(kind: str, door: Callable[[Any], Any], tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    make, says = TEAMS[kind]
    with pytest.raises(BadInput, match=says):
        door(make())


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"margin": -1.0}, "margin must be a number"),
        ({"margin": math.nan}, "margin must be a number"),
        ({"duration": "long"}, "duration must be a number"),
        ({"claims": 3}, "A certificate is what"),
        ({"claims": ()}, "no claims"),
    ],
)
def test_certificates_that_make_no_sense(changes: dict[str, Any], says: str, tmp_path) -> None:
    bad = dataclasses.replace(CERT, **changes)
    for ask in (lambda: flight.fly(PLAN, TEAM, bad), lambda: flight.export(TEAM, bad, tmp_path / "out")):
        with pytest.raises(BadInput, match=says):
            ask()
    assert not (tmp_path / "out").exists()


def test_a_certificate_of_another_mission_covers_no_flight() -> None:
    wider = behind(PLAN, "mission", MISSION.changed(separation=0.1))
    with pytest.raises(verify.NotCertified, match="of another mission"):
        flight.fly(wider, TEAM, CERT)


def test_what_was_computed_is_computed_again_from_the_fields() -> None:
    """A formula or a limit that was put in beside its text is not what is judged."""
    unmet = MISSION.changed(spec={"formula": "G !a"})
    assert not verify.judge(behind(PLAN, "mission", unmet), TEAM).holds
    for name, value in (("formula", TRUE), ("effective_limits", None)):
        forged = unmet.model_copy()
        object.__setattr__(forged, name, value)
        cert = verify.judge(behind(PLAN, "mission", forged), TEAM)
        assert [c.name for c in cert.claims if c.outcome != "holds"] == ["formula"]


def test_a_sound_value_that_is_changed_afterwards_is_refused_too() -> None:
    mission = MISSION.model_copy()
    plan = behind(PLAN, "mission", mission)
    assert verify.judge(plan, TEAM).holds
    object.__setattr__(mission, "separation", -1.0)
    with pytest.raises(BadInput, match="separation"):
        verify.judge(plan, TEAM)
    object.__setattr__(mission, "separation", MISSION.separation)
    assert verify.judge(plan, TEAM).mission == MISSION
    object.__setattr__(check_mission(MISSION), "separation", -1.0)
    assert check_mission(MISSION).separation == MISSION.separation


def test_changing_a_value_validates_it() -> None:
    assert MISSION.changed(separation=0.5).separation == 0.5
    assert MISSION.changed(limits=MISSION.limits.changed(speed=0.5)).effective_limits.speed == 0.5
    assert MISSION.changed(limits={"speed": 0.5}) == MISSION.changed(limits=Limits(speed=0.5))
    bigger = MISSION.regions["a"].changed(radii=(0.4, 0.4, 0.4))
    assert bigger.shape[0][0] == pytest.approx(1 / 0.16)
    assert MISSION.changed(regions={"a": bigger}).regions["a"] == bigger
    assert PLAN.changed(notes=("ours",)).notes == ("ours",)
    assert MISSION.separation == 0.3
    for change, says in (
        (lambda: MISSION.changed(separtion=0.5), "no field 'separtion'. Did you mean 'separation'"),
        (lambda: MISSION.changed(separation=-0.5), "separation: .*-0.5"),
        (lambda: MISSION.changed(spec=MISSION.spec.changed(formula="F b")), "'b' is not a name of this mission"),
        (lambda: MISSION.limits.changed(speed=0.0), "Limits.speed: .*0.0"),
        (lambda: PLAN.changed(robots={}), "has robots"),
    ):
        with pytest.raises(BadInput, match=says):
            change()


@pytest.mark.parametrize(
    "parts", [("U", (TRUE,)), ("name",), ("until", (TRUE, TRUE)), ("!", [TRUE]), ("F", ("a",))], ids=lambda parts: parts[0]
)
def test_formulas_and_words_made_in_code(parts: Any) -> None:
    formula = Formula(*parts)
    for ask in (
        lambda: verify.check_word(formula, [{"a"}]),
        lambda: verify.check_team(formula, {"r0": [{"a"}]}),
        lambda: ltlplan.translate(formula),
    ):
        with pytest.raises(BadInput, match="Formula"):
            ask()
    for word in (Word(("ab",)), Word((frozenset({3}),)), Word(3)):  # type: ignore[arg-type]
        with pytest.raises(BadInput, match=r"no sound Word|which is no name"):
            verify.check_word("F a", word)


def test_assertions_refuse_unsound_missions() -> None:
    bad = MISSION.model_copy(update={"regions": {"a": 3}})
    with pytest.raises(BadInput, match=r"regions\.a"):
        assert_satisfies(TEAM["r0"], "F a", bad)
