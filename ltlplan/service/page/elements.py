"""Words, buttons, fields, tables, links and messages that the page is made of, over NiceGUI."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from typing import Any

from nicegui import ui
from nicegui.element import Element
from nicegui.elements.mixins.text_element import TextElement
from nicegui.helpers import should_await

_HERE = """(event) => {
  if (event.ctrlKey || event.metaKey || event.shiftKey || event.altKey) return;
  event.preventDefault();
  emit();
}"""
"""A click that asks for no other tab or window is for this one."""


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
    seconds = 0 if stays else 6
    ui.notify(str(problem), type=kind, position="top", multi_line=True, close_button="Close", timeout=1000 * seconds)
