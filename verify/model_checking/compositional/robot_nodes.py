"""Possible positions of one robot while words move on, and where it may have been observed: sets of its nodes, as bits."""

from __future__ import annotations

import bisect
import itertools
import operator

from verify.data.errors import InternalError
from verify.model_checking.compositional.violation_automaton import BreakingWords, bits
from verify.model_checking.robot_letters import RobotBehaviour


class RobotNodes:
    """One robot's nodes as bits, from each rank at which a span of its own begins, or has just ended, to the next.

    Attributes:
        starts: Those ranks; *epochs* are what lies between them, numbered as they are.
        present: For each epoch the nodes whose spans hold its times.
        hopeful: For each epoch and state of the words where the robot can be so that it can complete its flight while the
            others move the words on at their will, not having been read and having been read.
    """

    def __init__(self, robot: RobotBehaviour, words: BreakingWords, ranks: list[tuple[int, int]], last: int) -> None:
        number = {letter: i for i, letter in enumerate(words.letters)}
        seen = words.normal.propositions
        self.words = words
        self.initial = sum(1 << node for node in robot.initial)
        self.final = sum(1 << node for node in robot.final)
        self.showing = [0] * len(words.letters)
        for node, letter in enumerate(robot.letters):
            self.showing[number[letter & seen]] |= 1 << node
        self.silent = [0] * len(robot)  # targets whose letter is the same
        self.changing = [0] * len(robot)
        self.silent_before = [0] * len(robot)
        self.changing_before = [0] * len(robot)
        for node, targets in enumerate(robot.following):
            for target in targets:
                if ranks[target][0] > ranks[node][1]:
                    raise InternalError(f"{robot.robot}'s spans do not follow one another. This is a bug of ltlplan's.")
                same = robot.letters[target] == robot.letters[node]
                (self.silent if same else self.changing)[node] |= 1 << target
                (self.silent_before if same else self.changing_before)[target] |= 1 << node
        self.free = [sum(nodes for i, nodes in enumerate(self.showing) if free >> i & 1) for free in words.free]
        toggled: dict[int, int] = {}
        for node, (low, high) in enumerate(ranks):
            toggled[low] = toggled.get(low, 0) ^ 1 << node
            toggled[high + 1] = toggled.get(high + 1, 0) ^ 1 << node
        self.starts = sorted(rank for rank in toggled if rank <= last)
        self.present = list(itertools.accumulate((toggled[rank] for rank in self.starts), operator.xor))
        self.hopeful = self._hopeful()
        self.known: dict[tuple[int, int, int, int], tuple[int, int]] = {}

    def epoch(self, rank: int) -> int:
        """Return in which epoch a rank lies."""
        return bisect.bisect_right(self.starts, rank) - 1

    def closed(self, state: int, epoch: int, nodes: int, read: int) -> tuple[int, int]:
        """Return where it may be, and where it may have been read, once all that is free has been done; what has no hope left out.

        Args:
            state: Of the words; says what is free.
            epoch: Says which nodes can be held at the present time.
            nodes: Where it may be.
            read: Those of them at which it may have been read.
        """
        key = (state, epoch, nodes, read)
        found = self.known.get(key)
        if found is not None:
            return found
        present, free = self.present[epoch], self.free[state]
        nodes &= present
        read = (read | free) & nodes
        left_nodes, left_read = nodes, read  # what has come in and was not followed yet
        while left_nodes or left_read:
            more_nodes = more_read = 0
            for node in bits(left_nodes):
                more_nodes |= self.silent[node]
            for node in bits(left_read):
                more_nodes |= self.changing[node]
                more_read |= self.silent[node]
            more_nodes = (more_nodes | more_read) & present
            more_read = (more_read & present) | more_nodes & free
            left_nodes, left_read = more_nodes & ~nodes, more_read & ~read
            nodes |= more_nodes
            read |= more_read
        hopeful, hopeful_read = self.hopeful[epoch][state]
        read &= hopeful_read
        found = self.known[key] = nodes & hopeful | read, read
        return found

    def _hopeful(self) -> list[list[tuple[int, int]]]:
        """Go back from the end, over epochs, with what every state's moves (by whomever) leave possible."""
        words = self.words
        found: list[list[tuple[int, int]]] = []
        after = [(0, self.final if ends else 0) for ends in words.ends]
        for present in reversed(self.present):
            here = [(nodes & present, read & present) for nodes, read in after]
            work = list(range(len(here)))
            while work:
                state = work.pop()
                nodes, read = here[state]
                for letter, targets in words.moves[state].items():
                    for target in targets:
                        nodes |= here[target][0] | here[target][1] & self.showing[letter]
                        read |= here[target][1]
                nodes, read = self._completed(state, present, nodes, read)
                if (nodes, read) != here[state]:
                    here[state] = nodes, read
                    work += [state, *words.before[state]]
            found.append(here)
            after = here
        return found[::-1]

    def _completed(self, state: int, present: int, nodes: int, read: int) -> tuple[int, int]:
        """Add the nodes from which what is free leads to the given ones."""
        while True:
            more_nodes, more_read = nodes | read & self.free[state], read | nodes
            for node in bits(more_nodes):
                more_nodes |= self.silent_before[node]
                more_read |= self.changing_before[node]
            for node in bits(more_read):
                more_read |= self.silent_before[node]
            more_nodes &= present
            more_read &= present
            if (more_nodes, more_read) == (nodes, read):
                return nodes, read
            nodes, read = more_nodes, more_read
