"""Two flights that play side by side on one clock."""

from __future__ import annotations

from nicegui.element import Element


class PairOfFlights(Element, component="../assets/pair.js"):
    """Two flights on one clock; the scenes' own scripts come with the mission's world."""

    def show(self, first: str | None, second: str | None) -> None:
        """Show two flights.

        Args:
            first: Where the one's `watch.json` is; None shows none.
            second: Where the other's is.
        """
        if (self._props.get("first"), self._props.get("second")) != (first or "", second or ""):
            self._props["first"], self._props["second"] = first or "", second or ""
            self.update()
