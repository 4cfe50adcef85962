"""Every field of plan.json is proved, or no claim depends on it: each value in the file is changed, and all digests are made anew."""

from __future__ import annotations

import copy
import hashlib
import json
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.helpers.few import few_of
from tests.helpers.motion.flights import changed, legs, plan_of, small_mission
from tests.verify.test_run_folder import write_folder
from verify import certify, judge, recheck
from verify.certificate import payload_digest
from verify.claims.judged_plan import OF_PLANNING, PROVED, judged_plan
from verify.data import BadInput, NotCertified, Plan, RobotPlan, Trajectory, Visit, Waypoint, Word
from verify.data.plan import Meeting, Precedence
from verify.data.sections import Action

TYPES = (Plan, RobotPlan, Visit, Precedence, Meeting)
REGIONS = "a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}\nb: {center: [1.0, 2.0, 1.0], radii: [0.2, 0.2, 0.2]}"
TASK = """
robot:
  initial: idle
  states: {idle: [], busy: [busy]}
  actions: [{at: a, from: idle, to: busy}]
"""
RING = "ring: {center: [2.0, 0.0, 1.0], yaw_deg: 0, radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}"
FILL = Action.model_validate({"at": "a", "from": "idle", "to": "busy"})


def test_each_field_is_proved_or_of_planning() -> None:
    for model in TYPES:
        proved, other = PROVED[model.__name__], OF_PLANNING.get(model.__name__, frozenset())
        assert proved | other == set(model.model_fields), f"classify the new field of {model.__name__}"
        assert not proved & other
    assert {each.name for each in fields(Word)} == {"prefix", "cycle"}  # both proved, by `recheck`
    assert set(Waypoint.model_fields) == {"position", "role", "region", "visit"}  # all of planning


def finite() -> tuple[Plan, dict[str, Trajectory]]:
    """Return a plan with an action, an opening, a precedence and a meeting, and flights that keep them."""
    mission = small_mission("F busy & F b", regions=REGIONS, hoops=RING, starts=((0, 0, 1), (0, 2, 1)), margin=0.01, extra=TASK)
    visits = {
        "r0": [Visit(region="a", actions=(FILL,)), Visit(region="ring", direction="F")],
        "r1": [Visit(region="b")],
    }
    words = {"r0": Word.of([[], ["a"], ["a", "busy"], ["busy"], ["ring", "busy"], ["busy"]]), "r1": Word.of([[], ["b"]])}
    plan = plan_of(mission, visits, words)
    plan = plan.changed(
        precedences=(Precedence(first=("r0", 0), then=("r1", 0), done="acted"),),
        meetings=(Meeting(first=("r0", 1), then=("r1", 0)),),
        notes=("a note",), cost=3.5, lower_bound=3.0, complete=True, seed=4,
    )  # fmt: skip
    return plan, {"r0": legs([[0, 0, 1], [1, 0, 1], [3, 0, 1]]), "r1": legs([[0, 2, 1], [1, 2, 1]], hold=12.0)}


def laps() -> tuple[Plan, dict[str, Trajectory]]:
    """Return laps of two robots, each of which waits for the other in each lap, and flights that keep that."""
    mission = small_mission("G F a & G F b", regions=REGIONS, starts=((0, 0, 1), (0, 2, 1)), margin=0.01, trace="infinite")
    plan = plan_of(mission, {"r0": [Visit(region="a")], "r1": [Visit(region="b")]})
    robots = {
        name: robot.model_copy(update={"cycle_visit": 0, "cycle_waypoint": 0, "word": Word.of([], [[], [region]])})
        for (name, robot), region in zip(plan.robots.items(), "ab", strict=True)
    }
    plan = plan.changed(robots=robots, meetings=(Meeting(first=("r0", 0), then=("r1", 0)),))
    pause = [[0, 0, 1]] * 41
    team = {
        "r0": legs([[0, 0, 1], [1, 0, 1], *pause], speed=0.25, cycle=0),
        "r1": legs([*[[0, 2, 1]] * 41, [1, 2, 1], [0, 2, 1]], speed=0.25, cycle=0),
    }
    return plan, team


def leaves(value: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the paths of all values in JSON, tables and lists included."""
    yield at
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, each in items:
        yield from leaves(each, (*at, key))


def mutations(value: Any) -> list[Any]:
    """Return other values of the same kind, and some of another."""
    match value:
        case bool():
            return [not value]
        case int():
            return [value + 1, value - 1, float(value), None]
        case float():
            return [value + 0.5, -value - 1.0]
        case str():
            others = {"F": "B", "left": "entered", "entered": "left", "acted": "left", "enters": "leaves"}
            return [others.get(value, value + "x"), None]
        case None:
            return [0, 1.0, "F", [["a"]]]
        case list():
            found: list[Any] = [[], [*value, *value[-1:]], [*value[:1], *value]] if value else [["a"], [["a"]]]
            return [*found, value[:-1], value[::-1]]
        case _:
            return []


def field_of(at: tuple[Any, ...]) -> tuple[str, str]:
    """Return which type's field a value of plan.json belongs to."""
    match at:
        case ("robots", _, "visits", _, field, *_):
            return "Visit", field
        case ("robots", _, field, *_):
            return "RobotPlan", field
        case ("precedences", _, field, *_):
            return "Precedence", field
        case ("meetings", _, field, *_):
            return "Meeting", field
        case _:
            return "Plan", at[0]


def forged(folder: Path, data: dict[str, Any]) -> None:
    """Write another plan, with all digests made anew."""
    (folder / "plan.json").write_text(json.dumps(data, indent=1) + "\n")
    certificate = json.loads((folder / "certificate.json").read_text())
    certificate["plan"] = hashlib.sha256((folder / "plan.json").read_bytes()).hexdigest()
    certificate["digest"] = payload_digest({key: value for key, value in certificate.items() if key != "digest"})
    (folder / "certificate.json").write_text(json.dumps(certificate))


@few_of(1, "made", [finite, laps])
def test_what_is_changed_in_a_plan_is_refused_or_changes_no_claim(tmp_path: Path, made: Any) -> None:
    assert hunt(tmp_path, made, every=23)


@pytest.mark.slow
@pytest.mark.parametrize("made", [finite, laps])
def test_every_value_that_is_changed_in_a_plan_is_refused_or_changes_no_claim(tmp_path: Path, made: Any) -> None:
    assert {("RobotPlan", field) for field in RobotPlan.model_fields} <= hunt(tmp_path, made, every=1)


def hunt(tmp_path: Path, made: Any, *, every: int) -> set[tuple[str, str]]:
    """Change one of so many values of a plan at a time; return the fields that were changed."""
    plan, team = made()
    certificate = certify(plan, team)
    folder = write_folder(tmp_path / "out", plan, team, certificate)
    data = json.loads((folder / "plan.json").read_text())
    seen: set[tuple[str, str]] = set()
    tried = 0
    for at in leaves(data):
        if not at or at[0] == "format":
            continue
        *before, last = at
        for other in mutations(_at(data, at)):
            if other == _at(data, at) and type(other) is type(_at(data, at)):
                continue
            tried += 1
            if tried % every:
                continue
            changed = copy.deepcopy(data)
            _at(changed, tuple(before))[last] = other
            forged(folder, changed)
            seen.add(field_of(at))
            model, field = field_of(at)
            if field in PROVED[model]:
                with pytest.raises((BadInput, NotCertified)):
                    recheck(folder)
                continue
            try:
                again = recheck(folder)
            except (BadInput, NotCertified):
                continue  # no value that the field may have
            assert again.claims == certificate.claims, at
            assert (again.actions, again.largest_margin) == (certificate.actions, certificate.largest_margin)
    assert tried > 100
    return seen


def _at(data: Any, at: tuple[Any, ...]) -> Any:
    for key in at:
        data = data[key]
    return data


def test_the_judge_sees_only_what_is_proved() -> None:
    plan, team = finite()
    other = plan.changed(notes=(), cost=99.0, seed=1, complete=False, lower_bound=None, method="other")
    robots = {name: robot.model_copy(update={"hold": 2.0, "cost": 1.0}) for name, robot in plan.robots.items()}
    other = other.changed(robots=robots)
    assert judged_plan(other) == judged_plan(plan)
    assert certify(other, team).claims == certify(plan, team).claims


@few_of(
    1,
    ("change", "says"),
    [
        ({"cycle_waypoint": 1.0}, "not written as a plan is|cycle_waypoint"),
        ({"cycle_waypoint": 0}, "give both or neither"),
        ({"cycle_visit": 0}, "cannot have a cycle"),
    ],
)
def test_a_finite_plan_has_no_cycle(tmp_path: Path, change: dict[str, Any], says: str) -> None:
    plan, team = finite()
    folder = write_folder(tmp_path / "out", plan, team, certify(plan, team))
    data = json.loads((folder / "plan.json").read_text())
    data["robots"]["r0"].update(change)
    forged(folder, data)
    with pytest.raises((BadInput, NotCertified), match=says):
        recheck(folder)


def test_a_word_that_holds_a_letter_twice_is_refused(tmp_path: Path) -> None:
    plan, team = finite()
    stuttered = Word.of([[], ["b"], ["b"]])
    plan = plan.changed(robots={**plan.robots, "r1": plan.robots["r1"].model_copy(update={"word": stuttered})})
    with pytest.raises(NotCertified, match="holds a letter twice in succession"):
        certify(plan, team)


@few_of(
    1,
    ("wait", "holds"),
    [
        (Meeting(first=("r0", 0), then=("r1", 0)), True),
        (Meeting(first=("r1", 0), then=("r0", 0)), False),
        (Precedence(first=("r0", 0), then=("r1", 0)), True),
        (Precedence(first=("r0", 0), then=("r1", 0), done="entered", due="leaves"), True),
        (Precedence(first=("r1", 0), then=("r0", 0), done="left", due="enters"), False),
        (Precedence(first=("r1", 0), then=("r0", 0), done="entered", due="leaves"), False),
    ],
)
def test_waits_of_laps_are_judged_in_every_lap(wait: Meeting | Precedence, holds: bool) -> None:
    plan, team = laps()
    meetings, precedences = ((wait,), ()) if isinstance(wait, Meeting) else ((), (wait,))
    plan = plan.changed(meetings=meetings, precedences=precedences)
    if holds:
        (kept,) = [claim for claim in certify(plan, team).claims if claim.name == "precedences"]
        assert kept.sentence.startswith("In flight r1 ")
        assert ", in each lap, by at least " in kept.sentence
        return
    with pytest.raises(NotCertified, match="It is not so that"):
        certify(plan, team)


def test_a_rest_on_the_way_is_no_setting_out_for_a_lap_s_first_visit() -> None:
    plan, _ = laps()
    r1 = legs([[0, 2, 1], [0, 3, 1], *[[0, 2.5, 1]] * 41, [1, 2, 1], [0, 3, 1]], speed=0.25, cycle=1)
    r0 = legs([*[[0, 0, 1]] * 17, [1, 0, 1], *[[0, 0, 1]] * 50], speed=0.25, cycle=16)
    lasts = r0.durations.copy()
    lasts[-1] = np.float32(r1.duration - lasts[:-1].sum())
    team = {"r0": changed(r0, durations=lasts), "r1": r1}
    (kept,) = [claim for claim in judge(plan, team, largest=False).claims if claim.name == "precedences"]
    assert kept.outcome == "fails", kept.sentence
    assert kept.time == 4.0  # where its lap begins, more than 2 s before r0 comes to a
