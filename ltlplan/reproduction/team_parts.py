"""Sections 2 to 5 of the 2022 paper: automata, transition systems, decomposition, the team automaton and its size."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.decomposition import decomposition_set
from ltlplan.logic.translation import translate
from ltlplan.missions import load_mission
from ltlplan.mtac.agent_moves import World
from ltlplan.mtac.decomposable_task import Reader
from ltlplan.reproduction.element import Element, Findings, Quantity, holds
from ltlplan.systems.products import PlanningAutomaton, walk
from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.transition_systems import environment_of, robot_graph
from verify import check_word
from verify.data import Letter, Word

FORMULA = "F loc1 & F loc2 & G(smoke -> carrying)"
"""Example 2's formula."""
LONGEST = 3
"""Letters of the words that are tried one by one."""


def _letters(names: Sequence[str]) -> list[Letter]:
    return [frozenset(chosen) for size in range(len(names) + 1) for chosen in itertools.combinations(names, size)]


def _words(letters: Iterable[Letter], longest: int) -> list[tuple[Letter, ...]]:
    known = list(letters)
    return [word for size in range(1, longest + 1) for word in itertools.product(known, repeat=size)]


def finite_automaton() -> Findings:
    """Compare the automaton of Example 2's formula with the checker's own semantics, word by word."""
    automaton, small = translate(FORMULA), translate(FORMULA, form="small")
    letters = _letters(("loc1", "loc2", "smoke", "carrying"))
    words = [Word(word) for word in _words(letters, 2)]
    words += [
        Word(word) for word in _words([frozenset(), frozenset({"loc1"}), frozenset({"loc2"}), frozenset({"smoke"})], LONGEST)
    ]
    expected = [bool(check_word(FORMULA, word)) for word in words]
    return Findings(
        (
            Quantity("states of the deterministic automaton", len(automaton.states), digits=0),
            Quantity("states of the small nondeterministic one", len(small.states), digits=0),
            holds(f"it accepts just the words that satisfy the formula, of {len(words)}", [automaton.accepts(word) for word in words] == expected),
            holds("so does the small one", [small.accepts(word) for word in words] == expected, "sigma |= phi iff q(T) in F"),
            Quantity("satisfying words among them", sum(expected), digits=0),
        )
    )  # fmt: skip


def finite_words() -> Findings:
    """Compare finite words with the paper's reading by *end*, with good prefixes, and with laps that are repeated."""
    words = [Word(word) for word in _words(_letters(("loc1", "smoke", "carrying")), 2)]
    finite, ended = "F loc1 & G(smoke -> carrying)", "F(loc1 & !end) & G(end | (smoke -> carrying)) & F end & G(end -> G end)"
    forever = [Word(word.prefix, (frozenset({"end"}),)) for word in words]
    same = [
        bool(check_word(finite, own)) == bool(check_word(ended, infinite)) for own, infinite in zip(words, forever, strict=True)
    ]
    co_safe, letters = "F loc1 & (!smoke U carrying)", _letters(("loc1", "smoke", "carrying"))
    good = [word for word in words if check_word(co_safe, word)]
    kept = all(check_word(co_safe, Word((*word.prefix, letter))) for word in good for letter in letters)
    published, prefix = "G(F hoop0 -> !hoop1 U hoop2 & F hoop1)", (frozenset[str](), frozenset({"hoop1"}), frozenset[str]())
    laps = [check_word(published, Word(prefix + (frozenset({"hoop2"}), frozenset[str]()) * count)) for count in range(1, 6)]
    return Findings(
        (
            holds(f"with *end* after them {len(words)} words mean the same as without it", all(same), "end holds from some letter on"),
            Quantity("satisfying words of a co-safe formula among them", len(good), digits=0),
            holds("each stays satisfying, whatever letter follows", kept, "sigma_f is a good prefix"),
            holds("(hoop1)(hoop2)^N satisfies the published formula for N = 1 to 5", all(laps), "sigma_f sigma_N"),
        )
    )  # fmt: skip


def robot_system() -> Findings:
    """Check R of the fire-fighting robots."""
    graph = robot_graph(load_mission("firefighting"))
    states = {name: sorted(data["propositions"]) for name, data in graph.nodes(data=True)}
    return Findings(
        (
            Quantity("states and their propositions", ", ".join(f"{name} {{{' '.join(shown)}}}" for name, shown in states.items()), paper="NO WATER, CARRYING"),
            Quantity("actions", ", ".join(f"{a} to {b} at {data['at']}" for a, b, data in graph.edges(data=True)), paper="NO WATER to CARRYING at WATER"),
            Quantity("initial state", next(name for name, data in graph.nodes(data=True) if data["initial"]), paper="NO WATER"),
        )
    )  # fmt: skip


def environment() -> Findings:
    """Check E of the fire-fighting scenario."""
    graph = environment_of(load_mission("firefighting")).to_networkx()
    into = sorted(graph.predecessors("loc2"))
    return Findings(
        (
            Quantity("vertices", ", ".join(sorted(graph.nodes)), paper="ROBOT, WATER, SMOKE, LOC1, LOC2"),
            Quantity("edges, both ways where robots may return", graph.number_of_edges(), digits=0),
            Quantity("loc2 is entered from", ", ".join(into), paper="SMOKE"),
        )
    )


def agent_system() -> Findings:
    """Check that A has the states and actions of the product of E and R."""
    mission = load_mission("firefighting")
    system = Systems(mission).of("quad0")
    nodes = [node for node in system.nodes if node.leg is None]
    hovers = {(node.place, node.internal) for node in nodes if not node.flying}
    acted = [
        (system.nodes[a], system.nodes[b])
        for a, edges in enumerate(system.edges)
        for b, _ in edges
        if system.nodes[a].internal != system.nodes[b].internal
    ]
    moves = {
        (a.entered, b.entered)
        for s, edges in enumerate(system.edges)
        for t, _ in edges
        for a, b in [(system.nodes[s], system.nodes[t])]
        if a.entered != b.entered
    }
    edges = environment_of(mission).successors
    shown = all(
        {"carrying"} & system.labels[index] == ({"carrying"} if node.internal == "carrying" else set())
        for index, node in enumerate(system.nodes)
    )
    return Findings(
        (
            Quantity("hovers in a region, in each internal state", len(hovers), paper="V x S", digits=0),
            holds("S_A is V x S", hovers == {(place, internal) for place in mission.all_regions for internal in mission.robot.states}),
            holds("actions of R are made in the region that permits them alone", all(a.place == b.place == "water" for a, b in acted) and bool(acted)),
            holds("each move follows an edge of E", all(b in edges[a] for a, b in moves), "(v, v') in E"),
            holds("labels are those of the place and of the internal state", shown),
            Quantity("nodes with free flight", len(system.nodes), digits=0),
        )
    )  # fmt: skip


def planning_automaton() -> Findings:
    """Walk P of one robot, and compare its accepting runs with the formula."""
    system, automaton = Systems(load_mission("firefighting")).of("quad0"), translate(FORMULA)
    planning = PlanningAutomaton(system, automaton)
    before: dict[tuple[int, int], tuple[int, int] | None] = dict.fromkeys(planning.initial())
    for state, following in walk(planning.initial(), planning.successors):
        for target, _ in following:
            before.setdefault(target, state)
    ends = [state for state in before if planning.is_accepting(state)]

    def word(state: tuple[int, int] | None) -> Word:
        letters: list[Letter] = []
        while state is not None:
            letters.append(system.labels[state[1]])
            state = before[state]
        return Word(tuple(reversed(letters)))

    rejected = [state for state in before if not planning.is_accepting(state)]
    return Findings(
        (
            Quantity("states reached", len(before), paper="at most |Q| |S_A|", digits=0),
            holds(
                "at most the automaton's states times the nodes of A", len(before) <= len(automaton.states) * len(system.labels)
            ),
            Quantity("accepting states", len(ends), digits=0),
            holds(
                "a run to each accepting state satisfies the formula", all(check_word(FORMULA, word(state)) for state in ends)
            ),
            holds("a run to any other state does not", not any(check_word(FORMULA, word(state)) for state in rejected)),
        )
    )


EXAMPLES = ("F loc1 & F loc2 & G(smoke -> carrying)", "F(a & F b)", "F a & F b & (!c U a)", "G(a -> F b)")
"""Formulas whose decomposition set is compared with all short words."""


def _brute(automaton: Automaton, state: int, words: Sequence[tuple[Letter, ...]]) -> bool:
    """Return whether eq. (8) holds in a state for all words of some: the second task's word, then the first's."""

    def after(begin: int, word: tuple[Letter, ...]) -> int:
        for letter in word:
            begin = automaton.successor(begin, letter)
        return begin

    firsts = [word for word in words if after(automaton.initial, word) == state]
    seconds = [word for word in words if automaton.is_accepting(after(state, word))]
    between = {after(automaton.initial, second) for second in seconds}
    return all(automaton.is_accepting(after(begin, first)) for begin in between for first in firsts)


def decomposition() -> Findings:
    """Compare decomposition sets with eq. (8), tried on all short words."""
    rows: list[Quantity] = []
    same = True
    for formula in EXAMPLES:
        automaton = translate(formula)
        assert isinstance(automaton, Automaton)
        words = [(), *_words(automaton.letters, LONGEST)]
        found = decomposition_set(automaton)
        same &= set(found) == {state for state in automaton.states if _brute(automaton, state, words)}
        rows.append(Quantity(f"{formula}: states in D", f"{len(found)} of {len(automaton.states)}"))
    return Findings(
        (*rows, holds(f"eq. (8) for all words of up to {LONGEST} letters, both orders", same, "for all permutations"))
    )


def team_size() -> Findings:
    """Count the nodes of the team automaton and of the full product."""
    mission = load_mission("firefighting")
    reader = Reader(World(mission))
    vertices = len(environment_of(mission).successors) * len(mission.robot.states)
    states = len(translate(mission.formula).states)
    linear = {count: count * states * vertices for count in (1, 2, 3)}
    return Findings(
        (
            Quantity("states of the automaton, |F|", states, digits=0),
            Quantity("states of a robot, |S_A|", vertices, digits=0),
            Quantity("nodes of T for three robots, N |F| |S_A|", linear[3], paper="linear in N", digits=0),
            Quantity("nodes of the full product, |F| |S_A|^N", states * vertices**3, paper="exponential in N", digits=0),
            Quantity("nodes of the full product for ten robots over T's", states * vertices**10 // (10 * linear[1]), digits=0),
            Quantity("letters that one robot can show", len(reader.shown), digits=0),
        )
    )


def experiment_settings() -> Findings:
    """Check the starts, formula and regions of the shipped mission against those of Sections 5.3 and 7."""
    mission = load_mission("firefighting")
    starts = [agent.start for agent in mission.agents.values()]
    radii = {radius for hoop in mission.hoops.values() for radius in hoop.radii or ()}
    return Findings(
        (
            Quantity("formula", mission.spec.formula or "", paper="F LOC1 & F LOC2 & G(SMOKE -> CARRYING)"),
            holds("three robots start at p1, p2 and p3", starts == [(1.0, -0.5, 0.8), (1.0, 0.0, 0.8), (1.0, 0.5, 0.8)], "(1, -0.5 | 0 | 0.5, 0.8)"),
            Quantity("a region counts within", max(radii), "m", "0.2 m"),
        )
    )  # fmt: skip


TEAM_PARTS: tuple[Element, ...] = (
    Element(
        id="2022-def-2.2", publication="2022", kind="definition", title="Section 2.1 and Definition 2.2: finite LTL and its automaton", shares="2022-def-2.2",
        says="A finite word satisfies the formula just if it leads the automaton from an initial to an accepting state.",
        differs="Finite words end by ending (LTLf), without a proposition *end*; the plan is searched on the deterministic automaton.",
        by=("ltlplan.logic.translation.translate", "verify.trace_checking.word_verdict.check_word"), compute=finite_automaton,
    ),
    Element(
        id="2022-section-2.1", publication="2022", kind="section", title="Section 2.1: *end*, good prefixes, repeated laps", shares="2022-def-2.2",
        says="A finite word is an infinite one on which *end* holds from some letter on. A good prefix suffices for co-safe formulas, and a part may be repeated N times.",
        differs="Missions need no *end*, and a name of that kind means a region; `spec.repeat` counts laps of infinite traces.",
        by=("verify.trace_checking.word_verdict.check_word",), compute=finite_words,
    ),
    Element(
        id="2022-def-4.1", publication="2022", kind="definition", title="Definition 4.1 and Fig. 7: robot transition system", also=("2022-fig-7",),
        says="A robot has states, actions between them and propositions; water turns NO WATER into CARRYING.", differs="",
        by=("ltlplan.systems.transition_systems.robot_graph",), compute=robot_system,
    ),
    Element(
        id="2022-def-4.2", publication="2022", kind="definition", title="Definition 4.2 and Fig. 8: environment transition system", also=("2022-fig-8",),
        says="Regions are vertices, and loc2 can be reached only through smoke.", differs="Edges not readable in the figure are ours.",
        by=("ltlplan.systems.transition_systems.environment_of",), compute=environment,
    ),
    Element(
        id="2022-def-4.3", publication="2022", kind="definition", title="Definition 4.3 and Fig. 9: agent transition system", also=("2022-fig-9",),
        says="A = E x R: a place and an internal state; an action needs its edge, its internal step and its condition.",
        differs="Free flight between regions is a node of its own, so that plans are made over the letters that are flown.",
        by=("ltlplan.systems.robot_systems.Systems",), compute=agent_system,
    ),
    Element(
        id="2022-def-4.4", publication="2022", kind="definition", title="Definition 4.4: planning automaton",
        says="P = F x A accepts only sequences that satisfy the formula.", differs="Only states that can be reached are made.",
        by=("ltlplan.systems.products.PlanningAutomaton",), compute=planning_automaton,
    ),
    Element(
        id="2022-def-4.5", publication="2022", kind="definition", title="Definition 4.5 and eq. (8): decomposition set", also=("2022-eq-8",),
        says="Two tasks are a decomposition if their words satisfy the formula in both orders.",
        differs="Decided exactly by reachability in pairs of states; the essential sequences of the literature accept states that they must not.",
        by=("ltlplan.logic.decomposition.decomposition_set",), compute=decomposition,
    ),
    Element(
        id="2022-section-5.2", publication="2022", kind="section", title="Definition 4.6 and Section 5.2: team automaton and complexity",
        also=("2022-def-4.6",),
        says="T is the union of the planning automata: linear in N, where the full product is exponential.",
        differs="T is walked and never built.",
        by=("ltlplan.mtac.agent_moves.World", "ltlplan.mtac.decomposable_task.Reader"), compute=team_size,
    ),
    Element(
        id="2022-example-2", publication="2022", kind="section", title="Example 2 and Section 7: formula, starts and regions",
        says="Three robots at given starts; a region counts within 0.2 m of its hoop.", differs="Hoop positions are ours.",
        by=("ltlplan.missions.load_mission",), compute=experiment_settings,
    ),
)  # fmt: skip
