"""Plain values of a mission's file before validation, with the file and line of each key."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from verify.data.errors import BadInput
from verify.data.storage.strict_yaml import MAX_DEPTH, MAX_NODES, NotAccepted, load_tree
from verify.data.validation.faults import Fault, KeyPath, MissionError

MOST = 10**18
"""Greatest whole number that is read; nothing in a mission comes near it."""


@dataclass(frozen=True, slots=True)
class Place:
    """A line of a file.

    Attributes:
        source: The file's name, as messages show it.
        line: From 1.
    """

    source: str
    line: int


@dataclass(frozen=True, slots=True)
class MissionTree:
    """Plain values of one file, or of several that were put together.

    Attributes:
        source: The file's name, as messages show it; of several, that of the mission.
        data: What stands under each key.
        places: Where each key and each entry of a list stands.
        written: Keys that the file has by a synonym: as it has them.
    """

    source: str
    data: dict[str, Any]  # of any type: what a mission file may hold
    places: Mapping[KeyPath, Place]
    written: Mapping[KeyPath, str] = field(default_factory=dict[KeyPath, str])

    def place(self, keys: KeyPath) -> Place | None:
        """Return where the deepest of nested keys stands."""
        for length in range(len(keys), 0, -1):
            if keys[:length] in self.places:
                return self.places[keys[:length]]
        return Place(self.source, 1) if self.places else None

    def fault(self, keys: KeyPath, reason: str) -> Fault:
        """Return a fault at some keys, with its line, and with its file where that is not the mission's own.

        Args:
            keys: Where, as keys and indices.
            reason: What is wrong and what would be right.
        """
        keys = tuple(self.written.get(keys[: at + 1], key) for at, key in enumerate(keys))
        place = self.place(keys)
        if place is None:
            return Fault(keys, None, reason)
        return Fault(keys, place.line, reason, None if place.source == self.source else place.source)


def read_tree(text: str, source: str, what: str = "mission") -> MissionTree:
    """Read YAML 1.2 as plain values.

    Args:
        text: The file's contents.
        source: Names it in messages.
        what: What it should be, for messages: a mission, or a room.

    Raises:
        MissionError: It is no YAML, or what YAML allows and missions do not; with the line.
        BadInput: It is no table of keys at all.
    """
    lines: dict[KeyPath, int] = {}
    data = _plain(_composed(text, source, what), (), lines, source)
    return MissionTree(source, data, {keys: Place(source, line) for keys, line in lines.items()})


def _composed(text: str, source: str, what: str) -> CommentedMap:
    """Parse YAML 1.2, refusing what could not be a mission."""
    if not text.strip():
        start = "; `ltlplan missions --new NAME` writes a mission to start from" if what == "mission" else ""
        raise BadInput(f"{source} is empty{start}.")
    try:
        tree = load_tree(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = None if mark is None else mark.line + 1
        problem = " ".join(str(part) for part in (error.context, error.problem) if part)
        raise MissionError(source, [Fault((), line, f"this is no YAML: {problem.splitlines()[0]}.")]) from None
    except NotAccepted as error:
        raise MissionError(source, [Fault((), error.line, error.reason)]) from None
    except YAMLError as error:
        raise BadInput(f"{source} is no YAML: {str(error).splitlines()[0]}") from None
    except RecursionError:
        raise BadInput(f"{source} is no {what} file: it is nested too deeply.") from None
    except (ValueError, OverflowError) as error:
        raise BadInput(f"{source} is no {what} file: {str(error).splitlines()[0]}.") from None
    if not isinstance(tree, CommentedMap):
        keys = "`name:` and `agents:`" if what == "mission" else "`regions:` and `hoops:`"
        raise BadInput(f"{source} is no {what}: the file must be a table of keys such as {keys}.")
    return tree


def _plain(node: Any, keys: KeyPath, lines: dict[KeyPath, int], source: str, budget: list[int] | None = None) -> Any:
    """Turn ruamel's tree into plain values and note the line of every key."""
    budget = [MAX_NODES] if budget is None else budget
    budget[0] -= 1
    if budget[0] < 0 or len(keys) > MAX_DEPTH:
        raise BadInput(f"{source} is no mission file: it has too many or too deeply nested values.")
    if isinstance(node, CommentedMap):
        result: dict[str, Any] = {}
        for key, value in node.items():
            if not isinstance(key, str):
                line = node.lc.key(key)[0] + 1
                raise MissionError(source, [Fault((*keys, str(key)), line, "a key must be text; put it in quotes.")])
            lines[(*keys, key)] = node.lc.key(key)[0] + 1
            result[str(key)] = _plain(value, (*keys, key), lines, source, budget)
        return result
    if isinstance(node, CommentedSeq):
        items: list[Any] = []
        for index, value in enumerate(node):
            lines[(*keys, index)] = node.lc.item(index)[0] + 1
            items.append(_plain(value, (*keys, index), lines, source, budget))
        return items
    if isinstance(node, bool) or node is None:
        return node
    if isinstance(node, int) and abs(node) > MOST:
        line = next((lines[keys[:n]] for n in range(len(keys), 0, -1) if keys[:n] in lines), 1)
        raise MissionError(source, [Fault(keys, line, f"a whole number beyond {MOST:.0e} is no number of a mission.")])
    for kind in (int, float, str):  # ruamel's scalars remember how they were written; we do not
        if isinstance(node, kind):
            return kind(node)
    return str(node)  # a date, say: text to the schema, which then says what it wants
