import json

import pytest

from ltlplan.missions import load_mission
from verify.data import BadInput, Plan, RobotPlan, Visit, Waypoint, Word
from verify.data.mission import Action
from verify.data.plan import plan_from_json


def firefighting_plan() -> Plan:
    mission = load_mission("firefighting")
    action = Action(source="no_water", target="carrying", at="water")
    robots = {}
    for name, agent in mission.agents.items():
        visits = (Visit(region="water", direction="F", actions=(action,)),) if name == "quad0" else ()
        word = Word.of([[], ["water"], ["water", "carrying"], ["carrying"]]) if visits else Word.of([[]])
        robots[name] = RobotPlan(
            word=word, visits=visits, waypoints=(Waypoint(position=agent.start, role="start"),), times=(0.0,)
        )
    return Plan(mission=mission, robots=robots, notes=("a note",))


def test_a_plan_reads_back_as_itself() -> None:
    plan = firefighting_plan()
    again = plan_from_json(plan.to_json(), plan.mission)
    assert again == plan
    assert again.digest() == plan.digest()
    assert again.to_json() == plan.to_json()


def test_a_plan_for_another_mission_is_refused() -> None:
    plan = firefighting_plan()
    with pytest.raises(BadInput, match="another mission"):
        plan_from_json(plan.to_json(), plan.mission.model_copy(update={"margin": 0.01}))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda d: d.update(format=9), "format"),
        (lambda d: d.update(extra=1), "extra"),
        (lambda d: d["robots"].pop("quad1"), "robots"),
        (lambda d: d["robots"]["quad0"]["visits"][0].update(region="lake"), "'lake' is not a region"),
        (lambda d: d["robots"]["quad0"].update(times=[0.0, 1.0]), "2 times for 1 waypoints"),
        (lambda d: d["robots"]["quad0"]["word"].update(prefix=[]), "word"),
        (lambda d: d.update(precedences=[{"first": ["quad0", 0], "then": ["quad1", 0]}]), "does not exist"),
    ],
)
def test_damaged_plans_are_refused(change, says: str) -> None:
    plan = firefighting_plan()
    data = json.loads(plan.to_json())
    change(data)
    with pytest.raises(BadInput, match=says):
        plan_from_json(json.dumps(data), plan.mission)


def test_text_that_is_no_json_is_refused() -> None:
    mission = load_mission("firefighting")
    for text in ("", "{", "[]", "null", "[" * 100_000):
        with pytest.raises(BadInput):
            plan_from_json(text, mission)


def test_a_bare_string_is_no_letter() -> None:
    with pytest.raises(BadInput, match="is the string 'ab'"):
        Word.of(["ab"])
