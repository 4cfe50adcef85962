"""Jobs that were made of a job's flight, listed on the page as they go: campaigns and rehearsals, kept recordings."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from nicegui import ui

from ltlplan.service.models import ENDED
from ltlplan.service.page.comparison.studies import STATES
from ltlplan.service.page.elements import Part, Words, box, button, link, progress_bar, table
from ltlplan.service.page.next_steps import offered_steps
from ltlplan.service.people.roles import Action
from verify.data import LtlplanError

if TYPE_CHECKING:
    from nicegui.element import Element

    from ltlplan.service.models import DerivedKind, Job
    from ltlplan.service.page.session_state import Desk

_REFRESH = 1.5
"""s between looks while one is going and the tab is seen."""

Extra = Callable[["Job"], None]


class DerivedJobs:
    """List of what was made of the job that is looked at.

    Args:
        desk: What the person has open.
        tab: The tab that it is on.
        kinds: What is listed.
        none: Said where there is none.
        extra: Draws what else can be done with one that is done.
        steps: What buttons do where there is none, by their words; without any the forms beside the list say it.
    """

    def __init__(
        self,
        desk: Desk,
        tab: str,
        kinds: tuple[DerivedKind, ...],
        none: str,
        extra: Extra | None = None,
        steps: Mapping[str, Callable[[], object]] = MappingProxyType({}),
    ) -> None:
        self.desk, self.tab, self.kinds, self.none, self.extra, self.steps = desk, tab, kinds, none, extra, steps
        self.place = box("derived")
        self.part = Part(self.place)
        self.going: dict[str, tuple[Element, Words]] = {}
        self.timer = ui.timer(_REFRESH, self.refresh, active=False)
        desk.on_tab.append(lambda _tab: self.look())
        desk.on_job.append(lambda _job: self.look())

    def look(self) -> None:
        """Look as long as the tab is seen and there is something to see."""
        job = self.desk.job
        self.timer.activate() if self.desk.tab == self.tab and job is not None and job.files else self.timer.deactivate()

    async def refresh(self) -> None:
        """List them again where something changed."""
        job = self.desk.job
        try:
            listed = [] if job is None else [each for each in await self.desk.jobs.derived(job.id) if each.kind in self.kinds]
        except LtlplanError:
            listed = []
        if all(each.state in ENDED for each in listed):
            self.timer.deactivate()
        still = [each.model_copy(update={"share": 0.0, "sentence": ""}) for each in listed]
        self.part.show(still, lambda: self._draw(listed))
        for each in listed:
            if each.id in self.going:
                bar, sentence = self.going[each.id]
                bar.props(f"value={each.share:.3f}")
                sentence.set_text(f"{each.sentence or 'waits for a free worker'} ...")

    def _draw(self, listed: list[Job]) -> None:
        self.going.clear()
        if not listed:
            offered_steps(self.none, self.steps)
        for each in listed:
            with box(f"stage {each.state}", tag="section"):
                self._one(each)

    def _one(self, job: Job) -> None:
        with box("line"):
            Words("b", job.title)
            Words("span", STATES[job.state], f"chip {job.state}")
        if job.state not in ENDED:
            self.going[job.id] = progress_bar(job.share), Words("p", "", "sentence")
        if job.problem is not None:
            Words("p", job.problem.detail, "verdict fails")
        found = job.stages[-1].found if job.stages else {}
        for sentence in found.get("sentences", ()):
            Words("p", sentence)
        if rows := found.get("rows"):
            table(rows[0], rows[1:])
        if job.kind == "recording" and "words" in found:
            Words("p", found["sentence"])
            Words("p", "Said: " + (", ".join(found["said"]) or "nothing") + ".", "soft")
        with box("row"):
            if job.state == "done" and self.extra is not None:
                self.extra(job)
            if any(file.name.endswith(".html") for file in job.files):
                link(f"/api/jobs/{job.id}/report", "Open the report", "button").props("target=_blank")
            for file in job.files:
                if not file.name.endswith((".html", ".yaml", "plan.json", "shown.json")):
                    link(f"/api/jobs/{job.id}/files/{file.name}", file.name, "button").props("download")
            if self.desk.may(Action.PLAN) and self.desk.jobs.owns(job):
                label = "Cancel" if job.state not in ENDED else "Delete"
                button(label, lambda: self._end(job), "quiet", label=f"{label} {job.title}")

    async def _end(self, job: Job) -> None:
        jobs = self.desk.jobs
        if job.state in ENDED:
            await self.desk.guarded(jobs.delete(job.id), self.place)
        else:
            await self.desk.guarded(_cancelled(jobs.cancel(job.id)), self.place)
        await self.refresh()


async def _cancelled(work: Awaitable[object]) -> None:
    await work
