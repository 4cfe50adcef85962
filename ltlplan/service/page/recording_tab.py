"""The fifth tab: a recorded flight is dropped in, and checked claim by claim against what was certified."""

from __future__ import annotations

import asyncio
import json
from typing import TYPE_CHECKING, Any

from nicegui import ui
from nicegui.elements.upload_files import FileUpload
from nicegui.events import UploadEventArguments

from ltlplan.service.execution.derived import SHOWN, RecordingKept
from ltlplan.service.page.components import Flight
from ltlplan.service.page.derived_jobs import DerivedJobs
from ltlplan.service.page.elements import Words, box, button
from ltlplan.service.page.judging import recording_asked
from ltlplan.service.page.next_steps import next_steps
from ltlplan.service.people.roles import Action
from ltlplan.service.recordings import kept_name
from ltlplan.service.service import places
from ltlplan.service.views.recorded import judged
from verify.data import LtlplanError

if TYPE_CHECKING:
    from ltlplan.service.models import Job
    from ltlplan.service.page.session_state import Desk

_FIELDS = {
    "max_speed": ("No robot was faster than", "m/s", "1.5"),
    "error": ("Measured positions are off by at most", "m", "0.002"),
    "start": ("The flight began at", "s of its clock; empty finds it", "3.2 or quad0=3.2,quad1=5.7"),
    "start_error": ("That may be off by", "s", "0.1"),
    "pauses": ("Pauses between parts of the flight", "s", "4, 2.5"),
    "called": ("What the recording calls robots", "", "quad0=cf231, quad1=cf7"),
    "axes": ("The mission's x, y, z in its axes", "", "x,-z,y"),
    "origin": ("Where its origin lies in the mission", "m", "1.5,0,0 or quad0=1,0,0"),
}
"""What may be said of a recording: in words, its unit, and how it is written. Nothing is said unless somebody writes it."""
_KINDS = (
    "A recording of this job's flight: motion capture (t, robot, x, y, z ...), a Crazyflie's or PX4's log, a ROS 2 bag, a log of ours such "
    "as flight.csv; or a ZIP archive with a file for each robot, or a bag's folder."
)
_NO_JOB = "Choose a job that is done under Plan; its flight is what a recording is held against."
_NONE_KEPT = "None yet. A recording that was judged can be kept, with what was said of it and its verdict."
_NOT_TAKEN = "This file was not taken: a recording is one file (.csv, .tsv, .ulg, .mcap, .db3 or .zip), of a size that the service reads."

_PICK = """
<label class="pick" @vue:mounted="(node) => { node.el.querySelector('input').tabIndex = 0; }">Choose a recording, or drop one here<q-uploader-add-trigger /></label>
"""
"""Head of the upload: a label around the field itself, so that it has a name and is reached by the keyboard."""


class _Judging:
    """The tab while it is used. A verdict is seen as long as its file, what was said of it and its job are what they were."""

    def __init__(self, desk: Desk, flight: Flight) -> None:
        self.desk, self.flight = desk, flight
        self.fields = dict.fromkeys(_FIELDS, "")
        self.file: FileUpload | None = None
        self.job: str | None = None
        self.newest = 0
        self.note, self.missing = Words("p", _KINDS, "soft"), next_steps(desk, _NO_JOB)
        with box("judging") as self.form:
            self.upload = ui.upload(
                label="Drop a recording here", auto_upload=True, on_upload=self.uploaded, on_rejected=self.refused,
                max_file_size=desk.service.settings.limits.upload_bytes, max_files=1,
            ).props('accept=".csv,.tsv,.ulg,.mcap,.db3,.zip" flat')  # fmt: skip
            self.upload.add_slot("header", _PICK)
            self.upload.on("failed", self.refused)
            with box("bounds", tag="fieldset"):
                Words("legend", "What you know of the recording; the verdict rests on it", "soft")
                for key in _FIELDS:
                    self._field(key)
            with box("outcome").props("role=status aria-live=polite"):
                self.state = Words("p", "", "sentence")
                self.again = button("Judge it again", lambda: desk.guarded(self._judge(), self.form), "primary")
                self.keep = button("Keep it with the job", lambda: desk.guarded(self._keep(), self.form))
                self.keep.set_visibility(False)
            Words("h2", "Kept with this job")
            steps = {"Choose a recording": self._lead}
            self.kept = DerivedJobs(desk, "judge", ("recording",), _NONE_KEPT, self._offer, steps)
        desk.on_job.append(self.show)

    def _field(self, key: str) -> None:
        label, unit, example = _FIELDS[key]
        with box(tag="label"):
            Words("span", f"{label} ({unit})" if unit else label)
            field = ui.element("input").props(f"name={key} autocomplete=off maxlength=20000")
            field.props["placeholder"] = f"such as {example}"  # called, it would read the words as a list of properties
            field.on("input", lambda event: self._typed(key, event), js_handler="(event) => emit(event.target.value)")

    def _typed(self, key: str, event: Any) -> None:  # of any type: NiceGUI's events carry what the browser sends
        self.fields[key] = str(event.args)
        told = "" if self.file is None else f"{self.file.name} was judged with other words; judge it again."
        self._forget(told)

    def _forget(self, told: str) -> None:
        """Take the verdict away, also one that is on its way."""
        self.newest += 1
        self.flight.judge(None)
        self.state.set_text(told)
        self.again.set_visibility(self.file is not None)
        self.keep.set_visibility(False)

    def show(self, job: Job | None) -> None:
        """Say whether a recording can be checked; what was checked is another job's."""
        ready = job is not None and job.state == "done"
        if self.job != (job.id if job is not None and ready else None) or not ready:
            self.job = job.id if job is not None and ready else None
            self.file = None
            self._forget("")
        self.form.set_visibility(ready)
        self.note.set_visibility(ready)
        self.missing.set_visibility(not ready)

    def refused(self, _event: object = None) -> None:
        """Say that a file was not taken."""
        self.file = None
        self._forget(_NOT_TAKEN)
        self.upload.reset()

    async def uploaded(self, event: UploadEventArguments) -> None:
        """Check what was dropped."""
        self.file = event.file
        self.upload.reset()
        await self._judge()

    async def _judge(self) -> None:
        file, job = self.file, self.job
        if file is None or job is None:
            return
        self._forget(f"judging {file.name} ...")
        number = self.newest
        said = [
            f"{_FIELDS[key][0]}: {text.strip()} {_FIELDS[key][1].partition(' ')[0]}".strip()
            for key, text in self.fields.items()
            if text.strip()
        ]
        service = self.desk.service
        try:
            asked = recording_asked(self.fields)
            files = await places(self.desk.jobs, job)
            told = await service.questions.ask_in_folder(judged, files, await file.read(), asked, who=self.desk.who)
        except LtlplanError as error:
            if number == self.newest:
                self.state.set_text(f"{file.name} is not judged: {error}")
            return
        if number == self.newest:
            self.state.set_text(f"{file.name}: {told['words']}")
            self.flight.judge({**told, "file": file.name, "said": said})
            self.keep.set_visibility(self.desk.may(Action.PLAN))

    async def _keep(self) -> None:
        """Keep the recording with the job, and its verdict."""
        file, job = self.file, self.job
        if file is None or job is None:
            return
        data = await file.read()
        await self.desk.jobs.derive(job, RecordingKept(kept_name(file.name, data), recording_asked(self.fields), data))
        self.keep.set_visibility(False)
        await self.kept.refresh()
        self.kept.look()

    def _lead(self) -> None:
        """Bring the field for recordings into sight, with the focus."""
        field = f"getHtmlElement({self.upload.id}).querySelector('.pick input')"
        self.desk.client.run_javascript(f"{field}.scrollIntoView({{ block: 'center' }}); {field}.focus();")

    def _offer(self, job: Job) -> None:
        button("Show it", lambda: self.desk.guarded(self._show(job), self.form), label=f"Show {job.title}")

    async def _show(self, job: Job) -> None:
        """Show a verdict that was kept."""
        file = await self.desk.jobs.file(job.id, SHOWN)
        told = json.loads(await asyncio.to_thread(file.path.read_bytes))
        self._forget(f"{told['file']}: {told['words']}")
        self.flight.judge(told)


def judge_tab(desk: Desk, flight: Flight) -> None:
    """Make the tab.

    Args:
        desk: What the person has open.
        flight: Where the verdict is shown.
    """
    _Judging(desk, flight).show(None)
