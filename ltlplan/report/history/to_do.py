"""Parts of a formula that a sampled flight has still to do. For pictures only."""

from __future__ import annotations

from collections.abc import Sequence

from ltlplan.report.history.bounds import Letters, timed_stands, times_of_bounds
from ltlplan.report.history.letters import ReadLetter
from verify.data import Letter, Mission
from verify.logic.normal_form import normal_form
from verify.logic.progression import REFUTED, SETTLED, Automaton


def still_to_do(
    mission: Mission, letters: Letters, readings: Sequence[ReadLetter]
) -> list[tuple[float, list[tuple[str, str]]]]:
    """Return, at each reading and where windows begin and end, how each part of the topmost conjunction stands: its time in s, and (part, how).

    Args:
        mission: Whose formula; of a finite trace.
        letters: Each robot's letters over time.
        readings: The team word, in order of time.
    """
    parts, timed = mission.bounded.conjuncts(), mission.timed_parts
    automata = {part: Automaton(normal_form(part)) for part in parts if not part.timed}
    states = {part: automaton.initial for part, automaton in automata.items()}
    bounds = times_of_bounds(timed, max((mine[-1].end for mine in letters.values()), default=0.0))
    read: list[tuple[float, Letter | None]] = [(reading.time, reading.letter) for reading in readings]
    read = sorted([*read, *((bound, None) for bound in bounds)], key=lambda each: each[0])
    rows: list[tuple[float, list[tuple[str, str]]]] = []
    for (time, letter), stands in zip(read, timed_stands(timed, letters, [time for time, _ in read]), strict=True):
        if letter is not None:
            states = {part: automaton.step(states[part], automaton.cut(letter)) for part, automaton in automata.items()}
        now = dict(stands)
        now |= {str(part): _state(automaton, states[part]) for part, automaton in automata.items()}
        rows.append((time, [(str(part), now[str(part)]) for part in parts]))
    return rows


def _state(automaton: Automaton, state: int) -> str:
    if state == SETTLED:
        return "done"
    if state == REFUTED:
        return "broken"
    return "kept so far" if automaton.accepts(state) else "open"
