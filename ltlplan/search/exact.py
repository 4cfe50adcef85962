"""From a mission to words: who visits what, in which order, at the smallest cost.

`assign` is exact: it returns a cheapest plan among all whose words keep the formula in every order of the robots, over the
letters that will really be flown, or says that there is none and why. Nothing here knows about time; a later check of the
timed claim may still add waits.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal

from ltlplan.allocation import Itinerary
from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.logic.task import Task
from ltlplan.search.counts.capacities import small_rooms
from ltlplan.search.counts.meetings import HoversOutside, meetings_of
from ltlplan.search.counts.planning import plan_counts
from ltlplan.search.counts.refusals import no_counted_plan
from ltlplan.search.endurance import over_endurance, require_endurance
from ltlplan.search.interleavings.ordered_plans import MOST_STATES, plan_ordered
from ltlplan.search.joint.team_words import plan_joint, plan_joint_makespan
from ltlplan.search.lassos.forgetful import closes_at_once
from ltlplan.search.lassos.lasso import LassoRun, cheapest_lasso
from ltlplan.search.lassos.resting_actions import acts_at_rest, comes_anew
from ltlplan.search.lassos.shared_parts import parts_of, share_out
from ltlplan.search.lassos.team_itineraries import team_itineraries, team_meetings
from ltlplan.search.lassos.team_lassos import TeamLasso, plan_team_lasso, team_lasso_exists
from ltlplan.search.lassos.team_readers import reads_letters
from ltlplan.search.lassos.word_lasso import improve_lasso
from ltlplan.search.makespan import Rule, plan_makespan
from ltlplan.search.reduced_graph import Team
from ltlplan.search.refusals.requirements import all_of
from ltlplan.search.relevant_places import FEW, places_that_matter
from ltlplan.search.team_search import PlanningOutcome, plan_team
from ltlplan.systems.region_labels import Layout
from ltlplan.systems.robot_systems import Systems, unit_cost
from ltlplan.systems.transition_systems import Cost, Node, TransitionSystem
from ltlplan.systems.visit_log import VisitLog
from verify.data import Formula, Infeasible, InternalError, Mission, Unsatisfiable, Visit, Word
from verify.data.language.counting import Atom, atoms
from verify.data.language.formula import FALSE
from verify.data.language.word import stutter_free
from verify.data.plan import Meeting, Precedence
from verify.data.shapes.inequalities import Point

TIES = 1e-6  # m, more than the tiny amounts that break ties between equally dear plans add up to
MOST_NAMES = 400  # in a formula: decision diagrams of its letters are as deep as that
WORD_STATES = 10_000  # states for looking for a cheaper infinite word than the planning automaton's


@dataclass(frozen=True, slots=True)
class Assignment:
    """What every robot does, and how good that is.

    Attributes:
        robots: An itinerary for each of the mission's agents, in the mission's order.
        cost: The objective: the sum of the robots' costs, or that of the one that costs most.
        lower_bound: No plan costs less than this.
        complete: Whether the search was exhausted, so that no plan is cheaper.
        tried: Complete plans that were checked in every order.
        notes: Sentences for a person.
        meetings: Arrivals that others wait for before they set out.
        precedences: Waits under which the words satisfy the formula, where they do not in every order of the robots.
    """

    robots: dict[str, Itinerary]
    cost: float
    lower_bound: float | None
    complete: bool
    tried: int
    notes: tuple[str, ...] = ()
    meetings: tuple[Meeting, ...] = ()
    precedences: tuple[Precedence, ...] = ()


def assign(
    mission: Mission,
    *,
    cost: Cost | None = None,
    metre: Mapping[str, float] | None = None,
    budget: Budget = DEFAULT_BUDGET,
    explained: bool = True,
) -> Assignment:
    """Share a mission among its robots at the smallest cost.

    Args:
        mission: With its formula, regions, environment, internal states and agents.
        cost: Cost of a leg, (robot, from a position or a region, to a region) -> float; where None, straight lines by the mission's
            weights of length and time (by metres, where some robot has neither).
        metre: What a metre costs each robot on the way to its end, where `cost` counts more than metres; endurance is not kept then.
        budget: Bounds on the search.
        explained: Whether it is found out why there is no plan, which takes many more searches.

    Raises:
        Unsatisfiable: No words that these robots can fly satisfy the formula; the message says which parts of it cannot
            hold together, and which to leave out.
        Infeasible: No way to share it brings all back before a vehicle's endurance ends.
        TooLarge: A budget was used up before an answer was found.
    """
    try:
        found = _assign(mission, cost, metre, budget)
    except _NoWords as error:
        raise (error.why() if explained else error) from None
    return in_units_of(mission, found) if cost is None else found


def assign_under_precedences(
    mission: Mission, *, cost: Cost | None = None, budget: Budget = DEFAULT_BUDGET
) -> Assignment | None:
    """Share a finite mission by the cheapest words that hold under precedences, also where dearer or other words hold in every order.

    Args:
        mission: Of several robots.
        cost: Cost of a leg, as for `assign`.
        budget: Bounds on the search.

    Returns:
        None where there are no such words.

    Raises:
        Infeasible: It brings not all back before a vehicle's endurance ends.
        TooLarge: A budget was used up before an answer was found.
    """
    layout = Layout(mission)
    systems = Systems(mission, cost, places=places_that_matter(mission, layout), layout=layout)
    each = [systems.of(name) for name in mission.agents]
    asked = _asked(mission, each)
    automata = conjunct_automata(asked, "finite", budget=budget)
    found = _assign_ordered(mission, systems, each, automata, atoms(asked), budget)
    if found is None:
        return None
    require_endurance(mission, systems, found.robots)
    return in_units_of(mission, found) if cost is None else found


class _NoWords(Unsatisfiable):
    """There is no plan; why is found out where it is asked."""

    def __init__(self, why: Callable[[], Unsatisfiable | Infeasible]) -> None:
        super().__init__("No plan satisfies the formula.")
        self.why = why


def _cheapest(mission: Mission) -> float | None:
    """Return what the cheapest plan costs; None where there is none."""
    try:
        return assign(mission, budget=Budget(states=50_000), explained=False).cost
    except (Unsatisfiable, Infeasible):
        return None


def in_units_of(mission: Mission, found: Assignment) -> Assignment:
    """Return what was searched by metres with the mission's own costs; the same where a metre costs 1.

    Args:
        mission: Gives weights and speeds.
        found: Counted as `Systems` does without a cost.
    """
    unit = unit_cost(mission)
    if unit == 1.0:
        return found
    robots = {name: replace(does, cost=does.cost * unit) for name, does in found.robots.items()}
    bound = None if found.lower_bound is None else found.lower_bound * unit
    return replace(found, robots=robots, cost=found.cost * unit, lower_bound=bound)


def _assign(mission: Mission, cost: Cost | None, metre: Mapping[str, float] | None, budget: Budget) -> Assignment:
    layout = Layout(mission)
    systems = Systems(mission, cost, places=places_that_matter(mission, layout), layout=layout, metre=metre)
    each = [systems.of(name) for name in mission.agents]
    if mission.spec.trace == "infinite":
        lasso = (
            _assign_team_laps(mission, systems, each, budget)
            if len(each) > 1
            else _assign_lasso(mission, systems, each[0], budget)
        )
        require_endurance(mission, systems, lasso.robots)
        return lasso
    asked = _asked(mission, each)
    if len(each) > 1 and mission.written.counts:
        counted = _assign_counted(mission, systems, each, asked, atoms(asked), budget)
        require_endurance(mission, systems, counted.robots)
        return counted
    automata = conjunct_automata(asked, "finite", budget=budget)
    joint = mission.spec.team == "joint" and len(each) > 1
    longest, most = mission.planner.objective == "longest" and len(each) > 1, systems.most_costs()
    bound, exhausted = 0.0, False  # on the bottleneck's cost, where that is what counts
    if joint:
        if longest:
            found, bound, exhausted = plan_joint_makespan(each, automata, budget, most)
        else:
            found = plan_joint(each, automata, budget, most)
        if found.run is None and found.first is not None and most is not None and found.refused is None:
            raise over_endurance(
                mission, systems, _assignment(mission, each, replace(found, run=found.first), 0.0, False).robots
            )
    else:
        team = Team(each)
        task = Task(automata, team.letters, team.walls)
        if longest or most is not None:
            found, bound, exhausted = plan_makespan(team, task, budget, Rule(longest, most))
            if found.run is None and most is not None:
                found, bound = plan_team(team, task, budget), 0.0  # is it the endurance, or the formula?
                if found.run is not None:
                    raise over_endurance(mission, systems, _assignment(mission, each, found, 0.0, False).robots)
        else:
            found = plan_team(team, task, budget)
    if found.run is None:
        ordered = None if len(each) == 1 else _assign_ordered(mission, systems, each, automata, atoms(asked), budget)
        if ordered is not None:
            require_endurance(mission, systems, ordered.robots)
            return ordered
        raise _NoWords(lambda: _no_plan(mission, systems, each, asked, found))
    plan = _assignment(mission, each, found, bound, exhausted)
    require_endurance(mission, systems, plan.robots)
    return replace(plan, notes=(*plan.notes, *_sizes(each, automata, found), *systems.unclear()))


def _assign_counted(
    mission: Mission,
    systems: Systems,
    each: list[TransitionSystem],
    asked: Formula,
    known: dict[str, Atom],
    budget: Budget,
) -> Assignment:
    """Plan a formula that counts robots or names them: words, and who waits for whom."""
    kinds = [mission.alike_as(name) for name in mission.agents]
    automata = conjunct_automata(asked, "finite", budget=budget)
    found = plan_counts(each, kinds, automata, known, budget, rooms=small_rooms(mission, each))
    if found is None:
        from ltlplan.search.refusals.relaxation import relaxed

        raise _NoWords(lambda: relaxed(mission, no_counted_plan(mission, each, kinds, asked), _cheapest))
    try:
        waits = meetings_of(each, found)
    except HoversOutside:  # but flights may be timed so that nobody has to
        with contextlib.suppress(TooLarge, Infeasible):
            ordered = _assign_ordered(mission, systems, each, automata, known, budget)
            if ordered is not None:
                return ordered
        raise
    robots = {name: itinerary(system, path) for name, system, path in zip(mission.agents, each, found.paths, strict=True)}
    total = sum(robot.cost for robot in robots.values())
    complete = found.exact and total <= found.bound + TIES
    notes = [f"The search reached {found.reached:,} states: how many robots rest where, and what is done."]
    if not complete:
        notes.append("A cheaper plan was not ruled out: who flies what was decided after how many fly where.")
    if waits:
        notes.append(
            f"Robots wait for each other: the plan has {len(found.stages)} stages, each begun when the one before has ended."
        )
    least = found.bound if found.exact else 0.0
    longest = mission.planner.objective == "longest" and len(robots) > 1
    if longest:
        notes.append("With counts the plan has the smallest sum of costs; its dearest robot may not be the cheapest.")
        total, least = max(robot.cost for robot in robots.values()), least / len(robots)
    return Assignment(robots, total, least, complete and not longest, 1, (*notes, *systems.unclear()), tuple(waits))


def _assign_ordered(
    mission: Mission,
    systems: Systems,
    each: list[TransitionSystem],
    automata: Sequence[Automaton],
    known: dict[str, Atom],
    budget: Budget,
) -> Assignment | None:
    """Plan words that hold under precedences between events, where none hold in every order of the robots; None where none do."""
    most = min(MOST_STATES, budget.states // 50)
    found = plan_ordered(each, automata, known, joint=mission.spec.team == "joint", most=most)
    if found is None:
        return None
    robots = {name: itinerary(system, path) for name, system, path in zip(mission.agents, each, found.paths, strict=True)}
    total = sum(robot.cost for robot in robots.values())
    notes = [
        "No words hold in every order of the robots; these hold under the plan's precedences: every team word that keeps them satisfies "
        f"the formula. The search reached {found.reached:,} states of all robots together."
    ]
    if mission.planner.objective == "sum":
        return Assignment(
            robots, total, max(0.0, total - TIES), True, 1, (*notes, *systems.unclear()), precedences=found.precedences
        )
    notes.append("With precedences the plan has the smallest sum of costs; its dearest robot may not be the cheapest.")
    dearest = max(robot.cost for robot in robots.values())
    least = max(0.0, total / len(robots) - TIES)
    return Assignment(robots, dearest, least, False, 1, (*notes, *systems.unclear()), precedences=found.precedences)


def _asked(mission: Mission, systems: Sequence[TransitionSystem]) -> Formula:
    """Return the formula over what these systems can show: what nobody ever shows is false.

    With few regions that is the mission's own formula, whatever is shown.

    Raises:
        TooLarge: It speaks of more names than conditions on letters can be made of.
    """
    if len(mission.all_regions) <= FEW:
        return mission.formula
    shown = {name for system in systems for label in system.labels for name in label}
    asked = mission.formula.substitute(dict.fromkeys(mission.all_regions.keys() - shown, FALSE))
    if (used := len(asked.names())) > MOST_NAMES:
        hint = "`!free` speaks of all regions at once; name those that are meant instead."
        raise TooLarge("The formula speaks of", used, "regions and propositions", MOST_NAMES, hint)
    return asked


def _sizes(systems: list[TransitionSystem], automata: Sequence[Automaton], found: PlanningOutcome) -> Iterator[str]:
    """Say, for a team, how many states were reached beside how many the product of all robots has."""
    if len(systems) > 1 and found.run is not None:
        size = math.prod(len(a.edges) for a in automata) * math.prod(len(system.labels) for system in systems)
        many = f"{size:,}" if size < 1_000_000 else f"{Decimal(size):.1e}"
        yield f"The search reached {found.run.reached:,} states of the team automaton; the product of all robots has {many}."


def _assignment(
    mission: Mission, systems: list[TransitionSystem], found: PlanningOutcome, bound: float, exhausted: bool
) -> Assignment:
    """Return what the robots do; `bound` and `exhausted` are of a search for the cheapest bottleneck, if any."""
    assert found.run is not None
    robots = {
        name: itinerary(system, path) for name, system, path in zip(mission.agents, systems, found.run.paths, strict=True)
    }
    total, bottleneck = sum(robot.cost for robot in robots.values()), max(robot.cost for robot in robots.values())
    least = total if found.stopped is None else max(0.0, found.bound - TIES)
    notes: list[str] = []
    if found.tried > 1:
        notes.append(f"{found.tried} plans were tried; the cheaper ones hold in some orders of the robots, but not in all.")
    if found.stopped is not None:
        notes.append(f"{found.stopped.shortage} This plan holds in every order of the robots; a cheaper one may exist.")
    if mission.planner.objective == "sum" or len(robots) == 1:
        return Assignment(robots, total, least, found.stopped is None, found.tried, tuple(notes))
    if not exhausted:
        notes.append(
            "Finding the cheapest dearest robot takes too many states; a plan whose dearest robot costs less may exist."
        )
    return Assignment(robots, bottleneck, bottleneck if exhausted else bound, exhausted, found.tried, tuple(notes))


def _no_plan(
    mission: Mission, systems: Systems, each: list[TransitionSystem], asked: Formula, found: PlanningOutcome
) -> Unsatisfiable:
    """Return the error that says why there is no plan."""
    from ltlplan.search.refusals.no_plan import no_plan

    order: list[tuple[str, Word]] = []
    if found.first is not None:
        names, words = tuple(mission.agents), [word_along(s, p) for s, p in zip(each, found.first.paths, strict=True)]
        order = [(names[i], words[i]) for i in found.refused or range(len(names))]
    return no_plan(mission, systems, each, asked, order, _cheapest)


def itinerary(system: TransitionSystem, path: tuple[int, ...]) -> Itinerary:
    """Read visits, actions, word and cost off a path of a robot's system."""
    log = _followed(system, path)
    return Itinerary(log.visits, word_along(system, path), None, path_cost(system, path), log.stops)


def path_cost(system: TransitionSystem, path: tuple[int, ...]) -> float:
    """Return the sum of the costs along a path; a letter that is read once more where the robot is costs nothing."""
    total = 0.0
    for source, target in itertools.pairwise(path):
        if source != target:
            total += min(cost for node, cost in system.edges[source] if node == target)
    return total


def word_along(system: TransitionSystem, path: tuple[int, ...]) -> Word:
    """Return the labels along a path, without immediate repetitions."""
    return Word(tuple(system.labels[node] for node in path)).compressed()


def visits_of(system: TransitionSystem, path: tuple[int, ...]) -> list[Visit]:
    """Return the visits that a path makes, in the order in which they begin, with their actions."""
    return list(_followed(system, path).visits)


def _followed(system: TransitionSystem, path: tuple[int, ...]) -> VisitLog:
    log = VisitLog()
    previous: Node | None = None
    rests: tuple[str, Point | None] | None = None
    for index in path:
        node = system.nodes[index]
        new = log.enter(node.regions)
        at = None if node.flying else (node.place, node.position)
        # an end that is no region's middle is flown to as the last point, and is a stop only in a region that is new
        if at not in (None, rests) and (node.position is None or previous is None or new):
            log.stop(node.place)
        rests = at
        if previous is not None and previous.internal != node.internal:
            change = (previous.internal, node.internal)
            log.act(next(a for a in system.actions if (a.source, a.target) == change and a.at in node.regions))
        previous = node
    return log


def _assign_lasso(mission: Mission, systems: Systems, system: TransitionSystem, budget: Budget) -> Assignment:
    """Plan one robot's infinite trace; as many laps count as are flown."""
    automata = conjunct_automata(_asked(mission, [system]), "infinite", budget=budget)
    run = cheapest_lasso(system, automata, weight=mission.spec.repeat, budget=budget)
    if run is None:
        from ltlplan.search.refusals.relaxation import relaxed
        from ltlplan.search.refusals.unsatisfiable_cores import explain

        def possible(parts: Sequence[Formula], worlds: Sequence[TransitionSystem]) -> bool:
            return _lasso_exists(parts, worlds[0], budget)

        raise _NoWords(lambda: relaxed(mission, explain(mission, systems, [system], feasible=possible), _cheapest))
    laps = mission.spec.repeat
    run, exact, certain = _improved(system, automata, run, laps, budget)
    if acts_at_rest(system, run.cycle):
        automata = [*automata, *conjunct_automata(comes_anew(system), "infinite", budget=budget)]
        run = cheapest_lasso(system, automata, weight=laps, budget=budget)
        if run is None:
            raise Unsatisfiable(
                "The formula can be kept for ever only by actions to and fro inside one region, where the robot would rest. A lap is "
                "flown: it comes to its regions anew. Let the formula allow the robot to leave the region in each lap, or make the "
                "actions in two regions."
            )
        run, exact, certain = _improved(system, automata, run, laps, budget)
    (name,) = mission.agents
    robot = lasso_itinerary(system, run.prefix, run.cycle, laps)
    if certain:
        return Assignment({name: robot}, robot.cost, robot.cost, complete=True, tried=1)
    note = "The cheapest round of the planning automaton" if exact else "The best round found within the budget of states"
    least = _least_lasso(system, automata, run, laps, budget)
    return Assignment({name: robot}, robot.cost, least, False, 1, (f"{note}; a cheaper word was not ruled out.",))


def _improved(
    system: TransitionSystem, automata: Sequence[Automaton], run: LassoRun, laps: int, budget: Budget
) -> tuple[LassoRun, bool, bool]:
    """Return a lasso that is as cheap or cheaper, whether the first was the cheapest round, and whether this is the cheapest word."""
    exact = run.bound >= run.prefix_cost + laps * run.cycle_cost - TIES
    certain = exact and all(map(closes_at_once, automata))
    if not certain:
        run, certain = improve_lasso(system, automata, run, weight=laps, states=min(budget.states, WORD_STATES))
        certain = certain and exact
    return run, exact, certain


def _assign_team_laps(mission: Mission, systems: Systems, each: list[TransitionSystem], budget: Budget) -> Assignment:
    """Plan a team's laps; as many count as are flown."""
    asked, longest = _asked(mission, each), mission.planner.objective == "longest"
    parts = parts_of(mission, asked)
    if parts is not None:
        shared = share_out(mission, each, parts, budget, longest=longest)
        if shared is None:
            raise _NoWords(lambda: _no_team_laps(mission, systems, each, budget))
        found = TeamLasso(shared.prefixes, shared.laps, None, shared.least, shared.least is not None, shared.lassos)
        notes = [f"The parts of the formula were shared out, by {shared.lassos:,} lassos of single robots."]
    else:
        product = plan_team_lasso(mission, each, asked, budget)
        if product is None:
            raise _NoWords(lambda: _no_team_laps(mission, systems, each, budget))
        found = product
        notes = [f"The search reached {found.reached:,} places of the team's product, in which one robot flies at a time."]
    robots, waits = team_itineraries(each, found, mission.spec.repeat), team_meetings(each, found)
    if waits:
        notes.append("Robots wait for each other within each lap, as the formula asks.")
    total, least = sum(robot.cost for robot in robots.values()), found.least
    if longest:
        total = max(robot.cost for robot in robots.values())
        if parts is None:
            notes.append("Laps have the smallest sum of costs; the dearest robot may not be the cheapest.")
            least = None if least is None else least / len(robots)
    complete = least is not None and total <= least + 2 * TIES
    if not complete and not longest:
        notes.append(
            "The cheapest laps of robots that fly one at a time." if found.exact else "A cheaper lap was not ruled out."
        )
    return Assignment(robots, total, least, complete, 1, (*notes, *systems.unclear()), tuple(waits))


def _no_team_laps(
    mission: Mission, systems: Systems, each: list[TransitionSystem], budget: Budget
) -> Unsatisfiable | Infeasible:
    """Return the error that says why there are no laps."""
    from ltlplan.search.refusals.relaxation import relaxed
    from ltlplan.search.refusals.unsatisfiable_cores import explain

    def possible(parts: Sequence[Formula], worlds: Sequence[TransitionSystem]) -> bool:
        if len(worlds) < len(each) and any(part.counts for part in parts):
            return False  # what is said of all robots says nothing of some of them
        try:
            if (shared := parts_of(mission, all_of(parts))) is not None:
                return share_out(mission, worlds, shared, budget, longest=False) is not None
            return team_lasso_exists(mission, worlds, all_of(parts), budget, together=False)
        except (TooLarge, Infeasible):
            return True  # not known to be impossible

    asked, waits = _asked(mission, each), False
    if parts_of(mission, asked) is None:
        try:
            waits = not reads_letters(mission, asked) or team_lasso_exists(mission, each, asked, budget, together=True)
        except TooLarge:
            waits = True
    if waits:
        return Infeasible(
            "No laps were found in which one robot flies at a time while the others rest, in regions or at their starts. Others may exist, "
            "in which robots hover outside all regions for one another, or are read in a lap where they only rest: these are not planned. Give such "
            "a place a region of its own, or let the formula come true in flight."
        )
    return relaxed(mission, explain(mission, systems, each, feasible=possible), _cheapest)


def _least_lasso(
    system: TransitionSystem, automata: Sequence[Automaton], run: LassoRun, laps: int, budget: Budget
) -> float | None:
    """Return a lower bound on all infinite words: what the conjuncts ask for whose automata forget all but the last letter.

    Of these a lap of the word is a round of the product, so that a bound on rounds is one on words.
    """
    forgetful = [automaton for automaton in automata if closes_at_once(automaton)]
    if not forgetful:
        return None
    relaxed = run if len(forgetful) == len(automata) else cheapest_lasso(system, forgetful, weight=laps, budget=budget)
    return None if relaxed is None else max(0.0, relaxed.bound - TIES)


def _lasso_exists(parts: Sequence[Formula], system: TransitionSystem, budget: Budget) -> bool:
    from ltlplan.search.lassos.lasso import lasso_exists

    try:
        return lasso_exists(system, conjunct_automata(all_of(parts), "infinite", budget=budget), budget=budget)
    except TooLarge:
        return True  # not known to be impossible


def lasso_itinerary(system: TransitionSystem, prefix: tuple[int, ...], cycle: tuple[int, ...], laps: int) -> Itinerary:
    """Read an infinite path: visits of prefix and one lap, and the word, turned so that the cycle begins with a visit.

    Args:
        system: What the robot can do.
        prefix: Nodes before the cycle.
        cycle: Nodes of one lap.
        laps: How many laps count.

    Raises:
        InternalError: The cycle changes internal states for ever inside one region, which no robot flies.
    """
    cycle = tuple(node for node, after in zip(cycle, (*cycle[1:], cycle[0]), strict=True) if node != after) or cycle[:1]
    path, labels = (*prefix, *cycle), system.labels
    entering = [i for i in range(len(cycle)) if _enters(system, path, len(prefix) + i, cycle)]
    if not entering:  # the cycle stays where it is
        letters = stutter_free(labels[node] for node in path)
        visits = tuple(visits_of(system, path))
        hover = tuple(dict.fromkeys(system.labels[node] for node in cycle))
        if len(hover) > 1:  # internal changes for ever, inside one region
            raise InternalError("A cycle of actions inside one region is not flown.")
        return Itinerary(visits, Word(letters[:-1], (letters[-1],)), len(visits), path_cost(system, path))
    turn = entering[0]
    prefix, cycle = (*prefix, *cycle[:turn]), (*cycle[turn:], *cycle[:turn])
    before = visits_of(system, prefix)
    lap = visits_of(system, (*prefix, *cycle))[len(before) :]
    cost = path_cost(system, (*prefix, cycle[0]))
    path_cost_of_lap = path_cost(system, (*cycle, cycle[0]))
    word = Word(stutter_free(labels[node] for node in prefix), stutter_free(labels[node] for node in cycle))
    return Itinerary((*before, *lap), word, len(before), cost + laps * path_cost_of_lap)


def _enters(system: TransitionSystem, path: tuple[int, ...], index: int, cycle: tuple[int, ...]) -> bool:
    previous = path[index - 1] if index > 0 else cycle[-1]
    if index == len(path) - len(cycle):
        previous = cycle[-1]
    return system.nodes[previous].flying and not system.nodes[path[index]].flying
