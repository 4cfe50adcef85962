"""Reasons that stand in the way of requirements: each kind is the outcome of a search in a world without that one thing.

`unmet_needs` says, step by step, what one requirement needs that the others or the world do not allow.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from ltlplan.free_space.bottlenecks import Gap, Shut, narrowest_around
from ltlplan.free_space.free_space import FreeSpace
from ltlplan.logic.automaton import DEAD, representative_letters
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.logic.product_automaton import Task
from ltlplan.search.explanations.count_laws import no_word
from ltlplan.search.explanations.inquiry import Inquiry, all_of, eventually, satisfiable
from ltlplan.search.explanations.relaxed_systems import (
    leaving_at_once,
    sure_at_walls,
    with_internal,
    without,
    without_free_flight,
)
from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.shared_walls import wall_sentence
from ltlplan.systems.unreachable import joined_names, said_of_narrowest, why_not_within
from verify.data import Formula, Letter, Mission
from verify.data.language.lasting import lasting_regions

_FAR = 1e4  # m, to where a region is moved to see what is possible without it in the way


def reasons_against(inquiry: Inquiry, core: list[Formula]) -> list[str]:
    """Return sentences that say why requirements cannot hold together, the plainest kind of reason alone.

    Args:
        inquiry: Into whose mission.
        core: The requirements.
    """
    for plain in (_contradiction, _apart, _bad_starts, _walls, _bad_ends, _free_between, _in_the_way, _unmet):
        if reasons := plain(inquiry, core):
            return reasons
    if len(core) > 1:
        return ["Each part of this can hold without the others, but no order of visits serves them all."]
    return leads_through(inquiry, core) or [
        "Some words satisfy this, but none that can be flown from these starts along these edges."
    ]


def leads_through(inquiry: Inquiry, core: Sequence[Formula]) -> list[str]:
    """Say through which region every way leads to what requirements name, if the core could hold were it not there.

    Args:
        inquiry: Into whose mission.
        core: The requirements.
    """
    found = (f"Every way to {joined_names(names)} leads through '{region}'." for region, names in _in_front(inquiry, core))
    return list(itertools.islice(found, 1))


def _free_between(inquiry: Inquiry, core: list[Formula]) -> list[str]:
    """Say whether it is in the way that a robot between two regions is in free flight."""
    worlds = [without_free_flight(world) for world in inquiry.worlds]
    if inquiry.mission.spec.trace == "infinite" or not inquiry.feasible(core, worlds):
        return []
    return [
        "Between two regions that lie apart a robot is in free flight and in neither of them; "
        "`free` means in no region, so write for instance `(a | free)` where that may happen."
    ]


def _in_the_way(inquiry: Inquiry, core: list[Formula]) -> list[str]:
    """Say whether a robot lingers where it acted, or regions overlap."""
    return [*_lingering(inquiry, core), *(_within(inquiry, core) or _overlapping(inquiry, core)), *narrow_past(inquiry, core)]


def _within(inquiry: Inquiry, core: list[Formula]) -> list[str]:
    """Say whether a region that holds a robot's start and what it is asked to leaves no way between them."""
    mission = inquiry.mission
    asked = sorted({name for part in core for name in inquiry.names(part)} & mission.regions.keys())
    found = (
        why_not_within(mission, inquiry.systems.graph_of(robot), robot, name)
        for name in (asked if mission.obstacles else ())
        if not inquiry.feasible([eventually(name)], inquiry.worlds)
        for robot in mission.agents
    )
    return [said for said in [next((said for said in found if said is not None), None)] if said is not None]


def _unmet(inquiry: Inquiry, core: list[Formula]) -> list[str]:
    """Say what each requirement needs that the others do not allow, else whether one robot alone could do it."""
    found = [reason for part in core for reason in unmet_needs(inquiry, part, [other for other in core if other is not part])]
    if not found and len(inquiry.worlds) > 1 and any(inquiry.feasible(core, [world]) for world in inquiry.worlds):
        return ["One robot alone could do it; the letters of the others at their starts break it."]
    return found


def _walls(inquiry: Inquiry, core: list[Formula]) -> list[str]:
    """Say whether it is in the way that a robot which goes straight from room to room is in neither for sure at their wall."""
    pairs = sorted({(min(rooms), max(rooms)) for world in inquiry.worlds for rooms in world.walls.values()})
    if inquiry.mission.spec.trace == "infinite" or not pairs:
        return []
    found = (
        next((pair for pair in pairs if _held_at(inquiry, [pair], core)), pairs[0]) if _held_at(inquiry, pairs, core) else None
    )
    return [] if found is None else [wall_sentence(*found, inquiry.mission.margin)]


def _held_at(inquiry: Inquiry, pairs: list[tuple[str, str]], core: list[Formula]) -> bool:
    """Tell whether a plan keeps the core where robots are in one room for sure at these walls, or in both."""
    shown: tuple[Literal["one", "both"], ...] = ("one", "both")
    return any(inquiry.feasible(core, [sure_at_walls(world, pairs, names) for world in inquiry.worlds]) for names in shown)


def _lingering(inquiry: Inquiry, core: list[Formula]) -> list[str]:
    """Say whether it is in the way that a robot is still in the region whose action it has just made."""
    actions = [(robot, action) for robot in inquiry.robots for action in robot.actions if action.source != action.target]
    for robot, action in actions:
        worlds = [leaving_at_once(world, action) for world in inquiry.worlds]
        if inquiry.feasible(core, worlds):
            changed = sorted(set(robot.states[action.target]) ^ set(robot.states[action.source]))
            shown = f", which changes {joined_names(changed)}," if changed else ""
            return [
                f"The action {action.source} -> {action.target} is made inside {action.at}{shown} and the robot is still there "
                f"when it ends: it leaves {action.at} afterwards. Ask for what is meant outside of {action.at} alone, such as "
                f"`(... | {action.at})`."
            ]
    return []


def _overlapping(inquiry: Inquiry, core: list[Formula]) -> list[str]:
    """Say which two regions overlap so that no way to them is clear, though there would be one if they lay apart."""
    regions, layout = inquiry.mission.all_regions, inquiry.systems.layout
    named = sorted({name for part in core for name in inquiry.names(part)} & regions.keys())
    pairs = {tuple(sorted((a, b))) for a in named for b in layout.neighbours[a]}
    for a, b in sorted(pairs):
        if _held_without(inquiry, core, b):
            for inner, outer in ((a, b), (b, a)):
                if outer in (layout.around(inner) or ()):
                    return [f"{inner} lies inside {outer}: {inner} cannot be reached, or left again, without entering {outer}."]
            gap = float(np.linalg.norm(np.array(regions[a].center) - np.array(regions[b].center)))
            return [
                f"{a} and {b} overlap, their middles {gap:.3g} m apart: whether a robot at one of them, or on the way to it, is in "
                f"the other as well is not clear by the margin {layout.slack:g} m. Move them apart, or one well inside the other."
            ]
    return []


def _held_without(inquiry: Inquiry, core: Sequence[Formula], region: str) -> bool:
    """Tell whether the core could hold were a region far away."""
    body, table = inquiry.mission.all_regions[region], "hoops" if region in inquiry.mission.hoops else "regions"
    far = body.model_copy(update={"center": (body.center[0] + _FAR, *body.center[1:])})
    moved = {**getattr(inquiry.mission, table), region: far}
    systems = Systems(inquiry.mission.model_copy(update={table: moved}))
    return inquiry.feasible(core, [systems.of(name) for name in inquiry.mission.agents])


def _in_front(inquiry: Inquiry, core: Sequence[Formula]) -> Iterator[tuple[str, list[str]]]:
    """Yield regions without which the core could hold, and what it names that is reached through them alone."""
    asked = sorted({name for part in core for name in inquiry.names(part)} & inquiry.mission.regions.keys())
    for region in inquiry.mission.regions:
        past = [without(world, region) for world in inquiry.worlds]
        behind = [name for name in asked if name != region and not inquiry.feasible([eventually(name)], past)]
        if behind and _held_without(inquiry, core, region):
            yield region, behind


def narrow_past(inquiry: Inquiry, core: Sequence[Formula]) -> list[str]:
    """Say where a region leaves too narrow a way past it, if the core could hold were it not there.

    Args:
        inquiry: Into whose mission.
        core: The requirements.
    """
    mission = inquiry.mission
    for region, behind in _in_front(inquiry, core):
        gaps = [
            (gap, robot, name)
            for robot, name in itertools.product(mission.agents, behind)
            if isinstance(gap := _gap(mission, robot, region, name), Gap) and gap.width <= gap.needed
        ]
        if gaps:
            gap, robot, name = max(gaps, key=lambda found: found[0].width - found[0].needed)
            helps = " or a smaller `margin`" if gap.width > gap.needed - 2.0 * mission.margin else ""
            where = said_of_narrowest(mission, gap)
            return [f"No way past '{region}' leads {robot} to {name}: {where}. More room there{helps} would help."]
    return []


def _gap(mission: Mission, robot: str, region: str, end: str) -> Gap | Shut:
    """Return where the widest way of a robot to a region, past another one, is narrowest."""
    permitted = mission.all_regions.keys() - lasting_regions(mission, robot, inside=False) - {region}
    start, middle = (np.array(point) for point in (mission.agents[robot].start, mission.all_regions[end].center))
    return narrowest_around(FreeSpace.of(mission, mission.vehicle_of(robot).radius), start, middle, permitted)


def _contradiction(inquiry: Inquiry, core: list[Formula]) -> list[str]:
    """Say whether not even robots that can show every letter at every time could do it."""
    return [sentence for sentence in [no_word(inquiry.mission, core)] if sentence]


def _apart(inquiry: Inquiry, core: list[Formula]) -> list[str]:
    """Say which regions would have to be visited at once, if that is what stands in the way."""
    if inquiry.mission.spec.team == "joint" or inquiry.mission.spec.trace == "infinite":
        return []
    regions = sorted({name for part in core for name in inquiry.names(part)} & set(inquiry.mission.all_regions))
    letters = representative_letters(conjunct_automata(all_of(core), "finite"))
    shown = {label & frozenset(regions) for world in inquiry.worlds for label in world.labels}
    if satisfiable(core, [letter for letter in letters if letter & frozenset(regions) in shown]):
        return []
    pairs = [(a, b) for a, b in itertools.combinations(regions, 2) if not any({a, b} <= label for label in shown)]
    for a, b in pairs:
        allowed = [letter for letter in letters if not {a, b} <= letter]
        if not satisfiable(core, allowed) and b in inquiry.systems.layout.neighbours[a]:
            return [f"{a} and {b} may overlap, but no straight way between middles of regions is in both at once for sure."]
        if not satisfiable(core, allowed):
            return [f"{a} and {b} lie apart: no robot is in both at once."]
    return [f"No robot is ever in two of {joined_names(regions)} at once."] if pairs else []


def _bad_starts(inquiry: Inquiry, core: list[Formula]) -> list[str]:
    """Return a sentence for each robot whose first letter, of `joint` beside those of the others, loses the core."""
    mission = inquiry.mission
    if mission.spec.trace == "infinite" or mission.written.counts:
        return []
    automata = conjunct_automata(all_of(core), "finite")
    first = {world.robot: world.labels[world.initial] for world in inquiry.worlds if world.robot}

    def loses(letter: Letter) -> bool:
        task = Task(automata, [letter])
        return task.row(task.initial)[0] == DEAD

    blamed = [robot for robot, letter in first.items() if loses(letter)]
    if mission.spec.team == "joint":
        team = frozenset[str]().union(*first.values())
        alone = [robot for robot in blamed if first[robot] & mission.all_regions.keys()]
        blamed = (alone or blamed) if loses(team) else []
    return [f"{robot} starts {_inside(inquiry, first[robot])}." for robot in blamed]


def _bad_ends(inquiry: Inquiry, core: list[Formula]) -> list[str]:
    """Return a sentence for each robot whose end is where the core could hold if robots might end anywhere."""
    mission = inquiry.mission
    ends = {name: agent.end for name, agent in mission.agents.items() if agent.end is not None}
    if not ends or not inquiry.feasible(core, [replace(world, final=None) for world in inquiry.worlds]):
        return []
    found: list[str] = []
    for robot, end in ends.items():
        worlds = [replace(world, final=None) if world.robot == robot else world for world in inquiry.worlds]
        if len(ends) == 1 or inquiry.feasible(core, worlds):
            letter = frozenset(
                name for name, region in mission.all_regions.items() if float(region.level(np.array(end))) <= 1.0
            )
            found.append(f"{robot} is to end {_inside(inquiry, letter)}.")
    return found


def _inside(inquiry: Inquiry, letter: Letter) -> str:
    """Return where a robot is that shows a letter."""
    inside = sorted(letter & frozenset(inquiry.mission.all_regions))
    return f"inside {joined_names(inside)}" if inside else "in free flight, in no region"


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
            given = [with_internal(world, proposition) for world in inquiry.worlds]
            if inquiry.feasible([*others, eventually(name)], given):
                return [f"{name} needs {proposition}", *_why(inquiry, proposition, others, seen | {proposition})]
        held = [f"`{inquiry.shown(other)}`" for other in others]
        return [f"{name} cannot be visited while {joined_names(held)} hold{'s' * (len(held) == 1)}"] if held else []
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
    who = f"only {joined_names(able)} can show {name}"
    regions = sorted(seen & inquiry.mission.all_regions.keys())
    return [who, *(f"{joined_names(able)} cannot reach {r}" for r in regions if not inquiry.feasible([eventually(r)], worlds))]


def _needed_by(inquiry: Inquiry, part: Formula) -> list[str]:
    """Return regions, not named by a requirement, without which it cannot be met."""
    return [
        region
        for region in inquiry.mission.all_regions
        if region not in inquiry.names(part)
        and not inquiry.feasible([part], [without(world, region) for world in inquiry.worlds])
    ]


def _sentence(steps: list[str]) -> str:
    return (steps[0] if len(steps) == 1 else f"{', '.join(steps[:-1])}, and {steps[-1]}") + "."
