"""The tab of results beside each other: studies of one mission over values, and two results side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui

from ltlplan.service.page.comparison.comparing import Comparing
from ltlplan.service.page.comparison.studies import Studies
from ltlplan.service.page.elements import box

if TYPE_CHECKING:
    from ltlplan.service.page.session_state import Desk


async def compare_tab(desk: Desk) -> None:
    """Make the tab, with what there is to see if it is the one that is opened.

    Args:
        desk: What the person has open.
    """
    with box("compare") as place:
        studies = box()
        comparing = Comparing(desk, place)

        def compare(first: str, second: str) -> None:
            desk.pair = first, second
            desk.show("compare")
            desk.client.run_javascript("scrollTo(0, 0)")

        with studies:
            listed = Studies(desk, compare)

    def turned(tab: str) -> None:
        if tab == "compare":
            with place:  # what was clicked may be drawn anew before they begin
                ui.timer(0.0, comparing.refresh, once=True)
                ui.timer(0.0, listed.refresh, once=True)

    if desk.tab == "compare":
        await comparing.refresh()
        await listed.refresh()
    desk.on_tab.append(turned)
