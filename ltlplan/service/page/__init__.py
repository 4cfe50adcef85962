"""Page of the service in a browser: missions written with help, plans followed, flights watched, trusted, checked, taken away.

Begin with `frame`, which puts the tabs together: `missions` (Write), `plan`, `certificate_tab` (Trust), `simulations_tab`, `recording_tab` (Judge), `downloads_tab` (Take
away), `comparison` (Compare), `live` and `people_tab`. A flight is watched in `assets/flight.js`. `session_state` is what one person has open, `addresses` are those
of views, `derived_jobs` what was made of a flight. `next_steps` stands in empty tabs, `folding` shows the beginning of what is long. `elements` and `components` are the page's own parts over NiceGUI; scripts
of the latter are in `assets`. `judging` runs in workers, as all that computes.
NiceGUI is loaded only where pages are served.
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
