"""Random edits of proofs and other files."""

from __future__ import annotations

import copy
from random import Random
from typing import Any


def edited(rng: Random, data: Any) -> Any:
    """Return evidence with one thing changed somewhere."""
    data = copy.deepcopy(data)
    holder: Any = {"": data}
    key: Any = ""
    depth = 0
    while isinstance(holder[key], (list, dict)) and len(holder[key]) and (depth < 2 or rng.random() < 0.9):
        holder = holder[key]
        key, depth = rng.choice(list(holder) if isinstance(holder, dict) else range(len(holder))), depth + 1
    value = holder[key]
    if isinstance(value, int) and rng.random() < 0.8:
        holder[key] = rng.choice([value + 1, value - 1, -1, 0, value ^ 1, 1 << 70])
    elif rng.random() < 0.5 and isinstance(holder, list):
        rng.choice([holder.pop, lambda at: holder.insert(at, copy.deepcopy(value))])(key)
    else:
        holder[key] = rng.choice([None, True, 1.5, "x", [], {}, [[]], [0], 0])
    return data


def edited_text(text: str, rng: Random) -> str:
    """Return a text with some letters changed, left out, doubled or turned round."""
    for _ in range(rng.choice([1, 1, 2, 6])):
        at, kind = rng.randrange(max(len(text), 1)), rng.randrange(4)
        end = min(len(text), at + rng.choice([1, 1, 2, 9]))
        new = [rng.choice('nms?ik0123456789[]{}",:'), "", text[at:end] * 2, text[at:end][::-1]][kind]
        text = text[:at] + new + text[end:]
    return text
