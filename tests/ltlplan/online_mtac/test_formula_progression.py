"""What is left of a formula: right for every way to read what was flown, by brute force over readings."""

import itertools
from functools import reduce
from random import Random

import pytest

from ltlplan.mtac.agent_moves import World
from ltlplan.mtac.decomposable_task import Reader
from ltlplan.online_mtac.formula_progression import formula_left, progressed
from tests.helpers.few import few_of
from tests.helpers.words.plain_team_words import holds
from tests.helpers.words.random_counts import random_counting_formula
from tests.ltlplan.mtac.test_offline import small
from verify import check_word
from verify.data import parse_formula
from verify.data.language.counting import written_out

RESTS = ([set()], [{"a"}, set(), {"b"}], [{"c"}, {"a"}, set()], [{"b"}, set()], [set(), {"a"}, {"c"}, set(), {"b"}])


@pytest.mark.parametrize("letters", [[], [{"a"}], [set(), {"b"}], [{"a"}, {"c"}, set()]])
@pytest.mark.parametrize(
    "text", ["F a & F b", "G(a -> F c)", "!b U a", "(a | b) W c", "a R (b | !c)", "F(a & F b) xor G !c", "b M !a"]
)
def test_progression_asks_of_the_rest_what_the_formula_asks_of_the_whole(text, letters):
    formula = parse_formula(text)
    read = [frozenset(letter) for letter in letters]
    left = reduce(progressed, read, formula)
    for rest in ([set()], [{"a"}, {"b"}], [{"c"}, {"a"}, set()], [{"b"}], [set(), {"a", "c"}]):
        whole = [*letters, *rest]
        assert bool(check_word(left, rest)) == bool(check_word(formula, whole)), (str(left), whole)


@few_of(4, "seed", range(12))
def test_progression_asks_the_same_of_formulas_that_count(seed):
    rng, names = Random(seed), ("quad0", "quad1", "quad2")
    formula = random_counting_formula(rng, 6, names)
    asked = written_out(formula, names)
    mission = small("F a", regions={"a": (-2, 0, 1), "b": (1.5, 0, 1)}, agents=[(0, -1, 1), (0, 1, 1), (0, 0, 1)], team="joint")
    reader = Reader(World(mission.model_copy(update={"spec": mission.spec.model_copy(update={"formula": str(formula)})})))
    word = [{name: frozenset(x for x in "ab" if rng.random() < 0.5) for name in names} for _ in range(6)]
    for cut in range(1, len(word)):
        left = reduce(progressed, map(reader.team_letter, word[:cut]), asked)
        assert holds(left, word[cut:]) == holds(formula, word), cut
        state = reader.initial
        for held in word:
            state = reader.successor(state, reader.team_letter(held))
        assert (state in reader.accepting) == holds(formula, word)


def readings(first, shown, most):
    """Every team word so far of at most so many readings in which each letter was read before it ended, with who is still to be read."""
    names = list(first)
    moments = [dict(first)]
    for _, events in shown:
        moments.append({**moments[-1], **events})
    found = set()

    def go(word, moment, unread):
        if len(word) > most:
            return
        if moment == len(moments) - 1:
            found.add((tuple(word), unread))
        for name in names:
            go([*word, moments[moment][name]], moment, unread - {name})
        if moment + 1 < len(moments):
            changing = set(shown[moment][1])
            if not unread & changing:
                go(word, moment + 1, unread | changing)

    go([], 0, frozenset(names))
    return found


@few_of(4, "text", ["F a & F b", "!b U a", "G(a -> F c)", "G(a -> (a W c))", "F(a & F b)", "(!a U c) | F b"])
@few_of(
    2,
    ("changes", "most"),
    [
        ((), 3),
        ((("quad0", {"a"}),), 4),
        ((("quad0", {"a"}), ("quad0", set())), 5),
        ((("quad0", {"a"}), ("quad1", {"b"})), 6),
        ((("quad0", {"a"}), ("quad1", {"c"}), ("quad0", set())), 7),
    ],
)
def test_what_is_left_is_what_every_reading_leaves(text, changes, most):
    mission = small(text, regions={"a": (-2, 0, 1), "b": (1.5, 0, 1), "c": (-2, 1.5, 1)}, agents=[(0, -1, 1), (0, 1, 1)])
    first = dict.fromkeys(mission.agents, frozenset())
    shown = [(float(i), {name: frozenset(letter)}) for i, (name, letter) in enumerate(changes)]
    reader = Reader(World(mission))
    left = formula_left(mission.formula, reader, first, shown, reading="own")
    words = readings(first, shown, most)
    assert words
    # repeating a letter changes no verdict, so few words stand for all; all of them leave what is left together
    kept = {tuple(key for key, _ in itertools.groupby(word)) for word, _ in words}
    held = dict(first)
    for _, events in shown:
        held.update(events)
    # a robot's present letter is read in the rest too: it is the first letter of what is left
    for begin, rest in itertools.product(itertools.permutations(held.values()), RESTS):
        whole = all(check_word(text, [*map(set, word), *map(set, begin), *rest]) for word in kept)
        asked = bool(check_word(left, [*map(set, begin), *rest]))
        assert whole or not asked, (str(left), begin, rest)
        assert asked or not whole or "!" in str(left), "more is asked only where letters are to be shown anew"
    # nor need it be read: what is left asks for it anew where it was read, so that no flight rests on its being read twice
    ends = {(tuple(key for key, _ in itertools.groupby(word)), unread) for word, unread in words}
    for rest in RESTS:
        if all(check_word(left, [*map(set, begin), *rest]) for begin in itertools.permutations(held.values())):
            for (word, unread), order in itertools.product(ends, itertools.permutations(held)):
                still = [set(held[name]) for name in order if name in unread]
                assert check_word(text, [*map(set, word), *still, *rest]), (str(left), word, still, rest)


def test_a_letter_that_is_held_and_was_read_is_asked_for_anew():
    text = "F(a & F b)"
    mission = small(text, regions={"a": (-2, 0, 1), "b": (1.5, 0, 1)}, agents=[(0, -1, 1), (0, 1, 1)])
    first = dict.fromkeys(mission.agents, frozenset())
    shown = [(0.0, {"quad1": frozenset("b")}), (0.1, {"quad0": frozenset("a")}), (0.2, {"quad0": frozenset()})]
    left = formula_left(mission.formula, Reader(World(mission)), first, shown, reading="own")
    assert check_word("F b", [{"b"}, set()])
    assert not check_word(left, [{"b"}, set()]), "who holds b was read before a, and need not be read again"
    assert check_word(left, [{"b"}, set(), {"b"}])


def test_reading_a_letter_again_makes_nothing_longer():
    formula = parse_formula("G(a -> F c) & F b & (a W b)")
    once = progressed(formula, frozenset("a"))
    assert reduce(progressed, [frozenset("a")] * 20, once) == progressed(once, frozenset("a"))
