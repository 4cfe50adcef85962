"""Long lists and differences on the page: their beginning first, and all of them by a button."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from ltlplan.service.page.elements import Part, Words, box, button

Shown = TypeVar("Shown")


def folded(parts: Sequence[Shown], draw: Callable[[Sequence[Shown]], object], what: str, most: int = 24) -> None:
    """Show the first of many parts, with a button that shows all.

    Args:
        parts: All of them.
        draw: Makes the elements of some.
        what: The parts, in the plural.
        most: How many are shown at first; a few more are shown at once.
    """
    if len(parts) <= 1.25 * most:
        draw(parts)
        return
    place = Part(box())

    def turn(whole: bool) -> None:
        place.show(whole, lambda: draw(parts if whole else parts[:most]))
        more.set_text(f"Only the first {most} {what}" if whole else f"All {len(parts)} {what}")
        more.props(f"aria-expanded={'true' if whole else 'false'}")

    more = button("", lambda: turn(more.props["aria-expanded"] == "false"), "quiet")
    turn(False)


def differing(told: str) -> None:
    """Show a unified diff, what was added and what was removed in colours of their own; of a long one its beginning at first.

    Args:
        told: The diff; empty where nothing changed.
    """

    def draw(lines: Sequence[str]) -> None:
        with box("difference scroll", tag="pre").props('tabindex=0 role=group aria-label="What changed"'):
            for line in lines:
                kind = {"+": "added", "-": "removed", "@": "soft"}.get(line[:1], "")
                Words("span", line + "\n", kind)

    folded(told.splitlines()[2:] or ["nothing changed"], draw, "lines")
