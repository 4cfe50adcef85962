"""The second tab: jobs, and of one of them its stages as they go, with what each found."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from datetime import datetime
from typing import TYPE_CHECKING, Any

from nicegui import ui

from ltlplan.service.page.elements import (
    Part,
    Words,
    box,
    button,
    confirm_deletion,
    named_field,
    progress_bar,
    running_clock,
    say,
    search_field,
    table,
    view_link,
)
from ltlplan.service.page.next_steps import next_steps, nothing_found
from ltlplan.service.people.roles import Action
from ltlplan.service.storage.retention import kept_until
from ltlplan.service.times import utc_now

if TYPE_CHECKING:
    from ltlplan.service.models import Job, Stage
    from ltlplan.service.page.session_state import Desk

Found = Mapping[str, Any]  # of any type: what stages found is JSON

_STATES = {"queued": "waits", "running": "runs", "done": "done", "failed": "refused", "cancelled": "cancelled"}
_REFRESH = 3.0
"""s between looks at the list while it is seen."""
_MOST = 60
"""Jobs that are listed at first, and that are added to them at a time."""
_GONE = " and all its files? This cannot be undone."
_KEPT = "? Others who have it keep it; if nobody has, its files are gone for good."
_REFUSALS = 6
"""Refused claims of a round that are written out."""


class _Planning:
    """The tab while it is used."""

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        with box("planning"):
            with box("jobs", tag="section").props('aria-label="Jobs"'):
                Words("h2", "Jobs")
                self.field = search_field("Search jobs by name, formula, id, owner or project", self._search)
                self.list = box("job-list", tag="ul")
                self.more = button("Show more", self._show_more, "quiet")
            with box("job", tag="section").props('aria-label="The job"'):
                with box("head"):
                    self.name, self.actions = Part(box("name")), Part(box("actions"))
                self.early = Part(box("early"))
                self.told, self.stages = Part(box("told")), Part(box("stages", tag="ol"))
                self.problem = Part(box("problem").props("role=alert"))
        self.listed: dict[str, _Entry] = {}
        self.wanted, self.most = "", _MOST
        self.none = Part(self.list)
        self.bar: ui.element | None = None
        self.sentence: Words | None = None
        desk.on_job.append(self.show)
        desk.on_progress.append(self.progress)
        desk.on_tab.append(lambda tab: self.timer.activate() if tab == "plan" else self.timer.deactivate())
        self.timer = ui.timer(_REFRESH, self.refresh, active=False)

    async def refresh(self) -> None:
        """List the jobs again where something changed."""
        jobs = await self.desk.jobs.jobs(limit=self.most + 1, search=self.wanted)
        self.more.set_visibility(len(jobs) > self.most)
        jobs = jobs[: self.most]
        chosen = "" if self.desk.job is None else self.desk.job.id
        present = {job.id for job in jobs}
        for gone in [job for job in self.listed if job not in present]:
            self.listed.pop(gone).place.delete()
        if not self.listed:
            self.none.show(bool(jobs) or self.wanted, lambda: None if jobs else self._none())
        for index, job in enumerate(jobs):
            entry = self.listed.get(job.id)
            if entry is None:
                with self.list:
                    entry = self.listed[job.id] = _Entry(job, self.desk.user, self._open)
                entry.place.move(target_index=index)
            entry.show(job, job.id == chosen)

    def _none(self) -> None:
        with box(tag="li"):
            if self.wanted:
                nothing_found(self.field, "No job has this in its name, formula, id, owner or project.", self._search)
            else:
                next_steps(self.desk, "None yet: write a mission and plan it.", ("write",))

    async def _search(self, wanted: str) -> None:
        self.wanted, self.most = wanted, _MOST
        await self.refresh()

    async def _show_more(self) -> None:
        self.most += _MOST
        await self.refresh()

    async def _open(self, job_id: str) -> None:
        await self.desk.guarded(self.desk.open(job_id, "plan"), self.list)

    def progress(self, sentence: str, share: float) -> None:
        """Show what is being done at the moment."""
        if self.bar is not None and self.sentence is not None:
            self.bar.props(f"value={share:.3f}")
            self.sentence.set_text(f"{sentence} ...")

    def show(self, job: Job | None) -> None:
        """Show a job as far as it has come."""
        self.timer.activate()
        self.problem.place.set_visibility(job is not None and job.problem is not None)
        if job is None:
            self.bar = self.sentence = None
            self.name.show(None, lambda: next_steps(self.desk, "Choose a job beside this, or write a mission.", ("write",)))
            for part in (self.actions, self.early, self.told, self.stages, self.problem):
                part.show(None, lambda: None)
            return
        ended = None if job.ended is None else job.state
        if (entry := self.listed.get(job.id)) is not None:
            entry.show(job, True)  # not only at the next look at the list
        self.name.show((job.mission, job.state), lambda: _name(job))
        self.early.show((job.id, job.searches, job.owner), lambda: self._early(job))
        self.actions.show((job.id, ended, job.owner, job.project), lambda: self._actions(job))
        self.told.show((job.id, job.state, job.started, job.ended, job.stopped, job.project), lambda: self._told(job))
        self.stages.show(job.stages, lambda: [_stage(stage) for stage in job.stages])
        self.problem.show((job.id, job.problem, job.state), lambda: self._problem(job))

    def _actions(self, job: Job) -> None:
        mine = self.desk.may(Action.PLAN) and self.desk.jobs.owns(job)
        if job.ended is None and mine:
            button("Cancel", lambda: self.desk.guarded(self._cancel(job), self.actions.place), "danger")
        elif job.state == "done":
            button("Watch it", lambda: self.desk.show("watch"), "primary")
        if job.ended is not None:
            button("Compare", lambda: self.desk.show("compare"), label="Compare with another result")
        button("Edit and plan again", lambda: self.desk.guarded(self._edit(job), self.actions.place))
        if mine and (job.ended is not None or self.desk.user is not None):
            button("Delete", lambda: self.desk.guarded(self._delete(job), self.actions.place), "quiet")
        if mine and job.owner == self.desk.user:
            self._project(job)

    def _project(self, job: Job) -> None:
        """Show the job's project, and let it be another; projects are shared under People."""
        place = self.actions.place
        named_field(
            "Project", job.project, lambda project: self.desk.guarded(self._move(job, project), place), hint="none"
        ).classes("project")

    async def _move(self, job: Job, project: str) -> None:
        await self.desk.jobs.move(job.id, project)
        await self.desk.open(job.id, "plan")
        await self.refresh()
        with self.actions.place:
            say(f"It is in the project {project} now." if project else "It is in no project now.", good=True)

    def _told(self, job: Job) -> None:
        self.bar = self.sentence = None
        Words("code", job.title, "asked")
        times = [f"seed {job.seed}", f"handed in {_clock(job.submitted)}{_whose(job, self.desk.user)}"]
        if job.started and job.ended:
            times.append(f"took {_seconds(job.started, job.ended)}")
        Words("p", ", ".join(times), "soft")
        if (until := kept_until(job, self.desk.service.settings.limits)) is not None:
            Words("p", f"Kept until {until}, unless a project or a study has it.", "soft")
        if job.stopped:
            Words(
                "p",
                "Its search was stopped at the best plan so far; plan the mission again to have it searched to the end.",
                "soft",
            )
        if job.ended is None:
            self.bar = progress_bar(job.share)
            waits = "waits for a free worker" if job.state == "queued" else job.sentence or "working"
            self.sentence = Words("p", f"{waits} ...", "sentence")
            self._running(job)

    def _running(self, job: Job) -> None:
        """Show how long a job has run, and what its stages may take at most."""
        limits = self.desk.service.settings.limits
        with box("soft running-time", tag="p"):
            if job.started is not None:
                Words("span", "Has run for ")
                running_clock(_between(job.started, utc_now()))
                Words("span", ". ")
            most = f"{_lasting(limits.stage_seconds)} of processor time and {limits.stage_megabytes} MB"
            Words("span", f"A stage may take {most}.")

    def _problem(self, job: Job) -> None:
        if job.problem is None:
            return
        Words("h3", job.problem.title)
        Words("pre", job.problem.detail, "words-of-command")
        if job.state == "failed":
            button("What would mend it", lambda: self.desk.show("trust"), "primary")

    async def _edit(self, job: Job) -> None:
        await self.desk.edit(await self.desk.text_of(job))

    async def _cancel(self, job: Job) -> None:
        await self.desk.jobs.cancel(job.id)
        await self.desk.open(job.id, "plan")

    def _early(self, job: Job) -> None:
        if job.searches and self.desk.may(Action.PLAN) and self.desk.jobs.owns(job):
            button("Take the best plan so far", lambda: self.desk.guarded(self._stop_search(job), self.early.place))

    async def _stop_search(self, job: Job) -> None:
        await self.desk.jobs.stop_search(job.id)
        with self.early.place:
            say("The search ends with the best plan so far, which is refined and certified.", good=True)

    async def _delete(self, job: Job) -> None:
        if not await confirm_deletion(f"Delete the job of {job.mission}{_KEPT if self.desk.user is not None else _GONE}"):
            return
        await self.desk.jobs.delete(job.id)
        self.desk.leave_job()
        self.desk.show("plan", "instead")
        await self.refresh()
        with self.actions.place:
            say(f"The job of {job.mission} is deleted.", good=True)


class _Entry:
    """One job in the list."""

    def __init__(self, job: Job, user: str | None, opened: Callable[[str], Awaitable[None]]) -> None:
        self.user, self.place = user, box(tag="li")
        with self.place:
            self.button = view_link(f"/jobs/{job.id}/plan", "", lambda: opened(job.id))
            with self.button:
                Words("b", job.mission)
                self.chip = Words("span", "")
                Words("small", f"{job.title}", "title")
                self.when = Words("small", "", "soft")

    def show(self, job: Job, chosen: bool) -> None:
        """Show how far it has come, whose it is, and whether it is looked at."""
        self.button.classes(replace=f"entry {job.state}").props(f"aria-current={'true' if chosen else 'false'}")
        self.chip.classes(replace=f"chip {job.state}").set_text(_STATES[job.state])
        self.when.set_text(f"{_clock(job.submitted)}, seed {job.seed}{_whose(job, self.user)}")


def _whose(job: Job, user: str | None) -> str:
    """Return whose job it is, where it is another's, and its project."""
    if user is None:
        return ""
    return (f", {job.owner}'s" if job.owner not in ("", user) else "") + (f", in {job.project}" if job.project else "")


def _name(job: Job) -> None:
    Words("h2", job.mission)
    Words("span", _STATES[job.state], f"chip {job.state}").props("role=status data-state=" + job.state)


def _stage(stage: Stage) -> None:
    """Show one stage and what it found."""
    with box(f"stage {stage.state}", tag="li").props(f'data-stage="{stage.name}"'):
        with box("line"):
            Words("b", stage.name)
            Words("span", _STATES[stage.state], f"chip {stage.state}")
            if stage.started and stage.ended:
                Words("span", _seconds(stage.started, stage.ended), "soft")
        found = stage.found
        if stage.name == "plan" and "words" in found:
            _plan(found)
        elif stage.name.startswith("round") and "claims" in found:
            _round(found)
        elif stage.name == "flight" and "tracking" in found:
            _flight(found)
        elif stage.name == "files" and "files" in found:
            Words("p", f"{len(found['files'])} files, to be taken away.")
            for sentence in _sentences(stage)[-1:]:
                Words("p", f"{sentence}.")


def proof_of(job: Job) -> tuple[str, ...]:
    """Return what the kernel says of a job's claims, the count of those that it checked last; nothing of a job of an earlier version."""
    return tuple(sentence for stage in job.stages if stage.name == "files" for sentence in _sentences(stage))


def _sentences(stage: Stage) -> tuple[str, ...]:
    return tuple(stage.found.get("proof", {}).get("sentences", ()))


def _plan(found: Found) -> None:
    rows = [(robot, found["visits"].get(robot, ""), word) for robot, word in found["words"].items()]
    table(("robot", "visits", "word"), rows)
    bound = (
        ""
        if found.get("lower_bound") is None
        else (", the cheapest" if found.get("complete") else ", not sure to be the cheapest")
    )
    Words(
        "p",
        f"Cost {found.get('cost_text') or format(found['cost'], '.3f')} by the method {found['method']}{bound if found['method'] == 'exact' else ''}.",
    )
    for note in found["notes"]:
        Words("p", note, "soft")


def _round(found: Found) -> None:
    claims = found["claims"]
    if found.get("certified"):
        largest = found.get("largest_margin")
        more = "" if largest is None else f"; {1000 * largest:.1f} mm would hold too"
        tube = f"; tube {found['tube']}" if "tube" in found else ""  # of no job of an earlier version
        Words(
            "p",
            f"All {len(claims)} claims are proved at a margin of {1000 * found['margin']:g} mm{more}{tube}.",
            "verdict holds",
        )
        for sentence in (*filter(None, [found.get("fitted")]), *found.get("tracking_proved", ()), *found.get("soft", ())):
            Words("p", sentence, "soft")
        return
    refused = [claim for claim in claims if claim["outcome"] != "holds"]
    again = f"{len(refused)} claims are refused; refinement tries again with what they say:"
    Words("p", again if refused else "All claims are proved; refinement tries to keep more soft parts.", "verdict fails")
    with box(tag="ul"):
        for claim in refused[:_REFUSALS]:
            Words("li", f"{claim['name']}: {claim['sentence']}")
        if len(refused) > _REFUSALS:
            Words("li", f"and {len(refused) - _REFUSALS} more", "soft")
    for sentence in found.get("precedences", ()):
        Words("p", f"From now on {sentence}.", "soft")


def _flight(found: Found) -> None:
    rows = [
        (robot, f"{1000 * flown['worst']:.1f} mm", f"{1000 * flown['rms']:.1f} mm")
        for robot, flown in found["tracking"].items()
    ]
    table(("robot", "worst tracking error", "RMS"), rows)
    for sentence in found.get("sentences", ()):
        Words("p", sentence, "soft")


def _clock(time: str) -> str:
    return datetime.fromisoformat(time).strftime("%Y-%m-%d %H:%M:%S UTC")


def _between(start: str, end: str) -> float:
    return (datetime.fromisoformat(end) - datetime.fromisoformat(start)).total_seconds()


def _seconds(start: str, end: str) -> str:
    seconds = _between(start, end)
    return f"{seconds:.1f} s" if seconds < 100 else f"{seconds / 60:.1f} min"


def _lasting(seconds: float) -> str:
    """Return a limit as it is written."""
    return f"{seconds:g} s" if seconds < 120 else f"{seconds / 60:g} min"


async def plan_tab(desk: Desk) -> None:
    """Make the tab.

    Args:
        desk: What the person has open.
    """
    planning = _Planning(desk)
    planning.show(None)
    await planning.refresh()
