"""Page of the service in a browser: missions written with help, plans followed, flights watched, trusted, checked, taken away.

Begin with `frame`, which puts one module a tab together (`write`, `plan`, `certificate_tab`, `simulations_tab`, `recording_tab`, `downloads_tab`, `compare_tab`, `live`, `people_tab`).
A flight is watched in `assets/flight.js`. `session_state` is what one person has open, `drafted` what they write, `stored` what they find and store,
`varying` begins a study, `studies` shows them, `comparing` two results, with their flights as a `flight_pair`;
`derived_jobs` what was made of a flight.
`elements` are the page's own parts over NiceGUI, whose scripts are in `assets`. `checking` and `judging` run in workers, as all that computes.
NiceGUI is loaded only where pages are served. `mission_text` edits one value of a mission file that is being written.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fastapi import FastAPI

    from ltlplan.service.service import Service


def add_pages(server: FastAPI, service: Service) -> None:
    """Make the page part of a server; one a process, because NiceGUI has one app a process.

    Args:
        server: Whose routes it joins; they come first.
        service: What it shows.

    Raises:
        MissingEngine: NiceGUI is not installed.
    """
    try:
        from ltlplan.service.page.frame import put_pages
    except ModuleNotFoundError as error:
        if error.name is None or not error.name.startswith("nicegui"):
            raise
        from verify.data import MissingEngine

        raise MissingEngine("The page needs NiceGUI: pip install 'ltlplan[service]'.") from None
    put_pages(server, service)
