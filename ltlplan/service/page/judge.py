"""The fifth tab: a recorded flight is dropped in, and judged claim by claim against what was certified."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from nicegui import ui
from nicegui.events import UploadEventArguments

from ltlplan.service.page.elements import Flight, Words, box, say
from ltlplan.service.page.judging import judged
from ltlplan.service.service import places
from verify.data import LtlplanError

if TYPE_CHECKING:
    from ltlplan.service.models import Job
    from ltlplan.service.page.desk import Desk

_SPEED = "1.5"
"""m/s; the bound on a robot's speed that is filled in at first."""


class _Judging:
    """The tab while it is used."""

    def __init__(self, desk: Desk, flight: Flight) -> None:
        self.desk, self.flight = desk, flight
        self.bounds = {"max_speed": _SPEED, "error": "0.002", "start": ""}
        self.note = Words("p", "", "soft")
        with box("judging") as self.form:
            self.upload = ui.upload(
                label="Drop a recording here", auto_upload=True, on_upload=self.uploaded, on_rejected=self.refused,
                max_file_size=desk.service.settings.limits.upload_bytes, max_files=1,
            ).props('accept=".csv,.tsv,.ulg,.mcap,.db3,.zip" flat')  # fmt: skip
            with box("bounds"):
                self._field("max_speed", "No robot was faster than (m/s)")
                self._field("error", "A measured position is off by at most (m)")
                self._field("start", "The flight began at (s); empty finds it")
            self.state = Words("p", "", "sentence").props("role=status aria-live=polite")
        desk.on_job.append(self.show)

    def _field(self, key: str, label: str) -> None:
        with box(tag="label"):
            Words("span", label)
            field = ui.element("input").props(f'inputmode=decimal value="{self.bounds[key]}" name={key}')

            def typed(event: Any) -> None:  # of any type: NiceGUI's events carry what the browser sends
                self.bounds[key] = str(event.args).strip()

            field.on("input", typed, js_handler="(event) => emit(event.target.value)")

    def show(self, job: Job | None) -> None:
        """Say whether a recording can be judged."""
        ready = job is not None and job.state == "done"
        self.form.set_visibility(ready)
        self.state.set_text("")
        said = (
            "A recording of this job's flight: motion capture (t, robot, x, y, z ...), a Crazyflie's or PX4's log, a ROS 2 bag, a log of ours such "
            "as flight.csv; or a ZIP archive with a file for each robot, or a bag's folder."
        )
        self.note.set_text(
            said if ready else "Choose a job that is done under Plan; its flight is what a recording is held against."
        )

    def refused(self) -> None:
        """Say that a file was not taken."""
        with self.form:
            say(
                "This file was not taken: a recording is one file (.csv, .tsv, .ulg, .mcap, .db3 or .zip), of a size that the service reads."
            )

    async def uploaded(self, event: UploadEventArguments) -> None:
        """Judge what was dropped."""
        data = await event.file.read()
        self.upload.reset()
        job = self.desk.job
        if job is None:
            return
        self.state.set_text(f"judging {event.file.name} ...")
        try:
            questions = self.desk.service.questions
            told = await questions.ask_in_folder(
                judged, await places(self.desk.service.jobs, job.id), data, self._given(), who=self.desk.who
            )
        except LtlplanError as error:
            self.state.set_text("")
            with self.form:
                say(error)
            return
        self.state.set_text(f"{event.file.name}: {told['words']}")
        self.flight.judge(told)

    def _given(self) -> dict[str, float]:
        from verify.data import BadInput

        given: dict[str, float] = {}
        for key, text in self.bounds.items():
            if not text:
                continue
            try:
                given[key] = float(text)
            except ValueError:
                raise BadInput(f"'{text}' is no number.") from None
        return given


def judge_tab(desk: Desk, flight: Flight) -> None:
    """Make the tab.

    Args:
        desk: What the person has open.
        flight: Where the verdict is shown.
    """
    _Judging(desk, flight).show(None)
