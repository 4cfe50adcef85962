"""The page's own elements: each has its script, wherever its module is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui", reason="needs the service's extra")


def test_every_element_of_the_page_finds_its_script() -> None:
    from ltlplan.service.page.comparison.flight_pair import PairOfFlights
    from ltlplan.service.page.components import Editor, Flight, LiveView, StopBar, World

    elements: dict[str, Any] = {
        "editor": Editor, "flight": Flight, "live_view": LiveView, "pair": PairOfFlights, "stop_bar": StopBar, "world": World,
    }  # fmt: skip
    for name, element in elements.items():
        assert element.component is not None, f"{name}: NiceGUI says nothing where a script is not found"
        assert element.component.path.is_file()
        assert element.component.name == name


def test_no_script_of_the_page_is_longer_than_a_module_may_be() -> None:
    from ltlplan.service.page import frame

    scripts = sorted((Path(frame.__file__).parent / "assets").glob("*.js"))
    assert len(scripts) > 5
    assert {each.name: count for each in scripts if (count := len(each.read_text().splitlines())) > 400} == {}
