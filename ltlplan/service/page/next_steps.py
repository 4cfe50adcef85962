"""Next steps where a tab or a list has nothing to show: a sentence, and buttons that lead to what is missing."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from ltlplan.service.page.elements import Words, box, button

if TYPE_CHECKING:
    from nicegui.element import Element

    from ltlplan.service.page.session_state import Desk

_STEPS = {"plan": "Choose a job", "write": "Write a mission"}
"""Words on the button that leads to a tab."""


def offered_steps(sentence: str, steps: Mapping[str, Callable[[], object]]) -> Element:
    """Return what stands where nothing is.

    Args:
        sentence: What is missing, and what will be here.
        steps: What each button does, by its words.
    """
    with box("empty") as made:
        Words("p", sentence, "soft")
        with box("row"):
            for words, act in steps.items():
                button(words, act)
    return made


def next_steps(desk: Desk, sentence: str, tabs: Sequence[str] = tuple(_STEPS)) -> Element:
    """Return what stands in an empty tab or list.

    Args:
        desk: What the person has open.
        sentence: What is missing, and what will be here.
        tabs: Where the buttons lead.
    """
    return offered_steps(sentence, {_STEPS[tab]: partial(desk.show, tab) for tab in tabs})


def nothing_found(field: Element, sentence: str, search: Callable[[str], Awaitable[None]]) -> Element:
    """Return what stands in a list where a search found nothing: a button that ends the search.

    Args:
        field: Where the search is typed; it is emptied, and has the focus next.
        sentence: What was looked for.
        search: Searches for a text.
    """

    async def ended() -> None:
        focus(field, "made.value = '';")
        await search("")

    return offered_steps(sentence, {"Show all": ended})


def focus(field: Element, first: str = "") -> None:
    """Bring a field into sight and give it the focus.

    Args:
        field: The field.
        first: JavaScript that is done to it, as `made`, before.
    """
    made = f"const made = getHtmlElement({field.id});"
    field.client.run_javascript(f"{made} {first} made.scrollIntoView({{ block: 'center' }}); made.focus();")
