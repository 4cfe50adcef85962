"""Stored missions where missions are written: found and opened, saved as versions, with who changed what when."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Any

from nicegui import ui

from ltlplan.service.page.elements import Part, Words, box, button, confirm_deletion, named_field, say, search_field, submitted
from ltlplan.service.page.folding import differing
from ltlplan.service.page.next_steps import focus, nothing_found, offered_steps
from ltlplan.service.people.roles import Action
from ltlplan.service.problems import Conflict, NotFound
from verify.data import LtlplanError

if TYPE_CHECKING:
    from ltlplan.service.page.session_state import Desk
    from ltlplan.service.people_models import MissionVersion, StoredMission

_LISTED = 30
_LOOK = 5.0
"""s between looks at whether what is open is still stored."""
_NONE = "None is stored yet. Write a mission, give it a name below, and save it."
_NOT_FOUND = "No stored mission has this in its name, tags or text."


class Stored:
    """The stored missions of who has a page open.

    Args:
        desk: What the person has open.
        text: Returns what is written at the moment.
        opened: Shows a text as another draft.
    """

    def __init__(self, desk: Desk, text: Callable[[], str], opened: Callable[[str], Awaitable[None]]) -> None:
        self._desk, self._text, self._opened = desk, text, opened
        self._missions = desk.service.people.missions
        self.current: StoredMission | None = None
        self._name, self._wanted = "", ""
        self._timer = ui.timer(_LOOK, self._look, active=False)

    def draw_list(self) -> None:
        """Draw what opens a stored mission."""
        with box(tag="details") as details:
            Words("summary", "Stored")
            with box("drop"):
                self._searched = search_field("Search stored missions", self._search)
                self._list = Part(box())
        details.on(
            "toggle", lambda _event: self._guarded(self.refresh()), js_handler="(event) => { if (event.target.open) emit(); }"
        )

    def draw_saving(self) -> None:
        """Draw what saves a version."""
        self._place = box("saving", tag="form")
        with self._place:
            with box(tag="label"):
                Words("span", "stored as")
                self._field = (
                    ui.element("input").props('maxlength=60 autocomplete=off placeholder="a name"').classes("stored-name")
                )
                self._field.on("input", self._typed, js_handler="(event) => emit(event.target.value)")
            if self._desk.may(Action.PLAN):
                button("Save", lambda: None, "quiet").props("type=submit")
            self._history_button = button("History", self._history, "quiet")
            self._history_button.set_visibility(False)
            self._said = Words("span", "", "soft").props("role=status")
        submitted(self._place, self._save)

    def close(self) -> None:
        """Look at no stored mission any more: another text is written."""
        self._set(None)

    def _typed(self, event: Any) -> None:  # of any type: NiceGUI's events carry what the browser sends
        self._name = str(event.args).strip()

    async def _search(self, wanted: str) -> None:
        self._wanted = wanted
        await self._guarded(self.refresh())

    async def refresh(self) -> None:
        """List the stored missions again."""
        found = await asyncio.to_thread(lambda: self._missions.listed(self._desk.principal, search=self._wanted))
        self._list.show((self._wanted, found), lambda: self._draw(found))

    def _draw(self, found: tuple[StoredMission, ...]) -> None:
        if not found and self._wanted:
            nothing_found(self._searched, _NOT_FOUND, self._search)
        elif not found:
            offered_steps(_NONE, {"Name this one": lambda: focus(self._field)} if self._desk.may(Action.PLAN) else {})
        with box(tag="ul"):
            for each in found[:_LISTED]:
                with (
                    box(tag="li"),
                    button("", lambda each=each: self._guarded(self._open(each)), "quiet", label=f"Open {each.name}"),
                ):
                    Words("b", each.name)
                    Words("small", f" version {each.version} by {each.by}, {_when(each.changed)}{_where(each)}", "soft")
        if len(found) > _LISTED:
            Words("p", f"The newest {_LISTED} of {len(found)}; search finds the others.", "soft")

    async def _open(self, mission: StoredMission, number: int | None = None) -> None:
        found = await asyncio.to_thread(self._missions.version, self._desk.principal, mission.id, number or mission.version)
        await self._opened(found.text)
        self._set(mission)

    def _set(self, mission: StoredMission | None) -> None:
        self.current, self._name = mission, "" if mission is None else mission.name
        self._desk.client.run_javascript(f"getHtmlElement({self._field.id}).value = {json.dumps(self._name)}")
        self._history_button.set_visibility(mission is not None)
        self._timer.activate() if mission is not None else self._timer.deactivate()
        self._said.set_text("" if mission is None else f"version {mission.version} by {mission.by}{_where(mission)}")

    async def _look(self) -> None:
        """Say where the mission that is open is no longer stored, or no longer shared; what is written stays."""
        mission = self.current
        if mission is None:
            return
        try:
            await asyncio.to_thread(self._missions.get, self._desk.principal, mission.id)
        except NotFound:
            if mission == self.current:
                self._let_go()

    def _let_go(self) -> None:
        """Look at a stored mission no more that is gone, and keep its name."""
        name = self._name
        self._set(None)
        self._name = name
        self._desk.client.run_javascript(f"getHtmlElement({self._field.id}).value = {json.dumps(name)}")
        self._said.set_text("It is no longer stored, or no longer shared with you; Save stores what is written as your own.")

    async def _save(self, _event: object = None) -> None:
        await self._guarded(self._saved())

    async def _saved(self) -> None:
        text, who, mission, name = self._text(), self._desk.principal, self.current, self._name
        try:
            if mission is not None and name == mission.name:
                made = await asyncio.to_thread(lambda: self._missions.save(who, mission.id, text, after=mission.version))
            else:
                made = await asyncio.to_thread(lambda: self._missions.store(who, name, text))
        except NotFound:
            self._let_go()
            return
        except Conflict as error:
            present = await asyncio.to_thread(lambda: self._present(name))
            if present is not None:
                self._set(present)
                raise Conflict(
                    f"{error} Look at the History; Save once more puts yours after version {present.version}."
                ) from None
            raise
        self._set(made)
        await self.refresh()

    def _present(self, name: str) -> StoredMission | None:
        """Return the stored mission that a save was about, as it is now."""
        if self.current is not None and name == self.current.name:
            return self._missions.get(self._desk.principal, self.current.id)
        own = self._missions.listed(self._desk.principal, search=name)
        return next((each for each in own if each.name == name and each.owner == self._desk.principal.user), None)

    async def _history(self) -> None:
        await self._guarded(self._show_history())

    async def _show_history(self) -> None:
        if self.current is None:
            return
        mission = await asyncio.to_thread(self._missions.get, self._desk.principal, self.current.id)
        versions = await asyncio.to_thread(self._missions.versions, self._desk.principal, mission.id)
        with self._place, ui.dialog() as dialog, box("dialog history"):
            Words("h2", mission.name)
            if self._desk.may(Action.PLAN) and (mission.owner == self._desk.principal.user or self._desk.principal.sees_all):
                self._about(mission, dialog)
            changes = Part(box("changes"))
            with box("scroll"), box(tag="table"), box(tag="tbody"):
                for each in versions:
                    with box(tag="tr"):
                        self._version(mission, each, dialog, changes)
            with box("row"):
                button("Close", dialog.close)
        dialog.open()

    def _version(self, mission: StoredMission, version: MissionVersion, dialog: ui.dialog, changes: Part) -> None:
        Words("td", f"version {version.number}")
        Words("td", version.user)
        Words("td", _when(version.made), "soft")

        async def opened() -> None:
            dialog.close()
            await self._guarded(self._open(mission, version.number))

        async def planned() -> None:
            dialog.close()
            await self._guarded(self._plan(mission, version.number))

        async def shown() -> None:
            told = await asyncio.to_thread(
                self._missions.difference, self._desk.principal, mission.id, version.number - 1, version.number
            )
            changes.show(told, lambda: differing(told))

        with box(tag="td"), box("row"):
            label = f"version {version.number}"
            button("Changes", lambda: self._guarded(shown()), "quiet", label=f"Changes of {label}")
            button("Open", opened, "quiet", label=f"Open {label}")
            if self._desk.may(Action.PLAN):
                button("Plan", planned, "quiet", label=f"Plan {label}")

    def _about(self, mission: StoredMission, dialog: ui.dialog) -> None:
        """Show the mission's project and tags, and let them be others."""

        async def moved(project: str) -> None:
            who = self._desk.principal
            self._set(await asyncio.to_thread(lambda: self._missions.change(who, mission.id, project=project)))

        async def tagged(tags: str) -> None:
            who = self._desk.principal
            self._set(await asyncio.to_thread(lambda: self._missions.change(who, mission.id, tags=tuple(tags.split()))))

        async def deleted() -> None:
            if not await confirm_deletion(
                f"Delete {mission.name} with all its {mission.version} versions? This cannot be undone."
            ):
                return
            dialog.close()
            await asyncio.to_thread(self._missions.delete, self._desk.principal, mission.id)
            self._set(None)
            await self.refresh()

        with box("row"):
            named_field("Project", mission.project, lambda project: self._guarded(moved(project)))
            named_field("Tags", " ".join(mission.tags), lambda tags: self._guarded(tagged(tags)))
            button("Delete", lambda: self._guarded(deleted()), "quiet danger")

    async def _plan(self, mission: StoredMission, number: int) -> None:
        job = await self._desk.service.plan_stored(self._desk.principal, mission.id, number)
        await self._desk.open(job.id, "plan")

    async def _guarded(self, work: Awaitable[None]) -> None:
        try:
            await work
        except LtlplanError as error:
            with self._place:
                say(error)


def _where(mission: StoredMission) -> str:
    return (f", in {mission.project}" if mission.project else "") + "".join(f" #{tag}" for tag in mission.tags)


def _when(time: str) -> str:
    return f"{time[:16].replace('T', ' ')} UTC"
