"""Studies on the page: a list, and of one of them a table and a plot that grow while its jobs run."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, get_args

from nicegui import ui

from ltlplan.service.page.elements import Part, Words, box, button, choice, link, say, search_field, view_link
from ltlplan.service.page.next_steps import next_steps, nothing_found
from ltlplan.service.people.roles import Action
from ltlplan.service.people.user_studies import written
from ltlplan.service.study_models import Figure
from ltlplan.service.views.plots import NAMES, study_plot
from verify.data import LtlplanError

if TYPE_CHECKING:
    from ltlplan.service.page.session_state import Desk
    from ltlplan.service.study_models import Figures, Study, StudyMember

_REFRESH = 2.0
"""s between looks while the tab is seen."""
_NONE = "None yet. Write a mission, and press Study ... beside Plan it."
STATES = {
    "queued": "waits",
    "running": "runs",
    "done": "done",
    "failed": "refused",
    "cancelled": "cancelled",
    "deleted": "deleted",
}


class Studies:
    """The studies while the tab is used.

    Args:
        desk: What the person has open.
        compare: Shows two jobs side by side.
    """

    def __init__(self, desk: Desk, compare: Callable[[str, str], object]) -> None:
        self.desk, self._compare = desk, compare
        self.of = desk.service.studies_of(desk.principal)
        self.wanted, self.figure = "", "duration"
        self.chosen: list[str] = []
        with box("planning"):
            with box("jobs", tag="section").props('aria-label="Studies"'):
                Words("h2", "Studies")
                self.field = search_field("Search studies by name, key, owner or project", self._search)
                self.list = Part(box("job-list", tag="ul"))
            with box("job", tag="section").props('aria-label="The study"') as self.place:
                self.head, self.plot = Part(box("head")), Part(box("study-plot"))
                self.table = Part(box("study-table"))
        desk.on_tab.append(lambda tab: self.timer.activate() if tab == "compare" else self.timer.deactivate())
        self.timer = ui.timer(_REFRESH, self.refresh, active=False)

    async def _search(self, wanted: str) -> None:
        self.wanted = wanted
        await self.refresh()

    async def refresh(self) -> None:
        """Look at the studies again."""
        listed: tuple[Study, ...] = ()
        try:
            listed = await self.of.listed(search=self.wanted)
            if self.desk.study is None and listed and not self.wanted:
                self.desk.study = listed[0].id
            found = None if self.desk.study is None else await self.of.study(self.desk.study)
        except LtlplanError as error:
            self.show(None, str(error))
            return
        finally:
            self.list.show((listed, self.desk.study, self.wanted), lambda: self._entries(listed))
        self.show(found)

    def _entries(self, listed: tuple[Study, ...]) -> None:
        if not listed:
            with box(tag="li"):
                if self.wanted:
                    nothing_found(self.field, "No study has this in its name, key, owner or project.", self._search)
                else:
                    next_steps(self.desk, _NONE, ("write",))
        for each in listed:
            with box(tag="li"), view_link(f"/studies/{each.id}", "", lambda each=each: self._open(each.id), "entry") as entry:
                Words("b", each.name)
                Words("span", f"{each.size}", "chip")
                Words("small", f"{each.key}{_whose(each, self.desk.user)}", "soft")
            entry.props(f"aria-current={'true' if each.id == self.desk.study else 'false'}")

    async def _open(self, study: int) -> None:
        self.chosen = []
        self.desk.show_study(study)
        await self.refresh()

    def show(self, study: Study | None, why: str = "") -> None:
        """Show a study as far as it has come; where there is none, why."""
        if study is None:
            self.head.show(why, lambda: Words("p", why).props("role=alert") if why else None)
            for part in (self.plot, self.table):
                part.show(None, lambda: None)
            return
        going = sum(member.figures.state in ("queued", "running") for member in study.members)
        self.head.show((study.id, study.name, going), lambda: self._head(study, going))
        self.plot.show((study, self.figure), lambda: self._plot(study))
        self.table.show((study, tuple(self.chosen)), lambda: self._table(study))

    def _head(self, study: Study, going: int) -> None:
        Words("h2", study.name)
        done = study.size - going
        Words("span", f"{done} of {study.size}" if going else "all ended", "chip running" if going else "chip done").props(
            "role=status"
        )
        link(f"/api/studies/{study.id}/table", "Table (CSV)", "button").props("download")
        if not self.desk.may(Action.PLAN) or not (study.owner == self.desk.principal.user or self.desk.principal.sees_all):
            return
        if going:
            button("Cancel the rest", lambda: self._guarded(self._cancel, study), "danger")
        button("Delete", lambda: self._guarded(self._delete, study), "quiet").props["title"] = "The study; its jobs stay"

    async def _guarded(self, act: Callable[[Study], Any], study: Study) -> None:
        await self.desk.guarded(act(study), self.place)

    async def _cancel(self, study: Study) -> None:
        self.show(await self.of.cancel(study.id))

    async def _delete(self, study: Study) -> None:
        await self.of.delete(study.id)
        self.desk.study = None
        self.desk.show("compare", "instead")
        await self.refresh()
        with self.place:
            say(f"The study {study.name} is deleted; its jobs are under Plan.", good=True)

    def _plot(self, study: Study) -> None:
        names = {each: NAMES[each] for each in get_args(Figure)}

        async def turned(figure: str) -> None:
            self.figure = figure
            await self.refresh()

        choice("Figure over the values", names, self.figure, turned)
        ui.html(study_plot(study, self.figure), sanitize=True)  # type: ignore[arg-type]  # one of the offered ones

    def _table(self, study: Study) -> None:
        if len(self.chosen) == 2:
            first, second = self.chosen
            button("Compare the two", lambda: self._compare(first, second), "primary")
        else:
            Words("p", "Mark two rows to compare them.", "soft")
        header = ("", study.key, "", "cost", "duration", "largest margin", "worst error", "took", "")
        with box("scroll"), box(tag="table"):
            with box(tag="thead"), box(tag="tr"):
                for cell in header:
                    Words("th", cell)
            with box(tag="tbody"):
                for member in study.members:
                    self._row(member)

    def _row(self, member: StudyMember) -> None:
        figures = member.figures
        with box(tag="tr"):
            with box(tag="td"):
                if figures.state != "deleted":
                    mark = ui.element("input").props("type=checkbox")
                    mark.props["aria-label"] = f"Compare {written(member.value)}"
                    mark.props["checked"] = figures.job in self.chosen
                    mark.on("change", lambda _event, job=figures.job: self._marked(job))
            Words("td", written(member.value))
            with box(tag="td"):
                Words("span", STATES[figures.state], f"chip {figures.state}").props["title"] = figures.problem
            for cell in cells(figures):
                Words("td", cell, "number")
            with box(tag="td"):
                if figures.state != "deleted":
                    button("Open", lambda job=figures.job: self._job(job), "quiet", label=f"Open {written(member.value)}")

    async def _marked(self, job: str) -> None:
        self.chosen = [each for each in self.chosen if each != job] if job in self.chosen else [*self.chosen, job][-2:]
        await self.refresh()

    async def _job(self, job: str) -> None:
        await self.desk.guarded(self.desk.open(job, "plan"), self.place)


def cells(figures: Figures) -> tuple[str, ...]:
    """Return figures as a table shows them: cost, duration, largest margin, worst error, time that it took."""

    def told(value: float | None, unit: str, scale: float = 1.0, digits: int = 2) -> str:
        return "" if value is None else f"{scale * value:.{digits}f}{unit}"

    return (
        told(figures.cost, "", digits=3),
        told(figures.duration, " s"),
        told(figures.largest_margin, " mm", 1000, 1),
        told(figures.worst_error, " mm", 1000, 1),
        told(figures.seconds, " s", digits=1),
    )


def _whose(study: Study, user: str | None) -> str:
    if user is None:
        return ""
    return (f", {study.owner}'s" if study.owner != user else "") + (f", in {study.project}" if study.project else "")
