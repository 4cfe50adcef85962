"""What one requirement needs, step by step, that the others or the world do not allow."""

from __future__ import annotations

from ltlplan.logic.automaton import representative_letters
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.search.explanations.inquiry import Inquiry, listed
from ltlplan.search.explanations.relaxed_systems import with_internal, without
from ltlplan.search.explanations.requirements import eventually, satisfiable
from verify.data import Formula


def unmet_needs(inquiry: Inquiry, part: Formula, others: list[Formula]) -> list[str]:
    """Say what one requirement needs that the others or the world do not allow; empty where nothing was found.

    Args:
        inquiry: Into whose mission.
        part: The requirement.
        others: Those that have to hold besides.
    """
    shown = f"`{inquiry.shown(part)}`"
    for name in sorted(inquiry.names(part)):
        wanted = eventually(name)
        if satisfiable([part, Formula("!", (wanted,))], representative_letters(conjunct_automata(part, "finite"))):
            continue  # it can hold without this name
        if not inquiry.feasible([*others, wanted], inquiry.worlds):
            steps = _why(inquiry, name, others, {name})
            if steps:
                start = f"{name} needs "
                if steps[0].startswith(start):
                    return [_sentence([f"{shown} needs {steps[0].removeprefix(start)}", *steps[1:]])]
                return [_sentence([f"{shown} needs {name}", *steps])]
    if inquiry.feasible([part], inquiry.worlds):
        for region in _needed_by(inquiry, part):
            if not inquiry.feasible([*others, eventually(region)], inquiry.worlds):
                return [_sentence([f"{shown} needs {region}", *_why(inquiry, region, others, {region})])]
    return []


def _why(inquiry: Inquiry, name: str, others: list[Formula], seen: set[str]) -> list[str]:
    """Return steps that explain why no robot can come to show a name while the other requirements hold."""
    if name in inquiry.mission.all_regions:
        if not inquiry.feasible([eventually(name)], inquiry.worlds):
            return [f"no robot can reach {name}"]
        for region in _needed_by(inquiry, eventually(name)):
            if region not in seen and not inquiry.feasible([*others, eventually(region)], inquiry.worlds):
                return [f"{name} needs {region}", *_why(inquiry, region, others, seen | {region})]
        for proposition in sorted(inquiry.mission.internal_propositions - seen):
            given = [with_internal(world, proposition, inquiry.mission) for world in inquiry.worlds]
            if inquiry.feasible([*others, eventually(name)], given):
                return [f"{name} needs {proposition}", *_why(inquiry, proposition, others, seen | {proposition})]
        held = [f"`{inquiry.shown(other)}`" for other in others]
        return [f"{name} cannot be visited while {listed(held)} hold{'s' * (len(held) == 1)}"] if held else []
    places: set[str] = set()
    for robot in inquiry.robots:
        gains = {s for s, names in robot.states.items() if name in names}
        places |= {a.at for a in robot.actions if a.target in gains and a.source not in gains}
    regions = sorted(places)
    if not regions:
        return [f"no action leads to {name}"]
    for region in regions:
        if region not in seen and not inquiry.feasible([*others, eventually(region)], inquiry.worlds):
            steps = _why(inquiry, region, others, seen | {region})
            return steps if steps and steps[0].endswith(region) else [f"{name} needs {region}", *steps]
    return _who(inquiry, name, seen)


def _who(inquiry: Inquiry, name: str, seen: set[str]) -> list[str]:
    """Say which robots alone can come to show an internal proposition, and what of all that is needed these cannot reach."""
    agents = list(inquiry.mission.agents)
    able = [a for a in agents if any(name in names for names in inquiry.mission.robot_of(a).states.values())]
    if len(able) == len(agents) or len(inquiry.worlds) < len(agents):
        return []
    worlds = [inquiry.worlds[agents.index(agent)] for agent in able]
    who = f"only {listed(able)} can show {name}"
    regions = sorted(seen & inquiry.mission.all_regions.keys())
    return [who, *(f"{listed(able)} cannot reach {r}" for r in regions if not inquiry.feasible([eventually(r)], worlds))]


def _needed_by(inquiry: Inquiry, part: Formula) -> list[str]:
    """Return regions, not named by a requirement, without which it cannot be met."""
    return [
        region
        for region in inquiry.mission.all_regions
        if region not in inquiry.names(part)
        and not inquiry.feasible([part], [without(world, region) for world in inquiry.worlds])
    ]


def _sentence(steps: list[str]) -> str:
    text = steps[0] if len(steps) == 1 else f"{', '.join(steps[:-1])}, and {steps[-1]}"
    return text + "."
