"""All team words that keep precedences between events, written out: for small words only, and without any of our automata."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence

from tests.helpers.words.plain_team_words import Held, holds
from verify.data import Formula, Letter

Words = Mapping[str, Sequence[Letter]]
Event = tuple[str, int]
Pairs = Sequence[tuple[Event, Event]]


def events_of(words: Words) -> list[Event]:
    """All events: a robot's coming to a letter of its word."""
    return [(name, index) for name, word in words.items() for index in range(1, len(word))]


def courses(words: Words, pairs: Pairs, *, shared: bool) -> Iterator[list[tuple[Event, ...]]]:
    """Yield the ways in which events can follow each other, each instant with its events; `shared`: several at one instant."""

    def further(done: frozenset[Event], course: list[tuple[Event, ...]]) -> Iterator[list[tuple[Event, ...]]]:
        left = [event for event in events_of(words) if event not in done]
        if not left:
            yield course
        free = [
            (name, index)
            for name, index in left
            if (index == 1 or (name, index - 1) in done)
            and all(first in done for first, then in pairs if then == (name, index))
        ]
        for many in range(1, (len(free) if shared else 1) + 1):
            for instant in itertools.combinations(free, many):
                yield from further(done | set(instant), [*course, instant])

    yield from further(frozenset(), [])


def unions(words: Words, pairs: Pairs) -> Iterator[list[Held]]:
    """Yield the team words of `joint`."""
    for course in courses(words, pairs, shared=True):
        held = {name: word[0] for name, word in words.items()}
        found: list[Held] = [dict(held)]
        for instant in course:
            held |= {name: words[name][index] for name, index in instant}
            found.append(dict(held))
        yield found


def readings(words: Words, pairs: Pairs, most: int) -> Iterator[list[Held]]:
    """Yield the team words of `own` of up to `most` readings; every letter is read while it is held."""
    for course in courses(words, pairs, shared=False):
        yield from _read(words, [event for (event,) in course], most)


def _read(words: Words, course: Sequence[Event], most: int) -> Iterator[list[Held]]:
    def further(place: int, at: dict[str, int], unread: frozenset[str], word: list[Held]) -> Iterator[list[Held]]:
        if place == len(course) and not unread:
            yield word
        if len(word) + len(unread) + len(course) - place > most:
            return
        if place < len(course) and course[place][0] not in unread:
            name, index = course[place]
            yield from further(place + 1, at | {name: index}, unread | {name}, word)
        if len(word) < most:
            for name, index in at.items():
                yield from further(place, at, unread - {name}, [*word, {name: words[name][index]}])

    yield from further(0, dict.fromkeys(words, 0), frozenset(words), [])


def broken(formula: Formula, words: Words, pairs: Pairs, reading: str, most: int) -> list[Held] | None:
    """Return a team word that keeps the precedences and breaks the formula; under `own` one of up to `most` readings."""
    found = unions(words, pairs) if reading == "joint" else readings(words, pairs, most)
    return next((word for word in found if not holds(formula, word)), None)
