"""A flown team's belief against all team words of what was flown, and the gate against random flights."""

import itertools
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ltlplan
from ltlplan.online_mtac.possible_states import admits, at_start, can_finish, follow
from tests.strategies import formulas

EMPTY = frozenset()


class Table:
    """A translated automaton with the container that a belief asks for."""

    def __init__(self, formula):
        self.automaton = ltlplan.translate(formula, trace="finite")
        self.initial = self.automaton.initial

    @property
    def accepting(self):
        return self

    def __contains__(self, state):
        return self.automaton.is_accepting(state)

    def successor(self, state, letter):
        return self.automaton.successor(state, letter)


def run(table, letters):
    state = table.initial
    for letter in letters:
        state = table.successor(state, letter)
    return state


def states_by_all_words(table, first, events):
    """States after every team word, each robot's letter kept by name: no letter counts as read without being read."""
    names, held = list(first), dict(first)

    def closed(pairs):
        found, stack = set(pairs), list(pairs)
        while stack:
            state, unread = stack.pop()
            for name in names:
                pair = (table.successor(state, held[name]), unread - {name})
                if pair not in found:
                    found.add(pair)
                    stack.append(pair)
        return found

    pairs = closed({(table.initial, frozenset(names))})
    for name, letter in events:
        ended = {(state, unread) for state, unread in pairs if name not in unread}
        held[name] = letter
        pairs = closed({(state, unread | {name}) for state, unread in ended})
    return {state for state, unread in pairs if not unread}


letters_ = st.sampled_from([frozenset(), frozenset({"a"}), frozenset({"b"}), frozenset({"c"})])
flights = st.lists(st.tuples(st.sampled_from(["x", "y"]), letters_), max_size=6)


@given(formulas(size=6), letters_, letters_, flights)
@settings(max_examples=80, deadline=None)
def test_a_belief_accepts_just_what_all_team_words_accept(formula, first, second, events):
    table = Table(formula)
    belief = at_start(table, {"x": first, "y": second}, reading="own")
    for name, letter in events:
        if letter != belief.held[name]:
            belief = belief.after(name, letter)
    kept, held = [], {"x": first, "y": second}
    for name, letter in events:
        if letter != held[name]:
            kept.append((name, letter))
            held[name] = letter
    by_force = states_by_all_words(table, {"x": first, "y": second}, kept)
    assert belief.accepts() == all(state in table.accepting for state in by_force)


@given(formulas(size=5), st.lists(letters_, min_size=1, max_size=4), st.lists(letters_, min_size=1, max_size=4))
@settings(max_examples=60, deadline=None)
def test_serial_flights_agree_with_concatenated_words(formula, first, second):
    # nobody reads the other while he flies: one reading among those that a belief stands for
    table = Table(formula)
    belief = at_start(table, {"x": first[0], "y": second[0]}, reading="own")
    for name, word in (("x", first), ("y", second)):
        for before, letter in itertools.pairwise(word):
            if letter != before:
                belief = belief.after(name, letter)
    if belief.accepts():
        assert run(table, [*first, *second]) in table.accepting


MISSIONS = [
    ("F a & F b & G(b -> c)", {"x": [{"a"}, set()], "y": [{"c"}, {"b", "c"}, set()]}),
    ("F a & F c & G(a -> (!c U b)) & G(c -> (!a U d))", {"x": [{"a"}, {"b"}, set()], "y": [{"c"}, {"d"}, set()]}),
    ("!F(a & F(b & F a))", {"x": [{"a"}, set()], "y": [{"b"}, set()]}),
    ("F a & F b & F c & G(a -> F b)", {"x": [{"a"}, {"b"}, set()], "y": [{"c"}, set()], "z": [{"a"}, {"b"}, set()]}),
]


@pytest.mark.parametrize(("formula", "plan"), MISSIONS)
@pytest.mark.parametrize("seed", range(6))
def test_flights_through_the_gate_finish_and_are_accepted(formula, plan, seed):
    """Robots want to go at random times; the gate lets passages begin, letters then come in any order."""
    draw = random.Random(seed)
    table = Table(formula)
    ahead = {name: [frozenset(letter) for letter in letters] for name, letters in plan.items()}
    belief = at_start(table, dict.fromkeys(plan, EMPTY), reading="own")
    assert can_finish(belief, ahead)
    inside = {}
    for _ in range(200):
        if not any(ahead.values()) and not any(inside.values()):
            break
        name = draw.choice(list(plan))
        if inside.get(name):
            belief = belief.after(name, inside[name].pop(0))
        elif ahead[name]:
            # a passage: letters up to and with the next free flight
            end = ahead[name].index(EMPTY) + 1
            chains = {n: letters for n, letters in inside.items() if letters} | {name: ahead[name][:end]}
            rest = {n: ahead[n][end:] if n == name else ahead[n] for n in plan}
            if admits(belief, chains, rest):
                inside[name], ahead[name] = ahead[name][:end], ahead[name][end:]
    assert not any(ahead.values()), "somebody waited for ever"
    assert not any(inside.values())
    assert belief.accepts()


def test_the_gate_keeps_apart_what_fails_side_by_side():
    # words a b and c d pass one after another; a c b d fails
    formula, plan = MISSIONS[1]
    table = Table(formula)
    belief = at_start(table, {"x": EMPTY, "y": EMPTY}, reading="own")
    x, y = ([frozenset(letter) for letter in plan[name]] for name in ("x", "y"))
    assert admits(belief, {"x": x[:1]}, {"x": x[1:], "y": y})
    after = belief.after("x", x[0])
    assert not admits(after, {"y": y[:1]}, {"x": x[1:], "y": y[1:]})
    assert can_finish(after, {"x": x[1:], "y": y})
    assert not can_finish(follow(after, (("y", letter) for letter in y)), {"x": x[1:]}), "only x before y"


def test_joint_missions_read_unions():
    table = Table("F a & F b & G !(a & b)")
    belief = at_start(table, {"x": EMPTY, "y": EMPTY}, reading="joint")
    a, b = frozenset({"a"}), frozenset({"b"})
    assert admits(belief, {"x": [a, EMPTY]}, {"x": [], "y": [b, EMPTY]})
    assert not admits(belief, {"x": [a, EMPTY], "y": [b, EMPTY]}, {"x": [], "y": []})
    assert not belief.after("x", a).after("y", b).accepts()
    assert belief.after("x", a).after("x", EMPTY).after("y", b).accepts()


def test_events_of_one_instant_count_in_every_order():
    table = Table("!b U a")
    a, b = frozenset({"a"}), frozenset({"b"})
    belief = at_start(table, {"x": EMPTY, "y": EMPTY}, reading="own")
    # a is read for sure once x has left it; until then y's b may be read first
    assert belief.after("x", a).after("x", EMPTY).after("y", b).accepts()
    assert not belief.after("x", a).after("y", b).accepts()
    assert not belief.after_all({"x": a, "y": b}).accepts()
    left = belief.after("x", a)
    assert (
        left.after_all({"x": EMPTY, "y": b}).pairs
        == left.after("x", EMPTY).after("y", b).pairs | left.after("y", b).after("x", EMPTY).pairs
    )


def test_a_robot_that_joins_reads_its_letter_too():
    table = Table("G !a")
    belief = at_start(table, {"x": EMPTY}, reading="own")
    assert belief.at_once({"y": EMPTY}).accepts()
    assert not belief.at_once({"y": frozenset({"a"})}).accepts()
