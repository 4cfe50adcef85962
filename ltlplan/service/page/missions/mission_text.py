"""Mission files as text that is being written: where a key's value stands, and the same text with one value changed.

Everything else stays as its author wrote it, comments and line breaks too.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from verify.data import BadInput

Keys = Sequence[str | int]
Span = tuple[int, int]
"""Offsets of the first character and of the one behind the last."""

_PLAIN = re.compile(r"[A-Za-z0-9_.+-][A-Za-z0-9_.+ ()&|<>!-]*")
_READ_OTHERWISE = re.compile(r"(?i)true|false|null|yes|no|on|off|~|[-+.0-9][-+.0-9_e]*")


def span_of(text: str, keys: Keys) -> Span | None:
    """Return where the value of some keys stands in a mission's text, or the nearest of those above it that is there.

    Args:
        text: YAML; it may be at fault.
        keys: Keys and indices from the outermost on; none mean nothing.

    Returns:
        A value that holds others is told by its key; None where nothing is found.
    """
    node = _composed(text)
    found: Span | None = None
    for key in keys:
        step = _step(node, key)
        if step is None:
            break
        name, node = step
        told = node if isinstance(node, ScalarNode) or name is None else name
        found = (told.start_mark.index, told.end_mark.index)
    return found


def with_value(text: str, keys: Sequence[str], value: str | float | list[list[str]]) -> str:
    """Return a mission's text with one value changed, or added where its section is there.

    Args:
        text: YAML.
        keys: One key, or a section's and one in it.
        value: The new value.

    Raises:
        BadInput: The text is no YAML, or there is no such section.
    """
    root = _composed(text)
    if not isinstance(root, MappingNode):
        raise BadInput("The text is no mission: it must be a table of keys such as `name:` and `agents:`.")
    written = _written(value)
    node: Node = root
    for depth, key in enumerate(keys):
        step = _step(node, key)
        if step is None and depth < len(keys) - 1:
            raise BadInput(f"The mission has no section `{key}`.")
        if step is None:
            return _added(text, node, key, written, nested=depth > 0)
        node = step[1]
    start, end = node.start_mark.index, node.end_mark.index
    behind = "\n" if text[start:end].endswith("\n") else ""
    return text[:start] + written + behind + text[end:]


def with_edges(text: str, edges: Sequence[tuple[str, str]]) -> str:
    """Return a mission's text with edges added to its environment.

    Args:
        text: YAML.
        edges: Pairs of regions.

    Raises:
        BadInput: The text has no list of edges.
    """
    node = _composed(text)
    for key in ("environment", "edges"):
        step = None if node is None else _step(node, key)
        if step is None:
            raise BadInput("The mission has no list `environment.edges` to add to.")
        node = step[1]
    assert node is not None
    added = ", ".join(_written([[a, b]])[1:-1] for a, b in edges)
    start, end = node.start_mark.index, node.end_mark.index
    if text[end - 1 : end] == "]":
        comma = "" if text[start + 1 : end - 1].strip() in ("",) else ", "
        return text[: end - 1] + comma + added + text[end - 1 :]
    column = node.start_mark.column
    lines = "".join(f"{' ' * column}- {_written([[a, b]])[1:-1]}\n" for a, b in edges)
    at = start + len(text[start:end].rstrip())
    return text[:at] + "\n" + lines.rstrip("\n") + text[at:]


def _composed(text: str) -> Node | None:
    try:
        return YAML(typ="safe", pure=True).compose(text)
    except (YAMLError, ValueError, RecursionError):
        return None


def _step(node: Node | None, key: str | int) -> tuple[Node | None, Node] | None:
    if isinstance(node, MappingNode):
        for name, value in node.value:
            if isinstance(name, ScalarNode) and name.value == str(key):
                return name, value
    if isinstance(node, SequenceNode) and isinstance(key, int) and 0 <= key < len(node.value):
        return None, node.value[key]
    return None


def _added(text: str, node: Node, key: str, written: str, *, nested: bool) -> str:
    if not nested:
        return text.rstrip("\n") + f"\n{key}: {written}\n"
    start, end = node.start_mark.index, node.end_mark.index
    if text[start : start + 1] == "{":
        inner = text[start + 1 : end - 1].strip()
        return text[: start + 1] + f"{key}: {written}" + (", " if inner else "") + text[start + 1 :]
    return text[:start] + f"{key}: {written}\n{' ' * node.start_mark.column}" + text[start:]


def _written(value: str | float | list[list[str]]) -> str:
    if isinstance(value, list):
        return "[" + ", ".join("[" + ", ".join(map(_written, pair)) + "]" for pair in value) + "]"
    if not isinstance(value, str):
        return f"{value:g}"
    plain = _PLAIN.fullmatch(value) and not _READ_OTHERWISE.fullmatch(value) and ": " not in value and not value.endswith(" ")
    return value if plain else json.dumps(value, ensure_ascii=False)
