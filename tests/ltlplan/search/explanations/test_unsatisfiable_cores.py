from __future__ import annotations

import pytest

from ltlplan.logic.conjunction import conjuncts
from ltlplan.missions import load_mission
from ltlplan.search.exact import assign
from ltlplan.search.explanations.unsatisfiable_cores import NoPlan
from tests.helpers.few import given_few
from tests.helpers.missions.worlds import world
from tests.strategies import formulas
from verify.data import Formula, Mission, parse_formula


def fire(formula: str | None = None, **changes: object) -> Mission:
    mission = load_mission("firefighting")
    if formula is not None:
        changes["spec"] = mission.spec.model_copy(update={"formula": formula})
    return mission.model_copy(update=changes)


def without_edges(*removed: tuple[str, str]) -> Mission:
    environment = load_mission("firefighting").environment
    assert environment is not None
    kept = tuple(edge for edge in environment.edges if edge not in removed)
    return fire(environment=environment.model_copy(update={"edges": kept}))


def refusal(mission: Mission) -> NoPlan:
    with pytest.raises(NoPlan) as info:
        assign(mission)
    assert info.value.exit_code == 3
    return info.value


def test_water_out_of_reach() -> None:
    error = refusal(without_edges(("robot", "water"), ("water", "smoke"), ("water", "loc1")))
    assert error.core == ("F loc2", "G (smoke -> carrying)")
    assert "`F loc2` needs smoke, smoke needs carrying, and no robot can reach water." in str(error)
    assert error.edges == (("robot", "loc2"),)


def test_no_action() -> None:
    robot = load_mission("firefighting").robot.model_copy(update={"actions": ()})
    assert "smoke needs carrying, and no action leads to carrying." in str(refusal(fire(robot=robot)))


def test_no_way() -> None:
    error = refusal(without_edges(("smoke", "loc2")))
    assert error.core == ("F loc2",)
    assert "no robot can reach loc2" in str(error)
    assert error.edges


def test_a_contradiction() -> None:
    error = refusal(fire("F loc1 & G !loc1 & F loc2"))
    assert error.core == ("F loc1", "G !loc1")
    assert "no word satisfies" in str(error)


def test_free_flight_stands_in_the_way() -> None:
    starts = ((0.0, 0.0),)
    for text in ("G(a | b) & F b", "a U b"):
        error = refusal(world(text, starts=starts))
        assert "free flight" in str(error)
        assert "(a | free)" in str(error)
    assert assign(world("(a | free) U b", starts=starts)).cost == pytest.approx(2.0)


def test_a_start_in_no_region() -> None:
    assert "quad0 starts in free flight" in str(refusal(fire("G(loc1 | loc2)")))


def test_regions_that_lie_apart() -> None:
    assert "loc1 and loc2 lie apart" in str(refusal(fire("F(loc1 & loc2)")))


def test_free_is_shown_as_it_was_written() -> None:
    assert refusal(fire("(loc1 | free) U loc2")).core == ("(loc1 | free) U loc2",)


def test_a_smallest_core_is_found() -> None:
    error = refusal(fire("F loc1 & F loc2 & G(smoke -> carrying) & G !smoke & G !loc1"))
    assert error.core == ("F loc1", "G !loc1") or error.core == ("F loc2", "G !smoke")


def test_plans_that_hold_only_in_one_order() -> None:
    starts = ((-0.5, 0.0), (2.0, 0.0))  # quad1 stands in b
    error = refusal(world("F a & (!b W a)", robots=2, starts=starts))
    assert "in every order" in str(error)
    assert "quad1" in str(error)


def test_infinite_traces() -> None:
    mission = load_mission("hoops-ltl")

    def patrol(text: str) -> Mission:
        return mission.model_copy(update={"spec": mission.spec.model_copy(update={"formula": text})})

    error = refusal(patrol("G F hoop0 & F G !hoop0 & F hoop1"))
    assert error.core == ("G F hoop0", "F G !hoop0")
    error = refusal(patrol("G(F hoop0 -> !hoop1 U hoop2 & F hoop1) & G F hoop0"))
    assert "G F hoop0" in error.core
    assert len(error.core) == 3


def test_joint_missions_are_explained_too() -> None:
    error = refusal(world("F(a & b) & G !a", robots=2, team="joint"))
    assert set(error.core) == {"F (a & b)", "G !a"}


@given_few(6, 40, formulas(size=5), formulas(size=5))
def test_cores_are_impossible_and_minimal(first: Formula, second: Formula) -> None:
    mission = world(f"({first}) & ({second})")
    try:
        assign(mission)
    except NoPlan as error:
        core = [parse_formula(text) for text in error.core]
        text = " & ".join(f"({part})" for part in core)
        assert {str(part) for part in core} <= {str(part) for part in conjuncts(parse_formula(f"({first}) & ({second})"))}
        with pytest.raises(NoPlan):
            assign(world(text))
        for part in core:
            rest = [other for other in core if other is not part]
            if rest:
                assert assign(world(" & ".join(f"({other})" for other in rest)))
