"""The page's own elements: an editor that knows faults and names, a mission's world, a flight that plays.

They are small Vue components over what NiceGUI brings in its wheel (CodeMirror, three.js); nothing is fetched from elsewhere.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from typing import Any

import nicegui
from nicegui import ui
from nicegui.element import Element
from nicegui.elements.mixins.text_element import TextElement
from nicegui.events import GenericEventArguments
from nicegui.helpers import should_await

Json = dict[str, Any]  # of any type: JSON nests
Told = Callable[[str], Awaitable[None]]

_HERE = """(event) => {
  if (event.ctrlKey || event.metaKey || event.shiftKey || event.altKey) return;
  event.preventDefault();
  emit();
}"""
"""A click that asks for no other tab or window is for this one."""
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


class Words(TextElement):
    """An element that holds text and nothing else: whatever stands in it is never read as markup.

    Args:
        tag: Of HTML.
        content: The text.
        classes: Of CSS.
    """

    def __init__(self, tag: str, content: str, classes: str = "") -> None:
        super().__init__(tag=tag, text=content)
        self.classes(classes)


class Part:
    """A place that is drawn anew only when it has something else to show.

    A browser says which element was clicked, and elements that are drawn anew are others: a click on its way would be lost.

    Args:
        place: What it is drawn into.
    """

    def __init__(self, place: Element) -> None:
        self.place = place
        self._shown: object = self  # like nothing that is shown

    def show(self, what: object, draw: Callable[[], object]) -> None:
        """Draw it, unless it shows the same already.

        Args:
            what: What is shown; two that are equal look the same.
            draw: Makes the elements.
        """
        if what == self._shown:
            return
        self._shown = what
        self.place.clear()
        with self.place:
            draw()


def box(classes: str = "", *, tag: str = "div") -> Element:
    """Return an element to put others into.

    Args:
        classes: Of CSS.
        tag: Of HTML.
    """
    return ui.element(tag).classes(classes)


def button(content: str, act: Callable[[], object], classes: str = "", *, label: str | None = None) -> Words:
    """Return a button.

    Args:
        content: What stands on it.
        act: Called on a click; may return something to wait for, until which further clicks do nothing.
        classes: Of CSS.
        label: What it does, where its words do not say so.
    """
    made = Words("button", content, classes).props("type=button")
    if label is not None:
        made.props["aria-label"] = label  # called, it would read the words as a list of properties
    made.on("click", one_at_a_time(lambda _event: act()))
    return made


def submitted(form: Element, act: Callable[[Any], object], value: str = "") -> None:
    """Have a form sent to the page alone.

    Args:
        form: The form.
        act: Called with the event; may return something to wait for, until which the form is not sent again.
        value: JavaScript of what is sent with it, out of `event`.
    """
    form.on("submit", one_at_a_time(act), js_handler=f"(event) => {{ event.preventDefault(); emit({value}); }}")


def one_at_a_time(act: Callable[[Any], object]) -> Callable[[Any], Awaitable[None]]:
    """Return a function of an event that does nothing while what it did before is not over.

    Args:
        act: Called with the event; may return something to wait for.
    """
    going = False

    async def called(event: Any) -> None:  # of any type: NiceGUI's events carry what the browser sends
        nonlocal going
        if going:
            return
        going = True
        try:
            result = act(event)
            if should_await(result):
                await result
        finally:
            going = False

    return called


def search_field(label: str, search: Callable[[str], Awaitable[None]]) -> Element:
    """Return a field to search in.

    Args:
        label: What is searched, for those who cannot see it.
        search: Called with what is wanted, a moment after it was typed.
    """
    made = ui.element("input").props("type=search placeholder=search").classes("search")
    made.props["aria-label"] = label
    typed = "(event) => emit(event.target.value)"
    made.on("input", lambda event: search(str(event.args).strip()), js_handler=typed, throttle=0.3, leading_events=False)
    return made


def named_field(label: str, value: str, changed: Callable[[str], Awaitable[None]], *, hint: str = "") -> Element:
    """Return a field for a short text, with its label.

    It begins with a value and then belongs to who types: a `value` would be put back whenever anything on the page changes.

    Args:
        label: What is entered.
        value: Its beginning.
        changed: Called with the text once it was entered.
        hint: Shown while it is empty.
    """
    with box(tag="label") as place:
        Words("span", f"{label} ", "soft")
        made = ui.element("input").props("maxlength=200 autocomplete=off")
        made.props["defaultValue"], made.props["placeholder"] = value, hint
    made.on("change", lambda event: changed(str(event.args).strip()), js_handler="(event) => emit(event.target.value)")
    return place


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> Element:
    """Return a table of text.

    Args:
        header: Words over the columns.
        rows: Cells.
    """
    with box("scroll").props("tabindex=0") as place, box(tag="table"):
        with box(tag="thead"), box(tag="tr"):
            for cell in header:
                Words("th", cell)
        with box(tag="tbody"):
            for row in rows:
                with box(tag="tr"):
                    for cell in row:
                        Words("td", cell)
    return place


def choice(label: str, options: Mapping[str, str], chosen: str, act: Callable[[str], object]) -> Element:
    """Return a choice of one of several.

    Args:
        label: What is chosen.
        options: In words, by what the choice is told as.
        chosen: The one that is chosen at first.
        act: Receives another one; may return something to wait for.
    """
    with box("choice", tag="label") as place:
        Words("span", f"{label} ", "soft")
        with ui.element("select") as made:
            for value, words in options.items():
                option = Words("option", words)
                option.props["value"], option.props["selected"] = value, value == chosen
    made.on("change", lambda event: act(str(event.args)), js_handler="(event) => emit(event.target.value)")
    return place


def link(address: str, content: str, classes: str = "") -> Words:
    """Return a link.

    Args:
        address: Where it leads.
        content: What stands on it.
        classes: Of CSS.
    """
    made = Words("a", content, classes)
    made.props["href"] = address  # called, it would read an address as a list of properties
    return made


def view_link(address: str, content: str, act: Callable[[], object], classes: str = "") -> Words:
    """Return a link to another view of this page: it is shown here on a click, and elsewhere as any other link.

    Args:
        address: Of the view.
        content: What stands on it.
        act: Shows the view here; may return something to wait for.
        classes: Of CSS.
    """
    made = link(address, content, classes)
    made.on("click", one_at_a_time(lambda _event: act()), js_handler=_HERE)
    return made


def progress_bar(share: float) -> Element:
    """Return a bar of work that is going on.

    Args:
        share: How much of it is done, 0 to 1.
    """
    return ui.element("progress").classes("going").props(f'max=1 value={share:.3f} aria-label="How much is done"')


def running_clock(seconds: float) -> Words:
    """Return how long something has run; the browser counts on.

    Args:
        seconds: How long at this moment.
    """
    return Words("span", "").props(f"data-ran={max(seconds, 0):.1f}")


async def confirm_deletion(question: str) -> bool:
    """Ask before something is deleted, and return whether it is.

    Args:
        question: What would be gone.
    """
    with ui.dialog() as dialog, box("dialog"):
        Words("p", question)
        with box("row"):
            button("Delete it", lambda: dialog.submit(True), "danger")
            button("Keep it", lambda: dialog.submit(False))
    return bool(await dialog)


def say(problem: Exception | str, *, good: bool = False, stays: bool = False) -> None:
    """Tell a person something: an error in the words of the command line, or that something is done.

    Args:
        problem: What is told.
        good: Whether it is no error.
        stays: Whether it is there until it is closed; else it passes.
    """
    kind = "positive" if good else "negative"
    ui.notify(str(problem), type=kind, multi_line=True, close_button="close", timeout=0 if stays else 6000)
