"""Addresses of views: what each shows, when it is opened, reloaded, or gone back to."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from ltlplan.service.event_inbox.names import NAME
from ltlplan.service.page.elements import say
from ltlplan.service.page.session_state import ADDRESS
from verify.data import LtlplanError

if TYPE_CHECKING:
    from ltlplan.service.page.session_state import Desk, Entry

_TAB = {address: tab for tab, address in ADDRESS.items()}


def read_address(desk: Desk, path: str) -> tuple[str, str]:
    """Return the tab and the job (empty for none) of an address, and note what else of it is looked at.

    Args:
        desk: What the person has open.
        path: The address within the service, such as `/jobs/ID/watch`; one that is none is the first tab's.
    """
    match path.strip("/").split("/"):
        case ["jobs", job, "compare", other]:
            desk.pair = (job, other)
            return "compare", ""
        case ["jobs", job]:
            return "plan", job
        case ["jobs", job, at]:
            desk.pair = ("", "")
            return _TAB.get(at, "plan"), job
        case ["studies", study] if study.isdecimal():
            desk.pair, desk.study = ("", ""), int(study)
            return "compare", ""
        case ["live", flight]:
            desk.flight = flight if re.fullmatch(NAME, flight) else None
            return "live", ""
        case ["compare"]:
            desk.pair, desk.study = ("", ""), None
            return "compare", ""
        case [at]:
            return _TAB.get(at, "write"), ""
        case _:
            return "write", ""


async def visit(desk: Desk, path: str, how: Entry) -> None:
    """Show what an address stands for; where it is a job that is not there, say so and show the list of jobs.

    Args:
        desk: What the person has open.
        path: The address, as `read_address` takes it.
        how: Entry of the browser's history that it is.
    """
    tab, job = read_address(desk, path)
    if not job:
        if path.strip("/") == ADDRESS[tab] and tab not in ("live", "people"):
            desk.leave_job()
        desk.show(tab, how)
        return
    try:
        await desk.open(job, tab, how)
    except LtlplanError as error:
        desk.leave_job()
        desk.show("plan", how)
        with desk.client.content:
            say(error)
