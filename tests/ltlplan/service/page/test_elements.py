"""The page's own elements: each has its script, wherever its module is."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("nicegui", reason="needs the service's extra")


def test_every_element_of_the_page_finds_its_script() -> None:
    from ltlplan.service.page.comparison.flight_pair import PairOfFlights
    from ltlplan.service.page.elements import Editor, Flight, LiveView, StopBar, World

    elements: dict[str, Any] = {
        "editor": Editor, "flight": Flight, "live_view": LiveView, "pair": PairOfFlights, "stop_bar": StopBar, "world": World,
    }  # fmt: skip
    for name, element in elements.items():
        assert element.component is not None, f"{name}: NiceGUI says nothing where a script is not found"
        assert element.component.path.is_file()
        assert element.component.name == name
