"""The page's own elements: an editor that knows faults and names, a mission's world, a flight that plays.

They are small Vue components over what NiceGUI brings in its wheel (CodeMirror, three.js); nothing is fetched from elsewhere.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import nicegui
from nicegui.element import Element
from nicegui.events import GenericEventArguments

Json = dict[str, Any]  # of any type: JSON nests
Told = Callable[[str], Awaitable[None]]

_WHEEL = nicegui.__path__[0] + "/elements"


class Editor(Element, component="assets/editor.js", esm={"nicegui-codemirror": f"{_WHEEL}/codemirror/dist"}):  # pyright: ignore[reportGeneralTypeIssues]  # NiceGUI's own way to name a component
    """A text that is written with help.

    Args:
        label: What is written, for those who cannot see it.
        language: CodeMirror's name of the text's language, if any.
        single: Whether it is one line.
        hint: Shown while it is empty.
        on_text: Receives the text a quarter of a second after a change.
        on_submit: Called on Ctrl-Enter.
    """

    def __init__(
        self,
        label: str,
        *,
        language: str | None = None,
        single: bool = False,
        hint: str = "",
        on_text: Told,
        on_submit: Callable[[], Awaitable[None]] | None = None,
    ) -> None:
        super().__init__()
        self._props.update({"label": label, "language": language, "single": single, "hint": hint, "value": "", "faults": []})
        self.text = ""
        self.draft = ""

        async def told(event: GenericEventArguments) -> None:
            self.text = str(event.args)
            self._props["value"] = self.text
            await on_text(self.text)

        self.on("text", told)
        if on_submit is not None:
            self.on("submit", lambda _event: on_submit())

    def drafts(self, owner: str, written: Callable[[GenericEventArguments], Awaitable[None]]) -> None:
        """Keep what is written in the browser, under the id `draft`.

        Args:
            owner: Whose it is; others who use this browser have drafts of their own.
            written: Told `draft`, `text` and `changed` (ms since 1970) a quarter of a second after a change.
        """
        self._props["owner"] = owner
        self.on("written", written)

    @property
    def draft(self) -> str:
        """The id under which what is written is kept; empty where it is not."""
        return self._props["draft"]

    @draft.setter
    def draft(self, draft: str) -> None:
        self._props["draft"] = draft
        self.update()

    def put(self, text: str, *, own: bool = True) -> None:
        """Show another text.

        Args:
            text: The text.
            own: Whether it is this person's, and to be kept like what they write.
        """
        self.text = text
        self._props["value"], self._props["own"] = text, own
        self.update()

    def underline(self, faults: list[Json]) -> None:
        """Underline faults, each with `from`, `to` and `message`."""
        self._props["faults"] = faults
        self.update()

    def complete(self, names: Json, operators: Json) -> None:
        """Offer names and operators, each with what it is."""
        self._props["names"], self._props["operators"] = names, operators
        self.update()

    def reveal(self, offset: int) -> None:
        """Put the cursor at an offset and bring it into view."""
        self.run_method("reveal", offset)


class World(
    Element,
    component="assets/world.js",
    dependencies=["assets/ltlplan_scene.js", "assets/scene_shapes.js", "assets/scene_view.js", "../../report/scene_names.js"],
    esm={"nicegui-scene": f"{_WHEEL}/scene/dist"},
):
    """A mission's world before anything is planned.

    Args:
        label: What is seen, for those who cannot see it.
    """

    def __init__(self, label: str) -> None:
        super().__init__()
        self._props["label"] = label

    def put(self, figure: Json) -> None:
        """Show another world.

        Args:
            figure: `traces` and `layout`, and the names of the `robots` that are the last traces.
        """
        self._props["figure"] = figure
        self.update()


class Flight(Element, component="assets/flight.js"):
    """A flight that plays, with what is claimed of it."""

    def show(self, url: str | None) -> None:
        """Show a flight.

        Args:
            url: Where its `watch.json` is; None shows none.
        """
        if self._props.get("url") != (url or ""):
            self._props["url"] = url or ""
            self._props["verdict"] = None
            self.update()

    def look(self, view: str) -> None:
        """Show it to be watched ("watch"), trusted ("trust") or checked ("judge")."""
        self._props["view"] = view
        self.update()

    def judge(self, verdict: Json | None) -> None:
        """Show what a recording says of the flight: `sentence`, `claims`, `assumptions`, `flown`."""
        self._props["verdict"] = verdict
        self.update()


class LiveView(Element, component="assets/live_view.js", dependencies=["assets/ltlplan_feed.js"]):
    """A flight in the air as it is seen, or one that is replayed."""

    def look(self, flight: str | None, replay: str | None, *, drags: bool) -> None:
        """Look at a flight.

        Args:
            flight: What it listens as; None for none.
            replay: Where its recording is; None shows it live.
            drags: Whether regions and obstacles can be dragged.
        """
        asked = {"flight": flight or "", "replay": replay or "", "drags": drags}
        if any(self._props.get(name) != value for name, value in asked.items()):
            self._props.update(asked)
            self.update()


class StopBar(Element, component="assets/stop_bar.js", dependencies=["assets/ltlplan_feed.js"]):
    """The stop button of each flight in the air."""
