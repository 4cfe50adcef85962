"""Agents of several kinds in mission files: what is their own, what is closed to them, and what is refused."""

import pytest

from tests.helpers.missions.kinds import mixed, mixed_text
from tests.helpers.motion.flights import small_mission
from verify.data import MissionError, mission_to_yaml, parse_mission


def faults(text: str) -> str:
    with pytest.raises(MissionError) as refused:
        parse_mission(text)
    return str(refused.value)


def test_what_is_an_agents_own_stands_instead_of_what_all_share():
    mission = mixed("F smoke", slow=", limits: {speed: 0.3, legs: {desk: {speed: 0.2}}}", fast=", limits: {tilt_deg: 20.0}")
    assert (mission.vehicle_of("fast").name, mission.vehicle_of("slow").name) == ("crazyflie-2.1", "heavy")
    assert (mission.limits_of("fast").speed, mission.limits_of("slow").speed) == (1.0, 0.3)
    assert mission.limits_of("slow").acceleration == 4.0
    assert mission.limits_of("fast").tilt < 0.35 < mission.limits_of("slow").tilt
    assert mission.leg_limits_of("fast") == {}
    assert mission.leg_limits_of("slow")["desk"].speed == 0.2
    assert mission.robot_of("slow").states == {"empty": (), "full": ("carrying",)}
    assert mission.robot_of("fast").actions == ()
    assert mission.initial_internal("slow") == "empty"
    assert mission.propositions == {"water", "smoke", "desk", "carrying", "free"}


def test_each_agent_sees_the_mission_with_its_own():
    mission = mixed(
        "F smoke", desk=", only: [scout]", edges="[[robot, water], {between: [robot, smoke], only: [tanker]}, [water, desk]]"
    )
    fast, slow = mission.seen_by("fast"), mission.seen_by("slow")
    assert (fast.planner.speed, slow.planner.speed) == (0.45, 0.45)
    assert slow.vehicle.name == "heavy"
    assert slow.robot.initial == "empty"
    assert slow.seen_by("slow") is slow
    assert fast.environment is not None
    assert slow.environment is not None
    assert fast.environment.edges == (("robot", "water"), ("water", "desk"))
    assert slow.environment.edges == (("robot", "water"), ("robot", "smoke"))
    alike = small_mission(starts=((0, 0, 1), (1, 1, 1)))
    assert alike.of_one_kind
    assert alike.seen_by("r0") is alike


def test_without_edges_a_kind_goes_from_everywhere_to_every_region_that_is_open_to_it():
    mission = mixed("F smoke", desk=", only: [scout]").changed(environment=None)
    assert mission.seen_by("fast").environment is None
    open_to_slow = mission.seen_by("slow").environment
    assert open_to_slow is not None
    assert open_to_slow.directed
    assert sorted(open_to_slow.edges) == sorted(
        (a, b) for b in ("water", "smoke") for a in (open_to_slow.start, "water", "smoke", "desk") if a != b
    )


def test_a_mission_of_one_kind_is_written_as_before():
    resolved = small_mission().resolved()
    assert "robots" not in resolved
    assert "endurance" not in resolved["vehicle"]
    assert all(key not in agent for agent in resolved["agents"].values() for key in ("vehicle", "limits", "robot"))


def test_a_resolved_mission_of_several_kinds_reads_back_the_same():
    mission = mixed("F desk", desk=", only: [scout]", edges="[[robot, smoke], {between: [smoke, desk], only: [scout, tanker]}]")
    again = parse_mission(mission_to_yaml(mission))
    assert again == mission
    assert again.digest() == mission.digest()
    assert mission_to_yaml(again) == mission_to_yaml(mission)


@pytest.mark.parametrize(
    ("said", "parts"),
    [
        ("agents.fast.robot: 'scuot' is no table of `robots`. Did you mean 'scout'?", {"fast": ", robot: scuot"}),
        ("regions.desk.only: 'boat' is no table of `robots`.", {"desk": ", only: [boat]"}),
        ("environment.edges.0.only: 'boat' is no table", {"edges": "[{between: [robot, smoke], only: [boat]}]"}),
        ("environment.edges.0.onyl: unknown key. Did you mean 'only'?", {"edges": "[{between: [robot, smoke], onyl: [scout]}]"}),
        ("environment.edges.0: must have 2 entries, not 1: ['robot']", {"edges": "[[robot]]"}),
        ("environment.edges.0: 'smok' is not a region", {"edges": "[{between: [robot, smok], only: [scout]}]"}),
        ("regions.desk.only: must have at least 1 entry", {"desk": ", only: []"}),
        ("agents.slow.limits.speed: 0.7 is above the vehicle's own 0.6 (heavy)", {"slow": ", limits: {speed: 0.7}"}),
        ("agents.slow.limits.legs.dsk: 'dsk' is not a region", {"slow": ", limits: {legs: {dsk: {speed: 0.1}}}"}),
        ("agents.slow.internal: 'idle' is not a state", {"slow": ", internal: idle"}),
        ("agents.slow.start: lies inside 'desk', which is open to scout only", {"desk": ", only: [scout]", "slow": ", start: [1.0, 0.9, 1.0]"}),
        ("agents.slow: an endurance of 9 s leaves no time to fly", {"slow": ", limits: {endurance: 9.0}"}),
        ("separation: 0.2 m between centres lets robots touch: the radii of slow (heavy, 0.16 m) and fast", {"separation": "0.2"}),
    ],
)  # fmt: skip
def test_misuse_is_refused_where_it_stands(said: str, parts: dict[str, str]):
    separation = parts.pop("separation", "0.4")
    text = mixed_text("F smoke", **parts).replace("separation: 0.4", f"separation: {separation}")
    for key in ("robot", "start"):  # given a second time: the last one counts here
        for table in ("fast", "slow"):
            if f", {key}:" in parts.get(table, ""):
                text = _without_first(text, table, key)
    assert said in faults(text)


def _without_first(text: str, table: str, key: str) -> str:
    """Leave out the first of two equal keys on an agent's line."""
    lines = text.splitlines()
    (at,) = (i for i, line in enumerate(lines) if line.startswith(f"  {table}: "))
    first = lines[at].index(f"{key}: ")
    stop = lines[at].index("], ", first) + 3 if key == "start" else lines[at].index(", ", first) + 2
    lines[at] = lines[at][:first] + lines[at][stop:]
    return "\n".join(lines)


def test_tables_that_nobody_uses_are_refused():
    unused = mixed_text("F smoke").replace("robot: scout", "robot: tanker")
    assert "robots.scout: no agent is of this kind" in faults(unused)
    both = mixed_text("F smoke").replace("robots:", "robot: {initial: a, states: {a: [b]}}\nrobots:")
    assert "robot: every agent names a table of `robots`" in faults(both)
    alone = mixed_text("F smoke").replace("robots:", "unknown:")
    assert "the mission has no `robots`" in faults(alone)


def test_an_opening_must_let_one_of_those_through_that_may_go_there():
    hoop = "hoops: {gate: {center: [0.0, 0.9, 1.0], radii: [0.3, 0.3, 0.3], opening: 0.2, rim: 0.02%s}}\nregions:"
    assert parse_mission(mixed_text("F smoke").replace("regions:", hoop % "")).hoops["gate"].only is None
    text = mixed_text("F smoke").replace("regions:", hoop % ", only: [tanker]")
    assert "hoops.gate.opening: 0.2 m leaves no room: vehicle radius 0.16 m plus margin 0.05 m" in faults(text)


def test_limits_that_all_share_must_tighten_some_vehicle():
    assert mixed("F smoke").limits.speed == 1.0  # above the heavy one's own 0.6, below the other's
    assert "limits.speed: 9 is above the vehicle's own" in faults(mixed_text("F smoke").replace("speed: 1.0}", "speed: 9.0}"))
