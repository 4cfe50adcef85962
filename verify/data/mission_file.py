"""Mission files: YAML in, `Mission` out, with every fault at once and each at its line.

Two passes, both of `verify.data.rules`: every section, and every entry of a table of entries, is validated on its own, so one
mistake does not hide the next; then whatever is sound is held against the rest (names, starts, edges, limits).
"""

from __future__ import annotations

import io
import os
from typing import Any

import numpy as np
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from verify.data.errors import BadInput
from verify.data.mission import Mission
from verify.data.rules.faults import Fault, KeyPath, MissionError, sound_sections
from verify.data.rules.missions import broken_rules
from verify.data.storage.reading import read_text
from verify.data.storage.strict_yaml import MAX_DEPTH, MAX_NODES, NotAccepted, load_tree

MAX_BYTES = 1_000_000
MOST = 10**18
"""Greatest whole number that is read; nothing in a mission comes near it."""


def load_mission_file(source: str | os.PathLike[str], *, installed: bool = True) -> Mission:
    """Read a mission from a file.

    Args:
        source: The file.
        installed: Whether the planning method and the cost terms that it names must be there. What was planned already is judged
            without them.

    Raises:
        MissionError: All faults of the file, each with its line and keys.
        BadInput: There is no such file, or it is too large or unreadable.
    """
    text = read_text(source, most=MAX_BYTES, what="mission file")
    return parse_mission(text, str(source), installed=installed)


def parse_mission(text: str, source: str = "mission", *, installed: bool = True) -> Mission:
    """Read a mission from YAML text.

    Args:
        text: The file's contents.
        source: Names it in messages.
        installed: Whether the planning method and the cost terms that it names must be there.

    Raises:
        MissionError: All faults, each with its line and keys.
        BadInput: It is no table of keys at all.
    """
    tree = _compose(text, source)
    lines: dict[KeyPath, int] = {}
    data = _plain(tree, (), lines, source)
    values, faults = sound_sections(data, Mission.model_fields)
    found = [Fault(keys, _line(lines, keys), reason) for keys, reason in faults]
    with np.errstate(all="ignore"):  # absurd numbers end as infinities, which lie outside of everything
        found += [Fault(keys, _line(lines, keys), reason) for keys, reason in broken_rules(values, data, installed=installed)]
    if found:
        raise MissionError(source, found)
    return Mission.model_validate(values)


def mission_to_yaml(mission: Mission) -> str:
    """Return the resolved mission as YAML that reads back as the same mission."""
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]  # ruamel declares it as None
    yaml.width = 120
    buffer = io.StringIO()
    buffer.write("# A resolved mission: every default, region matrix and vehicle number is written out.\n")
    yaml.dump(mission.resolved(), buffer)
    return buffer.getvalue()


def _compose(text: str, source: str) -> Any:
    """Parse YAML 1.2 without aliases, refusing what could not be a mission."""
    if not text.strip():
        raise BadInput(f"{source} is empty; `ltlplan missions --new NAME` writes a mission to start from.")
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
        raise BadInput(f"{source} is no mission file: it is nested too deeply.") from None
    except (ValueError, OverflowError) as error:
        raise BadInput(f"{source} is no mission file: {str(error).splitlines()[0]}.") from None
    if not isinstance(tree, CommentedMap):
        raise BadInput(f"{source} is no mission: the file must be a table of keys such as `name:` and `agents:`.")
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
        reason = f"a whole number beyond {MOST:.0e} is no number of a mission."
        raise MissionError(source, [Fault(keys, _line(lines, keys), reason)])
    for kind in (int, float, str):  # ruamel's scalars remember how they were written; we do not
        if isinstance(node, kind):
            return kind(node)
    return str(node)  # a date, say: text to the schema, which then says what it wants


def _line(lines: dict[KeyPath, int], keys: KeyPath) -> int | None:
    """Return the line of the deepest key of `keys` that stands in the file."""
    for length in range(len(keys), 0, -1):
        if keys[:length] in lines:
            return lines[keys[:length]]
    return 1 if lines else None
