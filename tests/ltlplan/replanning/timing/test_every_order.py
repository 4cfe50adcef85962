"""Random missions with deadlines against brute force over the orders of their visits: none is refused that some order's flight keeps."""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator

import pytest

import ltlplan
from ltlplan.pipeline import attempted, certified_team
from ltlplan.replanning import alternatives
from ltlplan.replanning.alternatives import candidates
from ltlplan.replanning.cuts import Candidate, Conflict, Flight
from ltlplan.replanning.timing.plans_in_time import plan_in_order
from tests.helpers.missions.timed_rooms import room
from verify.data import LtlplanError, Mission, Plan, parse_formula

SECOND = {"more": ", team: joint", "agents": "  quad1: {start: [0.4, 1.6, 1.0]}"}


def random_mission(rng: random.Random, robots: int) -> tuple[Mission, tuple[str, ...]]:
    """Return a mission with a window for each of two or three regions, many of them too narrow, and the regions."""
    places = rng.sample(["dock", "shelf", "pit"], rng.choice([2, 3, 3]))
    parts: list[str] = []
    for place in places:
        kind, end = rng.random(), round(rng.uniform(0.6, 3.2 if robots == 1 else 2.2), 2)
        if kind < 0.65:
            parts.append(f"F[0,{end}] {place}")
        elif kind < 0.85:
            begin = round(rng.uniform(0.5, 4.0), 2)
            parts.append(f"F[{begin},{round(begin + rng.uniform(0.3, 2.0), 2)}] {place}")
        else:
            parts.append(f"F[0,{round(end + 0.8, 2)}] G[0,{round(rng.uniform(0.3, 2.0), 2)}] {place}")
    return room(" & ".join(parts), **(SECOND if robots == 2 else {})), tuple(places)


def orders(mission: Mission, places: tuple[str, ...]) -> Iterator[str]:
    """Yield every order of visits to all places, and every share among the robots."""
    names = list(mission.agents)
    for order in itertools.permutations(places):
        for ends in itertools.combinations_with_replacement(range(len(order) + 1), len(names) - 1):
            chains: list[str] = []
            for name, (i, j) in zip(names, itertools.pairwise([0, *ends, len(order)]), strict=True):
                whose, chain = f"{name}." if len(names) > 1 else "", ""
                for place in reversed(order[i:j]):
                    chain = f"F ({whose}{place} & {chain})" if chain else f"F {whose}{place}"
                chains += [chain] if chain else []
            yield " & ".join(chains)


def certified_in_this_order(made: Plan) -> bool:
    """Return whether a plan's own words have a certified flight, with its times chosen."""
    refused: list[Flight | Conflict] = []
    for candidate in candidates(Candidate(made), refused):
        found = attempted(candidate)
        refused.append(found)
        if candidate.better_of(found) is not None:
            return True
    return False


@pytest.mark.slow
@pytest.mark.parametrize(("robots", "seed"), [(1, seed) for seed in range(25)] + [(2, seed) for seed in range(1000, 1015)])
def test_no_mission_is_refused_that_some_order_keeps(robots: int, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    mission, places = random_mission(random.Random(seed), robots)
    try:
        assert certified_team(ltlplan.plan(mission)).certificate.holds
    except LtlplanError:
        alone = {
            reason: those[:1] if reason == "times" else () for reason, those in vars(alternatives)["_ALTERNATIVES"].items()
        }
        monkeypatch.setattr(alternatives, "_ALTERNATIVES", alone)
        for text in orders(mission, places):
            order = parse_formula(text, mission.propositions, robots=mission.agents)
            made = plan_in_order(mission, order, ltlplan.plan)
            assert made is None or not certified_in_this_order(made), text
