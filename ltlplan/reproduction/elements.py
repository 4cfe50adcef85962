"""The elements of both papers and the published problems, in the order in which they are shown."""

from __future__ import annotations

from collections.abc import Sequence

from ltlplan.reproduction.element import Element
from ltlplan.reproduction.hoops_flights import HOOPS_FLIGHTS
from ltlplan.reproduction.hoops_parts import HOOPS_PARTS
from ltlplan.reproduction.hoops_sequences import HOOPS_SEQUENCES
from ltlplan.reproduction.published import PUBLISHED
from ltlplan.reproduction.quantile_parts import QUANTILE_PARTS
from ltlplan.reproduction.race import RACE
from ltlplan.reproduction.team_flights import TEAM_FLIGHTS
from ltlplan.reproduction.team_parts import TEAM_PARTS
from verify.data import BadInput
from verify.data.errors import did_you_mean

ELEMENTS: tuple[Element, ...] = (
    *HOOPS_PARTS,
    *HOOPS_SEQUENCES,
    *HOOPS_FLIGHTS,
    *TEAM_PARTS,
    *TEAM_FLIGHTS,
    *QUANTILE_PARTS,
    *RACE,
    *PUBLISHED,
)
"""All of them."""


def chosen(names: Sequence[str]) -> tuple[Element, ...]:
    """Return the elements that names ask for, in the order of all; all where there are no names.

    Args:
        names: Ids, their beginnings (`2019`, `published-bai`) or their ends (`fig-14`); of the other publication, too.

    Raises:
        BadInput: No element has such a name.
    """
    if not names:
        return ELEMENTS
    found: set[str] = set()
    for name in names:
        named = {element.id for element in ELEMENTS if any(_named(own, name) for own in (element.id, *element.also))}
        if not named:
            known = [element.id for element in ELEMENTS]
            ends = [own.partition("-")[2] for own in known]
            hint = did_you_mean(name, (*known, *dict.fromkeys(ends)))
            raise BadInput(f"'{name}' is no element of the reproduction.{hint} Elements: {', '.join(known)}.")
        found |= named
    return tuple(element for element in ELEMENTS if element.id in found)


def _named(own: str, name: str) -> bool:
    return own == name or own.startswith(f"{name}-") or own.endswith(f"-{name}")
