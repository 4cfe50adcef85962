"""What a page carries, read from its text: an unpacking and a parsing of their own."""

from __future__ import annotations

import base64
import gzip
import itertools
import json
import re
from dataclasses import dataclass
from html.parser import HTMLParser
from typing import Any

MOST_BYTES = 2_000_000
"""What a page may weigh, so that it can be sent."""


def carried(page: str, name: str) -> str:
    """Return the text that a page carries packed in the script element with this id."""
    found = re.search(rf'<script id="{name}" type="text/plain">([^<]*)</script>', page)
    assert found is not None, f"the page has no {name}"
    return gzip.decompress(base64.b85decode(found.group(1).replace(",", "<"))).decode()


def data_of(page: str) -> dict[str, Any]:
    """Return what a page's figures and player are made of."""
    data = read_rows(json.loads(carried(page, "data")))
    for figure in data["figures"].values():
        figure["data"] = [data["traces"][place] for place in figure["data"]]
    return data


def read_rows(value: Any) -> Any:  # of any type: what JSON holds
    """Return data with the rows of numbers that a page writes by their steps."""
    if isinstance(value, list):
        return [read_rows(part) for part in value]
    if isinstance(value, dict) and set(value) == {"columns"}:
        return [list(row) for row in zip(*map(read_rows, value["columns"]), strict=True)]
    if isinstance(value, dict) and set(value) == {"per", "sums", "of"}:
        row = value["of"]
        for _ in range(value["sums"]):
            row = list(itertools.accumulate(row))
        return row if value["per"] == 1 else [number / value["per"] for number in row]
    return {key: read_rows(part) for key, part in value.items()} if isinstance(value, dict) else value


@dataclass(frozen=True)
class SeenBar:
    """A bar as a reader sees it: its row, where it begins and how long it is as shares of the axis, its words."""

    row: str
    start: float
    length: float
    title: str


class _Bars(HTMLParser):
    def __init__(self, name: str) -> None:
        super().__init__()
        self.name, self.inside, self.depth = name, False, 0
        self.row: str | None = None
        self.rows: list[str] = []
        self.bars: list[SeenBar] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        if tag == "div":
            self.inside = self.inside or found.get("id") == self.name
            self.depth += self.inside
        if self.inside and tag == "span" and found.get("class") == "name" and found.get("title") is not None:
            self.row = str(found["title"])
            self.rows.append(self.row)
        if self.inside and tag == "i":
            style = dict(part.split(":") for part in str(found["style"]).split(";"))
            start, length = (float(style[key].rstrip("%")) / 100 for key in ("left", "width"))
            assert self.row is not None
            self.bars.append(SeenBar(self.row, start, length, str(found["title"])))

    def handle_endtag(self, tag: str) -> None:
        if tag == "div" and self.inside:
            self.depth -= 1
            self.inside = self.depth > 0


def bars_of(page: str, name: str) -> tuple[list[str], list[SeenBar]]:
    """Return the rows and the bars of the chart with this id."""
    parser = _Bars(name)
    parser.feed(page)
    assert parser.rows, f"the page has no bars {name}"
    return parser.rows, parser.bars
