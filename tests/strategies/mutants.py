"""Mutants of valid files: bytes and lines moved, lost, doubled or replaced by what hostile files hold; values of JSON likewise."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import deepcopy
from random import Random
from types import FrameType
from typing import Any

TOKENS = (
    b"", b"0", b"-0.0", b"1e999", b"-1e308", b"1e-999", b"nan", b"inf", b"NaN", b"Infinity", b"null", b"true", b"~", b"\0", b"\xff",
    b"\xef\xbb\xbf", b"\r", b"\n", b"\r\n", b"\t", b",", b",,", b";", b":", b"\"", b"'", b"\\", b"\\ud800", b"#", b"&x ", b"*x",
    b"<<: ", b"!!omap ", b"!!python/object:os.system ", b"{", b"}", b"[", b"]", b"[[[[[[[[", b"---\n", b"...\n", b"? ", b"- ", b"|\n",
    b">\n", b"%YAML 1.1\n", b"9" * 60, b"1" * 5000, b"0x" + b"f" * 60, b"1_0", b"\xd9\xa1", b"\xe2\x80\xa8", b"1e5", b"1.5", b"-", b"+1",
    b" ", b".", b"a", b"A", b"r0", b"R0", b"x", b"t", b"0.1", b"0.10000000000000001", b"1e-300", b"/*", b"//", b"=1+1",
)  # fmt: skip

VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 2**63, 10**400, -0.0, 0.5, 1e308, 5e-324, "", "a", "r0", "R0", "free", "\u2028", "0" * 64, "x" * 5000,
    [], {}, [[]], [[], []], {"a": 1}, [None], [0, 0, 0], [1e9, 1e9, 1e9], {"r0": None},
)  # fmt: skip


def mutated_bytes(data: bytes, rng: Random) -> bytes:
    """Return a file's bytes after one to three small accidents or malices."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        data = rng.choice(_BYTES)(data, rng)
    return data


def mutated_json(data: bytes, rng: Random) -> bytes:
    """Return JSON in which a value was changed, lost, moved or doubled; now and then its text is mutated instead."""
    if rng.random() < 0.25:
        return mutated_bytes(data, rng)
    value = json.loads(data)
    for _ in range(rng.choice((1, 1, 2))):
        value = _changed(value, rng)
    text = json.dumps(value, indent=rng.choice((None, 1)))
    if rng.random() < 0.1 and '": ' in text:
        at = rng.choice([i for i in range(len(text)) if text.startswith('": ', i)])
        begin = text.rindex('"', 0, at)
        text = f"{text[:begin]}{text[begin : at + 1]}: 1, {text[begin:]}"
    return text.encode()


def _changed(value: Any, rng: Random) -> Any:
    value = deepcopy(value)
    places = list(_places(value))
    if not places:
        return rng.choice(VALUES)
    holder, key = rng.choice(places)
    match rng.randrange(7):
        case 0:
            del holder[key]
        case 1:
            holder[key] = deepcopy(rng.choice(VALUES))
        case 2:
            other, from_ = rng.choice(places)
            holder[key] = deepcopy(other[from_])
        case 3 if isinstance(holder, list):
            holder.insert(key, deepcopy(holder[key]))
        case 4 if isinstance(holder, dict):
            holder[rng.choice(("extra", key + " ", key.upper(), ""))] = holder[key]
        case 5 if isinstance(holder[key], float | int) and not isinstance(holder[key], bool):
            holder[key] = rng.choice(
                (holder[key] + 1, -holder[key], holder[key] * (1 + 1e-7), holder[key] * 1.01, str(holder[key]))
            )
        case _:
            holder[key] = rng.choice(([holder[key]], {"a": holder[key]}, str(holder[key])))
    return value


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield value, key
        yield from _places(inner)


def _flip(data: bytes, rng: Random) -> bytes:
    if not data:
        return data
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]


def _insert(data: bytes, rng: Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.choice(TOKENS) + data[at:]


def _replace(data: bytes, rng: Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.choice(TOKENS) + data[at + rng.randrange(1, 9) :]


def _cut(data: bytes, rng: Random) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _lose(data: bytes, rng: Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] + data[at + rng.randrange(1, 30) :]


def _lines(change: Callable[[list[bytes], int, int, Random], None]) -> Callable[[bytes, Random], bytes]:
    def mutate(data: bytes, rng: Random) -> bytes:
        lines = data.splitlines(keepends=True)
        if not lines:
            return data
        change(lines, rng.randrange(len(lines)), rng.randrange(len(lines)), rng)
        return b"".join(lines)

    return mutate


def _double(lines: list[bytes], at: int, to: int, _: Random) -> None:
    lines.insert(to, lines[at])


def _swap(lines: list[bytes], at: int, to: int, _: Random) -> None:
    lines[at], lines[to] = lines[to], lines[at]


def _drop(lines: list[bytes], at: int, _: int, __: Random) -> None:
    del lines[at]


def _cell(lines: list[bytes], at: int, _: int, rng: Random) -> None:
    cells = lines[at].split(b",")
    cells[rng.randrange(len(cells))] = rng.choice((*TOKENS, rng.choice(cells)))
    lines[at] = b",".join(cells)


def _indent(lines: list[bytes], at: int, _: int, rng: Random) -> None:
    lines[at] = rng.choice((b" ", b"  ", b"\t")) + lines[at]


_BYTES = (
    _flip, _insert, _insert, _replace, _replace, _cut, _lose,
    *(_lines(change) for change in (_double, _swap, _drop, _cell, _cell, _indent)),
)  # fmt: skip


@contextmanager
def no_hang(seconds: float = 30.0) -> Iterator[None]:
    """Fail where the work does not end: a budget for each mutant, far above what any needs."""

    def stop(_signal: int, _frame: FrameType | None) -> None:
        raise AssertionError(f"still at work after {seconds:g} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
