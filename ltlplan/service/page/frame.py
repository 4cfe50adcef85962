"""The page's frame: what stands above the tabs, and how they are put together for one person."""

from __future__ import annotations

from importlib import resources
from typing import TYPE_CHECKING

from fastapi import Request, Response
from nicegui import app, ui
from nicegui.element import Element

from ltlplan.report.inline import package_text
from ltlplan.service.api.application import answer_bug, answer_of
from ltlplan.service.page.addresses import read_address, visit
from ltlplan.service.page.certificate_tab import trust_tab
from ltlplan.service.page.comparison.compare_tab import compare_tab
from ltlplan.service.page.components import Flight, StopBar
from ltlplan.service.page.downloads_tab import take_away_tab
from ltlplan.service.page.elements import Words, box, button, view_link
from ltlplan.service.page.live import live_tab
from ltlplan.service.page.missions.write import write_tab
from ltlplan.service.page.people_tab import people_tab
from ltlplan.service.page.plan import plan_tab
from ltlplan.service.page.recording_tab import judge_tab
from ltlplan.service.page.session_state import ADDRESS, TABS, Desk
from ltlplan.service.page.simulations_tab import simulations_tab
from ltlplan.service.people.roles import Action
from ltlplan.service.problems import NotFound
from verify.data import LtlplanError

if TYPE_CHECKING:
    from fastapi import FastAPI

    from ltlplan.service.models import Job
    from ltlplan.service.service import Service

_SIGNS = {"queued": "waits", "running": "runs", "done": "done", "failed": "refused", "cancelled": "cancelled"}
_ARROWS = """(event) => {
  const tabs = Array.from(event.currentTarget.children);
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!step) return;
  event.preventDefault();
  event.stopPropagation();
  const next = tabs[(tabs.indexOf(document.activeElement) + step + tabs.length) % tabs.length];
  next.focus();
  next.click();
}"""
"""Arrow keys go from tab to tab, as keyboards expect of tabs."""

_LOOK = 3.0
"""s between looks at whether the job that is open is still there."""
_FAVICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32"><g fill="none" stroke="#1f77e0" stroke-width="3">'
    '<circle cx="8" cy="8" r="5"/><circle cx="24" cy="8" r="5"/><circle cx="8" cy="24" r="5"/><circle cx="24" cy="24" r="5"/>'
    '<path d="M11 11l10 10M21 11l-10 10"/></g></svg>'
)


def put_pages(server: FastAPI, service: Service) -> None:
    """Make the page part of a server.

    Args:
        server: Whose routes it joins; they come first.
        service: What it shows.
    """
    ui.add_css(package_text("style.css"), shared=True)
    assets = resources.files("ltlplan.service.page") / "assets"
    ui.add_css((assets / "page.css").read_text(encoding="utf-8"), shared=True)
    ui.add_head_html(f"<script>{(assets / 'session.js').read_text(encoding='utf-8')}</script>", shared=True)

    async def page() -> None:
        client = ui.context.client
        asked = client.request
        await _page(Desk(service, client, asked.state.principal, asked.state.asker.session), asked.url.path)

    for path in ("/", "/jobs/{job}", "/jobs/{job}/compare/{other}", "/studies/{study:int}", "/live/{flight}"):
        ui.page(path)(page)
    for tab in TABS[1:]:
        for path in (f"/{ADDRESS[tab]}", f"/jobs/{{job}}/{ADDRESS[tab]}"):
            ui.page(path)(page)
    _put_errors()
    app.config.socket_io_js_transports = ["websocket", "polling"]
    ui.run_with(
        server, title="ltlplan", favicon=_FAVICON, dark=None, tailwind=False, show_welcome_message=False, reconnect_timeout=10.0,
        language="en-US",
    )  # fmt: skip


def _put_errors() -> None:
    """Let pages that are not there, and bugs, be told as everywhere here, without NiceGUI's own pages."""

    @app.exception_handler(404)
    async def missing(request: Request, error: Exception) -> Response:
        cause = error if isinstance(error, LtlplanError) else NotFound(f"There is no page {request.url.path[:100]}.")
        return answer_of(request, cause, 404)

    app.exception_handler(Exception)(answer_bug)


async def _page(desk: Desk, path: str) -> None:
    client = desk.client
    desk.tab, _ = read_address(desk, path)
    client.on_delete(desk.leave)
    ui.on("went", lambda event: visit(desk, str(event.args), "back"))
    client.layout.classes("page")
    with client.layout:
        _header(desk).move(client.layout, target_index=0)
    with box("tabs") as tabs:
        panels = {
            name: box("panel").props(f"role=tabpanel id={ADDRESS[name]}-panel aria-labelledby={ADDRESS[name]}-tab")
            for name in TABS
            if name != "watch"
        }
        flight = Flight()
    tabs.set_visibility(False)  # the first timer has the page sent, however much of it is made by then
    with panels["write"]:
        await write_tab(desk)
    with panels["plan"]:
        await plan_tab(desk)
    with panels["trust"]:
        trust_tab(desk, flight)
    with panels["simulate"]:
        simulations_tab(desk)
    with panels["judge"]:
        judge_tab(desk, flight)
    with panels["take away"]:
        take_away_tab(desk)
    with panels["compare"]:
        await compare_tab(desk)
    with panels["live"]:
        await live_tab(desk)
    with panels["people"]:
        people_tab(desk)
    if desk.may(Action.FLY):
        StopBar()

    def turned(to: str) -> None:
        for name, panel in panels.items():
            panel.set_visibility(name == to)
        flight.set_visibility(to in ("watch", "trust", "judge"))
        if to in ("watch", "trust", "judge"):
            flight.look(to)

    def come_further(found: Job | None) -> None:
        seen = found is not None and any(file.name == "watch.json" for file in found.files)
        flight.show(f"/api/jobs/{found.id}/files/watch.json" if found is not None and seen else None)

    desk.on_tab.append(turned)
    desk.on_job.append(come_further)
    looks = ui.timer(_LOOK, desk.look, active=False)
    desk.on_job.append(lambda found: looks.activate() if found is not None else looks.deactivate())
    await visit(desk, path, "instead")
    tabs.set_visibility(True)


def _header(desk: Desk) -> Element:
    with box("top", tag="header") as header:
        title = Words("h1", "ltlplan", "brand")
        tabs: dict[str, Words] = {}
        with box("tablist", tag="nav").props('role=tablist aria-label="Parts of the page"') as row:
            row.on("keydown", js_handler=_ARROWS)
            for name in TABS:
                tabs[name] = view_link(desk.path_of(name), name.capitalize(), lambda name=name: desk.show(name)).props(
                    f"role=tab id={ADDRESS[name]}-tab"
                )
            tabs["people"].set_visibility(desk.user is not None)
        at = button("", lambda: desk.show("plan"), "current", label="The job that is looked at")
        at.set_visibility(False)
        if desk.user is not None:
            with box("leave", tag="form").props("method=post action=/logout"):
                leave = Words("button", "Log out", "quiet").props("type=submit")
                leave.props["title"] = f"You are {desk.user}, {desk.principal.role.name}"

    def turned(to: str) -> None:
        title.props["aria-label"] = f"ltlplan: {to}"
        title.update()
        seen = f"document.getElementById('{ADDRESS[to]}-tab')?.scrollIntoView({{ block: 'nearest', inline: 'nearest' }})"
        desk.client.run_javascript(seen)
        for name, tab in tabs.items():
            tab.props["href"] = desk.path_of(name)
            tab.props(f"aria-selected={'true' if name == to else 'false'} tabindex={0 if name == to else -1}")

    def come_further(job: Job | None) -> None:
        at.set_visibility(job is not None)
        if job is not None:
            at.set_text(f"{job.mission}: {_SIGNS[job.state]}")
            at.classes(replace=f"current {job.state}")

    desk.on_tab.append(turned)
    desk.on_job.append(come_further)
    return header
