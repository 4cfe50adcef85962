"""A mission's formula as nested lists, for the kernel."""

from __future__ import annotations

from typing import Any

from verify.data.language.counting import written_out
from verify.data.language.formula import FREE, Formula
from verify.data.language.relaxation import relaxed, without_idle_bounds
from verify.data.mission import Mission

Tree = list[Any]
"""Nested lists: an operator and what it joins."""


def formula_tree(mission: Mission) -> Tree:
    """Return what words have to satisfy as nested lists; what speaks of each robot or of numbers of them is written out for the team."""
    return tree_of(relaxed(without_idle_bounds(written_out(mission.written, tuple(mission.agents)))))


def tree_of(formula: Formula) -> Tree:
    """Return a formula, without next and written out for a team, as nested lists; a chain of one junction is one list."""
    done: dict[int, Tree] = {}
    waiting: list[tuple[Formula, bool]] = [(formula, False)]
    while waiting:
        node, ready = waiting.pop()
        if ready:
            parts = [done[id(part)] for part in node.arguments]
            done[id(node)] = _joined(node, parts)
        elif id(node) not in done:
            waiting.append((node, True))
            waiting += [(part, False) for part in node.arguments]
    return done[id(formula)]


def _joined(node: Formula, parts: list[Tree]) -> Tree:
    match node.operator:
        case "name":
            plain: Tree = ["free"] if node.name == FREE else ["name", node.name]
            return ["robot", node.robot, plain] if node.robot else plain
        case "count":
            assert node.bound is not None
            return ["count", node.bound[1], parts[0]]
        case "&" | "|":
            return [node.operator, *(one for part in parts for one in (part[1:] if part[0] == node.operator else [part]))]
        case _:
            return [f"{node.operator}{node.bounds}", *parts]
