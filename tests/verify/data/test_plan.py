import json

import pytest

from ltlplan.missions import load_mission
from verify.data import BadInput, Plan, RobotPlan, Visit, Waypoint, Word
from verify.data.plan import plan_from_json
from verify.data.sections import Action


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


@pytest.mark.parametrize(("visit", "exists"), [(0, True), (1, True), (2, False), (-1, False)])
def test_a_precedence_names_visits_that_there_are(visit: int, exists: bool) -> None:
    plan = firefighting_plan()
    robot = plan.robots["quad1"].model_copy(update={"visits": (Visit(region="loc1"), Visit(region="loc2"))})
    plan = plan.model_copy(update={"robots": {**plan.robots, "quad1": robot}})
    data = json.loads(plan.to_json())
    data["precedences"] = [{"first": ["quad0", 0], "then": ["quad1", visit]}]
    if exists:
        assert plan_from_json(json.dumps(data), plan.mission).precedences[0].then == ("quad1", visit)
        return
    with pytest.raises(BadInput, match=rf"visit {visit} of quad1, which has 2 visits"):
        plan_from_json(json.dumps(data), plan.mission)


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


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('"seed": 0', '"seed": "0"', "seed"),
        ('"seed": 0', '"seed": false', "seed"),
        ('"complete": false', '"complete": 0', "complete"),
        ('"cost": 0.0', '"cost": "0"', "cost"),
        ('"method": "exact"', '"method": "exact", "method": "mtac-e"', "'method' stands twice"),
    ],
)
def test_what_is_written_otherwise_than_it_is_meant_is_refused(old: str, new: str, says: str) -> None:
    plan = firefighting_plan()
    text = plan.to_json()
    assert old in text
    with pytest.raises(BadInput, match=says):
        plan_from_json(text.replace(old, new, 1), plan.mission)


def test_a_letter_is_a_set_and_names_each_once() -> None:
    plan = firefighting_plan()
    data = json.loads(plan.to_json())
    letters = data["robots"]["quad0"]["word"]["prefix"]
    letters[2] = ["water", "carrying"]
    assert plan_from_json(json.dumps(data), plan.mission) == plan
    letters[2] = ["water", "carrying", "water"]
    with pytest.raises(BadInput, match=r"robots\.quad0\.word\.prefix\.2: this is not written as a plan is"):
        plan_from_json(json.dumps(data), plan.mission)
