"""Explanations of unsatisfiable formulas that count robots: the parts that cannot hold together."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

from ltlplan.logic.budget import Budget
from ltlplan.logic.conjunction import conjunct_automata, conjuncts
from ltlplan.logic.signed_parts import signed_parts
from ltlplan.search.counting.capacities import Room, most_that_show
from ltlplan.search.counting.counting_propositions import Marks, true_atoms
from ltlplan.search.counting.planning import plan_counts
from ltlplan.search.explanations.count_laws import laws_of_counts, laws_of_turns, no_word, propositions_of, some_word
from ltlplan.search.explanations.inquiry import Inquiry, all_of
from ltlplan.search.explanations.reasons import leads_through, narrow_past
from ltlplan.search.explanations.relaxed_systems import without
from ltlplan.search.explanations.unsatisfiable_cores import (
    NoPlan,
    edge_sentence,
    missing_edges,
    opened_to_all,
    without_needless,
)
from ltlplan.search.numbering import closure
from ltlplan.search.orders.state_sets import Reading, shown_at
from ltlplan.search.problem import Problem
from ltlplan.systems.region_labels import Layout
from ltlplan.systems.transition_systems import TransitionSystem
from ltlplan.systems.unreachable import joined_names, why_unreachable
from verify.data import Formula, Mission
from verify.data.language.counting import atoms

_STATES = 20_000
_IN_TURNS = "Robots move one after another or together, and each waits in its region, or just outside one that it has left, for others where that helps."
_PAIRS = 300
"""Pairs of requirements of which it is found out whether they contradict each other."""


def no_counted_plan(problem: Problem, kinds: Sequence[str], rooms: Mapping[str, int]) -> NoPlan:
    """Return the error that says which parts of the formula cannot hold together.

    Args:
        problem: Whose formula cannot be met.
        kinds: As for `plan_counts`.
        rooms: How many robots small regions hold.
    """
    mission, systems = problem.mission, problem.each
    parts = list(dict.fromkeys(conjuncts(problem.asked)))
    inquiry = Inquiry(mission, problem.systems, systems, partial(_possible, kinds, rooms))
    core = _contradiction(mission, parts) or without_needless(parts, lambda some: inquiry.feasible(some, systems))
    robots, in_worlds = [system.robot for system in systems], partial(inquiry.feasible, core)
    opened = opened_to_all(mission, in_worlds, robots)
    edges = [] if opened else missing_edges(mission, in_worlds, robots)
    roomy = replace(inquiry, possible=partial(_possible, kinds, {}))
    reasons = (
        [sentence for sentence in [no_word(mission, core)] if sentence]
        or _bad_starts(mission, systems, core)
        or _apart(mission, systems, core)
        or _at_one_instant(mission, systems, core, rooms)
        or [
            *_closed(mission, core),
            *(
                _unreached(problem, core)
                or narrow_past(inquiry, core)
                or _needed(inquiry, core)
                or leads_through(inquiry, core)
            ),
            *(_crowded(mission, systems, rooms, core) if rooms and roomy.feasible(core, systems) else ()),
        ]
    )
    reasons = [*reasons, *opened, *edge_sentence(mission, edges)] or [_IN_TURNS]
    return NoPlan([inquiry.shown(part) for part in core], reasons, edges)


def _contradiction(mission: Mission, parts: Sequence[Formula]) -> list[Formula] | None:
    """Return a requirement, or two that speak of the same, that no word satisfies; None where none were found."""
    tried = (some for size in (1, 2) for some in itertools.islice(itertools.combinations(parts, size), _PAIRS))
    of_the_same = (some for some in tried if frozenset.intersection(*(part.names() for part in some)))
    return next((list(some) for some in of_the_same if no_word(mission, some)), None)


def _bad_starts(mission: Mission, systems: Sequence[TransitionSystem], core: Sequence[Formula]) -> list[str]:
    """Say who starts inside regions that requirements name, and who does not, where what the team shows at its start loses them."""
    formula = all_of(core)
    marks = Marks(conjunct_automata(formula, "finite"), atoms(formula))
    if Reading(marks, joint=True).begin(tuple([shown_at(marks, system, system.initial) for system in systems])) is not None:
        return []
    inside, outside = dict[str, dict[str, None]](), list[str]()
    named = {(node.name, node.robot) for part in core for node in part.nodes() if node.name in mission.all_regions}
    for region, whose in sorted(named):
        those = [each.robot for each in systems if whose in ("", each.robot) and region in each.labels[each.initial]]
        for robot in those:
            inside.setdefault(robot, {})[region] = None
        outside += [] if those else [f"At the start {f'{whose} is not' if whose else 'no robot is'} inside {region}."]
    return [*(f"{robot} starts inside {joined_names(regions)}." for robot, regions in inside.items()), *outside]


def _apart(mission: Mission, systems: Sequence[TransitionSystem], core: Sequence[Formula]) -> list[str]:
    """Say which regions lie apart, if that leaves too few robots for what is asked of both at once."""
    letters = frozenset(letter for system in systems for letter in system.labels)
    if some_word(mission, [*core, *laws_of_counts(core, len(systems), letters)]):
        return []
    neighbours, named = Layout(mission).neighbours, all_of(core).names() & mission.all_regions.keys()
    pairs = [(a, b) for a, b in itertools.combinations(sorted(named), 2) if b not in neighbours[a]]
    few = (
        f", and there are {len(systems)} robots"
        if any(node.operator == "count" for part in core for node in part.nodes())
        else ""
    )
    return [f"{a} and {b} lie apart: no robot is in both at once{few}." for a, b in pairs]


def _at_one_instant(
    mission: Mission, systems: Sequence[TransitionSystem], core: Sequence[Formula], rooms: Mapping[str, int]
) -> list[str]:
    """Say whether robots would have to enter or leave regions at the very same instant, and of which there is no room for them in any case."""
    known = [*core, *laws_of_counts(core, len(systems)), *_shown_at_starts(systems, core)]
    pair = next((pair for pair, law in laws_of_turns(core) if not some_word(mission, [*known, law])), None)
    if pair is None:
        return []
    named = [atom for atom in pair if atom.robot]
    first = f", such as `G ({named[0].text} -> F {named[1].text})`" if named else ""
    shown = joined_names([f"`{atom.text}`" for atom in pair])
    return [
        f"Two robots would have to enter or leave at the very same instant, for {shown} to change together: no flight is sure to do that, as one "
        f"comes before the other. What would help: a formula that lets one of them be first{first}.",
        *(
            f"Nor is there room for both in '{region}' at once: {_kept(mission)} {_enlarged(mission, region, 2)}."
            for region in {atom.counted.name for atom in pair}
            if rooms.get(region, 2) < 2
        ),
    ]


def _shown_at_starts(systems: Sequence[TransitionSystem], core: Sequence[Formula]) -> Iterator[Formula]:
    """Yield for each proposition that it holds at the start, or that it does not."""
    known = {atom.text: atom for atom in propositions_of(core)}
    held = true_atoms(known, [(system.robot, system.labels[system.initial]) for system in systems])
    yield from (atom.formula if text in held else Formula("!", (atom.formula,)) for text, atom in known.items())


def _possible(
    kinds: Sequence[str], rooms: Mapping[str, int], parts: Sequence[Formula], systems: Sequence[TransitionSystem]
) -> bool:
    marks = Marks(conjunct_automata(all_of(parts), "finite"), atoms(all_of(parts)))
    return plan_counts(systems, kinds, marks, Budget(states=_STATES), rooms=rooms) is not None


def _unreached(problem: Problem, core: Sequence[Formula]) -> list[str]:
    """Say of regions that requirements name, of some robot or of all, which nobody can come to that is asked to, and what shuts the way."""
    mission, found = problem.mission, dict[str, None]()
    shown = {system.robot: _shown(system) for system in problem.each}
    named = {(node.name, node.robot) for part in core for node in part.nodes() if node.name in mission.all_regions}
    for region, whose in sorted(named):
        asked = [system for system in problem.each if whose in ("", system.robot)]
        if any(region in shown[system.robot] for system in asked):
            continue
        robot = min((system.robot for system in asked), key=lambda name: mission.vehicle_of(name).radius)
        shut = why_unreachable(mission, problem.systems.graph_of(robot), robot, region)
        found[shut or f"{whose or 'No robot'} {'cannot' if whose else 'can'} reach {region}."] = None
    return [*found, *(problem.systems.unclear(mission.formula.names()) if found else ())]


def _needed(inquiry: Inquiry, core: Sequence[Formula]) -> list[str]:
    """Say which regions requirements need that do not name them."""
    every = ((part, [name for name in inquiry.mission.all_regions if name not in part.names()]) for part in core)
    alone = ((part, others) for part, others in every if others and inquiry.feasible([part], inquiry.worlds))
    needs = (
        (part, [name for name in others if not inquiry.feasible([part], [without(world, name) for world in inquiry.worlds])])
        for part, others in alone
    )
    return [f"`{inquiry.shown(part)}` needs {joined_names(lost)}." for part, lost in needs if lost]


def _shown(system: TransitionSystem) -> frozenset[str]:
    """Return all names that a robot can come to show."""
    nodes = closure([system.initial], lambda node: (target for target, _ in system.edges[node]))
    return frozenset[str]().union(*(system.labels[node] for node in nodes))


def _closed(mission: Mission, core: Sequence[Formula]) -> list[str]:
    """Say which regions that requirements name with a robot are closed to its kind."""
    named = {(node.name, node.robot) for part in core for node in part.nodes() if node.operator == "name" and node.robot}
    closed = sorted(
        (name, robot) for name, robot in named if name in mission.all_regions and not mission.may_enter(robot, name)
    )
    return [
        f"{name} is closed to {robot}: only {joined_names(mission.all_regions[name].only or ())} may enter it."
        for name, robot in closed
    ]


def _crowded(
    mission: Mission, systems: Sequence[TransitionSystem], rooms: Mapping[str, int], core: Sequence[Formula]
) -> list[str]:
    """Say which regions are too small for what is asked: for a count, else those that are named."""
    return list(_too_small(mission, systems, rooms, core)) or [
        f"It could hold if {_those_in(name, core) or 'more robots'} were in '{name}' at once, which has room for {rooms[name] or 'none'}: "
        f"{_kept(mission)} {_enlarged(mission, name, rooms[name] + 1)}; a smaller `margin` needs less."
        for name in sorted(all_of(core).names() & rooms.keys())
    ]


def _those_in(region: str, core: Sequence[Formula]) -> str:
    """Return the robots that requirements name with a region, where these are several."""
    robots = {node.robot for part in core for node in part.nodes() if node.robot and node.name == region}
    return joined_names(sorted(robots)) if len(robots) > 1 else ""


def _too_small(
    mission: Mission, systems: Sequence[TransitionSystem], rooms: Mapping[str, int], core: Sequence[Formula]
) -> Iterator[str]:
    """Name counts that ask for more robots at once than there is room for, and what would do."""
    known: set[str] = set()
    counts = {text: atom for part in core for text, atom in atoms(part).items() if not atom.robot}
    signed = {(node.atom, sign) for part in core for node, sign in signed_parts(part) if node.operator == "count"}
    for text, atom in sorted(counts.items(), key=lambda item: item[1].least):
        every_other = Formula("!", (atom.counted,)), len(systems) - atom.least + 1
        asked_for = ((atom.counted, atom.least), True), (every_other, False)  # that fewer do is that all others do not
        for counted, least in (asked for asked, sign in asked_for if (text, sign) in signed):
            found = most_that_show(counted, systems, rooms)
            if found is not None and least > found[0] and str(_plain(counted)) not in known:
                known.add(str(_plain(counted)))
                asked = str(Formula("count", (_plain(counted),), bound=(">=", least)))
                places = " or ".join(f"'{name}' (room for {rooms[name] or 'none'})" for name in found[1])
                yield f"`{asked}` asks for {least} robots in {places}: {_kept(mission)} {_what_would_do(mission, found[1], least)}"


def _plain(counted: Formula) -> Formula:
    twice = counted.operator == "!" and counted.arguments[0].operator == "!"
    return counted.arguments[0].arguments[0] if twice else counted


def _kept(mission: Mission) -> str:
    room = Room.of(mission, next(iter(mission.all_regions)))
    stretched = f", a distance in z counting {room.z_scale:g} times" if room.z_scale != 1.0 else ""
    return f"their centres are {room.apart:g} m apart (separation and margins{stretched}), and inside by the margin {room.margin:g} m."


def _what_would_do(mission: Mission, regions: Sequence[str], least: int) -> str:
    other = "ask for fewer, or in more regions"
    if len(regions) > 1:
        return f"Make one of them larger, or {other}."
    return f"{_enlarged(mission, regions[0], least)}, or {other}."


def _enlarged(mission: Mission, region: str, least: int) -> str:
    """Say how large a region must be at the least to hold some robots."""
    scale = Room.of(mission, region).scale_for(least)
    if scale is None:
        return "Make it much larger"
    size = " x ".join(f"{2 * half:.3g}" for half in mission.all_regions[region].half_lengths)
    return f"Make it larger ({size} m now; at least {math.ceil(scale * 100) / 100:g} times that, in each direction)"
