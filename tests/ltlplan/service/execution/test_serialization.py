"""Stored values: each comes back field by field as it was, and no field of any class that is stored can be left out."""

from __future__ import annotations

import dataclasses
import importlib
import json
import zipfile
from collections.abc import Iterator
from io import BytesIO
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest

from ltlplan.missions import load_mission
from ltlplan.replanning.cuts import Candidate, Certified, Cut
from ltlplan.service.execution import stages
from ltlplan.service.execution.serialization import fields_of, from_bytes, stored_classes, to_bytes
from ltlplan.service.execution.stages import mission_bytes, run_stage
from tests.helpers.few import few_of
from tests.helpers.motion.flights import small_mission
from verify.data import Mission, Plan, Trajectory, Witness
from verify.data.obstruction import Obstruction
from verify.data.plan import Hover, Precedence
from verify.data.progress import silent

PLAIN = (str, int, float, bool, type(None))


def assert_same(first: Any, second: Any, where: str = "value") -> None:
    """Hold two values against each other, field by field, with their types and to the last bit."""
    assert type(first) is type(second), where
    if isinstance(first, np.ndarray):
        assert first.dtype == second.dtype, where
        assert first.shape == second.shape, where
        assert first.tobytes() == second.tobytes(), where
    elif isinstance(first, dict):
        assert list(first) == list(second), where
        for key in first:
            assert_same(first[key], second[key], f"{where}[{key!r}]")
    elif isinstance(first, list | tuple):
        assert len(first) == len(second), where
        for index, (one, other) in enumerate(zip(first, second, strict=True)):
            assert_same(one, other, f"{where}[{index}]")
    elif dataclasses.is_dataclass(first) or hasattr(type(first), "model_fields"):
        names = fields_of(type(first))
        assert names, where
        for name in names:
            assert_same(getattr(first, name), getattr(second, name), f"{where}.{name}")
    else:
        assert repr(first) == repr(second) if isinstance(first, float) else first == second, where


def stored(mission: Mission, last: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[str, Any, bytes]]:
    """Do a mission's stages up to one; yield each that stores a value, the value itself, and its bytes."""
    kept: list[Any] = []
    monkeypatch.setattr(stages, "to_bytes", lambda value: kept.append(value) or to_bytes(value))
    stage: str | None = "plan"
    value = mission_bytes(mission)
    assert_same(mission, from_bytes(value))
    while stage is not None and stage != last:
        kept.clear()
        outcome = run_stage(stage, value, silent)
        if kept:
            yield stage, kept[-1], outcome.value
        stage, value = outcome.following, outcome.value


def written(value: Any) -> str:
    with zipfile.ZipFile(BytesIO(to_bytes(value))) as archive:
        return archive.read("value.json").decode()


@pytest.mark.parametrize("name", sorted(stored_classes()))
def test_every_field_of_every_stored_class_is_written(name: str) -> None:
    kind = stored_classes()[name]
    value = object.__new__(kind)
    declared = set(getattr(kind, "model_fields", None) or {field.name for field in dataclasses.fields(kind)})
    for field in declared:
        object.__setattr__(value, field, f"what {field} holds")
    assert json.loads(written(value))["fields"] == {field: f"what {field} holds" for field in declared}


def within(hint: Any) -> Iterator[type]:
    """Yield the classes that a type is made of."""
    if isinstance(hint, type) and not get_args(hint):
        yield hint
    for part in get_args(hint):
        yield from within(part)


def test_all_that_a_stored_class_can_hold_can_be_stored() -> None:
    from ltlplan.allocation import Leg
    from verify import Certificate, Claim
    from verify.data.shapes.inequalities import Point

    names = {"Leg": Leg, "Point": Point, "Certificate": Certificate, "Claim": Claim, "Certified": Certified}
    for kind in stored_classes().values():
        hints = get_type_hints(kind, None, names)
        for name in fields_of(kind):
            for held in within(hints[name]):
                ours = held.__module__.split(".")[0] in ("ltlplan", "verify", "flight", "refine")
                assert not ours or held is Mission or stored_classes().get(held.__name__) is held, f"{kind.__name__}.{name}"


def test_a_candidate_with_everything_in_it_comes_back() -> None:
    mission = small_mission("F a", margin=0.05, extra="planner: {pace: nominal}")
    planned = importlib.import_module("ltlplan").plan(mission)
    waits = (Precedence(first=("r0", 0), then=("r0", 0), done="entered", due="leaves"),)
    plan: Plan = planned.model_copy(
        update={
            "precedences": waits,
            "lower_bound": 1.5,
            "notes": ("a note",),
            "hovers": (Hover(robot="r0", visit=0, seconds=2.0),),
        }
    )
    witness = Witness(claim="formula", sentence="no", word=(("r0", frozenset({"b", "a"})),), times=((0.5, float("inf")),))
    legs = frozenset({("r0", (0.0, 0.0, 1.0), "a"), ("r0", "a", "b")})  # of kinds that have no order
    team = {"r0": Trajectory([1.0, 2.0], np.ones((2, 4, 8)), cycle=1, cuts=(1,))}
    certified = Certified(plan, team, None, 2)  # type: ignore[arg-type]  # the certificate is looked at elsewhere
    cut = Cut(
        "legs", "why", 3, True, True, (witness,), legs, ("a", 2), (0, 4), 0.8, "digest", "F(a & F b)", 0.5, Obstruction("no", ("r0",), "here", ("a",), ("b",))
    )  # fmt: skip
    candidate = Candidate(plan, (cut,), 1, certified)
    for value in (cut, candidate):
        assert all(getattr(value, field.name) != field.default for field in dataclasses.fields(value))
    again = from_bytes(to_bytes(candidate))
    assert_same(candidate, again)
    assert to_bytes(again) == to_bytes(candidate)


def test_a_draft_of_an_earlier_version_goes_on() -> None:
    plan = importlib.import_module("ltlplan").plan(small_mission("F a", margin=0.05))
    witness = Witness(claim="formula", sentence="no", robot="r0")
    stored_now = to_bytes(Candidate(plan, (Cut("waits", "why", 1, witnesses=(witness,)),), 1))
    found = draft_of(stored_now, witnesses=(witness,))
    assert (found.plan, found.rounds, found.witnesses, found.certified) == (plan, 1, (witness,), None)


def draft_of(stored_now: bytes, witnesses: tuple[Witness, ...]) -> Candidate:
    """Return what is read of a candidate, written as the draft that 0.2.0 would have stored."""
    with zipfile.ZipFile(BytesIO(stored_now)) as archive:
        held = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(BytesIO(to_bytes(witnesses))) as archive:
        told = json.loads(archive.read(next(name for name in archive.namelist() if name.endswith(".json"))))
    name = next(name for name in held if name.endswith(".json"))
    data = json.loads(held[name])
    kind = next(key for key, value in data.items() if value == "Candidate")
    fields = data["fields"]
    held[name] = json.dumps({kind: "Draft", "fields": {**fields, "witnesses": told}}).encode()
    written = BytesIO()
    with zipfile.ZipFile(written, "w") as archive:
        for each, content in held.items():
            archive.writestr(each, content)
    return from_bytes(written.getvalue())


@pytest.mark.parametrize(("cycle", "cuts"), [(None, ()), (None, (1, 2)), (0, ()), (0, (0, 2)), (1, (1,))])
def test_a_flight_in_parts_comes_back_in_parts(cycle: int | None, cuts: tuple[int, ...]) -> None:
    draw = np.random.default_rng(5)
    flight = Trajectory(draw.uniform(0.1, 2.0, 3), draw.normal(size=(3, 4, 8)), cycle=cycle, cuts=cuts)
    again = from_bytes(to_bytes(flight))
    assert_same(flight, again)
    assert again.digest() == flight.digest()


@pytest.mark.slow
def test_what_planning_and_refining_a_flight_in_parts_store_comes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    found = list(stored(load_mission("door-puzzle"), "flight", monkeypatch))
    assert [stage for stage, _, _ in found] == ["plan", "round 1"]
    for stage, value, kept in found:
        assert_same(value, from_bytes(kept), stage)
    certified = from_bytes(found[-1][2])
    assert any(flight.cuts for flight in certified.team.values())
    assert certified.certificate.covers(certified.team)


@few_of(1, ("formula", "trace"), [("F a", "finite"), ("F (a & F b)", "finite"), ("G F a & G F b", "infinite")])
def test_whatever_a_stage_stores_comes_back(formula: str, trace: str, monkeypatch: pytest.MonkeyPatch) -> None:
    regions = "a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}\nb: {center: [-1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}"
    mission = small_mission(formula, regions=regions, margin=0.05, trace=trace, extra="planner: {pace: nominal}")
    if trace == "finite":
        soft = [{"formula": "F a"}, {"formula": "G !a", "weight": 0.5}]
        mission = mission.changed(spec={**mission.spec.model_dump(), "soft": soft})
    found = list(stored(mission, "files", monkeypatch))
    assert found[-1][0] == "flight"
    for stage, value, kept in found:
        assert_same(value, from_bytes(kept), stage)
