"""Why there is no plan: a smallest set of requirements that cannot hold together, and what stands in their way, in words.

Nothing is guessed. Every sentence here is the outcome of a search that found nothing, in the mission's world or in one
that differs from it in just the thing that the sentence names: one region taken away, all edges added, free flight
not shown, an internal state given from the start.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ltlplan.logic.automaton import DEAD, representative_letters
from ltlplan.logic.budget import TooLarge
from ltlplan.logic.conjunction import conjunct_automata, conjuncts
from ltlplan.logic.task import Task
from ltlplan.search.reduced_graph import Team
from ltlplan.search.refusals import remedies
from ltlplan.search.refusals.altered_systems import leaving_at_once, sure_at_walls, with_internal, without, without_free_flight
from ltlplan.search.refusals.remedies import Worlds
from ltlplan.search.refusals.requirements import BUDGET, all_of, eventually, satisfiable
from ltlplan.search.team_search import cheapest_path
from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.shared_walls import wall_sentence
from ltlplan.systems.unreachable import why_unreachable
from verify.data import Formula, Mission, Unsatisfiable, Word
from verify.data.language.counting import written_out
from verify.data.language.formula import FREE
from verify.data.language.free import in_no_region

MAX_SUBSETS = 300
_FAR = 1e4  # m, to where a region is moved to see what is possible without it in the way

Feasible = Callable[[Sequence[Formula], Worlds], bool]


class NoPlan(Unsatisfiable):
    """No words that these robots can fly satisfy the formula.

    Attributes:
        core: Requirements that cannot hold together, as text; no proper part of them is impossible by itself.
        reasons: What stands in their way, one sentence each.
        edges: Edges of the environment that would make the core possible, where some would.
        left_out: Parts of the formula without which the rest can be planned; empty where none were found.
    """

    def __init__(
        self,
        core: Sequence[str],
        reasons: Sequence[str],
        edges: Sequence[tuple[str, str]] = (),
        left_out: Sequence[str] = (),
        *,
        least: bool = False,
    ) -> None:
        self.core = tuple(core)
        self.reasons = tuple(reasons)
        self.edges = tuple(edges)
        self.left_out = tuple(left_out)
        quoted = [f"`{part}`" for part in core]
        what = f"{quoted[0]} cannot hold" if len(quoted) == 1 else f"{_and(quoted)} cannot hold together"
        offer = [_offer(self.left_out, least=least)] if left_out else []
        super().__init__(" ".join(["No plan satisfies the formula.", f"{what}.", *self.reasons, *offer]))


def _offer(left_out: Sequence[str], *, least: bool) -> str:
    which = "The cheapest relaxation" if least else "A relaxation"
    return f"{which} leaves out {_and([f'`{part}`' for part in left_out])} (weight {len(left_out)}): the rest can be planned."


def explain(mission: Mission, systems: Systems, worlds: Worlds, *, feasible: Feasible | None = None) -> NoPlan:
    """Return the error that says why a mission has no plan.

    Args:
        mission: Whose formula cannot be met.
        systems: What its robots can do.
        worlds: One system for each robot.
        feasible: Whether some requirements can be met in some worlds; by default on finite words, each robot's letters
            by themselves.
    """
    return _Inquiry(mission, systems, worlds, feasible or _feasible).answer()


def refused_in_some_order(mission: Mission, order: Sequence[tuple[str, Word]]) -> NoPlan:
    """Return the error for a formula that robots can meet in one order of flying, but by no plan in every order.

    Args:
        mission: Whose formula it is.
        order: The order, with words, that breaks the cheapest plan.
    """
    shown = ", then ".join(f"{robot} {word}" for robot, word in order)
    if mission.spec.team == "joint" and len(mission.agents) > 1:
        reason = (
            "Under `team: joint` robots fly one at a time, whichever of them is first, while the others hold their first or last "
            "letters. Plans exist that hold where one certain robot flies first, but none that holds whoever does. The cheapest one "
            f"fails, for instance, where {shown} is flown. Let the formula hold while the other robot is still where it starts, or "
            "one robot do it all."
        )
        return NoPlan([mission.spec.formula or "true"], [reason])
    reason = (
        "Plans exist that hold in one order of the robots, but none that holds in every order. "
        f"The cheapest one fails, for instance, when they are read one after another as {shown}."
    )
    return NoPlan([mission.spec.formula or "true"], [reason])


def _feasible(parts: Sequence[Formula], worlds: Worlds) -> bool:
    team = Team(worlds)
    try:
        task = Task(conjunct_automata(all_of(parts), "finite"), team.letters, team.walls)
        return cheapest_path(team, task, BUDGET) is not None
    except TooLarge:
        return True  # not known to be impossible, so nothing is said of it


@dataclass
class _Inquiry:
    mission: Mission
    systems: Systems
    worlds: Worlds
    feasible: Feasible

    def __post_init__(self) -> None:
        free = {FREE: in_no_region(self.mission.all_regions)}
        robots = tuple(self.mission.agents)
        self.robots = list({id(robot): robot for robot in map(self.mission.robot_of, self.mission.agents)}.values())
        self.written: dict[Formula, Formula] = {}  # as the user wrote them, with `free`
        for asked in reversed(conjuncts(self.mission.written)):
            for part in conjuncts(written_out(asked.substitute(free), robots)):
                self.written[part] = asked if FREE in asked.names() else part

    def answer(self) -> NoPlan:
        core = self._core(list(dict.fromkeys(conjuncts(self.mission.formula))))
        robots = [world.robot for world in self.worlds]

        def possible(worlds: Worlds) -> bool:
            return self.feasible(core, worlds)

        opened = remedies.opened(self.mission, possible, robots)
        edges = [] if opened else remedies.missing_edges(self.mission, possible, robots)
        reasons = [*self._reasons(core), *self._shut(core), *self._edge_sentence(edges), *opened, *self.systems.unclear()]
        reasons = list(dict.fromkeys(reasons))
        return NoPlan([self._shown(part) for part in core], reasons, edges)

    def _core(self, parts: list[Formula]) -> list[Formula]:
        """Return a smallest impossible set of parts; where there are too many sets to try, one that cannot be made smaller."""
        core = list(parts)
        for part in parts:
            rest = [other for other in core if other is not part]
            if rest and not self.feasible(rest, self.worlds):
                core = rest
        tried = 0
        for size in range(1, len(core)):
            for subset in itertools.combinations(parts, size):
                tried += 1
                if tried > MAX_SUBSETS:
                    return core
                if not self.feasible(subset, self.worlds):
                    return list(subset)
        return core

    def _reasons(self, core: list[Formula]) -> list[str]:
        if self._contradiction(core):
            return ["Whatever robots do, no word satisfies this."]
        apart = self._apart(core)
        if apart:
            return apart
        starts = self._bad_starts(core)
        if starts:
            return starts
        walls = self._walls(core)
        if walls:
            return walls
        if self.mission.spec.trace == "finite" and self.feasible(core, [without_free_flight(world) for world in self.worlds]):
            return [
                "Between two regions that lie apart a robot is in free flight and in neither of them; "
                "`free` means in no region, so write for instance `(a | free)` where that may happen."
            ]
        reasons = [*self._lingering(core), *self._overlapping(core)]
        if reasons:
            return reasons
        for part in core:
            others = [other for other in core if other is not part]
            reasons += self._obstacles(part, others)
        if not reasons and len(self.worlds) > 1 and any(self.feasible(core, [world]) for world in self.worlds):
            reasons.append("One robot alone could do it; the letters of the others at their starts break it.")
        if reasons:
            return reasons
        over_time = all(any(node.operator in "FGUWRM" for node in part.nodes()) for part in core)
        if self.mission.spec.team == "joint" and len(self.worlds) > 1 and over_time:
            return [
                "Under `team: joint` robots fly one at a time, while the others hold their first or last letters: what several "
                "robots would have to do in turns, or at once, is not planned."
            ]
        if len(core) > 1:
            return ["Each part of this can hold without the others, but no order of visits serves them all."]
        return ["Some words satisfy this, but none that can be flown from these starts along these edges."]

    def _walls(self, core: list[Formula]) -> list[str]:
        """Say whether it is in the way that a robot which goes straight from room to room is in neither for sure at their wall."""
        pairs = sorted({(min(rooms), max(rooms)) for world in self.worlds for rooms in world.walls.values()})
        if self.mission.spec.trace == "infinite" or not pairs:
            return []
        found = next((pair for pair in pairs if self._held_at([pair], core)), pairs[0]) if self._held_at(pairs, core) else None
        return [] if found is None else [wall_sentence(*found, self.mission.margin)]

    def _held_at(self, pairs: list[tuple[str, str]], core: list[Formula]) -> bool:
        """Tell whether a plan keeps the core where robots are in one room for sure at these walls, or in both."""
        shown: tuple[Literal["one", "both"], ...] = ("one", "both")
        return any(self.feasible(core, [sure_at_walls(world, pairs, names) for world in self.worlds]) for names in shown)

    def _lingering(self, core: list[Formula]) -> list[str]:
        """Say whether it is in the way that a robot is still in the region whose action it has just made."""
        actions = [(robot, action) for robot in self.robots for action in robot.actions if action.source != action.target]
        for robot, action in actions:
            worlds = [leaving_at_once(world, action) for world in self.worlds]
            if self.feasible(core, worlds):
                changed = sorted(set(robot.states[action.target]) ^ set(robot.states[action.source]))
                shown = f", which changes {_and(changed)}," if changed else ""
                return [
                    f"The action {action.source} -> {action.target} is made inside {action.at}{shown} and the robot is still there "
                    f"when it ends: it leaves {action.at} afterwards. Ask for what is meant outside of {action.at} alone, such as "
                    f"`(... | {action.at})`."
                ]
        return []

    def _overlapping(self, core: list[Formula]) -> list[str]:
        """Say which two regions overlap so that no way to them is clear, though there would be one if they lay apart."""
        regions, layout = self.mission.all_regions, self.systems.layout
        named = sorted({name for part in core for name in self._names(part)} & regions.keys())
        pairs = {tuple(sorted((a, b))) for a in named for b in layout.neighbours[a]}
        for a, b in sorted(pairs):
            far = (regions[b].center[0] + _FAR, *regions[b].center[1:])
            table = "hoops" if b in self.mission.hoops else "regions"
            moved = {**getattr(self.mission, table), b: regions[b].model_copy(update={"center": far})}
            systems = Systems(self.mission.model_copy(update={table: moved}))
            if self.feasible(core, [systems.of(name) for name in self.mission.agents]):
                gap = float(np.linalg.norm(np.array(regions[a].center) - np.array(regions[b].center)))
                return [
                    f"{a} and {b} overlap, their middles {gap:.3g} m apart: whether a robot at one of them, or on the way to it, is in "
                    f"the other as well is not clear by the margin {layout.slack:g} m. Move them apart, or one well inside the other."
                ]
        return []

    def _contradiction(self, core: list[Formula]) -> bool:
        """Tell whether not even robots that can show every letter at every time could do it."""
        trace = self.mission.spec.trace
        if trace == "infinite":
            from ltlplan.logic.small_automata import small_automaton

            return not small_automaton(all_of(core), trace).accepting
        return not satisfiable(core, representative_letters(conjunct_automata(all_of(core), trace)))

    def _apart(self, core: list[Formula]) -> list[str]:
        """Say which regions would have to be visited at once, if that is what stands in the way."""
        if self.mission.spec.team == "joint" or self.mission.spec.trace == "infinite":
            return []
        regions = sorted({name for part in core for name in self._names(part)} & set(self.mission.all_regions))
        letters = representative_letters(conjunct_automata(all_of(core), "finite"))
        shown = {label & frozenset(regions) for world in self.worlds for label in world.labels}
        if satisfiable(core, [letter for letter in letters if letter & frozenset(regions) in shown]):
            return []
        pairs = [(a, b) for a, b in itertools.combinations(regions, 2) if not any({a, b} <= label for label in shown)]
        for a, b in pairs:
            allowed = [letter for letter in letters if not {a, b} <= letter]
            if not satisfiable(core, allowed) and b in self.systems.layout.neighbours[a]:
                return [f"{a} and {b} may overlap, but no straight way between middles of regions is in both at once for sure."]
            if not satisfiable(core, allowed):
                return [f"{a} and {b} lie apart: no robot is in both at once."]
        return [f"No robot is ever in two of {_and(regions)} at once."] if pairs else []

    def _bad_starts(self, core: list[Formula]) -> list[str]:
        """Return a sentence for each robot whose first letter alone loses the core."""
        found: list[str] = []
        if self.mission.spec.trace == "infinite" or self.mission.spec.team == "joint":
            return found
        automata = conjunct_automata(all_of(core), "finite")
        for world in self.worlds:
            letter = world.labels[world.initial]
            task = Task(automata, [letter])
            if task.row(task.initial)[0] == DEAD and world.robot:
                inside = sorted(letter & frozenset(self.mission.all_regions))
                where = f"inside {_and(inside)}" if inside else "in free flight, in no region"
                found.append(f"{world.robot} starts {where}.")
        return found

    def _obstacles(self, part: Formula, others: list[Formula]) -> list[str]:
        """Say what one requirement needs that the others or the world do not allow."""
        shown = f"`{self._shown(part)}`"
        for name in sorted(self._names(part)):
            wanted = eventually(name)
            if satisfiable([part, Formula("!", (wanted,))], representative_letters(conjunct_automata(part, "finite"))):
                continue  # it can hold without this name
            if not self.feasible([*others, wanted], self.worlds):
                steps = self._why(name, others, {name})
                if steps:
                    start = f"{name} needs "
                    if steps[0].startswith(start):
                        return [_sentence([f"{shown} needs {steps[0].removeprefix(start)}", *steps[1:]])]
                    return [_sentence([f"{shown} needs {name}", *steps])]
        if self.feasible([part], self.worlds):
            for region in self._needed_by(part):
                if not self.feasible([*others, eventually(region)], self.worlds):
                    return [_sentence([f"{shown} needs {region}", *self._why(region, others, {region})])]
        return []

    def _why(self, name: str, others: list[Formula], seen: set[str]) -> list[str]:
        """Return steps that explain why no robot can come to show a name while the other requirements hold."""
        if name in self.mission.all_regions:
            if not self.feasible([eventually(name)], self.worlds):
                return [f"no robot can reach {name}"]
            for region in self._needed_by(eventually(name)):
                if region not in seen and not self.feasible([*others, eventually(region)], self.worlds):
                    return [f"{name} needs {region}", *self._why(region, others, seen | {region})]
            for proposition in sorted(self.mission.internal_propositions - seen):
                given = [with_internal(world, proposition, self.mission) for world in self.worlds]
                if self.feasible([*others, eventually(name)], given):
                    return [f"{name} needs {proposition}", *self._why(proposition, others, seen | {proposition})]
            held = [f"`{self._shown(other)}`" for other in others]
            return [f"{name} cannot be visited while {_and(held)} hold{'s' * (len(held) == 1)}"] if held else []
        places: set[str] = set()
        for robot in self.robots:
            gains = {s for s, names in robot.states.items() if name in names}
            places |= {a.at for a in robot.actions if a.target in gains and a.source not in gains}
        regions = sorted(places)
        if not regions:
            return [f"no action leads to {name}"]
        for region in regions:
            if region not in seen and not self.feasible([*others, eventually(region)], self.worlds):
                steps = self._why(region, others, seen | {region})
                return steps if steps and steps[0].endswith(region) else [f"{name} needs {region}", *steps]
        return self._who(name, seen)

    def _who(self, name: str, seen: set[str]) -> list[str]:
        """Say which robots alone can come to show an internal proposition, and what of all that is needed these cannot reach."""
        agents = list(self.mission.agents)
        able = [a for a in agents if any(name in names for names in self.mission.robot_of(a).states.values())]
        if len(able) == len(agents) or len(self.worlds) < len(agents):
            return []
        worlds = [self.worlds[agents.index(agent)] for agent in able]
        who = f"only {_and(able)} can show {name}"
        regions = sorted(seen & self.mission.all_regions.keys())
        return [who, *(f"{_and(able)} cannot reach {r}" for r in regions if not self.feasible([eventually(r)], worlds))]

    def _needed_by(self, part: Formula) -> list[str]:
        """Return regions, not named by a requirement, without which it cannot be met."""
        return [
            region
            for region in self.mission.all_regions
            if region not in self._names(part) and not self.feasible([part], [without(world, region) for world in self.worlds])
        ]

    def _shut(self, core: list[Formula]) -> list[str]:
        """Say what shuts the ways to regions that no robot can reach for obstacles."""
        if not self.mission.obstacles:
            return []
        named = {name for part in core for name in self._names(part)} & self.mission.all_regions.keys()
        lost = [name for name in sorted(named) if not self.feasible([eventually(name)], self.worlds)]
        smallest = min(self.mission.agents, key=lambda robot: self.mission.vehicle_of(robot).radius)
        graph = self.systems.graph_of(smallest)
        found = (why_unreachable(self.mission, graph, smallest, name) for name in lost)
        return [sentence for sentence in found if sentence is not None]

    def _edge_sentence(self, edges: list[tuple[str, str]]) -> list[str]:
        if not edges:
            return []
        arrow = " -> " if self.mission.environment is not None and self.mission.environment.directed else " - "
        return [f"With the edge{'s' * (len(edges) > 1)} {_and([a + arrow + b for a, b in edges])} added it could hold."]

    def _shown(self, part: Formula) -> str:
        return str(self.written.get(part, part))

    def _names(self, part: Formula) -> frozenset[str]:
        return self.written.get(part, part).names() - {FREE}


def _and(items: Sequence[str]) -> str:
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}"


def _sentence(steps: list[str]) -> str:
    text = steps[0] if len(steps) == 1 else f"{', '.join(steps[:-1])}, and {steps[-1]}"
    return text + "."
