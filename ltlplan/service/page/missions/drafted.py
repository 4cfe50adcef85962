"""Drafts that are not lost: each text in the browser from key to key, and at the service too for those who logged in.

A draft has an id. Its text follows the editor until another mission is loaded: that begins a draft of its own, so that nothing is written over.
"""

from __future__ import annotations

import asyncio
import logging
import re
import uuid
from collections.abc import Awaitable, Callable
from contextlib import suppress
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from ltlplan.service.log import note
from ltlplan.service.page.components import Editor
from ltlplan.service.page.elements import Part, Words, box, button
from ltlplan.service.storage.drafts import OF_JOB, Draft
from verify.data import BadInput

if TYPE_CHECKING:
    from nicegui.events import GenericEventArguments

    from ltlplan.service.page.session_state import Desk

_LISTED = 12
_PATIENCE = 10.0
"""s that the browser may take to say what it has."""
_NAME = re.compile(r"^name:[ \t]*(.{1,60})", re.MULTILINE)


class Drafted:
    """The drafts of who has a page open.

    Args:
        desk: What the person has open.
        editor: Where they write; it keeps what is written in the browser.
        shown: Shows a draft's text.
    """

    def __init__(self, desk: Desk, editor: Editor, shown: Callable[[str], Awaitable[None]]) -> None:
        self._desk, self._editor, self._shown = desk, editor, shown
        self._known: dict[str, tuple[float, str]] = {}
        self._part = Part(box())
        editor.drafts(desk.user or "", self._written)
        self.begin()

    def begin(self) -> None:
        """Begin another draft; the one before stays as it is."""
        self._editor.draft = uuid.uuid4().hex[:16]
        self._list()

    async def restore(self) -> tuple[str | None, bool]:
        """Return what was written here last, to go on with; None where nothing was.

        Returns:
            The text, and whether it is this person's own; what was only looked at is not.
        """
        told = await self._merge()
        here, busy = told.get("here"), frozenset(told.get("busy", ()))
        free = {draft: known for draft, known in self._known.items() if draft not in busy and not draft.startswith(OF_JOB)}
        if here in free:
            return await self._go_on(str(here)), True
        if told.get("shown") is not None:
            self._list()
            return str(told["shown"]), False
        if free:
            return await self._go_on(max(free, key=lambda draft: free[draft][0])), True
        self._list()
        return None, False

    async def text_of(self, job: str) -> str | None:
        """Return the text that a job was made of, as it was written; None where that was elsewhere."""
        return await self._text(OF_JOB + job) if OF_JOB + job in self._known else None

    async def hand_in(self, job: str, text: str) -> None:
        """Keep the text that a job was made of."""
        draft = Draft(text, datetime.now(UTC).timestamp() * 1000)
        self._known[OF_JOB + job] = (draft.changed, _title(text))
        self._editor.run_method("keep", OF_JOB + job, text)
        await self._keep(OF_JOB + job, draft)

    async def _merge(self) -> dict[str, Any]:  # of any type: NiceGUI's events carry what the browser sends
        """Put together what the browser has and what the service has, each draft as it was changed last; return what the browser says."""
        try:
            told: dict[str, Any] = await self._editor.run_method("drafts", timeout=_PATIENCE)
        except TimeoutError:
            told = {}
        user = self._desk.user
        kept = await self._at_service()
        self._known = {draft: (each.changed, _title(each.text)) for draft, each in kept.items()}
        for draft, (changed, title) in told.get("drafts", {}).items():
            if draft not in kept or changed > kept[draft].changed:
                self._known[draft] = (changed, title)
                text = await self._in_browser(draft) if user is not None else None
                if text is not None:
                    await self._keep(draft, Draft(text, changed))
        return told

    async def _go_on(self, draft: str) -> str | None:
        text = await self._text(draft)
        if text is not None:
            self._editor.draft = draft
        self._list()
        return text

    async def _text(self, draft: str) -> str | None:
        kept = await self._at_service()
        return kept[draft].text if draft in kept else await self._in_browser(draft)

    async def _at_service(self) -> dict[str, Draft]:
        """Return what the service has of who logged in; where that cannot be read, the browser's is all there is."""
        if self._desk.user is None:
            return {}
        try:
            return await asyncio.to_thread(self._desk.service.drafts.of, self._desk.user)
        except BadInput as error:
            note("drafts cannot be read", level=logging.WARNING, reason=str(error))
            return {}

    async def _in_browser(self, draft: str) -> str | None:
        try:
            return await self._editor.run_method("draftText", draft, timeout=_PATIENCE)
        except TimeoutError:
            return None

    async def _written(self, event: GenericEventArguments) -> None:
        """Note what the browser has kept, and keep it for who logged in."""
        draft, text, changed = str(event.args["draft"]), str(event.args["text"]), float(event.args["changed"])
        self._known[draft] = (changed, _title(text))
        self._list()
        await self._keep(draft, Draft(text, changed))

    async def _keep(self, draft: str, kept: Draft) -> None:
        """Keep a draft at the service, for who logged in; where that cannot be, it is in the browser."""
        if self._desk.user is None:
            return
        with suppress(BadInput):
            await asyncio.to_thread(self._desk.service.drafts.keep, self._desk.user, draft, kept)

    def _list(self) -> None:
        """List the drafts that are not open, the newest first."""
        others = sorted(
            (
                (changed, draft, title)
                for draft, (changed, title) in self._known.items()
                if draft != self._editor.draft and not draft.startswith(OF_JOB)
            ),
            reverse=True,
        )[:_LISTED]
        self._part.show(others, lambda: self._draw(others) if others else None)

    def _draw(self, others: list[tuple[float, str, str]]) -> None:
        with box(tag="details"):
            Words("summary", f"Drafts ({len(others)})")
            with box("drop"), box(tag="ul"):
                for changed, draft, title in others:
                    with box(tag="li"):
                        button(f"{title}, {_when(changed)}", lambda draft=draft: self._open(draft), "quiet")

    async def _open(self, draft: str) -> None:
        text = await self._go_on(draft)
        if text is not None:
            await self._shown(text)


def _title(text: str) -> str:
    """Return what a draft is called: its mission's name, or how it begins."""
    found = _NAME.search(text)
    return (found[1] if found is not None else text.strip()[:40]).strip() or "without a name"


def _when(changed: float) -> str:
    return datetime.fromtimestamp(changed / 1000, UTC).strftime("%Y-%m-%d %H:%M UTC")
