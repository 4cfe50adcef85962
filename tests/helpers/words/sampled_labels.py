"""Labels of many sampled paths and runs of any automaton over them: a reading of words beside that of the search's filter."""

from __future__ import annotations

from collections.abc import Collection, Hashable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ltlplan.paths.hoops.keep_out import room
from ltlplan.paths.sampling.path_problem import samples_near
from verify.data import BadInput, Letter, Mission
from verify.data.arrays import Booleans, Floats, Integers


class WordAutomaton(Protocol):
    """What a run needs of an automaton; `ltlplan.translate` returns one."""

    @property
    def initial(self) -> Hashable:
        """State before the first letter."""
        ...

    @property
    def accepting(self) -> Collection[Hashable]:
        """States in which a finite word may end."""
        ...

    def successor(self, state: Hashable, letter: Letter) -> Hashable | None:
        """Return the state after a letter, or None where there is none."""
        ...


@dataclass(frozen=True, eq=False, slots=True)
class Labels:
    """The letter of every sample of every path, as codes.

    Attributes:
        codes: Index of a letter. Shape (instants, paths).
        regions: Region i is in the letter where bit i of the code is set.
    """

    codes: NDArray[np.int32]
    regions: tuple[str, ...]

    def letter(self, code: int) -> Letter:
        """Return the letter that a code stands for."""
        return frozenset(name for bit, name in enumerate(self.regions) if code >> bit & 1)


def label(mission: Mission, positions: Floats, *, grow: float = 0.0) -> Labels:
    """Label sampled paths: which regions each sample is in.

    Args:
        mission: At most 30 regions.
        positions: m, as `SampledPaths.axes(0)` has them. Shape (instants, 3, paths).
        grow: m by which every region is grown (shrunk where negative) before labelling.

    Raises:
        BadInput: There are more regions than a code has bits for.
    """
    names = tuple(mission.all_regions)
    if len(names) > 30:
        raise BadInput(f"{len(names)} regions; sampled labels hold at most 30.")
    codes = np.zeros((len(positions), positions.shape[2]), dtype=np.int32)
    flat = codes.reshape(-1)
    bits = {name: 1 << bit for bit, name in enumerate(names)}
    for region, at, offset in samples_near(positions, room(mission, max(grow, 0.0)).regions.values()):
        level = max(1.0 + grow / mission.all_regions[region.name].inner_radius, 0.05) ** 2
        flat[at[region.levels(offset.T) <= level]] |= bits[region.name]
    return Labels(codes, names)


def run(automaton: WordAutomaton, labels: Labels, internal: Letter = frozenset()) -> Booleans:
    """Tell for each path whether the word of its samples is accepted.

    Args:
        automaton: Deterministic, over finite words.
        labels: Codes of all samples.
        internal: Propositions that hold at every sample beside the regions.
    """
    present = np.flatnonzero(np.bincount(labels.codes.ravel()))
    dense = np.zeros(int(present.max(initial=0)) + 1, dtype=np.int64)
    dense[present] = np.arange(len(present))
    letters = [labels.letter(int(code)) | internal for code in present]
    index: dict[Hashable, int] = {automaton.initial: 0}
    states: list[Hashable] = [automaton.initial]
    rows: list[list[int]] = []
    while len(rows) < len(states):  # closure under the letters that occur
        row = []
        for letter in letters:
            following = automaton.successor(states[len(rows)], letter)
            if following is not None and following not in index:
                index[following] = len(states)
                states.append(following)
            row.append(-1 if following is None else index[following])
        rows.append(row)
    accepting = set(automaton.accepting)
    accepts = np.array([state in accepting for state in states] + [False])
    return accepts[final_states(np.array(rows, dtype=np.int64), dense[labels.codes])]


def final_states(table: Integers, codes: NDArray[np.integer]) -> Integers:
    """Run a table over codes from state 0; the state after the last is len(table) where a run died. Shape (paths,)."""
    dead = len(table)
    full = np.concatenate([np.where(table < 0, dead, table), np.full((1, table.shape[1]), dead)])
    state = np.zeros(codes.shape[1], dtype=np.int64)
    for row in codes:
        state = full[state, row]
    return state
