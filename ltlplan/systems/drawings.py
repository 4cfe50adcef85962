"""Drawings of automata and transition systems in Graphviz's language, and as SVG where Graphviz is installed.

The systems are drawn as in Figs. 7 to 9 of the 2022 paper: the robot's internal states R, the environment E, and their
product A with the actions that are possible only where the guard holds.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from typing import TYPE_CHECKING

from verify.data import BadInput, MissingEngine, Mission
from verify.data.language.word import show_letter

if TYPE_CHECKING:
    from ltlplan.systems.products import PlanningAutomaton
    from ltlplan.systems.transition_systems import TransitionSystem

SECONDS = 60.0
"""How long Graphviz may take for one drawing."""

MAX_NODES = 2000
"""Nodes up to which a drawing is made; a person could not read a larger one."""


def robot_dot(mission: Mission) -> str:
    """Return R (Fig. 7): internal states with their propositions; an arrow names the region that permits the action.

    Kinds of robots stand beside each other, each state under the name of its table.
    """
    lines = _head("robot")
    kinds = {mission.kind_of(agent): mission.robot_of(agent) for agent in mission.agents}
    for kind, robot in kinds.items():
        of = "" if kind is None else f"{kind}: "
        for state, names in robot.states.items():
            label = f"{of}{state}\n{show_letter(frozenset(names))}"
            lines.append(f"  {_text(of + state)} [label={_text(label)}];")
        lines.append(f'  "" -> {_text(of + robot.initial)};')
        lines += [f"  {_text(of + a.source)} -> {_text(of + a.target)} [label={_text(a.at)}];" for a in robot.actions]
    return "\n".join([*lines, "}"]) + "\n"


def environment_dot(mission: Mission) -> str:
    """Return E (Fig. 8): an arrow where a region can be visited next; one without heads where both ways are open."""
    from ltlplan.systems.transition_systems import environment_of

    environment = environment_of(mission)
    lines = _head("environment")
    lines += [f"  {_text(vertex)};" for vertex in environment.successors]
    lines.append(f'  "" -> {_text(environment.start)};')
    for vertex, targets in environment.successors.items():
        for target in targets:
            both = vertex in environment.successors.get(target, ())
            if target != vertex and not (both and target < vertex):
                lines.append(f"  {_text(vertex)} -> {_text(target)}{' [dir=none]' if both else ''};")
    return "\n".join([*lines, "}"]) + "\n"


def system_dot(system: TransitionSystem) -> str:
    """Return A (Fig. 9) with free flight: nodes carry the letters that they show, arrows the cost of the leg in m."""
    _readable(len(system.labels))
    lines = _head(system.robot or "system")
    for index, label in enumerate(system.labels):
        text = show_letter(label)
        if system.nodes:
            node = system.nodes[index]
            text = f"{'after ' if node.flying else ''}{node.place}, {node.internal}\n{text}"
        lines.append(
            f"  {index} [label={_text(text)}{', style=dashed' if system.nodes and system.nodes[index].flying else ''}];"
        )
    lines.append(f'  "" -> {system.initial};')
    for source, edges in enumerate(system.edges):
        for target, cost in edges:
            lines.append(f"  {source} -> {target}" + (f' [label="{cost:.2f}"];' if cost else ";"))
    return "\n".join([*lines, "}"]) + "\n"


def product_dot(product: PlanningAutomaton) -> str:
    """Return P (Def. 4.4): nodes are pairs of the automaton's state and what the robot does."""
    graph = product.to_networkx()
    _readable(graph.number_of_nodes())
    numbers = {state: index for index, state in enumerate(graph)}
    lines = _head(product.system.robot or "product")
    for state, data in graph.nodes(data=True):
        at, node = state
        place = product.system.nodes[node] if product.system.nodes else None
        where = str(node) if place is None else f"{'after ' if place.flying else ''}{place.place}, {place.internal}"
        shape = ", shape=doubleoctagon" if data["accepting"] else ""
        lines.append(f"  {numbers[state]} [label={_text(f'{at}: {where}')}{shape}];")
        if data["initial"]:
            lines.append(f'  "" -> {numbers[state]};')
    for source, target, cost in graph.edges(data="cost"):
        lines.append(f"  {numbers[source]} -> {numbers[target]}" + (f' [label="{cost:.2f}"];' if cost else ";"))
    return "\n".join([*lines, "}"]) + "\n"


def svg(dot: str) -> str:
    """Return a drawing as SVG.

    Raises:
        MissingEngine: Graphviz is not installed, or did not finish.
    """
    program = shutil.which("dot")
    if program is None:
        raise MissingEngine(
            "Drawing SVG needs Graphviz's `dot`, which is not installed (Debian: `apt install graphviz`). "
            "Use `--format dot` and draw it elsewhere."
        )
    try:
        done = subprocess.run([program, "-Tsvg"], input=dot, capture_output=True, text=True, timeout=SECONDS, check=True)
    except (subprocess.TimeoutExpired, subprocess.CalledProcessError) as error:
        raise MissingEngine(f"Graphviz could not draw this: {error}. Use `--format dot`.") from None
    return done.stdout


def _readable(nodes: int) -> None:
    if nodes > MAX_NODES:
        raise BadInput(f"A drawing of {nodes:,} nodes cannot be read; {MAX_NODES:,} is the most. Use `--format json`.")


def _head(name: str) -> list[str]:
    return [f"digraph {_text(name)} {{", '  rankdir=LR; "" [shape=point, label=""];']


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
