"""Reasons that no flight was found, and the sentences that are made of them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class Obstruction:
    """Reason that no flight was found.

    Attributes:
        what: What cannot be flown, as sentences.
        robots: Those concerned.
        place: Sentence on the narrow place; empty where none was found.
        tried: What was tried, each as a sentence's part that begins with a verb: "letting robots give way".
        helps: What would help, each as a noun: "a second door".
    """

    what: str
    robots: tuple[str, ...] = ()
    place: str = ""
    tried: tuple[str, ...] = ()
    helps: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """All of it as sentences; robots are named where what is said of them does not."""
        said = [self.what, self.place]
        unnamed = [robot for robot in self.robots if not any(_names(text, robot) for text in said)]
        if unnamed:
            said.append(f"It concerns {_listed(unnamed, 'and')}.")
        if self.tried:
            said.append(f"Tried: {_listed(self.tried, 'and')}.")
        if self.helps:
            said.append(f"What would help: {_listed(self.helps, 'or')}.")
        return " ".join(part for part in said if part)

    def saying(self, *more: str) -> Obstruction:
        """Return the obstruction with more sentences on what cannot be flown.

        Args:
            more: The sentences.
        """
        return replace(self, what=" ".join([self.what, *more]))


def _names(text: str, robot: str) -> bool:
    """Tell whether a sentence has a robot's name as a word, possibly with a genitive."""
    words = text.replace(",", " ").replace(":", " ").replace(".", " ").replace("'s", " ").replace("(", " ").replace(")", " ")
    return robot in words.split()


def _listed(items: Collection[str], last: str) -> str:
    *most, end = items
    return f"{', '.join(most)} {last} {end}" if most else end
