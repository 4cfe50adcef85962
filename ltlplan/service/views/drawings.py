"""An automaton as a drawing: states in columns from left to right, arrows, and labels that stand clear of states and of each other.

It is made here rather than by Graphviz, which a service cannot count on, and so that the page can point at a state.
"""

from __future__ import annotations

import html
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import networkx

from ltlplan.logic.automaton import Automaton

MOST_STATES = 16
"""States up to which an automaton is drawn: a person reads no more beside a formula."""

_DOWN, _RADIUS, _EDGE, _LETTER, _LINE = 96.0, 15.0, 58.0, 6.7, 14.0
_LOOP = 35.0
"""px from the middle of a state to the top of its loop."""
_LONGEST_GUARD = 34
_ALONG = (0.5, 0.4, 0.6, 0.3, 0.7, 0.22, 0.78)
"""Where on its arrow a label may stand, the best first."""
_ASIDE = (9.0, -9.0, 16.0, -16.0, 23.0, -23.0, 37.0, -37.0)
"""How far from its arrow, px, on the side to which that is bent."""


@dataclass(frozen=True, slots=True)
class _Place:
    x: float
    y: float


@dataclass(frozen=True, slots=True)
class _Box:
    """Box that a state or a label covers."""

    left: float
    top: float
    right: float
    bottom: float

    def covers(self, other: _Box) -> float:
        """Return how much of another box this one covers, in square pixels."""
        across = min(self.right, other.right) - max(self.left, other.left)
        down = min(self.bottom, other.bottom) - max(self.top, other.top)
        return max(0.0, across) * max(0.0, down)


@dataclass(frozen=True, slots=True)
class _Arrow:
    """A curve with one control point, or a loop.

    Attributes:
        path: As SVG writes it.
        guard: Its label.
        points: Where the label's middle may be, the best first.
    """

    path: str
    guard: str
    points: tuple[_Place, ...]


def automaton_svg(automaton: Automaton) -> str:
    """Return a drawing whose nodes carry `data-state`, in the page's colours; all text in it is escaped.

    Args:
        automaton: With at most `MOST_STATES` states.
    """
    guards = [automaton.diagrams.text(guard) for edges in automaton.edges for guard, _ in edges]
    across = max(110.0, max((len(_shown(guard)) for guard in guards), default=1) * _LETTER + 56)
    places = _places(automaton, across)
    arrows = [
        _arrow(places, source, target, automaton.diagrams.text(guard), across)
        for source, edges in enumerate(automaton.edges)
        for guard, target in edges
    ]
    loops = {state for state, edges in enumerate(automaton.edges) for _, target in edges if target == state}
    nodes = [
        _Box(place.x - _RADIUS, place.y - (_LOOP if state in loops else _RADIUS), place.x + _RADIUS, place.y + _RADIUS)
        for state, place in enumerate(places)
    ]
    boxes = _labels(arrows, nodes)
    initial = places[automaton.initial]
    left = min(initial.x - 42, *(box.left for box in (*nodes, *boxes))) - 4
    top = min(box.top for box in (*nodes, *boxes)) - 4
    width = max(box.right for box in (*nodes, *boxes)) + 4 - left
    height = max(box.bottom for box in (*nodes, *boxes)) + 10 - top
    drawn = [_line(f"M{initial.x - 40:.0f} {initial.y:.0f}L{initial.x - _RADIUS - 2:.0f} {initial.y:.0f}")]
    drawn += [_line(arrow.path) for arrow in arrows]
    drawn += [_node(state, place, accepting=state in automaton.accepting) for state, place in enumerate(places)]
    drawn += [_label(arrow.guard, box) for arrow, box in zip(arrows, boxes, strict=True)]
    return (
        f'<svg class="automaton" viewBox="{left:.0f} {top:.0f} {width:.0f} {height:.0f}" width="{width:.0f}" height="{height:.0f}" role="img" '
        f'aria-label="Automaton with {len(places)} states">{"".join(drawn)}</svg>'
    )


def _places(automaton: Automaton, across: float) -> list[_Place]:
    """Place states in columns so that arrows go to the right but for loops, in each column by where their arrows come from."""
    columns: dict[int, list[int]] = {}
    for state, column in enumerate(_columns(automaton)):
        columns.setdefault(column, []).append(state)
    tallest = max(map(len, columns.values()))
    places: dict[int, _Place] = {}

    def before(state: int) -> float:
        return _mean([places[s].y for s in places if any(target == state for _, target in automaton.edges[s])])

    for index, states in sorted(columns.items()):
        top = _EDGE + (tallest - len(states)) * _DOWN / 2
        for row, state in enumerate(sorted(states, key=before)):
            places[state] = _Place(index * across, top + row * _DOWN)
    return [places[state] for state in automaton.states]


def _columns(automaton: Automaton) -> list[int]:
    """Return each state's column: after all from which it is reached, where these are not reached from it; within a loop by steps."""
    graph = networkx.DiGraph()
    graph.add_nodes_from(automaton.states)
    graph.add_edges_from((source, target) for source, edges in enumerate(automaton.edges) for _, target in edges)
    loops = networkx.condensation(graph)
    first: dict[int, int] = {}
    column = dict.fromkeys(automaton.states, 0)
    for loop in networkx.topological_sort(loops):
        members: set[int] = loops.nodes[loop]["members"]
        come_from = [column[s] for s in graph if s not in members and any(t in members for t in graph.successors(s))]
        first[loop] = 1 + max(come_from, default=-1)
        entered = {t for s in graph if s not in members for t in graph.successors(s) if t in members}
        begin = ({automaton.initial} & members) or entered or {min(members)}
        steps = networkx.multi_source_dijkstra_path_length(graph.subgraph(members), sorted(begin), weight=None)
        for state in members:
            column[state] = first[loop] + int(steps[state])
    return [column[state] for state in automaton.states]


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values) if values else 0.0


def _arrow(places: Sequence[_Place], source: int, target: int, guard: str, across: float) -> _Arrow:
    a, b = places[source], places[target]
    if source == target:
        path = f"M{a.x - 7:.1f} {a.y - _RADIUS + 1:.1f}C{a.x - 22:.1f} {a.y - 42:.1f} {a.x + 22:.1f} {a.y - 42:.1f} {a.x + 8:.1f} {a.y - _RADIUS:.1f}"
        return _Arrow(path, guard, tuple(_Place(a.x, a.y - _LOOP - up) for up in (7.0, 7.0 + _LINE)))
    dx, dy = b.x - a.x, b.y - a.y
    length = (dx * dx + dy * dy) ** 0.5
    ux, uy = dx / length, dy / length
    between = any(  # a state on the way is passed around
        state not in (source, target)
        and 0 < (c.x - a.x) * ux + (c.y - a.y) * uy < length
        and abs((c.y - a.y) * ux - (c.x - a.x) * uy) < 2 * _RADIUS
        for state, c in enumerate(places)
    )
    bend = 16.0 + 34.0 * max(0.0, length / across - 1.2) + (60.0 if between else 0.0)
    control = _Place((a.x + b.x) / 2 + uy * bend, (a.y + b.y) / 2 - ux * bend)
    start, end = _towards(a, control, _RADIUS), _towards(b, control, _RADIUS + 2)
    path = f"M{start.x:.1f} {start.y:.1f}Q{control.x:.1f} {control.y:.1f} {end.x:.1f} {end.y:.1f}"
    side = -1.0 if ux >= 0 else 1.0
    curve = [_on_curve(start, control, end, share) for share in _ALONG]
    return _Arrow(path, guard, tuple(_Place(point.x, point.y + side * aside) for aside in _ASIDE for point in curve))


def _on_curve(a: _Place, control: _Place, b: _Place, t: float) -> _Place:
    u, v, w = (1 - t) * (1 - t), 2 * t * (1 - t), t * t
    return _Place(u * a.x + v * control.x + w * b.x, u * a.y + v * control.y + w * b.y)


def _towards(a: _Place, b: _Place, distance: float) -> _Place:
    length = max(((b.x - a.x) ** 2 + (b.y - a.y) ** 2) ** 0.5, 1e-9)
    return _Place(a.x + (b.x - a.x) / length * distance, a.y + (b.y - a.y) / length * distance)


def _labels(arrows: Sequence[_Arrow], nodes: Sequence[_Box]) -> list[_Box]:
    """Return where labels stand, loops' first, each where it covers least of states and of labels that stand already."""
    found: dict[int, _Box] = {}
    for index in sorted(range(len(arrows)), key=lambda index: len(arrows[index].points)):
        taken = (*nodes, *found.values())
        found[index] = min(_choices(arrows[index]), key=lambda box: sum(map(box.covers, taken)))
    return [found[index] for index in range(len(arrows))]


def _choices(arrow: _Arrow) -> Iterator[_Box]:
    half = len(_shown(arrow.guard)) * _LETTER / 2 + 2
    for at in arrow.points:
        yield _Box(at.x - half, at.y - _LINE / 2, at.x + half, at.y + _LINE / 2)


def _line(path: str) -> str:
    """Return a line with its head, drawn as a second short path at its end."""
    numbers = [float(n) for n in path.replace("M", " ").replace("L", " ").replace("Q", " ").replace("C", " ").split()]
    x, y = numbers[-2:]
    px, py = numbers[-4:-2]
    length = max(((x - px) ** 2 + (y - py) ** 2) ** 0.5, 1e-9)
    ux, uy = (x - px) / length, (y - py) / length
    left, right = (x - 8 * ux + 3.5 * uy, y - 8 * uy - 3.5 * ux), (x - 8 * ux - 3.5 * uy, y - 8 * uy + 3.5 * ux)
    head = f"M{x:.1f} {y:.1f}L{left[0]:.1f} {left[1]:.1f}L{right[0]:.1f} {right[1]:.1f}Z"
    return f'<path class="edge" d="{path}"/><path class="head" d="{head}"/>'


def _node(state: int, place: _Place, *, accepting: bool) -> str:
    twice = f'<circle r="{_RADIUS - 3:g}"/>' if accepting else ""
    return (
        f'<g class="node{" accepting" if accepting else ""}" data-state="{state}" transform="translate({place.x:.0f} {place.y:.0f})">'
        f'<circle r="{_RADIUS:g}"/>{twice}<text>{state}</text></g>'
    )


def _label(guard: str, box: _Box) -> str:
    x, y = (box.left + box.right) / 2, (box.top + box.bottom) / 2 + 4
    return f'<text class="guard" x="{x:.1f}" y="{y:.1f}"><title>{html.escape(guard)}</title>{html.escape(_shown(guard))}</text>'


def _shown(guard: str) -> str:
    return guard if len(guard) <= _LONGEST_GUARD else guard[: _LONGEST_GUARD - 1] + "…"
