import json

import pytest

from ltlplan.missions import load_mission
from verify.data import BadInput, Plan, RobotPlan, Visit, Waypoint, Word
from verify.data.plan import Precedence, check_plan, plan_from_json
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


def test_a_plain_precedence_is_written_as_it_always_was_and_others_with_what_they_say() -> None:
    plan = firefighting_plan()
    visits = {name: robot.model_copy(update={"visits": (Visit(region="smoke"),) * 2}) for name, robot in plan.robots.items()}
    plain = Precedence(first=("quad0", 0), then=("quad1", 1))
    other = Precedence(first=("quad0", 1), then=("quad1", 0), done="entered", due="leaves")
    made = plan.model_copy(update={"robots": visits, "precedences": (plain, other)})
    written = json.loads(made.to_json())["precedences"]
    assert written[0] == {"first": ["quad0", 0], "then": ["quad1", 1]}
    assert plan_from_json(made.to_json(), made.mission).precedences == (plain, other)
    assert (
        other.sentence(made.robots)
        == "quad1 leaves smoke for the first time only when quad0 has entered smoke for the second time"
    )


def test_a_precedence_waits_for_an_action_that_there_is() -> None:
    plan = firefighting_plan()
    visits = {name: robot.model_copy(update={"visits": (Visit(region="smoke"),)}) for name, robot in plan.robots.items()}
    wait = Precedence(first=("quad0", 0), then=("quad1", 0), done="acted")
    with pytest.raises(BadInput, match="an action of quad0 in visit 0, which has none"):
        check_plan(plan.model_copy(update={"robots": visits, "precedences": (wait,)}))


def test_tables_in_the_place_of_values_become_values_however_often_they_are_given() -> None:
    plan = firefighting_plan()
    spec = {**plan.mission.spec.model_dump(), "formula": "F water"}
    robots = {name: robot.model_dump() for name, robot in plan.robots.items()}
    for _ in range(2):
        assert plan.mission.changed(spec=spec).spec.formula == "F water"
        assert plan.changed(robots=robots) == plan
