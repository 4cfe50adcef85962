"""State of one person's session: a job, its mission's text, a tab. The tabs receive its changes, and make them."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from nicegui import Client, background_tasks
from nicegui.element import Element

from ltlplan.service.page.elements import say
from ltlplan.service.people.roles import Action, Principal, allows
from ltlplan.service.people.user_jobs import UserJobs
from ltlplan.service.problems import NotFound
from ltlplan.service.security.tokens import LOCAL
from verify.data import LtlplanError

if TYPE_CHECKING:
    from ltlplan.service.models import Job
    from ltlplan.service.service import Service

TABS = ("write", "plan", "watch", "trust", "simulate", "judge", "take away", "compare", "live", "people")
ADDRESS = {tab: tab.replace(" ", "-") for tab in TABS}
Entry = Literal["new", "instead", "back"]
"""How what is seen comes into the browser's history: as a new entry, instead of the present one, or as one that was gone back to."""


@dataclass(eq=False)
class Desk:
    """State of one person's session.

    Attributes:
        service: The running service.
        client: The browser's page.
        job: The job that is looked at.
        tab: The tab that is seen.
        flight: Name of the flight in the air that is looked at.
        study: The study that is looked at.
        pair: Jobs that are compared; empty for none.
        principal: Who looks.
        session: The session by which they logged in, if they did.
        texts: Missions as they were written, by the job that was made of them.
        on_job: Receives the job when it is another one or has come further.
        on_progress: Receives a sentence and the share done while it is computed.
        on_tab: Receives the tab when it is another one.
        write: Shows a mission's text in the first tab.
        written: Finds the text that a job was made of, in this browser or of this user.
    """

    service: Service
    client: Client
    principal: Principal
    session: str = ""
    job: Job | None = None
    tab: str = "write"
    flight: str | None = None
    study: int | None = None
    pair: tuple[str, str] = ("", "")
    texts: dict[str, str] = field(default_factory=dict[str, str])
    on_job: list[Callable[[Job | None], None]] = field(default_factory=list[Callable[["Job | None"], None]])
    on_progress: list[Callable[[str, float], None]] = field(default_factory=list[Callable[[str, float], None]])
    on_tab: list[Callable[[str], None]] = field(default_factory=list[Callable[[str], None]])
    write: Callable[[str], Awaitable[None]] | None = None
    written: Callable[[str], Awaitable[str | None]] | None = None
    _following: asyncio.Task[None] | None = None

    @property
    def who(self) -> str:
        """Name under which what is asked is counted: the user's, or an address."""
        return self.principal.client

    @property
    def user(self) -> str | None:
        """The user's name, where somebody logged in."""
        return None if self.principal.user == LOCAL else self.principal.user

    @property
    def jobs(self) -> UserJobs:
        """Jobs as this person has them."""
        return self.service.jobs_of(self.principal)

    def may(self, action: Action) -> bool:
        """Return whether this person may do something. Another role ends the session, and this page with it."""
        return allows(self.principal.role, action)

    async def open(self, job_id: str, tab: str, how: Entry = "new") -> None:
        """Look at a job.

        Args:
            job_id: The job's.
            tab: The tab to be seen.
            how: Entry of the browser's history that it is.

        Raises:
            BadInput: There is no such job.
        """
        job = await self.jobs.job(job_id)
        self._set_job(job)
        self.show(tab, how)
        self.leave()
        if job.ended is None:
            self._following = background_tasks.create(self._follow(job_id), name=f"following job {job_id}")

    def leave_job(self) -> None:
        """Look at no job any more."""
        self.leave()
        self._set_job(None)

    async def look(self) -> None:
        """Look at no job any more that is gone, and say so; what is open beside it stays."""
        job = self.job
        if job is None:
            return
        try:
            await self.jobs.job(job.id)
        except NotFound:
            if self.job is None or self.job.id != job.id:
                return
            self.leave_job()
            self.show(self.tab, "instead")
            with self.client.content:
                say(f"The job of {job.mission} was deleted, or is no longer shared with you.", stays=True)

    def leave(self) -> None:
        """Stop following the job."""
        if self._following is not None:
            self._following.cancel()
            self._following = None

    def path_of(self, tab: str) -> str:
        """Return the address of what a tab shows, so that a reload, a link and the history show it again."""
        match tab:
            case "write":
                return "/"
            case "live":
                return "/live" if self.flight is None else f"/live/{self.flight}"
            case "people":
                return "/people"
            case "compare" if all(self.pair):
                return "/jobs/{}/compare/{}".format(*self.pair)
            case "compare" if self.study is not None:
                return f"/studies/{self.study}"
            case _:
                return f"/{ADDRESS[tab]}" if self.job is None else f"/jobs/{self.job.id}/{ADDRESS[tab]}"

    def show(self, tab: str, how: Entry = "new") -> None:
        """Show a tab, and note it in the address.

        Args:
            tab: The tab.
            how: Entry of the browser's history that it is.
        """
        self.tab = tab
        for told in self.on_tab:
            told(tab)
        self.client.run_javascript(f"noteView({json.dumps(self.path_of(tab))}, {json.dumps(how)})")

    def show_study(self, study: int) -> None:
        """Show a study."""
        self.study, self.pair = study, ("", "")
        self.show("compare")

    async def edit(self, text: str) -> None:
        """Show a mission's text where missions are written."""
        self.show("write")
        if self.write is not None:
            await self.write(text)

    async def text_of(self, job: Job) -> str:
        """Return a job's mission as it was written here, or as it was resolved."""
        known = self.texts.get(job.id) or (None if self.written is None else await self.written(job.id))
        return known or await self.jobs.mission(job.id)

    async def guarded(self, work: Awaitable[None], place: Element | None = None) -> None:
        """Wait for work, and say in words what goes wrong with it.

        Args:
            work: The work.
            place: Where in the page it belongs.
        """
        try:
            await work
        except LtlplanError as error:
            with place or self.client.content:
                say(error)

    def _set_job(self, job: Job | None) -> None:
        if job == self.job:
            return
        self.job = job
        for told in self.on_job:
            told(job)

    async def _follow(self, job_id: str) -> None:
        """Tell the tabs what happens to a job until it ends."""
        jobs = self.jobs
        try:
            async for event in jobs.events(job_id):
                if self.job is None or self.job.id != job_id:
                    return
                if event.kind == "progress":
                    for told in self.on_progress:
                        told(event.sentence, event.share)
                elif event.kind in ("stage", "state"):
                    self._set_job(await jobs.job(job_id))
            self._set_job(await jobs.job(job_id))
        except NotFound:
            await self.look()
