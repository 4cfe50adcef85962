"""A formula for people who write it: in words, the names that it may use, and its automaton as a drawing.

The drawing is made here rather than by Graphviz, which a service cannot count on, and so that the page can point at a state.
"""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.conjunction import conjunct_automata, conjuncts
from verify.data import Formula, Letter, Mission, parse_formula
from verify.data.language.formula import FREE

MOST_STATES = 16
"""States up to which an automaton is drawn: a person reads no more beside a formula."""

OPERATORS: Mapping[str, str] = {
    "F": "at some time",
    "G": "at all times",
    "U": "until, and it must come",
    "W": "until, or for ever",
    "R": "releases: until both hold, or for ever",
    "M": "until both hold, and they must",
    "!": "not",
    "&": "and",
    "|": "or",
    "xor": "either, not both",
    "->": "implies",
    "<->": "exactly when",
    "true": "holds always",
    "false": "holds never",
}
"""What may be typed beside names, and what it says."""

_PLAIN = frozenset({"name", "true", "false"})
_INFIX: Mapping[str, str] = {
    "&": "{a} and {b}",
    "|": "{a} or {b}",
    "xor": "either {a} or {b}, not both,",
    "->": "if {a}, then {b}",
    "<->": "{a} exactly when {b}",
    "U": "{a} until {b}, which must come",
    "W": "{a} until {b}, or to the end",
    "R": "{b} until {a} too, or to the end",
    "M": "{b} until {a} too, which must come",
}
_NESTED: Mapping[tuple[str, str], str] = {("G", "F"): "again and again", ("F", "G"): "from some time on always"}
_PREFIX: Mapping[str, str] = {
    "F": "at some time",
    "G": "always",
    "X": "at the next letter",
    "X[!]": "at the next letter, which must come,",
}
_DEEPEST = 40


def in_words(mission: Mission) -> tuple[str, ...]:
    """Return a mission's formula as sentences, one for each part that must hold; none where it asks for a sequence."""
    if mission.spec.formula is None:
        return ()
    return tuple(_capital(_say(part, mission, 0)) + "." for part in parse_formula(mission.spec.formula).conjuncts())


def _say(formula: Formula, mission: Mission, depth: int) -> str:
    if depth > _DEEPEST:
        return f"`{formula}`"
    operator = formula.operator
    if operator == "name":
        return _say_name(formula.name, mission)
    if operator in ("true", "false"):
        return "anything" if operator == "true" else "nothing"
    if operator == "!":
        inner = formula.arguments[0]
        said = _say(inner, mission, depth + 1)
        return f"not {said}" if inner.operator in _PLAIN else f"it is not so that ({said})"
    if len(formula.arguments) == 1:
        (inner,) = formula.arguments
        word = _NESTED.get((operator, inner.operator))
        if word is not None:  # again and again p: one step deeper
            inner = inner.arguments[0]
        said = _say(inner, mission, depth + 1)
        begins = word or _PREFIX[operator]
        return f"{begins} {said}" if inner.operator in _PLAIN or inner.operator == "!" else f"{begins}: {said}"
    left, right = (_bracketed(argument, formula, mission, depth) for argument in formula.arguments)
    return _INFIX[operator].format(a=left, b=right)


def _bracketed(argument: Formula, parent: Formula, mission: Mission, depth: int) -> str:
    said = _say(argument, mission, depth + 1)
    plain = argument.operator in _PLAIN or (argument.operator == parent.operator and parent.operator in ("&", "|"))
    literal = argument.operator == "!" and argument.arguments[0].operator in _PLAIN
    return said if plain or literal else f"({said})"


def _say_name(name: str, mission: Mission) -> str:
    if name == FREE:
        return "in free flight"
    return f"in {name}" if name in mission.all_regions else name


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def known_names(mission: Mission) -> dict[str, str]:
    """Return what a mission's formula may name, and what each is."""
    names = dict.fromkeys(mission.hoops, "hoop") | dict.fromkeys(mission.regions, "region")
    names |= dict.fromkeys(sorted(mission.internal_propositions), "internal state")
    return {**names, FREE: "in no region"}


def part_automata(mission: Mission) -> tuple[tuple[Formula, Automaton], ...]:
    """Return each part of a formula that must hold, with its automaton; the formula's own is their product.

    Parts are what a person reads: three automata of two states say more than one of eight.

    Raises:
        TooLarge: One is larger than a budget.
        MissingEngine: Spot is not installed.
    """
    parts = tuple(dict.fromkeys(conjuncts(mission.formula)))
    return tuple(zip(parts, conjunct_automata(mission.formula, mission.spec.trace), strict=True))


def automaton_states(automaton: Automaton, letters: Sequence[tuple[float, Letter]]) -> list[tuple[float, tuple[int, ...]]]:
    """Return the states that an automaton can be in over time.

    Args:
        automaton: The automaton.
        letters: (time in s, letter that is read then), in order of time.

    Returns:
        (time in s, states) from before the first letter on; no state from where nothing can be accepted any more.
    """
    at = frozenset({automaton.initial})
    seen: list[tuple[float, tuple[int, ...]]] = [(0.0, tuple(at))]
    for time, letter in letters:
        at = frozenset(target for state in at for target in automaton.successors(state, letter))
        if tuple(sorted(at)) != seen[-1][1]:
            seen.append((time, tuple(sorted(at))))
    return seen


@dataclass(frozen=True, slots=True)
class _Place:
    x: float
    y: float


_DOWN, _RADIUS, _EDGE, _LETTER = 86.0, 15.0, 58.0, 6.7
_LONGEST_GUARD = 34


def automaton_svg(automaton: Automaton) -> str:
    """Return a drawing whose nodes carry `data-state`, in the page's colours; all text in it is escaped.

    Args:
        automaton: With at most `MOST_STATES` states.
    """
    longest = max((len(_shown(automaton.diagrams.text(guard))) for edges in automaton.edges for guard, _ in edges), default=1)
    across = max(110.0, longest * _LETTER + 46)
    places = _places(automaton, across)
    side = max(40.0, longest * _LETTER / 2 + 6)
    width = max(place.x for place in places) + side
    height = max(place.y for place in places) + 26
    parts: list[str] = []
    initial = places[automaton.initial]
    parts.append(_arrow(f"M{initial.x - 40:.0f} {initial.y:.0f}L{initial.x - _RADIUS - 2:.0f} {initial.y:.0f}"))
    labels: list[str] = []
    for source, edges in enumerate(automaton.edges):
        for guard, target in edges:
            path, at = _edge(places[source], places[target], across)
            parts.append(_arrow(path))
            labels.append(_label(automaton.diagrams.text(guard), at))
    for state, place in enumerate(places):
        twice = f'<circle r="{_RADIUS - 3:g}"/>' if state in automaton.accepting else ""
        parts.append(
            f'<g class="node{" accepting" if twice else ""}" data-state="{state}" transform="translate({place.x:.0f} {place.y:.0f})">'
            f'<circle r="{_RADIUS:g}"/>{twice}<text>{state}</text></g>'
        )
    return (
        f'<svg class="automaton" viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}" height="{height:.0f}" role="img" '
        f'aria-label="Automaton with {len(places)} states">{"".join(parts)}{"".join(labels)}</svg>'
    )


def _places(automaton: Automaton, across: float) -> list[_Place]:
    """Place states in columns by how many letters lead there at least, in each column by where their arrows come from."""
    depth = {automaton.initial: 0}
    waiting = [automaton.initial]
    for state in waiting:  # grows while it is walked
        for _, target in automaton.edges[state]:
            if target not in depth:
                depth[target] = depth[state] + 1
                waiting.append(target)
    columns: list[list[int]] = [[] for _ in range(max(depth.values()) + 1)]
    for state in automaton.states:
        columns[depth.get(state, 0)].append(state)
    tallest = max(map(len, columns))
    places: dict[int, _Place] = {}

    def before(state: int) -> float:
        return _mean([places[s].y for s in places if any(target == state for _, target in automaton.edges[s])])

    for index, column in enumerate(columns):
        top = _EDGE + (tallest - len(column)) * _DOWN / 2
        for row, state in enumerate(sorted(column, key=before)):
            places[state] = _Place(max(50.0, across / 2 - 16) + index * across, top + row * _DOWN)
    return [places[state] for state in automaton.states]


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values) if values else 0.0


def _edge(a: _Place, b: _Place, across: float) -> tuple[str, _Place]:
    """Return an arrow's path and where its label stands."""
    if a == b:
        path = f"M{a.x - 7:.1f} {a.y - _RADIUS + 1:.1f}C{a.x - 22:.1f} {a.y - 42:.1f} {a.x + 22:.1f} {a.y - 42:.1f} {a.x + 8:.1f} {a.y - _RADIUS:.1f}"
        return path, _Place(a.x, a.y - 37)
    dx, dy = b.x - a.x, b.y - a.y
    length = (dx * dx + dy * dy) ** 0.5
    ux, uy = dx / length, dy / length
    far = max(0.0, length / across - 1.2)
    bend = 15.0 + 40.0 * far  # long arrows pass around what lies between, and back arrows run on the other side
    mx, my = (a.x + b.x) / 2 - uy * -bend, (a.y + b.y) / 2 + ux * -bend
    start = _towards(a, _Place(mx, my), _RADIUS)
    end = _towards(b, _Place(mx, my), _RADIUS + 2)
    at = _Place((a.x + 2 * mx + b.x) / 4, (a.y + 2 * my + b.y) / 4)
    return f"M{start.x:.1f} {start.y:.1f}Q{mx:.1f} {my:.1f} {end.x:.1f} {end.y:.1f}", at


def _towards(a: _Place, b: _Place, distance: float) -> _Place:
    length = max(((b.x - a.x) ** 2 + (b.y - a.y) ** 2) ** 0.5, 1e-9)
    return _Place(a.x + (b.x - a.x) / length * distance, a.y + (b.y - a.y) / length * distance)


def _arrow(path: str) -> str:
    """Return a line with its head, drawn as a second short path at its end."""
    numbers = [float(n) for n in path.replace("M", " ").replace("L", " ").replace("Q", " ").replace("C", " ").split()]
    x, y = numbers[-2:]
    px, py = numbers[-4:-2]
    length = max(((x - px) ** 2 + (y - py) ** 2) ** 0.5, 1e-9)
    ux, uy = (x - px) / length, (y - py) / length
    left, right = (x - 8 * ux + 3.5 * uy, y - 8 * uy - 3.5 * ux), (x - 8 * ux - 3.5 * uy, y - 8 * uy + 3.5 * ux)
    head = f"M{x:.1f} {y:.1f}L{left[0]:.1f} {left[1]:.1f}L{right[0]:.1f} {right[1]:.1f}Z"
    return f'<path class="edge" d="{path}"/><path class="head" d="{head}"/>'


def _label(guard: str, at: _Place) -> str:
    return f'<text class="guard" x="{at.x:.1f}" y="{at.y:.1f}"><title>{html.escape(guard)}</title>{html.escape(_shown(guard))}</text>'


def _shown(guard: str) -> str:
    return guard if len(guard) <= _LONGEST_GUARD else guard[: _LONGEST_GUARD - 1] + "…"
