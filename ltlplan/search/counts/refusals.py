"""Why no plan keeps a formula that counts robots: the parts of it that cannot hold together."""

from __future__ import annotations

from collections.abc import Sequence

from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.logic.conjunction import conjunct_automata, conjuncts
from ltlplan.search.counts.planning import plan_counts
from ltlplan.search.refusals.unsatisfiable_cores import NoPlan
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Mission
from verify.data.language.counting import atoms

_STATES = 20_000


def no_counted_plan(mission: Mission, systems: Sequence[TransitionSystem], kinds: Sequence[str], asked: Formula) -> NoPlan:
    """Return the error that says which parts of the formula cannot hold together.

    Args:
        mission: Whose formula cannot be met.
        systems: One for each robot.
        kinds: As for `plan_counts`.
        asked: The formula, written out.
    """
    core = list(dict.fromkeys(conjuncts(asked)))
    for part in list(core):
        others = [other for other in core if other != part]
        if others and not _possible(others, systems, kinds):
            core = others
    reasons = [
        *_too_many(mission),
        "Robots move one after another or together, and each waits in its region for others where that helps.",
    ]
    return NoPlan([str(part) for part in core], reasons)


def _possible(parts: Sequence[Formula], systems: Sequence[TransitionSystem], kinds: Sequence[str]) -> bool:
    formula = parts[0]
    for part in parts[1:]:
        formula = Formula("&", (formula, part))
    try:
        automata = conjunct_automata(formula, "finite")
        return plan_counts(systems, kinds, automata, atoms(formula), Budget(states=_STATES)) is not None
    except TooLarge:
        return True  # not known to be impossible


def _too_many(mission: Mission) -> list[str]:
    """Name counts that ask for more robots than there are."""
    robots = len(mission.agents)
    found: list[str] = []
    for node in mission.written.nodes():
        if node.bound is not None:
            sign, number = node.bound
            if number + (sign == ">") > robots and sign in (">=", ">", "=="):
                found.append(f"`{node}` asks for more robots than the mission has: {robots}.")
    return list(dict.fromkeys(found))
