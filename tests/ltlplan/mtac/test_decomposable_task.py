"""The formula as robots read it: where it divides, seen from now, and letters that may be read at any time."""

import itertools

from hypothesis import given, settings
from hypothesis import strategies as st

from ltlplan.logic.automaton import DEAD, Automaton
from ltlplan.logic.conjunction import Conjunction
from ltlplan.logic.decomposition import decomposes, decomposes_from
from ltlplan.logic.determinisation import intersection
from ltlplan.logic.translation import translate
from ltlplan.mtac.agent_moves import World
from ltlplan.mtac.decomposable_task import Reader
from ltlplan.online_mtac.possible_states import at_start
from tests.helpers.few import given_few
from tests.helpers.words.actions import actions_of_words
from tests.ltlplan.mtac.test_offline import ROW, small
from tests.strategies import formulas
from verify.data import Formula


def automaton_of(formula):
    found = translate(formula)
    assert isinstance(found, Automaton)
    return found


def divides_by_all_words(automaton, does, begun, states):
    """Def. 4.5 from `begun`, word by word."""

    def after(action, at):
        return frozenset(DEAD if s == DEAD else action[s] for s in at)

    def accepted(at):
        return DEAD not in at and at <= automaton.accepting

    first = {after(f, begun) for f in does if accepted(after(f, states))}
    second = [g for g in does if after(g, begun) == states]
    return all(accepted(after(g, at)) for at in first for g in second)


@given_few(6, 40, formulas(size=4), st.data())
def test_where_a_mission_divides_seen_from_any_states_against_all_words(formula: Formula, data):
    automaton = automaton_of(formula)
    does = actions_of_words(automaton)
    if does is None:
        return
    for begun, state in itertools.product(automaton.states, repeat=2):
        one, other = frozenset({begun}), frozenset({state})
        assert decomposes_from(automaton, one, other) == divides_by_all_words(automaton, does, one, other)
        if begun == automaton.initial:
            assert decomposes_from(automaton, one, other) == decomposes(automaton, state)
    several = st.frozensets(st.sampled_from(automaton.states), min_size=1, max_size=3)
    begun, states = data.draw(several), data.draw(several)
    assert decomposes_from(automaton, begun, states) == divides_by_all_words(automaton, does, begun, states)


@settings(max_examples=25, deadline=None)
@given(formulas(size=3), formulas(size=3))
def test_a_conjunction_divides_where_its_product_does(first: Formula, second: Formula):
    parts = [automaton_of(first), automaton_of(second)]
    whole, product = Conjunction(parts), intersection(*parts)
    # the same states by number; those from which nothing is accepted have none
    number, waiting = {whole.initial: product.initial}, [whole.initial]
    for at in waiting:
        for letter in whole.letters:
            after = whole.successor(at, letter)
            if after != DEAD and after not in number:
                number[after] = product.successor(number[at], letter)
                waiting.append(after)
    alive = [state for state in waiting if number[state] != DEAD]
    for one, other in itertools.islice(itertools.product(alive, repeat=2), 60):
        expected = decomposes_from(product, frozenset({number[one]}), frozenset({number[other]}))
        assert decomposes_from(whole, frozenset({one}), frozenset({other})) == expected


def test_the_present_state_and_the_start_divide_differently():
    until = automaton_of("(!b U a) & F b")
    done = until.successor(until.initial, {"a"})
    assert not decomposes(until, done)
    assert decomposes_from(until, frozenset({done}), frozenset({done}))
    # before a is done, the states after it are not to be divided
    assert not decomposes_from(until, frozenset({until.initial}), frozenset({done}))
    assert not decomposes_from(until, frozenset({until.initial}), frozenset({DEAD}))


@given_few(4, 25, formulas(size=4))
def test_letters_said_to_commute_do_and_no_others(formula: Formula):
    reader = reader_of(str(formula))
    states = {reader.initial}
    waiting = list(states)
    for state in waiting:
        for letter in reader.shown:
            after = reader.successor(state, letter)
            if after not in states:
                states.add(after)
                waiting.append(after)

    def read(state, *letters):
        for letter in letters:
            state = reader.successor(state, letter)
        return state

    for letter in reader.shown:
        plainly = all(read(s, letter, x) == read(s, x, letter) for s in states for x in reader.shown)
        assert reader.commutes(letter) == (plainly and all(read(s, letter, letter) == read(s, letter) for s in states))


@given_few(10, 60, formulas(size=4), st.data())
def test_what_readings_lead_to_with_the_shortcut_against_plain_enumeration(formula: Formula, data):
    reader = reader_of(str(formula))
    robots = ["x", "y", "z"][: data.draw(st.integers(2, 3))]
    shown = st.sampled_from(reader.shown)
    held = {robot: data.draw(shown) for robot in robots}
    belief = at_start(reader, held, reading="own")
    plain = {(reader.initial, frozenset(held.items()))}
    for _ in range(data.draw(st.integers(0, 4))):
        robot, letter = data.draw(st.sampled_from(robots)), data.draw(shown)
        # what a robot has shown must have been read by the time it shows something else
        plain = {pair for pair in plainly_read(reader, plain, held.values()) if not any(name == robot for name, _ in pair[1])}
        plain = {(state, unread | {(robot, letter)}) for state, unread in plain}
        held[robot] = letter
        belief = belief.after(robot, letter)
    over = {state for state, unread in plainly_read(reader, plain, held.values()) if not unread}
    # the shortcut may leave out readings that end where others end, so what counts is what all readings lead to
    assert belief.settled == over
    assert belief.accepts() == all(state in reader.accepting for state in over)


def plainly_read(reader, pairs, held):
    """All (state, letters not read yet, by robot) that any number of readings of held letters leads to."""
    seen, waiting = set(pairs), list(pairs)
    for state, unread in waiting:
        for letter in set(held):
            after = reader.successor(state, letter)
            # reading a letter once is reading it for one robot that holds it, or for all of them
            owners = [item for item in unread if item[1] == letter]
            for count in range(len(owners) + 1):
                for read in itertools.combinations(owners, count):
                    pair = (after, unread - set(read))
                    if pair not in seen:
                        seen.add(pair)
                        waiting.append(pair)
    return seen


def reader_of(formula):
    return Reader(World(small(formula, regions=ROW, agents=[(0, -1, 1)])))
