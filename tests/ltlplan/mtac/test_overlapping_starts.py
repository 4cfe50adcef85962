"""A start inside two overlapping regions: every method plans it by the letter that is flown there, or says whose words it gives."""

import numpy as np
import pytest

from ltlplan.pipeline import certified_team, plan
from ltlplan.sharing.team import OnlineTeam
from verify.data import BadInput, Mission, Plan, parse_mission

OVERLAP = frozenset({"a", "b"})


def mission(method: str, formula: str = "F c & (a U (b & !a))") -> Mission:
    return parse_mission(f"""
format: 1
name: overlap
spec: {{formula: "{formula}"}}
regions:
  a: {{center: [0, 0, 1], radii: [0.3, 0.3, 0.3]}}
  b: {{center: [0.4, 0, 1], radii: [0.3, 0.3, 0.3]}}
  c: {{center: [1.5, 0, 1], radii: [0.3, 0.3, 0.3]}}
agents: {{quad0: {{start: [0.2, 0, 1]}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-4, -4, 0.2], max: [4, 4, 2.2]}}
planner: {{method: {method}, samples: 20, elite: 0.1, iterations: 3}}
""")


def planned(method: str) -> Plan:
    return plan(mission(method), seed=1)


@pytest.mark.parametrize(("method", "name"), [("mtac-e", "MTAC-E"), ("online-mtac-e", "Online MTAC-E")])
def test_both_forms_of_mtac_e_plan_the_words_of_the_exact_search_and_say_so(method, name):
    exact, made = planned("exact"), planned(method)
    assert str(exact.words["quad0"]) == "{a, b} {b} {} {c}"
    assert made.words == exact.words
    assert made.robots["quad0"].visits == exact.robots["quad0"].visits
    assert made.method == method
    assert made.notes[0] == f"{name} shares nothing where quad0 starts in a and b at once; these are the exact search's."
    assert made.lower_bound == exact.lower_bound


@pytest.mark.slow
@pytest.mark.parametrize("method", ["exact", "mtac-e", "online-mtac-e"])
def test_such_a_plan_is_refined_and_certified(method):
    done = certified_team(planned(method))
    assert done.certificate.claims
    assert all(claim.outcome == "holds" for claim in done.certificate.claims)
    assert done.plan.words["quad0"].prefix[0] == OVERLAP


@pytest.mark.parametrize("method", ["mtac-e", "online-mtac-e"])
def test_an_infinite_trace_is_refused_before_anything_is_planned(method):
    given = mission(method, "G F c")
    endless = given.model_copy(update={"spec": given.spec.model_copy(update={"trace": "infinite"})})
    with pytest.raises(BadInput, match="infinite trace belongs to one robot"):
        plan(endless)


def test_a_team_that_shares_in_flight_still_refuses_it():
    with pytest.raises(BadInput, match="quad0 starts in a and b at once; these regions overlap there"):
        OnlineTeam(mission("online-mtac-e"), rng=np.random.default_rng(0))
