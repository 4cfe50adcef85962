"""`ltlplan automaton`: show the automaton of a formula, or the transition systems of a mission."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

if TYPE_CHECKING:
    from ltlplan.logic.automaton import Automaton
    from ltlplan.logic.conjunction import Conjunction
    from verify.data import Mission

from ltlplan.commands.support.options import JsonOption

Format = Literal["hoa", "dot", "svg", "json"]
View = Literal["formula", "robot", "environment", "agent", "planning"]


def command(
    source: Annotated[
        str,
        typer.Argument(
            metavar="FORMULA|MISSION",
            help="LTL such as 'F a & G(b -> c)', a mission file, or the name of a shipped mission.",
            show_default=False,
        ),
    ],
    kind: Annotated[Format, typer.Option("--format", help="Automata format, Graphviz, picture, or JSON.")] = "hoa",
    view: Annotated[
        View, typer.Option("--show", help="The formula's automaton, or a mission's systems R, E, A and product P.")
    ] = "formula",
    trace: Annotated[
        Literal["finite", "infinite"] | None,
        typer.Option("--trace", help="Words that end, or infinite ones (default: the mission's own; finite for a formula)."),
    ] = None,
    form: Annotated[
        Literal["deterministic", "small"],
        typer.Option("--form", help="For finite words: deterministic, or a small nondeterministic automaton."),
    ] = "deterministic",
    json: JsonOption = False,
) -> None:
    """Print the automaton that accepts just what a formula allows, or draw a mission's transition systems."""
    from ltlplan.commands.support.terminal import print_json

    kind = "json" if json else kind
    mission = _mission(source)
    if view == "formula":
        _show_formula(source if mission is None else mission, kind, trace, form)
        return
    from verify.data import BadInput

    if mission is None:
        raise BadInput(f"`--show {view}` needs a mission; {source!r} is a formula. For it, `--show formula` is all there is.")
    if kind == "hoa":
        kind = "dot"
    if kind == "json":
        print_json(_graph(mission, view))
        return
    typer.echo(_drawn(_system_dot(mission, view), kind), nl=False)


def _mission(source: str) -> Mission | None:
    """Return the mission that an argument names, or None where it is a formula."""
    from pathlib import Path

    from ltlplan.missions import load_mission, shipped_missions
    from verify.data.errors import did_you_mean

    shipped = shipped_missions()
    is_file = len(source) < 1000 and "\n" not in source and (source.endswith((".yaml", ".yml")) or Path(source).is_file())
    if is_file or source in shipped:
        return load_mission(source)
    if source.replace("-", "_").isidentifier() and (hint := did_you_mean(source, shipped)):
        typer.echo(f"note: '{source}' is read as a formula.{hint}", err=True)
    return None


def _show_formula(source: str | Mission, kind: Format, trace: Any, form: Any) -> None:
    from ltlplan.commands.support.terminal import print_json
    from ltlplan.logic.translation import translate
    from verify.data import parse_formula

    formula = parse_formula(source) if isinstance(source, str) else source.formula
    if not isinstance(source, str) and source.timed_parts:
        typer.echo("note: bounds in seconds are left out; an automaton reads words, which measure no time.", err=True)
    chosen = trace or ("finite" if isinstance(source, str) else source.spec.trace)
    automaton = translate(formula, chosen, form=form)
    if kind == "json":
        print_json({"formula": str(formula), **_plain(automaton)})
        return
    explicit = _explicit(automaton)
    typer.echo(explicit.to_hoa() if kind == "hoa" else _drawn(explicit.to_dot(), kind), nl=False)


def _explicit(automaton: Automaton | Conjunction) -> Automaton:
    from ltlplan.logic.automaton import Automaton

    return automaton if isinstance(automaton, Automaton) else automaton.multiplied()


def _plain(automaton: Automaton | Conjunction) -> dict[str, Any]:
    from ltlplan.logic.decomposition import decomposition_set

    explicit = _explicit(automaton)
    data: dict[str, Any] = {
        "trace": explicit.trace,
        "propositions": list(explicit.propositions),
        "initial": explicit.initial,
        "states": list(explicit.states),
        "accepting": sorted(explicit.accepting),
        "deterministic": explicit.deterministic,
        "edges": [
            {"source": source, "target": target, "guard": explicit.diagrams.text(guard)}
            for source, edges in enumerate(explicit.edges)
            for guard, target in edges
        ],
    }
    if explicit.trace == "finite" and explicit.deterministic:
        data["decomposition"] = sorted(decomposition_set(explicit))
    return data


def _drawn(dot: str, kind: Format) -> str:
    from ltlplan.systems.drawings import svg

    return svg(dot) if kind == "svg" else dot


def _system_dot(mission: Mission, view: View) -> str:
    from ltlplan.systems import drawings
    from ltlplan.systems.robot_systems import Systems

    if view == "robot":
        return drawings.robot_dot(mission)
    if view == "environment":
        return drawings.environment_dot(mission)
    system = Systems(mission).of(next(iter(mission.agents)))
    if view == "agent":
        return drawings.system_dot(system)
    from ltlplan.logic.translation import translate
    from ltlplan.systems.products import PlanningAutomaton

    return drawings.product_dot(PlanningAutomaton(system, translate(mission.formula, mission.spec.trace)))


def _graph(mission: Mission, view: View) -> dict[str, Any]:
    from ltlplan.logic.translation import translate
    from ltlplan.systems.products import PlanningAutomaton
    from ltlplan.systems.robot_systems import Systems
    from ltlplan.systems.transition_systems import environment_of, robot_graph

    if view == "robot":
        graph: Any = robot_graph(mission)
    elif view == "environment":
        graph = environment_of(mission).to_networkx()
    else:
        system = Systems(mission).of(next(iter(mission.agents)))
        if view == "agent":
            graph = system.to_networkx()
        else:
            graph = PlanningAutomaton(system, translate(mission.formula, mission.spec.trace)).to_networkx()
    return {
        "nodes": [{"id": node, **data} for node, data in graph.nodes(data=True)],
        "edges": [{"source": source, "target": target, **data} for source, target, data in graph.edges(data=True)],
    }
