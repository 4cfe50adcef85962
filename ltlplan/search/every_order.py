"""Fixed words of a team, held against every order in which its robots may be read or fly one after another."""

from __future__ import annotations

from collections.abc import Sequence

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.product_automaton import Task
from ltlplan.logic.transition_monoid import OrderCheck, TransitionMonoid
from ltlplan.search.joint.conjuncts import JointConjunct, WordEffects
from verify.data import Letter


def hold_in_every_order(automata: Sequence[Automaton], words: Sequence[Sequence[Letter]], *, joint: bool) -> bool:
    """Tell whether words satisfy all conjuncts in every order of the robots (the sequential property of the 2022 paper, Def. 4.5).

    Args:
        automata: One for each conjunct, of finite traces.
        words: One for each robot.
        joint: Whether a robot's letters are read together with what all others hold, or by themselves.

    Raises:
        TooLarge: There are too many different orders.
    """
    if joint:
        names = sorted({name for automaton in automata for name in automaton.propositions})
        bit = {name: 1 << i for i, name in enumerate(names)}
        masks = [[sum(bit.get(name, 0) for name in letter) for letter in word] for word in words]
        effects = [WordEffects(JointConjunct(automaton, bit), None) for automaton in automata]
        return all(effect.failing_order([effect.of(word) for word in masks]) is None for effect in effects)
    numbers: dict[Letter, int] = {}
    read = [[numbers.setdefault(letter, len(numbers)) for letter in word] for word in words]
    task = Task(automata, tuple(numbers))
    monoid = TransitionMonoid(task)
    return OrderCheck(task).failing_order([monoid.of(word) for word in read]) is None
