"""A formula for people who write it: in words, the names that it may use, and its parts as automata (drawn by `drawings`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.conjunction import conjunct_automata, conjuncts
from verify.data import Formula, Letter, Mission, parse_formula
from verify.data.language.formula import COUNTING, FREE, decimal

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
    "count": "how many robots show it, as in count(dock) >= 2",
    "all": "of all robots",
    "some": "of some robot",
    "ever": "how many robots show it at some time, as in ever(dock) <= 1",
    "each": "for each robot, read of it alone",
    "true": "holds always",
    "false": "holds never",
}
"""What may be typed beside names, and what it says."""

_PLAIN = frozenset({"name", "true", "false", "count", "all", "some", "ever"})
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
    """Return a mission's formula as sentences, one for each part that must hold and then one for each that is wished for.

    Where it asks for a sequence there are none for that.
    """
    asked = () if mission.spec.formula is None else parse_formula(mission.spec.formula).conjuncts()
    wished = ((part.weight, _say(parse_formula(part.formula), mission, 0)) for part in mission.soft_parts)
    return (
        *(_capital(_say(part, mission, 0)) + "." for part in asked),
        *(f"Wished for, with weight {weight:g}: {said}." for weight, said in wished),
    )


def _say(formula: Formula, mission: Mission, depth: int) -> str:
    if depth > _DEEPEST:
        return f"`{formula}`"
    operator = formula.operator
    if operator == "name":
        said = _say_name(formula.name, mission)
        return f"{formula.robot} {said}" if formula.robot else said
    if operator in COUNTING:
        said = _say(formula.arguments[0], mission, depth + 1)
        such = "" if formula.arguments[0].operator in ("name", "!", "&", "|") else "such that "
        return f"for each robot: {said}" if operator == "each" else f"{_how_many(formula)} {such}{said}"
    if operator in ("true", "false"):
        return "anything" if operator == "true" else "nothing"
    if operator == "!":
        inner = formula.arguments[0]
        said = _say(inner, mission, depth + 1)
        return f"not {said}" if inner.operator in _PLAIN else f"it is not so that ({said})"
    if len(formula.arguments) == 1:
        (inner,) = formula.arguments
        if formula.window is not None:
            said = _say(inner, mission, depth + 1)
            return (
                f"{_when(formula)} {said}" if inner.operator in _PLAIN or inner.operator == "!" else f"{_when(formula)}: {said}"
            )
        word = _NESTED.get((operator, inner.operator)) if inner.window is None else None
        if word is not None:  # again and again p: one step deeper
            inner = inner.arguments[0]
        said = _say(inner, mission, depth + 1)
        begins = word or _PREFIX[operator]
        return f"{begins} {said}" if inner.operator in _PLAIN or inner.operator == "!" else f"{begins}: {said}"
    left, right = (_bracketed(argument, formula, mission, depth) for argument in formula.arguments)
    said = _INFIX[operator].format(a=left, b=right)
    return said if formula.window is None else f"{said.replace('to the end', 'for all that time')} ({_when(formula)})"


def _when(formula: Formula) -> str:
    """Return the time from now that an operator's bounds leave: "within 10 s", "for the next 5 s"."""
    assert formula.window is not None
    low, high = (None if bound is None else decimal(bound) for bound in formula.window)
    always = formula.operator == "G"
    if low == high:
        return f"after {low} s"
    if high is None:
        return f"from {low} s on always" if always else f"after {low} s or later"
    if low == "0":
        return f"for the next {high} s" if always else f"within {high} s"
    return f"from {low} to {high} s from then always" if always else f"between {low} and {high} s from then"


_NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
_COMPARED: Mapping[str, str] = {
    ">=": "at least {n}", "<=": "at most {n}", "==": "exactly {n}", "<": "fewer than {n}", ">": "more than {n}",
}  # fmt: skip


def _how_many(count: Formula) -> str:
    """Return of how many robots a count speaks: "at least two robots are"."""
    if count.bound is None:
        return "all robots are" if count.operator == "all" else "some robot is"
    sign, number = count.bound
    said = _NUMBERS[number] if number < len(_NUMBERS) else str(number)
    does = ("is ever", "are ever") if count.operator == "ever" else ("is", "are")
    return f"{_COMPARED[sign].format(n=said)} {f'robot {does[0]}' if number == 1 else f'robots {does[1]}'}"


def _bracketed(argument: Formula, parent: Formula, mission: Mission, depth: int) -> str:
    said = _say(argument, mission, depth + 1)
    plain = argument.operator in _PLAIN or (argument.operator == parent.operator and parent.operator in ("&", "|"))
    literal = argument.operator == "!" and argument.arguments[0].operator in _PLAIN
    return said if plain or literal else f"({said})"


def _say_name(name: str, mission: Mission) -> str:
    if name == FREE:
        return "in free flight"
    return f"in {name}" if name in mission.all_regions else f"in state {name}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def known_names(mission: Mission) -> dict[str, str]:
    """Return what a mission's formula may name, and what each is."""
    names = dict.fromkeys(mission.hoops, "hoop") | dict.fromkeys(mission.regions, "region")
    names |= dict.fromkeys(sorted(mission.internal_propositions), "internal state")
    if mission.spec.team == "joint" and len(mission.agents) > 1:
        names |= {f"{robot}.": "this robot: what it shows follows the dot" for robot in mission.agents}
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
