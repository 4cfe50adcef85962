"""The sixth tab: what a job made, to be taken away: files, exports, the report, a link."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING
from urllib.parse import quote

from nicegui import ui

from ltlplan.service import queries as asked
from ltlplan.service.execution.exporting import ExportAsked
from ltlplan.service.page.elements import Part, Words, box, button, link, say
from ltlplan.service.page.next_steps import next_steps
from ltlplan.service.page.plan import proof_of
from ltlplan.service.people.roles import Action
from ltlplan.service.problems import error_of
from verify.data import LtlplanError

if TYPE_CHECKING:
    from ltlplan.service.models import Job
    from ltlplan.service.page.session_state import Desk

_WHAT = {
    "mission.yaml": "the mission with every default written out",
    "plan.json": "words, visits and waypoints",
    "certificate.json": "every claim, with digests of what it covers",
    "statement.json": "what is proved, for the kernel",
    "proof.json": "the evidence for it",
    "check.pyz": "the kernel: python check.pyz FOLDER",
    "flight.csv": "the simulated flight",
    "report.html": "the report: one file that opens without a network",
    "manifest.json": "digests of all files",
    "watch.json": "what this page plays",
}


_PATIENCE = 30.0
"""s between looks at an export that is being written."""


class _Away:
    """The tab while it is used."""

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        self.part = Part(box("away"))
        self.formats: dict[str, list[str]] = {}
        desk.on_job.append(self.show)

    def show(self, job: Job | None) -> None:
        """Offer what a job made."""
        self.part.show(None if job is None else (job.id, job.state, job.files), lambda: self._draw(job))

    def _draw(self, job: Job | None) -> None:
        if job is None:
            next_steps(self.desk, "Choose a job under Plan; what it made is here.")
            return
        self._address(job)
        if not job.files:
            Words("p", "This job has made no files.", "soft")
            return
        if job.state == "done":
            self._together(job)
        _files(job)

    def _address(self, job: Job) -> None:
        with box("row link"):
            Words("span", "A link to this job:", "soft")
            path = f"/jobs/{job.id}"
            link(path, path)
            button(
                "Copy it",
                lambda: ui.run_javascript(f"navigator.clipboard.writeText(location.origin + {json.dumps(path)})"),
                "quiet",
            )

    def _together(self, job: Job) -> None:
        with box("row"):
            if any(file.name == "report.html" for file in job.files):
                link(f"/api/jobs/{job.id}/report", "Open the report", "button primary").props("target=_blank")
            link(f"/api/jobs/{job.id}/archive", "All files as one archive", "button").props("download")
            if any(file.name == "statement.json" for file in job.files):
                link(f"/api/jobs/{job.id}/proof", "The proof and its checker", "button").props("download")
        for sentence in proof_of(job)[-1:]:
            Words("p", f"{sentence}.", "soft")
        if not self.desk.may(Action.PLAN):
            return
        Words("h2", "For a vehicle")
        Words(
            "p",
            "The certificate is proved again, and the flight flown in simulation, before anything is written for a vehicle.",
            "soft",
        )
        place = box("row exports")
        state = Words("p", "", "soft").props("role=status")  # beside what was clicked, not below the files
        ui.timer(0.0, lambda: self._exports(job, place, state), once=True)

    async def _exports(self, job: Job, place: ui.element, state: Words) -> None:
        if not self.formats:
            try:
                listed = await self.desk.service.questions.ask(asked.export_formats, who=self.desk.who)
                self.formats = {each["name"]: each["controllers"] for each in json.loads(listed)}
            except ValueError as error:
                say(error)
        with place:
            for name, controllers in self.formats.items():
                # of vehicles whose controller is not modelled every export is one without a rehearsal
                wanted = ExportAsked(name, anyway=not controllers)
                label = name if controllers else f"{name}, not rehearsed"
                button(label, lambda wanted=wanted, label=label: self._export(job, wanted, label, state))

    async def _export(self, job: Job, wanted: ExportAsked, label: str, state: Words) -> None:
        """Have the flight written, and give the archive when it is."""
        jobs = self.desk.jobs
        state.set_text(f"{label} is being written ...")
        try:
            made = await jobs.derive(job.id, wanted)
            while made.ended is None:
                made = await jobs.waited(made.id, _PATIENCE)
            if made.problem is not None:
                raise error_of(made.problem)
        except LtlplanError as error:
            state.set_text("")
            with self.part.place:
                say(error)
            return
        state.set_text(f"{label} is written." if made.state == "done" else f"{label} was cancelled.")
        if made.state == "done":
            anyway = "?anyway=true" if wanted.anyway else ""
            ui.download.from_url(f"/api/jobs/{job.id}/exports/{quote(wanted.target, safe='')}{anyway}")


def _files(job: Job) -> None:
    Words("h2", "Files")
    Words("p", "Unpacked from the archive they are a folder that `ltlplan recheck` proves again.", "soft")
    with box("scroll"), box(tag="table"), box(tag="tbody"):
        for file in job.files:
            what = _WHAT.get(file.name) or (
                "a robot's polynomials" if file.name.endswith(".csv") and "/" not in file.name else ""
            )
            with box(tag="tr"):
                with box(tag="td"):
                    link(f"/api/jobs/{job.id}/files/{file.name}", file.name).props("download")
                Words("td", f"{file.size / 1000:,.1f} kB", "number")
                Words("td", what, "soft")


def take_away_tab(desk: Desk) -> None:
    """Make the tab.

    Args:
        desk: What the person has open.
    """
    _Away(desk).show(None)
