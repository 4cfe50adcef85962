"""Next steps where a tab has nothing to show: a sentence, and buttons that lead to what is missing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ltlplan.service.page.elements import Words, box, button

if TYPE_CHECKING:
    from nicegui.element import Element

    from ltlplan.service.page.session_state import Desk

_STEPS = {"plan": "Choose a job", "write": "Write a mission"}
"""Words on the button that leads to a tab."""


def next_steps(desk: Desk, sentence: str, tabs: Sequence[str] = tuple(_STEPS)) -> Element:
    """Return what stands in an empty tab.

    Args:
        desk: What the person has open.
        sentence: What is missing, and what will be here.
        tabs: Where the buttons lead.
    """
    with box("empty") as made:
        Words("p", sentence, "soft")
        with box("row"):
            for tab in tabs:
                button(_STEPS[tab], lambda tab=tab: desk.show(tab))
    return made
