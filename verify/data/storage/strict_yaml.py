"""YAML with one meaning: no tags, no merge keys, no anchor twice, and an end to depth and size before anything is built."""

from __future__ import annotations

import re
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.composer import Composer
from ruamel.yaml.events import AliasEvent, ScalarEvent
from ruamel.yaml.nodes import MappingNode, ScalarNode
from ruamel.yaml.parser import RoundTripParser
from ruamel.yaml.scanner import Scanner

MAX_NODES = 50_000
MAX_DEPTH = 20
MAX_TEXT = 100_000
"""Characters of one value; a formula of thousands of operators has fewer."""
MAX_NUMBER = 400
"""Characters of a number; a float written out has fewer."""

_HALF = re.compile("[\ud800-\udfff]")
_MERGE = "tag:yaml.org,2002:merge"
_NUMBERS = ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float")


def load_tree(text: str) -> Any:  # ruamel's nodes have no common type
    """Return ruamel's tree of a YAML 1.2 text, which knows the line of every key.

    Raises:
        NotAccepted: The text holds what YAML allows and we do not.
        YAMLError: It is no YAML.
    """
    yaml = YAML(typ="rt", pure=True)
    yaml.Composer = _Composer
    yaml.Scanner, yaml.Parser = _Scanner, _Parser
    return yaml.load(text)


class NotAccepted(Exception):
    """Something that YAML allows and missions do not."""

    def __init__(self, line: int, reason: str) -> None:
        super().__init__(reason)
        self.line, self.reason = line, reason


class _Scanner(Scanner):
    """The scanner that keeps no comments, which took a quarter of reading; the same tokens with fewer calls for each."""

    def __init__(self, loader: Any = None) -> None:
        super().__init__(loader)
        self._seen = -1

    def need_more_tokens(self) -> bool:
        if self.done:
            return False
        if not self.tokens:
            return True
        index = self.reader.index
        if self.possible_simple_keys and index != self._seen:  # they become stale only as the text is read on
            self.stale_possible_simple_keys()
            self._seen = index
        keys = self.possible_simple_keys.values()
        return bool(keys) and min(key.token_number for key in keys) == self.tokens_taken

    def check_token(self, *choices: Any) -> bool:
        while self.need_more_tokens():
            self.fetch_more_tokens()
        return bool(self.tokens) and (not choices or isinstance(self.tokens[0], choices))


class _Parser(RoundTripParser):
    """The parser, which looks up its scanner once."""

    def __init__(self, loader: Any) -> None:
        super().__init__(loader)
        self._tokens: Any = None

    @property
    def scanner(self) -> Any:
        if self._tokens is None:
            self._tokens = super().scanner
        return self._tokens

    def check_event(self, *choices: Any) -> bool:
        event = self.peek_event()
        return event is not None and (not choices or isinstance(event, choices))


class _Composer(Composer):
    """Refuses, before anything is built of it, what would give a name or value a second meaning."""

    def __init__(self, loader: Any = None) -> None:
        super().__init__(loader)
        self._reads: Any = None
        self._nested = self._nodes = 0

    @property
    def parser(self) -> Any:
        if self._reads is None:
            self._reads = super().parser
        return self._reads

    def compose_node(self, parent: Any, index: Any) -> Any:
        event = self.parser.peek_event()
        line = event.start_mark.line + 1
        if self._nodes == MAX_NODES:
            raise NotAccepted(line, f"this is too long for a mission: more than {MAX_NODES} keys and values.")
        if not isinstance(event, AliasEvent):
            if event.anchor is not None and event.anchor in self.anchors:
                raise NotAccepted(line, f"the anchor &{event.anchor[:40]} is set twice; give each anchor a name of its own.")
            if getattr(event, "ctag", None) is not None:
                raise NotAccepted(line, f"YAML tags such as {event.ctag!s:.60} are not accepted.")
            if self._nested > MAX_DEPTH:
                raise NotAccepted(line, "this is nested too deeply for a mission.")
            if isinstance(event, ScalarEvent) and len(event.value) > MAX_TEXT:
                raise NotAccepted(line, f"a text or number of {len(event.value)} characters; {MAX_TEXT} is the most.")
            if isinstance(event, ScalarEvent) and _HALF.search(event.value):
                raise NotAccepted(
                    line, "a text holds half of a surrogate pair, which is no character; write the character itself."
                )
        self._nodes += 1
        self._nested += 1
        node = super().compose_node(parent, index)
        self._nested -= 1
        if isinstance(node, ScalarNode) and node.tag in _NUMBERS and len(node.value) > MAX_NUMBER:
            raise NotAccepted(line, f"a number of {len(node.value)} characters; {MAX_NUMBER} is the most.")
        if isinstance(node, MappingNode):
            for key, _ in node.value:
                if not isinstance(key, ScalarNode):
                    raise NotAccepted(key.start_mark.line + 1, "a key must be text, not a list or a table.")
                if key.tag == _MERGE:
                    raise NotAccepted(key.start_mark.line + 1, "merge keys (`<<`) are not accepted; write the keys out.")
        return node
