"""Checks of a mission while it is typed: errors where they stand, the formula in words, its automata, the world.

These functions are run by a worker, never by the process that serves; what they return is plain data.
"""

from __future__ import annotations

from typing import Any

from ltlplan.service.page.missions.mission_text import span_of, with_edges, with_value
from verify.data import BadInput, Mission, MissionError, parse_mission
from verify.data.language.formula_error import FormulaError
from verify.data.language.formula_reader import parse_formula
from verify.data.progress import Progress

Json = dict[str, Any]  # of any type: JSON nests


def check_text(text: str, report: Progress) -> Json:
    """Return what is to be said of a mission's text.

    Args:
        text: YAML as it is typed.
        report: Receives what is done.

    Returns:
        `faults`, each with `line`, `keys`, `message` and where it stands (`from`, `to`, offsets); of a sound mission also its
        `name`, `formula`, `words`, `names`, `automata` and `world`.
    """
    report("checking the mission", 0.0)
    try:
        mission = parse_mission(text)
    except MissionError as error:
        faults = [_fault(text, fault.keys, fault.line, fault.reason) for fault in error.faults]
        return {"faults": faults, "formula": _formula_in(text)}
    except BadInput as error:
        return {"faults": [_fault(text, (), None, str(error))], "formula": _formula_in(text)}
    return {"faults": [], **mission_view(mission)}


def mission_view(mission: Mission) -> Json:
    """Return what is shown of a sound mission."""
    from flight.pictures import scene
    from ltlplan.missions.notes import notes_of
    from ltlplan.service.views.formulas import OPERATORS, in_words, known_names
    from ltlplan.service.views.watching import automata_data, drawn, radii

    return {
        "name": mission.name,
        "formula": mission.spec.formula,
        "sequence": mission.sequence,
        "trace": mission.spec.trace,
        "team": mission.spec.team,
        "robots": len(mission.agents),
        "seed": mission.planner.seed,
        "method": mission.planner.method,
        "words": list(in_words(mission)),
        "notes": list(notes_of(mission)),
        "names": known_names(mission),
        "operators": dict(OPERATORS),
        "automata": automata_data(mission),
        "world": {**drawn(scene(mission, {})), "robots": list(mission.agents), "radii": radii(mission)},
    }


def change_formula(text: str, formula: str, report: Progress) -> str:
    """Return a mission's text with another formula.

    Args:
        text: YAML.
        formula: The new formula.
        report: Receives what is done.

    Raises:
        BadInput: The text is no mission to write a formula into.
    """
    report("writing the formula", 0.0)
    return with_value(text, ("spec", "formula"), formula)


def change_margin(text: str, margin: float, report: Progress) -> str:
    """Return a mission's text with another margin.

    Args:
        text: YAML.
        margin: m.
        report: Receives what is done.

    Raises:
        BadInput: The text is no mission to write a margin into.
    """
    report("writing the margin", 0.0)
    return with_value(text, ("margin",), margin)


def add_edges(text: str, edges: list[tuple[str, str]], report: Progress) -> str:
    """Return a mission's text with more edges.

    Args:
        text: YAML.
        edges: Pairs of regions.
        report: Receives what is done.

    Raises:
        BadInput: The text has no list of edges.
    """
    report("writing the edges", 0.0)
    return with_edges(text, edges)


def leave_out(text: str, part: str, report: Progress) -> str:
    """Return a mission's text without one part of its formula.

    Args:
        text: YAML.
        part: The part, as text.
        report: Receives what is done.

    Raises:
        BadInput: The text is no mission, or its formula has no such part.
    """
    report("writing the formula", 0.0)
    formula = _formula_in(text)
    if formula is None:
        raise BadInput("The mission has no formula to leave a part out of.")
    parts = parse_formula(formula).conjuncts()
    wanted = parse_formula(part)
    kept = [each for each in parts if each != wanted]
    if len(kept) == len(parts):
        raise BadInput(f"`{part}` is no part of the formula `{formula}` that stands by itself.")
    joined = " & ".join(f"({each})" if each.operator in _LOOSE and len(kept) > 1 else str(each) for each in kept) or "true"
    return with_value(text, ("spec", "formula"), joined)


_LOOSE = frozenset({"|", "->", "<->", "xor"})


def _formula_in(text: str) -> str | None:
    """Return the formula that stands in a text, which may be at fault elsewhere."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    span = span_of(text, ("spec", "formula"))
    if span is None:
        return None
    try:
        value: object = YAML(typ="safe", pure=True).load(text[slice(*span)])
    except YAMLError:
        return None
    return value if isinstance(value, str) else None


def _fault(text: str, keys: tuple[str | int, ...], line: int | None, reason: str) -> Json:
    start, end = _place(text, keys, line)
    fault: Json = {"line": line, "keys": ".".join(map(str, keys)), "message": reason, "from": start, "to": end}
    formula = _formula_in(text)
    if keys != ("spec", "formula") or formula is None:
        return fault
    low, high = _in_formula(text, formula)
    fault |= {"message": reason.split("\n", 1)[0], "in_formula": [low, high]}
    if formula in text[start:end]:
        begin = start + text[start:end].index(formula)
        fault |= {"from": begin + low, "to": begin + high}
    return fault


def _place(text: str, keys: tuple[str | int, ...], line: int | None) -> tuple[int, int]:
    """Return where a fault stands: its value or key, else its line."""
    span = span_of(text, keys)
    lines = text.splitlines(keepends=True)
    if line is None or not 1 <= line <= len(lines):
        return span or (0, len(lines[0].rstrip()) if lines else 0)
    begin = sum(map(len, lines[: line - 1]))
    content = lines[line - 1].rstrip()
    if span is not None and begin <= span[0] <= begin + len(content):
        return span
    return begin + len(content) - len(content.lstrip()), begin + len(content)


def _in_formula(text: str, formula: str) -> tuple[int, int]:
    """Return where in a formula the fault is: the name or sign that is wrong."""
    try:
        parsed = parse_formula(formula)
    except FormulaError as error:
        at = max(0, min(error.position, len(formula) - 1))
        return at, at + 1
    known = _names_in(text)
    for node in parsed.walk():
        if node.operator == "name" and node.name not in known:
            return node.position, node.position + len(node.name)
    return 0, len(formula)


def _names_in(text: str) -> set[str]:
    """Return the names that a text defines for its formula, as far as they can be read."""
    try:
        mission = parse_mission(with_value(text, ("spec", "formula"), "true"))
    except BadInput:
        return set()
    from ltlplan.service.views.formulas import known_names

    return set(known_names(mission))
